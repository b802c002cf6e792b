"""A board's image for those who have no tools for ELF: image.py IMAGE.ELF OUT.bin|OUT.uf2

.uf2 is for the own loader of Raspberry Pi's processors: the drive that a board is while BOOTSEL is held. Which it is for,
its family, shows in the image.
"""

import struct
import sys

# https://github.com/microsoft/uf2: blocks of 512 bytes; the family an RP2040, or an RP2350's secure Arm cores.
MAGICS, LAST_MAGIC, HAS_FAMILY, PAYLOAD = (0x0A324655, 0x9E5D5157), 0x0AB16F30, 0x2000, 256
RP2040, RP2350_ARM_S = 0xE48BFF56, 0xE48BFF59
# What an RP2350 looks for in the first 4 KiB (its datasheet, 5.9); an RP2040 for a second stage of its boot (2.8.1.3).
START_BLOCK, BOOT2_BYTES = struct.pack("<I", 0xFFFFDED3), 256


def segments(elf):
    """What is stored: address in flash and bytes, in that order."""
    if elf[:6] != b"\x7fELF\x01\x01":
        raise SystemExit("image.py: not a 32-bit little-endian ELF file")
    (at,) = struct.unpack_from("<I", elf, 28)
    size, count = struct.unpack_from("<HH", elf, 42)
    found = []
    for k in range(count):
        kind, offset, _, address, length = struct.unpack_from("<IIIII", elf, at + k * size)
        if kind == 1 and length:
            found.append((address, elf[offset : offset + length]))
    return sorted(found)


def flat(parts):
    """From the first byte to the last, erased flash between them."""
    start = parts[0][0]
    out = bytearray(b"\xff" * (parts[-1][0] + len(parts[-1][1]) - start))
    for address, data in parts:
        out[address - start : address - start + len(data)] = data
    return start, bytes(out)


def crc32(data):
    """Its polynomial forwards, from all ones, neither end inverted."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte << 24
        for _ in range(8):
            crc = crc << 1 & 0xFFFFFFFF ^ (0x04C11DB7 if crc >> 31 else 0)
    return crc


def family(data):
    if START_BLOCK in data[:4096]:
        return RP2350_ARM_S
    if crc32(data[: BOOT2_BYTES - 4]) == struct.unpack_from("<I", data, BOOT2_BYTES - 4)[0]:
        return RP2040
    raise SystemExit("image.py: neither an RP2040 nor an RP2350 would start this")


def uf2(start, data):
    assert start % PAYLOAD == 0, hex(start)
    count, chip = -(-len(data) // PAYLOAD), family(data)
    data = data.ljust(count * PAYLOAD, b"\xff")
    for k in range(count):
        piece = data[k * PAYLOAD : (k + 1) * PAYLOAD].ljust(476, b"\0")
        yield struct.pack("<8I", *MAGICS, HAS_FAMILY, start + k * PAYLOAD, PAYLOAD, k, count, chip) + piece
        yield struct.pack("<I", LAST_MAGIC)


def main():
    source, out = sys.argv[1:]
    start, data = flat(segments(open(source, "rb").read()))
    with open(out, "wb") as file:
        file.write(b"".join(uf2(start, data)) if out.endswith(".uf2") else data)


main()
