//! The potentiometer at ADC0 (GP26), at exactly 1 kHz: the converter begins by its own divider sixteen times
//! a sample, DMA writes its readings to a ring, and the timer, which has the same crystal, says how many
//! there must be. The program sums them up whenever it comes by, and where it stays away an interrupt does,
//! but not while the flash is at work.

use super::hal::pac::{ADC, DMA};
use super::timing::{divider, readings, FIRST_READING_US};
use super::TIMER;
use core::cell::Cell;
use core::ptr::{addr_of, addr_of_mut};
use cortex_m::interrupt::{free, CriticalSection, Mutex};
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::SYST;
use cortex_m_rt::exception;
use embedded_storage::nor_flash::NorFlash;
use yawrig_firmware::conversions::CONVERSIONS;
use yawrig_firmware::device::Device;
use yawrig_firmware::input::Input;
use yawrig_firmware::ring::Reader;
use yawrig_firmware::sensors::potentiometer::Potentiometer;
use yawrig_firmware::sums::Sums;

/// Readings in the ring, a second of them: the flash is at work for 0.4 s at most, and then the interrupt
/// comes.
const RING: usize = 1024 * CONVERSIONS as usize;
const INTERRUPT_HZ: u32 = 10;
/// DMA goes round where as many bits of its address as this come round, and no further (RP2040 datasheet,
/// 2.5.7).
const RING_BITS: u8 = 15;
#[repr(align(32768))]
struct Ring([u16; RING]);
const _: () = assert!(size_of::<Ring>() == 1 << RING_BITS && align_of::<Ring>() == 1 << RING_BITS);
#[link_section = ".ring"]
static mut READINGS: Ring = Ring([0; RING]);

/// Samples kept, 2 bytes each: 4 s of them, twice as long as a refined estimate takes without a
/// floating-point unit.
const KEPT: usize = 4096;
static SUMS: Sums<RING, KEPT> = Sums::new();
/// When the first reading came.
static FIRST_US: Mutex<Cell<u64>> = Mutex::new(Cell::new(0));

/// Of DMA's channels one takes readings, as many as the ring has; with the last it starts the other one,
/// which starts it again, within less than a reading.
const CHANNEL: usize = 0;
const AGAIN: usize = 1;
/// In RAM: DMA reads it while the flash cannot be read, too.
#[link_section = ".data.TRANSFERS"]
static TRANSFERS: u32 = RING as u32;
/// ADC0, at GP26.
const INPUT: u8 = 0;

pub struct Sampling {
    adc: ADC,
    dma: DMA,
    reader: Reader<KEPT>,
    input: Input<Potentiometer<CONVERSIONS>>,
}

impl Sampling {
    /// Begins to sample. The converter is on and has `adc_hz`, DMA is out of reset, the timer runs, GP26 is
    /// an analogue input, the processor has `processor_hz`.
    pub fn begin(adc: ADC, dma: DMA, adc_hz: u32, mut timer: SYST, processor_hz: u32) -> Self {
        let cycles = divider(adc_hz).expect("an exact rate");
        // SAFETY: any divider will do.
        adc.div().write(|w| unsafe { w.int().bits(cycles).frac().bits(0) });
        let mut sampling =
            Self { adc, dma, reader: Reader::new(), input: Input::new(Potentiometer) };
        free(|cs| sampling.start(cs));
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(processor_hz / INTERRUPT_HZ - 1);
        timer.clear_current();
        timer.enable_interrupt();
        timer.enable_counter();
        sampling
    }

