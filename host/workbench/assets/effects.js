// Effects: those of the model, and those that it may lack with their cards and what they would do.
import { by, digits, first, focused, get, make, ratio } from "./talk.js";
import { DIAGNOSIS, seen, trialColour } from "./panels.js";

/** Items as they were drawn, and of what; reasons as far as they are typed. By effect. */
const /** @type {Map<string, { key: string, item: HTMLElement }>} */ kept = new Map(), /** @type {Map<string, string>} */ notes = new Map();
let /** @type {Candidate[]} */ list = [], /** @type {Candidates | null} */ verdict = null, asked = 0;
/** @typedef {string | null} Which Of the effects. */
let /** @type {Which} */ current = null, /** @type {Which} */ open = null, /** @type {Which} */ rejecting = null;

/** @param {State} state @param {Act} act */
export async function refresh(state, act) {
  drawModel(state, act);
  const release = seen.release, mine = ++asked;
  if (release === null) { list = []; return draw(state, act); }
  let answer = null;
  try { answer = await get("/api/candidates", { release }); } catch { /* There are none to be drawn. */ }
  // Answers may overtake each other: the last question's is what is so.
  if (mine !== asked || release !== seen.release) return;
  list = answer ? answer.candidates : [];
  verdict = answer;
  if (!list.some((c) => c.effect === current)) current = list.length ? list[0].effect : null;
  // While the list is the same it is left alone: somebody may be typing in it.
  const now = JSON.stringify([found(), !!state.job, seen.ghost, seen.view && seen.view.trials.map((t) => t.effect)]);
  if (now !== drawn) { drawn = now; draw(state, act); }
}

let drawn = "";
const found = () => [list, verdict, seen.release];

// As the program shows it: what lies a million times within its uncertainty the data say nothing about.
/** @param {Parameter} parameter */
function valued({ value, u }) {
  if (value === null) return "each release its own";
  if (u !== null && u > 1e6 * Math.abs(value) && value !== 0) return "not determined";
  return digits(value, 4) + (u ? ` ± ${digits(u, 2)}` : "");
}

/** @param {State} state @param {Act} act */
function drawModel(state, act) {
  const { model } = state;
  const chip = (/** @type {ModelEffect} */ e) => make("div", { className: "chip" },
    make("strong", { textContent: e.effect, title: e.title }),
    make("button", { type: "button", textContent: "Remove", "data-remove": e.effect, disabled: !!state.job, onclick: () => act({ do: "remove", effect: e.effect }) }),
    make("span", { className: "values", textContent: e.parameters.map((p) => `${p.name} = ${valued(p)} ${p.unit === "1" || p.value === null ? "" : p.unit}`).join(",  ") }));
  by("in-model").replaceChildren(
    make("p", { className: "caption", textContent: model.fault ? `${model.file} cannot be used: correct it, or return to one of the steps below` : !model.exists ? `No model yet: the first step makes ${model.file}` : model.effects.length ? "In the model, beside the second-order response:" : "The model is a second-order response, no effects." }),
    ...model.effects.map(chip));
}

/** The verdict in the words of the command line, and a way to see what it leaves. @param {Act} act */
function drawDiagnosis(act) {
  const box = by("diagnosis"), is_drawn = seen.ghost === DIAGNOSIS;
  const line = (/** @type {string} */ text, className = "") => make("p", { textContent: `${text}.`, className });
  const is_open = verdict?.status === "unexplained" || verdict?.status === "mostly_explained";
  by("law-button").classList.toggle("primary", is_open && by("law").hidden);
  const together = verdict?.together ? verdict.together.filter(Boolean).map((text, k) => line(capital(text), k ? "caption" : "verdict")) : [];
  if (!verdict || !verdict.verdict) return box.replaceChildren(make("p", { className: "caption", textContent: "Fits every effect to this release." }), ...together);
  box.replaceChildren(...[
    line(`This release is ${verdict.verdict}`, "verdict"),
    verdict.sentence ? line(capital(verdict.sentence)) : null,
    ...[...verdict.refused ?? [], ...verdict.alike].map((text) => line(text, "caption")),
    is_open ? line("What is left may be a law that can be measured", "caption") : null,
    verdict.is_drawn ? make("button", { type: "button", textContent: is_drawn ? "Hide what it leaves" : "Draw what it leaves", "data-focus": "diagnosis", title: "The diagnosis' model over the record, and its residual in every panel", onclick: () => act({ do: "lay", ghost: is_drawn ? null : DIAGNOSIS }) }) : null,
    ...together,
  ].flatMap((e) => e ?? []));
}

