// The levitating top in three dimensions, from the poses that the virtual bench publishes.
//
// Poses come in pieces, 400 a second of the bench. The page plays them a little late and turns the top between two of
// them, so that it moves evenly however often messages come. Slower than the bench, it plays what it has kept, and
// goes on from the newest when that is at its end.

import {openStage} from "./top.js";
import {SOFTWARE} from "./plot.js";

/** Poses that are kept: at most 20 s of the bench's time. */
const KEPT = 8000;
/** Least mean time between pictures without a graphics card [ms]: the screen's own times are 17 ms apart. */
const LEAST_MS = SOFTWARE ? 46 : 0;

/** A fall is kept from so long before it to so long after it, played from so long before it [s of bench time], and so much slower. */
const BEFORE_S = 1, AFTER_S = 0.4, LEAD_S = 0.2, REPLAY_RATE = 0.05;
/** Where less motion is wanted, a picture comes after this time [ms]. */
const STILL_MS = 1000;
/** The path of the axis' end is drawn over this time [s of bench time]: some turns of the nutation. */
const TRAIL_S = 1;
/** Pixels without a graphics card, as a part of those that are shown: half would do, but is coarse to look at. */
const SOFTWARE_RATIO = 0.75;

/** @param description of the top and its base, as the server sends it. */
export async function openSpace(canvas, description) {
  const {THREE, OrbitControls} = await import("./three.js");
  let moved = true;
  const stage = openStage(THREE, OrbitControls, canvas, description, {ratio: SOFTWARE_RATIO, changed: () => { moved = true; }});
  canvas.style.touchAction = "pan-y";  // a finger that goes up or down scrolls the page; two come nearer
  canvas.addEventListener("wheel", (event) => {  // so does the wheel, until the picture has the focus
    if (document.documentElement.scrollHeight > innerHeight + 1 && document.activeElement !== canvas) event.stopImmediatePropagation();
  }, {capture: true});
  const shown = {drive: false, path: true, axis: true, spin: true, height: true};
  let parts = description, lean = 1, flashes = null;
  function show(wanted) {
    Object.assign(shown, wanted);
    stage.view.show(shown);
    stage.view.setLean(lean);
    moved = true;
  }

  const [one, two] = [new THREE.Quaternion(), new THREE.Quaternion()];
  const trail = new Float32Array(3 * 2 * KEPT);
  let live = {times: [], places: [], turns: [], ups: []}, fall = null, film = live;  // film: what is shown of them
  let playhead = NaN, last = 0, drawnAt = 0, rate = 1, speed = 1, paused = false, frames = 0;

  function add(start, step, position, quaternion, up) {
    const {times} = live;
    if (times.length && start < times.at(-1) - 1e-9) {  // a new bench
      const shows = film === live;
      live = {times: [], places: [], turns: [], ups: []};
      if (shows) film = live;
    }
    for (let k = 0; k < up.length; k += 1) {
      live.times.push(start + k * step);
      live.places.push(position.subarray(3 * k, 3 * k + 3));
      live.turns.push(quaternion.subarray(4 * k, 4 * k + 4));
      live.ups.push(up[k] !== 0);
    }
    if (live.times.length > KEPT) for (const list of Object.values(live)) list.splice(0, list.length - KEPT);
  }

  /** Keep the poses about a fall, once they are there; until then there is none to replay. */
  function keepFall(at) {
    const {times} = live, from = times.findIndex((time) => time >= at - BEFORE_S), to = times.findIndex((time) => time >= at + AFTER_S);
    if (from < 0 || to < 0) return false;
    const kept = Object.fromEntries(Object.entries(live).map(([name, list]) => [name, list.slice(from, to)]));
    if (film === fall) film = kept;  // a replay goes on in it
    fall = kept;
    return true;
  }

  /** Play the fall that was kept from this share of it on, and then go on with what is now. */
  function replay(share = (BEFORE_S - LEAD_S) / (BEFORE_S + AFTER_S)) {
    if (fall) [film, playhead] = [fall, fall.times[0] + share * (fall.times.at(-1) - fall.times[0])];
  }

  /** Move the playhead on by these seconds on the wall [s]. */
  function advance(seconds) {
    if (film === fall) {
      playhead += seconds * REPLAY_RATE;
      if (playhead < fall.times.at(-1)) return;
      film = live;
    }
    const first = live.times[0], newest = live.times.at(-1), late = 0.12 * speed;
    if (!(playhead >= first && playhead <= newest)) playhead = Math.max(first, newest - late);
    playhead += seconds * speed * rate;
    if (rate === 1) {
      const off = newest - late - playhead;
      playhead += Math.abs(off) > 0.5 * speed ? off : 0.1 * off;
    } else if (playhead < first || !rate) playhead = newest;
    playhead = Math.min(Math.max(playhead, first), newest);
  }

  /** The number of the last pose at a time, or before. */
  function poseAt(time) {
    let low = 0, high = film.times.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (film.times[middle] <= time) low = middle;
      else high = middle;
    }
    return low;
  }

  function place() {
    const {view} = stage, {times, places, turns, ups} = film, time = flashes ? Math.max(flashes(playhead), times[0]) : playhead;
    const low = poseAt(time), high = Math.min(low + 1, times.length - 1);
    const share = times[high] > times[low] ? Math.min((time - times[low]) / (times[high] - times[low]), 1) : 0;
    one.fromArray(turns[low]);
    two.fromArray(turns[high]);
    const about = two.clone().multiply(one.clone().invert());
    const axis = view.axisEnd([0, 0, 0], turns[low]);
    view.setSpin(ups[low] ? Math.sign((about.x * axis[0] + about.y * axis[1] + about.z * axis[2]) * about.w) : 0);
    const here = places[low].map((value, k) => value + share * (places[high][k] - value));
    view.setLean(ups[low] ? lean : 1);
    const now = one.slerp(two, share).toArray();
    view.setPose(here, now);
    const there = ups[low] || here[2] !== 0;  // else it was taken away
    view.show({top: there});
    if (shown.path) {
      let n = 0;
      for (let k = Math.max(0, poseAt(time - TRAIL_S)); k <= low; k += 1) {
        if (ups[k] === ups[low] && there) trail.set(view.axisEnd(places[k], turns[k]), 3 * n++);
      }
      trail.set(view.axisEnd(here, now), 3 * n);
      view.setPath(trail, n + 1);
    }
    return {place: here, up: ups[low], there, time: playhead};
  }

  let state = null, stilled = 0;
  function draw(now) {
    requestAnimationFrame(draw);
    if (document.hidden || now - drawnAt < LEAST_MS) return;
    const seconds = Math.min((now - last) / 1000, 0.25);
    last = now;
    const calm = !rate && film === live;
    if (live.times.length && !paused && !(calm && state && now - stilled < STILL_MS)) {
      if (calm) stilled = now;
      const before = playhead;
      advance(seconds);
      if (playhead !== before || !state) {
        state = place();
        moved = true;
      }
    }
    if (!moved) return;
    moved = false;
    drawnAt = Math.max(drawnAt + LEAST_MS, now - LEAST_MS / 2);
    stage.render();
    frames += 1;
  }
  show({});
  requestAnimationFrame(draw);

  return {
    add, keepFall, replay,
    /** Go on with what is now. */
    endReplay: () => {
      if (film !== live) [film, playhead] = [live, live.times.at(-1)];
    },
    /** The poses about a fall, as text: what a page had that was loaded before this one. */
    get fall() { return JSON.stringify(fall, (_, value) => ArrayBuffer.isView(value) ? [...value] : value); },
    setFall: (kept) => { fall = JSON.parse(kept); },
    get replays() { return film === fall && fall !== null; },
    /** The share of the fall that was played. */
    get played() { return (playhead - film.times[0]) / (film.times.at(-1) - film.times[0]); },
    get parts() { return parts; },
    setParts: (described) => {
      if (JSON.stringify(described) === JSON.stringify(parts)) return;
      parts = described;
      stage.setParts(parts);
      show({});
      if (!state) return;
      advance(0);  // the poses may have begun again, and a picture that stands still has not followed
      state = place();
    },
    /** What is seen, as of the view's own function; and how many times as far as it is the axis leans. */
    show,
    setLean: (factor) => {
      lean = factor;
      if (state) state = place();
      moved = true;
    },
    /** With a strobe lamp: a time → when the lamp flashed last [s]; null: in steady light. */
    setStrobe: (lamp) => { flashes = lamp; },
    reset: stage.reset, setCloseUp: stage.setCloseUp,
    setRate: (value) => { rate = value; },
    setSpeed: (value, still) => { speed = still ? 0 : value || 1; },
    pause: (value) => { paused = value; },
    get state() { return state; },
    get frames() { return frames; },
  };
}
