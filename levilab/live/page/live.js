// The live view: asks for frames and shows them. A view only: it may be closed and opened again at any time.

import {command, connect, load, read, takeToken} from "./connection.js";
import {takeDrops} from "./drop.js";
import {drawHistory, openHistory} from "./history.js";
import {drawReadings, drawRecords, saidOf, sheet, tableOf, titled} from "./plot.js";
import {openPractice, watchPractice} from "./practice.js";
import {openTune} from "./tune.js";
import {openSound} from "./sound.js";
import {LANGUAGE, between, by, fixed, lapse, make, option, phrase, put, short, turnLanguage, typeset, write} from "./words.js";

/** Least time between two spoken readings; an event is spoken at once, if it is not older [ms]. */
const SPOKEN_EVERY_MS = 30_000, NEWS_MS = 10_000;
/** Events in the list. */
const MOST_EVENTS = 200;
const STATES = {
  none: phrase("no run yet"), running: phrase("running"), finished: phrase("finished"), interrupted: phrase("interrupted"), failed: phrase("failed"),
  setup: phrase("starting"), slow: phrase("the bench is slow"), silent: phrase("bench silent"), lost: phrase("instrument lost"), missing: phrase("no run"),
  unreachable: phrase("server gone"), idle: phrase("ready"), unreadable: phrase("unreadable"),
};
const LONGER = {  // what stands beside the state
  slow: phrase("this computer has other work; the bench goes on by itself"),
  unreachable: phrase("it is tried again; start levilab live again if it was ended"),
};
/** A record of the oscilloscope that is older is marked with its age [s of bench time; where that is faster, of the wall]: without pulses a count takes 2.5 s. */
const OLD_S = 3;
/** What keeps to the bench for practice and to the runs that it records, in the place of a run's name. */
const OWN_BENCH = ".";
/** What a practice bench's oscilloscope shows, from above. */
const CHANNELS = ["tape", "drive", "laser"];
const PAUSED = phrase("The view is paused, and shows nothing of what the bench would do: “Go on” first.");
const NO_VALUE = phrase("––.––––");
const PLACE_EACH = 8, MOST_PLACES = 6000;  // of the sway each eighth pose is drawn, 50 a second, for two minutes
const SLIP_HZ = 0.2, SWINGS_HZ = 0.5;  // a top that follows is counted this near to its drive, on a ramp, too; while it swings

const token = takeToken();
const seen = {run: null, tick: -1, readings: -1, events: 0, fit: -1, poses: 0, said: 0, source: null, records: {}};
const data = {readings: null, found: null, hidden: null, shown: {}, said: [], fit: null, records: new Map(), about: null, bench: null, up: null, lastUp: NaN, last: {}, count: 0, trend: NaN};
const papers = {plot: sheet(by("plot")), trace: sheet(by("trace"))};
const history = openHistory(sessionStorage.getItem(`minutes ${token}`) ?? undefined), sound = openSound();
let places = [];  // of the top while a run is recorded: [bench time, x]
let fellAt = NaN;  // a fall whose poses are not kept yet
let isReady = false;  // whether the bench for practice has measured something yet
let paused = false, drawn = null, pointed = -1, space = null, topOf = "", wanted = "", practice = null, reachable = true;
let news = [], spoken = 0, spokenState = "", close = null, dirty = {plot: true, trace: true};
addEventListener("pagehide", () => {  // another language loads the page again
  sessionStorage.setItem(`minutes ${token}`, history.kept);
  sessionStorage.setItem(`fall ${token}`, space?.fall ?? "null");
});
window.levilab = {frames: 0, drawn: 0, seen, data, history};  // what tests and benchmarks read

// --- frames ---

function take(head) {
  window.levilab.frames += 1;
  if (paused) {  // what comes meanwhile is not kept: the next frame after the pause has it all
    seen.tick = head.tick;
    return;
  }
  seen.tick = head.tick;
  if (head.run !== seen.run) turnTo(head.run);
  if (head.source !== seen.source) {  // another bench, with a clock of its own
    Object.assign(seen, {source: head.source, records: {}});
    data.records.clear();
    dirty.trace = true;
  }
  const drove = data.bench ? Boolean(data.bench.drive?.output) : null;
  data.bench = head.bench;
  if (drove === false && head.bench?.drive?.output) lookAtBench();
  let follows = false;
  for (const one of head.said) {
    seen.said = one.n;
    practice?.hear(one);
    follows ||= Boolean(practice) && wanted !== "" && wanted !== OWN_BENCH && one.kind === "recording";
    if (/message|refused|ended/.test(one.kind) && !one.of_run) listEvent(one, one.text, one.kind === "message" ? "" : "warning");
  }
  if (head.about) {
    if (data.about && data.about.status !== head.about.status) listRuns(seen.run);
    data.about = head.about;
    showChoices();
  }
  if (head.readings) takeReadings(head.readings);
  if (head.events) takeEvents(head.events);
  if (head.fit) takeFit(head.fit);
  for (const one of head.records) {
    for (const [channel, other] of data.records) if (other.drawn !== one.drawn) data.records.delete(channel);  // what a run reads itself
    seen.records[one.channel] = one.number;
    data.records.set(one.channel, one);
    dirty.trace = true;
  }
  if (head.poses.length) takePoses(head.poses);
  if (data.bench && !data.bench.silent && history.add(data.bench, data.up === false) && isOfMinutes()) dirty.plot = true;
  show();
  if (follows) open(wanted = "");  // an older run was chosen, and a new one begins
}

