// A data file as it was understood: its columns, what to correct, and from there the analysis and the report.

import {ask, takeToken} from "./connection.js";
import {takeDrops, takeFiles} from "./drop.js";
import {numberField} from "./field.js";
import {drawReadings, sheet} from "./plot.js";
import {showResult} from "./result.js";
import {by, make, option, phrase, turnLanguage, write} from "./words.js";

const HEADS = [phrase("Column"), phrase("Understood as"), phrase("Unit"), phrase("First values")];
const token = takeToken();
let quantities = {}, look = null;
window.levilab = {get look() { return look; }};  // what tests read

// --- what the server knows ---

async function begin() {
  if (!token) return write("said", phrase("This page may only look: open the address that the terminal shows."));
  const {files, folder, quantities: known, error} = await ask({do: "list files"}, token);
  if (error) return write("said", error);
  quantities = known;
  write("kept-in", phrase("Dropped files are kept in {folder}", {folder}));
  listFiles(files);
  takeDrops(token, open, (text) => write("said", text));
  by("chosen").disabled = false;
  const asked = new URLSearchParams(location.search).get("file");
  const first = files.find(({file}) => file === asked) || files[0];
  if (first) await open(first.file);
}

function listFiles(files) {
  by("choose").hidden = files.length < 2;
  by("files").replaceChildren(...files.map(({file, name}) => option(name, file)));
}

/** Open a file by its id, with the options that it has. */
async function open(file) {
  history.replaceState(null, "", `open?file=${file}`);
  listFiles((await ask({do: "list files"}, token)).files || []);
  by("files").value = file;
  by("result").hidden = true;
  await lookAt({do: "look at a file", file});
  by("file").focus();
}

/** Ask how the file is understood, with other options perhaps. */
async function lookAt(wanted) {
  const answer = await ask(wanted, token);
  if (answer.error) {
    if (look) hold(phrase("It was not taken, as said above: correct it, or undo corrections."));
    return write(look ? "problem" : "said", answer.error);
  }
  look = answer;
  show();
}

const correct = (options) => lookAt({do: "look at a file", file: look.file, options});

// --- what is shown ---

/** A message of the server: the file by its name, and options as they stand here. */
const inWords = (text) => text.replaceAll(look.path, look.name).replaceAll("`skip_doubtful`", phrase("the button below")).replaceAll(/`(\w+)`( =)?/g, "$1");

function show() {
  by("file").hidden = false;
  document.title = `${look.name} – levilab`;
  write("name", look.name);
  write("holds", look.holds);
  write("problem", look.problem && !look.runs.some(({problem}) => problem === look.problem) ? inWords(look.problem) : "");
  by("doubts").replaceChildren(...look.runs.flatMap((run) => run.doubts.map(doubtOf)));
  by("runs").replaceChildren(...look.runs.map(runOf));
  look.runs.forEach((_, k) => draw(k));
  by("record").hidden = !look.channels.length && look.rate === null;
  by("channel").replaceChildren(...look.channels.map((name) => option(name)));
  by("channel").closest("label").hidden = look.channels.length < 2;
  by("channel").selectedIndex = Math.max(0, look.runs[0]?.columns.findIndex(({quantity}) => quantity === "signal") ?? 0);
  by("film").hidden = !look.film;
  rim.set(String(look.options.rim_mm ?? ""));
  rate.set(look.rate === null ? "" : String(Number(look.rate.toPrecision(9))));
  const notes = [...new Set(look.runs.flatMap(({warnings}) => warnings))];
  by("notes").replaceChildren(...notes.map((text) => make("li", inWords(text))));
  const asks = look.runs.some(({problem, doubts}) => problem && doubts.length);
  hold(asks ? phrase("Answer the question above first.") : look.problem ? phrase("It is not read; the reason stands above.") : "");
  by("keep").disabled = Boolean(look.problem) || !look.words.length || Boolean(look.options.rim_mm);
  by("again").disabled = !look.words.length;
  by("command").parentElement.hidden = asks;
  write("command", ["levilab analyze", look.typed, ...look.words].map((word, k) => k && /[^\w.,=/-]/.test(word) ? `"${word}"` : word).join(" "));
  const used = look.runs.flatMap(({columns}) => columns).filter(({quantity}) => quantity).map(({title, quantity, unit}) => phrase("{column} is {quantity} in {unit}", {column: title || phrase("a column"), quantity: wordsOf(quantity), unit}));
  write("news", inWords(look.problem) || `${look.name}: ${used.join(", ")}`);
}

