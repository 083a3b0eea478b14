// The bench for practice: controls that send commands, and the guide that shows how far one is.

import {read} from "./connection.js";
import {numberField} from "./field.js";
import {showResult} from "./result.js";
import {LANGUAGE, by, fixed, lapse, local, make, option, phrase, put, short, write} from "./words.js";

/** What the fields of the drive set. */
const KEYS = {frequency: "frequency_hz", amplitude: "amplitude_vpp"};
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
  for (const {name, title} of about.experiments) by("experiment").append(Object.assign(option(phrase(title), name), {selected: name === sessionStorage.getItem("experiment")}));
  const now = {drive: false, busy: false, paused: false, analyzed: "", ended: false, elsewhere: null, bench: null, read: sessionStorage.getItem("read")};

  put(by("controls"), {disabled: true});  // until the bench is there
  if (!allowed) write("said", phrase("This page may only look: open the address that the terminal shows."));

  /** @param field {refuse} that has the values: what is wrong stands beside it; without one below the controls. */
  async function send(what, values = {}, field = null) {
    const wrongs = what === "record a run" || values.task ? document.querySelector("#controls [aria-invalid=true]") : null;
    if (wrongs) return write("said", phrase("First correct this: {field}, {why}", {field: wrongs.ariaLabel || wrongs.labels[0].firstChild.data.trim(), why: by(`${wrongs.id}-wrong`).textContent}));
    now.slowed = values.task ? Number(by("speed").value) > 1 : now.slowed;  // at 10 × the top is down before a person has read the task
    if (values.task && now.slowed) await command({do: "set the speed", speed: 1});
    if (allowed) write("said", "");  // and not later: what the bench says may come before the answer
    const wrong = await command({do: what, ...values});
    if (!allowed || !wrong) return;
    write("said", field ? "" : wrong);
    field?.refuse(wrong);
  }

  /** What the bench says: a refusal, or a line for the person at it. */
  function hear({kind, text, status}) {
    now.ended ||= kind === "ended";
    if (allowed && (kind === "done" || kind === "recording")) write("said", "");
    const stands = [...document.querySelectorAll(".wrong")].some(({textContent}) => textContent === text);
    if (allowed && !stands && (kind === "refused" || kind === "ended" || (kind === "recorded" && status === "failed"))) write("said", text);
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
    if (!values || now.busy) return undefined;
    return send("tune the drive", values, fields[Object.keys(KEYS).find((id) => KEYS[id] in values)]);
  }
  const fields = Object.fromEntries(Object.entries(KEYS).map(([id, key]) => {
    const slider = by(`${id}-slider`);
    const field = numberField(id, (value) => {  // a value between the steps of the slider is as good: the drive takes any
      slider.value = String(value);
      tune({[key]: value});
    });
    slider.addEventListener("input", () => {
      field.set(slider.value);
      tune({[key]: Number(slider.value)});
    });
    return [id, {
      ...field,
      follow(value) {
        if (timer || !(value > 0) || document.activeElement === slider) return;
        const text = String(Number(value.toFixed(2)));
        field.show(text);
        if (slider.value !== text) slider.value = text;
      },
    }];
  }));
  const seed = numberField("seed", (value) => send("take a seed", {seed: Number.isFinite(value) ? value : null}, seed), true);

  const does = {
    drive: () => send("switch the drive", {on: !now.drive}),
    match: () => {
      now.matched = true;
      send("match the drive");
    },
    back: () => {
      now.matched = false;
      send("put the top back");
    },
    hold: () => send("pause", {on: !now.paused}),
    record: () => now.busy ? send("stop the run") : send("record a run", {experiment: by("experiment").value, group: by("group").value}),
    analyze: () => openResult(run()),
    report: () => sessionStorage.setItem("read", now.read = run()),
  };
  for (const [id, act] of Object.entries(does)) {
    by(id).addEventListener("click", async () => {
      await sendTune();  // what was typed just before comes first
      act();
    });
  }
  by("speed").addEventListener("change", () => send("set the speed", {speed: Number(by("speed").value)}));

  by("group").addEventListener("change", () => send("take a seed", {group: by("group").value}));

  // what if
  const knobs = Object.entries(about.what_if).map(([name, row]) => {
    const label = make("label", "", "quantity"), value = make("output"), input = make("input"), title = phrase(row.title);
    value.ariaLive = "off";  // what the slider is at, its own text says
    Object.assign(input, {type: "range", min: row.low, max: row.high, step: row.step, value: row.usual});
    input.id = name;
    input.setAttribute("aria-label", `${title}, ${row.unit}`);
    input.setAttribute("aria-describedby", "shows");
    label.append(make("span", title), input, value);
    by("quantities").append(label);
    for (const kind of ["focusin", "pointerenter"]) label.addEventListener(kind, () => write("shows", phrase(row.shows)));
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
  write("shows", phrase(about.what_if[names[0]].shows));
  by("usual").addEventListener("click", () => send("change the bench"));

  // the three tabs: arrow keys go from one to the next
  const tabs = [...document.querySelectorAll("[role=tab]")];
  function turnTo(chosen) {
    for (const tab of tabs) {
      const is = tab === chosen;
      put(tab, {ariaSelected: String(is), tabIndex: is ? 0 : -1});
      put(by(tab.getAttribute("aria-controls")), {hidden: !is, ariaLabel: tab.firstChild.data.trim()});
    }
  }
  tabs.forEach((tab, k) => {
    tab.addEventListener("click", () => turnTo(tab));
    tab.addEventListener("keydown", ({key}) => {
      const next = {ArrowRight: k + 1, ArrowLeft: k - 1, Home: 0, End: -1}[key];
      if (next === undefined) return;
      turnTo(tabs.at(next % tabs.length));
      tabs.at(next % tabs.length).focus();
    });
  });

  let needed = "";
  /** Mark the control that the step or the task needs; a task brings it into view, too. */
  function need(id, isOfTask) {
    if (id === needed) return;
    by(needed)?.classList.remove("needed");
    by(needed = id)?.classList.add("needed");
    if (!isOfTask) return;
    const panel = by(id)?.closest("[role=tabpanel]");
    if (panel) turnTo(tabs.find((tab) => tab.getAttribute("aria-controls") === panel.id));
    by(id)?.scrollIntoView({block: "nearest"});
  }

  // tasks
  const tasks = Object.fromEntries(about.tasks.map((row) => {
    const item = make("li"), button = make("button", phrase(row.title));
    button.addEventListener("click", () => send("begin a task", {task: row.name}));
    for (const kind of ["focusin", "pointerenter"]) item.addEventListener(kind, () => write("goal", phrase(row.does)));
    item.append(button);
    by("task-list").append(item);
    return [row.name, {...row, item}];
  }));
  by("leave-task").addEventListener("click", () => send("begin a task"));
  by("next-task").addEventListener("click", () => send("begin a task", {task: by("next-task").value}));
  let shownTask = "", reached = "";

  /** Show the task under way, else the first steps, of which none goes with a top that lies, and after those, or a task, the next. */
  function showTask(bench, isGuided, lies) {
    const row = tasks[bench.task], next = about.tasks.find(({name}) => !bench.tasks_done.includes(name));
    if (shownTask && !row) reached = bench.tasks_done.includes(shownTask) ? shownTask : "";
    put(by("task"), {hidden: !row, inert: !allowed});
    put(by("guide"), {hidden: Boolean(row) || !isGuided || lies});
    put(by("to-back"), {hidden: !lies});
    put(by("offer"), {hidden: Boolean(row) || !(reached || !isGuided && next), inert: !allowed});
    write("offer-text", reached ? `✓ ${phrase(tasks[reached].title)}: ${phrase(tasks[reached].teaches)}` : phrase("These were the first steps. Now a task:"));
    put(by("next-task"), {hidden: !next, value: next?.name ?? "", textContent: next ? phrase(next.title) : ""});
    put(by("task-share"), {value: bench.task_share});
    write("tasks-done", bench.tasks_done.length ? `${bench.tasks_done.length}/${about.tasks.length}` : "");
    for (const [name, {item}] of Object.entries(tasks)) put(item, {className: bench.tasks_done.includes(name) ? "done" : ""});
    if (!by("goal").textContent) write("goal", phrase((next ?? about.tasks[0]).does));
    if (bench.task === shownTask) return;
    shownTask = bench.task;
    if (!row) return;
    reached = "";
    write("answers-wrong", "");
    write("task-title", phrase(row.title));
    for (const place of ["task-does", "goal"]) write(place, phrase(row.does));
    if (now.slowed) by("task-does").append(` ${phrase("Time goes at 1 × again.")}`);
    if (row.measures) Object.assign(by("experiment"), {value: row.measures}).dispatchEvent(new Event("change"));
    const answers = Object.entries(row.answers);
    put(by("task-share"), {hidden: answers.length > 0});
    by("answers").replaceChildren(...answers.map(([text, value]) => {
      const button = make("button", text);
      button.addEventListener("click", () => send("answer", {value}, {refuse: (why) => write("answers-wrong", why)}));
      return button;
    }));
  }

  /** Say what the chosen experiment finds out, and how long it takes at the present speed of the bench. */
  function sayWhatItAsks() {
    const {asks, length_s} = about.experiments.find(({name}) => name === by("experiment").value);
    const speed = Number(by("speed").value), length = lapse(length_s);
    const soon = speed === 1 ? phrase("About {length} of the bench.", {length}) : phrase("About {length} of the bench, {time} at {speed} ×.", {length, time: lapse(length_s / speed), speed: short(speed)});
    write("asks", `${phrase(asks)} ${soon}`);
    sessionStorage.setItem("experiment", by("experiment").value);  // another language loads the page again
  }
  for (const id of ["experiment", "speed"]) by(id).addEventListener("change", sayWhatItAsks);
  sayWhatItAsks();

  /** Tune by a step, as with the keys. */
  function step(hz) {
    if (!by("controls").disabled) fields.frequency.stepBy(hz);
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
    const steps = guide(now.bench, about_run, readings);
    if (elsewhere) return;
    const {drive} = bench;
    Object.assign(now, {drive: Boolean(drive?.output), busy: bench.busy, paused: bench.paused});
    press("drive", now.drive, now.drive ? phrase("Drive off") : phrase("Drive on"));
    press("hold", now.paused, now.paused ? phrase("Let time go on") : phrase("Stop time"));
    write("record", now.busy ? phrase("End run") : phrase("Record"));
    for (const id of ["drive", "match", "back", "frequency", "frequency-slider", "amplitude", "amplitude-slider", "experiment", "group", "seed"]) {
      put(by(id), {disabled: now.busy});
    }
    if (bench.seed !== now.seed) seed.set(String(now.seed = bench.seed));  // else a person may be typing
    names.forEach((name, k) => knobs[k].show(bench.what_if[name]));
    const task = tasks[bench.task], isMeasured = Boolean(task?.measures) && readings > 0 && about_run?.experiment === task.measures;
    const lies = Boolean(down && (task ? task.needs !== "washers_g" && !isMeasured : steps && steps !== "analyze"));  // a top of another mass is no use back
    showTask(bench, Boolean(steps), lies);
    const next = now.busy ? "" : lies ? "back" : task?.needs ?? steps;
    need(next, Boolean(bench.task));
    for (const id of ["match", "back", "record", "analyze"]) by(id).classList.toggle("main", id === (next || (down ? "back" : "record")));  // one at most
    for (const part of ["what-if", "tasks", "offer"]) put(by(part), {inert: now.busy || !allowed});
    put(by("analyze"), {disabled: now.busy || !readings || about_run?.status === "running"});
    if (drive) {
      const goal = bench.goal_hz ?? drive.frequency_hz, moves = drive.output && Math.abs(goal - drive.frequency_hz) >= 0.01;
      fields.frequency.follow(goal);
      fields.amplitude.follow(drive.amplitude_vpp);
      write("frequency-now", moves ? phrase("now {value}", {value: fixed(drive.frequency_hz, 2)}) : "");
    }
    if (bench.speed && bench.speed !== now.speed) {
      choose(by("speed"), now.speed = bench.speed);
      sayWhatItAsks();
    }  // else it may just be chosen
  }

  /** Tick the steps that are done.  Returns the control that the next one needs; "" where all are done. */
  function guide(bench, run_now, readings) {
    const name = run(), recorded = Boolean(run_now) && run_now.status !== "running" && readings > 0 && isOwn(name);  // by this bench
    const done = {
      drive: bench.took_hold, tune: bench.tuned_up || now.busy, record: recorded, analyze: recorded && now.analyzed === name, report: recorded && now.read === name,
    };
    if (recorded && now.looked !== name) {  // another page may have analyzed it
      now.looked = name;
      read(`run/${encodeURIComponent(name)}/analysis?language=${LANGUAGE}`).then((found) => { if (found?.verdict?.length) take(found.verdict, name); });
    }
    const items = [...by("guide").children], last = items.map((item) => Boolean(done[item.dataset.step])).lastIndexOf(true);
    items.forEach((item, k) => {  // a run drives the top itself: it has done the steps before it
      put(item, {className: k <= last ? "done" : k === last + 1 ? "now" : ""});
      put(item, {ariaCurrent: item.className === "now" ? "step" : null});
    });
    put(by("to-record"), {hidden: now.busy});
    put(by("recording"), {hidden: !now.busy});
    const needs = {drive: now.matched ? "drive" : "match", tune: "frequency", record: "record", analyze: "analyze", report: "analyze"};
    now.learned ||= last === items.length - 1;  // the next run brings the steps not back
    return now.learned ? "" : needs[items[last + 1].dataset.step];
  }

  /** Open the result of a run: the one that was asked for last, under way or over, or a new one. */
  async function openResult(name) {
    if (!name) return;
    by("result").showModal();
    if (now.asked === name) return;
    now.asked = name;
    const is = () => now.asked === name;
    const isThere = await showResult(
      () => command({do: "analyze", run: name}), `run/${encodeURIComponent(name)}`, is, (verdict) => take(verdict, name));
    if (is() && !isThere) now.asked = "";
  }

  const take = (verdict, name) => Object.assign(now, {analyzed: name, verdict: verdict.slice(0, 2)});
  /** Whether the running fit of an experiment would give away what the task under way asks for: until it is analyzed. */
  const hidesFit = (experiment) => now.analyzed !== run() && Boolean(experiment) && tasks[now.bench?.task]?.measures === experiment;

  return {
    show, step, hear, hidesFit, get ended() { return now.ended; },
    /** What the analysis of the run that is shown says; nothing before. */
    get verdict() { return now.analyzed === run() ? now.verdict : []; },
    act: (id) => by(id).click(),
  };
}

/** Choose the option nearest to a value; one that is not there is added. */
function choose(select, value) {
  const text = String(value);
  if (![...select.options].some(({value: there}) => there === text)) select.append(option(`${local(text)} ×`, text));
  select.value = text;
}