const capital = (/** @type {string} */ text) => text[0].toUpperCase() + text.slice(1);

/** The step is the same on the command line: it says so. @param {State} state @param {Act} act */
function draw(state, act) {
  by("diagnose-button").disabled = !!state.job || seen.release === null;
  by("diagnose-button").classList.toggle("primary", !(verdict && verdict.verdict));
  const ticked = verdict ? verdict.ticked : 0, few = ticked < 2;
  Object.assign(by("together-button"), {
    disabled: !!state.job || few,
    title: few ? "Tick two releases or more to be fitted" : `Judge the ${ticked} ticked releases as one: which effects all of them need, each with its own natural frequency, damping ratio and rest angle`,
  });
  drawDiagnosis(act);
  const focus = focused();
  const place = document.activeElement instanceof HTMLInputElement && focus && focus.startsWith("note-") ? document.activeElement.selectionStart : null;
  // An item that is as it was stays, so that no click on it is lost.
  const trials = seen.view ? seen.view.trials.map((t) => t.effect) : [];
  const items = list.map((c) => {
    const key = JSON.stringify([c, !!state.job, c.effect === current, c.effect === open, c.effect === seen.ghost, trials.indexOf(c.effect), seen.release]);
    const old = kept.get(c.effect);
    const item = old && old.key === key ? old.item : candidate(c, state, act);
    kept.set(c.effect, { key, item });
    return item;
  });
  const there = [.../** @type {HTMLCollectionOf<HTMLElement>} */ (by("candidates").children)];
  if (there.length === items.length && items.every((item, k) => item.dataset.effect === there[k].dataset.effect)) {
    items.forEach((item, k) => { if (item !== there[k]) there[k].replaceWith(item); });
  } else by("candidates").replaceChildren(...items);
  if (focus) {
    const again = first(`[data-focus="${focus}"]`);
    if (again && again !== document.activeElement) again.focus({ preventScroll: true });
    if (again instanceof HTMLInputElement && place !== null) again.setSelectionRange(place, place);
  }
}

