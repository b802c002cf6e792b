//! ARM CMSDK APB UART, as on the MPS2 board, driven by polling.
//!
//! Interrupts never run a handler: they are enabled in the NVIC, masked by PRIMASK, and only wake
//! the core. Each direction holds one byte.

use core::ptr::{read_volatile, write_volatile};
use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;
use embedded_io::{Error, ErrorKind, ErrorType, Read, ReadReady, Write, WriteReady};

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

    /// From here on a byte received or sent wakes the core again. Look at [`ReadReady::read_ready`] after
    /// this and before sleeping: what came earlier does not wake it any more.
    pub fn arm(&mut self) {
        self.write_register(INTSTATUS, INTSTATUS_ALL);
        NVIC::unpend(self.receive);
        NVIC::unpend(self.transmit);
    }
}

/// A byte came before the one before it was taken.
#[derive(Clone, Copy, Debug)]
pub struct Overrun;

impl Error for Overrun {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl ErrorType for Uart {
    type Error = Overrun;
}

impl ReadReady for Uart {
    #[inline]
    fn read_ready(&mut self) -> Result<bool, Overrun> {
        Ok(self.read_register(STATE) & (STATE_RX_FULL | STATE_RX_OVERRUN) != 0)
    }
}

impl Read for Uart {
    #[inline]
    fn read(&mut self, room: &mut [u8]) -> Result<usize, Overrun> {
        if self.read_register(STATE) & STATE_RX_OVERRUN != 0 {
            self.write_register(STATE, STATE_RX_OVERRUN);
            return Err(Overrun);
        }
        let Some(first) = room.first_mut() else { return Ok(0) };
        while self.read_register(STATE) & STATE_RX_FULL == 0 {}
        *first = self.read_register(DATA) as u8;
        Ok(1)
    }
}

impl WriteReady for Uart {
    #[inline]
    fn write_ready(&mut self) -> Result<bool, Overrun> {
        Ok(self.read_register(STATE) & STATE_TX_FULL == 0)
    }
}

impl Write for Uart {
    #[inline]
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Overrun> {
        let Some(&byte) = bytes.first() else { return Ok(0) };
        while self.read_register(STATE) & STATE_TX_FULL != 0 {}
        self.write_register(DATA, u32::from(byte));
        Ok(1)
    }

    fn flush(&mut self) -> Result<(), Overrun> {
        while self.read_register(STATE) & STATE_TX_FULL != 0 {}
        Ok(())
    }
}
