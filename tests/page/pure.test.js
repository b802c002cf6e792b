// The parts of the pages' scripts that need no page. `tests/page/check` runs them from a copy of the scripts beside this file.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import test from "node:test";
import { whole } from "./scripts/dropped.js";
import { wrapped } from "./scripts/own.js";
import { paired } from "./scripts/derivatives.js";
import { shown } from "./scripts/points.js";
import { swings, written } from "./scripts/phone.js";
import { trialColour } from "./scripts/panels.js";
import { called } from "./scripts/replay.js";
import { toldApart } from "./scripts/releases.js";
import { height, short } from "./scripts/steps.js";
import * as summaries from "./scripts/summaries.js";
import { digits, make, ratio } from "./scripts/talk.js";
import { unpacked } from "./scripts/unpack.js";

/** A classic script, which leaves its name behind. */
const text = readFileSync(new URL("./scripts/plots.js", import.meta.url), "utf8");
const Plots = new Function("matchMedia", "addEventListener", `${text}; return Plots;`)(() => ({ addEventListener() {} }), () => {});

test("numbers have their digits, a proper minus, and a dash where there are none", () => {
  assert.deepEqual([0.012345, -7.5, 1234567, null, undefined, NaN].map((x) => digits(x)), ["0.0123", "−7.5", "1230000", "–", "–", "–"]);
  assert.deepEqual([0.987, 1.005, 12.34, 123.4, null].map(ratio), ["0.99", "1.00", "12.3", "123", "–"]);
});

test("ticks have the digits that tell them from the next", () => {
  const { tick } = Plots;
  assert.deepEqual([tick(0, 1), tick(0.25, 0.25), tick(-0.5, 0.25), tick(10, 5), tick(3e-5), tick(250000)], ["0", "0.25", "−0.50", "10", "3.0e−5", "2.5e5"]);
});

test("a value has the digits of its uncertainty", () => {
  assert.deepEqual([Plots.uncertain(7.49812, 0.001867), Plots.uncertain(-120.4, 31), Plots.uncertain(-0.02, 0.0004)], ["7.4981 ± 0.0019", "−120 ± 31", "−0.02000 ± 0.00040"]);
});

test("tables over their own x share one, with nothing where they have nothing", () => {
  const joined = Plots.joined([{ x: [3, 1], y: [30, 10] }, { x: [2, 3], y: [-2, -3] }]);
  assert.deepEqual(joined, [[1, 2, 3], [10, null, 30], [null, -2, -3]]);
});

test("a caret stays under its character where a line is cut", () => {
  assert.deepEqual(wrapped("abcdef", "   ^", 10), ["abcdef", "   ^"]);
  assert.deepEqual(wrapped("abcdef", "    ^^", 3), ["abc", "def", " ^^"]);
  assert.deepEqual(wrapped("abc", "   ^", 3), ["abc", "", "^"]);
});

test("a derivative has the digits of its uncertainty, and none of one that was not stored", () => {
  assert.deepEqual([shown(-0.10623, 0.0021), shown(0.53, 0), shown(-0.5, null)], ["−0.1062 ±\u00a00.0021", "0.5300 ±\u00a00.0000", "−0.5000"]);
});

test("derivatives before and after are beside each other by what they are of, not by their number", () => {
  const [k1, k2, k3] = ["K1", "K2", "K3"].map((spring) => ({ spring, wind_speed_m_s: 10 })), faster = { ...k2, wind_speed_m_s: 20 };
  assert.deepEqual(paired({ before: [k1, k2], after: [k2, k3] }), [{ before: k1, after: undefined }, { before: k2, after: k2 }, { before: undefined, after: k3 }]);
  assert.deepEqual(paired({ before: [k2], after: [faster] }).length, 2);
  assert.deepEqual([paired({ before: null, after: [k1] }), paired({ before: null, after: null })], [[{ before: undefined, after: k1 }], []]);
});

test("a session says how long it is and whether it ended", () => {
  const session = { session: "s.jsonl", started: "2026-11-02T10:00:00Z", duration_s: 12.34, releases: 1, marks: 2, is_damaged: false, is_finished: false };
  assert.equal(called(session), "2026-11-02 10:00:00 UTC · 12.3 s, 1 release, 2 marks, never ended · s.jsonl");
  assert.match(called({ ...session, duration_s: null, releases: 0, is_damaged: true }), /no trace, 0 releases, 2 marks, damaged/);
});

