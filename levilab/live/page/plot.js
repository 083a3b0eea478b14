// Pictures of readings and of records on a canvas. They are drawn when there is something new, and not otherwise.

import {drawnBySoftware} from "./top.js";
import {colours, fixed, phrase, short} from "./words.js";

/** Without a graphics card an accelerated canvas costs four times as much as one in memory. */
export const SOFTWARE = drawnBySoftware();

const FONT = '12px system-ui, "Segoe UI", Roboto, "Helvetica Neue", "DejaVu Sans", sans-serif';

/** A canvas that has as many pixels as it is shown with. */
export function sheet(canvas) {
  const context = canvas.getContext("2d", {willReadFrequently: SOFTWARE});
  return {
    canvas, context,
    fit() {
      const ratio = SOFTWARE ? 1 : Math.min(devicePixelRatio || 1, 2);
      const [width, height] = [canvas.clientWidth, canvas.clientHeight];
      const [w, h] = [Math.max(1, Math.round(width * ratio)), Math.max(1, Math.round(height * ratio))];
      if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      context.clearRect(0, 0, width, height);
      context.font = FONT;
      return [width, height];
    },
  };
}

/** A picture of a canvas on its ground, below a title and other lines. */
export function titled(canvas, [title, ...lines]) {
  const copy = document.createElement("canvas"), c = copy.getContext("2d"), ratio = canvas.width / canvas.clientWidth, paint = colours();
  [copy.width, copy.height] = [canvas.width, canvas.height + Math.round((18 * lines.length + 26) * ratio)];
  c.fillStyle = paint.panel;
  c.fillRect(0, 0, copy.width, copy.height);
  c.drawImage(canvas, 0, copy.height - canvas.height);
  c.scale(ratio, ratio);
  c.fillStyle = paint.ink;
  for (const [k, text] of [title, ...lines].entries()) {
    c.font = k ? FONT : `bold ${FONT}`;
    c.fillText(text, 12, 18 * (k + 1), canvas.clientWidth - 24);
  }
  return copy;
}

/** Return about `count` round numbers from low to high, and no fewer than two. */
export function ticks(low, high, count) {
  if (!(high > low)) return [low];
  const raw = (high - low) / Math.max(count, 1), power = 10 ** Math.floor(Math.log10(raw));
  const steps = [0.1, 0.2, 0.5, 1, 2, 5, 10].map((k) => k * power), most = (high - low) / 2;
  const step = Math.min(steps.find((k) => k >= raw * 0.999), steps.findLast((k) => k <= most) ?? Infinity);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) found.push(k * step);
  return found;
}

/** How many decimals the numbers at an axis need. */
export const decimals = (marks) => marks.length < 2 ? 2 : Math.max(0, Math.min(6, -Math.floor(Math.log10(marks[1] - marks[0]) + 1e-9)));

/** The least and the greatest of all values, [0, 0] without any. */
function range(arrays) {
  let low = Infinity, high = -Infinity;
  for (const array of arrays) {
    for (const value of array) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return high >= low ? [low, high] : [0, 0];
}

/** That range, and beyond it so large a share of it. */
export function extent(arrays, share) {
  const [low, high] = range(arrays);
  const more = share * (high - low) || Math.abs(high) * 1e-3 || 1;
  return [low - more, high + more];
}

/** The value of a curve at x, between its points; NaN beside it. */
export function at(xs, ys, x) {
  let low = 0, high = xs.length - 1;
  if (!(xs.length && x >= xs[0] && x <= xs[high])) return NaN;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (xs[middle] <= x) low = middle;
    else high = middle;
  }
  const share = xs[high] > xs[low] ? (x - xs[low]) / (xs[high] - xs[low]) : 0;
  return ys[low] + share * (ys[high] - ys[low]);
}

const LEFT = 58, RIGHT = 12, TOP = 8, BOTTOM = 34, GAP = 22;  // in the gap stands what is below it
const ASIDE = 28;  // for the name of an axis beside its numbers

