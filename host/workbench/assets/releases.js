// The list of releases: grouped by spring and wind, a badge each, and what each is used for.
import { by, first, focused, get, HAS_SYSTEM, make, post, ratio } from "./talk.js";
import { seen } from "./panels.js";

const BADGES = {
  adequate: "adequate: the model explains it to the noise",
  structured: "structured residual: something is missing",
  bad: "bad data", pending: "being looked at",
};

const /** @type {Map<number, HTMLElement>} */ keep = new Map(), /** @type {Map<number, string>} */ known = new Map();
let order = "";

/** Draws the list; `choose` is called with the release that the user takes.
 * @param {State} state @param {Choose} choose @param {Failed} failed */
export function draw(state, choose, failed) {
  const list = by("release-list");
  // A row that is as it was stays: a click or a focus on it is not lost while others become ready.
  const now = JSON.stringify(state.releases.map((r) => [r.id, r.spring, r.wind_speed_m_s]));
  const focus = focused();
  if (now === order && state.releases.length) {
    for (const release of state.releases) {
      const text = JSON.stringify(release);
      if (known.get(release.id) === text) continue;
      known.set(release.id, text);
      const old = keep.get(release.id);
      old?.replaceWith(row(release, choose, failed));
    }
    restore(focus);
    return buttons(state);
  }
  order = now;
  for (const release of state.releases) known.set(release.id, JSON.stringify(release));
  const /** @type {Map<string, Release[]>} */ groups = new Map();
  for (const release of state.releases) {
    const wind = release.wind_speed_m_s === null ? null : release.wind_speed_m_s === 0 ? "wind off" : `${release.wind_speed_m_s} m/s`;
    const name = release.spring === null ? "Records" : `${release.spring} · ${wind}`;
    const group = groups.get(name) ?? [];
    groups.set(name, group);
    group.push(release);
  }
  const rows = [];
  for (const [name, releases] of groups) {
    if (groups.size > 1 || releases[0].spring !== null) rows.push(make("div", { className: "group", textContent: name }));
    rows.push(...releases.map((release) => row(release, choose, failed)));
  }
  if (!rows.length) rows.push(make("p", { className: "empty", textContent: HAS_SYSTEM ? "No record is open. Press Open, or start yawrig workbench with records." : "No record is open. Drop one anywhere on the page, or press Open." }),
    HAS_SYSTEM ? "" : make("button", { type: "button", id: "example-button", textContent: "Try an example", title: "A release of a virtual rig, with something in it that the second-order model lacks" }));
  list.replaceChildren(...rows);
  restore(focus);
  buttons(state);
}

/** @param {string | null} focus */
function restore(focus) {
  const again = focus && first(`[data-focus="${focus}"]`, by("release-list"));
  if (again && again !== document.activeElement) again.focus({ preventScroll: true });
}

/** @param {State} state */
function buttons(state) {
  by("fit-button").textContent = !state.model.exists ? "Fit" : state.model.ticks_changed ? "Fit ticked" : "Fit again";
  by("fit-button").classList.toggle("primary", state.model.exists && state.model.ticks_changed);
  by("fit-button").disabled = !!state.job || !state.releases.length;
  by("report-button").disabled = !state.model.exists;
}

/** A release recorded here begins with the time of its session: its number and the time of day tell it from the others.
 * @param {string} name */
export function toldApart(name) {
  const found = name.match(/T(\d\d)-(\d\d)-(\d\d)Z-release-0*(\d+)\.csv$/);
  return found ? `no. ${found[4]}, ${found[1]}:${found[2]}:${found[3]}` : name;
}

/** @param {Release} release @param {Choose} choose @param {Failed} failed */
function row(release, choose, failed) {
  const { id, used, badge } = release;
  const why = release.fault ? `${release.fault.message} ${release.fault.help}` : BADGES[badge];
  const short = release.spring === null ? toldApart(release.name) : `${release.axis} axis`;
  const tick = (/** @type {string} */ name, /** @type {Use} */ value, /** @type {string} */ title) => make("input", {
    type: "checkbox", checked: used === value, disabled: release.is_left_out, title: release.is_left_out ? why : title, "aria-label": `${release.name}: ${name}`, "data-focus": `${name}-${id}`,
    onchange: (event) => set([id], event.target.checked ? value : "out", failed),
  });
  const element = make("div", { className: `release${id === seen.release ? " selected" : ""}`, "data-release": id, "data-badge": badge },
    make("span", { className: `badge ${badge}`, title: why, role: "img", "aria-label": BADGES[badge] }),
    make("button", {
      type: "button", textContent: short, title: `${release.file}\n${why}`, "data-focus": `name-${id}`, "aria-current": id === seen.release ? "true" : null,
      onclick: () => choose(id),
    }),
    make("span", { className: "number", textContent: release.over_noise === null ? "" : ratio(release.over_noise), title: "residual over noise" }),
    tick("fit", "fit", "fitted"), tick("hold", "hold_out", "held out: the model is tried on it"));
  keep.set(id, element);
  return element;
}

/** Marks another one as looked at, at once. @param {number} id */
export function mark(id) {
  for (const [other, element] of keep) {
    element.classList.toggle("selected", other === id);
    const button = element.querySelector("button");
    if (!button) continue;
    if (other === id) { button.setAttribute("aria-current", "true"); element.scrollIntoView({ block: "nearest" }); } else button.removeAttribute("aria-current");
  }
}

/** The release so many places on in the order of the list. @param {number} step */
export function neighbour(step) {
  const order = [...document.querySelectorAll(".release")].map((e) => Number(e.getAttribute("data-release")));
  const at = seen.release === null ? -1 : order.indexOf(seen.release);
  return order[Math.min(Math.max(at + step, 0), order.length - 1)] ?? null;
}

/** @param {number[]} releases @param {Use} used @param {Failed} failed */
export async function set(releases, used, failed) {
  try { await post("/api/do", { do: "tick", releases, used }); } catch (error) { failed(error); }
}

/** `make_campaign` opens the form for a campaign of the folder's records.
 * @param {Choose} choose @param {Failed} failed @param {() => void} make_campaign */
export async function openDialog(choose, failed, make_campaign) {
  const dialog = by("open-dialog");
  try {
    const { files } = await get("/api/files");
    const open = async (/** @type {string} */ file) => {
      dialog.close();
      try { choose((await post("/api/do", { do: "open", file })).release); } catch (error) { failed(error); }
    };
    dialog.replaceChildren(make("h2", { textContent: "Records in this folder" }),
      files.length ? make("div", { className: "file-list" }, ...files.map((file) => make("button", { type: "button", textContent: file, onclick: () => open(file) })))
        : make("p", { textContent: "There are no further records in the folder that yawrig was started in." }),
      make("p", { className: "row" }, make("button", { type: "button", id: "campaign-button", textContent: "Make a campaign of them", title: "Which spring, axis and wind each was made with: a campaign.toml (g)", onclick: () => { dialog.close(); make_campaign(); } }), make("button", { type: "button", textContent: "Close", onclick: () => dialog.close() })));
    dialog.showModal();
  } catch (error) { failed(error); }
}
