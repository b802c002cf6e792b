// The measured law: asked for, drawn over the cuts, and the ways to take it into the model.
import { by, first, focused, get, make, ratio } from "./talk.js";
import { seen, showMeasured, trialColour } from "./panels.js";

let /** @type {Law | null} */ law = null, drawn = "", asked = 0;

/** What is known of the law by now. @param {State} state @param {Act} act */
export async function refresh(state, act) {
  const release = seen.release, mine = ++asked;
  let answer = null;
  if (release !== null) try { answer = await get("/api/law", { release }); } catch { /* There is none to be drawn. */ }
  // Answers may overtake each other: the last question's is what is so.
  if (mine !== asked || release !== seen.release) return;
  law = answer;
  const now = JSON.stringify([law, !!state.job]);
  if (now === drawn) return;
  drawn = now;
  showMeasured(law);
  draw(state, act);
}

/**
 * What shows that no law holds it, and where it is drawn.
 * @type {{ left: string, host: HTMLElement } | null}
 */
let shown = null;
/** @param {LeftByLaw} left */
function picture(left) {
  if (shown?.left === JSON.stringify(left)) return shown.host;
  const host = make("div", { className: "plot left", role: "img", "aria-label": `${left.y_label} over ${left.x_label}` });
  const places = left.at === null ? [] : [{ x: left.at, text: `${ratio(left.at)} Hz` }];
  const plot = Plots.lines(host, { x: { label: left.x_label }, y: { label: left.y_label }, places: () => places, cursor: false });
  plot.set(Plots.joined(left.lines), left.lines.map(() => ({ colour: "law", width: 1.2, spanGaps: true })));
  shown = { left: JSON.stringify(left), host };
  return host;
}

const change = (/** @type {BeforeAfter} */ [before, after]) => `${ratio(before)} → ${ratio(after)}`;

/** @param {State} state @param {Act} act */
function draw(state, act) {
  const box = by("law"), busy = !!state.job;
  box.hidden = !law;
  if (!law) return box.replaceChildren();
  const { measured, found } = law;
  const button = (/** @type {string} */ name, /** @type {string} */ text, /** @type {string} */ title, /** @type {Job} */ job) => make("button", { type: "button", textContent: text, title, disabled: busy, "data-focus": `law-${name}`, onclick: () => act(job) });
  const add = (/** @type {string} */ effect, /** @type {string} */ text, /** @type {string} */ title) => button(effect, text, title, { do: "add", effect });
  /** @type {HTMLElement[]} */
  const parts = [make("strong", { textContent: "measured_law" }),
    make("p", { className: "caption", textContent: `from ${law.file}, known to ${ratio(law.yaw_deg)} ${law.units[0]} and ${ratio(law.rate_deg_s)} ${law.units[1]}` })];
  if (measured) parts.push(make("p", { textContent: `Residual over noise ${change(measured.residual_over_noise)}, held out ${change(measured.held_out_over_noise)}.` }));
  if (!found) parts.push(make("p", { className: "caption", textContent: measured ? "The formulas that it may be are being fitted." : "A first law; its band is being computed." }));
  else {
    if (found.memory && found.remembers) parts.push(make("p", { className: "memory", textContent: `${found.memory}.` }), add(found.remembers, `Add as ${found.remembers}`, `yawrig add ${found.remembers}`));
    if (found.beside) parts.push(make("p", { className: "memory", textContent: `${found.beside}.` }));
    if (found.left) parts.push(picture(found.left));
    const may_drive = !!measured?.may_drive, how = may_drive ? " --may-drive" : "";
    parts.push(button("measured_law", "Add as measured", `The curves themselves, fitted to all ticked releases: yawrig add measured_law${how}`, { do: "add", effect: "measured_law", may_drive }));
    parts.push(may_drive
      ? button("drive", "Measure again, taking energy out", "The damping takes energy out at every rate, as without wind.", { do: "law" })
      : button("drive", "Measure again, energy may come in", "The damping may put energy in, as wind does where a model swings by itself: yawrig law --may-drive", { do: "law", may_drive: true }));
    parts.push(make("ol", {}, ...found.names.map((name, k) => {
      const swatch = make("span", { className: "trial" });
      swatch.style.borderTopColor = `var(--${trialColour(k)})`;
      return make("li", { title: `${name.title}: ${name.formula}` },
        make("div", { className: "head" }, swatch, make("span", { className: "name", textContent: name.form }),
          make("span", { className: "found", textContent: `ratio ${ratio(name.residual_over_noise)} · held out ${ratio(name.held_out_over_noise)}`, title: "Residual over noise with this formula in place of the law, and on parts that were left out of the fit." })),
        make("p", { className: "caption", textContent: name.numbers }),
        name.file ? add(name.file, `Add as ${name.form}`, `yawrig add ${name.file}`) : null);
    })));
    if (!found.names.length) parts.push(make("p", { className: "caption", textContent: "No formula: the second-order response is all that is seen." }));
    if (found.alike) parts.push(make("p", { className: "caption", textContent: `${found.alike}.` }));
  }
  const focus = focused();
  box.replaceChildren(...parts);
  if (focus && focus.startsWith("law-")) first(`[data-focus="${CSS.escape(focus)}"]`, box)?.focus({ preventScroll: true });
}
