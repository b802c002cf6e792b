//! USART2, which the ST-Link makes a serial port of the computer: PA2 and PA3, 115 200 baud. DMA1 writes what
//! comes to a ring, also while the processor waits for the flash.

use core::ptr::{addr_of, addr_of_mut};
use embedded_io::{Error, ErrorKind, ErrorType, Read, ReadReady, Write, WriteReady};
use stm32f4xx_hal::gpio::{PA2, PA3};
use stm32f4xx_hal::pac::{DMA1, USART2};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};
use stm32f4xx_hal::serial::config::{Config, DmaConfig};
use stm32f4xx_hal::serial::Serial;
use yawrig_firmware::ring::Reader;

/// As the host opens the port.
const BAUD: u32 = 115_200;
/// 89 ms of an uninterrupted stream; a host that waits for its answer sends less.
const RING: usize = 1024;
static mut RECEIVED: [u8; RING] = [0; RING];

// Fields of registers, by the names and the tables of RM0390.
const SR_ORE: u16 = 1 << 3;
const SR_TXE: u16 = 1 << 7;
/// Stream 5 has come to the ring's end; the same bit clears it.
const DMA_HISR_COMPLETE_5: u32 = 1 << 11;
const DMA_CR_EN: u32 = 1;
const DMA_CR_CIRC: u32 = 1 << 8;
const DMA_CR_MINC: u32 = 1 << 10;
/// USART2's receiver is on stream 5, channel 4.
const STREAM: usize = 5;
const DMA_CR_CHANNEL_4: u32 = 4 << 25;

pub struct Link {
    usart: USART2,
    dma: DMA1,
    reader: Reader<RING>,
    lost: bool,
}

impl Link {
    pub fn begin(usart: USART2, pins: (PA2, PA3), dma: DMA1, rcc: &mut Rcc) -> Self {
        let config = Config::default().baudrate(BAUD.bps()).dma(DmaConfig::Rx);
        let serial: Serial<USART2> =
            Serial::new(usart, pins, config, rcc).expect("a baud rate it can make");
        let (usart, _pins) = serial.release();
        DMA1::enable(rcc);
        DMA1::reset(rcc);
        let stream = dma.st(STREAM);
        // SAFETY: fields as above; the ring is a static that nothing else writes.
        unsafe {
            stream.par().write(|w| w.bits(usart.dr().as_ptr() as u32));
            stream.m0ar().write(|w| w.bits(addr_of_mut!(RECEIVED) as u32));
            stream.ndtr().write(|w| w.bits(RING as u32));
            let how = DMA_CR_CHANNEL_4 | DMA_CR_CIRC | DMA_CR_MINC;
            stream.cr().write(|w| w.bits(how));
            stream.cr().write(|w| w.bits(how | DMA_CR_EN));
        }
        Self { usart, dma, reader: Reader::new(), lost: false }
    }

    /// The status register. Once it has been read, DMA's next read of the data clears the overrun in it
    /// (RM0390, 25.6.1), so whoever reads it keeps that.
    fn status(&mut self) -> u16 {
        let status = self.usart.sr().read().bits();
        if status & SR_ORE != 0 {
            self.lost = true;
            // Reading the data after the status clears it.
            let _ = self.usart.dr().read();
        }
        status
    }

    /// Whether a byte was lost since this was last asked: it came before DMA had taken the one before, or DMA
    /// has gone round the ring before it was read.
    fn overrun(&mut self) -> bool {
        self.status();
        let wrapped = self.dma.hisr().read().bits() & DMA_HISR_COMPLETE_5 != 0;
        let position = self.position();
        if wrapped || self.reader.is_behind(position) {
            // SAFETY: clears by writing ones.
            self.dma.hifcr().write(|w| unsafe { w.bits(DMA_HISR_COMPLETE_5) });
        }
        let overtaken = self.reader.overtaken(wrapped, position);
        core::mem::take(&mut self.lost) || overtaken
    }

    /// Where in the ring DMA writes next.
    fn position(&self) -> u32 {
        (RING as u32).wrapping_sub(self.dma.st(STREAM).ndtr().read().bits()) % RING as u32
    }
}

/// A byte was lost.
#[derive(Clone, Copy, Debug)]
pub struct Overrun;

impl Error for Overrun {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl ErrorType for Link {
    type Error = Overrun;
}

impl ReadReady for Link {
    fn read_ready(&mut self) -> Result<bool, Overrun> {
        if self.overrun() {
            return Err(Overrun);
        }
        Ok(self.reader.has_before(self.position()))
    }
}

impl Read for Link {
    /// The next byte that comes.
    fn read(&mut self, room: &mut [u8]) -> Result<usize, Overrun> {
        let Some(first) = room.first_mut() else { return Ok(0) };
        let at = loop {
            if let Some(at) = self.reader.next_before(self.position()) {
                break at;
            }
        };
        // SAFETY: in the ring, written by DMA only, and complete.
        *first = unsafe { addr_of!(RECEIVED[at]).read_volatile() };
        Ok(1)
    }
}

impl WriteReady for Link {
    fn write_ready(&mut self) -> Result<bool, Overrun> {
        Ok(self.status() & SR_TXE != 0)
    }
}

impl Write for Link {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Overrun> {
        let Some(&byte) = bytes.first() else { return Ok(0) };
        while self.status() & SR_TXE == 0 {}
        // SAFETY: any byte may be sent.
        self.usart.dr().write(|w| unsafe { w.bits(byte.into()) });
        Ok(1)
    }

    fn flush(&mut self) -> Result<(), Overrun> {
        while self.status() & SR_TXE == 0 {}
        Ok(())
    }
}
