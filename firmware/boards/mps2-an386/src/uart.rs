//! ARM CMSDK APB UART, as on the MPS2 board, driven by polling.
//!
//! Interrupts never run a handler: they are enabled in the NVIC, masked by PRIMASK, and only wake
//! the core. Each direction holds one byte.

use core::ptr::{read_volatile, write_volatile};
use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;
use yawrig_firmware::serial::{Received, Receiver};

/// Register offsets in bytes.
const DATA: usize = 0x00;
const STATE: usize = 0x04;
const CTRL: usize = 0x08;
const INTSTATUS: usize = 0x0c;
const BAUDDIV: usize = 0x10;

const STATE_TX_FULL: u32 = 1 << 0;
const STATE_RX_FULL: u32 = 1 << 1;
const STATE_RX_OVERRUN: u32 = 1 << 3;
const CTRL_TX_ENABLE: u32 = 1 << 0;
const CTRL_RX_ENABLE: u32 = 1 << 1;
const CTRL_TX_INTERRUPT: u32 = 1 << 2;
const CTRL_RX_INTERRUPT: u32 = 1 << 3;
const INTSTATUS_ALL: u32 = 0xf;
/// 25 MHz / 217 is 115 200 baud; QEMU does not pace by it.
const DIVIDER: u32 = 217;

#[derive(Clone, Copy)]
struct Line(u16);

// SAFETY: the number is a line of this board's NVIC and never changes.
unsafe impl InterruptNumber for Line {
    fn number(self) -> u16 {
        self.0
    }
}

/// One of the board's UARTs.
pub struct Uart {
    base: usize,
    receive: Line,
    transmit: Line,
}

impl Uart {
    /// UART `n` of the board, ready in both directions.
    ///
    /// # Safety
    /// One owner for each `n`; `n` is 0, 1 or 2; interrupts are masked by PRIMASK and stay so, since
    /// there is no handler.
    pub unsafe fn new(n: usize) -> Self {
        let line = 2 * n as u16;
        let uart =
            Self { base: 0x4000_4000 + 0x1000 * n, receive: Line(line), transmit: Line(line + 1) };
        uart.write_register(BAUDDIV, DIVIDER);
        uart.write_register(
            CTRL,
            CTRL_TX_ENABLE | CTRL_RX_ENABLE | CTRL_TX_INTERRUPT | CTRL_RX_INTERRUPT,
        );
        // QEMU asks whether the UART can receive only when something wakes its main loop; a read does.
        uart.read_register(DATA);
        NVIC::unmask(uart.receive);
        NVIC::unmask(uart.transmit);
        uart
    }

    fn read_register(&self, offset: usize) -> u32 {
        // SAFETY: `base` is a UART of this board and every offset used is one of its registers.
        unsafe { read_volatile((self.base + offset) as *const u32) }
    }

    fn write_register(&self, offset: usize, value: u32) {
        // SAFETY: as above.
        unsafe { write_volatile((self.base + offset) as *mut u32, value) }
    }

    #[inline]
    pub fn can_write(&self) -> bool {
        self.read_register(STATE) & STATE_TX_FULL == 0
    }

    /// Sends a byte; only where [`Uart::can_write`].
    #[inline]
    pub fn write(&mut self, byte: u8) {
        self.write_register(DATA, u32::from(byte));
    }

    /// From here on a byte received or sent wakes the core again. Look at [`Receiver::state`] after this and
    /// before sleeping: what came earlier does not wake it any more.
    pub fn arm(&mut self) {
        self.write_register(INTSTATUS, INTSTATUS_ALL);
        NVIC::unpend(self.receive);
        NVIC::unpend(self.transmit);
    }
}

impl Receiver for Uart {
    #[inline]
    fn state(&self) -> Received {
        let state = self.read_register(STATE);
        Received { byte: state & STATE_RX_FULL != 0, overrun: state & STATE_RX_OVERRUN != 0 }
    }

    #[inline]
    fn take(&mut self) -> u8 {
        self.read_register(DATA) as u8
    }

    fn clear_overrun(&mut self) {
        self.write_register(STATE, STATE_RX_OVERRUN);
    }
}
