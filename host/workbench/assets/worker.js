// The worker: yawrig compiled to WebAssembly, one question after the other.
import { answer, begin, file, hold, initSync, take } from "./yawrig.js";

/** @typedef {{ name: string, bytes: Uint8Array } | { hold: string, bytes: Uint8Array } | { file: string } | { path: string, asked: object }} Question */

/** @param {Question} what @returns {unknown} */
function answered(what) {
  if ("name" in what) return JSON.parse(take(what.name, what.bytes));
  if ("hold" in what) return hold(what.hold, what.bytes);
  if ("file" in what) return file(what.file) ?? null;
  return JSON.parse(answer(what.path, JSON.stringify(what.asked)));
}

/** @param {{ module: WebAssembly.Module } | { id: number } & Question} what */
function done(what) {
  if ("module" in what) {
    initSync({ module: what.module });
    begin((said) => postMessage({ said }), (news) => postMessage({ news: JSON.parse(news) }));
    return;
  }
  const { id } = what;
  try {
    postMessage({ id, value: answered(what) });
  } catch (error) {
    // What yawrig refuses is text; all else is a fault in it.
    const is_broken = typeof error !== "string";
    const fault = is_broken ? { message: `yawrig has failed: ${error}`, help: "the session stands as it was before; say what was done to those who make yawrig" } : JSON.parse(error);
    postMessage({ id, fault, is_broken });
  }
}

onmessage = ({ data }) => done(data);