/**
 * Draw readings with their running fit, and below them what the fit leaves over.
 *
 * @param data x, low, high (arrays in SI), u (or null), single, xAxis and yAxis ([label, unit, factor]), colour, and the
 *   fit: {x, y, band, solid_to}, or null.
 * @param {number} pointed which reading is pointed at, −1 for none.
 * @returns where things are: {place(k): [x, y], nearest(px): k, width}.
 */
export function drawReadings(paper, data, pointed) {
  const paint = colours(), {context: c} = paper;
  const [width, height] = paper.fit();
  const {x, low, high, u, fit} = data, n = x.length;
  const [fx, fy] = [data.xAxis[2], data.yAxis[2]];
  const below = fit ? Math.max(54, 0.22 * (height - TOP - BOTTOM)) : 0;
  const bottom = height - BOTTOM, split = bottom - (fit ? below + GAP : 0);

  const ends = u ? [low.map((value, k) => value - u[k]), high.map((value, k) => value + u[k])] : [low, high];
  const xs = extent(fit ? [x, fit.x] : [x], 0.02), ys = extent(fit ? [...ends, fit.y] : ends, 0.06);
  const yMarks = ticks(ys[0] * fy, ys[1] * fy, Math.max(2, split / 46)), yTexts = yMarks.map((mark) => fixed(mark, decimals(yMarks)));
  const edge = Math.max(LEFT, ASIDE + Math.max(...yTexts.map((text) => c.measureText(text).width)));
  const toX = (value) => edge + (value - xs[0]) / (xs[1] - xs[0]) * (width - edge - RIGHT);
  const toY = (value) => split - (value - ys[0]) / (ys[1] - ys[0]) * (split - TOP);

  const left = new Float32Array(n), leftLow = new Float32Array(n), leftHigh = new Float32Array(n);
  if (fit) {
    for (let k = 0; k < n; k += 1) {
      const there = at(fit.x, fit.y, x[k]);
      left[k] = (low[k] + high[k]) / 2 - there;
      leftLow[k] = low[k] - there - (u ? u[k] : 0);
      leftHigh[k] = high[k] - there + (u ? u[k] : 0);
    }
  }
  const reach = fit ? 1.15 * Math.max(...extent([leftLow.filter(Number.isFinite), leftHigh.filter(Number.isFinite)], 0).map(Math.abs), 1e-9) : 1;
  const middle = bottom - below / 2, toLeft = (value) => middle - value / reach * below / 2;

  // axes
  c.lineWidth = 1;
  c.fillStyle = paint.soft;
  c.strokeStyle = paint.grid;
  c.textBaseline = "middle";
  const xMarks = ticks(xs[0] * fx, xs[1] * fx, width / 90);
  for (const [from, to] of fit ? [[TOP, split], [bottom - below, bottom]] : [[TOP, bottom]]) {
    line(c, xMarks.map((mark) => [toX(mark / fx), from, toX(mark / fx), to]));
  }
  line(c, yMarks.flatMap((mark) => [[edge, toY(mark / fy), width - RIGHT, toY(mark / fy)]]));
  c.textAlign = "right";
  yMarks.forEach((mark, k) => c.fillText(yTexts[k], edge - 7, toY(mark / fy)));
  c.textAlign = "center";
  for (const mark of xMarks) c.fillText(fixed(mark, decimals(xMarks)), toX(mark / fx), bottom + 11);
  c.fillText(named(data.xAxis), (edge + width - RIGHT) / 2, height - 8);
  const room = c.measureText(named(data.yAxis)).width < split - TOP ? split : bottom;
  upright(c, named(data.yAxis), 11, (TOP + room) / 2);
  if (fit) {
    c.strokeStyle = paint.soft;
    line(c, [[edge, middle, width - RIGHT, middle]]);
    c.textAlign = "right";
    const power = 10 ** Math.floor(Math.log10(0.8 * reach * fy));
    const one = [5, 2, 1].map((k) => k * power).find((k) => k <= 0.8 * reach * fy);
    const apart = toLeft(0) - toLeft(one / fy) >= 15;  // else the zero would lie on its neighbours
    for (const mark of apart ? [-one, 0, one] : [-one, one]) c.fillText(short(mark, 2), edge - 7, toLeft(mark / fy));
    c.textAlign = "left";
    c.fillText(named(["readings − fit", data.yAxis[1]]), edge, bottom - below - 10);
    c.strokeStyle = paint.line;
    c.strokeRect(edge + 0.5, bottom - below + 0.5, width - edge - RIGHT - 1, below - 1);
  }
  c.strokeStyle = paint.line;
  c.strokeRect(edge + 0.5, TOP + 0.5, width - edge - RIGHT - 1, split - TOP - 1);

  // the fit: its band, the line, and dashed what it expects
  if (fit) {
    if (fit.band.length) {
      c.save();  // of few readings the band is wider than the picture
      c.beginPath();
      c.rect(edge, TOP, width - edge - RIGHT, split - TOP);
      c.clip();
      c.fillStyle = paint.band;
      c.beginPath();
      fit.x.forEach((value, k) => c.lineTo(toX(value), toY(fit.y[k] + fit.band[k])));
      for (let k = fit.x.length - 1; k >= 0; k -= 1) c.lineTo(toX(fit.x[k]), toY(fit.y[k] - fit.band[k]));
      c.fill();
      c.restore();
    }
    c.strokeStyle = paint[fit.look] || paint.fit;
    c.lineWidth = 1.6;
    const until = Number.isFinite(fit.solid_to) ? fit.solid_to : Infinity;
    curve(c, fit, toX, toY, (value) => value <= until);
    c.setLineDash([4, 4]);
    curve(c, fit, toX, toY, (value) => value >= until);
    c.setLineDash([]);
  }

  // the readings: each by itself, or from the lowest to the highest of a column
  c.strokeStyle = paint.reading;
  c.lineWidth = 1.2;
  if (data.single) {
    const size = n > 400 ? 1.6 : n > 100 ? 2.2 : 3.2;
    const paints = n > 100 ? paint.reading : paint.panel;  // open circles while there is room for them
    if (u) line(c, Array.from(x, (value, k) => [toX(value), toY(low[k] - u[k]), toX(value), toY(low[k] + u[k])]));
    dots(c, x, low, toX, toY, size, paints);
    if (fit) {
      if (u) line(c, Array.from(x, (value, k) => [toX(value), toLeft(leftLow[k]), toX(value), toLeft(leftHigh[k])]));
      dots(c, x, left, toX, toLeft, size, paints);
    }
  } else {
    line(c, Array.from(x, (value, k) => [toX(value), toY(low[k]) + 0.6, toX(value), toY(high[k]) - 0.6]));
    if (fit) line(c, Array.from(x, (value, k) => [toX(value), toLeft(leftLow[k]) + 0.6, toX(value), toLeft(leftHigh[k]) - 0.6]));
  }

  const place = (k) => [toX(x[k]), toY((low[k] + high[k]) / 2)];
  if (pointed >= 0 && pointed < n) {
    c.strokeStyle = paint.ink;
    c.lineWidth = 1.5;
    c.beginPath();
    c.arc(...place(pointed), 6.5, 0, 7);
    if (fit) {
      c.moveTo(toX(x[pointed]) + 6.5, toLeft(left[pointed]));
      c.arc(toX(x[pointed]), toLeft(left[pointed]), 6.5, 0, 7);
    }
    c.stroke();
  }
  return {place, left, width, nearest: (px) => nearest(x, toX, px)};
}

