// The worker: yawrig compiled to WebAssembly, one question after the other.
import { answer, begin, initSync, take } from "./yawrig.js";

/** @param {{ module: WebAssembly.Module } | { id: number, name: string, bytes: ArrayBuffer } | { id: number, path: string, asked: object }} what */
function done(what) {
  if ("module" in what) {
    initSync({ module: what.module });
    begin((/** @type {string} */ said) => postMessage({ said }));
    return;
  }
  const { id } = what;
  try {
    const text = "name" in what ? take(what.name, new Uint8Array(what.bytes)) : answer(what.path, JSON.stringify(what.asked));
    postMessage({ id, value: JSON.parse(text) });
  } catch (error) {
    // What yawrig refuses is text; all else is a fault in it.
    const is_broken = typeof error !== "string";
    const fault = is_broken ? { message: `yawrig has failed: ${error}`, help: "the record is opened again; say what was done with it to those who make yawrig" } : JSON.parse(error);
    postMessage({ id, fault, is_broken });
  }
}

onmessage = ({ data }) => done(data);