function turnTo(run) {
  Object.assign(seen, {run, readings: -1, events: 0, fit: -1});
  Object.assign(data, {readings: null, found: null, hidden: null, fit: null, about: null, ended: "", end: null, last: {}, count: 0, trend: NaN});
  by("event-list").replaceChildren();
  put(by("events-key"), {hidden: true});
  if (/minutes|place/.test(by("drawn").value)) by("drawn").value = "all";
  places = [];
  pointed = -1;
  space?.endReplay?.();  // the fall was before this run
  dirty = {plot: true, trace: true};
  if (by("run").value !== run && run) listRuns(run);
}

function takeReadings(about) {
  seen.readings = about.version;
  Object.assign(data, {last: about.last, count: about.count, trend: about.trend});
  if (!drawPlaces()) data.readings = about.x ? {...about, xAxis: about.x_axis, yAxis: about.y_axis} : null;
  if (pointed >= (data.readings?.x.length ?? 0)) pointed = -1;
  dirty.plot = true;
}

function takeFit(about) {
  seen.fit = about.version;
  data.found = about;
  data.hidden = null;
}

/** Draw the running fit, unless a task asks for its numbers. */
function showFit() {
  const hidden = Boolean(practice?.hidesFit?.(data.about?.experiment)), said = practice?.verdict ?? [];
  if (data.hidden === hidden && data.said.length === said.length) return;
  const about = data.shown = hidden ? {} : said.length ? {...data.found, lines: said} : data.found ?? {};
  Object.assign(data, {hidden, said});
  data.fit = about.curve ? {...about, ...about.curve, solid_to: about.curve.solid_to ?? Infinity} : null;
  typeset(by("fit-head"), hidden ? phrase("The fit is shown once the run is analyzed: the task asks for it.") : about.head || "");
  typeset(by("fit-lines"), (about.lines || []).join(said.length ? " " : " · "));
  data.end = about.end_s || null;
  dirty.plot = true;
}

function takeEvents(events) {
  for (const event of events) {
    if (event.n <= seen.events) continue;
    seen.events = event.n;
    if (/^(failed|interrupted)$/.test(event.kind)) data.ended = event.text;
    const loud = /warning|damaged/.test(event.kind) ? "warning" : /lost|failed|not reached/.test(event.kind) ? "lost" : "";
    listEvent(event, event.text, loud);
  }
}

/** The latest stands first, each with the time of this computer's clock, and that of the run in brackets. */
function listEvent({time_s, utc}, text, loud) {
  const list = by("event-list"), item = make("li", "", loud), moment = new Date(utc || NaN);
  if (Date.now() - moment < NEWS_MS) news.push(text);
  const ofRun = typeof time_s === "number" ? `(${lapse(time_s, 0).replace(" min", "")})` : "";
  const clock = Number.isNaN(moment.valueOf()) ? "" : moment.toLocaleTimeString("en-GB");
  const when = make("time", [clock, ofRun].filter(Boolean).join(" "));
  if (clock) when.dateTime = utc;
  by("events-key").hidden &&= !ofRun;
  item.append(when, " ", make("span", text));
  item.dataset.utc = utc || list.firstChild?.dataset.utc || "";  // one that is damaged comes with the last
  list.insertBefore(item, [...list.children].find((other) => other.dataset.utc <= item.dataset.utc) || null);
  while (list.children.length > MOST_EVENTS) list.lastChild.remove();
}

async function drawTopOf(about) {
  try {
    const parts = await partsNow();
    if (about === topOf) space.setParts(parts);
  } catch {
    if (about === topOf) topOf = "";  // asked for again with the next poses
  }
}

function takePoses(pieces) {
  const about = `${seen.run} ${data.about?.status} ${seen.source}`;  // the top of another bench may be another one
  if (!space) {
    topOf = about;
    openTop();
  } else if (about !== topOf && space.setParts) {
    topOf = about;
    drawTopOf(about);
  }
  for (const piece of pieces) {
    seen.poses = piece.number;
    const up = piece.up, last = up.findLastIndex(Boolean);
    const before = data.up;
    data.up = last === up.length - 1;
    if (before && !data.up) markFall();
    else if (!before && data.up) forgetFall();
    if (last >= 0) data.lastUp = piece.start_s + last * piece.step_s;
    space.add(piece.start_s, piece.step_s, piece.position, piece.quaternion, up);
    if (data.about?.status !== "running" || piece.start_s <= places.at(-1)?.[0]) continue;
    if (!places.length && data.about.experiment === "sway") by("drawn").value = "place";
    for (let k = 0; k < up.length; k += PLACE_EACH) places.push([piece.start_s + k * piece.step_s, piece.position[3 * k]]);
  }
  places = places.slice(-MOST_PLACES);
  drawPlaces();
}

