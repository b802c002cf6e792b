// The page that needs no server: opens records, asks the worker, draws what it answers.
import { by, get, make, post, ratio } from "./talk.js";
import { cancel as end, onSaid } from "./backend.js";
import * as panels from "./panels.js";
import * as effects from "./effects.js";
import * as dropped from "./dropped.js";

const { seen } = panels;
/** A record that was opened. @typedef {{ id: number, name: string, fault: Fault | null }} Opened */
let /** @type {Opened[]} */ records = [], /** @type {{ what: string, since: number, said: string, is_last?: true } | null} */ job = null;
/** What is printed of a release, by verb. @type {Map<number, { identify: Printed | null, diagnose: Printed | null }>} */
const printed = new Map();

function say(/** @type {string} */ text, isError = false) {
  Object.assign(by("message"), { textContent: text, title: text, className: isError ? "error" : "" });
}
const brief = (/** @type {string} */ text) => text.split("\n")[0];
/** @type {Failed} */
const failed = (error) => {
  const { message, help } = /** @type {Fault} */ (error);
  say(help ? `${brief(message)} — ${help}` : brief(message), true);
};

/** What the workbench's scripts are told of a session that keeps no model. @returns {State} */
const state = () => /** @type {any} */ ({ job, model: { keeps_none: true, fault: null, exists: false, effects: [], file: "" }, releases: records });

// Work.

/** One thing after the other; its answer, or null where it failed or was cancelled.
 * @template T @param {string} what @param {() => Promise<T>} work @returns {Promise<T | null>} */
async function work(what, work) {
  if (job) { say(`not now: ${job.what} is under way`, true); return null; }
  const mine = job = { what, since: performance.now(), said: "" };
  drawJob();
  drawSide();
  try { return await work(); } catch (error) { if (job === mine) failed(error); return null; } finally {
    if (job === mine) job = null;
    drawJob();
    drawSide();
  }
}

function drawJob() {
  by("job").hidden = !job;
  document.body.toggleAttribute("data-busy", !!job);
  if (job) by("job-text").textContent = `${job.what} … ${((performance.now() - job.since) / 1000).toFixed(0)} s${job.said ? `, ${job.said}` : ""}`;
}
setInterval(drawJob, 250);
onSaid((text) => { if (job) job.said = brief(text); if (text.startsWith("yawrig: warning: ")) say(text.replace("yawrig: warning: ", "")); });

async function cancel() {
  if (!job || job.is_last) return;
  // Nothing else is asked of the next worker before it has the records.
  const mine = job = { what: "opening the records again", since: performance.now(), said: "", is_last: true };
  drawJob();
  // What lay over the panels went with the worker.
  seen.ghost = null;
  try {
    await end();
    say("cancelled");
  } catch (error) { failed(error); }
  if (job === mine) job = null;
  drawJob();
  await panels.refresh();
  await fitted();
  drawSide();
}

// Records.

async function opened(/** @type {number} */ id) {
  records = /** @type {any} */ (await get("/api/state")).releases;
  printed.delete(id);
  await choose(id);
  await analyse(id);
}

async function choose(/** @type {number} */ id) {
  seen.release = null;
  drawRecords(id);
  await panels.show(id);
  await fitted();
  drawHead();
  drawSide();
}

/** The record is drawn before a model is fitted to it: then that, too. */
async function fitted() {
  if (seen.view && !seen.curves?.residual_deg) await panels.refresh();
}

/** What is found in a record at once, and what takes longer. */
async function analyse(/** @type {number} */ id) {
  if (seen.fault) return;
  const found = await work("identifying", () => asked("/api/identify", id));
  printed.set(id, { identify: found, diagnose: null });
  drawHead();
  drawSide();
  await diagnose();
}

/** @param {"/api/identify" | "/api/diagnose"} path @param {number} release @returns {Promise<Printed>} */
const asked = async (path, release) => /** @type {any} */ (await get(/** @type {any} */ (path), { release }));

async function diagnose() {
  const id = seen.release;
  if (id === null) return;
  const found = await work("fitting every effect", async () => {
    await post("/api/do", { do: "diagnose", release: id });
    return asked("/api/diagnose", id);
  });
  if (!found) return;
  printed.set(id, { identify: printed.get(id)?.identify ?? null, diagnose: found });
  if (seen.release !== id) return;
  seen.ghost = panels.DIAGNOSIS;
  await panels.refresh();
  drawHead();
}

/** @type {Act} */
async function act(what) {
  if (what.do === "lay") { seen.ghost = what.ghost; await panels.refresh(); return drawSide(); }
  if (what.do !== "try") return;
  const done = await work(`trying ${what.effect}`, () => post("/api/do", what));
  if (!done) return;
  say(/** @type {any} */ (done).message);
  seen.ghost = what.effect;
  await panels.refresh();
}

