// The panels: one cursor and one stretch of time for all of them.
import { by, digits, get, HAS_SYSTEM, ratio } from "./talk.js";
import * as summaries from "./summaries.js";

/**
 * What is looked at. `span` is in seconds of the record's clock; nulls for all of it.
 * @type {{ release: number | null, span: Span, ghost: string | null, view: View | null, curves: Curves | null, fault: Fault | null }}
 */
export const seen = { release: null, span: [null, null], ghost: null, view: null, curves: null, fault: null };

/** The name under which the model of a diagnosis is laid over the panels: then they show what it leaves. */
export const DIAGNOSIS = "the diagnosis";
const isDiagnosis = () => seen.ghost === DIAGNOSIS;

let heard = () => {};
/** Calls `listener` whenever another view of the release is there. @param {() => void} listener */
export const onView = (listener) => { heard = listener; };

/** @typedef {"damping" | "stiffness"} CutPanel @typedef {"wn" | "zeta"} AmplitudePanel */
const TRIALS = 5;
const time = { label: "time in the record (s)" };
const zoomed = (/** @type {number | null} */ from, /** @type {number | null} */ to) => zoom(from, to);
const plots = /** @type {Record<"overlay" | "residual" | CutPanel | AmplitudePanel | "spectrum", LinePlot> & { phase: PlanePlot }} */ ({});

/** Words and units of what is looked at. */
const ANGLE = { recorded: "yaw angle", unit: "deg", coordinate: "yaw angle", word: "yaw", rate: "yaw rate", of: "deg", rate_unit: "deg/s", moment: "rad/s²", shows_rest: true };
/** @returns {Units} */
const units = () => (seen.curves && seen.curves.units) || ANGLE;

/** The part of its record that a release is; `moved` asks for another. */
/** @typedef {(from: number | null, to: number | null) => void} Cutting */
let /** @type {Cutting} */ cutTo = () => {};
export const onCut = (/** @type {Cutting} */ listener) => { cutTo = listener; };

/** Only what is in view is analysed, or all of the record again. */
export function cut() {
  const c = seen.curves;
  if (!c) return;
  const [from, to] = seen.span;
  seen.span = [null, null];
  cutTo(from, to);
}

/** @param {0 | 1} which @param {number} x */
function moved(which, x) {
  const c = seen.curves;
  if (!c || !c.analysed_s) return;
  const now = c.cut_s || [null, null], time_s = +seconds(c, x, 2);
  c.cut_s = which === 0 ? [time_s, now[1]] : [now[0], time_s];
  c.analysed_s[which] = time_s;
  cutTo(c.cut_s[0], c.cut_s[1]);
}

/** A time with the digits that the record's length asks for, and so many more.
 * @param {Curves} c @param {number} t */
function seconds(c, t, more = 0) {
  const [first, last] = c.whole_s;
  return t.toFixed(Math.min(9, Math.max(0, 2 - Math.floor(Math.log10(last - first || 1))) + 1 + more));
}

/** Where what is analysed begins and ends, and why. */
function drawEnds() {
  const c = seen.curves, why = c && c.analysed, [from, to] = c && c.analysed_s ? c.analysed_s.map((t) => seconds(c, t)) : [];
  const caption = by("overlay-caption");
  caption.textContent = why ? `${from} to ${to} s` : "";
  caption.title = why ? `analysed from ${from} s (${why[0]}) to ${to} s (${why[1]})` : "";
  by("uncut-button").hidden = !(c && c.cut_s);
}