/** Let nothing be analyzed for a reason, which stands beside the button; "" lets it. */
function hold(why) {
  by("analyze").disabled = Boolean(why);
  write("why", why);
}

const wordsOf = (quantity) => phrase(quantities[quantity]?.words || quantity);

/** A question with a button for each answer. */
function doubtOf({kind, text, choices}) {
  const box = make("div", "", "doubt");
  box.setAttribute("role", "group");
  box.setAttribute("aria-label", inWords(text));
  box.append(make("p", inWords(text)));
  if (kind === "titles") {  // each column could be each of them: the table below has the choice
    box.append(make("p", phrase("Choose below what the columns are.")));
    return box;
  }
  const row = make("div", "", "row");
  for (const choice of choices) {
    const button = make("button", choice.text);
    button.addEventListener("click", () => correct({...look.options, ...kind === "rows" ? {skip_doubtful: true} : {columns: canonical({...look.options.columns, ...choice.columns})}}));
    row.append(button);
  }
  box.append(row);
  return box;
}

/** Names of columns in full: a choice may have them as the option --columns has, t and f. */
const canonical = (columns) => Object.fromEntries(Object.entries(columns).map(([key, to]) =>
  [{t: "time_s", f: "spin_frequency_hz", u: "spin_frequency_u_hz", z: "height_m", b: "flux_density_t", bx: "flux_density_x_t", by: "flux_density_y_t", bz: "flux_density_z_t"}[key] || key, to]));

/** A run: a table of its columns, each with what it is taken for, and a small plot. */
function runOf(run, number) {
  const box = make("div", "", "run");
  if (run.name) box.append(make("h3", run.name));
  if (run.problem && !run.doubts.length) box.append(make("p", inWords(run.problem), "said"));
  if (!run.columns.length) return box;
  const table = make("table"), head = make("tr"), body = make("tbody"), top = make("thead");
  for (const text of HEADS) head.append(Object.assign(make("th", text), {scope: "col"}));
  top.append(head);
  body.append(...run.columns.map((column) => rowOf(column, run)));
  table.append(make("caption", phrase("columns of {name}", {name: run.name || look.name}), "hidden"), top, body);
  box.append(table);
  for (const [k, {x, x_axis: [xName], y_axis: [yName]}] of (look.plots[number] || []).entries()) {
    const canvas = make("canvas");
    canvas.id = `plot-${number}-${k}`;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", phrase("{count} points: {y} against {x}", {count: x.length, y: look.channels.length ? yName : phrase(yName), x: phrase(xName)}));
    box.append(canvas);
  }
  return box;
}

function rowOf(column, run) {
  const row = make("tr", "", column.quantity ? "used" : ""), title = column.title || phrase("column {number}", {number: column.index + 1});
  const cells = [Object.assign(make("th", title), {scope: "row"}), make("td"), make("td"), make("td", column.values.join("  "), "values")];
  if (look.channels.length || !quantities[column.quantity || "time_s"]) {
    cells[1].textContent = column.quantity ? phrase("{quantity}, is analyzed", {quantity: column.quantity}) : phrase("not used");
    cells[2].textContent = column.unit;
  } else {
    const quantity = selectOf(phrase("what {title} is", {title}), {"": phrase("not used"), ...Object.fromEntries(Object.keys(quantities).map((name) => [name, wordsOf(name)]))}, column.quantity || "");
    quantity.addEventListener("change", () => change(column, run, {quantity: quantity.value, unit: ""}));
    cells[1].append(quantity);
    if (column.quantity) {
      const names = [...new Set([column.unit, ...quantities[column.quantity].units])];
      const words = (unit) => unit === column.unit && column.inverse ? phrase("{unit} a turn", {unit}) : unit;
      const unit = selectOf(phrase("unit of {title}", {title}), Object.fromEntries(names.map((name) => [name, words(name)])), column.unit);
      unit.addEventListener("change", () => change(column, run, {quantity: column.quantity, unit: unit.value}));
      cells[2].append(unit);
    }
  }
  for (const [k, name] of HEADS.entries()) cells[k].dataset.head = name;
  row.append(...cells);
  return row;
}

