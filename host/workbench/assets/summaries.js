// What each panel shows, in a sentence: for those who do not see it.
import { digits } from "./elements.js";

/** The one whose size is largest. @template T @param {T[]} all @param {(one: T) => number} size @returns {T | undefined} */
const largest = (all, size) => all.reduce((/** @type {T | undefined} */ best, one) => (best === undefined || Math.abs(size(one)) > Math.abs(size(best)) ? one : best), undefined);

/** The record between its ends and how large it is. @param {Curves} c @param {Units} u */
export function overlay(c, u) {
  let low = Infinity, high = -Infinity;
  for (const y of c.measured_deg) if (y !== null) { low = Math.min(low, y); high = Math.max(high, y); }
  const of = c.ghost_title ? ` and the model with ${c.ghost_title}` : "";
  return `${u.recorded} over time, ${digits(low)} to ${digits(high)} ${u.unit}, from ${digits(c.time_s[0])} to ${digits(c.time_s[c.time_s.length - 1])} s, with the model${of}.`;
}

/** @param {View} v @param {Units} u */
export const residual = (v, u) => `Residual over time, rms ${digits(v.residual_rms_deg)} ${u.unit}: ${digits(v.over_noise)} times the noise, ${v.is_white ? "white" : "not white"}.`;

/** @param {Where} w @param {Units} u */
export function phase(w, u) {
  const most = largest(w.phase, (cell) => cell[2]);
  return most ? `Missing moment over ${u.coordinate} and ${u.rate}, largest ${digits(most[2])} ${u.moment} at ${digits(most[0])} ${u.of} and ${digits(most[1])} ${u.rate_unit}; the noise makes ${digits(w.noise, 2)} of it.` : "No missing moment is known.";
}

/** @param {CutPoint[]} points @param {string} over @param {string} unit @param {Where} w @param {Units} u */
export function cut(points, over, unit, w, u) {
  const most = largest(points, (p) => p[1]);
  if (!most) return `No missing moment over ${over} is known.`;
  const outside = points.filter((p) => Math.abs(p[1]) > 2 * w.noise).length;
  return `Missing moment over ${over}, ${points.length} points, ${outside} of them beyond twice the noise; largest ${digits(most[1])} ${u.moment} at ${digits(most[0])} ${unit}.`;
}

/** @param {AmplitudePoint[]} points @param {1 | 3} column @param {string} name @param {Units} u */
export function amplitude(points, column, name, u) {
  const sorted = [...points].sort((a, b) => b[0] - a[0]), first = sorted[0], last = sorted[sorted.length - 1];
  if (!first) return `No ${name} by amplitude is known.`;
  const at = (/** @type {AmplitudePoint} */ p) => `${digits(p[column], 4)} ± ${digits(p[/** @type {2 | 4} */ (column + 1)], 2)} at ${digits(p[0])} ${u.of}`;
  return `${name} against amplitude, from ${at(first)} to ${at(last)}.`;
}

/** @param {Where} w */
export function spectrum(w) {
  const most = largest(w.frequency, (band) => band[2]);
  return most ? `Spectrum of the residual, largest at ${digits(most[0])} Hz: ${digits(most[2])} times the noise's power.` : "No spectrum of the residual is known.";
}
