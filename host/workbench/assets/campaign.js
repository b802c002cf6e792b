// A campaign.toml by form and drag: records onto their condition, the numbers that no name says, and what is still wrong.
import { by, focused, get, make, post } from "./talk.js";

/** @typedef {Record<string, string>} Typed @typedef {Pick<PlacedRecord, "spring" | "axis" | "wind_speed_m_s">} Whereto */
const AXES = /** @type {const} */ (["mid", "front"]);
/** What is typed; `given` by name, `stiffness` by spring.
 * @type {{ folder: string, pattern: string, given: Typed, stiffness: Typed }} */
const form = { folder: ".", pattern: "", given: {}, stiffness: {} };
/** The records of the folder with what is known of each. @type {PlacedRecord[]} */
let files = [];
/** The folder, once it has been looked into; the file that is picked up. */
let /** @type {CampaignFolder | null} */ known = null, /** @type {string | null} */ held = null;
let /** @type {string[]} */ springs = [], /** @type {Condition[]} */ conditions = [];
let /** @type {number | undefined} */ timer = undefined, number = 0, /** @type {Failed} */ failed = () => {}, opened = () => {};

const place = (/** @type {string} */ file) => files.find((f) => f.file === file);
const isWhole = (/** @type {PlacedRecord} */ f) => f.spring !== null && f.axis !== null && f.wind_speed_m_s !== null;
const isTouched = (/** @type {PlacedRecord} */ f) => f.spring !== null || f.axis !== null || f.wind_speed_m_s !== null || f.unknown.length > 0;
const same = (/** @type {Condition} */ c, /** @type {Pick<PlacedRecord, keyof Condition>} */ f) => c.axis === f.axis && c.wind_speed_m_s === f.wind_speed_m_s;
const called = (/** @type {Condition} */ c) => `${c.axis}, ${c.wind_speed_m_s === 0 ? "wind off" : `${c.wind_speed_m_s} m/s`}`;

/** @param {Failed} fail @param {() => void} done */
export async function open(fail, done) {
  failed = fail; opened = done;
  if (!await look()) return;
  draw();
  by("campaign-dialog").showModal();
}

/** Lists the folder anew. */
async function look() {
  try { known = await get("/api/campaign", { folder: form.folder }); } catch (error) { failed(error); return false; }
  files = known.files.map((file) => place(file) || blank(file));
  return true;
}

/** @param {string} file @returns {PlacedRecord} */
const blank = (file) => ({ file, spring: null, axis: null, wind_speed_m_s: null, unknown: [] });

/** Rows and columns that the placed records need, beside those that were made by hand. */
function grow() {
  for (const f of files) {
    if (f.spring !== null && !springs.includes(f.spring)) springs.push(f.spring);
    const { axis, wind_speed_m_s } = f;
    if (axis !== null && wind_speed_m_s !== null && !conditions.some((c) => same(c, f))) conditions.push({ axis, wind_speed_m_s });
  }
  springs.sort();
  conditions.sort((a, b) => AXES.indexOf(a.axis) - AXES.indexOf(b.axis) || a.wind_speed_m_s - b.wind_speed_m_s);
}

async function byPattern() {
  try {
    const found = await post("/api/campaign/pattern", { folder: form.folder, pattern: form.pattern });
    if ("fault" in found) throw found.fault;
    files = files.map((f) => found.placed.find((p) => p.file === f.file) || blank(f.file));
    tell(`${found.placed.length} of ${files.length} records match the pattern`);
  } catch (/** @type {any} */ error) { tell(`${error.message}${error.help ? ` — ${error.help}` : ""}`, true); }
  draw();
}

/** @param {string} file @param {Whereto} where */
function put(file, where) {
  const record = place(file);
  if (!record) return;
  Object.assign(record, { unknown: [] }, where);
  held = null;
  draw();
}
const take = (/** @type {string} */ file) => put(file, { spring: null, axis: null, wind_speed_m_s: null });

let /** @type {[text: string, isError: boolean]} */ told = ["", false];
function tell(/** @type {string} */ text, isError = false) { told = [text, isError]; }

/** A place that records are dragged to, or put by a click after one has been chosen.
 * @param {HTMLElement} element @param {Whereto} where */
