// A stored session on the page: which one, play and pause, how fast, and from where.
import { by, make } from "./talk.js";

/** Seconds that an arrow key goes. */
const STEP_S = 5;
let /** @type {Replay | null} */ state = null, /** @type {Place[]} */ stops = [], /** @type {number | null} */ wanted = null;
let /** @type {ActLive} */ act = async () => {}, isGoing = false;

/** @param {ActLive} doing */
export function build(doing) {
  act = doing;
  const speed = by("replay-speed"), time = by("replay-time"), place = by("replay-place");
  by("replay-play").onclick = play;
  speed.onchange = () => act({ do: "speed", times: +speed.value });
  time.oninput = () => go(+time.value);
  place.onchange = () => { if (place.value !== "") go(+place.value); };
  // To be chosen once more.
  place.onblur = () => { place.value = ""; };
}

const play = () => act({ do: state?.is_playing ? "pause" : "play" });

/** To this time; while one jump is on its way, of those that follow only the last. @param {number} time_s */
async function go(time_s) {
  if (!state) return;
  wanted = Math.min(Math.max(time_s, state.from_s), state.to_s);
  if (isGoing) return;
  isGoing = true;
  while (wanted !== null) {
    const now = wanted;
    wanted = null;
    await act({ do: "jump", time_s: now });
  }
  isGoing = false;
}

const seconds = (/** @type {number} */ s) => `${s.toFixed(1)} s`;

/** How a session is called in the list. @param {StoredSession} s */
export function called(s) {
  const count = (/** @type {number} */ n, /** @type {string} */ one) => `${n} ${one}${n === 1 ? "" : "s"}`;
  const parts = [s.duration_s === null ? "no trace" : seconds(s.duration_s), count(s.releases, "release")];
  if (s.marks) parts.push(count(s.marks, "mark"));
  if (s.is_damaged) parts.push("damaged"); else if (!s.is_finished) parts.push("never ended");
  return `${s.started.replace("T", " ").replace("Z", " UTC")} · ${parts.join(", ")} · ${s.session}`;
}

/** Marks and releases that can be gone to. @param {Place[]} found */
export function places(found) {
  stops = [...found].sort((a, b) => a.time_s - b.time_s);
  by("replay-place").replaceChildren(make("option", { value: "", textContent: stops.length ? "jump to …" : "no marks" }),
    ...stops.map((p) => make("option", { value: `${p.time_s}`, textContent: `${seconds(Math.max(p.time_s, 0))} · ${p.text}` })));
}

/** @param {Replay | null} now */
export function draw(now) {
  state = now;
  by("live-replay").hidden = !now;
  if (!now) return;
  by("replay-play").textContent = now.is_playing ? "Pause" : "Play";
  by("replay-play").classList.toggle("primary", !now.is_playing);
  if (document.activeElement !== by("replay-speed")) by("replay-speed").value = String(now.speed);
  const slider = by("replay-time"), since = now.at_s - now.from_s, whole = now.to_s - now.from_s;
  Object.assign(slider, { min: now.from_s, max: now.to_s });
  // What is being dragged is not pulled back.
  if (!isGoing) slider.value = `${now.at_s}`;
  slider.setAttribute("aria-valuetext", `${seconds(now.at_s)} of the session`);
  // Of a session that was not recorded from its beginning on.
  const from = now.from_s > 0.05 ? `at ${seconds(now.at_s)}, ` : "";
  by("replay-at").textContent = `${from}${since.toFixed(1)} of ${seconds(whole)}`;
  by("replay-at").title = `${now.file}${now.started ? `, recorded from ${now.started}` : ""}${now.is_finished ? "" : ", never ended"}`;
  Object.assign(by("live-replay").dataset, { at: now.at_s, playing: now.is_playing, speed: now.speed });
}

/** @param {KeyboardEvent} event */
export function key(event) {
  if (!state) return false;
  const { at_s, from_s } = state, isOfButton = event.target instanceof Element && event.target.matches("button");
  const before = stops.filter((p) => p.time_s < at_s - 0.5).pop(), after = stops.find((p) => p.time_s > at_s + 0.01);
  switch (event.key) {
    case " ": if (isOfButton) return false; play(); return true;
    case "ArrowLeft": go(at_s - STEP_S); return true;
    case "ArrowRight": go(at_s + STEP_S); return true;
    case "[": go(before ? before.time_s : from_s); return true;
    case "]": if (after) go(after.time_s); return true;
    default: return false;
  }
}
