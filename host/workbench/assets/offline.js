// Keeps the page's own files in the browser: once it was opened, it opens without a network.
const FILES = ["FILES"], VERSION = "VERSION";
const begins = `yawrig ${registration.scope} `, kept = begins + VERSION;

addEventListener("install", (event) => {
  const asked = ["./", ...FILES].map((file) => new Request(file, { cache: "no-cache" }));
  event.waitUntil(caches.open(kept).then((files) => files.addAll(asked)).then(() => skipWaiting()));
});

addEventListener("activate", (event) => {
  const old = (names) => names.filter((name) => name.startsWith(begins) && name !== kept);
  event.waitUntil(caches.keys().then((names) => Promise.all(old(names).map((name) => caches.delete(name)))).then(() => clients.claim()));
});

addEventListener("fetch", (event) => {
  event.respondWith(caches.open(kept).then((files) => files.match(event.request)).then((file) => file ?? fetch(event.request)));
});