/** Draw how the top sways in place of the readings.  Returns whether that is wanted, and known of this run. */
function drawPlaces() {
  if (by("drawn").value !== "place" || !places.length) return false;
  const x = Float64Array.from(places, ([time]) => time - places[0][0]), low = Float64Array.from(places, ([, value]) => value);
  data.readings = {x, low, high: low, u: null, single: true, xAxis: ["time", "s", 1], yAxis: ["x", "mm", 1000, true]};
  return dirty.plot = true;
}

/** Mark the fall in the last minutes. */
function markFall() {
  fellAt = data.lastUp;
  put(by("replay"), {hidden: true});
  history.mark(data.lastUp, "fell");
  dirty.plot = true;
}

/** After a run that is over, a person puts the top back, drives it or changes it: the last minutes show what it does. */
function lookAtBench() {
  if (!practice || data.bench?.busy || data.about?.status === "running") return;
  by("drawn").value = "minutes";
  by("drawn").dispatchEvent(new Event("change"));
}

/** Another top floats: what is kept of a fall is not of it. */
function forgetFall() {
  fellAt = NaN;
  put(by("replay"), {hidden: true});
  space.endReplay?.();
}

/** What is drawn of the top that is shown. */
const partsNow = async () => (await fetch(`parts?run=${encodeURIComponent(seen.run)}`)).json();

/** Load what draws three dimensions when the first poses have come, and not before. */
async function openTop() {
  const early = [];
  space = {add: (...pieces) => early.length < 50 && early.push(pieces)};
  put(by("no-space"), {hidden: true});
  document.body.classList.remove("no-top");
  try {
    const parts = await partsNow();
    const {openSpace} = await import("./motion.js");
    space = await openSpace(by("space"), parts);
    space.setFall(sessionStorage.getItem(`fall ${token}`));
    put(by("replay"), {hidden: data.up || space.fall === "null"});
    for (const pieces of early) space.add(...pieces);
    window.levilab.space = space;
    space.setRate(Number(by("motion").value));
    for (const set of [lookAtTop, closeUp, leanTop, strobe]) set();
  } catch (error) {
    space = {add: () => {}};
    put(by("no-space"), {hidden: false});
    write("no-space", phrase("This browser draws no three dimensions: {why}", {why: error.message}));
  }
  dirty = {plot: true, trace: true};
}

// --- what is shown ---

function stateOf() {
  const {about, bench} = data;
  if (!reachable) return "unreachable";
  if (bench?.lost?.length && !bench.silent) return "lost";
  // a bench for practice is a program of this computer: it may be slow, and is silent once it has ended
  const quiet = !practice || practice.ended || (bench?.folder && !bench.busy) ? "silent" : "slow";
  if (about?.status === "running" && bench?.silent) return quiet;
  if (practice && (!bench || !isReady)) return practice.ended ? "silent" : "setup";
  if (practice && !bench.busy && (!about || about.status === "missing" || isOfMinutes())) return bench.silent ? quiet : "idle";
  return about ? about.status : "none";
}

