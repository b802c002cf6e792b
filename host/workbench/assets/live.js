// A device followed, or a stored session shown again: what is chosen, recording and marks.
import * as drawn from "./drawn.js";
import * as measure from "./measure.js";
import * as replay from "./replay.js";
import { by, get, make, post } from "./talk.js";

/** The device's last word on a release. */
let said = /** @type {LogLine | null} */ (null), isOpen = false, /** @type {Failed} */ fail = () => {};
/** Until the server has said what is. @type {LiveState} */
let state = { epoch: 0, is_followed: false, device: "", samples: 0, missing_samples: 0, recording: null, speed: null, measuring: null, disk: null, replay: null, fault: null };
// What is taken belongs to one beginning; news that come while its history is asked for wait.
let refused = "", /** @type {number | null} */ epoch = null, asking = false, /** @type {LiveNews[]} */ waiting = [];

/** @param {Failed} failed */
export function build(failed) {
  fail = failed;
  /** @type {ActLive} */
  const done = async (what) => {
    refused = "";
    try { await post("/api/do", what); } catch (/** @type {any} */ error) { refused = what.do === "replay" ? `${error.message}\n${error.help}` : ""; fail(error); draw(); }
  };
  // One after the other: two at once may arrive in another order.
  let queue = Promise.resolve();
  /** @type {ActLive} */
  const act = (what) => { queue = queue.then(() => done(what)); return queue; };
  by("live-connect").onclick = () => {
    if (state.is_followed || state.replay) act({ do: "disconnect" });
    else if (by("live-source").value === "session") act({ do: "replay", session: by("live-session").value });
    else act({ do: "connect", device: by("live-device").value, speed: Number(by("live-speed").value) });
  };
  by("live-device").onchange = drawHead;
  by("live-source").onchange = () => { refused = ""; offer(); drawHead(); draw(); };
  by("live-record").onclick = () => act({ do: state.recording ? "stop_recording" : "record" });
  const mark = () => { const note = by("live-note"); act({ do: "mark", text: note.value.trim() || "mark" }); note.value = ""; };
  by("live-mark").onclick = mark;
  by("live-note").onkeydown = (e) => { if (e.key === "Enter") mark(); };
  by("live-close").onclick = toggle;
  replay.build(act);
  measure.build(act, fail);
  drawn.build();
}

let told = () => {};
/** Calls `listener` when there is another verdict on what is live. @param {() => void} listener */
export const onVerdict = (listener) => { told = listener; };

/** What is live, in a line, and its details; null while the releases are looked at. */
export function verdict() {
  if (by("live").hidden) return null;
  if (!state.is_followed && !state.replay) return { text: "Live: nothing is followed.", detail: "" };
  const from = state.replay ? `stored session ${state.replay.file}` : state.device;
  return { text: said ? `Live: ${said.text.split("\n")[0]}` : "Live: no release yet.", detail: from };
}

/** Takes up what a page has missed; shows itself where something is shown from the beginning. */
export async function open() {
  if (asking) return;
  asking = true;
  try {
    const now = await get("/api/live");
    said = null; epoch = now.epoch;
    measure.forget();
    drawn.forget();
    replay.places(now.places);
    take(now);
    if ((now.is_followed || now.replay) && by("live").hidden && !isOpen) toggle();
    isOpen = true;
  } catch (error) { waiting = []; fail(error); }
  asking = false;
  for (const news of waiting.splice(0)) heard(news);
}

export async function toggle() {
  const show = by("live").hidden;
  by("live").hidden = !show;
  by("panels").hidden = show;
  told();
  if (!show) { by("live-button").focus(); return; }
  if (state.replay) by("live-source").value = "session";
  await offer();
  by("live-connect").focus();
  draw();
}

/** What can be chosen: ports, and sessions that are stored. */
async function offer() {
  try {
    const [{ ports }, { sessions }] = await Promise.all([get("/api/devices"), get("/api/sessions")]);
    const choice = (/** @type {"live-device" | "live-session"} */ id, /** @type {Node[]} */ options, /** @type {string} */ before) => {
      const chosen = by(id).value || before;
      by(id).replaceChildren(...options);
      if (chosen) by(id).value = chosen;
      if (by(id).selectedIndex < 0) by(id).selectedIndex = 0;
    };
    choice("live-device", [make("option", { value: "emulated", textContent: "emulated" }), make("option", { value: "qemu", textContent: "qemu" }),
      ...ports.map((p) => make("option", { value: p.path, textContent: `${p.path}  ${p.description}` }))], state.device);
    choice("live-session", sessions.map((s) => make("option", { value: s.session, textContent: replay.called(s), title: s.session })),
      state.replay ? state.replay.file.replace(/\.csv(\.partial)?$/, "") : "");
  } catch (error) { fail(error); }
  drawHead();
}

