// The page: fetches what has changed, passes on what is done, and knows the keys.
import { by, download, get, GONE, HAS_SYSTEM, listen, make, post, ratio } from "./talk.js";
import * as address from "./address.js";
import * as panels from "./panels.js";
import * as dropped from "./dropped.js";
import * as releases from "./releases.js";
import * as effects from "./effects.js";
import * as campaign from "./campaign.js";
import * as law from "./law.js";
import * as own from "./own.js";
import * as steps from "./steps.js";
import * as derivatives from "./derivatives.js";
import * as live from "./live.js";

const { seen } = panels;
let /** @type {State | null} */ state = null, ended = 0, modelKey = "";

function say(/** @type {string} */ text, isError = false) {
  const message = by("message");
  message.textContent = text;
  message.title = text;
  message.className = isError ? "error" : "";
}
/** A message without the lines of the file that it points at: there is one line for it. */
const brief = (/** @type {string} */ text) => text.split("\n")[0];
const inWords = (/** @type {Fault} */ { message, help }) => (help ? `${brief(message)} — ${help}` : brief(message));
/** @type {Failed} */
const failed = (error) => say(inWords(/** @type {Fault} */ (error)), true);

/** Does what the user asks for. @type {Act} */
async function act(what) {
  if (what.do === "lay") { seen.ghost = what.ghost; await panels.refresh(); if (state) await effects.refresh(state, act); return; }
  if (what.do === "try") seen.ghost = what.effect;
  try { await post("/api/do", what); } catch (error) { failed(error); }
}

let asking = false, again = false;
async function fetchState() {
  if (asking) { again = true; return; }
  asking = true;
  try { take(await get("/api/state")); } catch (error) { failed(error); }
  asking = false;
  if (again) { again = false; fetchState(); }
}

function take(/** @type {State} */ now) {
  const was = state;
  state = now;
  releases.draw(state, choose, failed);
  steps.draw(state, act);
  if (seen.release === null && !follow(address.read()) && state.releases.length) choose((state.releases.find((r) => !r.is_left_out) || state.releases[0]).id);
  drawHead(state);
  drawJob(state.job);
  const key = JSON.stringify([state.model, state.own, state.steps.length]);
  const changed = key !== modelKey;
  modelKey = key;
  if (state.ended && state.ended.number !== ended) {
    ended = state.ended.number;
    if (state.ended.message) say(inWords(state.ended), state.ended.is_error);
    const { job, is_error } = state.ended, isTrial = job.do === "try";
    if (isTrial ? is_error : changed) seen.ghost = null;
    // What it leaves is drawn at once.
    if (job.do === "diagnose" && !is_error) seen.ghost = panels.DIAGNOSIS;
    panels.refresh();
    derivatives.refresh(state, act).catch(failed);
  } else if (changed) {
    if (was && !state.job) tellOutside(was, state);
    panels.refresh();
    derivatives.refresh(state, act).catch(failed);
  }
  drawSide(state);
}

/** What has happened to the model other than by a page: by a command, or by hand.
 * @param {State} was @param {State} now */
function tellOutside(was, { model, steps }) {
  const last = steps[steps.length - 1];
  if (model.fault) failed(model.fault);
  else if (steps.length > was.steps.length) say(`step ${last.step}, taken outside this page: ${last.what}`);
  else if (model.edited && !was.model.edited && model.exists) say(`${model.file} was edited by hand`);
  else if (was.model.fault) say(`${model.file} can be used again`);
}

/** Effects and law, as far as they are known of this release. @param {State} state */
function drawSide(state) {
  effects.refresh(state, act);
  law.refresh(state, act);
  by("law-button").disabled = !!state.job || seen.release === null;
}

