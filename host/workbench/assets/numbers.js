// Numbers of effects that a device's network says: each window's, and the releases' with their uncertainty.
import { by, digits } from "./elements.js";

const RESULTS = 40;
let /** @type {WindowLine[]} */ windows = [], /** @type {ReleaseLine[]} */ releases = [], /** @type {LinePlot[]} */ plots = [];

/** The name and unit of a number, as the device last said it. @param {number} k */
const called = (k) => {
  const last = windows[windows.length - 1], number = last && last.numbers[k];
  return number ? `${number.name.split(".").pop()}${number.unit === "1" ? "" : ` (${number.unit})`}` : "";
};

/** @param {number} k @returns {PlotMark[]} */
const points = (k) => [
  ...windows.filter((w) => w.numbers[k]).map((w) => ({ x: w.time_s, y: w.numbers[k].value, colour: "model" })),
  ...releases.filter((r) => r.numbers[k]).map((r) => ({ x: r.time_s, y: r.numbers[k].value, u: r.numbers[k].u, colour: "ghost" })),
].sort((a, b) => a.x - b.x);

export function build() {
  plots = [0, 1].map((k) => Plots.lines(by(`plot-live-number-${k}`), { x: { label: "session time (s)" }, y: { label: () => called(k) }, marks: () => points(k), cursor: false }));
}

export function forget() {
  windows = []; releases = [];
}

/** Takes a line of the log. @param {LogLine} line */
export function heard(line) {
  if (!("numbers" in line) || !line.numbers.length) return;
  if (line.event === "window") windows.push(line); else releases.push(line);
  for (const all of [windows, releases]) if (all.length > RESULTS) all.shift();
}

export function draw() {
  const count = windows.length ? windows[windows.length - 1].numbers.length : 0;
  by("live-numbers").hidden = !count;
  for (const [k, plot] of plots.entries()) {
    by(`plot-live-number-${k}`).hidden = k >= count;
    if (k >= count) continue;
    const all = points(k);
    by(`plot-live-number-${k}`).title = windows[windows.length - 1].numbers[k].name;
    plot.set([all.map((p) => p.x), all.map((p) => p.y)], [{ invisible: true }]);
    plot.describe(`${called(k)} of windows and releases over the session's time, the latest ${digits(all.at(-1)?.y, 4)}.`);
  }
}