export function build() {
  const pointed = (/** @type {Pointed} */ source) => (/** @type {number | null} */ t) => point(t, source);
  plots.overlay = Plots.lines(by("plot-overlay"), { x: { label: "", unit: "s" }, y: { label: () => `${units().recorded} (${units().unit})`, size: 46 }, zoomed, pointed: pointed("overlay"), ends: { at: () => seen.curves?.analysed_s ?? null, reasons: () => seen.curves?.analysed ?? [], moved } });
  by("uncut-button").onclick = () => cutTo(null, null);
  plots.residual = Plots.lines(by("plot-residual"), {
    x: time, y: { label: () => `residual (${units().unit})`, size: 46 }, zoomed, pointed: pointed("residual"),
    band: () => 2 * (seen.curves?.noise_deg ?? 0),
  });
  plots.phase = Plots.plane(by("plot-phase"), { x: () => `${units().coordinate} (${units().of})`, y: () => `${units().rate} (${units().rate_unit})`, unit: () => units().moment, noise, least: SCALE });
  const law = (/** @type {CutPanel} */ id, /** @type {Label} */ label) => Plots.lines(by(`plot-${id}`), {
    x: { label }, y: { label: () => units().moment, range: (min, max) => around(id, min, max, [...beside[id], -SCALE * noise(), SCALE * noise()]) }, marks: () => marks[id], band: () => 2 * noise(),
  });
  plots.damping = law("damping", () => `rate (${units().rate_unit})`);
  plots.stiffness = law("stiffness", () => `${units().word} (${units().of})`);
  const amplitude = (/** @type {AmplitudePanel} */ id, /** @type {string} */ y) => Plots.lines(by(`plot-${id}`), {
    x: { label: () => units().of, range: amplitudes }, y: { label: y, range: (min, max) => around(id, min, max) }, marks: () => marks[id],
    pointed: (a) => point(a === null ? null : when(a), "amplitude"),
  });
  plots.wn = amplitude("wn", "wn (rad/s)");
  plots.zeta = amplitude("zeta", "damping ratio");
  plots.spectrum = Plots.lines(by("plot-spectrum"), {
    x: { label: "frequency (Hz)", range: (min, max) => [0, (max || 1) * 1.02] }, y: { label: "power / noise", range: (_, max) => [0, Math.max((max || 1) * 1.08, SCALE)] }, band: noisePower,
  });
}

/** What is drawn as points, and values of lines that are to be seen whole, by plot. */
/** @type {Record<CutPanel | AmplitudePanel, PlotMark[]>} */
const marks = { damping: [], stiffness: [], wn: [], zeta: [] };
/** @type {Record<CutPanel, number[]>} */
const beside = { damping: [], stiffness: [] };

/** Panels of what is missing reach to so many times the noise at least: where nothing is, the noise does not fill them. */
const SCALE = 8;
/** What the record's noise alone makes of a missing moment, its standard deviation. */
const noise = () => seen.view?.where.noise ?? 0;
/** What the power of noise stays below in nearly every band: one, and three standard deviations of the mean of its frequencies. */
function noisePower() {
  const bars = seen.view?.where.frequency ?? [], [from, to] = seen.curves?.analysed_s ?? [0, 0];
  const seconds = Math.min(seen.span[1] ?? to, to) - Math.max(seen.span[0] ?? from, from);
  return bars.length > 1 && seconds > 0 ? 1 + 3 / Math.sqrt((bars[1][0] - bars[0][0]) * seconds) : null;
}

/** The page asks for the record and what is known of it; old answers are thrown away. */
let asked = 0;
/** @param {number} release @param {Span} [span] */
export async function show(release, span = [null, null]) {
  if (release !== seen.release) { seen.span = span; seen.view = null; seen.curves = null; seen.ghost = null; }
  seen.release = release;
  await refresh();
}

/** What is to be drawn; throws what is wrong with a record that is bad data.
 * @template {object} T @param {Promise<T | { fault: Fault }>} asked @returns {Promise<T>} */
async function drawable(asked) {
  const answer = await asked;
  if ("fault" in answer) throw Object.assign(new Error(answer.fault.message), answer.fault);
  return answer;
}

