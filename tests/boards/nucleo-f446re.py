"""An STM32F446RE that executes the unmodified image for ST's NUCLEO-F446RE: unicorn is its Cortex-M4F, the registers
that the image uses are modelled here from RM0390 (revision 6); its sections stand beside them.

    nucleo-f446re.py ELF

Commands: board.py, and

    misplace         SysTick's handler is one that lies in the flash: `ok`

An overrun of the converter: conversions go on and are not taken to memory until the program clears it. While a sector is
erased the program may touch no flash, else the processor would stand still until the end, SysTick with it.

What it says nothing of beside that: framing and noise on the line, protection of the flash.
"""

from collections import defaultdict

from board import CONVERSIONS, Board, Wrong
from systick import SYSTICK_VECTOR
from unicorn import (UC_ARCH_ARM, UC_ERR_FETCH_PROT, UC_ERR_READ_PROT, UC_HOOK_MEM_WRITE, UC_MODE_MCLASS, UC_MODE_THUMB,
                     UC_PROT_ALL, UC_PROT_NONE, Uc, UcError)
from unicorn.arm_const import UC_ARM_REG_PC, UC_CPU_ARM_CORTEX_M4

FLASH, FLASH_BYTES, SECTOR = 0x0800_0000, 512 * 1024, 16 * 1024
# 3.3, table 4: sectors 1 to 3 are 16 KiB, sector 4 is 64 KiB. What the device writes; the rest is the image's.
SECTORS = {1: (0, SECTOR), 2: (SECTOR, SECTOR), 3: (2 * SECTOR, SECTOR), 4: (3 * SECTOR, 4 * SECTOR)}
WRITABLE, WRITABLE_BYTES = FLASH + SECTOR, 7 * SECTOR
# The image's: the vector table, and code from sector 5 on.
IMAGE = ((FLASH, SECTOR), (FLASH + 8 * SECTOR, FLASH_BYTES - 8 * SECTOR))
# In this order the device has them.
PLACES = (1, 4, 2, 3)
RAM, RAM_BYTES = 0x2000_0000, 128 * 1024
PERIPHERALS, PERIPHERALS_BYTES, BIT_BAND = 0x4000_0000, 0x30000, 0x4200_0000
AIRCR, AIRCR_RESET = 0xE000_ED0C, 0x05FA_0004
# PM0214, 4.4: the table of vectors is aligned to its 128 words; 2.3.7: what an exception stacks where the FPU is in use.
TABLE_BYTES, FRAME_BYTES = 512, 26 * 4

# 2.2.2, register boundary addresses.
TIM2, TIM5, IWDG, USART2, PWR = 0x4000_0000, 0x4000_0C00, 0x4000_3000, 0x4000_4400, 0x4000_7000
ADC1, ADC_CCR, GPIOA, RCC, FLASH_IF = 0x4001_2000, 0x4001_2304, 0x4002_0000, 0x4002_3800, 0x4002_3C00
DMA1, DMA2 = 0x4002_6000, 0x4002_6400
RCC_CR, RCC_PLLCFGR, RCC_CFGR, RCC_CSR = RCC, RCC + 0x04, RCC + 0x08, RCC + 0x74
FLASH_ACR, FLASH_KEYR, FLASH_SR, FLASH_CR = FLASH_IF, FLASH_IF + 4, FLASH_IF + 0xC, FLASH_IF + 0x10
FLASH_OPTKEYR, FLASH_OPTCR = FLASH_IF + 8, FLASH_IF + 0x14
USART_SR, USART_DR, USART_BRR, USART_CR1, USART_CR3 = (USART2 + o for o in (0, 4, 8, 0xC, 0x14))
HSE_HZ, LSI_HZ = 8_000_000, 32_000

# 3.8.5: FLASH_CR and FLASH_SR.
PG, SER, PSIZE_WORD, STRT, LOCK = 1, 2, 0b10 << 8, 1 << 16, 1 << 31
BUSY, SEQUENCE_ERROR, PROTECTION_ERROR, EOP = 1 << 16, 1 << 7, 1 << 4, 1
# Looks at the status register within which a word is programmed; how long an erase takes at most (data sheet, table 47).
WORD_LOOKS, ERASE_MS = 2, {SECTOR: 500, 4 * SECTOR: 1100}
OVR = 1 << 5  # 13.13.1: ADC_SR
# Bytes of the line between two looks of the main loop at the potentiometer; loops after which nothing is left to say.
BYTES_A_LOOP, QUIET_LOOPS = 8, 400


