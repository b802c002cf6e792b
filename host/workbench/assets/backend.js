// yawrig itself, in a worker: what a page without a server asks. What is under way is ended with the worker; another one
// goes on with the session as it was kept.
import * as store from "./store.js";

/** What the page says where the worker cannot be had. */
export const GONE = { message: "yawrig cannot be loaded in this browser", help: "open the page from a web server, in a browser of 2023 or later" };
const CANCELLED = { message: "cancelled; nothing is changed", help: "" };

/** @typedef {{ resolve: (value: any) => void, reject: (fault: Error) => void }} Waiting */
const /** @type {Map<number, Waiting>} */ waiting = new Map();
let /** @type {Worker | null} */ worker = null, /** @type {Promise<Worker> | null} */ ready = null, count = 0;
let said = (/** @type {string} */ _) => {}, told = (/** @type {News} */ _) => {};
/** The session, to go on with in another worker. @type {store.KeptSession} */
const session = { kept: {}, files: new Map() };
/** Whether it is this tab that keeps its session in the browser; not known before it was asked for. @type {boolean | null} */
let keeps = null;
export const isKept = () => keeps;
let unkept = () => {};
/** Calls `tell` once the session is not kept: another tab has one, or there is no room. @param {() => void} tell */
export function onUnkept(tell) {
  unkept = tell;
  if (keeps === false) tell();
}

/** Calls `says` with what is said meanwhile, `tells` with news.
 * @param {(text: string) => void} says @param {(news: News) => void} tells */
export function listen(says, tells) { said = says; told = tells; }

/** Compiled once, by the page: its content policy holds for it. @type {Promise<WebAssembly.Module> | null} */
let module = null;
export const compiled = () => module ??= compile();
async function compile() {
  const answer = await fetch("yawrig.lzma");
  if (!answer.ok) throw new Error(`yawrig.lzma: ${answer.status}`);
  return WebAssembly.compile(await unpacked(await answer.arrayBuffer()));
}

/** @param {ArrayBuffer} packed @returns {Promise<Uint8Array<ArrayBuffer>>} */
const unpacked = (packed) => new Promise((resolve, reject) => {
  const now = new Worker("unpack-worker.js", { type: "module" });
  now.onmessage = ({ data }) => { now.terminate(); resolve(data); };
  now.onerror = () => { now.terminate(); reject(thrown(GONE)); };
  now.postMessage(packed, [packed]);
});

/** @param {{ message: string, help: string }} fault */
const thrown = (fault) => Object.assign(new Error(fault.message), fault);

function end(/** @type {{ message: string, help: string }} */ fault) {
  if (worker) worker.terminate();
  worker = ready = null;
  for (const { reject } of waiting.values()) reject(thrown(fault));
  waiting.clear();
}

/** A worker with the module and the session in it. @returns {Promise<Worker>} */
async function begun() {
  const now = new Worker("worker.js", { type: "module" });
  worker = now;
  now.onmessage = ({ data }) => {
    if (now !== worker) return;
    if ("said" in data) return said(data.said);
    if ("news" in data) return told(data.news);
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
    now.postMessage({ module: await compiled() });
  } catch {
    module = null;
    if (now === worker) end(GONE);
    throw thrown(GONE);
  }
  if (session.files.size) {
    for (const [name, { bytes }] of session.files) put(now, { hold: name, bytes });
    await put(now, { path: "/api/do", asked: { do: "restore", kept: session.kept } });
  }
  return now;
}

/** @param {Worker} now @param {object} what @returns {Promise<any>} */
const put = (now, what) => new Promise((resolve, reject) => {
  const id = ++count;
  waiting.set(id, { resolve, reject });
  now.postMessage({ id, ...what });
});

/** @param {object} what @returns {Promise<any>} */
async function asked(what) {
  const now = await (ready ??= begun());
  if (now !== worker) throw thrown(CANCELLED);
  return put(now, what);
}

/** The bytes of a file of the session. @param {string} name @returns {Promise<Uint8Array | null>} */
export const file = (name) => asked({ file: name });

/** Hands a file over. @param {File} from @param {string} name */
export async function take(from, name) {
  return asked({ name, bytes: new Uint8Array(await from.arrayBuffer()) });
}

/** @param {string} path @param {object} what */
export const ask = (path, what) => asked({ path, asked: what });

/** Keeps the session as it is now: for another worker, and in the browser. */
export async function keep() {
  const { kept, files } = await ask("/api/kept", {});
  const /** @type {Map<string, store.KeptFile>} */ changed = new Map();
  for (const { name, crc32 } of files) {
    if (session.files.get(name)?.crc32 === crc32) continue;
    const bytes = await file(name);
    if (bytes) changed.set(name, { crc32, bytes });
  }
  const there = new Set(files.map((/** @type {{ name: string }} */ f) => f.name)), gone = [...session.files.keys()].filter((name) => !there.has(name));
  for (const [name, of] of changed) session.files.set(name, of);
  for (const name of gone) session.files.delete(name);
  session.kept = kept;
  if (keeps) try { await store.write(kept, changed, gone); } catch { keeps = false; unkept(); }
}

/** The session that was kept in this browser, where no other tab has it open. Within another page, as a book's, each
 * begins anew. */
export async function begin() {
  // Held until this tab is closed.
  keeps = self === top && await new Promise((resolve) => {
    if (!navigator.locks) return resolve(true);
    navigator.locks.request("yawrig session", { ifAvailable: true }, (lock) => {
      resolve(!!lock);
      return lock ? new Promise(() => {}) : undefined;
    }).catch(() => resolve(false));
  });
  try {
    const before = keeps ? await store.read() : null;
    if (before) Object.assign(session, before);
  } catch { keeps = false; }
  if (!keeps) unkept();
}

/** Ends what is under way; the session is as it was before. */
export async function cancel() {
  end(CANCELLED);
  await ask("/api/state", {});
}