function target(element, where) {
  element.addEventListener("dragover", (event) => { event.preventDefault(); element.classList.add("over"); });
  element.addEventListener("dragleave", () => element.classList.remove("over"));
  element.addEventListener("drop", (event) => { event.preventDefault(); put(event.dataTransfer?.getData("text/plain") ?? "", where); });
  element.addEventListener("click", (event) => { if (held && event.target === element) put(held, where); });
  element.addEventListener("keydown", (event) => { if (held && (event.key === "Enter" || event.key === " ") && event.target === element) { event.preventDefault(); put(held, where); } });
  return element;
}

/** @param {PlacedRecord} f */
function chip(f) {
  const missing = [f.spring === null ? "spring" : null, f.axis === null ? "axis" : null, f.wind_speed_m_s === null ? "wind" : null].filter(Boolean);
  const lacks = isTouched(f) && missing.length ? ` (${missing.join(", ")}?)` : "";
  return make("button", {
    type: "button", className: `file${held === f.file ? " held" : ""}`, draggable: true, textContent: `${f.file.split("/").pop()}${lacks}`, "data-file": f.file,
    title: `${f.file}${f.unknown.length ? `: the name says ${f.unknown.join(", ")}` : ""}. Drag it to its condition; or choose it, then the condition. Double-click: not of this campaign.`,
    ondragstart: (event) => event.dataTransfer?.setData("text/plain", f.file),
    onclick: () => { held = held === f.file ? null : f.file; draw(); },
    ondblclick: () => take(f.file),
  });
}

/** @param {CampaignFolder} known */
function table(known) {
  const cell = (/** @type {string} */ spring, /** @type {Condition} */ c) => target(make("td", { tabIndex: 0, "data-cell": `${spring} ${c.axis} ${c.wind_speed_m_s}`, "aria-label": `${spring}, ${called(c)}` },
    ...files.filter((f) => isWhole(f) && f.spring === spring && same(c, f)).map(chip)), { spring, ...c });
  const stiffness = (/** @type {string} */ spring) => make("td", {}, make("input", {
    value: form.stiffness[spring] ?? "", size: 7, inputMode: "decimal", "aria-label": `stiffness of ${spring}`, "data-field": `stiffness ${spring}`, placeholder: "N/m", title: known.stiffness,
    oninput: (event) => { form.stiffness[spring] = event.target.value; soon(); },
  }));
  return make("table", { className: "conditions" },
    make("thead", {}, make("tr", {}, make("th", { textContent: "spring" }), make("th", { textContent: "stiffness of one (N/m)" }), ...conditions.map((c) => make("th", { textContent: called(c) })))),
    make("tbody", {}, ...springs.map((spring) => make("tr", {}, make("th", { textContent: spring }), stiffness(spring), ...conditions.map((c) => cell(spring, c))))));
}

function adding() {
  const spring = make("input", { placeholder: "K1", size: 6, "aria-label": "name of a further spring", "data-field": "new-spring" });
  const axis = make("select", { "aria-label": "axis of a further condition", "data-field": "new-axis" }, ...AXES.map((a) => make("option", { value: a, textContent: a })));
  const wind = make("input", { placeholder: "m/s, 0: off", size: 8, inputMode: "decimal", "aria-label": "wind speed of a further condition", "data-field": "new-wind" });
  const add = (/** @type {string} */ id, /** @type {string} */ text, /** @type {() => void} */ onclick) => make("button", { type: "button", id, textContent: text, onclick });
  return make("div", { className: "row" },
    spring, add("campaign-spring", "+ spring", () => { const name = spring.value.trim(); if (name && !springs.includes(name)) { springs.push(name); draw(); } }),
    axis, wind, add("campaign-condition", "+ condition", () => {
      const speed = number_of(wind.value);
      if (speed === null || !(speed >= 0)) { tell(`${wind.value || "nothing"} is not a wind speed: give a number in m/s, 0 for off`, true); return draw(); }
      const one = { axis: /** @type {Axis} */ (axis.value), wind_speed_m_s: speed };
      if (!conditions.some((c) => same(c, one))) conditions.push(one);
      draw();
    }));
}

/** Also with a decimal comma. @param {string} text */
function number_of(text) {
  const number = Number(text.trim().replace(",", "."));
  return text.trim() && Number.isFinite(number) ? number : null;
}

/** @param {CampaignFolder} known */
function numbers(known) {
  return make("dl", { className: "numbers" }, ...known.numbers.flatMap(({ name, what }) => [
    make("dt", {}, make("label", { htmlFor: `number-${name}`, textContent: name })),
    make("dd", {}, make("input", { id: `number-${name}`, value: form.given[name] ?? "", size: 8, inputMode: "decimal", "data-field": name, oninput: (event) => { form.given[name] = event.target.value; soon(); } }),
      make("span", { className: "caption", textContent: what })),
  ]));
}