function show() {
  const {about, bench, last} = data;
  isReady ||= Boolean(bench) && (bench.busy || Object.keys(bench.last).length > 0);
  const state = stateOf();
  if (practice && !space) {
    put(by("no-space"), {hidden: state !== "setup"});
    write("no-space", phrase("The bench is being set up, for {time} so far: some seconds, up to a minute at the first start, which compiles.", {time: lapse(performance.now() / 1000)}));
  }
  put(document.body.dataset, {state});
  write("state-word", STATES[state] || state);
  const lost = bench?.lost?.length ? phrase("the {instruments} does not answer", {instruments: bench.lost.map((kind) => phrase(kind)).join(phrase(" and the "))}) : "";
  const down = Boolean(practice) && data.up === false && Boolean(bench) && !bench.silent && !bench.folder;
  const does = bench?.silent ? "" : bench?.text || (down ? phrase("the top is down") : "");
  write("top-said", practice ? does : "");
  write("state-text", lost || LONGER[state] || about?.problem || (state === about?.status && ended(about)) || (!practice && about?.status === "running" && does) || "");
  put(by("state-text"), {title: by("state-text").textContent});
  put(by("synthetic"), {hidden: !(about?.synthetic || (!about && bench?.virtual))});
  const elapsed = about?.status === "running" ? bench?.elapsed_s ?? last.time_s : state === "idle" ? NaN : last.time_s;
  write("run-label", state === "idle" && seen.run ? phrase("Last run") : phrase("Run"));
  write("elapsed", Number.isFinite(elapsed) ? lapse(elapsed) : "");
  const left = leftOf(about, bench, elapsed);
  const isPaced = practice && bench?.speed !== 1;
  write("left", !left ? "" : isPaced ? phrase("{time} of bench time left", {time: left}) : phrase("{time} left", {time: left}));
  showBar(about, bench);
  showCounter(bench, last);
  showGenerator(bench, last);
  showMagnetometer(bench, last);
  showFacts(about);
  document.body.classList.toggle("no-scope", !data.records.size && !practice && Boolean(about) && about.status !== "running");
  write("count", isOfMinutes() ? phrase("the spin as it is counted, and the drive") : data.count ? `${data.count.toLocaleString("en").replaceAll(",", "\u202f")}${data.readings?.single === false ? phrase(", each stroke from the lowest to the highest of many") : ""}` : "");
  const minutes = isOfMinutes();
  put(by("empty"), {hidden: data.count > 0 || minutes});
  put(by("drawn").parentElement, {hidden: !data.count});
  put(by("drawn").lastElementChild, {hidden: !places.length});
  put(by("csv").parentElement, {hidden: !data.readings && !minutes});
  put(by("netcdf"), {hidden: minutes || !token || !/finished|interrupted/.test(about?.status)});
  write("readings-title", minutes ? phrase("The last minutes") : phrase("Readings"));
  write("empty", {
    none: phrase("No run yet: levilab acquire starts one, here or in another terminal, and it appears."),
    idle: practice?.guest ? phrase("No run yet: it appears here once one is recorded.") : phrase("No run yet: the guide says how to record one."),
    setup: phrase("Here the spin and the drive of the last minutes are drawn."),
  }[state] || (about?.status === "running" ? phrase("No reading yet: the top is being driven up.") : phrase("This run has no readings.")));
  put(document, {title: `${state === "running" && data.count ? `${phrase("{count} readings", {count: data.count})} · ` : ""}levilab live`});
  if (isReady) practice?.show(bench, about, data.count, down);
  showFit();
  put(by("fit-head").parentElement, {hidden: !data.count || !by("fit-head").textContent || isOfMinutes()});
  put(by("own"), {hidden: !practice || wanted === OWN_BENCH || !seen.run || (isOwn(seen.run) ?? !wanted)});  // a run that begins is listed in a moment
  space?.setSpeed?.(bench?.speed, bench?.paused || bench?.silent);
  showTop(bench);
  showAge(bench);
  speak(state, left);
}

/** The time that is left, as text: that of the fit, whose line is drawn, else what the bench says; "" where it is not known. */
function leftOf(about, bench, elapsed) {
  if (about?.status !== "running") return "";
  if (data.end && Number.isFinite(elapsed)) return between(...data.end.map((end) => end - elapsed));
  return Number.isFinite(bench?.time_left_s) ? between(bench.least_left_s ?? bench.time_left_s, bench.time_left_s) : "";
}

/** How a run ended that did not finish: its last event, less the word that is its state. */
function ended(about) {
  return /failed|interrupted/.test(about?.status) ? (data.ended || "").replace(`${STATES.interrupted} `, "") : "";
}

function showBar(about, bench) {
  const share = about?.status === "running" || practice ? bench?.share : null;
  put(by("bar"), {hidden: !Number.isFinite(share)});
  if (!Number.isFinite(share)) return;
  by("bar").firstElementChild.style.width = `${100 * share}%`;
  put(by("bar"), {ariaValueNow: String(Math.round(100 * share))});
}

const stale = (id, is) => by(id).closest(".display").classList.toggle("stale", is);

/** The last values of the run that is shown; none at a bench for practice that does not record it: it shows what it measures now. */
const ofRun = (bench, last) => practice && bench && (!bench.busy || data.about?.status !== "running") ? {} : last;

function showCounter(bench, last) {
  const live = bench && !bench.silent ? bench.last : {};
  const before = ofRun(bench, last);
  const spin = live.spin_frequency_hz ?? before.spin_frequency_hz ?? live.spin_seen_hz ?? before.spin_seen_hz;
  write("spin-value", Number.isFinite(spin) ? fixed(spin, 4) : NO_VALUE);
  const age = Number.isFinite(spin) && bench ? history.age : NaN;
  stale("spin-value", !bench || bench.silent || Number.isFinite(age));
  const trend = practice && data.about?.status !== "running" ? history.trend : data.trend;  // that of the run, while it is recorded
  const much = Math.abs(trend) >= 0.0005;
  write("trend", Number.isFinite(trend) ? `${much ? (trend < 0 ? "↓ " : "↑ ") : "→ "}${fixed(trend, 4)} Hz/s` : Number.isFinite(age) ? phrase("counted {time} ago", {time: lapse(age)}) : "–");
  const counting = bench?.counting ?? data.about?.settings?.counter;
  write("gate", Number.isFinite(counting?.gate_s) ? `${short(counting.gate_s)} s` : "–");
  write("trigger", Number.isFinite(counting?.trigger_level_v) ? `${short(counting.trigger_level_v)} V${counting.input ? phrase(", input {number}", {number: counting.input}) : ""}` : "–");
  write("counter-model", modelOf("counter"));
}

