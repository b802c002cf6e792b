// A stored session on the page: which one, play and pause, how fast, and from where.
import { by, make } from "./talk.js";

/** Seconds that an arrow key goes. */
const STEP_S = 5;
let state = null, stops = [], act = async (_what) => {}, wanted = null, isGoing = false;

export function build(doing) {
  act = doing;
  by("replay-play").onclick = play;
  by("replay-speed").onchange = (e) => act({ do: "speed", times: +e.target.value });
  by("replay-time").oninput = (e) => go(+e.target.value);
  by("replay-place").onchange = (e) => { if (e.target.value !== "") go(+e.target.value); };
  // To be chosen once more.
  by("replay-place").onblur = (e) => { e.target.value = ""; };
}

const play = () => act({ do: state.is_playing ? "pause" : "play" });

/** To this time; while one jump is on its way, of those that follow only the last. */
async function go(time_s) {
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

const seconds = (s) => `${s.toFixed(1)} s`;

/** How a session is called in the list. */
export function called(s) {
  const count = (n, one) => `${n} ${one}${n === 1 ? "" : "s"}`;
  const parts = [s.duration_s === null ? "no trace" : seconds(s.duration_s), count(s.releases, "release")];
  if (s.marks) parts.push(count(s.marks, "mark"));
  if (s.is_damaged) parts.push("damaged"); else if (!s.is_finished) parts.push("never ended");
  return `${s.started.replace("T", " ").replace("Z", " UTC")} · ${parts.join(", ")} · ${s.session}`;
}

/** Marks and releases that can be gone to. */
export function places(found) {
  stops = [...found].sort((a, b) => a.time_s - b.time_s);
  by("replay-place").replaceChildren(make("option", { value: "", textContent: stops.length ? "jump to …" : "no marks" }),
    ...stops.map((p) => make("option", { value: p.time_s, textContent: `${seconds(Math.max(p.time_s, 0))} · ${p.text}` })));
}

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
  if (!isGoing) slider.value = now.at_s;
  slider.setAttribute("aria-valuetext", `${seconds(now.at_s)} of the session`);
  // Of a session that was not recorded from its beginning on.
  const from = now.from_s > 0.05 ? `at ${seconds(now.at_s)}, ` : "";
  by("replay-at").textContent = `${from}${since.toFixed(1)} of ${seconds(whole)}`;
  by("replay-at").title = `${now.file}${now.started ? `, recorded from ${now.started}` : ""}${now.is_finished ? "" : ", never ended"}`;
  Object.assign(by("live-replay").dataset, { at: now.at_s, playing: now.is_playing, speed: now.speed });
}

export function key(event) {
  const isOfButton = event.target.matches("button");
  const before = () => stops.filter((p) => p.time_s < state.at_s - 0.5).pop(), after = () => stops.find((p) => p.time_s > state.at_s + 0.01);
  switch (event.key) {
    case " ": if (isOfButton) return false; play(); return true;
    case "ArrowLeft": go(state.at_s - STEP_S); return true;
    case "ArrowRight": go(state.at_s + STEP_S); return true;
    case "[": go((before() || { time_s: state.from_s }).time_s); return true;
    case "]": if (after()) go(after().time_s); return true;
    default: return false;
  }
}