    /// Everything at its beginning: no conversion made, the ring's first place next. How many samples were
    /// lost by it.
    fn start(&mut self, cs: &CriticalSection) -> u32 {
        let lost = SUMS.begin_anew(triggers(cs));
        self.reader = Reader::new();
        let (channel, again) = (self.dma.ch(CHANNEL), self.dma.ch(AGAIN));
        self.adc.cs().modify(|_, w| w.start_many().clear_bit());
        while self.adc.cs().read().ready().bit_is_clear() {}
        // Both before either is aborted: one must not start the other.
        again.ch_al1_ctrl().modify(|_, w| w.en().clear_bit());
        channel.ch_al1_ctrl().modify(|_, w| w.en().clear_bit());
        // SAFETY: fields as they are named; the ring is a static that nothing else writes.
        unsafe {
            self.dma.chan_abort().write(|w| w.bits(1 << CHANNEL | 1 << AGAIN));
            while self.dma.chan_abort().read().bits() != 0 {}
            self.adc.fcs().write(|w| w.over().clear_bit_by_one().under().clear_bit_by_one());
            while self.adc.fcs().read().empty().bit_is_clear() {
                let _ = self.adc.fifo().read();
            }
            // Plain readings of 12 bits, DMA asked for each.
            self.adc.fcs().write(|w| w.en().set_bit().dreq_en().set_bit().thresh().bits(1));
            again.ch_read_addr().write(|w| w.bits(addr_of!(TRANSFERS) as u32));
            let count = channel.ch_al1_trans_count_trig().as_ptr();
            again.ch_write_addr().write(|w| w.bits(count as u32));
            again.ch_trans_count().write(|w| w.bits(1));
            again.ch_al1_ctrl().write(|w| {
                w.data_size().size_word();
                w.incr_read().clear_bit().incr_write().clear_bit();
                w.treq_sel().permanent().chain_to().bits(AGAIN as u8);
                w.irq_quiet().set_bit().high_priority().set_bit().en().set_bit()
            });
            channel.ch_read_addr().write(|w| w.bits(self.adc.fifo().as_ptr() as u32));
            channel.ch_write_addr().write(|w| w.bits(addr_of_mut!(READINGS) as u32));
            channel.ch_trans_count().write(|w| w.bits(RING as u32));
            channel.ch_ctrl_trig().write(|w| {
                w.data_size().size_halfword();
                w.incr_read().clear_bit().incr_write().set_bit();
                w.ring_sel().set_bit().ring_size().bits(RING_BITS);
                w.treq_sel().adc().chain_to().bits(AGAIN as u8);
                w.irq_quiet().set_bit().high_priority().set_bit().en().set_bit()
            });
            self.adc.cs().write(|w| w.en().set_bit().ainsel().bits(INPUT).start_many().set_bit());
        }
        // A converter that does not begin is the watchdog's; the host is answered meanwhile.
        let begun_us = now_us();
        let mut first_us = begun_us;
        while position() == 0 && first_us - begun_us < FIRST_READING_US {
            first_us = now_us();
        }
        FIRST_US.borrow(cs).set(first_us);
        lost
    }

    /// Gives the device the next sample; whether there was one. One at a time: each may bring a piece of a
    /// refined estimate with it, and USB waits for none but that.
    pub fn take(&mut self, device: &mut Device<impl NorFlash>) -> bool {
        free(collect);
        let came = SUMS.give_one(&mut self.reader, &mut self.input, device);
        if !came && SUMS.is_torn() {
            // A conversion without its reading: DMA was too late for it, or failed.
            device.lost(free(|cs| self.start(cs)));
        }
        came
    }
}

#[exception]
fn SysTick() {
    free(collect);
}

/// Sums up what has come.
fn collect(cs: &CriticalSection) {
    // The time first: a reading that comes between the two is one of the next call.
    let triggers = triggers(cs);
    let position = position();
    // SAFETY: a register that is only read; what is in the ring is written by DMA only, and complete.
    unsafe {
        if (*ADC::PTR).fcs().read().over().bit_is_set() {
            SUMS.tear();
        }
        SUMS.collect(triggers, position, |at| addr_of!(READINGS.0[at]).read_volatile());
    }
}

/// Conversions begun since the first.
fn triggers(cs: &CriticalSection) -> u32 {
    readings(now_us() - FIRST_US.borrow(cs).get())
}

/// Where in the ring DMA writes next.
fn position() -> u32 {
    // SAFETY: a register that is only read.
    let at = unsafe { (*DMA::PTR).ch(CHANNEL).ch_write_addr().read().bits() };
    at.wrapping_sub(addr_of!(READINGS) as u32) / 2 % RING as u32
}

/// The timer's time: its upper half is the same before and after the lower one.
fn now_us() -> u64 {
    // SAFETY: registers that are only read.
    let timer = unsafe { &*TIMER::PTR };
    let mut high = timer.timerawh().read().bits();
    loop {
        let low = timer.timerawl().read().bits();
        let after = timer.timerawh().read().bits();
        if after == high {
            return u64::from(high) << 32 | u64::from(low);
        }
        high = after;
    }
}
