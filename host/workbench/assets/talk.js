// What is said to the server, and what it says by itself.
export * from "./elements.js";

/** Whether yawrig has the system's folders and devices here. */
export const HAS_SYSTEM = true;

/** @template {keyof Answers} P @param {P} path @param {Record<string, string | number | null>} query @returns {Promise<Answers[P]>} */
export async function get(path, query = {}) {
  const words = Object.entries(query).flatMap(([k, v]) => (v === null ? [] : [`${k}=${encodeURIComponent(v)}`])).join("&");
  return answer(await asked(words ? `${path}?${words}` : path));
}

/**
 * @template {Order} O
 * @overload @param {"/api/do"} path @param {O} body @returns {Promise<Done<O>>}
 */
/**
 * @template {keyof Posts} P
 * @overload @param {P} path @param {Posts[P]["body"]} body @returns {Promise<Posts[P]["answer"]>}
 */
/** @param {string} path @param {object} body */
export async function post(path, body) {
  return answer(await asked(path, { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(body) }));
}

/** A file's bytes, under its name.
 * @param {string} path @param {File} file @returns {Promise<Posts["/api/as_read"]["answer"]>} */
export async function send(path, file, name = file.name) {
  return answer(await asked(`${path}?name=${encodeURIComponent(name)}`, { method: "POST", headers: { "content-type": "application/octet-stream" }, body: file }));
}

/** What the page says where yawrig has gone. */
export const GONE = { message: "yawrig does not answer", help: "if it was ended, start yawrig workbench again and open the address it prints" };

/** @param {string} path @param {RequestInit} [options] */
async function asked(path, options) {
  try { return await fetch(path, options); } catch { throw Object.assign(new Error(GONE.message), GONE); }
}

/** @param {Response} response */
async function answer(response) {
  const text = await response.text();
  let json;
  try { json = JSON.parse(text); } catch { json = { error: { message: text.trim() || `the server answered ${response.status}`, help: "" } }; }
  if (!response.ok || json.error && json.error.message && response.status >= 400) {
    throw Object.assign(new Error(json.error ? json.error.message : text), { help: json.error ? json.error.help : "" });
  }
  return json;
}

/** Calls `heard` with each piece of news; `lost` while the server does not answer. One tab holds the stream and tells
 * the others: a browser has six connections to a server, and a stream keeps one for itself.
 * @param {(news: News) => void} heard @param {(is: boolean) => void} lost */
export function listen(heard, lost) {
  /** @typedef {{ news: News } | { lost: boolean }} Told */
  const take = (/** @type {Told} */ told) => ("news" in told ? heard(told.news) : lost(told.lost));
  const open = (/** @type {(told: Told) => void} */ tell) => {
    const source = new EventSource("/api/news");
    source.onmessage = (event) => tell({ news: JSON.parse(event.data) });
    source.onopen = () => tell({ lost: false });
    source.onerror = () => tell({ lost: true });
  };
  // Without a secure context (--allow-remote) there are no locks.
  if (!navigator.locks) { open(take); return; }
  const tabs = new BroadcastChannel("yawrig news");
  tabs.onmessage = (event) => take(event.data);
  navigator.locks.request("yawrig news", () => {
    open((told) => { take(told); tabs.postMessage(told); });
    // Held until this tab is closed; then another has it.
    return new Promise(() => {});
  });
}