// Drawing.

function drawRecords(/** @type {number | null} */ current = seen.release) {
  by("release-list").replaceChildren(...records.map(({ id, name, fault }) => make("button", {
    type: "button", className: "record", textContent: name, title: fault ? fault.message : name, "aria-current": String(id === current), onclick: () => { choose(id).catch(failed); },
  })));
}

function drawHead() {
  const record = records.find((r) => r.id === seen.release), v = seen.view, found = seen.release === null ? undefined : printed.get(seen.release);
  const verdict = by("verdict"), fault = seen.fault || record?.fault;
  const put = (/** @type {string} */ text, /** @type {string} */ status) => { verdict.textContent = verdict.title = text; verdict.dataset.status = status; };
  if (!record) put("Drop the record of a free decay on this page, or open one.", "unknown");
  else if (fault) put(`Bad data: ${brief(fault.message)}${fault.help ? ` — ${fault.help}` : ""}`, "bad");
  else if (found?.diagnose) put(`This release is ${found.diagnose.sentence}.`, found.diagnose.json.status === "adequate" || found.diagnose.json.status === "explained" ? "adequate" : "structured");
  else if (v) put(v.is_explained ? "A second-order model explains this release to the noise." : `Something is missing: a second-order model leaves ${ratio(v.over_noise)} times the noise.`, v.is_explained ? "adequate" : "structured");
  else put("Reading …", "unknown");
  const figures = panels.figures();
  by("subtitle").textContent = by("subtitle").title = record ? [record.name, figures].filter(Boolean).join(" · ") : "CSV with time_s and yaw_deg, or what a data logger, MATLAB (before 7.3), LabVIEW or a telephone exports.";
  const ratioOf = (/** @type {string} */ id, /** @type {number | null | undefined} */ x) => { by(id).textContent = ratio(x); by(id).className = x === null || x === undefined ? "" : x <= 1.1 ? "good" : "warn"; };
  ratioOf("figure-fitted", v ? v.over_noise : null);
  const steps = found?.diagnose?.json.steps;
  ratioOf("figure-with", steps && steps.length > 1 ? steps[steps.length - 1].residual_over_noise : null);
  // As they are printed.
  by("figure-wn").textContent = found?.identify?.shown?.natural_frequency_rad_s ?? "–";
  by("figure-zeta").textContent = found?.identify?.shown?.damping_ratio ?? "–";
  document.title = record ? `${record.name} · yawrig` : "yawrig";
}

function drawSide() {
  effects.refresh(state(), act).catch(failed);
  const found = seen.release === null ? undefined : printed.get(seen.release);
  by("printed").hidden = !found?.identify && !found?.diagnose;
  for (const verb of /** @type {const} */ (["identify", "diagnose"])) {
    const of = found?.[verb];
    by(`printed-${verb}`).hidden = by(`save-${verb}`).hidden = !of;
    by(`printed-${verb}`).textContent = of ? of.text : "";
  }
}

function save(/** @type {"identify" | "diagnose"} */ verb) {
  const of = seen.release === null ? null : printed.get(seen.release)?.[verb];
  if (!of) return;
  const address = URL.createObjectURL(new Blob([`${JSON.stringify(of.json, null, 2)}\n`], { type: "application/json" }));
  make("a", { href: address, download: `${verb}.json` }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}

function start() {
  by("plot-overlay").dataset.empty = "Drop a record here.";
  panels.build();
  panels.onView(() => { drawHead(); drawSide(); });
  panels.onCut((from_s, to_s) => {
    const release = seen.release;
    if (release === null || job) return;
    post("/api/do", { do: "between", release, from_s, to_s }).then(() => opened(release)).catch(failed);
  });
  dropped.take((id) => { opened(id).catch(failed); }, failed);
  by("open-file").onchange = async () => {
    const files = [...by("open-file").files ?? []];
    by("open-file").value = "";
    for (const file of files) {
      try { await dropped.taken(file, (id) => { opened(id).catch(failed); }); } catch (error) { failed(error); }
    }
  };
  by("diagnose-button").onclick = () => { diagnose().catch(failed); };
  by("cancel-button").onclick = cancel;
  for (const verb of /** @type {const} */ (["identify", "diagnose"])) by(`save-${verb}`).onclick = () => save(verb);
  document.addEventListener("keydown", (event) => { if (event.key === "Escape") cancel(); });
  drawHead();
  drawSide();
  panels.refresh();
  // Where there is none (no https, and not this machine) the page needs its network.
  navigator.serviceWorker?.register("offline.js").catch(() => {});
}

start();
