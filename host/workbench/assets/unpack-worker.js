// The worker that unpacks the module, so that the page goes on meanwhile.
import { unpacked } from "./unpack.js";

onmessage = ({ data }) => {
  const bytes = unpacked(new Uint8Array(data));
  postMessage(bytes, { transfer: [bytes.buffer] });
};
