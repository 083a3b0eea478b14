// What an analysis says, always in one order: its sentences, figures, notes, and the link to the report.

import {GONE, read} from "./connection.js";
import {LANGUAGE, by, make, phrase, put, typeset, write} from "./words.js";

/** What is under way, by the step that the server names; "" once all is there. */
const STEPS = {analyze: phrase("Analyzing…"), report: phrase("The report is being written…"), "": ""};

/**
 * Ask for an analysis, and show its answer in the elements "verdict", "figures", "notes" and "report".  Nothing is shown
 * before it is whole: sentences, figures and notes once the analysis is over, the link once the report is written.
 *
 * @param {() => Promise<string>} begin asks for it; what is wrong, or "".
 * @param {string} at address of the input on the server.
 * @param {() => boolean} wanted whether its answer is still looked at.
 * @param {() => void} analyzed is called once there is an answer.
 */
export async function showResult(begin, at, wanted, analyzed) {
  const clear = (texts, step) => {
    by("verdict").replaceChildren(...texts.map((text) => {
      const paragraph = make("p");
      typeset(paragraph, text);
      return paragraph;
    }));
    for (const id of ["figures", "results-notes"]) by(id).replaceChildren();
    put(by("report"), {hidden: true});
    say(step);
  };
  clear([], "analyze");
  const wrong = await begin();
  if (wrong) return clear([wrong], "");
  for (let isShown = false; ;) {
    await new Promise((go) => { setTimeout(go, 400); });
    const found = await read(`${at}/analysis?language=${LANGUAGE}`);
    if (!wanted()) return;
    if (!found || found.failed) return clear([found?.failed || GONE], "");
    if (found.step !== "analyze" && !isShown) {
      isShown = true;
      analyzed();
      clear(found.verdict || [], found.step);
      by("figures").append(...found.figures.map((figure) => Object.assign(make("img"), {
        src: `${at}/${figure}?${Date.now()}`, alt: phrase("figure of the {analysis} analysis", {analysis: found.analysis}),
      })));
      by("results-notes").append(...(found.warnings || []).map((text) => make("li", text)));
    }
    say(found.step);
    if (found.step) continue;
    put(by("report"), {href: `${at}/${found.report}`, hidden: !found.report});
    return;
  }
}

/** Say what is under way. */
function say(step) {
  put(by("progress"), {hidden: !step});
  write("writing", STEPS[step]);
}
