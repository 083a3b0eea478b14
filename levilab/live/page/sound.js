// The spin and the drive as sounds: a click a turn, a tone, and the beat of both, which vanishes at the lock.

/** Of this many overtones a sound is made, since a loudspeaker hardly gives 30 Hz: equal ones are a click a turn. */
const CLICK = 40, TONE = 8;
/** How loud each is, and the time in which a frequency changes [s]. */
const LOUD = {spin: 0.3, drive: 0.12}, GLIDE_S = 0.05;

/** Silent until it is played. */
export function openSound() {
  let context = null, voices = {};

  function voice(overtones, fades) {
    const parts = Float32Array.from({length: overtones + 1}, (_, k) => (k === 0 ? 0 : fades ? 1 / k : 1));
    const source = context.createOscillator(), loud = context.createGain();
    source.setPeriodicWave(context.createPeriodicWave(parts, new Float32Array(parts.length)));
    loud.gain.value = 0;
    source.connect(loud).connect(context.destination);
    source.start();
    return {source, loud};
  }

  return {
    /** Begin or end; browsers allow it after a click. */
    play(on) {
      if (on && !context) {
        context = new AudioContext();
        voices = {spin: voice(CLICK, false), drive: voice(TONE, true)};
      }
      if (on) context?.resume();
      else context?.suspend();
    },

    /** Follow the bench: what is not counted, or off, is silent, and so is a bench whose time stands still. */
    follow(bench) {
      if (context?.state !== "running") return;
      const still = !bench || bench.silent || bench.paused;
      const heard = {spin: bench?.last.spin_frequency_hz, drive: bench?.drive?.output && !bench.drive.triggered ? bench.drive.frequency_hz : undefined};
      for (const [name, {source, loud}] of Object.entries(voices)) {
        const is = !still && heard[name] > 0;
        loud.gain.setTargetAtTime(is ? LOUD[name] : 0, context.currentTime, GLIDE_S);
        if (is) source.frequency.setTargetAtTime(heard[name], context.currentTime, GLIDE_S);
      }
    },
  };
}
