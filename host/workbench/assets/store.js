// The browser's own storage: the files of one session and what stands beside them.

/** A file as it was kept. @typedef {{ crc32: string, bytes: Uint8Array }} KeptFile */
/** @typedef {{ kept: object, files: Map<string, KeptFile> }} KeptSession */

/** @template T @param {IDBRequest<T>} asked @returns {Promise<T>} */
const answered = (asked) => new Promise((resolve, reject) => {
  asked.onsuccess = () => resolve(asked.result);
  asked.onerror = () => reject(asked.error);
});

/** @returns {Promise<IDBDatabase>} */
function opened() {
  const asked = indexedDB.open("yawrig", 1);
  asked.onupgradeneeded = () => { asked.result.createObjectStore("files"); asked.result.createObjectStore("session"); };
  return answered(asked);
}

/** What was kept; null where nothing was. @returns {Promise<KeptSession | null>} */
export async function read() {
  const all = (await opened()).transaction(["files", "session"]), files = all.objectStore("files");
  const [kept, names, bytes] = await Promise.all([answered(all.objectStore("session").get("kept")), answered(files.getAllKeys()), answered(files.getAll())]);
  return kept ? { kept, files: new Map(names.map((name, k) => [String(name), bytes[k]])) } : null;
}

/** All of it or nothing: a page that is closed meanwhile finds what was before.
 * @param {object} kept @param {Map<string, KeptFile>} changed @param {string[]} gone */
export async function write(kept, changed, gone) {
  const all = (await opened()).transaction(["files", "session"], "readwrite"), files = all.objectStore("files");
  for (const [name, file] of changed) files.put(file, name);
  for (const name of gone) files.delete(name);
  all.objectStore("session").put(kept, "kept");
  await new Promise((resolve, reject) => { all.oncomplete = resolve; all.onerror = all.onabort = () => reject(all.error); });
}