function draw() {
  if (!known) return;
  grow();
  const dialog = by("campaign-dialog");
  const focus = focused("field") || focused("file");
  const left = files.filter((f) => !isWhole(f));
  // The list stays as it is until it is known anew: emptied, it would move the buttons below it under the pointer.
  const list = by("campaign-wrong") || make("ol", { id: "campaign-wrong" });
  const pool = target(make("div", { className: "pool", role: "group", "aria-label": "not placed yet" }, ...left.map(chip)), { spring: null, axis: null, wind_speed_m_s: null });
  if (!left.length) pool.textContent = files.length ? "every record is placed" : "no records in this folder";
  dialog.replaceChildren(
    make("h2", { textContent: `A campaign of the records in ${known.folder}` }),
    make("div", { className: "row" },
      make("label", {}, "folder ", make("input", { value: form.folder, size: 12, "data-field": "folder", onchange: async (event) => { form.folder = event.target.value.trim() || "."; files = []; springs = []; conditions = []; if (await look()) draw(); } })),
      make("label", { className: "wide" }, "names look like ", make("input", { value: form.pattern, "data-field": "pattern", placeholder: "{spring}_V{wind}_{axis}_run{n}.csv", title: "{spring}, {wind} (m/s or off) and {axis} (mid or front) are taken from the name; {n} or any other name stands for anything", oninput: (event) => { form.pattern = event.target.value; }, onkeydown: (event) => { if (event.key === "Enter") byPattern(); } })),
      make("button", { type: "button", id: "campaign-pattern", textContent: "Place by name", onclick: byPattern })),
    make("p", { className: told[1] ? "error" : "caption", role: "status", id: "campaign-told", textContent: told[0] || "Drag each record to its spring and condition, or have them placed by their names." }),
    pool, table(known), adding(), numbers(known),
    make("h3", { textContent: "What is still wrong" }), list,
    make("div", { className: "row" },
      make("button", { type: "button", id: "campaign-write", className: "primary", textContent: known.exists ? "Write over campaign.toml" : "Write campaign.toml", disabled: !files.some(isTouched), onclick: write }),
      make("button", { type: "button", textContent: "Close", onclick: () => dialog.close() })));
  if (focus) [.../** @type {NodeListOf<HTMLElement>} */ (dialog.querySelectorAll("[data-field], [data-file]"))].find((e) => (e.dataset.field || e.dataset.file) === focus)?.focus({ preventScroll: true });
  soon(0);
}

/** @returns {CampaignForm} */
function asked() {
  const numbers = (/** @type {Typed} */ typed) => Object.fromEntries(Object.entries(typed).flatMap(([name, text]) => {
    const number = number_of(text);
    return number === null ? [] : [[name, number]];
  }));
  return { folder: form.folder, placed: files.filter(isTouched), given: { numbers: numbers(form.given), stiffness_n_per_m: numbers(form.stiffness) } };
}

function soon(wait = 250) { clearTimeout(timer); timer = setTimeout(check, wait); }

async function check() {
  const mine = ++number, list = by("campaign-wrong");
  if (!files.some(isTouched)) return list.replaceChildren(make("li", { className: "caption", textContent: "no record is placed" }));
  try {
    const found = await post("/api/campaign/check", asked());
    if (mine === number) wrong(found);
  } catch (/** @type {any} */ error) { if (mine === number) tellWrong([error.message]); }
}

const tellWrong = (/** @type {string[]} */ lines, kind = "error") => by("campaign-wrong").replaceChildren(...lines.map((line) => make("li", { className: kind, textContent: line })));

/** @param {Checked} found */
function wrong(found, is_written = false) {
  if (found.wrong.length) return tellWrong(found.wrong);
  if (found.doubtful.length) return tellWrong(["doubtful:", ...found.doubtful, ...found.notes]);
  tellWrong([is_written ? "nothing is wrong; its records were looked at, too" : "nothing; the records are looked at when it is written", ...found.notes], "caption");
}

async function write() {
  if (!known) return;
  try {
    const found = await post("/api/do", { do: "write_campaign", ...asked(), over: known.exists });
    known.exists = true;
    tell(`${found.file} is written${found.is_open ? " and open" : ""}`);
    draw();
    clearTimeout(timer); number++;
    wrong(found, true);
    opened();
  } catch (/** @type {any} */ error) { tell(`${error.message}${error.help ? ` — ${error.help}` : ""}`, true); draw(); }
}
