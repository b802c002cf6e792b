// What a followed device's releases are made under: set, shown, and led through a campaign; their derivatives.
import { by, make } from "./talk.js";

/** @typedef {{ at: string, name: string, d: DeviceDerivatives }} MeasuredPoint */
let /** @type {ConditionLine | null} */ next = null, /** @type {MeasuredPoint[]} */ points = [], wanted = "", hasEnded = false;

/** @param {ActLive} act @param {Failed} fail */
export function build(act, fail) {
  const text = (/** @type {InputId} */ id) => by(id).value.trim() || null;
  by("measure-begin").onclick = () => {
    const file = text("measure-file"), wind = text("measure-wind");
    const one = { condition: file, spring: text("measure-spring"), axis: text("measure-spring") && by("measure-axis").value, wind_speed_m_s: wind === null ? null : Number(wind) };
    if (wind !== null && !Number.isFinite(one.wind_speed_m_s)) return fail({ message: `${wind} is no wind speed`, help: "give a number in m/s, 0 for off" });
    act({ do: "measure", wanted: by("measure-what").value === "campaign" ? { campaign: file } : one });
  };
  by("measure-back").onclick = () => act({ do: "back" });
  by("measure-skip").onclick = () => act({ do: "skip" });
  by("measure-what").onchange = () => draw();
}

export function forget() {
  next = null; points = []; wanted = "";
}

/** Fills the fields with what is measured, once: it may have been begun elsewhere. @param {Measuring | null} measuring */
function fill(measuring) {
  const now = measuring ? JSON.stringify(measuring.wanted) : "";
  if (!measuring || now === wanted) return;
  wanted = now;
  const { campaign, condition, spring, axis, wind_speed_m_s } = measuring.wanted;
  by("measure-what").value = campaign ? "campaign" : "condition";
  by("measure-file").value = campaign ?? condition ?? "";
  by("measure-spring").value = spring ?? "";
  if (axis) by("measure-axis").value = axis;
  by("measure-wind").value = wind_speed_m_s === null ? "" : String(wind_speed_m_s);
}

/** Takes a line of the log. @param {LogLine} line */
export function heard(line) {
  if (line.event === "condition") next = line;
  if (line.event === "derivatives") next = null;
  if (!next || !("derivatives" in line) || !line.derivatives || next.wind_speed_m_s === 0) return;
  const { spring, axis, wind_speed_m_s } = next, at = JSON.stringify([spring, axis, wind_speed_m_s]);
  // The refined ones take the place of the network's, a release made again that of the one before.
  points = points.filter((p) => p.at !== at);
  points.push({ at, name: `${spring} ${axis}, ${wind_speed_m_s} m/s`, d: line.derivatives });
}

/** A derivative with its uncertainty, where that is known. @param {number} value @param {number | null} u */
export function shown(value, u) {
  const places = u !== null && u > 0 ? Math.min(Math.max(1 - Math.floor(Math.log10(u)), 0), 9) : 4;
  return `${value.toFixed(places)}${u === null ? "" : ` ±\u00a0${u.toFixed(places)}`}`.replace("-", "−");
}

/** @param {LiveState} [state] */
export function draw(state) {
  if (state) { by("live-measure").hidden = !state.is_followed; fill(state.measuring); }
  const isOne = by("measure-what").value === "condition";
  for (const id of /** @type {const} */ (["measure-spring", "measure-axis", "measure-wind"])) by(id).hidden = !isOne;
  for (const id of /** @type {const} */ (["measure-back", "measure-skip"])) by(id).disabled = !next;
  by("measure-skip").hidden = isOne;
  if (state) hasEnded = !!state.measuring && state.measuring.has_ended;
  by("measure-next").textContent = next ? next.text.split("\n").pop() ?? "" : hasEnded ? "all releases are made; the recording has ended" : "";
  by("measure-panel").hidden = !points.length;
  // Newest first, as in the log: it is what one looks for.
  by("measure-points").tBodies[0].replaceChildren(...points.toReversed().map((p) => make("tr", {},
    ...[p.name, shown(p.d.cn_beta, p.d.cn_beta_u), shown(p.d.cn_r, p.d.cn_r_u)].map((t) => make("td", { textContent: t })))));
}
