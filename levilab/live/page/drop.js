// Files that are dropped into a page, or chosen in it: they go to the server, which keeps and reads them.

import {send} from "./connection.js";
import {phrase} from "./words.js";

/** Send a file. Returns its id on the server, or {error}. */
export const sendFile = (file, token) =>
  send("file", file, {"X-Levilab-Token": token, "X-Levilab-Name": encodeURIComponent(file.name)});

/**
 * Take files that are dropped anywhere into the page.
 *
 * @param {(file: string) => void} opened is called with the id of the last of them.
 * @param {(text: string) => void} say shows what is under way, or wrong.
 */
export function takeDrops(token, opened, say) {
  const carries = (event) => [...event.dataTransfer?.types || []].includes("Files");
  let inside = 0;
  const mark = (by) => {
    inside = Math.max(0, inside + by);
    document.body.classList.toggle("dropping", inside > 0);
  };
  addEventListener("dragenter", (event) => carries(event) && mark(1));
  addEventListener("dragleave", (event) => carries(event) && mark(-1));
  addEventListener("dragover", (event) => carries(event) && event.preventDefault());
  addEventListener("drop", (event) => {
    if (!carries(event)) return;
    event.preventDefault();
    mark(-inside);
    takeFiles(event.dataTransfer.files, token, opened, say);
  });
}

/** Send files one after the other, and open the last. */
export async function takeFiles(files, token, opened, say) {
  let last = "";
  for (const file of files) {
    say(phrase("Reading {name}…", {name: file.name}));
    const {file: id, error} = await sendFile(file, token);
    if (error) return say(error);
    last = id;
  }
  say("");
  if (last) opened(last);
}