function showGenerator(bench, last) {
  const drive = bench?.drive ?? data.about?.settings?.generator;
  write("drive-value", drive?.frequency_hz ? fixed(drive.frequency_hz, 4) : Number.isFinite(last.drive_frequency_hz) ? fixed(last.drive_frequency_hz, 4) : NO_VALUE);
  stale("drive-value", !drive?.output || !bench || bench.silent);
  write("drive-on", drive?.output ? phrase("on") : phrase("off"));
  by("drive-on").classList.toggle("on", Boolean(drive?.output));
  write("signal", drive?.waveform ? `${drive.waveform}, ${short(drive.amplitude_vpp)} ${phrase("Vpp")}${drive.offset_v ? phrase(", offset {volts} V", {volts: short(drive.offset_v)}) : ""}` : "–");
  const [, spin, then] = drive?.output && history.latest || [], off = spin - then;  // of a count and its own time
  write("lock", drive?.output && drive.triggered ? phrase("triggers its drive") : Number.isFinite(off) ? `${Math.abs(off) < SLIP_HZ ? (practice && !bench.busy && !bench.took_hold ? phrase("takes hold") : phrase("follows")) : Math.abs(off) < SWINGS_HZ ? phrase("nearly") : phrase("does not follow")}, ${off >= 0 ? "+" : ""}${fixed(off, 3)} Hz` : drive?.output && history.age ? phrase("not counted now") : "–");
  write("generator-model", modelOf("generator"));
}

function showMagnetometer(bench, last) {
  const live = bench?.last || {};
  const from = Number.isFinite(live.flux_density_t) ? live : ofRun(bench, last);  // a value and its height belong together
  const field = from.flux_density_t, height = from.height_m ?? bench?.probe_m;
  write("field-value", Number.isFinite(field) ? fixed(field * 1000, 3) : "–");
  stale("field-value", !bench || bench.silent);
  write("probe", Number.isFinite(height) ? phrase("{height} cm above the base", {height: short(height * 100)}) : bench?.virtual ? phrase("in its chamber") : "–");
  write("magnetometer-model", modelOf("magnetometer"));
  write("scope-model", modelOf("oscilloscope"));
}

/** The model of an instrument: the second word of what it answers to *IDN?. */
function modelOf(kind) {
  const about = data.about?.instruments?.[kind];
  return about ? (about.identity || "").split(",")[1]?.trim() || about.driver || "" : "";
}

let facts = "";
function showFacts(about) {
  const rows = about ? [
    [phrase("experiment"), about.experiment], [phrase("started"), (about.started_utc || "").replace("T", " ").replace(/\..*/, " UTC")],
    [phrase("ended"), (about.ended_utc || "").replace("T", " ").replace(/\..*/, " UTC")], [phrase("group"), about.group], [phrase("note"), about.note],
    ...Object.entries(about.instruments || {}).map(([kind, one]) => [phrase(kind), one.identity || one.driver]),
    [phrase("folder"), seen.run],
  ].filter(([, text]) => text) : [];
  const now = JSON.stringify(rows);
  if (now === facts) return;
  facts = now;
  by("facts").replaceChildren(...rows.map(([what, text]) => {
    const row = make("div");
    row.append(make("dt", what), make("dd", text));
    return row;
  }));
}

function showTop(bench) {
  const pose = space?.state;
  for (const one of ["strobe-of", "sound-of"]) put(by(one), {hidden: !bench?.drive});
  if (Number.isFinite(fellAt) && space?.keepFall?.(fellAt)) {
    fellAt = NaN;
    put(by("replay"), {hidden: false});
  }
  put(by("played"), {hidden: !space?.replays});
  if (space?.replays) by("played").value = space.played;
  sound.follow(bench);
  if (!pose) return;
  const said = space.replays ? phrase("falls, 20 times slower") : pose.up ? phrase("floats at {height} mm", {height: fixed(pose.place[2] * 1000, 1)}) : pose.there ? phrase("lies where it fell") : phrase("is taken away");
  write("top-text", said);
  put(by("space"), {ariaLabel: phrase("the top over its base in three dimensions: it {said}", {said})});
}