/** @param {Candidate} c @param {State} state @param {Act} act */
function candidate(c, state, act) {
  const id = c.effect, busy = !!state.job;
  const choose = (/** @type {string | null} */ value) => { current = id; open = value; rejecting = null; draw(state, act); };
  const trials = seen.view ? seen.view.trials.map((t) => t.effect) : [], k = trials.indexOf(id);
  const trial = make("span", { className: "trial", title: k < 0 ? "" : "its line in the panels against amplitude" });
  if (k >= 0 && k < 5) trial.style.borderTopColor = `var(--${trialColour(k)})`;
  const found = c.over_noise === undefined ? "" : c.converged ? `ratio ${ratio(c.over_noise)} · difference of BIC ${digits(c.evidence, 3)}` : "not converged";
  const why = () => notes.get(id) || null;
  const is_shown = seen.ghost === id;
  const item = make("li", {
    className: `candidate${id === current ? " current" : ""}${c.is_suggested ? " suggested" : ""}${c.rejected ? " rejected" : ""}`, "data-effect": id,
  },
  make("div", { className: "head" },
    make("button", { type: "button", className: "name", textContent: id, "data-focus": `name-${id}`, title: c.is_suggested ? `${c.title}: needed, by this release's diagnosis` : c.title, "aria-expanded": String(open === id), onclick: () => choose(open === id ? null : id) }),
    make("span", { className: "found", textContent: found, title: "Residual over noise with this effect in this release, and the difference of an information criterion: larger is better, below 10 it is not believed." })),
  make("p", { className: "caption", textContent: c.title }),
  make("div", { className: "buttons" },
    make("button", { type: "button", textContent: is_shown ? "Hide" : "Try", "data-focus": `try-${id}`, disabled: busy || !c.can_be_tried, title: c.can_be_tried ? "Fit this release with it and lay it over the panels; nothing is written (t)" : "random: it cannot be simulated", onclick: () => { current = id; lay(id, act); } }),
    make("button", { type: "button", textContent: "Add", "data-focus": `add-${id}`, disabled: busy || !c.can_be_tried, title: "Into the model, fitted to all ticked releases (a)", onclick: () => { current = id; act({ do: "add", effect: id, why: why() }); } }),
    make("button", { type: "button", textContent: "Reject", "data-focus": `reject-${id}`, disabled: busy, title: "Not this one, with the reason, in the journal (r)", onclick: () => reject(c, state, act) }),
    trial));
  if (c.rejected) item.append(make("p", { className: "caption", textContent: `rejected in step ${c.rejected.step}: ${c.rejected.why || "no reason given"}` }));
  if (open === id) {
    const line = (/** @type {string} */ name, /** @type {Node | string} */ text) => [make("dt", { textContent: name }), make("dd", {}, text)];
    item.append(make("dl", { className: "card" },
      ...line("moment", make("code", { textContent: c.formula })), ...line("cause", c.cause), ...line("seen as", c.fingerprint),
      ...line("confirm", c.confirm), ...line("remove", c.remove)));
    item.append(make("input", {
      className: "note", placeholder: "reason, for the journal", value: notes.get(id) || "", "data-focus": `note-${id}`, "aria-label": `reason to add or reject ${c.title}`,
      oninput: (event) => notes.set(id, event.target.value),
      onkeydown: (event) => { if (event.key === "Enter" && rejecting === id) reject(c, state, act); },
    }));
  }
  return item;
}

/** Lays it over the panels, or takes it off again. @param {string} effect @param {Act} act */
function lay(effect, act) {
  if (seen.ghost === effect) act({ do: "lay", ghost: null });
  else if (seen.release !== null) act({ do: "try", release: seen.release, effect });
}

/** A rejection without a reason helps nobody: the note is asked for first.
 * @param {Candidate} c @param {State} state @param {Act} act */
export function reject(c, state, act) {
  const why = (notes.get(c.effect) || "").trim();
  if (why) { rejecting = null; notes.delete(c.effect); return act({ do: "reject", effect: c.effect, why }); }
  current = open = rejecting = c.effect;
  draw(state, act);
  /** @type {HTMLInputElement | null} */
  const note = first(`[data-focus="note-${c.effect}"]`);
  if (!note) return;
  note.placeholder = "say why, then Enter";
  note.focus();
}

/** By keys.
 * @param {"next" | "previous" | "open" | "try" | "add" | "reject"} what @param {State} state @param {Act} act */
export function key(what, state, act) {
  const at = list.findIndex((c) => c.effect === current), c = list[at];
  if (what === "next" || what === "previous") {
    const to = list[at + (what === "next" ? 1 : -1)];
    if (to) { current = to.effect; draw(state, act); document.querySelector(`[data-effect="${current}"]`)?.scrollIntoView({ block: "nearest" }); }
  } else if (what === "open" && c) { open = open === current ? null : current; rejecting = null; draw(state, act); } else if (what === "reject" && c) reject(c, state, act);
  else if (c && c.can_be_tried && what === "try") lay(c.effect, act);
  else if (c && c.can_be_tried && what === "add") act({ do: "add", effect: c.effect, why: notes.get(c.effect) || null });
}