/** @param {State} state */
function drawHead(state) {
  const { overall, model } = state, release = state.releases.find((r) => r.id === seen.release), now = live.verdict();
  by("figures").hidden = !!now;
  if (now) {
    Object.assign(by("verdict"), { textContent: now.text, title: now.text });
    by("verdict").dataset.status = "live";
    by("left-out").hidden = by("verdict-all").hidden = true;
    by("subtitle").textContent = by("subtitle").title = now.detail;
    return;
  }
  const broken = model.fault || (release && release.badge === "bad" ? release.fault : null);
  const judged = (/** @type {HTMLElement} */ e, /** @type {string} */ text, /** @type {string} */ status, title = text) => { e.textContent = text; e.title = title; e.dataset.status = status; };
  // Of one record alone there is one verdict, of several there are two, each with its name.
  const ticked = state.releases.filter((r) => r.used === "fit"), isAlone = !release || (ticked.length === 1 && ticked[0].id === release.id);
  if (broken) judged(by("verdict"), `${model.fault ? "The model cannot be used" : "This record: bad data"}: ${brief(broken.message)}`, "bad", `${broken.message}\n${broken.help}`);
  else if (release) judged(by("verdict"), `This record: ${release.verdict}`, release.badge === "pending" ? "unknown" : release.badge);
  else judged(by("verdict"), HAS_SYSTEM || state.releases.length ? overall.verdict : "Drop the record of a free decay on this page, or open one.", overall.status);
  by("verdict-all").hidden = isAlone;
  judged(by("verdict-all"), overall.verdict, overall.status);
  const leftOut = by("left-out");
  leftOut.hidden = !overall.left_out;
  leftOut.textContent = leftOut.title = overall.left_out || "";
  const figures = panels.figures();
  const edited = (model.read_only ? "to look at only, its folder cannot be written; " : "") + (model.edited && model.exists ? "edited by hand since the last step; " : "")
    + (model.changed_records && model.changed_records.length ? `changed since the fit: ${model.changed_records.join(", ")}; ` : "");
  by("subtitle").textContent = `${model.file}${model.exists || model.fault ? "" : " (not made yet)"} · ${edited}${release ? [release.name, figures].filter(Boolean).join(" · ") : "no record is open"}`;
  by("subtitle").title = by("subtitle").textContent;
  const set = (/** @type {string} */ id, /** @type {number | null} */ x) => { const e = by(id); e.textContent = ratio(x); e.className = x === null ? "" : x <= 1.1 ? "good" : "warn"; };
  set("figure-one", release && seen.view && seen.view.release === release.id ? seen.view.over_noise : null);
  set("figure-fitted", overall.over_noise);
  set("figure-held", overall.held_out);
  const held = by("figure-held").parentElement;
  if (held) held.title = `Residual over noise on what was not fitted: ${overall.held_out_is}.`;
  document.title = `${release ? release.name : "yawrig"} · workbench`;
}

function drawJob(/** @type {Progress | null} */ job) {
  by("job").hidden = !job;
  document.body.toggleAttribute("data-busy", !!job);
  if (job) {
    by("job-text").textContent = `${job.is_stopping ? "stopping" : job.what} … ${job.seconds.toFixed(0)} s${job.looks === null ? "" : `, ${job.looks} trial runs`}`;
    by("cancel-button").disabled = job.is_stopping;
  }
}

/** Shows what an address is of, where its record is here. @param {address.Place} place */
function follow({ record, span, tab: name }) {
  if (record === null) return false;
  tab(TABS.find((tab) => tab === name) ?? TABS[0]);
  const release = state?.releases.find((r) => r.name === record);
  if (release) choose(release.id, span); else fetched(record);
  return !!release;
}

/** What lies beside the page that needs no server. @type {(name: string) => Promise<File | null>} */
let beside = async () => null;
const /** @type {Set<string>} */ missed = new Set();
/** Opens the record that an address names, where it lies beside the page. It is looked for once. @param {string} name */
async function fetched(name) {
  if (missed.has(name)) return;
  missed.add(name);
  try {
    const file = await beside(name);
    if (file) await dropped.taken([{ file, name }], opened, failed);
    else failed({ message: `the address is of ${name}, which is not in the list`, help: "open it (o)" });
  } catch (error) { failed(error); }
}

/** The address of what is looked at. */
function place() {
  const release = state?.releases.find((r) => r.id === seen.release), shown = TABS.find((name) => !by(`pane-${name}`).hidden);
  if (release) address.write({ record: release.name, span: seen.span, tab: shown === TABS[0] ? null : shown ?? null });
}

/** @param {number | null} id @param {Span} [span] */
async function choose(id, span) {
  if (id === null) return;
  const begin = performance.now();
  seen.release = null;
  releases.mark(id);
  await panels.show(id, span);
  document.documentElement.dataset.lastClick = String(Math.round(performance.now() - begin));
  if (state) { drawHead(state); drawSide(state); }
}

live.onVerdict(() => { if (state) drawHead(state); });
panels.onView(() => { place(); if (state) { drawHead(state); drawSide(state); } diagnoseFirst(); });

