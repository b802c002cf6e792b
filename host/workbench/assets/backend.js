// yawrig itself, in a worker: what a page without a server asks. What is under way is ended with the worker.

/** What the page says where the worker cannot be had. */
export const GONE = { message: "yawrig cannot be loaded in this browser", help: "open the page from a web server, in a browser of 2022 or later" };
const CANCELLED = { message: "cancelled", help: "" };

/** @typedef {{ resolve: (value: any) => void, reject: (fault: Error) => void }} Waiting */
const /** @type {Map<number, Waiting>} */ waiting = new Map();
/** What was opened, to be opened again in another worker. */
const /** @type {Map<string, File>} */ files = new Map(), /** @type {Map<string, object>} */ orders = new Map();
let /** @type {Worker | null} */ worker = null, /** @type {Promise<Worker> | null} */ ready = null, count = 0, said = (/** @type {string} */ _) => {};

/** Calls `listener` with what is said meanwhile. @param {(text: string) => void} listener */
export const onSaid = (listener) => { said = listener; };

/** Compiled once, by the page: its content policy holds for it. @type {Promise<WebAssembly.Module> | null} */
let module = null;
async function compiled() {
  const answer = await fetch("yawrig_bg.wasm");
  if (!answer.ok) throw new Error(`yawrig_bg.wasm: ${answer.status}`);
  // A server that does not know the type says another.
  return WebAssembly.compile(await answer.arrayBuffer());
}

/** @param {{ message: string, help: string }} fault */
const thrown = (fault) => Object.assign(new Error(fault.message), fault);

function end(/** @type {{ message: string, help: string }} */ fault) {
  if (worker) worker.terminate();
  worker = ready = null;
  for (const { reject } of waiting.values()) reject(thrown(fault));
  waiting.clear();
}

/** A worker with the module in it. @returns {Promise<Worker>} */
async function begun() {
  const now = new Worker("worker.js", { type: "module" });
  worker = now;
  now.onmessage = ({ data }) => {
    if (now !== worker) return;
    if ("said" in data) return said(data.said);
    const asked = waiting.get(data.id);
    waiting.delete(data.id);
    if ("value" in data) asked?.resolve(data.value);
    else {
      asked?.reject(thrown(data.fault));
      // A module that has failed is not asked again.
      if (data.is_broken) end(data.fault);
    }
  };
  now.onerror = () => { if (now === worker) end(GONE); };
  try {
    now.postMessage({ module: await (module ??= compiled()) });
  } catch {
    module = null;
    if (now === worker) end(GONE);
    throw thrown(GONE);
  }
  return now;
}

/** @param {{ name: string, bytes: ArrayBuffer } | { path: string, asked: object }} what @returns {Promise<any>} */
async function told(what) {
  const now = await (ready ??= begun());
  if (now !== worker) throw thrown(CANCELLED);
  return new Promise((resolve, reject) => {
    const id = ++count;
    waiting.set(id, { resolve, reject });
    now.postMessage({ id, ...what });
  });
}

/** Hands a file over. @param {File} file */
export async function take(file) {
  const answer = await told({ name: file.name, bytes: await file.arrayBuffer() });
  files.set(file.name, file);
  return answer;
}

/** @param {string} path @param {any} asked */
export async function ask(path, asked) {
  const answer = await told({ path, asked });
  if (asked.do === "open") orders.set(asked.file, asked);
  return answer;
}

/** Ends what is under way. The records are opened again: what was known of them is to be asked anew. */
export async function cancel() {
  end(CANCELLED);
  for (const [name, order] of orders) {
    const file = files.get(name);
    if (!file) continue;
    await told({ name, bytes: await file.arrayBuffer() });
    await told({ path: "/api/do", asked: order });
  }
}