export async function refresh() {
  const release = seen.release, number = ++asked;
  if (release === null) return draw();
  const [from, to] = seen.span;
  const points = Math.max(300, Math.round(by("plot-overlay").clientWidth * 1.5));
  const curves = drawable(get("/api/curves", { release, from, to, points, ghost: seen.ghost }));
  const view = drawable(get("/api/view", { release, from, to, ghost: seen.ghost }));
  // What is wrong with it is said below, or is of an old answer.
  view.catch(() => {});
  try {
    const now = await curves;
    if (number !== asked) return;
    seen.curves = now; seen.fault = null;
    drawTime();
    if (!document.documentElement.dataset.firstPicture) document.documentElement.dataset.firstPicture = String(Math.round(performance.now()));
  } catch (/** @type {any} */ error) {
    if (number !== asked) return;
    seen.curves = null; seen.fault = error;
    drawTime();
  }
  try {
    const now = await view;
    if (number !== asked) return;
    seen.view = "pending" in now ? null : now;
  } catch (/** @type {any} */ error) {
    if (number !== asked) return;
    seen.view = null;
    seen.fault = error;
  }
  draw();
  heard();
}

/** @param {number | null} from @param {number | null} to */
export function zoom(from, to) {
  if (from !== null && to !== null) {
    const [first, last] = seen.curves ? seen.curves.whole_s : [from, to];
    if (to - from < 0.05) return void refresh();
    from = Math.max(first, from); to = Math.min(last, to);
    if (from === first && to === last) from = to = null;
  }
  seen.span = [from, to];
  refresh();
}

/** Narrower (share below 1) or wider about the middle; by a share of its width to the side.
 * @param {number} share */
export function zoomBy(share, aside = 0) {
  if (!seen.curves) return;
  const [first, last] = seen.curves.whole_s, from = seen.span[0] ?? first, to = seen.span[1] ?? last;
  const middle = (from + to) / 2 + aside * (to - from), half = (to - from) / 2 * share;
  const at = Math.min(Math.max(middle, first + Math.min(half, (last - first) / 2)), last - Math.min(half, (last - first) / 2));
  zoom(at - half, at + half);
}

// The cursor.

/** Amplitude at a time, between the windows; and the time of an amplitude. @param {number | null} t */
function envelope(t) {
  const w = seen.view && seen.view.measured;
  if (!w || w.length < 2 || t === null) return null;
  if (t < w[0][5]) return w[0][0];
  for (let k = 1; k < w.length; k++) {
    if (t <= w[k][5]) {
      const share = (t - w[k - 1][5]) / (w[k][5] - w[k - 1][5]);
      return w[k - 1][0] + share * (w[k][0] - w[k - 1][0]);
    }
  }
  return w[w.length - 1][0];
}
function when(/** @type {number} */ amplitude) {
  const w = seen.view && seen.view.measured;
  if (!w || !w.length) return null;
  return w.reduce((best, row) => (Math.abs(row[0] - amplitude) < Math.abs(best[0] - amplitude) ? row : best))[5];
}
/** @param {number | null} t @returns {PlaneState} */
function stateAt(t) {
  const s = seen.view && seen.view.states;
  if (!s || t === null || t < s.time_s[0]) return null;
  const k = s.time_s.findIndex((time) => time >= t);
  if (k < 1) return null;
  const share = (t - s.time_s[k - 1]) / (s.time_s[k] - s.time_s[k - 1]);
  const mix = (/** @type {number[]} */ v) => v[k - 1] + share * (v[k] - v[k - 1]);
  return [mix(s.yaw_deg), mix(s.rate_deg_s)];
}

let pointing = false;
/** @typedef {"overlay" | "residual" | "amplitude"} Pointed */
/** @param {number | null} t @param {Pointed} source */
function point(t, source) {
  if (pointing) return;
  pointing = true;
  if (source !== "overlay") plots.overlay.point(t);
  if (source !== "residual") plots.residual.point(t);
  plots.phase.point(stateAt(t));
  const amplitude = source === "amplitude" ? null : envelope(t);
  if (source !== "amplitude") { plots.wn.mark(amplitude); plots.zeta.mark(amplitude); }
  pointing = false;
}

