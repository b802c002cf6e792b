// What is looked at, in the page's address: reloaded, or opened from a bookmark, the page shows the same.

/** @typedef {{ record: string | null, span: Span, tab: string | null }} Place */

/** @returns {Place} */
export function read() {
  const words = new URLSearchParams(location.hash.slice(1));
  const time = (/** @type {string} */ name) => { const text = words.get(name); return text && isFinite(+text) ? +text : null; };
  return { record: words.get("record"), span: [time("from_s"), time("to_s")], tab: words.get("tab") };
}

/** @param {Place} place */
export function write({ record, span: [from, to], tab }) {
  const words = new URLSearchParams(Object.entries({ record, from_s: from, to_s: to, tab }).flatMap(([name, x]) => (x === null ? [] : [[name, typeof x === "number" ? String(+x.toPrecision(6)) : x]])));
  history.replaceState(null, "", `#${words}`);
}
