// Elements of a page and its numbers, whoever answers it.

/**
 * An element: tag, properties, children.
 * @template {Tag} T
 * @param {T} tag
 * @param {Properties<T>} [properties]
 * @param {...(Node | string | null | undefined)} children
 * @returns {HTMLElementTagNameMap[T]}
 */
export function make(tag, properties, ...children) {
  const element = document.createElement(tag);
  /** @type {object} */
  const given = properties ?? {};
  for (const [name, value] of Object.entries(given)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name in element && name !== "list") Object.assign(element, { [name]: value });
    else if (value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children.flatMap((c) => c ?? []));
  return element;
}

/** The page's element. @template {string} I @param {I} id @returns {ElementOf<I>} */
export const by = (id) => /** @type {any} */ (document.getElementById(id));

/** The first element found, of the kind asked for.
 * @template {Element} [E=HTMLElement] @param {string} selector @param {ParentNode} within @returns {E | null} */
export const first = (selector, within = document) => within.querySelector(selector);

/** What has the focus, by its `data-` attribute of that name; null where it has none. */
export const focused = (name = "focus") => (document.activeElement instanceof HTMLElement ? document.activeElement.dataset[name] ?? null : null);

/** A number to so many digits, with a proper minus. @param {number | null | undefined} x */
export const digits = (x, n = 3) => (x === null || x === undefined || !isFinite(x) ? "–" : String(+x.toPrecision(n)).replace("-", "−"));

/** Three digits, but nothing needless behind large numbers. @param {number | null | undefined} x */
export const ratio = (x) => (x === null || x === undefined ? "–" : x >= 100 ? x.toFixed(0) : x >= 10 ? x.toFixed(1) : x.toFixed(2));

/** Hands a file to the user. @param {string} name @param {BlobPart} bytes */
export function download(name, bytes) {
  const address = URL.createObjectURL(new Blob([bytes]));
  make("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}
