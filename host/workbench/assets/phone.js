// A phone as the sensor: its gyroscope is recorded at its own rate and becomes a record like any other.
import { by, digits, make } from "./talk.js";

/** Axes as a browser calls them; which of them is which of the phone's is not the same everywhere. */
const AXES = /** @type {const} */ (["alpha", "beta", "gamma"]);
/** Longest recording, s, and the longest wait for a first sample, ms. */
const LONGEST_S = 600, PATIENCE_MS = 3000;
/** Time in s and three rates in deg/s. @typedef {[time_s: number, alpha: number, beta: number, gamma: number]} Sample */

/** The one that swings: whose rate is largest about its mean. @param {Sample[]} samples @returns {typeof AXES[number]} */
export function swings(samples) {
  const power = AXES.map((_, k) => {
    const mean = samples.reduce((sum, s) => sum + s[k + 1], 0) / samples.length;
    return samples.reduce((sum, s) => sum + (s[k + 1] - mean) ** 2, 0);
  });
  return AXES[power.indexOf(Math.max(...power))];
}

/** Samples as a file. @param {Sample[]} samples */
export const written = (samples) => ["Time (s)", ...AXES.map((name) => `${name} (deg/s)`)].join(",") + "\n"
  + samples.map(([time_s, ...rates]) => [time_s.toFixed(4), ...rates.map((r) => +r.toPrecision(9))].join(",")).join("\n") + "\n";

let /** @type {Sample[]} */ samples = [], /** @type {number | null} */ begun = null, stop = () => {};

/** @param {DeviceMotionEvent} event */
function heard({ rotationRate: rate, timeStamp }) {
  if (!rate || rate.alpha === null || rate.beta === null || rate.gamma === null) return;
  begun ??= timeStamp;
  const time_s = (timeStamp - begun) / 1000, last = samples[samples.length - 1];
  // Two within a tenth of a millisecond are one.
  if (last && time_s - last[0] < 1e-4) return;
  samples.push([time_s, rate.alpha, rate.beta, rate.gamma]);
  if (time_s > LONGEST_S) stop();
}

/** Asks for leave where the phone wants it asked for, and for the screen to stay on. */
async function allowed() {
  if (typeof DeviceMotionEvent === "undefined") throw Object.assign(new Error("this browser shows no page how it moves"), { help: "open the page in another browser, by https" });
  const asks = /** @type {{ requestPermission?: () => Promise<string> }} */ (/** @type {unknown} */ (DeviceMotionEvent));
  if (asks.requestPermission && await asks.requestPermission() !== "granted") throw Object.assign(new Error("the gyroscope may not be read"), { help: "allow motion sensors for this page in the browser's settings, and press Start again" });
}

/** `opened` is given a recording as a file, and which of its axes swings.
 * @param {(file: File, reading: Reading) => Promise<unknown>} opened @param {Failed} failed */
export function build(opened, failed) {
  const dialog = by("phone-dialog");
  const told = make("p", { id: "phone-told", role: "status", textContent: " " });
  const begin = make("button", { type: "button", id: "phone-begin", className: "primary", textContent: "Start" });
  const close = make("button", { type: "button", textContent: "Cancel", onclick: () => dialog.close() });
  dialog.replaceChildren(make("h2", { textContent: "This phone as the sensor" }),
    make("p", { textContent: "Fix the phone to what swings: a bar on a string, a model on springs. Press Start, hold it aside for two seconds, let go, and do not touch it until it has come to rest. Then press Stop." }),
    make("p", { className: "caption", textContent: "Its gyroscope is recorded, a rate; where it is on what swings makes no difference. Nothing of it is sent anywhere." }),
    told, make("p", { className: "row" }, begin, close));
  let /** @type {number | undefined} */ timer, isOn = false, /** @type {{ release(): Promise<void> } | undefined} */ lock;
  const quiet = () => {
    isOn = false;
    removeEventListener("devicemotion", heard);
    clearInterval(timer);
    lock?.release().catch(() => {});
    lock = undefined;
    begin.textContent = "Start";
  };
  dialog.onclose = quiet;
  stop = () => {
    if (!isOn) return;
    quiet();
    const taken = samples;
    if (!taken.length) { told.textContent = "Nothing was measured."; return; }
    dialog.close();
    const name = `phone-${new Date().toISOString().slice(0, 19).replaceAll(":", "-")}Z.csv`;
    opened(new File([written(taken)], name), { yaw: `${swings(taken)} (deg/s)`, quantity: "rate", unit: "deg/s" }).catch(failed);
  };
  const show = (/** @type {number} */ since) => {
    const last = samples[samples.length - 1], rate = samples.length > 1 ? (samples.length - 1) / last[0] : 0;
    if (!last && performance.now() - since > PATIENCE_MS) {
      quiet();
      told.textContent = "The browser reports no motion: this device has no gyroscope, or the page does not come by https.";
    } else told.textContent = last ? `${last[0].toFixed(0)} s, ${digits(rate)} samples a second, ${digits(Math.max(...last.slice(1).map(Math.abs)))} deg/s now` : "waiting for the gyroscope …";
  };
  begin.onclick = async () => {
    if (isOn) return stop();
    try {
      await allowed();
      samples = [];
      begun = null;
      isOn = true;
      begin.textContent = "Stop";
      addEventListener("devicemotion", heard);
      const since = performance.now();
      show(since);
      timer = setInterval(() => show(since), 500);
      // A screen that goes dark ends it.
      lock = await navigator.wakeLock?.request("screen").catch(() => undefined);
    } catch (error) { dialog.close(); failed(error); }
  };
  by("phone-button").onclick = () => { told.textContent = " "; dialog.showModal(); };
}
