// What the workbench's page says to its server, said to a worker: written as talk.js beside a page that has none.
import { ask, take } from "./backend.js";
export { GONE } from "./backend.js";
export * from "./elements.js";

/** @template {keyof Answers} P @param {P} path @param {Record<string, string | number | null>} query @returns {Promise<Answers[P]>} */
export async function get(path, query = {}) {
  try { return await ask(path, query); } catch (error) {
    // As the server answers it: what is wrong with a record is drawn in its place.
    if (error instanceof Error && (path === "/api/curves" || path === "/api/view")) return /** @type {any} */ ({ fault: { message: error.message, help: "help" in error ? error.help : "" } });
    throw error;
  }
}

/** @param {string} path @param {object} body @returns {Promise<any>} */
export const post = (path, body) => ask(path, body);

/** @param {string} _ @param {File} file @returns {Promise<Posts["/api/as_read"]["answer"]>} */
export const send = (_, file) => take(file);
