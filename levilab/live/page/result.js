// What an analysis says, always in one order: doubts, the answer, figures, all else in a fold, the link to the report.

import {GONE, read} from "./connection.js";
import {LANGUAGE, by, lapse, make, phrase, put, typeset, write} from "./words.js";

/** Sentences that are the answer: the value with its u, what is excluded, and what is not; the others are in the fold. */
const ANSWER = 3;
/** What is under way, by the step that the server names; "" once all is there. */
const STEPS = {
  analyze: phrase("Analyzing: some seconds, the first time longer."),
  report: phrase("The report is being written, with a simulation of the run: up to a minute."), "": "",
};

/**
 * Ask for an analysis, and show its answer in the elements of the page's part "result".  Nothing is shown
 * before it is whole: sentences, figures and notes once the analysis is over, the link once the report is written.
 *
 * @param {() => Promise<string>} begin asks for it; what is wrong, or "".
 * @param {string} at address of the input on the server.
 * @param {() => boolean} wanted whether its answer is still looked at.
 * @param {(verdict: string[]) => void} analyzed is called once there is an answer.
 * @returns whether the report was written, too.
 */
export async function showResult(begin, at, wanted, analyzed) {
  const began = performance.now();
  const fill = (id, tag, texts) => by(id).replaceChildren(...texts.map((text) => {
    const one = make(tag);
    typeset(one, text);
    return one;
  }));
  const clear = (texts, step, {doubts = [], warnings = []} = {}) => {
    fill("doubts", "li", doubts);
    fill("verdict", "p", texts.slice(0, ANSWER));
    fill("verdict-more", "p", texts.slice(ANSWER));
    fill("results-notes", "li", warnings);
    by("figures").replaceChildren();
    put(by("more"), {hidden: texts.length <= ANSWER && !warnings.length, open: false});
    put(by("report"), {hidden: true});
    say(step, began);
  };
  clear([], "analyze");
  const wrong = await begin();
  if (wrong) {
    if (wanted()) clear([wrong], "");
    return false;
  }
  for (let isShown = false; ;) {
    await new Promise((go) => { setTimeout(go, 400); });
    const found = await read(`${at}/analysis?language=${LANGUAGE}`);
    if (!wanted()) return false;
    if (!found || found.failed) {
      clear([found?.failed || GONE], "");
      return false;
    }
    if (found.step !== "analyze" && !isShown) {
      isShown = true;
      analyzed(found.verdict);
      clear(found.verdict, found.step, found);
      by("figures").append(...found.figures.map((figure) => Object.assign(make("img"), {
        src: `${at}/${figure}?${Date.now()}`, alt: phrase("figure of the {analysis} analysis", {analysis: found.analysis}),
      })));
    }
    say(found.step, began);
    if (found.step) continue;
    put(by("report"), {href: `${at}/${found.report}`, hidden: !found.report});
    return Boolean(found.report);
  }
}

/** Say what is under way, how long it takes, and since when it is. */
function say(step, began) {
  put(by("progress"), {hidden: !step});
  write("writing", STEPS[step]);
  write("so-far", step && lapse((performance.now() - began) / 1000));
}
