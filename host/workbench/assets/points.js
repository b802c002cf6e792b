// The derivatives that a device gives of its releases, each under its condition.
import { by, make } from "./elements.js";

/** @typedef {{ at: string, name: string, d: DeviceDerivatives }} MeasuredPoint */
let /** @type {ConditionLine | null} */ condition = null, /** @type {MeasuredPoint[]} */ points = [];

export function forget() {
  condition = null; points = [];
}

/** What the next release is made under; null where that is not known. */
export const next = () => condition;

/** Takes a line of the log. @param {LogLine} line */
export function heard(line) {
  if (line.event === "condition") condition = line;
  if (line.event === "derivatives") condition = null;
  if (!condition || !("derivatives" in line) || !line.derivatives || condition.wind_speed_m_s === 0) return;
  const { spring, axis, wind_speed_m_s } = condition, at = JSON.stringify([spring, axis, wind_speed_m_s]);
  // The refined ones take the place of the network's, a release made again that of the one before.
  points = points.filter((p) => p.at !== at);
  points.push({ at, name: `${spring} ${axis}, ${wind_speed_m_s} m/s`, d: line.derivatives });
}

/** A derivative with its uncertainty, where that is known. @param {number} value @param {number | null} u */
export function shown(value, u) {
  const places = u !== null && u > 0 ? Math.min(Math.max(1 - Math.floor(Math.log10(u)), 0), 9) : 4;
  return `${value.toFixed(places)}${u === null ? "" : ` ±\u00a0${u.toFixed(places)}`}`.replace("-", "−");
}

export function draw() {
  by("measure-panel").hidden = !points.length;
  // Newest first, as in the log: it is what one looks for.
  by("measure-points").tBodies[0].replaceChildren(...points.toReversed().map((p) => make("tr", {},
    ...[p.name, shown(p.d.cn_beta, p.d.cn_beta_u), shown(p.d.cn_r, p.d.cn_r_u)].map((t) => make("td", { textContent: t })))));
}
