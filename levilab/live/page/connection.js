// The connection to the server: the page asks for a frame, draws it, and asks for the next. Nothing queues.

import {LANGUAGE, phrase} from "./words.js";

export const GONE = phrase("the server is gone: start levilab live again");

/** A frame with its arrays, row by row, as levilab/telemetry/codec.py packs it. */
export function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  return JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)), (_, value) => {
    if (!Array.isArray(value?.$array)) return value;
    const [kind, shape, first] = value.$array;
    return new {"<f4": Float32Array, "|b1": Uint8Array}[kind](buffer, 4 + length + first, shape.reduce((a, b) => a * b, 1));
  });
}

/**
 * Ask for frames until closed; after a break it tries again, at most every 5 s.
 *
 * @param {() => object} ask what the page has, and what it wants.
 * @param {(frame: object) => void} show draws a frame.
 * @param {(open: boolean) => void} changed whether the server is there.
 */
export function connect({run, ask, show, changed}) {
  let socket, closed = false, pause = 250, waiting = false;

  function next() {
    if (waiting || closed || socket.readyState !== WebSocket.OPEN) return;
    waiting = true;
    socket.send(JSON.stringify(ask()));
  }

  function open() {
    if (closed) return;
    socket = new WebSocket(`ws://${location.host}${location.pathname}frames?run=${encodeURIComponent(run)}&language=${LANGUAGE}`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      pause = 250;
      waiting = false;
      changed(true);
      next();
    };
    socket.onmessage = ({data}) => {
      waiting = false;
      show(unpack(data));
      // the browser draws first: a page in the background, which is not drawn, asks once a second
      if (document.hidden) setTimeout(next, 1000);
      else requestAnimationFrame(next);
    };
    socket.onclose = () => {
      if (closed) return;
      changed(false);
      pause = Math.min(2 * pause, 5000);
      setTimeout(open, pause);
    };
  }

  open();
  document.addEventListener("visibilitychange", () => next());
  return () => {
    closed = true;
    socket.close();
  };
}

/** What the server answers at a path, or null while it is gone or the page is left. */
export async function read(path) {
  try {
    return await (await fetch(path)).json();
  } catch {
    return null;
  }
}

/** Send something to the server, with the token. Returns its answer; {error} says what is wrong. */
export async function send(path, body, headers) {
  try {
    return await (await fetch(`${path}?language=${LANGUAGE}`, {method: "POST", body, headers})).json();
  } catch {
    return {error: GONE};
  }
}

/** Ask the server, with the token, for a file. Returns it as a blob; {error} says what is wrong. */
export async function load(path, token) {
  try {
    const answer = await fetch(`${path}?language=${LANGUAGE}`, {method: "POST", headers: {"X-Levilab-Token": token}});
    return await (answer.ok ? answer.blob() : answer.json());
  } catch {
    return {error: GONE};
  }
}

/** Send a command. Returns the answer; {error} says what is wrong with it. */
export const ask = (wanted, token) =>
  send("do", JSON.stringify(wanted), {"Content-Type": "application/json", "X-Levilab-Token": token});

/** Send a command to the bench for practice. Returns what is wrong with it, or "". */
export const command = async (wanted, token) => (await ask(wanted, token)).error || "";

/** The token of commands: what stands after # in the address, which never leaves the page, and stays for a reload. */
export function takeToken() {
  const given = tokenInAddress();
  if (given) sessionStorage.setItem("token", given);
  history.replaceState(null, "", location.pathname + location.search);
  addEventListener("hashchange", () => {  // the address of the terminal in a page that is open
    if (!tokenInAddress()) return;
    takeToken();
    location.reload();
  });
  return sessionStorage.getItem("token") || "";
}

/** What stands after #, but for the name of a part of the page, to which a link leads. */
function tokenInAddress() {
  const text = location.hash.slice(1);
  return document.getElementById(text) ? "" : text;
}
