//! The potentiometer at A0 (PA0), at exactly 1 kHz: TIM2 triggers ADC1 sixteen times a sample, DMA2 writes
//! its readings to a ring, TIM5 counts the triggers. The program sums them up whenever it comes by, and where
//! it stays away an interrupt, which is in RAM and so does it even while a sector of the flash is erased.

use core::ptr::{addr_of, addr_of_mut};
use cortex_m::interrupt::free;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{SCB, SYST};
use cortex_m_rt::exception;
use embedded_storage::nor_flash::NorFlash;
use stm32f4xx_hal::pac::{ADC1, ADC_COMMON, DMA2, TIM2, TIM5};
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};
use yawrig_firmware::conversions::{period, CONVERSIONS};
use yawrig_firmware::device::Device;
use yawrig_firmware::input::Input;
use yawrig_firmware::ring::Reader;
use yawrig_firmware::sensors::potentiometer::Potentiometer;
use yawrig_firmware::sums::Sums;

/// Readings in the ring, 16 ms of them; the interrupt comes after half.
const RING: usize = 16 * CONVERSIONS as usize;
const INTERRUPT_HZ: u32 = 125;
static mut READINGS: [u16; RING] = [0; RING];
/// Samples kept, 1016 ms of them: twice the longest that a sector of 16 KiB takes to erase. Of the larger
/// one's 1.1 s at most the first tenth may be lost, which is counted.
const KEPT: usize = 1024;
static SUMS: Sums<RING, KEPT> = Sums::new();

/// The processor's own exceptions; those of peripherals are not used.
const VECTORS: usize = 16;
#[link_section = ".vectors"]
static mut IN_RAM: [u32; VECTORS] = [0; VECTORS];

// Fields of registers, by the names and the tables of RM0390.
const TIM_CR1_CEN: u32 = 1;
const TIM_EGR_UG: u32 = 1;
const TIM_CR2_MMS_UPDATE: u32 = 0b010 << 4;
const TIM_SMCR_EXTERNAL_CLOCK: u32 = 0b111;
/// TIM5's internal trigger 0 is TIM2.
const TIM_SMCR_ITR0: u32 = 0b000 << 4;
const ADC_CCR_DIVIDE_BY_4: u32 = 0b01 << 16;
/// 480 cycles of 21 MHz, 23 us of the 62.5 us between conversions: a source of up to 50 kOhm charges the
/// converter's capacitor.
const ADC_SMPR2_SLOWEST_0: u32 = 0b111;
const ADC_CR2_ADON: u32 = 1;
const ADC_CR2_DMA: u32 = 1 << 8;
const ADC_CR2_DDS: u32 = 1 << 9;
const ADC_CR2_EXTSEL_TIM2: u32 = 0b0110 << 24;
const ADC_CR2_EXTEN_RISING: u32 = 0b01 << 28;
const DMA_CR_EN: u32 = 1;
const DMA_CR_CIRC: u32 = 1 << 8;
const DMA_CR_MINC: u32 = 1 << 10;
const DMA_CR_HALF_WORDS: u32 = 0b01 << 11 | 0b01 << 13;
/// ADC1 is on stream 0, channel 0.
const STREAM: usize = 0;
const DMA_LIFCR_STREAM_0: u32 = 0b11_1101;

pub struct Sampling {
    adc: ADC1,
    dma: DMA2,
    pace: TIM2,
    count: TIM5,
    reader: Reader<KEPT>,
    input: Input<Potentiometer<CONVERSIONS>>,
}

impl Sampling {
    /// Begins to sample. PA0 is an analogue input already.
    pub fn begin(
        adc: ADC1,
        common: ADC_COMMON,
        dma: DMA2,
        pace: TIM2,
        count: TIM5,
        core: cortex_m::Peripherals,
        rcc: &mut Rcc,
    ) -> Self {
        ADC1::enable(rcc);
        ADC1::reset(rcc);
        DMA2::enable(rcc);
        DMA2::reset(rcc);
        TIM2::enable(rcc);
        TIM2::reset(rcc);
        TIM5::enable(rcc);
        TIM5::reset(rcc);
        let period = period(rcc.clocks.timclk1().raw()).expect("an exact rate");
        // SAFETY: fields as above, in the registers they are for.
        unsafe {
            common.ccr().write(|w| w.bits(ADC_CCR_DIVIDE_BY_4));
            adc.smpr2().write(|w| w.bits(ADC_SMPR2_SLOWEST_0));
            pace.psc().write(|w| w.bits(0));
            pace.arr().write(|w| w.bits(period));
            // Takes both over, before updates are triggers.
            pace.egr().write(|w| w.bits(TIM_EGR_UG));
            pace.cr2().write(|w| w.bits(TIM_CR2_MMS_UPDATE));
            count.smcr().write(|w| w.bits(TIM_SMCR_EXTERNAL_CLOCK | TIM_SMCR_ITR0));
            count.cr1().write(|w| w.bits(TIM_CR1_CEN));
        }
        let mut sampling =
            Self { adc, dma, pace, count, reader: Reader::new(), input: Input::new(Potentiometer) };
        sampling.start();
        interrupt(core.SCB, core.SYST, rcc.clocks.hclk().raw());
        sampling
    }