let /** @type {number | null} */ soon = null;
function heard(/** @type {News} */ news) {
  if (news.kind === "job") {
    drawJob(news.job);
    // Buttons that have to wait for it are drawn from the state.
    if (state && !state.job && news.job) fetchState();
    return;
  }
  if (news.kind === "live") return live.heard(news);
  if (news.kind === "law") { if (state) law.refresh(state, act); return; }
  if (news.kind === "view" ? news.release === seen.release : !seen.view) panels.refresh();
  // Thirty releases become ready one after the other: not a request for each.
  if (news.kind === "view") { soon = soon || setTimeout(() => { soon = null; fetchState(); }, 120); } else fetchState();
}

// Tabs.

const TABS = /** @type {const} */ (["effects", "own", "derivatives"]);
function tab(/** @type {TABS[number]} */ name) {
  for (const other of TABS) {
    const is = other === name, button = by(`tab-${other}`);
    button.setAttribute("aria-selected", String(is));
    button.tabIndex = is ? 0 : -1;
    by(`pane-${other}`).hidden = !is;
  }
  own.opened(name === "own");
  place();
  if (name === "derivatives" && state) derivatives.refresh(state, act).catch(failed);
}

// Keys.

/** @typedef {[shown: string, what: string, act: ((event: KeyboardEvent, state: State) => void) | null, keys: string[]]} Key */
/** @type {Key[]} */
const KEYS = [
  ["j  k", "next, previous release", (e) => choose(releases.neighbour(e.key === "j" ? 1 : -1)), ["j", "k"]],
  ["f  h", "tick this release as fitted, as held out", (e, now) => toggle(now, e.key === "f" ? "fit" : "hold_out"), ["f", "h"]],
  ["Shift F", "fit the model to the ticked releases", () => act({ do: "fit" }), ["F"]],
  ["d", "what is missing in this release?", () => diagnose(), ["d"]],
  ["m", "measure the law that the ticked releases show", () => act({ do: "law" }), ["m"]],
  ["n  p", "next, previous effect", (e, now) => effects.key(e.key === "n" ? "next" : "previous", now, act), ["n", "p"]],
  ["c", "the effect's card", (_, now) => effects.key("open", now, act), ["c"]],
  ["t", "try it: lay it over the panels, or take it off again", (_, now) => effects.key("try", now, act), ["t"]],
  ["a", "add it to the model", (_, now) => effects.key("add", now, act), ["a"]],
  ["r", "reject it, with a reason", (_, now) => effects.key("reject", now, act), ["r"]],
  ["u", "return to the model before the last step", (_, now) => back(now), ["u"]],
  ["+  −", "zoom in and out", (e) => panels.zoomBy(e.key === "-" ? 2 : 0.5), ["+", "-", "="]],
  ["Ctrl wheel", "zoom about the pointer, in the two panels over time", null, []],
  ["←  →", "earlier, later", (e) => panels.zoomBy(1, e.key === "ArrowLeft" ? -0.25 : 0.25), ["ArrowLeft", "ArrowRight"]],
  ["z", "all of the record", () => panels.zoom(null, null), ["z"]],
  ["x", "analyse only the stretch in view, or, with all in view, all of the record", () => panels.cut(), ["x"]],
  ["1  2  3", "effects, your own, derivatives", (e) => tab(TABS[+e.key - 1]), ["1", "2", "3"]],
  ["l", HAS_SYSTEM ? "follow a device or show a stored session, or back to the releases" : "follow a board, or back to the releases", () => live.toggle(), ["l"]],
  ...!HAS_SYSTEM ? [] : /** @type {Key[]} */ ([["Space  [  ]", "a stored session: play or pause; to the mark or release before, after; arrows: 5 s", null, []]]),
  ["o", HAS_SYSTEM ? "open a record of this folder" : "open records", () => open(), ["o"]],
  ...!HAS_SYSTEM ? [] : /** @type {Key[]} */ ([["g", "make a campaign.toml of the folder's records", () => makeCampaign(), ["g"]]]),
  ["Esc", "cancel what is under way", () => cancel(), ["Escape"]],
  ["?", "this list", () => by("help").showModal(), ["?"]],
];

