// What boards have said, in the browser's own storage: each line as soon as it was said.

/** Lines and releases of one time that a board was followed. @typedef {{ name: string, lines: string[] }} Heard */

/** @template T @param {IDBRequest<T>} asked @returns {Promise<T>} */
const answered = (asked) => new Promise((resolve, reject) => {
  asked.onsuccess = () => resolve(asked.result);
  asked.onerror = () => reject(asked.error);
});

let /** @type {Promise<IDBDatabase> | null} */ opening = null;
const opened = () => opening ??= (() => {
  const asked = indexedDB.open("yawrig boards", 1);
  asked.onupgradeneeded = () => { asked.result.createObjectStore("lines", { autoIncrement: true }); asked.result.createObjectStore("releases"); };
  return answered(asked);
})();

/** @param {(all: IDBTransaction) => void} what @param {string[]} stores */
async function written(what, stores) {
  const all = (await opened()).transaction(stores, "readwrite", { durability: "strict" });
  what(all);
  await new Promise((resolve, reject) => { all.oncomplete = resolve; all.onerror = all.onabort = () => reject(all.error); });
}

/** Keeps a line of what a board says. @param {string} name of the session @param {string} line */
export const add = (name, line) => written((all) => { all.objectStore("lines").add({ name, line }); }, ["lines"]);

/** Keeps a release's samples. @param {string} name @param {string} text */
export const addRelease = (name, text) => written((all) => { all.objectStore("releases").put(text, name); }, ["releases"]);

/** All files that are kept: of each session its lines, and each release. @returns {Promise<Map<string, () => Promise<string>>>} */
export async function files() {
  const all = (await opened()).transaction(["lines", "releases"]), of = all.objectStore("releases");
  const [lines, names] = await Promise.all([answered(all.objectStore("lines").getAll()), answered(of.getAllKeys())]);
  const /** @type {Map<string, string[]>} */ sessions = new Map();
  for (const { name, line } of lines) {
    const said = sessions.get(name);
    if (said) said.push(line); else sessions.set(name, [line]);
  }
  const release = async (/** @type {IDBValidKey} */ name) => answered((await opened()).transaction("releases").objectStore("releases").get(name));
  return new Map([...[...sessions].map(([name, said]) => /** @type {const} */ ([`${name}.jsonl`, async () => `${said.join("\n")}\n`])),
    ...names.map((name) => /** @type {const} */ ([String(name), () => release(name)]))]);
}

/** Forgets all of it. */
export const forget = () => written((all) => { all.objectStore("lines").clear(); all.objectStore("releases").clear(); }, ["lines", "releases"]);
