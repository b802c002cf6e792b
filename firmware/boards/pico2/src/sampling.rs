//! The potentiometer at ADC0 (GP26), at exactly 1 kHz: the converter begins by its own divider sixteen times a sample, DMA
//! writes its readings to a ring, and the timer, which has the same crystal, says how many there must be. The processor
//! may be away for a second before a sample is lost.

use crate::timing::{divider, readings, ENDLESS, FIRST_READING_US};
use core::ptr::{addr_of, addr_of_mut};
use embedded_storage::nor_flash::NorFlash;
use rp235x_hal::pac::{ADC, DMA};
use rp235x_hal::timer::{CopyableTimer0, Timer};
use yawrig_firmware::conversions::CONVERSIONS;
use yawrig_firmware::device::Device;
use yawrig_firmware::input::Input;
use yawrig_firmware::ring::Reader;
use yawrig_firmware::sensors::potentiometer::Potentiometer;

/// Readings kept: for longer than the flash takes to erase a network's place.
const RING: usize = 1024 * CONVERSIONS as usize;
/// DMA goes round where as many bits of its address as this come round.
const RING_BITS: u8 = 15;
#[repr(align(32768))]
struct Ring([u16; RING]);
const _: () = assert!(size_of::<Ring>() == 1 << RING_BITS && align_of::<Ring>() == 1 << RING_BITS);
static mut READINGS: Ring = Ring([0; RING]);

const CHANNEL: usize = 0;
/// ADC0, at GP26.
const INPUT: u8 = 0;

pub struct Sampling {
    adc: ADC,
    dma: DMA,
    timer: Timer<CopyableTimer0>,
    first_us: u64,
    reader: Reader<RING>,
    input: Input<Potentiometer<CONVERSIONS>>,
}

impl Sampling {
    /// Begins to sample. The converter is on and has `clock_hz`, DMA is out of reset, GP26 is an analogue input.
    pub fn begin(adc: ADC, dma: DMA, timer: Timer<CopyableTimer0>, clock_hz: u32) -> Self {
        let cycles = divider(clock_hz).expect("an exact rate");
        // SAFETY: any divider will do.
        adc.div().write(|w| unsafe { w.int().bits(cycles).frac().bits(0) });
        let mut sampling = Self {
            adc,
            dma,
            timer,
            first_us: 0,
            reader: Reader::new(),
            input: Input::new(Potentiometer),
        };
        sampling.start();
        sampling
    }

    /// Everything at its beginning: no conversion made, the ring's first place next.
    fn start(&mut self) {
        let channel = self.dma.ch(CHANNEL);
        self.adc.cs().modify(|_, w| w.start_many().clear_bit());
        while self.adc.cs().read().ready().bit_is_clear() {}
        channel.ch_ctrl_trig().modify(|_, w| w.en().clear_bit());
        // SAFETY: fields as they are named; the ring is a static that nothing else writes.
        unsafe {
            self.dma.chan_abort().write(|w| w.bits(1 << CHANNEL));
            while channel.ch_ctrl_trig().read().busy().bit_is_set() {}
            self.adc.fcs().write(|w| w.over().clear_bit_by_one().under().clear_bit_by_one());
            while self.adc.fcs().read().empty().bit_is_clear() {
                let _ = self.adc.fifo().read();
            }
            // Plain readings of 12 bits, DMA asked for each.
            self.adc.fcs().write(|w| w.en().set_bit().dreq_en().set_bit().thresh().bits(1));
            channel.ch_read_addr().write(|w| w.bits(self.adc.fifo().as_ptr() as u32));
            channel.ch_write_addr().write(|w| w.bits(addr_of_mut!(READINGS) as u32));
            channel.ch_trans_count().write(|w| w.bits(ENDLESS));
            channel.ch_ctrl_trig().write(|w| {
                w.data_size().size_halfword();
                w.incr_read().clear_bit().incr_write().set_bit();
                w.ring_sel().set_bit().ring_size().bits(RING_BITS);
                w.treq_sel().adc().chain_to().bits(CHANNEL as u8);
                w.irq_quiet().set_bit().high_priority().set_bit().en().set_bit()
            });
            self.adc.cs().write(|w| w.en().set_bit().ainsel().bits(INPUT).start_many().set_bit());
        }
        // A converter that does not begin is the watchdog's; the host is answered meanwhile.
        let begun_us = self.timer.get_counter().ticks();
        self.first_us = begun_us;
        while self.position() == 0 && self.first_us - begun_us < FIRST_READING_US {
            self.first_us = self.timer.get_counter().ticks();
        }
    }

    /// Where in the ring DMA writes next.
    fn position(&self) -> u32 {
        let at = self.dma.ch(CHANNEL).ch_write_addr().read().bits();
        at.wrapping_sub(addr_of!(READINGS) as u32) / 2 % RING as u32
    }

    /// Gives the device all that has come since the last call; whether a sample did.
    pub fn take(&mut self, device: &mut Device<impl NorFlash>) -> bool {
        // The time first: a reading that comes between the two is one of the next call.
        let triggers = readings(self.timer.get_counter().ticks() - self.first_us);
        let position = self.position();
        let over = self.adc.fcs().read().over().bit_is_set();
        let made = Reader::<RING>::made(triggers, position).filter(|_| !over);
        if made.is_none() {
            // A conversion without its reading: DMA was too late for it, or failed.
            self.start();
        }
        // SAFETY: in the ring, written by DMA only, and complete.
        let reading = |at: usize| unsafe { addr_of!(READINGS.0[at]).read_volatile() };
        self.reader.give(triggers, made, reading, &mut self.input, device)
    }
}
