//! The potentiometer at A0 (PA0), at exactly 1 kHz: TIM2 triggers ADC1 sixteen times a sample, DMA2 writes its readings to
//! a ring, TIM5 counts the triggers. The processor may be away for a second before a sample is lost.

use core::ptr::{addr_of, addr_of_mut};
use embedded_storage::nor_flash::NorFlash;
use stm32f4xx_hal::pac::{ADC1, ADC_COMMON, DMA2, TIM2, TIM5};
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};
use yawrig_firmware::conversions::{period, CONVERSIONS};
use yawrig_firmware::device::Device;
use yawrig_firmware::input::Input;
use yawrig_firmware::ring::Reader;
use yawrig_firmware::sensors::potentiometer::Potentiometer;

/// Readings kept: for longer than a flash sector takes to erase.
const RING: usize = 1024 * CONVERSIONS as usize;
static mut READINGS: [u16; RING] = [0; RING];

// Fields of registers, by the names and the tables of RM0390.
const TIM_CR1_CEN: u32 = 1;
const TIM_EGR_UG: u32 = 1;
const TIM_CR2_MMS_UPDATE: u32 = 0b010 << 4;
const TIM_SMCR_EXTERNAL_CLOCK: u32 = 0b111;
/// TIM5's internal trigger 0 is TIM2.
const TIM_SMCR_ITR0: u32 = 0b000 << 4;
const ADC_CCR_DIVIDE_BY_4: u32 = 0b01 << 16;
/// 480 cycles of 21 MHz, 23 us of the 62.5 us between conversions: a source of up to 50 kOhm charges the converter's capacitor.
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
    reader: Reader<RING>,
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
        sampling
    }

    /// Everything at its beginning: no trigger counted, the ring's first place next.
    fn start(&mut self) {
        let stream = self.dma.st(STREAM);
        // SAFETY: fields as above; the ring is a static that nothing else writes.
        unsafe {
            self.pace.cr1().write(|w| w.bits(0));
            self.adc.cr2().write(|w| w.bits(0));
            stream.cr().write(|w| w.bits(0));
            while stream.cr().read().bits() & DMA_CR_EN != 0 {}
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
            self.pace.cr1().write(|w| w.bits(TIM_CR1_CEN));
        }
    }

    /// Gives the device all that has come since the last call; whether a sample did.
    pub fn take(&mut self, device: &mut Device<impl NorFlash>) -> bool {
        // The count first: a reading that comes between the two is one of the next call.
        let triggers = self.count.cnt().read().bits();
        let left = self.dma.st(STREAM).ndtr().read().bits();
        let made = Reader::<RING>::made(triggers, (RING as u32).wrapping_sub(left) % RING as u32);
        if made.is_none() {
            // A conversion without its reading: the converter was overrun, or DMA failed.
            self.start();
        }
        // SAFETY: in the ring, written by DMA only, and complete.
        let reading = |at: usize| unsafe { addr_of!(READINGS[at]).read_volatile() };
        self.reader.give(triggers, made, reading, &mut self.input, device)
    }
}