/** Return a reading as text, for the pointer and for screen readers. */
export function saidOf(data, drawn, k) {
  const [fx, fy] = [data.xAxis[2], data.yAxis[2]];
  const unit = data.yAxis[1], digits = unit === "Hz" ? 4 : 3;
  const x = `${short(data.x[k] * fx, 6)} ${data.xAxis[1]}`;
  const value = data.single ? fixed(data.low[k] * fy, digits) : phrase("{first} to {last}", {first: fixed(data.low[k] * fy, digits), last: fixed(data.high[k] * fy, digits)});
  const u = data.single && data.u ? ` ± ${short(data.u[k] * fy, 2)}` : "";
  const left = data.fit && Number.isFinite(drawn.left[k]) ? phrase(", {residual} from the fit", {residual: `${drawn.left[k] >= 0 ? "+" : ""}${short(drawn.left[k] * fy, 2)}`}) : "";
  return phrase("{value} at {x}", {value: `${value}${u} ${unit}`, x}) + left;
}

/** What is drawn of readings as a table of text, in the units of the axes; of many readings the lowest and the highest. */
export function tableOf({x, low, high, u, single, xAxis, yAxis}) {
  const name = ([label, unit]) => `${label}${unit ? ` [${unit}]` : ""}`.replaceAll(",", "");
  const heads = single ? [name(xAxis), name(yAxis), ...u ? [`u ${name(yAxis)}`] : []] : [name(xAxis), `lowest ${name(yAxis)}`, `highest ${name(yAxis)}`];
  const rows = Array.from(x, (value, k) => {
    const values = single ? [low[k] * yAxis[2], ...u ? [u[k] * yAxis[2]] : []] : [low[k] * yAxis[2], high[k] * yAxis[2]];
    return [value * xAxis[2], ...values].map((one) => Number(one.toPrecision(8))).join(",");
  });
  return [heads.join(","), ...rows, ""].join("\n");
}

