// The port that a board is plugged into (Web Serial): opened once somebody has chosen it, read until it is closed or gone, and
// opened again where it comes back.

/** Speed of the link; boards that have their USB themselves take any. */
const BAUD = 115200, BUFFER = 65536;
/** How often, and at which interval in ms, a port that is there again is tried: it may not have settled. */
const TRIES = 20, BETWEEN_MS = 250;

/** @typedef {{ came: (bytes: Uint8Array<ArrayBuffer>) => void, gone: (why: string) => void, back: () => void }} Heard */
/** @type {WebSerial | undefined} */
const serial = /** @type {any} */ (navigator).serial;
let /** @type {WebPort | null} */ port = null, /** @type {WritableStreamDefaultWriter<Uint8Array> | null} */ writer = null, /** @type {ReadableStreamDefaultReader<Uint8Array<ArrayBuffer>> | null} */ reader = null;
let /** @type {Heard | null} */ heard = null, isGone = false;

/** Whether this browser lets a page have a port. */
export const isThere = () => !!serial;

/** What the port is called. @param {WebPort} of */
function called(of) {
  const { usbVendorId: vendor, usbProductId: product } = of.getInfo(), hex = (/** @type {number} */ id) => id.toString(16).padStart(4, "0");
  return vendor === undefined || product === undefined ? "the chosen port" : `USB ${hex(vendor)}:${hex(product)}`;
}

/** Has the user choose a port and opens it; what it is called, null where none was chosen.
 * @param {Heard} hears @returns {Promise<string | null>} */
export async function open(hears) {
  if (!serial) return null;
  let /** @type {WebPort} */ chosen;
  try { chosen = await serial.requestPort(); } catch (/** @type {any} */ error) {
    if (error.name === "NotFoundError") return null;
    throw Object.assign(new Error(`this page may not have a port: ${error.message}`), { help: "allow serial ports for this page in the browser's settings, and connect again" });
  }
  try { await chosen.open({ baudRate: BAUD, bufferSize: BUFFER }); } catch (/** @type {any} */ error) {
    throw Object.assign(new Error(`cannot open ${called(chosen)}: another program has it open, or you may not (${error.message})`),
      { help: "close the program or the tab that has it open (yawrig monitor, a terminal), see that you may use serial ports, and connect again" });
  }
  port = chosen;
  heard = hears;
  taken(chosen);
  return called(chosen);
}

/** @param {WebPort} from */
function taken(from) {
  isGone = false;
  writer = from.writable?.getWriter() ?? null;
  read(from);
}

/** @param {string} why */
function lost(why) {
  if (isGone || !port) return;
  isGone = true;
  heard?.gone(why);
}

/** @param {WebPort} from */
async function read(from) {
  let why = "the port was closed", isEnded = false;
  // After a byte that came garbled there is another stream.
  while (from.readable && port === from && !isEnded) {
    const mine = reader = from.readable.getReader();
    try {
      for (;;) {
        const { value, done } = await mine.read();
        if (done) { isEnded = true; break; }
        if (port === from) heard?.came(value);
      }
    } catch (/** @type {any} */ error) { why = error.message; }
    mine.releaseLock();
  }
  if (port === from) lost(why);
}

/** @param {Uint8Array} bytes */
export function write(bytes) {
  writer?.write(bytes).catch((error) => lost(error.message));
}

/** Lets go of what is left of an old stream. */
async function released() {
  const [was, from] = [writer, reader];
  writer = reader = null;
  try { await from?.cancel(); } catch { /* It has gone with its port. */ }
  try { was?.releaseLock(); } catch { /* As above. */ }
}

export async function close() {
  const was = port;
  port = null;
  await released();
  // One that is gone is closed.
  try { await was?.close(); } catch { /* As above. */ }
}

serial?.addEventListener("connect", async (event) => {
  const there = /** @type {WebPort} */ (event.target);
  if (!port || !isGone || called(there) !== called(port)) return;
  const was = port;
  await released();
  try { await was.close(); } catch { /* It was closed when it went. */ }
  for (let tried = 0; tried < TRIES && port === was; tried++) {
    try { await there.open({ baudRate: BAUD, bufferSize: BUFFER }); } catch {
      await new Promise((resolve) => setTimeout(resolve, BETWEEN_MS));
      continue;
    }
    if (port !== was) return void there.close();
    port = there;
    taken(there);
    heard?.back();
    return;
  }
});
