// The last minutes of a bench, run or no run: the spin as it is counted, the drive, and their difference.

import {decimals, extent, line, ticks, upright} from "./plot.js";
import {colours, fixed, lapse, phrase} from "./words.js";

/** The time that is shown, at most and at least [s of bench time]: a free top is down 90 s after it was put up. */
const SHOWN_S = 180, LEAST_S = 60;
/** A value that stays is noted again after this time [s]. */
const NOTED_S = 1;
/** The least heights of the plot and of the plot of the difference about zero [Hz]. */
const LEAST_HZ = 2, LEAST_OFF_HZ = 0.2;
/** The frequencies that are shown while there is neither a top nor a drive [Hz]. */
const USUAL_HZ = [20, 35];
/** A count is shown until the next should be there, a gate and this time after its own gate [s]; then, after a fall,
 * and after a jump that no top makes [Hz], there is a gap. */
const COUNTED_S = 2, JUMP_HZ = 1;
/** The counts whose slope is shown [s]: a free top's is then known to some percent. */
const TREND_S = 12;
/** The chart stands still from this time after the last count on, while the top is down and the drive off [s]. */
const RESTS_S = 60;
/** Changes of the drive's frequency that are kept, to count its turns: a ramp makes two a second. */
const MOST_CHANGES = 100;
const LEFT = 58, LEAST_RIGHT_PX = 84, TOP = 10, BOTTOM = 34, GAP = 24;

/**
 * The last minutes: the drive, and each count at the middle of its gate, beside the drive of that moment.
 *
 * @param kept what a page had that was loaded before this one, as text.
 */
export function openHistory(kept = "{}") {
  // turns of the drive: [time, turns by then, frequency]
  let {drives = [], counts = [], marks = [], turns = []} = JSON.parse(kept, (_, value) => value ?? NaN), rests = false;
  return {
    /** As text, for the page that is loaded next; what is no number is null there. */
    get kept() { return JSON.stringify({drives, counts, marks, turns}); },
    /** Each [time, drive]; NaN while it is off, or the top triggers it. */
    get drives() { return drives; },
    /** Each [time, spin, drive of that time, end of the gate]; NaN where there is a gap, or the drive was off. */
    get counts() { return counts; },
    get marks() { return marks; },
    /** Whether the chart stands still. */
    get rests() { return rests; },

    /** Take in a state of the bench, and whether no top floats.  Returns whether the chart has changed. */
    add(bench, isDown = false) {
      const now = bench.time_s, last = drives.at(-1);
      if (last && now < last[0]) [drives, counts, marks, turns] = [[], [], [], []];  // another bench
      const drive = bench.drive?.output && !bench.drive.triggered ? bench.drive.frequency_hz : NaN;
      countTurns(now, drive);
      const rested = rests;
      rests = isDown && !Number.isFinite(drive) && now - counts.at(-1)?.[3] > RESTS_S;
      if (rests) return !rested;
      const changed = !last || !Object.is(last[1], drive) || now - last[0] >= NOTED_S;
      if (changed) drives.push([now, drive]);
      const counted = !isDown && take(bench.count, last ? now - last[0] : 0);
      drives = drives.filter(([time]) => time >= now - SHOWN_S);
      counts = counts.filter(([time]) => time >= now - SHOWN_S);
      marks = marks.filter(([time]) => time >= now - SHOWN_S);
      return changed || counted;
    },

    /** The last count, while it is shown; else null. */
    get latest() {
      const last = counts.at(-1);
      return last && drives.at(-1)[0] - last[3] <= 2 * (last[3] - last[0]) + COUNTED_S ? last : null;
    },

    /** The time since the last count, where that is shown no more; else NaN [s]. */
    get age() { return this.latest ? NaN : drives.at(-1)?.[0] - counts.at(-1)?.[3]; },

    /** The slope of the counts of the last seconds, behind the last gap [Hz/s]; NaN where they are few. */
    get trend() {
      const whole = counts.slice(counts.findLastIndex(([, spin]) => !Number.isFinite(spin)) + 1), now = drives.at(-1)?.[0];
      const last = whole.filter(([time]) => time >= now - TREND_S), mean = (k) => last.reduce((sum, row) => sum + row[k], 0) / last.length;
      const [time, spin] = [mean(0), mean(1)], sum = (of) => last.reduce((all, row) => all + of(row[0] - time, row[1] - spin), 0);
      return last.length < 3 ? NaN : sum((t, f) => t * f) / sum((t) => t * t);
    },

    /** When the drive began its last period before a time; the time itself while it is off [s]. */
    flash(time) {
      const one = turns.findLast(([start]) => start <= time);
      if (!one || !Number.isFinite(one[2])) return time;
      const [start, before, drive] = one;
      return start + (Math.floor(before + (time - start) * drive) - before) / drive;
    },

    /** The same as a table of text. */
    table() {
      const rows = [...drives.map(([time, drive]) => [time, NaN, drive]), ...counts.map((row) => row.slice(0, 3))].sort((one, two) => one[0] - two[0]);
      const texts = rows.map((row) => row.map((value) => Number.isFinite(value) ? String(value) : "").join(","));
      return ["bench_time_s,spin_frequency_hz,drive_frequency_hz", ...texts, ""].join("\n");
    },

    /** Mark at a time what happened, in English. */
    mark(time, text) { marks.push([time, text]); },
  };

  /** Take in a count that is new, a time after the state before [s]. */
  function take(count, elapsed) {
    const last = counts.at(-1);
    if (!count || count.end_s === last?.[3]) return false;
    const middle = count.end_s - count.gate_s / 2;
    if (last && middle <= last[0]) return false;
    const fell = marks.at(-1)?.[0];  // then this is another top
    if (last && (fell > last[0] && fell < middle || middle - last[0] > count.gate_s + COUNTED_S + elapsed || Math.abs(count.frequency_hz - last[1]) > JUMP_HZ)) counts.push([middle, NaN, NaN, NaN]);
    counts.push([middle, count.frequency_hz, driveAt(middle), count.end_s]);
    return true;
  }

  /** The drive at a time, between two states on a ramp: at the middle of a gate this is its mean over the gate. */
  function driveAt(time) {
    const k = drives.findLastIndex(([start]) => start <= time), [from, before] = drives[k] ?? [NaN, NaN];
    const [to, after] = drives[k + 1] ?? [Infinity, before];
    return to === Infinity ? before : before + (after - before) * (time - from) / (to - from);
  }

  /** Count the turns of the drive on, as long as its frequency stays. */
  function countTurns(now, drive) {
    const last = turns.at(-1);
    if (last && Object.is(last[2], drive)) return;
    turns.push([now, last ? last[1] + (now - last[0]) * (last[2] || 0) : 0, drive]);
    if (turns.length > MOST_CHANGES) turns.shift();
  }
}