function nearest(x, toX, px) {
  let best = -1, least = 40;
  for (let k = 0; k < x.length; k += 1) {
    const off = Math.abs(toX(x[k]) - px);
    if (off < least) [best, least] = [k, off];
  }
  return best;
}

/** The name of an axis with its unit; one that is `typed` is a person's, in any language the same. */
const named = ([label, unit, , typed]) => `${typed ? label : phrase(label)}${unit ? ` [${unit}]` : ""}`;

export function upright(c, text, x, y) {
  c.save();
  c.translate(x, y);
  c.rotate(-Math.PI / 2);
  c.textAlign = "center";
  c.fillText(text, 0, 0);
  c.restore();
}

export function line(c, pieces) {
  c.beginPath();
  for (const [x0, y0, x1, y1] of pieces) {
    c.moveTo(x0, y0);
    c.lineTo(x1, y1);
  }
  c.stroke();
}

function dots(c, x, y, toX, toY, size, inside) {
  c.fillStyle = inside;
  c.beginPath();
  for (let k = 0; k < x.length; k += 1) {
    c.moveTo(toX(x[k]) + size, toY(y[k]));
    c.arc(toX(x[k]), toY(y[k]), size, 0, 7);
  }
  c.fill();
  c.stroke();
}

function curve(c, fit, toX, toY, wanted) {
  c.beginPath();
  fit.x.forEach((value, k) => wanted(value) && c.lineTo(toX(value), toY(fit.y[k])));
  c.stroke();
}

/** The screen of the oscilloscope is at least so high [V]. */
const LEAST_SPAN_V = 0.8;

/** A record with something said of it is old: it is drawn so faintly. */
const FAINT = 0.45;

/** What is seen of records that the page triggers, and how much of that before the trigger [s]. */
const SWEEP_S = 0.15, BEFORE_S = 0.015;
/** A signal that moves by less is none, and triggers nothing [V]. */
const LEAST_SIGNAL_V = 0.3;

/** When a record first rises through its middle, at least BEFORE_S after its beginning [s]; NaN where it does not. */
export function triggerOf({low, high, start_s, step_s}) {
  const [from, to] = range([low, high]), level = (from + to) / 2;
  if (to - from < LEAST_SIGNAL_V) return NaN;
  for (let k = Math.ceil(BEFORE_S / step_s); k + 1 < high.length; k += 1) {
    if (high[k] < level && high[k + 1] >= level) return start_s + (k + (level - high[k]) / (high[k + 1] - high[k])) * step_s;
  }
  return NaN;
}

/** The record that triggers: of the drive where it is on and wanted, else of the tape; and when it does [s]. */
function trigger(records, source) {
  for (const channel of [source, "drive", "tape"]) {
    const one = records.find((record) => record.drawn && record.channel === channel), at = one ? triggerOf(one) : NaN;
    if (Number.isFinite(at)) return [channel, at];
  }
  return ["", NaN];
}