test("releases of one session are told apart by number and time", () => {
  assert.equal(toldApart("2026-11-02T10-04-05Z-release-007.csv"), "no. 7, 10:04:05");
  assert.equal(toldApart("K1-mid-off.csv"), "K1-mid-off.csv");
});

test("a step is short in the staircase, and higher where more is left", () => {
  assert.deepEqual(
    [{ action: "add", of: "coulomb_friction" }, { action: "remove", of: "drift" }, { action: "return", of: "2" }, { action: "fit", what: "fit" }].map(short),
    ["+coulomb_friction", "−drift", "↶2", "fit"],
  );
  assert.equal(height(10, 10), 1);
  assert.equal(height(0, 10), 0);
  assert.equal(height(0.1, 10), 0);
  assert.ok(height(2, 10) < height(5, 10));
});

test("trials have the colours of the style sheet, again and again", () => {
  const styled = new Set(readFileSync(new URL("./scripts/workbench.css", import.meta.url), "utf8").match(/trial-\d+(?=:)/g));
  const names = Array.from({ length: 2 * styled.size }, (_, k) => trialColour(k));
  assert.deepEqual(new Set(names), styled);
});

test("the types know of what kind the page's elements are", () => {
  const page = ["index", "server", "static", "live", "board", "drawn", "panels"].map((name) => readFileSync(new URL(`./scripts/${name}.html`, import.meta.url), "utf8")).join();
  const types = readFileSync(new URL("../../tests/page/globals.d.ts", import.meta.url), "utf8");
  const made = ["own-more-states", "own-try", "own-add", "own-save"];
  for (const kind of ["Button", "Details", "Dialog", "Input", "Select", "Table"]) {
    const said = types.match(new RegExp(`type ${kind}Id = ([^;]*);`))[1].match(/[\w-]+/g).filter((id) => !made.includes(id));
    const there = [...page.matchAll(new RegExp(`<${kind.toLowerCase()}\\b[^>]*? id="([^"]*)"`, "g"))].map((m) => m[1]);
    assert.deepEqual(said.sort(), [...new Set(there)].sort());
  }
});

test("elements take properties, attributes and listeners", () => {
  const element = { attributes: {}, listeners: {}, children: [], title: "", append(...c) { this.children.push(...c); },
    setAttribute(name, value) { this.attributes[name] = value; }, addEventListener(name, heard) { this.listeners[name] = heard; } };
  globalThis.document = { createElement: () => element };
  const heard = () => {};
  make("button", { title: "t", "aria-label": "a", "data-no": null, onclick: heard }, "text", null, undefined);
  assert.deepEqual([element.title, element.attributes, element.listeners, element.children], ["t", { "aria-label": "a" }, { click: heard }, ["text"]]);
});

test("a curve of any length is told between its ends", () => {
  const values = Array.from({ length: 300000 }, (_, k) => (k % 1000 === 0 ? null : Math.sin(k)));
  const said = summaries.overlay({ measured_deg: values, time_s: [0, 300] }, { recorded: "yaw angle", unit: "deg" });
  assert.equal(said, "yaw angle over time, −1 to 1 deg, from 0 to 300 s, with the model.");
});

test("a campaign's file or a model's names the others, wherever it lies", () => {
  const all = (...names) => whole(names.map((name) => ({ name, file: null })))?.name ?? null;
  assert.deepEqual([all("a.csv", "b.csv"), all("x/campaign.toml", "x/a.csv"), all("campaign.toml", "model.toml")], [null, "x/campaign.toml", "model.toml"]);
  assert.equal(all("my_effect.toml", "a.csv"), null);
});

test("a phone's axis that swings is found beside one that drifts, and its samples are a file", () => {
  const samples = Array.from({ length: 200 }, (_, k) => [k / 60, 100, 5 * Math.sin(k / 5), 0.5 * Math.sin(k / 5)]);
  assert.equal(swings(samples), "beta");
  assert.deepEqual(written(samples).split("\n").slice(0, 2), ["Time (s),alpha (deg/s),beta (deg/s),gamma (deg/s)", "0.0000,100,0,0"]);
});

