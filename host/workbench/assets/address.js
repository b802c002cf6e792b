// What is looked at, in the page's address: reloaded, or opened from a bookmark, the page shows the same.

/** @typedef {{ record: string | null, span: Span, tab: string | null }} Place */

/** What this page last read there, or wrote. */
let known = location.hash;

/** @returns {Place} */
export function read() {
  known = location.hash;
  const words = new URLSearchParams(location.hash.slice(1));
  const [from, to] = ["from_s", "to_s"].map((name) => Number(words.get(name) ?? NaN));
  return { record: words.get("record"), span: from < to && isFinite(to - from) ? [from, to] : [null, null], tab: words.get("tab") };
}

/** Writes nothing over an address that somebody has entered and the page not read yet. @param {Place} place */
export function write({ record, span: [from, to], tab }) {
  if (location.hash !== known) return;
  // To a microsecond, whenever the record's clock began.
  const time = (/** @type {number | null} */ t) => (t === null ? null : String(+t.toFixed(6)));
  const words = Object.entries({ record, from_s: time(from), to_s: time(to), tab }).flatMap(([name, text]) => (text === null ? [] : [[name, text]]));
  const now = `#${new URLSearchParams(words)}`;
  if (now !== known) history.replaceState(null, "", now);
  known = location.hash;
}

/** What is closed is in no address. */
export const forget = () => write({ record: null, span: [null, null], tab: null });
