// The bench for practice: controls that send commands, and the guide that shows how far one is.

import {showResult} from "./result.js";
import {by, fixed, lapse, local, make, numberIn, option, phrase, put, short, write} from "./words.js";

/** Least time between two messages of a slider [ms]. */
const SENDS_EVERY_MS = 120;

/** The bench for practice as guests see it: its controls stay hidden, and keys do nothing. */
export function watchPractice() {
  return {guest: true, ended: false, show() {}, step() {}, act() {}, hear({kind}) { this.ended ||= kind === "ended"; }};
}

/**
 * @param about what the server says of the bench: experiments, limits.
 * @param {(wanted: object) => Promise<string>} command sends one; what is wrong with it, or "".
 * @param {() => string} run name of the run that is shown.
 * @param {(run: string) => boolean} isOwn whether this bench recorded a run.
 * @param {boolean} allowed whether this page may give commands.
 */
export function openPractice(about, command, run, isOwn, allowed) {
  document.body.classList.add("practice");
  by("practice").hidden = false;
  for (const {name, title} of about.experiments) by("experiment").append(option(phrase(title), name));
  const now = {drive: false, busy: false, paused: false, analyzed: "", ended: false, elsewhere: null, bench: null};

  put(by("controls"), {disabled: true});  // until the bench is there
  if (!allowed) write("said", phrase("This page may only look: open the address that the terminal shows."));

  async function send(what, values = {}) {
    if (allowed) write("said", "");  // and not later: what the bench says may come before the answer
    const wrong = await command({do: what, ...values});
    if (allowed && wrong) write("said", wrong);
  }

  /** What the bench says: a refusal, or a line for the person at it. */
  function hear({kind, text, status}) {
    now.ended ||= kind === "ended";
    if (allowed && (kind === "done" || kind === "recording")) write("said", "");
    if (allowed && (kind === "refused" || kind === "ended" || (kind === "recorded" && status === "failed"))) write("said", text);
  }

  let timer = 0, latest = null;
  function tune(values) {
    latest = {...latest, ...values};
    timer ||= setTimeout(sendTune, SENDS_EVERY_MS);
  }
  function sendTune() {
    const values = latest;
    clearTimeout(timer);
    [timer, latest] = [0, null];
    return values && !now.busy ? send("tune the drive", values) : undefined;
  }
  const pair = (id, slider, key) => {
    const field = by(id), {min, max, step: size} = field.dataset;  // a value between the steps is as good: the drive takes any
    const pass = () => {
      const value = numberIn(field.value), empty = field.value.trim() === "";
      const wrong = !empty && !(value >= Number(min) && value <= Number(max));
      write(`${id}-wrong`, wrong ? phrase(Number.isFinite(value) ? "from {min} to {max}, not {seen}" : "a number from {min} to {max}, not {seen}", {min, max, seen: field.value.trim()}) : "");
      field.setAttribute("aria-invalid", String(wrong));
      if (wrong || empty) return;
      by(slider).value = String(value);
      field.value = local(String(value));
      tune({[key]: value});
    };
    field.addEventListener("change", pass);
    field.addEventListener("keydown", (event) => {
      const way = {ArrowUp: 1, ArrowDown: -1}[event.key];
      if (!way) return;
      event.preventDefault();
      stepBy(id, way * Number(size));
    });
    by(slider).addEventListener("input", () => {
      field.value = local(by(slider).value);
      write(`${id}-wrong`, "");
      field.setAttribute("aria-invalid", "false");
      tune({[key]: Number(by(slider).value)});
    });
  };
  pair("frequency", "frequency-slider", "frequency_hz");
  pair("amplitude", "amplitude-slider", "amplitude_vpp");

  const does = {
    drive: () => send("switch the drive", {on: !now.drive}),
    match: () => send("match the drive"),
    back: () => send("put the top back"),
    hold: () => send("pause", {on: !now.paused}),
    record: () => now.busy ? send("stop the run") : send("record a run", {experiment: by("experiment").value, group: by("group").value}),
    analyze: () => openResult(run()),
    report: () => { now.read = run(); },
  };
  for (const [id, act] of Object.entries(does)) {
    by(id).addEventListener("click", async () => {
      await sendTune();  // what was typed just before comes first
      act();
    });
  }
  by("speed").addEventListener("change", () => send("set the speed", {speed: Number(by("speed").value)}));

  by("group").addEventListener("change", () => send("take a seed", {group: by("group").value}));
  by("seed").addEventListener("change", () => send("take a seed", {seed: numberIn(by("seed").value)}));

  // what if
  const knobs = Object.entries(about.what_if).map(([name, row]) => {
    const label = make("label", "", "quantity"), value = make("output"), input = make("input"), small = make("small", phrase(row.shows)), title = phrase(row.title);
    value.ariaLive = "off";  // what the slider is at, its own text says
    Object.assign(input, {type: "range", min: row.low, max: row.high, step: row.step, value: row.usual});
    input.setAttribute("aria-label", `${title}, ${row.unit || phrase("as a part of the moment")}`);
    label.append(make("span", title), value, input, small);
    by("quantities").append(label);
    const decimals = row.step < 0.01 ? 3 : row.step < 0.1 ? 2 : 1;
    let wait = 0;
    input.addEventListener("input", () => {
      say(Number(input.value));
      wait ||= setTimeout(() => {
        wait = 0;
        send("change the bench", {values: {[name]: Number(input.value)}});
      }, SENDS_EVERY_MS);
    });
    function say(there) {
      put(value, {textContent: `${fixed(there, decimals)} ${row.unit}`});
      put(input, {ariaValueText: value.textContent});
      label.classList.toggle("changed", there !== row.usual);
    }
    return {
      show(there) {
        if (wait || document.activeElement === input && Math.abs(input.value - there) < row.step) return;
        input.value = there;
        say(there);
      },
    };
  });
  const names = Object.keys(about.what_if);
  by("usual").addEventListener("click", () => send("change the bench"));

  // tasks
  const tasks = Object.fromEntries(about.tasks.map((row) => {
    const item = make("li"), button = make("button", phrase(row.title));
    button.addEventListener("click", () => send("begin a task", {task: row.name}));
    item.append(button);
    by("task-list").append(item);
    return [row.name, {...row, item}];
  }));
  by("leave-task").addEventListener("click", () => send("begin a task"));
  let shownTask = "";
  function showTask(bench) {
    const row = tasks[bench.task];
    put(by("task"), {hidden: !row});
    put(by("guide"), {hidden: Boolean(row)});
    put(by("task"), {inert: !allowed});
    put(by("task-share"), {value: bench.task_share});
    write("tasks-done", bench.tasks_done.length ? phrase("{done} of {all} done", {done: bench.tasks_done.length, all: about.tasks.length}) : "");
    for (const [name, {item}] of Object.entries(tasks)) put(item, {className: bench.tasks_done.includes(name) ? "done" : ""});
    if (bench.task === shownTask) return;
    shownTask = bench.task;
    if (!row) return;
    write("task-title", phrase(row.title));
    write("task-does", phrase(row.does));
    const answers = Object.entries(row.answers);
    put(by("task-share"), {hidden: answers.length > 0});
    by("answers").replaceChildren(...answers.map(([text, value]) => {
      const button = make("button", text);
      button.addEventListener("click", () => send("answer", {value}));
      return button;
    }));
    by("task").scrollIntoView({block: "nearest"});
  }

  /** Say what the chosen experiment finds out, and how long it takes at the present speed of the bench. */
  function sayWhatItAsks() {
    const {asks, length_s} = about.experiments.find(({name}) => name === by("experiment").value);
    const speed = Number(by("speed").value), length = lapse(length_s);
    const soon = speed === 1 ? phrase("About {length} of the bench.", {length}) : phrase("About {length} of the bench, {time} at {speed} ×.", {length, time: lapse(length_s / speed), speed: short(speed)});
    write("asks", `${phrase(asks)} ${soon}`);
  }
  for (const id of ["experiment", "speed"]) by(id).addEventListener("change", sayWhatItAsks);
  sayWhatItAsks();

  /** Change a field by a step, within its limits; what is no number stays, and is refused. */
  function stepBy(id, step) {
    const field = by(id), value = numberIn(field.value) + step;
    const {min, max} = field.dataset;
    if (Number.isFinite(value)) field.value = fixed(Math.min(Math.max(value, Number(min)), Number(max)), 2);
    field.dispatchEvent(new Event("change"));
  }

  /** Tune by a step, as with the keys. */
  function step(hz) {
    if (!by("controls").disabled) stepBy("frequency", hz);
  }

  function press(id, on, text) {
    put(by(id), {ariaPressed: String(on)});
    write(id, text);
  }

  /** @param {boolean} down whether the top is down while nothing is recorded. */
  function show(bench, about_run, readings, down) {
    if (!bench) return;
    const elsewhere = Boolean(bench.folder) && !bench.busy;  // another program's bench records the run that is shown
    if (elsewhere !== now.elsewhere) {
      put(by("controls"), {disabled: !allowed || elsewhere});
      if (allowed && (elsewhere || now.elsewhere)) write("said", elsewhere ? phrase("Another program records this run: the practice bench rests until it ends, or until you go back to it.") : "");
      now.elsewhere = elsewhere;
    }
    now.bench = elsewhere ? now.bench || bench : bench;
    guide(now.bench, about_run, readings);
    if (elsewhere) return;
    const {drive} = bench;
    Object.assign(now, {drive: Boolean(drive?.output), busy: bench.busy, paused: bench.paused});
    by("back").classList.toggle("main", down);
    press("drive", now.drive, now.drive ? phrase("Drive off") : phrase("Drive on"));
    press("hold", now.paused, now.paused ? phrase("Let time go on") : phrase("Stop time"));
    write("record", now.busy ? phrase("End run") : phrase("Record"));
    for (const id of ["drive", "match", "back", "frequency", "frequency-slider", "amplitude", "amplitude-slider", "experiment", "group", "seed"]) {
      put(by(id), {disabled: now.busy});
    }
    if (bench.seed !== now.seed) put(by("seed"), {value: String(now.seed = bench.seed)});  // else a person may be typing
    names.forEach((name, k) => knobs[k].show(bench.what_if[name]));
    showTask(bench);
    for (const part of ["what-if", "tasks"]) put(by(part), {inert: now.busy});
    put(by("analyze"), {disabled: now.busy || !readings || about_run?.status === "running"});
    if (drive && !timer && document.activeElement !== by("frequency") && document.activeElement !== by("frequency-slider")) {
      follow("frequency", drive.frequency_hz, 2);
    }
    if (drive && !timer && !/^amplitude/.test(document.activeElement?.id)) follow("amplitude", drive.amplitude_vpp, 2);
    if (bench.speed && bench.speed !== now.speed) {
      choose(by("speed"), now.speed = bench.speed);
      sayWhatItAsks();
    }  // else it may just be chosen
  }

  function follow(id, value, decimals) {
    if (!(value > 0) || by(id).getAttribute("aria-invalid") === "true") return;  // what is wrong stays beside its message
    const text = String(Number(value.toFixed(decimals)));
    if (by(id).value === local(text)) return;
    put(by(id), {value: local(text)});
    by(`${id}-slider`).value = text;
  }

  function guide(bench, run_now, readings) {
    const name = run(), recorded = Boolean(run_now) && run_now.status !== "running" && readings > 0 && isOwn(name);  // by this bench
    const done = {
      drive: bench.took_hold, tune: bench.tuned_up, record: recorded, analyze: recorded && now.analyzed === name, report: recorded && now.read === name,
    };
    const items = [...by("guide").children], last = items.map((item) => Boolean(done[item.dataset.step])).lastIndexOf(true);
    items.forEach((item, k) => {  // a run drives the top itself: it has done the steps before it
      put(item, {className: k <= last ? "done" : k === last + 1 ? "now" : ""});
      put(item, {ariaCurrent: item.className === "now" ? "step" : null});
    });
  }

  async function openResult(name) {
    if (!name) return;
    by("result").showModal();
    await showResult(
      () => command({do: "analyze", run: name}), `run/${encodeURIComponent(name)}`, () => by("result").open, () => { now.analyzed = name; });
  }

  return {
    show, step, hear, get ended() { return now.ended; },
    act: (id) => by(id).click(),
  };
}

/** Choose the option nearest to a value; one that is not there is added. */
function choose(select, value) {
  const text = String(value);
  if (![...select.options].some(({value: there}) => there === text)) select.append(option(`${local(text)} ×`, text));
  select.value = text;
}
