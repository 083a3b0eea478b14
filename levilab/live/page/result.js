// What an analysis says, as it comes: verdict, notes, figures and the link to the report.

import {GONE, read} from "./connection.js";
import {LANGUAGE, by, make, phrase, write} from "./words.js";

/**
 * Ask for an analysis, and show its answer in the elements "verdict", "figures", "report" and "writing".
 *
 * @param {() => Promise<string>} begin asks for it; what is wrong, or "".
 * @param {string} at address of the input on the server.
 * @param {() => boolean} wanted whether its answer is still looked at.
 * @param {() => void} analyzed is called once there is an answer.
 */
export async function showResult(begin, at, wanted, analyzed) {
  by("verdict").replaceChildren(make("p", phrase("Analyzing…")));
  by("figures").replaceChildren();
  by("report").hidden = true;
  write("writing", "");
  const wrong = await begin();
  if (wrong) return say(wrong);
  for (;;) {
    await new Promise((go) => { setTimeout(go, 400); });
    const found = await read(`${at}/analysis?language=${LANGUAGE}`);
    if (!wanted()) return;
    if (!found) return say(GONE);
    if (found.running && !found.verdict?.length) continue;
    if (found.failed) return say(found.failed);
    analyzed();
    by("verdict").replaceChildren(
      ...(found.verdict || []).map((text) => make("p", text)), ...(found.warnings || []).map((text) => make("p", phrase("Note: {text}", {text}), "note")));
    if (!by("figures").children.length) by("figures").replaceChildren(...found.figures.map((figure) => {
      const image = make("img");
      image.src = `${at}/${figure}?${Date.now()}`;
      image.alt = phrase("figure of the {analysis} analysis", {analysis: found.analysis});
      return image;
    }));
    if (found.report) {
      by("report").href = `${at}/${found.report}`;
      by("report").hidden = false;
    }
    write("writing", found.running && !found.report ? phrase("The report is being written; its link appears here.") : "");
    if (!found.running) return;
  }
}

const say = (wrong) => by("verdict").replaceChildren(make("p", wrong));