/**
 * Draw the last minutes: spin and drive, and below them their difference while the drive was on.
 *
 * @returns the same as text.
 */
export function drawHistory(paper, {drives, counts, marks, latest, rests}) {
  const paint = colours(), {context: c} = paper;
  const [width, height] = paper.fit();
  const right = Math.max(LEAST_RIGHT_PX, 10 + Math.max(...["top", "drive"].map((name) => c.measureText(`${phrase(name)} 00.00`).width)));
  const now = drives.at(-1)[0], first = drives[0][0], shown = Math.min(Math.max(now - first, LEAST_S), SHOWN_S);
  const differences = counts.map(([, spin, drive]) => spin - drive);
  const known = (values) => values.filter(Number.isFinite);
  const driven = known(drives.map((row) => row[1])).length > 0;
  const bottom = height - BOTTOM, below = driven ? Math.max(44, 0.26 * (bottom - TOP)) : 0;
  const split = bottom - (driven ? below + GAP : 0);

  const counted = known([...drives.map((row) => row[1]), ...counts.map((row) => row[1])]);
  const ys = atLeast(counted.length ? extent([counted], 0.08) : USUAL_HZ, LEAST_HZ);
  const reach = Math.max(LEAST_OFF_HZ, Math.min(2, 1.15 * Math.max(0, ...known(differences).map(Math.abs))));
  const toX = (time) => width - right + (time - now) / shown * (width - LEFT - right);
  const toY = (value) => split - (value - ys[0]) / (ys[1] - ys[0]) * (split - TOP);
  const middle = bottom - below / 2, toOff = (value) => middle - value / reach * below / 2;

  c.lineWidth = 1;
  c.fillStyle = paint.soft;
  c.strokeStyle = paint.grid;
  c.textBaseline = "middle";
  const each = (shown > 90 ? 30 : 15) * (width < 420 ? 2 : 1), times = Array.from({length: Math.floor(shown / each) + 1}, (_, k) => -each * k);
  const yMarks = ticks(...ys, split / 46);
  for (const [from, to] of driven ? [[TOP, split], [bottom - below, bottom]] : [[TOP, bottom]]) {
    line(c, times.map((time) => [toX(now + time), from, toX(now + time), to]));
  }
  line(c, yMarks.map((mark) => [LEFT, toY(mark), width - right, toY(mark)]));
  c.textAlign = "right";
  for (const mark of yMarks) c.fillText(fixed(mark, decimals(yMarks)), LEFT - 7, toY(mark));
  c.textAlign = "center";
  for (const time of times) c.fillText(time ? `${fixed(time, 0)} s` : rests ? "" : phrase("now"), toX(now + time), bottom + 11);
  c.fillText(rests ? phrase("bench time; the chart stands still while the top is down and the drive off") : phrase("bench time before now"), (LEFT + width - right) / 2, height - 8);
  upright(c, phrase("frequency [Hz]"), 11, (TOP + split) / 2);
  c.strokeStyle = paint.line;
  c.strokeRect(LEFT + 0.5, TOP + 0.5, width - LEFT - right - 1, split - TOP - 1);
  if (driven) {
    c.strokeRect(LEFT + 0.5, bottom - below + 0.5, width - LEFT - right - 1, below - 1);
    c.strokeStyle = paint.soft;
    line(c, [[LEFT, middle, width - right, middle]]);
    c.textAlign = "right";
    for (const mark of [-reach, 0, reach]) c.fillText(fixed(0.8 * mark, 2), LEFT - 7, toOff(0.8 * mark));
    c.textAlign = "left";
    const off = latest ? latest[1] - latest[2] : NaN;  // beyond the strip it is a number
    c.fillText(`${phrase("top − drive [Hz]")}${Math.abs(off) > reach ? `: ${fixed(off, 2)}` : ""}`, LEFT, bottom - below - 11);
  }

  c.save();
  c.beginPath();
  c.rect(LEFT, 0, width - LEFT - right, bottom);
  c.clip();
  course(c, drives, (row) => row[1], toX, toY, paint.newton, 3.5);
  course(c, counts, (row) => row[1], toX, toY, paint.reading, 1.8);
  if (driven) course(c, counts, (row) => Math.abs(row[1] - row[2]) > reach ? NaN : row[1] - row[2], toX, toOff, paint.stokes, 1.6);
  c.strokeStyle = c.fillStyle = paint.bad;
  c.lineWidth = 1;
  c.setLineDash([3, 3]);
  line(c, marks.map(([time]) => [toX(time), TOP, toX(time), bottom]));
  c.setLineDash([]);
  c.lineWidth = 4;
  c.lineJoin = "round";
  c.strokeStyle = paint.panel;  // about the letters, where they lie on a line
  for (const [k, [time, text]] of marks.entries()) {
    const right = toX(time) > width / 2, place = [toX(time) + (right ? -5 : 5), TOP + 10 + 14 * (k % 2)];
    c.textAlign = right ? "right" : "left";
    c.strokeText(phrase(text), ...place);
    c.fillText(phrase(text), ...place);
  }
  c.restore();

  // what each line is stands at its end
  c.textAlign = "left";
  const last = counts.at(-1);
  if (!latest && last && !(marks.at(-1)?.[0] >= last[0])) {  // not counted now: it stands where its line ends
    c.fillStyle = paint.reading;
    c.fillText(`${phrase("top")} ${fixed(last[1], 2)}`, toX(last[0]) + 6, Math.min(toY(last[1]) + 14, split - 6));
  }
  const ends = [[phrase("top"), latest?.[1], paint.reading], [phrase("drive"), drives.at(-1)[1], paint.newton]].filter((one) => Number.isFinite(one[1]));
  const [one, two] = ends.map(([, value]) => toY(value));
  const apart = two === undefined || Math.abs(one - two) >= 15 ? 0 : (15 - Math.abs(one - two)) / 2 * (one <= two ? -1 : 1);
  ends.forEach(([name, value, colour], k) => {
    c.fillStyle = colour;
    c.fillText(`${name} ${fixed(value, 2)}`, width - right + 6, Math.min(Math.max(toY(value) + (k ? -apart : apart), TOP + 6), split - 6));
  });
  const said = ends.map(([name, value]) => phrase("{name} at {value} hertz", {name, value: fixed(value, 2)})).join(", ") || phrase("no top is counted");
  return phrase("the last {time} of the bench: {said}", {time: lapse(now - first), said});
}

/** Widen a range about its middle to a least width. */
function atLeast([low, high], width) {
  const more = Math.max(0, width - (high - low)) / 2;
  return [low - more, high + more];
}

/** Draw a value over the time, with gaps where there is none. */
function course(c, rows, value, toX, toY, colour, width) {
  c.strokeStyle = c.fillStyle = colour;
  c.lineWidth = width;
  c.lineJoin = "round";
  c.beginPath();
  let before = NaN;
  for (const row of rows) {
    const now = value(row);
    if (Number.isFinite(now)) {
      if (!Number.isFinite(before)) c.moveTo(toX(row[0]) - 1, toY(now));  // a single value is a dash
      c.lineTo(toX(row[0]), toY(now));
    }
    before = now;
  }
  c.stroke();
}