/** Say beside the oscilloscope that no top is up, that no instrument is read, and of each record how old it is, where it is old. */
function showAge(bench) {
  const used = Object.keys(data.about?.instruments || {}), runs = data.about?.status === "running";
  const drawn = [...data.records.values()].some((one) => one.drawn);
  const still = runs && used.length && !used.includes("oscilloscope") ? phrase("this run does not use it") : "";
  const why = still && drawn ? `${still}; ${phrase("the signals are simulated")}` : still;
  write("scope-key", [data.up === false ? phrase("the top is down") : "", why].filter(Boolean).join("; ") || (data.records.has("laser") ? phrase("laser: the beam that the stem cuts") : ""));
  put(by("trigger-of"), {hidden: !drawn});
  for (const one of data.records.values()) {
    const said = ageOf(one, bench);
    if (one.said === said) continue;
    one.said = said;
    dirty.trace = true;
  }
}

/** A run need not record all channels, and a counter that sees no pulse keeps the oscilloscope waiting. */
function ageOf(record, bench) {
  if (data.up === false && record.time_s <= data.lastUp) return phrase("before the fall");
  const age = bench ? bench.time_s - record.time_s : 0;
  return age > OLD_S * Math.max(1, bench?.speed || 1) ? phrase("{time} ago", {time: lapse(age)}) : "";
}

/** Say to those who listen what has happened, else a new state, and now and then the last reading. */
function speak(state, left) {
  const now = performance.now(), events = news.splice(0);
  if (events.length) {
    spoken = now;
    write("news", events.join("; "));
    return;
  }
  if (now - spoken < SPOKEN_EVERY_MS && state === spokenState) return;
  spokenState = state;
  const spin = data.last.spin_frequency_hz;
  const parts = [phrase("reading {number}", {number: data.count}), Number.isFinite(spin) ? phrase("{spin} hertz", {spin: fixed(spin, 2)}) : "", left ? phrase("{time} left", {time: left}) : ""];
  const text = (STATES[state] || state) + (data.count ? `: ${parts.filter(Boolean).join(", ")}` : "");
  if (by("news").textContent !== text) {
    spoken = now;
    write("news", text);
  }
}

/** Whether the last minutes of the bench are drawn: where a person wants them, and before the first reading. */
const isOfMinutes = () => history.drives.length > 0 && Boolean(data.bench) && (by("drawn").value === "minutes" || !data.count);

function draw() {
  requestAnimationFrame(draw);
  if (document.hidden) return;
  if (dirty.plot) {
    dirty.plot = false;
    if (isOfMinutes()) {
      put(by("plot"), {ariaLabel: drawHistory(papers.plot, history)});
      drawn = null;
    } else if (data.readings) {
      drawn = drawReadings(papers.plot, {...data.readings, fit: data.fit}, pointed);
      const said = phrase("{count} readings of the {y} against {x}", {count: data.count, y: phrase(data.readings.yAxis[0]), x: phrase(data.readings.xAxis[0])});
      put(by("plot"), {ariaLabel: pointed >= 0 ? `${said}: ${saidOf({...data.readings, fit: data.fit}, drawn, pointed)}` : phrase("{said}; the arrow keys go from one to the next", {said})});
      window.levilab.drawn += 1;
    } else papers.plot.fit();
    showPointer();
  }
  if (dirty.trace) {
    dirty.trace = false;
    const place = ({channel}) => CHANNELS.indexOf(channel);  // they may come in any order
    const records = [...data.records.values()].sort((one, two) => place(one) - place(two));
    const said = [drawRecords(papers.trace, records, by("source").value), by("scope-key").textContent];
    put(by("trace"), {ariaLabel: said.filter(Boolean).join("; ")});
  }
}

// --- the pointer in the readings ---

function point(k, aloud = false) {
  if (k === pointed) return;
  pointed = k;
  dirty.plot = true;
  if (aloud && drawn && k >= 0) write("news", saidOf({...data.readings, fit: data.fit}, drawn, k));
}

function showPointer() {
  const label = by("pointer");
  if (pointed < 0 || !drawn || !data.readings) {
    label.style.visibility = "hidden";
    return;
  }
  write("pointer", saidOf({...data.readings, fit: data.fit}, drawn, pointed));
  const [x, y] = drawn.place(pointed);
  const wide = label.offsetWidth;
  label.style.left = `${Math.min(Math.max(x + 14, 4), by("plot").offsetLeft + drawn.width - wide - 8)}px`;
  label.style.top = `${by("plot").offsetTop + Math.max(y - 34, 2)}px`;
  label.style.visibility = "visible";
}

by("plot").addEventListener("pointermove", (event) => drawn && point(drawn.nearest(event.offsetX)));
by("plot").addEventListener("pointerleave", () => point(-1));
by("plot").addEventListener("keydown", (event) => {
  const steps = {ArrowLeft: -1, ArrowRight: 1, PageUp: -10, PageDown: 10, Home: -1e9, End: 1e9}[event.key];
  const n = data.readings?.x.length ?? 0;
  if (!steps || !n) return;
  event.preventDefault();
  point(Math.min(Math.max((pointed < 0 ? (steps < 0 ? n : -1) : pointed) + steps, 0), n - 1), true);
});
// --- controls ---

