// Derivatives of a campaign, with the second-order model and with the present one.
import { by, digits, get, make } from "./talk.js";

let /** @type {LinePlot | null} */ plot = null;

/** @param {State} state @param {Act} act */
export async function refresh(state, act) {
  const pane = by("pane-derivatives");
  if (pane.hidden) return;
  const found = await get("/api/derivatives");
  if (!found.has_campaign) {
    pane.replaceChildren(make("p", { className: "caption", textContent: "Derivatives need a campaign: yawrig workbench campaign.toml. To make one of the folder's records, press g." }));
    plot = null;
    return;
  }
  const host = make("div", { className: "plot", id: "plot-derivatives" });
  const judged = found.judged;
  const both = judged && judged.derivatives ? judged.derivatives : { before: found.before, after: found.after };
  const rows = both.before || both.after || [];
  const parts = [make("div", { className: "row" }, make("button", {
    type: "button", id: "judge-button", textContent: "Judge the whole campaign", disabled: !!state.job, onclick: () => act({ do: "judge" }),
    title: "Every effect in a joint fit of all releases: which are needed, and whether they come from the rig or the air. Takes its time; it can be cancelled.",
  }))];
  if (judged) {
    parts.push(make("p", { textContent: `The campaign: ${judged.verdict}.` }),
      ...judged.effects.map((e) => make("p", { className: "caption", textContent: `${e}: ${judged.origin[e]}. ${judged.origin_reason[e] || ""}` })));
  }
  if (!rows.length) {
    parts.push(make("p", { className: "caption", textContent: state.model.exists ? "The fitted releases do not make a point: a spring needs its wind-off release and one with the wind on, at the middle axis." : "Fit a model first: the derivatives follow from its natural frequencies and damping ratios." }));
    pane.replaceChildren(...parts);
    plot = null;
    return;
  }
  parts.push(make("p", { className: "caption", textContent: "Cn_r per radian against reduced frequency, bars of two standard uncertainties: second-order model grey, present model blue." }), host, table(both), ...found.critical_speed.map(critical));
  pane.replaceChildren(...parts);
  /** @type {(list: Point[] | null, colour: string) => PlotMark[]} */
  const points = (list, colour) => (list || []).map((p) => ({ x: p.reduced_frequency, y: p.cn_r.value, u: p.cn_r.u, colour }));
  const marks = [...points(both.before, "measured"), ...points(both.after, "model")];
  plot = Plots.lines(host, { x: { label: "reduced frequency", range: (a, b) => [0, (b || 1) * 1.05] }, y: { label: "Cn_r (1/rad)" }, marks: () => marks, cursor: false });
  // The ends of the bars, so that they are inside.
  const ends = [-2, 2].map((k) => ({ x: marks.map((m) => m.x), y: marks.map((m) => m.y + k * (m.u || 0)) }));
  plot.set(Plots.joined(ends), [{ invisible: true }, { invisible: true }]);
  plot.describe("Cn_r per radian against reduced frequency, with the second-order model and with the present one: the numbers are in the table below.");
}

/** Where damping falls to zero. @param {Critical} of */
function critical({ text, by, rows }) {
  const cell = (/** @type {Quantity | null} */ q) => make("td", { textContent: q ? shown(q) : "–" });
  const titles = ["wind (m/s)", "ζ at rest", "limit cycle (deg)"];
  return make("div", { className: "critical" }, make("p", { textContent: text }), make("table", { className: "numbers" },
    make("thead", {}, make("tr", {}, ...titles.map((textContent) => make("th", { textContent })))),
    make("tbody", {}, ...rows.map(([speed, zeta, cycle]) => make("tr", {}, make("td", { textContent: digits(speed, 4) }), cell(zeta), cell(cycle))))),
  make("p", { className: "caption", textContent: by }));
}

/** @typedef {{ before: Point[] | null, after: Point[] | null }} Both */
/** @param {Both} both */
function table(both) {
  return make("div", {}, half(both, ["cn_beta", "cn_r"], ["Cn_β", "Cn_r"]), half(both, ["cy_beta", "cy_r"], ["Cy_β", "Cy_r"]),
    make("p", { className: "caption", textContent: "Per radian, Cn about the middle axis; Cn_r is the combined Cn_r − Cn_β̇. In brackets the standard uncertainty (k = 1) in units of the last digits." }));
}

/** To the second digit of the uncertainty. @param {Quantity | null} q */
function shown(q) {
  if (!q) return "–";
  if (!(q.u && q.u > 0)) return q.value.toFixed(4).replace("-", "−");
  const places = Math.min(8, Math.max(0, 1 - Math.floor(Math.log10(q.u))));
  return `${q.value.toFixed(places)}(${places ? Math.round(q.u * 10 ** places) : q.u.toFixed(0)})`.replace("-", "−");
}

/** The points one after the other, before and after beside each other: a step need not have those of another.
 * @param {Both} both */
export function paired({ before, after }) {
  const of = (/** @type {Point} */ p) => JSON.stringify([p.spring, p.wind_speed_m_s, p.at]), earlier = before || [], later = after || [];
  const pairs = earlier.map((p) => ({ before: p, after: later.find((q) => of(q) === of(p)) }));
  return [...pairs, ...later.filter((q) => !earlier.some((p) => of(p) === of(q))).map((q) => ({ before: undefined, after: q }))];
}

/** @param {Both} both @param {("cn_beta" | "cn_r" | "cy_beta" | "cy_r")[]} names @param {string[]} titles */
function half(both, names, titles) {
  const speeds = new Set([...both.before || [], ...both.after || []].map((p) => p.wind_speed_m_s));
  const called = (/** @type {Point} */ p) => (speeds.size > 1 ? `${p.spring} ${p.wind_speed_m_s} m/s` : p.spring);
  const row = (/** @type {Point | undefined} */ p, /** @type {"before" | "after"} */ which, isNamed = true) => (p ? [make("tr", { className: which },
    make("td", { textContent: isNamed ? called(p) : "" }), make("td", { textContent: which }), ...names.map((n) => make("td", { textContent: shown(p[n]) })))] : []);
  const rows = paired(both).flatMap(({ before, after }) => [...row(before, "before"), ...row(after, "after", !before)]);
  return make("table", { className: "numbers" }, make("thead", {}, make("tr", {}, make("th", { textContent: "spring" }), make("th", { textContent: "model" }), ...titles.map((t) => make("th", { textContent: t })))), make("tbody", {}, ...rows));
}