/** @param {LiveNews} news */
export function heard(news) {
  if (asking) { waiting.push(news); return; }
  if (epoch !== null && news.state.epoch < epoch) return;
  if (news.state.epoch !== epoch) { waiting.push(news); open(); return; }
  take({ ...news.state, trace: news.trace, lines: news.lines });
}

/** Space, arrows and brackets while a stored session is on the page. Whether the key was one of them.
 * @param {KeyboardEvent} event */
export const key = (event) => !by("live").hidden && !!state.replay && replay.key(event);

/** @param {LiveState & Partial<LiveHistory>} now */
function take(now) {
  const was = state;
  state = now;
  for (const line of drawn.take(now)) {
    measure.heard(line);
    if (["release", "refined"].includes(line.event)) { said = line; told(); }
    if (line.event === "recorded") offer();
  }
  if (now.fault && (!was.fault || was.fault.message !== now.fault.message)) fail(now.fault);
  if (now.replay) by("live-source").value = "session";
  drawHead();
  drawn.soon(draw);
}

function drawHead() {
  const isOn = state.is_followed || !!state.replay, isSession = by("live-source").value === "session";
  const connect = by("live-connect");
  connect.textContent = state.is_followed ? "Disconnect" : state.replay ? "Leave" : isSession ? "Show" : "Connect";
  connect.classList.toggle("primary", !isOn);
  connect.disabled = !isOn && isSession && !by("live-session").options.length;
  for (const id of /** @type {const} */ (["live-source", "live-device", "live-session"])) by(id).disabled = isOn;
  by("live-device").hidden = isSession;
  by("live-speed").hidden = isSession || !["emulated", "qemu"].includes(by("live-device").value);
  by("live-speed").disabled = isOn;
  // What runs may have been begun elsewhere.
  if (state.speed !== null) {
    const speed = String(state.speed), speeds = by("live-speed");
    if (![...speeds.options].some((o) => o.value === speed)) speeds.append(make("option", { value: speed, textContent: `${speed}×` }));
    speeds.value = speed;
  }
  by("live-session").hidden = !isSession;
  for (const id of /** @type {const} */ (["live-record", "live-mark", "live-note"])) { by(id).hidden = isSession; by(id).disabled = !state.is_followed; }
  by("live-record").textContent = state.recording ? "Stop recording" : "Record";
  by("live-record").classList.toggle("on", !!state.recording);
  const count = by("live-count");
  count.textContent = isOn || state.samples ? `${state.samples} samples, ${state.missing_samples} missing` : "";
  by("live-disk").textContent = state.disk ? `recording: up to ${size(state.disk.bytes_an_hour)} an hour` + (state.disk.free_bytes === null ? "" : `, ${size(state.disk.free_bytes)} free`) : "";
  count.title = state.recording || "";
  Object.assign(count.dataset, { samples: state.samples, missing: state.missing_samples });
  replay.draw(state.replay);
  measure.draw(state);
  told();
}

/** @param {number} bytes */
const size = (bytes) => bytes < 1e9 ? `${(bytes / 1e6).toFixed(0)} MB` : bytes < 1e12 ? `${(bytes / 1e9).toFixed(1)} GB` : `${(bytes / 1e12).toFixed(1)} TB`;

/** Why there is no trace to be seen. */
function why() {
  if (state.is_followed) return "waiting for the device's samples …";
  if (state.replay) return "no sample was stored by this time";
  if (refused) return refused;
  if (by("live-source").value !== "session") return "Choose a device and connect. It is not reset, and nothing is written to it but the condition you set.";
  return by("live-session").options.length ? "Choose a stored session and show it. It is read only."
    : "No session is stored in the folder recordings, beside the model, or in the folders there.\nRecord one of a device, here or by yawrig monitor --record FOLDER.";
}

function draw() {
  // What was there before is not what was asked for.
  drawn.draw(state.replay ? state.replay.from_s : 0, why(), !!refused);
}