function pause() {
  paused = !paused;
  put(by("pause"), {ariaPressed: String(paused)});
  write("pause", paused ? phrase("Go on") : phrase("Pause view"));
  space?.pause?.(paused);
  if (!paused && by("said").textContent === PAUSED) write("said", "");
}
by("pause").addEventListener("click", pause);
by("source").addEventListener("change", () => { dirty.trace = true; });
by("help").addEventListener("click", () => by("keys").showModal());
by("drawn").addEventListener("change", () => {
  seen.readings = seen.tick = pointed = -1;
  dirty.plot = true;
});
const lookAtTop = () => space?.show?.(Object.fromEntries(["path", "spin", "height"].map((name) => [name, by(`show-${name}`).checked])));
const closeUp = () => space?.setCloseUp?.(by("close").checked);
const leanTop = () => space?.setLean?.(by("lean").checked ? 5 : 1);
/** A lamp that flashes with the drive; a drive that is off leaves the light steady. */
const strobe = () => space?.setStrobe?.(by("strobe").checked ? (time) => history.flash(time) : null);
function fillScreen() {
  if (document.fullscreenElement) document.exitFullscreen();
  else by("top").requestFullscreen?.().catch(() => {});
}
for (const name of ["path", "spin", "height"]) by(`show-${name}`).addEventListener("change", lookAtTop);
by("close").addEventListener("change", closeUp);
by("lean").addEventListener("change", leanTop);
by("strobe").addEventListener("change", strobe);
by("replay").addEventListener("click", () => space?.replay?.());
by("played").addEventListener("input", () => space.replay(Number(by("played").value)));
if (matchMedia("(prefers-reduced-motion: reduce)").matches) by("motion").value = "0";
by("sound").addEventListener("change", () => sound.play(by("sound").checked));
const isSynthetic = () => !by("synthetic").hidden;
by("csv").addEventListener("click", () => save(new Blob([isSynthetic() ? "# SYNTHETIC\n" : "", isOfMinutes() ? history.table() : tableOf(data.readings)], {type: "text/csv"}), "csv"));
by("png").addEventListener("click", () => {
  const [title, found] = isOfMinutes() ? [phrase("The last minutes"), {}] : [[data.about?.group, seen.run].filter(Boolean).join(", "), data.shown];
  const drawn = [isOfMinutes() ? "" : `○ ${phrase("Readings")}`, found.head && `${data.fit ? "― " : ""}${found.head}`].filter(Boolean).join("     ");
  const whole = title + (isSynthetic() ? ` (${by("synthetic").textContent})` : "");
  titled(by("plot"), [whole, drawn, ...found.lines ?? []].filter(Boolean)).toBlob((picture) => save(picture, "png"));
});
by("netcdf").addEventListener("click", async () => {
  put(by("netcdf"), {disabled: true});
  const answer = await load(`run/${encodeURIComponent(seen.run)}/export`, token);
  if (answer.error) listEvent({utc: new Date().toISOString()}, answer.error, "warning");
  else save(answer, "nc");
  put(by("netcdf"), {disabled: false});
});

