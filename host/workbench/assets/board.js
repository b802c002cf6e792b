// A board at the browser's plug: its port is opened, read and written here; what is said over it, a worker knows. What the
// board says is kept in the browser before anything else is done with it.
import { compiled, GONE } from "./backend.js";
import * as drawn from "./drawn.js";
import * as kept from "./kept.js";
import * as plug from "./plug.js";
import * as points from "./points.js";
import { by, download, post, send } from "./talk.js";

const NONE = "This browser has no Web Serial, so that no page can speak to a board: open this page by https in Chromium, Chrome, Edge or Firefox of today on a computer, or follow the board with the program (yawrig monitor).";
const CHOOSE = "Press Connect and choose the board's port. It is not reset, and nothing is written to it but the condition you set and the network you choose.";
/** Between two attempts to add a release to the list while something else is under way, ms. */
const AGAIN_MS = 1000;

let /** @type {Worker | null} */ worker = null, /** @type {LiveState | null} */ state = null, said = /** @type {LogLine | null} */ (null);
let told = () => {}, /** @type {Failed} */ fail = () => {}, isConnecting = false, stem = "", /** @type {string[]} */ lines = [], isKept = true, adding = Promise.resolve(), closing = Promise.resolve();
// The worker's last news of a board that was let go may still be under way when it is.
let isLetGo = true, ended = () => {};
const isOn = () => !!state && state.is_followed;

/** Calls `listener` when there is another verdict on the board. @param {() => void} listener */
export const onVerdict = (listener) => { told = listener; };
/** Of a page that has a server. */
export const open = async () => {}, heard = () => {}, key = () => false;

export function verdict() {
  if (by("live").hidden) return null;
  if (!isOn()) return { text: "Board: none is followed.", detail: "" };
  return { text: said ? `Board: ${said.text.split("\n")[0]}` : "Board: no release yet.", detail: state?.device ?? "" };
}

/** @param {string} text */
const say = (text) => { by("board-told").textContent = text; };

function keep(/** @type {object} */ line) {
  const text = JSON.stringify(line);
  lines.push(text);
  kept.add(stem, text).catch(unkept);
}

function unkept() {
  isKept = false;
  say("This browser keeps nothing of it: save the results before this page is closed.");
}

/** A release is kept, and becomes a record in the list. @param {{ release: number, missing_samples: number, text: string }} record */
function add({ release, text }) {
  const name = `${stem}-release-${String(release).padStart(3, "0")}.csv`;
  kept.addRelease(name, text).catch(unkept);
  adding = adding.then(async () => {
    await send("/api/drop", new File([text], name));
    for (;;) {
      try { return void await post("/api/do", { do: "open", file: name }); } catch (/** @type {any} */ error) {
        if (!error.message.startsWith("not now")) throw error;
        await new Promise((resolve) => setTimeout(resolve, AGAIN_MS));
      }
    }
  }).catch(fail);
}

/** @param {LiveNews} news */
function take({ state: now, ...news }) {
  state = isLetGo ? { ...now, is_followed: false } : now;
  for (const line of drawn.take(news)) {
    points.heard(line);
    if (["release", "refined"].includes(line.event)) { said = line; told(); }
    if (["written", "refused"].includes(line.event)) say(line.text.replace("\n", "; "));
  }
  if (!isLetGo && !now.is_followed) end(now.fault);
  show();
}

/** @param {Fault | null} fault */
function end(fault) {
  isLetGo = true;
  const worker_ended = worker && new Promise((resolve) => { ended = () => resolve(undefined); });
  worker?.postMessage({ end: true });
  closing = Promise.all([plug.close(), worker_ended]).then(() => {});
  if (state) state.is_followed = false;
  isConnecting = false;
  say(fault ? `${fault.message}; ${fault.help}` : "");
  if (fault) fail(fault);
  show();
}

async function begun() {
  const now = new Worker("board-worker.js", { type: "module" });
  now.onerror = () => { worker = null; ended(); end(GONE); };
  now.onmessage = ({ data }) => {
    if (now !== worker) return;
    if ("keep" in data) keep(data.keep);
    else if ("ended" in data) ended();
    else if ("send" in data) plug.write(data.send);
    else if ("record" in data) add(data.record);
    else if ("fault" in data) {
      if (data.is_broken) { now.terminate(); worker = null; ended(); end(data.fault); } else { say(`${data.fault.message}; ${data.fault.help}`); fail(data.fault); }
    } else if (data.news.kind === "live") {
      if (isConnecting && !isLetGo) { say(""); isConnecting = false; }
      take(data.news);
    }
    else if (data.news.kind === "writing") say(`writing ${data.news.name}: ${Math.round(100 * data.news.share)} %`);
    else about(data.news);
  };
  worker = now;
  now.postMessage({ module: await compiled() });
}

