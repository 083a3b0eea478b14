// Which washers today: what levilab tune asks at the bench, with its advice, and the washers put on here.

import {ask, command} from "./connection.js";
import {by, make, put, write} from "./words.js";

const FIELDS = ["top", "washers", "temperature"];

/** @param {string} token of a page that may give commands. */
export function openTune(token) {
  const trials = [];
  let advice = null;

  async function advise() {
    const given = Object.fromEntries(FIELDS.map((name) => [name, by(`tune-${name}`).value]));
    const found = await ask({do: "say which washers", ...given, trials}, token);
    if (found.error) {
      trials.splice(advice ? advice.trials : 0);
      return write("tune-text", found.error);
    }
    advice = {...found, trials: trials.length};
    write("tune-text", found.text);
    write("tune-why", found.why);
    put(by("tune-did"), {hidden: false});
    by("tune-trials").replaceChildren(...trials.map((text) => make("li", text.replace(/[a-z]+$/, (name) => document.querySelector(`#tune-did [value=${name}]`).textContent))));
    for (const id of ["tune-trials", "tune-text"]) by(id).scrollIntoView({block: "nearest"});  // at once: no motion
  }

  by("tune-ask").addEventListener("click", advise);
  by("tune-on").addEventListener("click", async () => {
    const wrong = await command({do: "change the bench", values: {washers_g: advice.washers_g}}, token);
    if (wrong) write("tune-text", wrong);
  });
  by("tune-did").addEventListener("click", ({target: {value: outcome}}) => {
    if (!outcome) return;
    trials.push(`${advice.washers}, ${by("tune-temperature").value}, ${outcome}`);
    advise();
  });
  by("tune-again").addEventListener("click", () => {
    trials.length = 0;
    advise();
  });
}
