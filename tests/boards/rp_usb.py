"""The USB controller of Raspberry Pi's processors as a device (RP2040 datasheet, 4.1; RP2350's, 12.7), and the host at the other end of the plug: it resets the bus, asks for
descriptors, configures the serial port and then carries bytes, in bulk packets of at most 64.

What the device does that its host or its controller would not take ends the run: a wrong data toggle, a buffer without its
length or without FULL, a controller that is not on, an address that is not its own, a request refused.
"""

import struct

# Offsets of registers.
ADDR_ENDP, MAIN_CTRL, SIE_CTRL, SIE_STATUS, BUFF_STATUS = 0x00, 0x40, 0x4C, 0x50, 0x58
EP_STALL_ARM, USB_MUXING, USB_PWR, INTR, INTE, INTS = 0x68, 0x74, 0x78, 0x8C, 0x90, 0x98
# SIE_STATUS; cleared by writing ones, but for the state of the line, which is J.
SETUP_REC, BUS_RESET, CONNECTED, LINE_J = 1 << 17, 1 << 19, 1 << 16, 1 << 2
# USB_MUXING: TO_DIGITAL_PAD, by which a program makes the line's state itself.
TO_PADS = 1 << 2
# INTR, INTE, INTS.
ON_BUFFER, ON_BUS_RESET, ON_SETUP = 1 << 4, 1 << 12, 1 << 16
# SIE_CTRL.
PULLUP_EN, EP0_INT_1BUF = 1 << 16, 1 << 29
# An endpoint's control: ENABLE, INTERRUPT_PER_BUFF, BUFFER_ADDRESS; type bulk.
ENABLE, PER_BUFFER, ADDRESS, BULK = 1 << 31, 1 << 29, 0xFFC0, 2
# A buffer's control, the lower half: buffer 0.
AVAILABLE, STALL, PID, FULL, LENGTH = 1 << 10, 1 << 11, 1 << 13, 1 << 15, 0x3FF
PACKET = 64
# Looks of the device within which it must have gone on.
PATIENCE = 10_000
DEVICE, CONFIGURATION, STRING = 1, 2, 3
SET_ADDRESS, GET_DESCRIPTOR, SET_CONFIGURATION, SET_LINE_CODING, SET_CONTROL_LINE_STATE = 5, 6, 9, 0x20, 0x22
IN, TO_INTERFACE = 0x80, 0x21


class Controller:
    """Its registers and its memory."""

    def __init__(self, control, has_e5):
        # RP2040-E5: on a busy bus it is connected after a reset of that once the program has made the line's state J.
        self.has_e5, self.has_seen_j = has_e5, not has_e5
        self.memory = bytearray(4096)
        self.registers = {MAIN_CTRL: control, SIE_CTRL: 0x8000, USB_MUXING: 1}

    def read(self, offset):
        if offset in (INTR, INTS):
            status = self.get(SIE_STATUS)
            raw = (ON_BUFFER * bool(self.get(BUFF_STATUS)) | ON_BUS_RESET * bool(status & BUS_RESET)
                   | ON_SETUP * bool(status & SETUP_REC))
            return raw if offset == INTR else raw & self.get(INTE)
        if offset == SIE_STATUS:
            return self.get(offset) | LINE_J | CONNECTED * self.has_seen_j
        return self.get(offset)

    def write(self, offset, value):
        if offset in (SIE_STATUS, BUFF_STATUS):
            value = self.get(offset) & ~value
        if offset == USB_MUXING and value & TO_PADS:
            self.has_seen_j = True
        self.registers[offset] = value

    def get(self, offset):
        return self.registers.get(offset, 0)

    def set(self, offset, bits):
        self.registers[offset] = self.get(offset) | bits

    def word(self, at, value=None):
        if value is not None:
            self.memory[at:at + 4] = value.to_bytes(4, "little")
        return int.from_bytes(self.memory[at:at + 4], "little")

    def is_connected(self):
        """Controller on as a device, its isolation taken away, muxed to its plug, a voltage seen or said to be, pulled up."""
        power = self.get(USB_PWR)
        return (self.get(MAIN_CTRL) & 7 == 1 and self.get(USB_MUXING) & 9 == 9 and power & 0xC == 0xC
                and bool(self.get(SIE_CTRL) & PULLUP_EN))

    def buffer(self, number, is_in):
        """Where an endpoint's buffer is; it is enabled, and each buffer is told."""
        if number == 0:
            assert self.get(SIE_CTRL) & EP0_INT_1BUF, "buffers of endpoint 0 are not told"
            return 0x100
        control = self.word(8 * number + (0 if is_in else 4))
        assert control & ENABLE and control & PER_BUFFER and control >> 26 & 3 == BULK, f"endpoint {number}: {control:#x}"
        return control & ADDRESS