/** The amplitudes that the stretch of time holds. @type {Ranged} */
function amplitudes(min, max) {
  const [from, to] = seen.span;
  if (from !== null && to !== null && seen.view) {
    const inside = seen.view.measured.filter((w) => w[5] >= from && w[5] <= to).map((w) => w[0]);
    if (inside.length > 1) { min = Math.min(...inside); max = Math.max(...inside); }
  }
  const pad = ((max ?? 1) - (min ?? 0)) * 0.04 || 0.1;
  return [Math.max(0, (min ?? 0) - pad), (max ?? 1) + pad];
}

/** What is measured with its bars, not every trial and not a bar that is long by chance: they would press the rest flat.
 * @type {(id: CutPanel | AmplitudePanel, min: number | null, max: number | null, more?: number[]) => Limits} */
function around(id, min, max, more = []) {
  const points = marks[id], usual = points.map((m) => m.u || 0).sort((a, b) => a - b)[points.length >> 1] || 0;
  const bar = (/** @type {PlotMark} */ m) => 2 * Math.min(m.u || 0, 2.5 * usual);
  const values = [...points.map((m) => [m.y - bar(m), m.y + bar(m)]), ...more];
  if (!values.length) return [min ?? 0, max ?? 1];
  const sorted = values.flat().sort((a, b) => a - b);
  let low = sorted[0], high = sorted[sorted.length - 1];
  const pad = (high - low) * 0.15 || Math.abs(high) * 0.01 || 1;
  return [low - pad, high + pad];
}

// Drawing.

function draw() {
  drawTime();
  drawWhere();
  drawAmplitude();
  describe();
}

/** Each panel in a sentence. */
function describe() {
  const v = seen.view, c = seen.curves, u = units(), w = v && (isDiagnosis() && v.ghost || v.where);
  plots.overlay.describe(c ? summaries.overlay(c, u) : "");
  plots.residual.describe(v ? summaries.residual(v, u) : "");
  plots.phase.describe(w ? summaries.phase(w, u) : "");
  plots.damping.describe(v ? summaries.cut(v.where.damping_law, u.rate, u.rate_unit, v.where, u) : "");
  plots.stiffness.describe(v ? summaries.cut(v.where.stiffness_law, u.coordinate, u.of, v.where, u) : "");
  plots.wn.describe(v ? summaries.amplitude(v.measured, 1, "Natural frequency in rad/s", u) : "");
  plots.zeta.describe(v ? summaries.amplitude(v.measured, 3, "Damping ratio", u) : "");
  plots.spectrum.describe(v ? summaries.spectrum(v.where) : "");
}

/** @returns {Limits | null} */
function limits() {
  const c = seen.curves;
  return c ? [seen.span[0] ?? c.whole_s[0], seen.span[1] ?? c.whole_s[1]] : null;
}

/** Over axes that have nothing on them yet: their numbers would mean nothing. */
const BLANK = " ";

