// A field for a number: what it refuses stays in it, with the reason beside it.

import {by, fixed, local, numberIn, phrase, write} from "./words.js";

/**
 * @param id of the field; its data have min, max, step, unit, and whole where no fraction is taken.  "id-wrong" says what is wrong.
 * @param {(value: number) => void} take gets each number that is allowed, NaN for an empty field that may be empty.
 * @param {boolean} mayBeEmpty whether an empty field is taken; else it waits.
 */
export function numberField(id, take, mayBeEmpty = false) {
  const field = by(id), {min, max, step, whole, unit} = field.dataset, most = local(max) + (unit ? ` ${phrase(unit)}` : "");

  /** Say what is wrong; "" where nothing is. */
  function refuse(why) {
    write(`${id}-wrong`, why);
    field.setAttribute("aria-invalid", String(Boolean(why)));
  }

  function pass() {
    const seen = field.value.trim(), value = numberIn(seen);
    if (!seen) {
      refuse("");
      if (mayBeEmpty) take(NaN);
    } else if (!Number.isFinite(value) || (whole !== undefined && !Number.isInteger(value))) {
      refuse(phrase(whole === undefined ? "a number from {min} to {max}, not {seen}" : "a whole number from {min} to {max}, not {seen}", {min: local(min), max: most, seen}));
    } else if (value < Number(min) || value > Number(max)) refuse(phrase("from {min} to {max}, not {seen}", {min: local(min), max: most, seen}));
    else {
      refuse("");
      field.value = local(String(value));
      take(value);
    }
  }

  /** Change the number by a step, within its limits; what is no number stays, and is refused. */
  function stepBy(size) {
    const value = numberIn(field.value) + size;
    if (Number.isFinite(value)) field.value = fixed(Math.min(Math.max(value, Number(min)), Number(max)), 2);
    pass();
  }

  field.addEventListener("input", () => refuse(""));  // else it goes at a click on a button, which moves away from under it
  field.addEventListener("change", pass);
  if (step) {
    field.addEventListener("keydown", (event) => {
      const way = {ArrowUp: 1, ArrowDown: -1}[event.key];
      if (!way) return;
      event.preventDefault();
      stepBy(way * Number(step));
    });
  }
  return {
    stepBy, refuse,
    /** Show a number that comes from elsewhere; what is refused stays until a person corrects it. */
    show(value) {
      if (field.getAttribute("aria-invalid") === "true" || document.activeElement === field) return;
      const text = local(String(value));
      if (field.value !== text) field.value = text;
    },
    /** Take another's number, as a slider's, in place of what stands there. */
    set(text) {
      field.value = local(text);
      refuse("");
    },
  };
}
