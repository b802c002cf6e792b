// The form for a user's own effect: errors under the character as it is typed, its law over the cuts.
import { by, first, make, post } from "./talk.js";
import { seen, showLaw } from "./panels.js";

/** @type {OwnForm} */
const form = {
  id: "my_effect", title: "My effect", moment: "-c * sign(r)",
  parameters: [{ name: "c", unit: "rad/s2", start: "0.05", min: "0", max: "" }],
  states: [],
};
let /** @type {number | undefined} */ timer = undefined, number = 0, good = false, showing = false;

/** What stands in the two tables' columns, and a row as it begins. */
const TABLES = {
  parameters: { one: "parameter", columns: ["name", "unit", "start", "min", "max"], fresh: { name: "", unit: "1", start: "1", min: "", max: "" } },
  states: { one: "state", columns: ["name", "unit", "rate", "start"], fresh: { name: "z", unit: "rad", rate: "(b - z) / T", start: "" } },
};
/** Of a chain that an effect may have. */
const MAX_STATES = 2;

/** The pane; `act` takes steps, `say` tells how one went.
 * @param {Act} act @param {(text: string) => void} say @param {Failed} failed */
export function build(act, say, failed) {
  const changed = () => { clearTimeout(timer); timer = setTimeout(preview, 120); };
  const field = (/** @type {"id" | "title" | "moment"} */ name, /** @type {string} */ label, /** @type {"input" | "textarea"} */ tag = "input") => make("label", {}, label,
    make(tag, { value: form[name], spellcheck: false, autocomplete: "off", "data-field": name, oninput: (e) => { form[name] = e.target.value; changed(); } }));
  /** A table of rows that grows and shrinks. @param {"parameters" | "states"} which */
  const table = (which) => {
    const { one, columns } = TABLES[which], list = /** @type {Record<string, string>[]} */ (/** @type {unknown} */ (form[which]));
    const rows = make("tbody", { id: `own-${which}` }), whole = make("table", { className: which }, make("thead", {}, make("tr", {}, ...columns.map((t) => make("th", { textContent: t })), make("td"))), rows);
    const draw = () => {
      whole.hidden = !list.length;
      rows.replaceChildren(...list.map((row, k) => make("tr", {},
        ...columns.map((name) => make("td", {}, make("input", {
          value: row[name], spellcheck: false, "aria-label": `${one} ${k + 1}: ${name}`, "data-field": `${which}.${k}.${name}`,
          oninput: (e) => { row[name] = e.target.value; changed(); },
        }))),
        make("td", { className: "x" }, make("button", { type: "button", textContent: "×", title: `take this ${one} away`, "aria-label": `take ${one} ${k + 1} away`, onclick: () => { list.splice(k, 1); draw(); changed(); } })))));
      const more = which === "states" && by("own-more-states");
      if (more) more.disabled = list.length >= MAX_STATES;
    };
    draw();
    return { whole, more: () => { list.push({ ...TABLES[which].fresh }); draw(); changed(); first("tr:last-child input", rows)?.focus(); } };
  };
  const parameters = table("parameters"), states = table("states");
  const defined = async (/** @type {(effect: string) => void} */ then) => {
    if (!await preview()) return;
    try { then((await post("/api/do", { do: "define", form })).effect); } catch (error) { failed(error); }
  };
  by("pane-own").replaceChildren(make("form", { className: "own", onsubmit: (e) => e.preventDefault() },
    make("p", { className: "caption", textContent: "A moment over the inertia, added to the model. It competes with the effects of the library." }),
    field("id", "id: lower-case letters, digits, _"), field("title", "title"),
    field("moment", "moment (rad/s²) of b angle (rad), r rate (rad/s), t time (s), wn, wind (m/s); of a displacement in its unit", "textarea"),
    make("pre", { className: "caret", id: "own-error", hidden: true, role: "status" }),
    parameters.whole, states.whole,
    make("div", { className: "row" },
      make("button", { type: "button", textContent: "+ parameter", onclick: parameters.more }),
      make("button", { type: "button", id: "own-more-states", textContent: "+ state", title: "For a moment that follows late: what it follows with, and how fast that changes", onclick: states.more }),
      make("button", { type: "button", id: "own-try", textContent: "Try", title: "Fit the release with it; nothing is written", onclick: () => defined((effect) => { if (seen.release !== null) act({ do: "try", release: seen.release, effect }); }) }),
      make("button", { type: "button", id: "own-add", textContent: "Add", title: "Into the model, its text with it", onclick: () => defined((effect) => act({ do: "add", effect, why: null })) }),
      make("button", { type: "button", id: "own-save", textContent: "Save", title: "As a file beside the model, for --effect", onclick: async () => {
        try { say(`saved as ${(await post("/api/do", { do: "save", form })).file}`); } catch (error) { failed(error); }
      } })),
    make("p", { className: "caption", textContent: "abs sign exp ln log10 sqrt sin cos tan asin acos atan atan2 sinh cosh tanh pow (^) min max, and pi. The violet line in the two cuts is the moment with each parameter at its start." })));
}

/** Shows the law while the pane is open. @param {boolean} is */
export function opened(is) {
  showing = is;
  if (is) preview(); else showLaw(null);
}

async function preview() {
  const mine = ++number;
  /** @type {Posts["/api/preview"]["answer"]} */
  let found;
  try { found = await post("/api/preview", { release: seen.release, form }); } catch (/** @type {any} */ error) { found = { error: { message: error.message, help: error.help, at: null } }; }
  if (mine !== number) return good;
  const box = by("own-error");
  document.querySelectorAll("#pane-own [aria-invalid]").forEach((e) => e.removeAttribute("aria-invalid"));
  good = !("error" in found);
  for (const id of /** @type {const} */ (["own-try", "own-add", "own-save"])) by(id).disabled = !good || (id === "own-try" && seen.release === null);
  if ("error" in found) {
    const { at, message, help } = found.error;
    /** @type {HTMLInputElement | HTMLTextAreaElement | null} */
    const field = at && first(`#pane-own [data-field="${at.field}"]`);
    if (field) field.setAttribute("aria-invalid", "true");
    const value = field ? field.value.replace(/[\n\r]/g, " ") : "";
    // The characters before stand for themselves, so that the caret is under its character whatever the width.
    const characters = Math.max(20, Math.floor((by("pane-own").clientWidth - 40) / 7.3));
    const lines = field && at ? wrapped(value, " ".repeat(at.column) + "^".repeat(at.width), characters) : [];
    box.textContent = [...lines, message, help].filter(Boolean).join("\n");
    box.className = "caret";
    box.hidden = false;
    showLaw(null);
  } else {
    box.textContent = found.warnings || "";
    box.className = "caret fine";
    box.hidden = !found.warnings;
    // A moment with memory is no curve.
    if (showing) showLaw(found.damping_law.rate_deg_s.length ? found : null);
  }
  return good;
}

/** A long line and its caret cut after so many characters, each piece of the one over that of the other.
 * @param {string} text @param {string} caret @param {number} width */
export function wrapped(text, caret, width) {
  const out = [];
  for (let at = 0; at < Math.max(text.length, caret.length); at += width) {
    out.push(text.slice(at, at + width));
    const under = caret.slice(at, at + width);
    if (under.includes("^")) out.push(under);
  }
  return out;
}
