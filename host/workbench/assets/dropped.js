// A file dropped on the page, from any folder: read, or asked about, and opened.
import { by, first, HAS_SYSTEM, make, post, send } from "./talk.js";

const QUANTITIES = [["", "what its unit says"], ["angle", "an angle"], ["rate", "a rate"], ["acceleration", "an acceleration"], ["displacement", "a displacement, or anything in proportion to it"]];

/** A file and where it lies below what was dropped. @typedef {{ file: File, name: string }} Taken */

/** `opened` is called with the release that a file has become. @param {Choose} opened @param {Failed} failed */
export function take(opened, failed) {
  const holds = (/** @type {DragEvent} */ event) => event.dataTransfer && [...event.dataTransfer.types].includes("Files");
  document.addEventListener("dragover", (event) => { if (holds(event)) { event.preventDefault(); document.body.classList.add("dropping"); } });
  document.addEventListener("dragleave", (event) => { if (!event.relatedTarget) document.body.classList.remove("dropping"); });
  document.addEventListener("drop", async (event) => {
    if (!holds(event)) return;
    event.preventDefault();
    document.body.classList.remove("dropping");
    // What was dropped is gone once this has returned: it is asked for before anything is waited for.
    const entries = [...event.dataTransfer?.items ?? []].map((item) => item.webkitGetAsEntry?.() ?? null), files = [...event.dataTransfer?.files ?? []];
    const folders = HAS_SYSTEM ? [] : entries.flatMap((entry) => (entry?.isDirectory ? [entry] : []));
    try {
      if (folders.length) await taken((await Promise.all(folders.map((entry) => within(/** @type {FileSystemDirectoryEntry} */ (entry))))).flat(), opened, failed);
      else await taken(files.map((file) => ({ file, name: file.name })), opened, failed);
    } catch (error) { failed(error); }
  });
}

/** All files below a folder. @param {FileSystemDirectoryEntry} folder @returns {Promise<Taken[]>} */
async function within(folder, above = "") {
  const reader = folder.createReader(), /** @type {Taken[]} */ all = [];
  for (;;) {
    // A hundred at a time.
    const /** @type {FileSystemEntry[]} */ some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (!some.length) return all;
    for (const entry of some) {
      const name = `${above}${entry.name}`;
      if (entry.isDirectory) all.push(...await within(/** @type {FileSystemDirectoryEntry} */ (entry), `${name}/`));
      else all.push({ name, file: await new Promise((resolve, reject) => /** @type {FileSystemFileEntry} */ (entry).file(resolve, reject)) });
    }
  }
}

/** What others are named in: the model, else the campaign. @param {Taken[]} all */
export const whole = (all) => ["model.toml", "campaign.toml"].flatMap((last) => all.filter(({ name }) => name === last || name.endsWith(`/${last}`)))[0] ?? null;

/** Hands files over and opens them, or what a campaign or a model among them names.
 * @param {Taken[]} all @param {Choose} opened @param {Failed} failed */
export async function taken(all, opened, failed) {
  const naming = HAS_SYSTEM ? null : whole(all);
  if (!naming) {
    for (const { file } of all) try { await answered(await send("/api/drop", file), opened); } catch (error) { failed(error); }
    return;
  }
  // It names them from its own folder on.
  const folder = naming.name.slice(0, naming.name.lastIndexOf("/") + 1);
  const beside = all.filter(({ name }) => name.startsWith(folder) && !name.slice(folder.length).split("/").some((part) => part.startsWith(".")));
  for (const { file, name } of beside) try { await send("/api/drop", file, name.slice(folder.length)); } catch { /* Beside the records there may be anything: what is missing is said of what names it. */ }
  await open(naming.name.slice(folder.length), {}, opened);
}

/** @param {string} file @param {Reading} reading @param {Choose} opened */
async function open(file, reading, opened) {
  opened((await post("/api/do", { do: "open", file, reading })).release);
}

/** Opens what is clear; of anything else the user says what it is.
 * @param {Posts["/api/as_read"]["answer"]} asked @param {Choose} opened */
async function answered(asked, opened) {
  if (asked.is_clear) return open(asked.file, {}, opened);
  return new Promise((/** @type {(none?: undefined) => void} */ done) => ask(asked, opened, done));
}

/** @param {Asked} asked @param {Choose} opened @param {() => void} done */
function ask(asked, opened, done) {
  const dialog = by("drop-dialog");
  const usable = asked.channels.filter((c) => !c.wrong);
  const field = (/** @type {string} */ label, /** @type {Node} */ element) => make("label", {}, `${label} `, element);
  const options = (/** @type {string[][]} */ pairs) => pairs.map(([value, textContent]) => make("option", { value, textContent }));
  const channel = (/** @type {Channel} */ c) => {
    const input = make("input", { type: "radio", name: "drop-channel", value: c.name, disabled: !!c.wrong });
    return make("label", { className: "channel" }, input, make("span", { className: "name", textContent: c.unit ? `${c.name}, ${c.unit}` : c.name }), sketch(c.sketch), make("span", { className: "caption", textContent: c.wrong || `${c.numbers} numbers` }));
  };
  const quantity = make("select", {}, ...options(QUANTITIES)), unit = make("input", { size: 8, placeholder: "its unit" });
  const time = make("select", {}, ...options([["", "the one that is called so"], ...usable.map((c) => [c.name, c.name])]));
  const rate = make("input", { size: 8, inputMode: "decimal" });
  const error = make("p", { className: "error", textContent: asked.why });
  /** @returns {Reading} */
  const reading = () => {
    /** @type {HTMLInputElement | null} */
    const chosen = first("input[name=drop-channel]:checked", dialog);
    const out = { yaw: chosen ? chosen.value : null, time: time.value, quantity: quantity.value, unit: unit.value.trim(), rate_hz: rate.value ? +rate.value : null };
    return Object.fromEntries(Object.entries(out).filter(([, value]) => value));
  };
  const close = () => { dialog.close(); done(); };
  const submit = async () => {
    try {
      const now = await post("/api/as_read", { file: asked.file, reading: reading() });
      if (!now.is_clear) { error.textContent = now.why; return; }
      await open(asked.file, reading(), opened);
      close();
    } catch (/** @type {any} */ wrong) { error.textContent = wrong.message; }
  };
  dialog.replaceChildren(make("h2", { textContent: `${asked.file}: which of its channels swings?` }), error,
    make("div", { className: "channels" }, ...asked.channels.map(channel)),
    make("p", { className: "row" }, field("It is", quantity), field("in", unit)),
    make("p", { className: "row" }, field("Time", time), field("or samples a second", rate)),
    make("p", { className: "row" }, make("button", { type: "button", id: "drop-open", className: "primary", textContent: "Open", onclick: submit }), make("button", { type: "button", textContent: "Cancel", onclick: close })));
  dialog.showModal();
}

/** A channel's course, 120 by 26. @param {Column} values */
function sketch(values) {
  const name = "http://www.w3.org/2000/svg";
  const svg = document.createElementNS(name, "svg"), line = document.createElementNS(name, "polyline");
  const points = values.map((v, k) => (v === null ? null : `${((k / Math.max(1, values.length - 1)) * 120).toFixed(1)},${(24 - v * 22).toFixed(1)}`));
  for (const [key, value] of Object.entries({ width: "120", height: "26", viewBox: "0 0 120 26", "aria-hidden": "true" })) svg.setAttribute(key, value);
  line.setAttribute("points", points.filter((p) => p).join(" "));
  svg.append(line);
  return svg;
}