/** Let the browser save what is drawn, by the name of the run. */
function save(blob, ending) {
  const link = Object.assign(make("a"), {href: URL.createObjectURL(blob), download: `${isOfMinutes() || !seen.run ? "bench" : seen.run}.${ending}`});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
by("nearest").addEventListener("click", () => space?.reset?.());
by("full").addEventListener("click", fillScreen);
by("space").addEventListener("dblclick", fillScreen);
by("motion").addEventListener("change", () => space?.setRate?.(Number(by("motion").value)));
by("own").addEventListener("click", () => {
  open(wanted = OWN_BENCH);
  by("run").value = OWN_BENCH;
  by("practice").focus();  // the button goes
});
by("run").addEventListener("change", () => {
  wanted = by("run").value;
  window.history.replaceState(null, "", wanted && !practice ? `?run=${encodeURIComponent(wanted)}` : location.pathname);
  open(wanted);
});

const KEYS = {
  " ": pause,
  "?": () => by("keys").showModal(),
  m: () => {
    const select = by("motion");
    select.selectedIndex = (select.selectedIndex + 1) % select.options.length;
    select.dispatchEvent(new Event("change"));
  },
  v: fillScreen,
  d: () => practice?.act("drive"), f: () => practice?.act("match"), b: () => practice?.act("back"), p: () => practice?.act("hold"), r: () => practice?.act("record"),
  ".": () => practice?.step(0.05), ",": () => practice?.step(-0.05), ":": () => practice?.step(0.5), ">": () => practice?.step(0.5),
  ";": () => practice?.step(-0.5), "<": () => practice?.step(-0.5),
};
document.addEventListener("keydown", (event) => {
  const fields = `input:not([type=checkbox]):not([type=range]), dialog[open]${event.key === "?" ? "" : ", select"}`;  // no option begins with a "?"
  const typing = event.target.closest?.(fields);
  const pressing = event.key === " " && event.target.closest?.("button, a, input, [role=button]");
  if (typing || pressing || event.ctrlKey || event.metaKey || event.altKey || !KEYS[event.key]) return;
  event.preventDefault();
  KEYS[event.key]();
});

// --- the server ---

function ask() {
  const columns = Math.max(1, Math.round(by("plot").clientWidth - 70));
  const about = {...seen, columns, latest: by("drawn").value === "latest"};
  return paused ? {run: seen.run, tick: seen.tick, readings: seen.readings, events: seen.events, fit: seen.fit, poses: seen.poses, said: seen.said} : about;
}

function open(run) {
  close?.();
  Object.assign(seen, {run: null, tick: -1, poses: 0, records: {}});
  data.records.clear();
  Object.assign(data, {bench: null, up: null, lastUp: NaN});
  close = connect({
    run, ask, show: take,
    changed: (is) => {
      reachable = is;
      if (is) Object.assign(seen, {tick: -1, poses: 0});
      else show();
    },
  });
}

let listed = {runs: []};
/** Whether the bench for practice recorded a run; undefined where it is not among the runs that are listed. */
const isOwn = (run) => listed.practice?.runs.includes(run) || (listed.runs.some(({name}) => name === run) ? false : undefined);
async function listRuns(chosen) {
  const answer = await read("runs");
  if (!answer) return listed;  // the server is gone: the list stays
  listed = answer;
  const select = by("run");
  select.replaceChildren(...listed.runs.map((run) => option("", run.name)));
  showChoices();
  if (listed.practice && !listed.practice.runs.length && listed.runs.length) {  // the runs are older than this bench
    select.prepend(option(phrase("no run of this bench yet"), OWN_BENCH));
    select.value = OWN_BENCH;
  }
  if (!listed.runs.length) select.append(option(phrase("none yet")));
  select.value = chosen || select.value;
  return listed;
}

/** Name each run that can be chosen; the state of the one that is shown comes with its frames. */
function showChoices() {
  for (const run of listed.runs) {
    if (run.name === seen.run && data.about) run.status = data.about.status;
    const status = run.status === "finished" ? "" : STATES[run.status] || run.status;
    // what differs stands first: the group, and the time of a run of today
    const begun = run.started_utc && new Date(run.started_utc), today = begun && begun.toDateString() === new Date().toDateString();
    const when = begun && (today ? begun.toLocaleTimeString(LANGUAGE, {timeStyle: "short"}) : begun.toLocaleString(LANGUAGE, {dateStyle: "short", timeStyle: "short"}));
    const text = [run.group, run.title ? phrase(run.title) : run.name, when, run.name === seen.run ? "" : status];
    const row = [...by("run").options].find(({value}) => value === run.name);
    if (row) put(row, {textContent: text.filter(Boolean).join(", ")});
  }
}
by("language").addEventListener("change", turnLanguage);
by("run").addEventListener("focus", () => listRuns(by("run").value));

async function begin() {
  const asked = new URLSearchParams(location.search).get("run");
  const {practice: bench, first, opens} = await listRuns(asked || "");
  put(by("open"), {hidden: !(opens && token)});
  if (opens && token) takeDrops(token, (file) => { location.href = `open?file=${file}`; }, (wrong) => write("dropped", wrong));
  document.body.classList.add("no-top");
  if (bench) {
    document.body.classList.remove("no-top");
    practice = bench.guest ? watchPractice() : openPractice(bench, give, () => seen.run, isOwn, Boolean(token));
    if (token) openTune(token);
  }
  for (const row of document.querySelectorAll(".practice-key")) row.hidden = !bench || bench.guest;
  wanted = bench ? "" : asked || first;
  if (wanted) by("run").value = wanted;
  open(wanted);
  if (!wanted && !bench) waitForRun();
}

/** Give a command to the bench for practice. */
function give(wanted) {
  if (paused && wanted.do !== "analyze") return PAUSED;
  if (["put the top back", "tune the drive", "change the bench"].includes(wanted.do)) lookAtBench();  // the bench itself puts it back after some runs, whose readings stay
  return command(wanted, token);
}

/** While there is no run: look for one every two seconds. */
function waitForRun() {
  show();
  const timer = setInterval(async () => {
    const {first} = await listRuns("");
    if (!first) return;
    clearInterval(timer);
    by("run").value = first;
    open(first);
  }, 2000);
}

new ResizeObserver(() => { dirty = {plot: true, trace: true}; }).observe(by("plot"));
new ResizeObserver(() => { dirty.trace = true; }).observe(by("trace"));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { dirty = {plot: true, trace: true}; });
requestAnimationFrame(draw);
begin();