test("a panel says in a sentence what it shows", () => {
  const u = { recorded: "yaw angle", unit: "deg", coordinate: "yaw angle", word: "yaw", rate: "yaw rate", of: "deg", rate_unit: "deg/s", moment: "rad/s²", shows_rest: true };
  const w = { noise: 0.01, phase: [[1, 2, 0.005], [-5, 10, -0.2]], damping_law: [[50, 0.1, 0.01], [5, 0.01, 0.01]], stiffness_law: [], frequency: [[1.2, 0.9, 57], [2.4, 0.1, 1]] };
  assert.equal(summaries.phase(w, u), "Missing moment over yaw angle and yaw rate, largest −0.2 rad/s² at −5 deg and 10 deg/s; the noise makes 0.01 of it.");
  assert.equal(summaries.cut(w.damping_law, u.rate, u.rate_unit, w, u), "Missing moment over yaw rate, 2 points, 1 of them beyond twice the noise; largest 0.1 rad/s² at 50 deg/s.");
  assert.equal(summaries.cut([], u.coordinate, u.of, w, u), "No missing moment over yaw angle is known.");
  assert.equal(summaries.spectrum(w), "Spectrum of the residual, largest at 1.2 Hz: 57 times the noise's power.");
  assert.equal(summaries.amplitude([[2, 7.4, 0.01, 0.02, 0.001, 9], [12, 7.5, 0.001, 0.01, 0.0001, 1]], 1, "Natural frequency in rad/s", u), "Natural frequency in rad/s against amplitude, from 7.5 ± 0.001 at 12 deg to 7.4 ± 0.01 at 2 deg.");
});

test("what another program packed is unpacked, and what is damaged refused", () => {
  const words = ["damping", "stiffness", "yaw", "angle", "rate", "drift", "noise", "swing", "spring", "release"], all = [];
  for (let k = 0, x = 1; k < 700; k++) {
    x = (x * 75 + 74) % 65537;
    all.push(words[x % 10]);
  }
  // Of `xz --format=lzma`'s library, lc=4 and pb=0 as the page's module; every kind of step is in it.
  const packed = Buffer.from(
    "BAAAAQDLEQAAAAAAAAA5GhTO7LEJEKee5BJTO0nlIhOaUlmLFUpLuzRjOVddL331TDPQQE/OdsTgAeeco7RKcUhom9yQLxtUu1+Tok4WQ9Gndg6FYIQJsaSTR2NqEpOEjBLrveuRt+nO" +
    "p4+QciJCJG3lzY7UUCpV5dH/lanj2s2IqhmfV9YO+TAKAvHKlYylSu8MqRED/m4SzYqeqpu8Gu6/p7sXfFG1ZrcfVDj4fFwHFn+kMklayFMzbeVDcEVYyF6BH8GAsMj1w87GLs0qP3M+" +
    "nCD/nblXyjDNzUxFG1r1HaRmU9ouOksP3OhXzOQbZ+K/6qo5kTq8xvUKSGkqmNubnfDBjlJnQ/5VBKQ8iOuyKfSjdpqw/Io+2zMpMh+T7/N7W0ESr7yJlTa0NxspE6cjwAE4SOSfxvP+" +
    "8dY9EDzq7n4DKRZupX0nVbn8i6FvXDWZOyvHEA0brC3fQPmbW3sNmfDwGS4EEB+YejxpctNXydkAmdE/xvnxL9nfY4fBWOA4ZczpJCVcc7sTQekgLiSZaMpI9ereqMsZDkq40Co1/PQJ" +
    "S8g4anao7cueKaIcKmXx8ODg8Ipe+IfJbyzHdlG1HzMawRLrQR0InIZa4ggh/eZ3pkZTcsxapvylv63c/9z8TA5DS7pHdVO2iePefWoTPpxdqF7rMzT+HxJIeQ6IlSng+1cJu0EHBI80" +
    "zH7aOpOWOwV2GzWGaXmS3gx3KwWFQ/PoJy55R3XQWH+LtmAIJ5nWFIlqo/WB+hUyXI1S5vZYJsZgyK8gF1GnKCR8j1bBWU3yi1+WsPO12gi2QNJQLOA/NgYvg2tYxXttx7R3r6NT+CbM" +
    "2SDVCKrCmhuEBbK1KibovmwzForIkVfPmzOGwZwWwC+4HLI+VFqg6SsJGWzv80phiioLTELtJbILBcQT//fPmt4=",
    "base64",
  );
  assert.equal(new TextDecoder().decode(unpacked(packed)), all.join(" "));
  assert.throws(() => unpacked(Uint8Array.from(packed, (byte, at) => (at < 14 ? byte : 255))), /damaged/);
});
