// The staircase: residual over noise after each step of the journal, and the way back to any of them.
import { by, first, focused, make, ratio } from "./talk.js";

let drawn = "";

/** @param {State} state @param {Act} act */
export function draw(state, act) {
  const { steps } = state, list = by("steps");
  const now = JSON.stringify([steps, !!state.job]);
  if (now === drawn) return;
  drawn = now;
  if (!steps.length) {
    list.replaceChildren(make("p", { className: "caption", textContent: "No step yet. Fit, or add an effect." }));
    return;
  }
  const numbers = steps.flatMap((s) => [s.over_noise ?? 0, s.held_out ?? 0]).filter((x) => isFinite(x) && x > 0);
  const most = Math.max(2, ...numbers) * 1.5;
  // The lowest 28 pixels are the names.
  const place = (/** @type {number | null} */ x) => `calc(28px + ${height(x, most).toFixed(4)} * (100% - 28px))`;
  const ticks = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000].filter((t) => t < 0.75 * most);
  const few = ticks.filter((t, k) => ticks.length < 5 || [1, 10, 100, 1000].includes(t) || k === ticks.length - 1);
  const axis = few.map((t) => { const e = make("div", { className: "axis" }, make("span", { textContent: `${t}` })); e.style.bottom = place(t); return e; });
  const items = steps.map((s, k) => {
    const rise = make("span", { className: "rise" }), held = make("span", { className: "held" });
    rise.style.height = `calc(${height(s.over_noise, most).toFixed(4)} * (100% - 28px))`;
    held.style.bottom = place(s.held_out);
    const last = k === steps.length - 1;
    const text = `step ${s.step}: ${s.what}${s.why ? `, "${s.why}"` : ""}. Residual over noise ${ratio(s.over_noise)}, held out ${ratio(s.held_out)}. ${s.time_utc}${last ? ". This is the model." : ". Choose it to return to it."}`;
    return make("li", { className: last ? "current" : "" }, make("button", {
      type: "button", title: text, "aria-label": text, "data-step": s.step, "data-over-noise": s.over_noise,
      onclick: () => { if (!last && !state.job) act({ do: "return", step: s.step }); },
    }, ...(s.over_noise === null ? [] : [rise]), ...(s.held_out === null ? [] : [held]), make("span", { className: "which", textContent: short(s).replaceAll("_", "_\u200b") })));
  });
  const at = list.scrollLeft;
  const focus = focused("step");
  list.replaceChildren(...axis, make("ol", {}, ...items));
  // The scale stays where it is seen.
  list.onscroll = () => list.style.setProperty("--at", `${list.scrollLeft}px`);
  list.scrollLeft = items.length > 6 ? list.scrollWidth : at;
  if (focus) first(`[data-step="${focus}"]`, list)?.focus({ preventScroll: true });
}

/** Share of the height, on a logarithmic scale. @param {number | null} x @param {number} most */
export function height(x, most) {
  const least = 0.7;
  return x !== null && x > 0 ? Math.max(0, Math.log(x / least) / Math.log(most / least)) : 0;
}

/** @param {Pick<Step, "action" | "of" | "what">} s */
export function short(s) {
  switch (s.action) {
    case "add": return `+${s.of}`;
    case "remove": return `−${s.of}`;
    case "reject": return `✗${s.of}`;
    case "return": return `↶${s.of}`;
    default: return s.what;
  }
}