class Stream:
    """One stream of a DMA controller, circular (9.3.8)."""

    def __init__(self, machine, base):
        self.machine, self.base, self.length = machine, base, 0

    def register(self, offset):
        return self.machine.registers[self.base + offset]

    def is_on(self, source, width):
        # 9.5.5: enabled, circular, memory incremented, peripheral to memory, both sides `width` bytes.
        control = self.register(0)
        sizes = control >> 11 & 3, control >> 13 & 3
        return (control & 1 and control >> 6 & 3 == 0 and control >> 8 & 1 and control >> 10 & 1
                and sizes == (width // 2, width // 2) and self.register(8) == source)

    def put(self, value, width):
        machine, left = self.machine, self.register(4)
        at = self.register(0xC) + (self.length - left) * width
        machine.uc.mem_write(at, value.to_bytes(width, "little"))
        machine.registers[self.base + 4] = left - 1 or self.length
        return left == 1


class Machine(Board):
    VECTORS, RAM, RAM_BYTES, FRAME_BYTES = FLASH, RAM, RAM_BYTES, FRAME_BYTES

    def __init__(self, elf):
        super().__init__(elf)
        for at, data in self.image:
            end = WRITABLE + WRITABLE_BYTES
            assert at + len(data) <= WRITABLE or at >= end, "code in a sector that is erased"
        self.options = 0x0FFF_AAED  # 3.8.6: as they come, the brown-out reset off
        self.sectors = bytearray(b"\xff" * WRITABLE_BYTES)
        self.power_on("power")

    def power_on(self, cause, ram=None):
        """`ram` is what a reset leaves; when power comes there is anything in it."""
        # 6.3.21: PORRSTF; IWDGRSTF, SFTRSTF, and PINRSTF with either.
        csr = {"power": 1 << 27, "watchdog": 1 << 29 | 1 << 26, "software": 1 << 28 | 1 << 26}[cause]
        self.uc = uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        uc.ctl_set_cpu_model(UC_CPU_ARM_CORTEX_M4)
        for begin, length in IMAGE:
            uc.mem_map(begin, length)
            uc.mem_write(begin, b"\xff" * length)
        self.map_device(WRITABLE, WRITABLE_BYTES, self.read_flash, self.write_flash)
        for at, data in self.image:
            uc.mem_write(at, data)
        uc.mem_map(RAM, RAM_BYTES)
        uc.mem_write(RAM, ram or b"\xa5" * RAM_BYTES)
        self.map_system()
        self.map_device(PERIPHERALS, PERIPHERALS_BYTES, self.read, self.write)
        self.map_device(BIT_BAND, PERIPHERALS_BYTES * 32, self.read_bit, self.write_bit)
        uc.hook_add(UC_HOOK_MEM_WRITE, self.system_control, begin=AIRCR, end=AIRCR + 3)
        self.registers = defaultdict(int)
        self.registers.update({RCC_CR: 0x83, RCC_PLLCFGR: 0x2400_3010, RCC_CSR: csr, FLASH_CR: LOCK,
                               IWDG + 8: 0xFFF, FLASH_OPTCR: self.options})
        self.adc, self.link = Stream(self, DMA2 + 0x10), Stream(self, DMA1 + 0x10 + 0x18 * 5)
        self.keys, self.busy, self.erasing, self.closed = [], 0, 0, False
        self.begun, self.fed_ms, self.transmitting = False, 0, 0
        self.begin()

    def map_device(self, begin, length, read, write):
        self.uc.mmio_map(begin, length, lambda uc, at, size, _: read(begin + at, size), None,
                         lambda uc, at, size, value, _: write(begin + at, size, value), None)

    # The flash (3.5): words are programmed where the interface is open for it, bits only cleared.

    def read_flash(self, at, size):
        if self.erasing:
            raise Wrong(f"the flash is read at {at:#x} while a sector is erased")
        offset = at - WRITABLE
        return int.from_bytes(self.sectors[offset:offset + size], "little")

    def write_flash(self, at, size, value):
        control = self.registers[FLASH_CR]
        if control & LOCK or not control & PG or control & 0x300 != PSIZE_WORD or size != 4 or at % 4 or self.busy:
            self.registers[FLASH_SR] |= SEQUENCE_ERROR
            return
        offset = at - WRITABLE
        old = int.from_bytes(self.sectors[offset:offset + 4], "little")
        self.sectors[offset:offset + 4] = (old & value).to_bytes(4, "little")
        self.busy = WORD_LOOKS

    def control_flash(self, value):
        if self.registers[FLASH_CR] & LOCK:
            self.registers[FLASH_SR] |= PROTECTION_ERROR
            return
        self.registers[FLASH_CR] = value & ~STRT
        if value & STRT and value & SER:
            number = value >> 3 & 0xF
            if number not in SECTORS:
                raise RuntimeError(f"the image erases sector {number}, which holds code")
            offset, length = SECTORS[number]
            self.sectors[offset:offset + length] = b"\xff" * length
            self.erasing = ERASE_MS[length]

    def flash_status(self):
        """A look at the status; while a sector is erased a millisecond goes by with each, and conversions go on (3.5)."""
        if self.erasing:
            self.erasing -= 1
            self.tick()
            return self.registers[FLASH_SR] | BUSY
        if self.busy:
            self.busy -= 1
            return self.registers[FLASH_SR] | BUSY
        return self.registers[FLASH_SR] | EOP

    # The processor. It is stopped at a read of a register where SysTick is due and where the flash, none of the program's
    # while a sector is erased, closes or opens; the read is done again after it.

    def stops_for_interrupt(self):
        if self.has_interrupt() or self.closed != bool(self.erasing):
            self.uc.emu_stop()
            return True
        return False

    def execute(self):
        self.finished = False
        while not (self.finished or self.reset_by):
            if self.closed != bool(self.erasing):
                self.closed = not self.closed
                for begin, length in IMAGE:
                    self.uc.mem_protect(begin, length, UC_PROT_NONE if self.closed else UC_PROT_ALL)
                self.uc.ctl_flush_tb()
            if self.has_interrupt():
                self.interrupt()
            self.go(0xFFFF_FFFF)
            self.pc = self.uc.reg_read(UC_ARM_REG_PC) | 1

    def go(self, until):
        try:
            self.uc.emu_start(self.pc, until)
        except UcError as error:
            at = self.uc.reg_read(UC_ARM_REG_PC)
            if error.errno in (UC_ERR_FETCH_PROT, UC_ERR_READ_PROT):
                raise Wrong(f"the flash is touched at {at:#x} while a sector is erased") from error
            raise RuntimeError(f"{error} at {at:#x}") from error

    def interrupt(self):
        table = self.vectors()
        assert table % TABLE_BYTES == 0, "the vectors are not aligned"
        if self.closed and table < RAM:
            raise Wrong("a vector is taken from the flash while a sector is erased")
        super().interrupt()

    def misplace(self):
        in_flash = bytes(self.uc.mem_read(FLASH + 4 * 14, 4))
        self.uc.mem_write(self.vectors() + 4 * SYSTICK_VECTOR, in_flash)

    # The peripherals.

    def read(self, at, size):
        if self.stops_for_interrupt():
            return 0
        word, shift = at & ~3, 8 * (at & 3)
        value = self.registers[word]
        if word == RCC_CR:  # 6.3.1: HSIRDY, HSERDY, PLLRDY follow their switches
            value |= (value & 0x0101_0001) << 1
        elif word == RCC_CFGR:  # 6.3.3: SWS follows SW
            value = value & ~0xC | (value & 3) << 2
        elif word == PWR + 4:  # 5.4.2: VOSRDY, ODRDY, ODSWRDY
            value |= 1 << 14 | 1 << 16 | 1 << 17
        elif word == FLASH_SR:
            value = self.flash_status()
        elif word == IWDG + 0xC:  # 22.4.4: nothing is being taken over
            value = 0
        elif word == USART_SR:  # 25.6.1: TXE and TC
            value = 0 if self.transmitting else 0xC0
            self.transmitting = max(self.transmitting - 1, 0)
        elif word == TIM5 + 0x24:
            if not self.handling:
                self.look()
            value = self.registers[word]
        return value >> shift & (1 << 8 * size) - 1

    def write(self, at, size, value):
        word, shift = at & ~3, 8 * (at & 3)
        mask = (1 << 8 * size) - 1 << shift
        value = self.registers[word] & ~mask | value << shift & mask
        if word == FLASH_KEYR:  # 3.5.1
            self.keys = (self.keys + [value])[-2:]
            if self.keys == [0x4567_0123, 0xCDEF_89AB]:
                self.registers[FLASH_CR] &= ~LOCK
        elif word == FLASH_CR:
            if value & LOCK:
                self.registers[FLASH_CR] |= LOCK
                self.keys = []
            else:
                self.control_flash(value)
        elif word == FLASH_OPTKEYR:  # 3.6.2
            self.keys = (self.keys + [value])[-2:]
            if self.keys == [0x0819_2A3B, 0x4C5D_6E7F]:
                self.registers[FLASH_OPTCR] &= ~1
        elif word == FLASH_OPTCR:
            if self.registers[FLASH_OPTCR] & 1:
                self.registers[FLASH_SR] |= PROTECTION_ERROR
            else:
                self.registers[FLASH_OPTCR] = value & ~2
                if value & 2:  # OPTSTRT
                    self.options, self.busy = value & ~2 | 1, WORD_LOOKS
        elif word == FLASH_SR:
            self.registers[word] &= ~value
        elif word == USART_DR:
            assert self.registers[USART_CR1] & 0x2008 == 0x2008, "sent by a USART that is not on"
            self.sent.append(value & 0xFF)
            self.transmitting, self.quiet = 1, 0
        elif word == IWDG:  # 22.4.1
            if value == 0xCCCC:
                self.begun, self.fed_ms = True, self.now_ms
            elif value == 0xAAAA:
                self.fed_ms = self.now_ms
        elif word in (DMA1 + 8, DMA1 + 0xC, DMA2 + 8, DMA2 + 0xC):  # 9.5.3: clears flags
            self.registers[word - 8] &= ~value
        else:
            self.registers[word] = value
        for stream in (self.adc, self.link):
            if word == stream.base + 4:
                stream.length = value

    def bit(self, at):
        at = PERIPHERALS + (at - BIT_BAND >> 5), (at - BIT_BAND & 31) >> 2
        return at[0] & ~3, at[1] + 8 * (at[0] & 3)

    def read_bit(self, at, _size):
        word, bit = self.bit(at)
        return self.read(word, 4) >> bit & 1

    def write_bit(self, at, _size, value):
        word, bit = self.bit(at)
        self.write(word, 4, self.registers[word] & ~(1 << bit) | (value & 1) << bit)

    def system_control(self, _uc, _access, _at, _size, value, _data):
        if value == AIRCR_RESET:
            self.restart("software")

    # Time: a millisecond with each sixteen conversions.

    def processor_hz(self):
        """The PLL from HSE (6.2)."""
        pll, cfgr = self.registers[RCC_PLLCFGR], self.registers[RCC_CFGR]
        assert cfgr & 3 == 2 and pll >> 22 & 1 and self.registers[RCC_CR] & 1 << 18, "not on HSE in bypass and the PLL"
        return HSE_HZ // (pll & 0x3F) * (pll >> 6 & 0x1FF) // (2 * (pll >> 16 & 3) + 2)

    def timer_hz(self):
        """How often TIM2 comes round (6.2, 17.4): APB1's timers have twice its clock where that is divided."""
        system, cfgr = self.processor_hz(), self.registers[RCC_CFGR]
        divided = {4: 2, 5: 4, 6: 8, 7: 16}.get(cfgr >> 10 & 7, 1)
        self.apb1_hz = system // divided
        timer = self.apb1_hz * (2 if divided > 1 else 1)
        return timer / ((self.registers[TIM2 + 0x28] & 0xFFFF) + 1) / (self.registers[TIM2 + 0x2C] + 1)

    def converts(self):
        """Whether a trigger of TIM2 makes a conversion that DMA2 takes to memory, and TIM5 counts it."""
        tim2 = self.registers[TIM2] & 1 and self.registers[TIM2 + 4] >> 4 & 7 == 0b010  # 17.4.2: MMS is update
        tim5 = self.registers[TIM5] & 1 and self.registers[TIM5 + 8] & 0x77 == 0b111  # 17.4.3: ITR0, external clock 1
        # 13.13.3: on, DMA with each, rising edge of TIM2's TRGO.
        control = self.registers[ADC1 + 8]
        adc = control & 1 and control >> 8 & 3 == 3 and control >> 24 & 0xF == 0b0110 and control >> 28 & 3 == 1
        analogue = self.registers[GPIOA] & 3 == 3
        return tim2 and tim5 and adc and analogue and self.adc.is_on(ADC1 + 0x4C, 2)

    def tick(self):
        """A millisecond goes by."""
        if self.stall_ms:
            self.stall_ms -= 1
        elif self.wanted and self.converts():
            for reading in self.wanted[:CONVERSIONS]:
                self.registers[TIM5 + 0x24] += 1
                # 13.8.1: after an overrun DMA is not asked any more.
                if not self.registers[ADC1] & OVR:
                    self.adc.put(reading, 2)
            del self.wanted[:CONVERSIONS]
        else:
            return
        self.now_ms += 1
        self.quiet = 0
        self.time_is(self.now_ms, 1000)
        # 22.3: the prescaler is 4 times two to the PR.
        after_ms = 1000 * (4 << self.registers[IWDG + 4]) * (self.registers[IWDG + 8] + 1) / LSI_HZ
        if self.begun and self.now_ms - self.fed_ms > after_ms:
            self.restart("watchdog")

    def look(self):
        """The main loop looks at the potentiometer: bytes of the line come, or else time goes by."""
        # 25.6.6: DMAR, 9.3.3: USART2's receiver is stream 5, channel 4 of DMA1.
        if self.bytes:
            assert self.registers[USART_CR3] & 1 << 6 and self.registers[self.link.base] >> 25 & 7 == 4
            assert self.link.is_on(USART_DR, 1), "DMA does not take the line's bytes"
            for byte in self.bytes[:BYTES_A_LOOP]:
                if self.link.put(byte, 1):
                    self.registers[DMA1 + 4] |= 1 << 11  # 9.5.2: TCIF5
            del self.bytes[:BYTES_A_LOOP]
            self.quiet = 0
        elif not self.transmitting_backlog():
            self.tick()
        self.quiet += 1
        if self.quiet > QUIET_LOOPS and not (self.wanted or self.stall_ms):
            self.finished = True
            self.uc.emu_stop()

    def transmitting_backlog(self):
        # What the device has to say goes out before the next millisecond: at 115 200 baud it would not all.
        return self.sent and self.quiet < 2

    def overrun(self):
        self.registers[ADC1] |= OVR

    def flash(self):
        places = (SECTORS[number][0] for number in PLACES)
        return "flash " + b"".join(bytes(self.sectors[begin:begin + SECTOR]) for begin in places).hex()

    def ram(self):
        """Bytes that have been used of it: of the stack, below the variables, down to what is as power has left it."""
        below = bytes(self.uc.mem_read(RAM, self.symbols["_stack_start"] - RAM))
        return len(below.lstrip(b"\xa5")) + self.symbols["__sheap"] - self.symbols["_stack_start"]

    COMMANDS = Board.COMMANDS + ("misplace",)

    def state(self):
        rate_hz = self.timer_hz()
        baud = self.apb1_hz / self.registers[USART_BRR]
        lit = self.registers[GPIOA + 0x18]
        return f"state rate_hz={rate_hz} baud={baud:.0f} bsrr={lit} now_ms={self.now_ms} latency={self.registers[FLASH_ACR] & 15} options={self.options:#x} ram={self.ram()}"


if __name__ == "__main__":
    Machine.main()