function drawTime() {
  const c = seen.curves;
  const fault = seen.fault ? `${seen.fault.message}\n${seen.fault.help || ""}` : null;
  plots.overlay.say(seen.release === null ? HAS_SYSTEM ? "No record is open.\nStart yawrig workbench with records, or press Open." : "Drop a record here." : c ? null : fault || "reading …");
  drawEnds();
  if (!c) {
    plots.overlay.set([[]], []); plots.residual.set([[]], []); plots.residual.say(BLANK);
    return;
  }
  const /** @type {PlotColumns} */ overlay = [c.time_s, c.measured_deg], /** @type {PlotLine[]} */ how = [{ colour: "measured", width: 1.6, name: "measured" }];
  if (c.model_deg) { overlay.push(c.model_deg); how.push({ colour: "model", width: 1, name: "model" }); }
  if (c.ghost_deg) { overlay.push(c.ghost_deg); how.push({ colour: "ghost", width: 1.2, dash: [6, 4], name: "on trial" }); }
  plots.overlay.set(overlay, how, limits());
  by("key-ghost").hidden = !c.ghost_deg;
  by("key-ghost").textContent = c.ghost_deg ? `with ${c.ghost_title}` : "";
  const /** @type {PlotColumns} */ residual = [c.time_s], /** @type {PlotLine[]} */ styles = [];
  const alone = c.ghost === DIAGNOSIS;
  by("residual-caption").textContent = alone ? `measured less model with ${c.ghost_title}; band: ±2 noise` : "measured less model; band: ±2 noise";
  if (c.residual_deg && !alone) { residual.push(c.residual_deg); styles.push({ colour: "model", width: 1 }); }
  if (c.ghost_residual_deg) { residual.push(c.ghost_residual_deg); styles.push({ colour: "ghost", width: 1, name: "on trial" }); }
  plots.residual.set(residual, styles, limits());
  plots.residual.say(c.residual_deg ? null : fault || "fitting …");
}

/** The law of an effect that is being written, for the cuts; null for none. */
let /** @type {OwnLaw | null} */ law = null;
export function showLaw(/** @type {OwnLaw | null} */ now) { law = now; cutKeys(); drawWhere(); }

/** The measured law with its formulas; null for none. */
let /** @type {Law | null} */ measured = null;
export function showMeasured(/** @type {Law | null} */ now) { measured = now && now.cuts ? now : null; cutKeys(); drawWhere(); }
/** The keys take the place of the caption. */
function cutKeys() {
  by("key-own").hidden = !law;
  by("key-law").hidden = !measured;
  by("cuts-caption").hidden = !!(law || measured);
}

/** What is drawn along a cut. @template M @param {Cuts<M>} cuts @param {Cut} name */
const along = ({ damping_law, stiffness_law }, name) => (name === "damping_law"
  ? { x: damping_law.rate_deg_s, y: damping_law.moment_rad_s2 } : { x: stiffness_law.yaw_deg, y: stiffness_law.moment_rad_s2 });

/** The measured law with its band and its names as lines of a cut; the values that are to be seen.
 * @param {Cut} name @param {PlotTable[]} tables @param {PlotLine[]} how */
function drawMeasured(name, tables, how) {
  if (!measured || !measured.cuts) return [];
  const { u } = measured.cuts[name], { x, y } = along(measured.cuts, name);
  if (u) {
    // The upper edge is filled down to the lower.
    tables.push({ x, y: y.map((v, k) => v - 2 * u[k]) }, { x, y: y.map((v, k) => v + 2 * u[k]) });
    how.push({ colour: "law", width: 0, spanGaps: true, alpha: 0 }, { colour: "law", width: 0, spanGaps: true, alpha: 1, filledTo: how.length });
  }
  for (const [k, n] of (measured.found ? measured.found.names : []).entries()) {
    if (!n.cuts) continue;
    tables.push(along(n.cuts, name));
    how.push({ colour: trialColour(k), width: 1, dash: [5, 3], alpha: 0.8, spanGaps: true });
  }
  tables.push({ x, y });
  how.push({ colour: "law", width: 1.8, spanGaps: true });
  return y;
}