class Host:
    def __init__(self, controller, bytes_out, bytes_in):
        self.controller, self.out, self.sent = controller, bytes_out, bytes_in
        self.descriptors, self.toggles, self.address, self.waited = {}, {}, 0, 0
        self.program, self.is_configured, self.was_busy = self.talk(), False, False

    def step(self):
        """The device looks: what the bus does by then. Whether that was anything."""
        if not self.controller.is_connected():
            return
        self.was_busy = True
        self.waited += 1
        assert self.waited < PATIENCE, "the device does not answer its host"
        next(self.program)

    def is_quiet(self):
        """It has nothing for the device, and the device had nothing for it at the last look."""
        return self.is_configured and not self.out and not self.was_busy

    # Transactions (12.7.3): None or False is the controller's NAK.

    def control_of(self, number, is_in):
        controller, at = self.controller, 0x80 + 8 * number + (0 if is_in else 4)
        assert controller.get(ADDR_ENDP) & 0x7F == self.address, "it listens to another address"
        control = controller.word(at)
        armed = number or controller.get(EP_STALL_ARM) & (1 if is_in else 2)
        assert not (control & STALL and armed), f"endpoint {number} stalls"
        return at, control, bool(control & AVAILABLE)

    def done(self, at, control, number, is_in):
        toggle = self.toggles.get((number, is_in), 0)
        assert bool(control & PID) == bool(toggle), f"endpoint {number}: the wrong toggle"
        self.toggles[number, is_in] = toggle ^ 1
        self.controller.set(BUFF_STATUS, 1 << 2 * number + (0 if is_in else 1))
        self.waited = 0

    def take(self, number):
        at, control, available = self.control_of(number, True)
        if not available:
            return None
        assert control & FULL and control & LENGTH <= PACKET, f"endpoint {number}: {control:#x} is not to be sent"
        buffer = self.controller.buffer(number, True)
        self.controller.word(at, control & ~(AVAILABLE | FULL))
        self.done(at, control, number, True)
        return bytes(self.controller.memory[buffer:buffer + (control & LENGTH)])

    def give(self, number, data):
        at, control, available = self.control_of(number, False)
        if not available:
            return False
        assert not control & FULL and control & LENGTH >= len(data), f"endpoint {number}: {control:#x} takes nothing"
        buffer = self.controller.buffer(number, False)
        self.controller.memory[buffer:buffer + len(data)] = data
        self.controller.word(at, control & ~(AVAILABLE | LENGTH) | FULL | len(data))
        self.done(at, control, number, False)
        return True

    # Transfers on endpoint 0: set-up, data, status (USB 2.0, 8.5.3).

    def taken(self):
        while (packet := self.take(0)) is None:
            yield
        return packet

    def given(self, data):
        while not self.give(0, data):
            yield

    def control(self, kind, request, value, index=0, data=b"", length=0):
        controller = self.controller
        controller.memory[:8] = struct.pack("<BBHHH", kind, request, value, index, length or len(data))
        controller.registers[EP_STALL_ARM] = 0
        controller.set(SIE_STATUS, SETUP_REC)
        self.toggles[0, True] = self.toggles[0, False] = 1
        while controller.get(SIE_STATUS) & SETUP_REC:
            yield
        answer = b""
        if kind & IN:
            while True:
                packet = yield from self.taken()
                answer += packet
                if len(packet) < PACKET or len(answer) >= length:
                    break
            self.toggles[0, False] = 1
            yield from self.given(b"")
        else:
            if data:
                yield from self.given(data)
            self.toggles[0, True] = 1
            status = yield from self.taken()
            assert status == b"", "a status with data"
        return answer

    def descriptor(self, kind, index, length, language=0):
        answer = yield from self.control(IN, GET_DESCRIPTOR, kind << 8 | index, language, length=length)
        assert answer[1] == kind, answer
        self.descriptors[kind, index] = answer
        return answer

    def reset_bus(self):
        self.address = 0
        self.toggles.clear()
        self.controller.set(SIE_STATUS, BUS_RESET)
        self.controller.has_seen_j = not self.controller.has_e5
        while self.controller.get(SIE_STATUS) & BUS_RESET or not self.controller.has_seen_j:
            yield

    def talk(self):
        """As a host's system does when a device is plugged in, then the bytes."""
        yield from self.reset_bus()
        yield from self.descriptor(DEVICE, 0, 64)
        yield from self.reset_bus()
        yield from self.control(0, SET_ADDRESS, 5)
        self.address = 5
        while self.controller.get(ADDR_ENDP) & 0x7F != self.address:
            yield
        device = yield from self.descriptor(DEVICE, 0, 18)
        head = yield from self.descriptor(CONFIGURATION, 0, 9)
        whole = yield from self.descriptor(CONFIGURATION, 0, struct.unpack_from("<H", head, 2)[0])
        language = struct.unpack_from("<H", (yield from self.descriptor(STRING, 0, 255)), 2)[0]
        for index in device[14:17]:
            yield from self.descriptor(STRING, index, 255, language)
        yield from self.control(0, SET_CONFIGURATION, head[5])
        # 115200 baud, 8 bits; DTR and RTS.
        yield from self.control(TO_INTERFACE, SET_LINE_CODING, 0, 0, struct.pack("<IBBB", 115_200, 0, 0, 8))
        yield from self.control(TO_INTERFACE, SET_CONTROL_LINE_STATE, 3)
        bulk = [end[2] for end in pieces(whole) if end[1] == 5 and end[3] & 3 == BULK]
        into, out_of = (next(e & 15 for e in bulk if bool(e & IN) == is_in) for is_in in (False, True))
        self.is_configured = True
        while True:
            packet = bytes(self.out[:PACKET])
            gave = bool(packet) and self.give(into, packet)
            if gave:
                del self.out[:PACKET]
            came = self.take(out_of)
            self.sent.extend(came or b"")
            self.was_busy = gave or came is not None
            if not self.out:
                self.waited = 0
            yield

    def string(self, index):
        """One of the device's: its maker 0, product 1, serial number 2."""
        text = self.descriptors.get((STRING, self.descriptors[DEVICE, 0][14 + index]))
        return text[2:].decode("utf-16-le") if text else "none"


def pieces(descriptor):
    while descriptor:
        yield descriptor[:descriptor[0]]
        descriptor = descriptor[descriptor[0]:]
