"""What executes an unmodified image, whichever board it is for: a processor of unicorn's, and commands on stdin, one a line,
each answered by one line on stdout:

    line HEX         bytes that the host sends; taken up before the readings that are given later
    samples HEX      readings of the converter, 12 bits, four digits each, sixteen a millisecond
    run              until all that was given is taken and nothing is left to be sent:
                     `sent HEX`, and ` reset watchdog|software|power` where the device has restarted
    fault            the processor refuses its next instruction; answered as `run`
    panic            power comes, and what there is only one of has been taken already; answered as `run`
    overrun          the converter is, as its board has it: `ok`
    stall MS         so many milliseconds without a conversion; answered as `run`
    reset            power off and on, the flash kept: `ok`
    flash            `flash HEX`: the 64 KiB in which networks and lock are kept
    state            `state KEY=VALUE ...`: what the registers say

Where the image does what it may not the answer is `wrong: WHAT`, and the machine is of no more use. A board adds its own.
What none says anything of: how long the image takes (time passes where the program looks for it), the analogue side, an
oscillator that fails, interrupts but those that the board says it has and faults, the debug unit.
"""

import struct
import sys

from elftools.elf.elffile import ELFFile
from systick import SysTick
from unicorn.arm_const import UC_ARM_REG_LR, UC_ARM_REG_SP

CONVERSIONS = 16


class Wrong(Exception):
    """What the image does and may not."""


class Board(SysTick):
    """A board has `power_on(cause, ram)`, which makes `uc`, and `go(until)`, `execute()`, `state()`, `flash()`; its vectors are
    at `VECTORS`."""

    def __init__(self, elf):
        self.image = []
        with open(elf, "rb") as file:
            elf_file = ELFFile(file)
            for segment in elf_file.iter_segments():
                if segment["p_type"] == "PT_LOAD" and segment["p_filesz"]:
                    self.image.append((segment["p_paddr"], segment.data()))
            symbols = elf_file.get_section_by_name(".symtab").iter_symbols()
            self.symbols = {symbol.name: symbol["st_value"] for symbol in symbols}

    def begin(self):
        """The processor at its reset vector, and nothing given."""
        stack, entry = struct.unpack("<2I", bytes(self.uc.mem_read(self.VECTORS, 8)))
        self.uc.reg_write(UC_ARM_REG_SP, stack)
        self.pc = entry | 1
        self.wanted, self.bytes, self.sent = [], bytearray(), bytearray()
        self.now_ms, self.stall_ms, self.quiet, self.reset_by = 0, 0, 0, None

    def run(self):
        self.quiet, self.sent, self.reset_by = 0, bytearray(), None
        self.execute()
        answer = f"sent {self.sent.hex()}"
        if self.reset_by:
            answer += f" reset {self.reset_by}"
            ram = None if self.reset_by == "power" else bytes(self.uc.mem_read(self.RAM, self.RAM_BYTES))
            self.power_on(self.reset_by, ram)
        return answer

    def restart(self, cause):
        self.reset_by = cause
        self.uc.emu_stop()

    def fault(self):
        """A hard fault where the program stands: the frame of the architecture, then the handler of vector 3."""
        uc, stack = self.uc, self.uc.reg_read(UC_ARM_REG_SP) - 32 & ~7
        uc.mem_write(stack, struct.pack("<8I", 0, 0, 0, 0, 0, 0xFFFF_FFFF, self.pc & ~1, 0x0100_0000))
        uc.reg_write(UC_ARM_REG_SP, stack)
        uc.reg_write(UC_ARM_REG_LR, 0xFFFF_FFF9)
        self.pc = struct.unpack("<I", bytes(uc.mem_read(self.VECTORS + 12, 4)))[0]
        return self.run()

    def panic(self):
        """Power comes, and at the program's first instruction its peripherals are taken already: its own panic."""
        self.power_on("power")
        self.go(self.symbols["main"] & ~1)
        self.uc.mem_write(self.symbols["DEVICE_PERIPHERALS"], b"\1")
        self.pc = self.symbols["main"] | 1
        return self.run()

    def line(self, text):
        self.bytes += bytes.fromhex(text)

    def samples(self, text):
        self.wanted += [int(text[k:k + 4], 16) for k in range(0, len(text), 4)]

    def stall(self, text):
        self.stall_ms = int(text)
        return self.run()

    def reset(self):
        self.power_on("power")

    COMMANDS = ("line", "samples", "run", "fault", "panic", "overrun", "stall", "reset", "flash", "state")

    def obey(self, command):
        verb, *rest = command.split()
        if verb not in self.COMMANDS:
            return f"what is {verb}?"
        try:
            return getattr(self, verb)(*rest) or "ok"
        except Wrong as wrong:
            return f"wrong: {wrong}"

    @classmethod
    def main(cls):
        board = cls(sys.argv[1])
        for command in sys.stdin:
            print(board.obey(command), flush=True)
