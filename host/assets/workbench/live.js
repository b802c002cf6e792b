// A device followed: its trace as it comes, each window's estimate, the log, recording and marks.
import { by, get, make, post } from "./talk.js";

const SPAN_S = 30, MOST = 6000, MOST_LINES = 200;
const trace = { time_s: [], low_deg: [], high_deg: [] };
let windows = [], release = [], seconds = 0, plots = {}, due = false, last = 0, state = { is_followed: false }, tell = () => {}, fail = () => {};
const RESULTS = 40;

export function build(say, failed) {
  tell = say; fail = failed;
  plots.trace = Plots.lines(by("plot-live"), { x: { label: "time of the session (s)" }, y: { label: "yaw angle (deg)" }, cursor: false });
  const marks = (column) => () => windows.map((w, k) => ({ x: w.time_s, y: w[column], colour: k === windows.length - 1 ? "ghost" : "model" }));
  plots.wn = Plots.lines(by("plot-live-wn"), { x: { label: "time of the session (s)" }, y: { label: "wn (rad/s)" }, marks: marks("natural_frequency_rad_s"), cursor: false });
  plots.zeta = Plots.lines(by("plot-live-zeta"), { x: { label: "time of the session (s)" }, y: { label: "damping ratio" }, marks: marks("damping_ratio"), cursor: false });
  const act = async (what) => { try { await post("/api/do", what); } catch (error) { fail(error); } };
  by("live-connect").onclick = () => act(state.is_followed ? { do: "disconnect" } : { do: "connect", device: by("live-device").value });
  by("live-record").onclick = () => act({ do: state.recording ? "stop_recording" : "record" });
  const mark = () => { const note = by("live-note"); act({ do: "mark", text: note.value.trim() || "mark" }); note.value = ""; };
  by("live-mark").onclick = mark;
  by("live-note").onkeydown = (e) => { if (e.key === "Enter") mark(); };
  by("live-close").onclick = toggle;
}

/** Takes up what a page has missed; shows itself where a device is followed from the beginning. */
export async function open() {
  try {
    const now = await get("/api/live");
    for (const name of Object.keys(trace)) trace[name] = [];
    windows = []; last = 0;
    by("live-log").replaceChildren();
    take(now);
    if (now.is_followed && by("live").hidden && !seconds) toggle();
    seconds = 1;
  } catch (error) { fail(error); }
}

export async function toggle() {
  const show = by("live").hidden;
  by("live").hidden = !show;
  by("panels").hidden = show;
  if (!show) { by("live-button").focus(); return; }
  try {
    const { ports } = await get("/api/devices");
    const chosen = by("live-device").value || state.device;
    by("live-device").replaceChildren(make("option", { value: "emulated", textContent: "emulated" }), make("option", { value: "qemu", textContent: "qemu" }),
      ...ports.map((p) => make("option", { value: p.path, textContent: `${p.path}  ${p.description}` })));
    if (chosen) by("live-device").value = chosen;
    if (by("live-device").selectedIndex < 0) by("live-device").selectedIndex = 0;
  } catch (error) { fail(error); }
  by("live-connect").focus();
  draw();
}

export function heard(news) { take({ ...news.state, trace: news.trace, lines: news.lines }); }

function take(now) {
  const was = state;
  state = now;
  if (now.is_followed && !was.is_followed && was.device !== undefined && now.samples < was.samples) {
    for (const name of Object.keys(trace)) trace[name] = [];
    windows = []; last = 0;
    by("live-log").replaceChildren();
  }
  if (now.trace) {
    for (const name of Object.keys(trace)) {
      trace[name].push(...now.trace[name]);
      if (trace[name].length > MOST) trace[name].splice(0, trace[name].length - MOST);
    }
  }
  for (const line of now.lines || []) {
    if (line.number <= last) continue;
    last = line.number;
    if (line.event === "window") { windows.push(line); if (windows.length > RESULTS) windows.shift(); }
    const lost = ["gap", "events_lost", "restarted", "silent", "disconnected"].includes(line.event);
    by("live-log").prepend(make("li", { className: lost ? "lost" : "", textContent: line.text, "data-event": line.event }));
  }
  while (by("live-log").childElementCount > MOST_LINES) by("live-log").lastChild.remove();
  if (now.fault && (!was.fault || was.fault.message !== now.fault.message)) fail(now.fault);
  by("live-connect").textContent = now.is_followed ? "Disconnect" : "Connect";
  by("live-connect").classList.toggle("primary", !now.is_followed);
  by("live-device").disabled = now.is_followed;
  for (const id of ["live-record", "live-mark", "live-note"]) by(id).disabled = !now.is_followed;
  by("live-record").textContent = now.recording ? "Stop recording" : "Record";
  by("live-record").classList.toggle("on", !!now.recording);
  const count = by("live-count");
  count.textContent = now.is_followed || now.samples ? `${now.samples} samples, ${now.missing_samples} missing` : "";
  count.title = now.recording || "";
  Object.assign(count.dataset, { samples: now.samples, missing: now.missing_samples });
  // One drawing a frame, however much has come.
  if (!due && !by("live").hidden) { due = true; requestAnimationFrame(() => { due = false; draw(); }); }
}

function draw() {
  if (by("live").hidden) return;
  const { time_s, low_deg, high_deg } = trace, xs = [], ys = [];
  const end = time_s.length ? time_s[time_s.length - 1] : 0, from = time_s.findIndex((t) => t >= end - SPAN_S);
  for (let k = Math.max(from, 0); k < time_s.length; k++) {
    // Where samples are missing the line is broken.
    if (k > 0 && time_s[k] - time_s[k - 1] > 0.025) { xs.push((time_s[k] + time_s[k - 1]) / 2); ys.push(null); }
    xs.push(time_s[k], time_s[k] + 0.005);
    const falls = k > 0 && high_deg[k] < high_deg[k - 1];
    ys.push(...(falls ? [high_deg[k], low_deg[k]] : [low_deg[k], high_deg[k]]));
  }
  plots.trace.set([xs, ys], [{ colour: "model", width: 1.2 }], [Math.max(0, end - SPAN_S), Math.max(end, SPAN_S)]);
  plots.trace.say(xs.length ? null : state.is_followed ? "waiting for the device's samples …" : "Choose a device and connect. It is read only: nothing is written to it and it is not reset.");
  for (const [plot, column] of [[plots.wn, "natural_frequency_rad_s"], [plots.zeta, "damping_ratio"]]) {
    plot.set([windows.map((w) => w.time_s), windows.map((w) => w[column])], [{ invisible: true }]);
    plot.say(windows.length ? null : "each three cycles of a release");
  }
}
