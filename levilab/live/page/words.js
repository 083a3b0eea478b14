// Numbers and small texts for people. Whatever comes from a run goes into the page as text, never as markup.

export const by = (id) => document.getElementById(id);

/** What the server has put into the page: the language's decimal sign, and English text → text. */
const TABLE = JSON.parse(by("texts").textContent);
export const LANGUAGE = document.documentElement.lang;

/** A text in the language of the page; {name} stands for a value. */
export const phrase = (english, values = {}) => (TABLE.texts[english] ?? english).replace(/\{(\w+)\}/g, (_, name) => values[name]);

/** Load the page again in the language that was chosen; the server keeps it. */
export function turnLanguage({target}) {
  const address = new URL(location);
  address.searchParams.set("language", target.value);
  location.replace(address);
}

/** Numbers in a text with the decimal sign of the language. */
export const local = (text) => text.replace(/(?<=\d)\.(?=\d)/g, TABLE.decimal);

/** Change properties of an element, and touch the page only where they change: a reader of the screen looks each time. */
export function put(element, properties) {
  for (const [name, value] of Object.entries(properties)) if (element[name] !== value) element[name] = value;
}

/** Write a text into an element. */
export const write = (id, text) => put(by(id), {textContent: text});

/** Return a number with these decimals, a zero without a sign; a dash where there is none. */
export const fixed = (value, decimals) =>
  Number.isFinite(value) ? local(value.toFixed(decimals)).replace(/^-(?=[0.,]+$)/, "").replace("-", "−") : "–";

/** Return a number to these digits, without zeros at the end. */
export const short = (value, digits = 4) =>
  Number.isFinite(value) ? local(String(Number(value.toPrecision(digits)))).replace("-", "−") : "–";

/** Seconds as 34 s, 2:05 min or 1:02:05; in minutes from `least` seconds on. */
export function lapse(seconds, least = 100) {
  if (!Number.isFinite(seconds)) return "";
  const whole = Math.round(Math.abs(seconds)), sign = seconds < -0.5 ? "−" : "";
  if (whole < least) return `${sign}${whole} s`;
  const two = (n) => String(n).padStart(2, "0");
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  return sign + (h ? `${h}:${two(m)}:${two(s)}` : `${m}:${two(s)} min`);
}

/** The number that a person typed, with a decimal point or a decimal comma; NaN where it is none. */
export const numberIn = (text) => /^[+\u2212-]?(\d+[.,]?\d*|[.,]\d+)$/.test(text.trim()) ? Number(text.trim().replace("\u2212", "-").replace(",", ".")) : NaN;

/** Return two limits of a time that is left [s] as text: "about 20 to 40 s", "at most 30 s"; "" where both are over. */
export function between(from, to) {
  const round = (seconds) => Math.round(seconds / 5) * 5;
  if (to < 0) return "";
  if (round(from) <= 0) return phrase("at most {time}", {time: lapse(Math.max(5, Math.ceil(to / 5) * 5))});
  const [first, last] = [lapse(round(from)), lapse(round(to))];
  if (first === last) return phrase("about {time}", {time: first});
  const unit = / (s|min)$/.exec(first)?.[0];
  return phrase("about {first} to {last}", {first: unit && last.endsWith(unit) ? first.slice(0, -unit.length) : first, last});
}

/** Write plain notation: what follows ^ in brackets, or as a number, is raised. */
export function typeset(element, text) {
  element.replaceChildren(...text.split(/(\^\([^()]*\)|\^[−-]?[\d½]+)/).filter(Boolean).map((piece) => {
    if (!piece.startsWith("^")) return document.createTextNode(piece);
    const raised = document.createElement("sup");
    raised.textContent = piece.replace(/^\^\(?|\)$/g, "");
    return raised;
  }));
}

/** An element with a class and a text. */
export function make(tag, text = "", className = "") {
  const element = document.createElement(tag);
  element.textContent = text;
  if (className) element.className = className;
  return element;
}

/** A row of a list to choose from. */
export const option = (text, value = text) => Object.assign(make("option", text), {value});

/** The colours of the style sheet, by their names; read again when the day turns to night. */
export function colours() {
  const style = getComputedStyle(document.documentElement);
  return new Proxy({}, {get: (_, name) => style.getPropertyValue(`--${name}`).trim()});
}