function selectOf(name, options, value) {
  const select = make("select");
  select.setAttribute("aria-label", name);
  select.append(...Object.entries(options).map(([key, text]) => option(text, key)));
  select.value = value;
  return select;
}

// --- corrections ---

/** The option `columns` of what is understood now: numbers from 1 on, a unit only where a person has named one. */
function columnsNow(run = look.runs.find(({problem}) => !problem) || look.runs[0]) {
  const named = canonical(look.options.columns || {});
  const used = (run?.columns || []).filter(({quantity}) => quantities[quantity]);
  return Object.fromEntries(used.map(({index, quantity}) => {
    const unit = /\[[^\]]*\]\s*$/.exec(named[quantity] || "")?.[0];
    return [quantity, unit ? `${index + 1} ${unit}` : String(index + 1)];
  }));
}

/** Take a column for something else, or in another unit; what was taken for it so far is left. */
function change(column, run, {quantity, unit}) {
  const columns = columnsNow(run);
  if (column.quantity) delete columns[column.quantity];
  if (quantity) columns[quantity] = `${column.index + 1}${unit ? ` [${unit}]` : ""}`;
  const {columns: _, ...others} = look.options;
  return correct(Object.keys(columns).length ? {...others, columns} : others);
}

by("channel").addEventListener("change", () => correct({...look.options, channel: by("channel").value}));
const rim = numberField("rim", (value) => correct({...look.options, rim_mm: Number.isNaN(value) ? null : value}), true);
const rate = numberField("rate", (value) => correct({...look.options, rate: value}));
by("again").addEventListener("click", () => correct({}));
by("keep").addEventListener("click", async () => {
  const {kept, error} = await ask({do: "keep", file: look.file}, token);
  write("news", error || phrase("kept in {file}", {file: kept}));
  if (error) write("problem", error);
  else await lookAt({do: "look at a file", file: look.file});
});
by("analyze").addEventListener("click", async () => {
  const {file} = look;
  by("result").hidden = false;
  by("result").focus();
  const isThere = await showResult(
    async () => (await ask({do: "analyze a file", file}, token)).error || "", `file/${file}`, () => look.file === file, () => {});
  by("command").parentElement.hidden ||= !isThere && look.file === file;  // it fails there, too
});

by("language").addEventListener("change", turnLanguage);
by("files").addEventListener("change", () => open(by("files").value));
by("chosen").addEventListener("change", async () => {
  await takeFiles(by("chosen").files, token, open, (text) => write("said", text));
  by("chosen").value = "";
});

by("samples").addEventListener("click", async ({target: {value: name}}) => {
  if (name) await takeFiles([new File([await (await fetch(`page/${name}`)).blob()], name)], token, open, (text) => write("said", text));
});

// --- the small plots ---

function draw(number) {
  for (const [k, plot] of (look.plots[number] || []).entries()) {
    const canvas = by(`plot-${number}-${k}`), values = Float64Array.from(plot.y);
    if (canvas) drawReadings(sheet(canvas), {
      x: Float64Array.from(plot.x), low: values, high: values, u: null, fit: null, single: true, xAxis: [...plot.x_axis, 1], yAxis: [...plot.y_axis, 1, look.channels.length > 0],
    }, -1);
  }
}
new ResizeObserver(() => look?.runs.forEach((_, k) => draw(k))).observe(by("runs"));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => look?.runs.forEach((_, k) => draw(k)));
begin();
