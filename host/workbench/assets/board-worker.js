// The worker that speaks to a board: the same module as the session's, in a worker of its own, so that no result waits
// for a diagnosis.
import { begin, board_back, board_begin, board_came, board_end, board_gone, board_network, board_order, board_turn, initSync } from "./yawrig.js";

/** Between two looks at the time, ms. */
const TURN_MS = 20;
let /** @type {number | undefined} */ timer;

/** @typedef {{ module: WebAssembly.Module } | { begin: string } | { came: Uint8Array } | { gone: string } | { back: true } | { order: object }
 *   | { network: string, bytes: Uint8Array } | { end: true }} Told */

/** @param {Told} what */
function take(what) {
  if ("module" in what) {
    initSync({ module: what.module });
    begin(() => {}, () => {});
  } else if ("begin" in what) {
    timer ??= setInterval(() => guarded(board_turn), TURN_MS);
    board_begin(what.begin, (kind, of) => postMessage(kind === "send" ? { send: of } : { [kind]: JSON.parse(of) }));
  } else if ("came" in what) board_came(what.came);
  else if ("gone" in what) board_gone(what.gone);
  else if ("back" in what) board_back();
  else if ("order" in what) board_order(JSON.stringify(what.order));
  else if ("network" in what) board_network(what.network, what.bytes);
  else {
    clearInterval(timer);
    timer = undefined;
    board_end();
    postMessage({ ended: true });
  }
}

/** @param {() => void} what */
function guarded(what) {
  try { what(); } catch (error) {
    // What yawrig refuses is text; all else is a fault in it.
    const is_broken = typeof error !== "string";
    if (is_broken) clearInterval(timer);
    postMessage({ fault: is_broken ? { message: `yawrig has failed: ${error}`, help: "connect again; what the board said is kept" } : JSON.parse(error), is_broken });
  }
}

onmessage = ({ data }) => guarded(() => take(data));
