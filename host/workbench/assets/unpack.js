// Unpacks the module, which no server has to compress then: LZMA, as in its specification (7-zip.org/sdk.html), a file
// of which the length of what is in it stands in the header.

const STATES = 12, POSITIONS = 16;
// Where each kind of probability begins.
const MATCH = 0, REPEAT = MATCH + STATES * POSITIONS, FIRST = REPEAT + STATES, SECOND = FIRST + STATES, THIRD = SECOND + STATES, LONG = THIRD + STATES,
  SLOT = LONG + STATES * POSITIONS, DISTANCE = SLOT + 4 * 64, ALIGN = DISTANCE + 128, LENGTH = ALIGN + 16, LENGTH_AGAIN = LENGTH + 514, LITERAL = LENGTH_AGAIN + 514;

/** @param {Uint8Array} packed */
export function unpacked(packed) {
  const of = packed[0], lc = of % 9, lp = Math.floor(of / 9) % 5, pb = Math.floor(of / 45);
  const view = new DataView(packed.buffer, packed.byteOffset), size = view.getUint32(5, true);
  const out = new Uint8Array(size), probabilities = new Uint16Array(LITERAL + (0x300 << (lc + lp))).fill(1024);
  let at = 18, range = 0xffffffff, code = view.getUint32(14);
  const next = () => {
    if (range < 0x1000000) {
      range = (range << 8) >>> 0;
      code = ((code << 8) | packed[at++]) >>> 0;
    }
  };
  const bit = (/** @type {number} */ which) => {
    const p = probabilities[which], bound = (range >>> 11) * p;
    if (code < bound) {
      range = bound;
      probabilities[which] = p + ((2048 - p) >> 5);
      next();
      return 0;
    }
    range -= bound;
    code -= bound;
    probabilities[which] = p - (p >> 5);
    next();
    return 1;
  };
  const bits = (/** @type {number} */ from, /** @type {number} */ count) => {
    let m = 1;
    for (let k = 0; k < count; k++) m = (m << 1) | bit(from + m);
    return m - (1 << count);
  };
  const bitsReversed = (/** @type {number} */ from, /** @type {number} */ count) => {
    let m = 1, value = 0;
    for (let k = 0; k < count; k++) {
      const b = bit(from + m);
      m = (m << 1) | b;
      value |= b << k;
    }
    return value;
  };
  const evenly = (/** @type {number} */ count) => {
    let value = 0;
    for (; count > 0; count--) {
      range >>>= 1;
      const b = code >= range ? 1 : 0;
      if (b) code -= range;
      next();
      value = value * 2 + b;
    }
    return value;
  };
  const length = (/** @type {number} */ from, /** @type {number} */ position) => {
    if (!bit(from)) return 2 + bits(from + 2 + position * 8, 3);
    if (!bit(from + 1)) return 10 + bits(from + 130 + position * 8, 3);
    return 18 + bits(from + 258, 8);
  };
  const distance = (/** @type {number} */ long) => {
    const slot = bits(SLOT + Math.min(long - 2, 3) * 64, 6);
    if (slot < 4) return slot;
    const count = (slot >> 1) - 1, base = (2 | (slot & 1)) * 2 ** count;
    return slot < 14 ? base + bitsReversed(DISTANCE + base - slot, count) : base + evenly(count - 4) * 16 + bitsReversed(ALIGN, 4);
  };
  let n = 0, state = 0, d0 = 0, d1 = 0, d2 = 0, d3 = 0;
  while (n < size) {
    const position = n & ((1 << pb) - 1);
    if (!bit(MATCH + state * POSITIONS + position)) {
      const before = n ? out[n - 1] : 0, from = LITERAL + 0x300 * (((n & ((1 << lp) - 1)) << lc) + (before >> (8 - lc)));
      let symbol = 1;
      if (state >= 7) {
        let like = out[n - d0 - 1];
        do {
          const expected = (like >> 7) & 1, b = bit(from + ((1 + expected) << 8) + symbol);
          like <<= 1;
          symbol = (symbol << 1) | b;
          if (expected !== b) break;
        } while (symbol < 0x100);
      }
      while (symbol < 0x100) symbol = (symbol << 1) | bit(from + symbol);
      out[n++] = symbol;
      state = state < 4 ? 0 : state < 10 ? state - 3 : state - 6;
      continue;
    }
    let count = 1;
    if (!bit(REPEAT + state)) {
      [d3, d2, d1] = [d2, d1, d0];
      count = length(LENGTH, position);
      d0 = distance(count);
      state = state < 7 ? 7 : 10;
    } else {
      let is_long = true;
      if (!bit(FIRST + state)) is_long = bit(LONG + state * POSITIONS + position) === 1;
      else if (!bit(SECOND + state)) [d1, d0] = [d0, d1];
      else if (!bit(THIRD + state)) [d2, d1, d0] = [d1, d0, d2];
      else [d3, d2, d1, d0] = [d2, d1, d0, d3];
      if (is_long) count = length(LENGTH_AGAIN, position);
      state = state < 7 ? (is_long ? 8 : 9) : 11;
    }
    if (d0 >= n) throw new Error("the module is damaged");
    for (let k = Math.min(count, size - n); k > 0; k--, n++) out[n] = out[n - d0 - 1];
  }
  return out;
}