/** @param {State} state @param {Use} used */
function toggle(state, used) {
  const release = state.releases.find((r) => r.id === seen.release);
  if (release) releases.set([release.id], release.used === used ? "out" : used, failed);
}
const diagnose = () => { if (seen.release !== null) act({ do: "diagnose", release: seen.release }); };
const cancel = () => { if (!by("job").hidden) post("/api/do", { do: "cancel" }).catch(failed); };
const makeCampaign = () => campaign.open(failed, fetchState);
async function opened(/** @type {number} */ id) {
  await fetchState();
  await choose(id);
  // Who opens one record without having installed anything wants to know what is in it: once it is drawn.
  if (!HAS_SYSTEM && state && state.releases.length === 1 && !state.model.exists) { isFirst = true; diagnoseFirst(); }
}
let isFirst = false;
async function diagnoseFirst() {
  if (!isFirst || !seen.view) return;
  isFirst = false;
  await fetchState();
  diagnose();
}
async function report() {
  const button = by("report-button");
  button.disabled = true;
  say("making report.html …");
  try {
    download("report.html", (await get("/api/report")).html);
    say("report.html is among your downloads");
  } catch (error) { failed(error); }
  button.disabled = false;
}
const open = () => (HAS_SYSTEM ? releases.openDialog(opened, failed, makeCampaign) : by("open-file").click());
function back(/** @type {State} */ { steps }) {
  const last = steps[steps.length - 1];
  if (last && last.step > 1) act({ do: "return", step: last.step - 1 });
}

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || !state) return;
  const { target } = event;
  if (!(target instanceof HTMLElement)) return;
  if (target.matches("input:not([type=checkbox]), textarea, select")) {
    if (event.key === "Escape") target.blur();
    return;
  }
  if (document.querySelector("dialog[open]")) return;
  if (target.matches("[role=tab]") && (event.key === "ArrowLeft" || event.key === "ArrowRight")) {
    const at = TABS.findIndex((name) => target.id === `tab-${name}`), to = TABS[(at + (event.key === "ArrowRight" ? 1 : TABS.length - 1)) % TABS.length];
    tab(to);
    by(`tab-${to}`).focus();
    return event.preventDefault();
  }
  if (live.key(event)) return event.preventDefault();
  const run = KEYS.find(([, , , keys]) => keys.includes(event.key))?.[2];
  if (run) { event.preventDefault(); run(event, state); }
});

function start() {
  panels.build();
  by("uncut-button").title += " (x)";
  let cutting = Promise.resolve();
  panels.onCut((from_s, to_s) => {
    const release = seen.release;
    if (release === null) return;
    // One after the other: what the first has cut is what the next begins with.
    cutting = cutting.then(() => post("/api/do", { do: "between", release, from_s, to_s })).then(fetchState)
      .catch(failed).then(() => { if (seen.release === release) return panels.refresh(); });
  });
  own.build(act, say, failed);
  live.build(failed);
  by("live-button").onclick = live.toggle;
  by("help").replaceChildren(make("p", { className: "row close" }, make("button", { type: "button", textContent: "Close", onclick: () => by("help").close() })),
    make("h2", { textContent: "Keys" }),
    make("dl", {}, ...KEYS.flatMap(([keys, what]) => [make("dt", {}, ...keys.split("  ").flatMap((k) => [make("kbd", { textContent: k }), " "])), make("dd", { textContent: what })])),
    make("h2", { textContent: "Panels" }),
    make("dl", {}, ...[.../** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll(".panel h3, #steps-panel h3"))].flatMap((h) => [make("dt", { textContent: h.firstChild?.textContent?.trim() }), make("dd", { textContent: h.title })])));
  by("help-button").onclick = () => by("help").showModal();
  by("open-button").onclick = open;
  dropped.take(opened, failed);
  by("fit-button").onclick = () => act({ do: "fit" });
  by("report-button").onclick = report;
  by("diagnose-button").onclick = diagnose;
  by("law-button").onclick = () => act({ do: "law" });
  by("together-button").onclick = () => act({ do: "together" });
  by("cancel-button").onclick = cancel;
  for (const name of TABS) by(`tab-${name}`).onclick = () => tab(name);
  addEventListener("hashchange", () => { if (state) follow(address.read()); });
  // What became known before the stream was open has been told to nobody: ask for all of it.
  listen(heard, (lost) => { if (lost) failed(GONE); else { fetchState(); panels.refresh(); live.open(); } });
  if (HAS_SYSTEM) fetchState(); else by("verdict").textContent = "Loading yawrig …";
}

start();

/** What the page that needs no server adds to it. */
export const page = { say, failed, opened, beside: (/** @type {typeof beside} */ has) => { beside = has; }, refresh: async () => { seen.release = null; address.forget(); await fetchState(); await panels.refresh(); } };