function drawWhere() {
  const v = seen.view, ghost = v && v.ghost;
  by("phase-caption").textContent = units().moment;
  by("cuts-caption").textContent = `${units().word} = 0, rate = 0`;
  plots.phase.set(v ? (ghost && isDiagnosis() ? ghost : v.where).phase : []);
  // Of a rate or an acceleration the residual shows no moment.
  const hidden = v && !units().shows_rest ? `A residual in ${units().unit} does not show it:\nmeasure the law.` : null;
  plots.phase.say(hidden);
  const cut = (/** @type {CutPanel} */ id, /** @type {Cut} */ name) => {
    const rows = v ? v.where[name] : [];
    marks[id] = rows.map(([x, y, u]) => ({ x, y, u, colour: "model" }));
    if (ghost) marks[id].push(...ghost[name].map(([x, y, u]) => ({ x, y, u, colour: "ghost" })));
    const /** @type {PlotTable[]} */ tables = [{ x: marks[id].map((m) => m.x), y: marks[id].map((m) => m.y) }];
    /** @type {PlotLine[]} */
    const how = [{ invisible: true }];
    beside[id] = drawMeasured(name, tables, how);
    if (law) { tables.push(along(law, name)); how.push({ colour: "own", width: 1.6, spanGaps: true }); }
    plots[id].set(Plots.joined(tables), how);
    plots[id].say(law || measured ? null : v ? hidden && BLANK : BLANK);
  };
  cut("damping", "damping_law");
  cut("stiffness", "stiffness_law");
  const bars = v ? v.where.frequency : [];
  const /** @type {PlotColumns} */ columns = [bars.map((b) => b[0]), bars.map((b) => b[2])];
  /** @type {PlotLine[]} */
  const how = [{ colour: "model", bars: true, width: 0 }];
  if (ghost) { columns.push(ghost.frequency.map((b) => b[2])); how.push({ colour: "ghost", width: 1.5 }); }
  plots.spectrum.set(columns, how);
  plots.spectrum.say(v ? null : BLANK);
}

/** The colour of the `k`th trial. @param {number} k */
export const trialColour = (k) => `trial-${(k % TRIALS) + 1}`;

function drawAmplitude() {
  const v = seen.view;
  for (const [id, column] of /** @type {const} */ ([["wn", 1], ["zeta", 3]])) {
    const measured = v ? v.measured : [];
    marks[id] = measured.map((w) => ({ x: w[0], y: w[column], u: w[column === 1 ? 2 : 4], colour: "measured" }));
    const tables = [{ x: measured.map((w) => w[0]), y: measured.map((w) => w[column]) }];
    /** @type {PlotLine[]} */
    const how = [{ invisible: true }];
    const line = (/** @type {AmplitudePoint[]} */ points, /** @type {PlotLine} */ style) => {
      const sorted = [...points].sort((a, b) => a[0] - b[0]);
      tables.push({ x: sorted.map((w) => w[0]), y: sorted.map((w) => w[column]) });
      how.push({ spanGaps: true, ...style });
    };
    if (v && v.predicted) line(v.predicted.points, { colour: "model", width: 1.6 });
    for (const [k, trial] of (v ? v.trials : []).slice(0, TRIALS).entries()) {
      if (trial.points) line(trial.points, { colour: trialColour(k), width: trial.effect === seen.ghost ? 2.2 : 1, alpha: trial.effect === seen.ghost ? 1 : 0.6, dash: [5, 3] });
    }
    plots[id].set(Plots.joined(tables), how);
    plots[id].say(v ? null : BLANK);
  }
}

/** The figures of this release, for the head of the page. */
export function figures() {
  const v = seen.view;
  const set = (/** @type {string} */ id, /** @type {string} */ text, kind = "") => { const e = by(id); e.textContent = text; e.className = kind; };
  set("figure-white", v ? (v.is_white ? "white" : `not white, ${digits(v.correlation, 2)}`) : "–", v ? (v.is_white ? "good" : "warn") : "");
  const figure = by("figure-white").parentElement;
  if (figure) figure.title = v
    ? `Lag-one correlation of this release's residual: ${digits(v.correlation, 2)}. White noise stays within ±${digits(v.correlation_of_white, 2)}.` : "";
  set("figure-wn", v ? v.natural_frequency_rad_s.text : "–");
  set("figure-zeta", v ? v.damping_ratio.text : "–");
  return v ? `residual ${digits(v.residual_rms_deg, 3)} ${units().unit}, noise ${digits(v.noise_rms_deg, 3)} ${units().unit}, ratio ${ratio(v.over_noise)}` : "";
}
