// What a page without a server adds: files that are chosen, the session as files, and what yawrig prints.
import { by, download, get, make, post, send } from "./talk.js";
import { file, isKept, onUnkept } from "./backend.js";
import * as dropped from "./dropped.js";
import { seen } from "./panels.js";
import * as kept from "./kept.js";
import * as phone from "./phone.js";
import { page } from "./workbench.js";

const EXAMPLE = "example.csv";

/** What can be saved: files that were written here, and what is made for it. */
async function offer() {
  // A browser without storage has kept none.
  const boards = await kept.files().catch(() => new Map());
  const dialog = by("save-dialog"), { files } = await get("/api/held"), release = seen.release;
  const written = files.map(({ name }) => name).filter((name) => /\.(toml|jsonl)$|^phone-/.test(name));
  const saved = (/** @type {string} */ name, /** @type {() => Promise<BlobPart | null>} */ bytes) => make("button", { type: "button", textContent: name, "data-save": name, onclick: async () => {
    try { const made = await bytes(); if (made) download(name.slice(name.lastIndexOf("/") + 1), /** @type {BlobPart} */ (made)); } catch (error) { dialog.close(); page.failed(error); }
  } });
  const printed = (/** @type {"identify" | "diagnose"} */ verb) => saved(`${verb}.json`, async () => (release === null ? null : `${JSON.stringify((await print(verb, release)).json, null, 2)}\n`));
  dialog.replaceChildren(make("h2", { textContent: "Save as a file" }),
    make("p", { className: "caption", textContent: "The model with its journal is what the program reads and writes: dropped here again with its records, or in their folder, it goes on." }),
    make("div", { className: "file-list" }, ...written.map((name) => saved(name, async () => /** @type {any} */ (await file(name)))),
      ...written.includes("model.toml") ? [saved("report.html", async () => (await get("/api/report")).html)] : [],
      ...release === null ? [] : [printed("identify"), printed("diagnose")]),
    ...boards.size ? [make("p", { className: "caption", textContent: "What boards have said, a line of JSON each, and their releases:" }),
      make("div", { className: "file-list" }, ...[...boards].map(([name, text]) => saved(name, text)),
        make("button", { type: "button", id: "forget-boards", textContent: "Forget these", onclick: async () => { dialog.close(); await kept.forget().catch(page.failed); } }))] : [],
    make("p", { className: "row" }, make("button", { type: "button", textContent: "Close", onclick: () => dialog.close() })));
  dialog.showModal();
}

/** @param {"identify" | "diagnose"} verb @param {number} release @returns {Promise<Printed>} */
const print = async (verb, release) => get("/api/printed", { verb, release });

/** What the program prints of the record in view, once somebody wants to see it. */
async function show() {
  const release = seen.release;
  if (!by("printed").open || release === null) return;
  for (const verb of /** @type {const} */ (["identify", "diagnose"])) {
    const box = by(`printed-${verb}`);
    box.textContent = `yawrig ${verb} …`;
    try {
      const { text } = await print(verb, release);
      if (release === seen.release) box.textContent = text;
    } catch (/** @type {any} */ error) { box.textContent = error.message; }
  }
}

/** A file in the page's own folder. @param {string} name */
async function beside(name) {
  const answer = /^[^/\\]+$/.test(name) ? await fetch(encodeURIComponent(name)) : null;
  return answer?.ok ? new File([await answer.blob()], name) : null;
}

function start() {
  onUnkept(() => {
    by("nothing-sent").textContent = "Records are read and judged here, in this browser: nothing of them is sent anywhere. This page's session is gone once it is closed, since it stands within another page, another tab keeps one, or there is no room for it: press Save before.";
  });
  const chosen = (/** @type {"open-file" | "open-folder"} */ id) => async () => {
    const files = [...by(id).files ?? []].map((file) => ({ file, name: file.webkitRelativePath || file.name }));
    by(id).value = "";
    try { await dropped.taken(files, page.opened, page.failed); } catch (error) { page.failed(error); }
  };
  by("open-file").onchange = chosen("open-file");
  by("open-folder").onchange = chosen("open-folder");
  // Made anew with the list.
  by("release-list").addEventListener("click", async ({ target }) => {
    if (target !== by("example-button")) return;
    try { const file = await beside(EXAMPLE); if (file) await dropped.taken([{ name: EXAMPLE, file }], page.opened, page.failed); } catch (error) { page.failed(error); }
  });
  page.beside(beside);
  by("folder-button").onclick = () => by("open-folder").click();
  by("save-button").onclick = () => { offer().catch(page.failed); };
  by("close-button").onclick = async () => {
    try { await post("/api/do", { do: "close" }); await page.refresh(); page.say(isKept() ? "closed, and forgotten in this browser" : "closed"); } catch (error) { page.failed(error); }
  };
  phone.build(async (file, reading) => {
    await send("/api/drop", file);
    await page.opened((await post("/api/do", { do: "open", file: file.name, reading })).release);
  }, page.failed);
  by("printed").ontoggle = () => { show(); };
  let drawn = /** @type {number | null} */ (null);
  new MutationObserver(() => {
    by("printed").hidden = seen.release === null;
    if (drawn !== seen.release) { drawn = seen.release; show(); }
  }).observe(by("candidates"), { childList: true });
  // Where there is none (no https, and not this machine) the page needs its network.
  navigator.serviceWorker?.register("offline.js").catch(() => {});
}

start();