/**
 * Draw the oscilloscope's screen: each channel's latest record, one below the other, on one scale of time.
 *
 * @param records channel, low, high, start_s, step_s, drawn, and said: how old it is, "" for a new one.
 * @param {string} source the channel that triggers records which were drawn; another one where it has no pulse.
 * @returns the same as text.
 */
export function drawRecords(paper, records, source) {
  const paint = colours(), {context: c} = paper;
  const [width, height] = paper.fit();
  c.strokeStyle = paint.graticule;
  c.lineWidth = 1;
  const across = Array.from({length: 9}, (_, k) => Math.round((k + 1) * width / 10) + 0.5);
  const n = Math.max(records.length, 1), band = height / n;  // each channel has a part of the screen to itself
  const up = Array.from({length: n - 1}, (_, k) => Math.round((k + 1) * band) + 0.5);
  line(c, [...across.map((x) => [x, 0, x, height]), ...up.map((y) => [0, y, width, y])]);
  if (!records.length) {
    c.fillStyle = paint.dim;
    c.textAlign = "center";
    c.textBaseline = "middle";
    c.fillText(phrase("no record yet"), width / 2, height / 2);
    return phrase("no record yet");
  }
  const [by, triggered] = trigger(records, source), first = Math.min(...records.map((one) => one.start_s));
  const begin = by ? triggered - BEFORE_S : first;
  const drawn = records.every((one) => one.drawn);
  const end = by || drawn ? begin + SWEEP_S : Math.max(...records.map((one) => one.start_s + one.step_s * one.low.length));
  if (by) {  // the moment of the trigger, as scopes mark it
    const x = (triggered - begin) / (end - begin) * width;
    c.fillStyle = paint[`trace-${records.findIndex(({channel}) => channel === by) % 4 + 1}`];
    c.beginPath();
    for (const [dx, y] of [[-5, 0], [5, 0], [0, 8]]) c.lineTo(x + dx, y);
    c.fill();
  }
  const said = [];
  records.forEach((one, channel) => {
    const [from, to] = range([one.low, one.high]);
    const more = Math.max(0, (LEAST_SPAN_V - (to - from)) / 2);  // noise alone does not fill the screen
    const [lowest, highest] = [from - more, to + more];
    const floor = (channel + 1) * band - Math.min(7, band / 8);  // above the signal stands what it is, on a low screen across it
    const ceiling = channel * band + (band < 36 ? band / 4 : Math.min(24, band / 2));
    const toX = (k) => (one.start_s + (k + 0.5) * one.step_s - begin) / (end - begin) * width;
    const toY = (value) => floor - (value - lowest) / (highest - lowest) * (floor - ceiling);
    const old = one.said ? `, ${one.said}` : "";
    c.globalAlpha = old ? FAINT : 1;
    c.strokeStyle = paint[`trace-${channel % 4 + 1}`];
    c.lineWidth = 1.2;
    c.beginPath();
    for (let k = 0; k < one.low.length; k += 1) {
      c.lineTo(toX(k), toY(one.low[k]));
      if (one.high[k] !== one.low[k]) c.lineTo(toX(k), toY(one.high[k]));
    }
    c.stroke();
    c.globalAlpha = 1;
    c.fillStyle = c.strokeStyle;
    c.textAlign = "left";
    c.textBaseline = "top";
    c.fillText(`${phrase(one.channel)}  ${short(from, 2)} … ${short(to, 2)} V${old}`, 8, channel * band + Math.min(6, band / 12));
    said.push(phrase("{channel} from {low} to {high} volts", {channel: phrase(one.channel), low: short(from, 2), high: short(to, 2)}) + old);
  });
  c.fillStyle = paint.dim;
  c.textAlign = "right";
  c.textBaseline = "top";
  const division = `${short((end - begin) * 100, 3)} ms`;
  const triggeredBy = by ? phrase(", triggered by the {channel}", {channel: phrase(by)}) : "";
  c.fillText(width < 400 ? phrase("{time}/div", {time: division}) : phrase("{time} a division", {time: division}) + triggeredBy, width - 8, 6);
  return `${said.join(", ")}${phrase(", over {time} milliseconds", {time: short((end - begin) * 1000, 3)})}${triggeredBy}`;
}