/** @param {{ text: string, warning: string | null }} of */
function about({ text, warning }) {
  by("board-about").hidden = false;
  by("board-text").textContent = text;
  by("board-warning").hidden = !warning;
  by("board-warning").textContent = warning;
  by("board-summary").textContent = warning ? "What it says of itself, and what should be changed" : "What it says of itself";
  by("board-summary").classList.toggle("warned", !!warning);
}

async function connect() {
  if (isOn() || isConnecting) return end(null);
  try {
    await closing;
    const name = await plug.open({
      came: (bytes) => worker?.postMessage({ came: bytes }, [bytes.buffer]),
      gone: (why) => worker?.postMessage({ gone: why }),
      back: () => worker?.postMessage({ back: true }),
    });
    if (name === null) return say("no port was chosen");
    isConnecting = true;
    isLetGo = false;
    lines = []; said = null; state = null; isKept = true;
    stem = `board-${new Date().toISOString().slice(0, 19).replaceAll(":", "-")}Z`;
    drawn.forget();
    points.forget();
    by("board-about").hidden = true;
    say("asking the board its name …");
    show();
    if (!worker) await begun();
    keep({ schema_version: 1, event: "session", started: new Date().toISOString(), program: "yawrig in a browser", rate_hz: 1000 });
    worker?.postMessage({ begin: name });
  } catch (error) { isConnecting = false; isLetGo = true; closing = plug.close(); say(""); fail(error); show(); }
}

/** The condition as it is asked for; what is no number is said. */
function condition() {
  const number = (/** @type {"board-wind" | "board-density" | "board-length" | "board-area" | "board-inertia"} */ id) => {
    const text = by(id).value.trim().replace(",", "."), value = Number(text);
    if (text === "" && id === "board-inertia") return null;
    if (text === "" || !Number.isFinite(value)) throw Object.assign(new Error(`${by(id).ariaLabel}: ${text ? `${text} is no number` : "it is missing"}`), { help: "give a number" });
    return value;
  };
  const spring = by("board-spring").value.trim();
  if (!spring) throw Object.assign(new Error("the spring has no name"), { help: "give it one: releases of the same spring and axis are compared" });
  return { do: "condition", spring, axis: by("board-axis").value, wind_speed_m_s: number("board-wind"), density_kg_m3: number("board-density"),
    length_m: number("board-length"), frontal_area_m2: number("board-area"), inertia_kg_m2: number("board-inertia") };
}

/** @param {Failed} failed */
export function build(failed) {
  fail = failed;
  drawn.build();
  by("live-connect").onclick = () => { connect(); };
  const mark = () => { worker?.postMessage({ order: { do: "mark", text: by("live-note").value.trim() || "mark" } }); by("live-note").value = ""; };
  by("live-mark").onclick = mark;
  by("live-note").onkeydown = (e) => { if (e.key === "Enter") mark(); };
  by("board-set").onclick = () => { try { worker?.postMessage({ order: condition() }); } catch (error) { fail(error); } };
  by("board-write").onclick = () => by("board-file").click();
  by("board-file").onchange = async () => {
    const file = by("board-file").files?.[0];
    by("board-file").value = "";
    if (file) worker?.postMessage({ network: file.name, bytes: new Uint8Array(await file.arrayBuffer()) });
  };
  by("board-save").onclick = () => download(`${stem}.jsonl`, `${lines.join("\n")}\n`);
  by("live-close").onclick = toggle;
  addEventListener("beforeunload", (event) => { if (isOn() || lines.length && !isKept) event.preventDefault(); });
  show();
}

export function toggle() {
  const isShown = by("live").hidden;
  by("live").hidden = !isShown;
  by("panels").hidden = isShown;
  told();
  show();
  (isShown ? by("live-connect") : by("live-button")).focus();
}

function show() {
  by("live-connect").disabled = !plug.isThere();
  by("live-connect").textContent = isOn() ? "Disconnect" : isConnecting ? "Cancel" : "Connect";
  by("live-connect").classList.toggle("primary", !isOn());
  for (const id of /** @type {const} */ (["live-note", "live-mark", "board-write", "board-set"])) by(id).disabled = !isOn();
  by("board-save").hidden = !lines.length;
  const count = by("live-count");
  count.textContent = state ? `${state.samples} samples, ${state.missing_samples} missing` : "";
  if (state) Object.assign(count.dataset, { samples: state.samples, missing: state.missing_samples });
  const next = points.next();
  by("measure-next").textContent = next ? next.text.split("\n").pop() ?? "" : "";
  points.draw();
  told();
  drawn.soon(() => drawn.draw(0, !plug.isThere() ? NONE : isOn() ? "waiting for the board's samples …" : CHOOSE));
}
