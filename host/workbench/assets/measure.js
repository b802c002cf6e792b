// What a followed device's releases are made under: set, shown, and led through a campaign.
import * as points from "./points.js";
import { by } from "./talk.js";
export { heard } from "./points.js";

let wanted = "", hasEnded = false;

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
  points.forget(); wanted = "";
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

/** @param {LiveState} [state] */
export function draw(state) {
  if (state) { by("live-measure").hidden = !state.is_followed; fill(state.measuring); }
  const isOne = by("measure-what").value === "condition";
  for (const id of /** @type {const} */ (["measure-spring", "measure-axis", "measure-wind"])) by(id).hidden = !isOne;
  const next = points.next();
  for (const id of /** @type {const} */ (["measure-back", "measure-skip"])) by(id).disabled = !next;
  by("measure-skip").hidden = isOne;
  if (state) hasEnded = !!state.measuring && state.measuring.has_ended;
  by("measure-next").textContent = next ? next.text.split("\n").pop() ?? "" : hasEnded ? "all releases are made; the recording has ended" : "";
  points.draw();
}
