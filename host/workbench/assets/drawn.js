// What a device says as it measures, drawn: its trace, each window's estimate, its marks, the log.
import * as numbers from "./numbers.js";
import { by, digits, make } from "./elements.js";

/** @typedef {"natural_frequency_rad_s" | "damping_ratio"} WindowColumn */
const SPAN_S = 30, MAX = 6000, MAX_LINES = 200, RESULTS = 40;
/** What has been lost, or has gone wrong. */
const LOST = ["trace_ended", "gap", "events_lost", "restarted", "silent", "disconnected", "refused"];
/** @type {LiveTrace} */
const trace = { time_s: [], low_deg: [], high_deg: [] };
const COLUMNS = /** @type {const} */ (["time_s", "low_deg", "high_deg"]);
/** Marks and releases on the trace. */
let /** @type {{ x: number, text: string }[]} */ places = [], /** @type {WindowLine[]} */ windows = [], due = false, last = 0;
let /** @type {{ trace: LinePlot, wn: LinePlot, zeta: LinePlot } | null} */ plots = null;

export function build() {
  const marks = (/** @type {WindowColumn} */ column) => () => windows.map((w, k) => ({ x: w.time_s, y: w[column], colour: k === windows.length - 1 ? "ghost" : "model" }));
  plots = {
    trace: Plots.lines(by("plot-live"), { x: { label: "session time (s)" }, y: { label: "yaw angle (deg)" }, places: () => places, cursor: false }),
    wn: Plots.lines(by("plot-live-wn"), { x: { label: "session time (s)" }, y: { label: "wn (rad/s)" }, marks: marks("natural_frequency_rad_s"), cursor: false }),
    zeta: Plots.lines(by("plot-live-zeta"), { x: { label: "session time (s)" }, y: { label: "damping ratio" }, marks: marks("damping_ratio"), cursor: false }),
  };
  numbers.build();
}

export function forget() {
  for (const name of COLUMNS) trace[name] = [];
  windows = []; places = []; last = 0;
  numbers.forget();
  by("live-log").replaceChildren();
}

/** Takes what has come; the lines of the log that are new. @param {{ trace?: LiveTrace, lines?: LogLine[] }} now */
export function take(now) {
  if (now.trace) {
    const { time_s } = trace, known = time_s.length ? time_s[time_s.length - 1] : -1;
    const from = now.trace.time_s.findIndex((t) => t > known);
    for (const name of COLUMNS) {
      if (from >= 0) trace[name].push(...now.trace[name].slice(from));
      if (trace[name].length > MAX) trace[name].splice(0, trace[name].length - MAX);
    }
  }
  const fresh = (now.lines || []).filter((line) => line.number > last);
  for (const line of fresh) {
    last = line.number;
    numbers.heard(line);
    if (line.event === "window") { windows.push(line); if (windows.length > RESULTS) windows.shift(); }
    if (line.event === "mark") places.push({ x: line.time_s, text: line.text.replace(/^mark at [^:]*: /, "") });
    by("live-log").prepend(make("li", { className: LOST.includes(line.event) ? "lost" : "", textContent: line.text, "data-event": line.event }));
  }
  while (by("live-log").childElementCount > MAX_LINES) by("live-log").lastChild?.remove();
  return fresh;
}

/** One drawing a frame, however much has come. @param {() => void} draw */
export function soon(draw) {
  if (!due && !by("live").hidden) { due = true; requestAnimationFrame(() => { due = false; draw(); }); }
}

/** @param {number} first time at which the session begins, s
 * @param {string} why there is no trace to be seen @param {boolean} isNone whether none is shown, whatever came */
export function draw(first, why, isNone = false) {
  if (!plots || by("live").hidden) return;
  const { time_s, low_deg, high_deg } = trace, /** @type {number[]} */ xs = [], /** @type {Column} */ ys = [];
  const end = time_s.length ? time_s[time_s.length - 1] : first, from = time_s.findIndex((t) => t >= end - SPAN_S);
  for (let k = Math.max(from, 0); k < time_s.length && !isNone; k++) {
    // Where samples are missing the line is broken.
    if (k > 0 && time_s[k] - time_s[k - 1] > 0.025) { xs.push((time_s[k] + time_s[k - 1]) / 2); ys.push(null); }
    xs.push(time_s[k], time_s[k] + 0.005);
    const falls = k > 0 && high_deg[k] < high_deg[k - 1];
    ys.push(...(falls ? [high_deg[k], low_deg[k]] : [low_deg[k], high_deg[k]]));
  }
  plots.trace.set([xs, ys], [{ colour: "model", width: 1.2 }], [Math.max(first, end - SPAN_S), Math.max(end, first + SPAN_S)]);
  plots.trace.say(xs.length ? null : why);
  plots.trace.describe(`Yaw angle in degrees over the session's last ${SPAN_S} s, ${digits(end)} s by now.`);
  numbers.draw();
  /** @type {[LinePlot, WindowColumn, string][]} */
  const results = [[plots.wn, "natural_frequency_rad_s", "Natural frequency in rad/s"], [plots.zeta, "damping_ratio", "Damping ratio"]];
  for (const [plot, column, name] of results) {
    plot.set([windows.map((w) => w.time_s), windows.map((w) => w[column])], [{ invisible: true }]);
    plot.say(windows.length ? null : "each three cycles of a release");
    plot.describe(`${name} of the last windows over the session's time, the latest ${digits(windows.at(-1)?.[column], 4)}.`);
  }
}
