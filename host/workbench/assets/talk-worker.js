// What the page says to its server, said to a worker: written as talk.js beside a page that has none. What takes its time
// is said to be under way from here: the worker does one thing after the other.
import * as backend from "./backend.js";
export { GONE } from "./backend.js";
export * from "./elements.js";

/** Whether yawrig has the system's folders and devices here. */
export const HAS_SYSTEM = false;

const JOBS = ["fit", "add", "remove", "reject", "return", "diagnose", "judge", "together", "law", "try"];
let /** @type {{ job: Job, what: string, since: number } | null} */ running = null, /** @type {Ended | null} */ ended = null, said = "";
let /** @type {State | null} */ last = null, tell = (/** @type {News} */ _) => {}, /** @type {number | null} */ wanted = null, isReadying = false;

/** @returns {Progress | null} */
const progress = () => running && { what: said ? `${running.what}, ${said}` : running.what, seconds: (performance.now() - running.since) / 1000, looks: null, is_stopping: false };

/** @template {keyof Answers} P @param {P} path @param {Record<string, string | number | null>} query @returns {Promise<Answers[P]>} */
export async function get(path, query = {}) {
  if (path === "/api/view" && typeof query.release === "number") wanted = query.release;
  // While it works it does not answer: what it said before is so until then.
  if (path === "/api/state" && running && last) return /** @type {any} */ ({ ...last, job: progress(), ended });
  const answer = await backend.ask(path, query);
  if (path === "/api/view" && "pending" in answer) makeReady();
  if (path !== "/api/state") return answer;
  last = answer;
  return /** @type {any} */ ({ ...answer, job: progress(), ended });
}

/** @param {string} path @param {any} body @returns {Promise<any>} */
export async function post(path, body) {
  if (path !== "/api/do") return backend.ask(path, body);
  if (body.do === "cancel") return cancel();
  if (running) throw Object.assign(new Error(`not now: ${running.what} is under way`), { help: "wait for it, or cancel it" });
  if (JOBS.includes(body.do)) { work(body); return {}; }
  const answer = await backend.ask(path, body);
  await backend.keep();
  tell({ kind: "state" });
  return answer;
}

/** @param {string} _ @param {File} file @param {string} [name] @returns {Promise<Posts["/api/as_read"]["answer"]>} */
export const send = (_, file, name = file.name) => backend.take(file, name);

/** What a job does, in words. @param {any} job */
const words = (job) => ({ fit: "fitting the model", law: "measuring the law", judge: "judging the whole campaign", together: "judging the ticked releases together", diagnose: "fitting every effect", return: `returning to step ${job.step}` })[/** @type {string} */ (job.do)]
  ?? `${{ add: "adding", remove: "removing", reject: "rejecting", try: "trying" }[/** @type {string} */ (job.do)]} ${job.effect}`;

/** @param {Job} job */
async function work(job) {
  const mine = running = { job, what: words(job), since: performance.now() };
  said = "";
  const number = (ended?.number ?? 0) + 1, tick = setInterval(() => tell({ kind: "job", job: progress() }), 250);
  tell({ kind: "job", job: progress() });
  let /** @type {Ended} */ end;
  try {
    const { message } = await backend.ask("/api/do", job);
    end = { job, message, help: "", is_error: false, number };
    await backend.keep();
  } catch (/** @type {any} */ error) {
    end = { job, message: error.message, help: error.help ?? "", is_error: !error.message.startsWith("cancelled"), number };
  }
  clearInterval(tick);
  if (running === mine) running = null;
  ended = end;
  tell({ kind: "job", job: null });
  tell({ kind: "state" });
  makeReady();
}

async function cancel() {
  if (!running) return {};
  await backend.cancel();
  return {};
}

/** Holds the model against one release after the other, that first which is looked at. */
async function makeReady() {
  if (isReadying) return;
  isReadying = true;
  try {
    for (let more = true; more && !running;) more = (await backend.ask("/api/ready", { wanted: wanted === null ? [] : [wanted] })).release !== null;
  } catch { /* The worker has ended: the next one is asked again. */ }
  isReadying = false;
}

/** Calls `heard` with each piece of news; `lost` once the page can be asked.
 * @param {(news: News) => void} heard @param {(is: boolean) => void} lost */
export async function listen(heard, lost) {
  tell = heard;
  backend.listen((text) => { said = text.replace(/^yawrig: (warning: )?/, "").split("\n")[0]; }, heard);
  await backend.begin();
  lost(false);
  makeReady();
}