    /// Everything at its beginning: no trigger counted, the ring's first place next. How many samples were
    /// lost by it.
    fn start(&mut self) -> u32 {
        let stream = self.dma.st(STREAM);
        // SAFETY: fields as above; the ring is a static that nothing else writes.
        unsafe {
            self.pace.cr1().write(|w| w.bits(0));
            self.adc.cr2().write(|w| w.bits(0));
            stream.cr().write(|w| w.bits(0));
            while stream.cr().read().bits() & DMA_CR_EN != 0 {}
            let triggers = self.count.cnt().read().bits();
            self.dma.lifcr().write(|w| w.bits(DMA_LIFCR_STREAM_0));
            self.adc.sr().write(|w| w.bits(0));
            self.count.cnt().write(|w| w.bits(0));
            self.pace.cnt().write(|w| w.bits(0));
            stream.par().write(|w| w.bits(self.adc.dr().as_ptr() as u32));
            stream.m0ar().write(|w| w.bits(addr_of_mut!(READINGS) as u32));
            stream.ndtr().write(|w| w.bits(RING as u32));
            let how = DMA_CR_CIRC | DMA_CR_MINC | DMA_CR_HALF_WORDS;
            stream.cr().write(|w| w.bits(how));
            stream.cr().write(|w| w.bits(how | DMA_CR_EN));
            let when = ADC_CR2_EXTSEL_TIM2 | ADC_CR2_EXTEN_RISING;
            let how = ADC_CR2_ADON | ADC_CR2_DMA | ADC_CR2_DDS;
            self.adc.cr2().write(|w| w.bits(how));
            self.adc.cr2().write(|w| w.bits(how | when));
            self.reader = Reader::new();
            let lost = SUMS.begin_anew(triggers);
            self.pace.cr1().write(|w| w.bits(TIM_CR1_CEN));
            lost
        }
    }

    /// Gives the device all that has come since the last call; whether a sample did.
    pub fn take(&mut self, device: &mut Device<impl NorFlash>) -> bool {
        free(|_| collect());
        let came = SUMS.give(&mut self.reader, &mut self.input, device);
        if SUMS.is_torn() {
            // A conversion without its reading: the converter was overrun, or DMA failed.
            device.lost(self.start());
        }
        came
    }
}

/// Has the interrupt come, by a vector that is in RAM, too.
fn interrupt(scb: SCB, mut timer: SYST, clock_hz: u32) {
    let flash = scb.vtor.read() as *const [u32; VECTORS];
    // SAFETY: the table of this image, copied before it is used; aligned as PM0214 wants it (4.4.4).
    unsafe {
        addr_of_mut!(IN_RAM).write_volatile(flash.read_volatile());
        scb.vtor.write(addr_of!(IN_RAM) as u32);
    }
    cortex_m::asm::dsb();
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(clock_hz / INTERRUPT_HZ - 1);
    timer.clear_current();
    timer.enable_interrupt();
    timer.enable_counter();
}

#[exception]
#[link_section = ".data.SysTick"]
fn SysTick() {
    collect();
}

/// Sums up what has come. In RAM with all that it calls; never within itself.
#[inline(never)]
#[link_section = ".data.collect"]
fn collect() {
    // SAFETY: registers that are only read; what is in the ring is written by DMA only, and complete.
    unsafe {
        // The count first: a reading that comes between the two is one of the next call.
        let triggers = (*TIM5::PTR).cnt().read().bits();
        let left = (*DMA2::PTR).st(STREAM).ndtr().read().bits();
        let position = (RING as u32).wrapping_sub(left) % RING as u32;
        SUMS.collect(triggers, position, |at| addr_of!(READINGS[at % RING]).read_volatile());
    }
}
