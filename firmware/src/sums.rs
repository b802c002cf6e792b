//! Samples on their way from an interrupt, which sums up what DMA has written of a converter's readings, to
//! the program, which may be away for as long as they are kept.
//!
//! ```
//! use yawrig_firmware::{device::Device, input::Input, ring::Reader, slots::MemoryFlash, sums::Sums};
//!
//! static SUMS: Sums<256, 1024> = Sums::new(); // of a ring of 256 readings; a second is kept
//! let mut device = Device::new(MemoryFlash::new(), "my board");
//! let (mut reader, mut input) = (Reader::new(), Input::new(Default::default()));
//!
//! // In the interrupt: how many conversions were begun, where DMA writes next, and what it has written.
//! SUMS.collect(32, 32, |_at| 2048);
//! SUMS.give(&mut reader, &mut input, &mut device); // in the program's loop
//! assert_eq!(device.samples(), 2);
//! ```

use crate::conversions::CONVERSIONS;
use crate::device::Device;
use crate::input::Input;
use crate::ring::{Reader, MARGIN};
use crate::sensors::potentiometer::Potentiometer;
use core::sync::atomic::{AtomicBool, AtomicU16, AtomicU32, Ordering};
use embedded_storage::nor_flash::NorFlash;

type Converter = Potentiometer<CONVERSIONS>;

/// The last `KEPT` sums of the readings in a ring of `RING`; both are powers of two.
pub struct Sums<const RING: usize, const KEPT: usize> {
    sums: [AtomicU16; KEPT],
    made: AtomicU32,
    /// A reading is missing, or was overwritten: nothing is summed up until everything begins anew.
    torn: AtomicBool,
}

impl<const RING: usize, const KEPT: usize> Default for Sums<RING, KEPT> {
    fn default() -> Self {
        Self::new()
    }
}

// Always inlined where the interrupt runs from RAM: all of it has to be there.
impl<const RING: usize, const KEPT: usize> Sums<RING, KEPT> {
    /// None yet.
    pub const fn new() -> Self {
        const { assert!(RING.is_power_of_two() && KEPT.is_power_of_two()) };
        Self {
            sums: [const { AtomicU16::new(0) }; KEPT],
            made: AtomicU32::new(0),
            torn: AtomicBool::new(false),
        }
    }

    /// Sums up the whole samples that have come, of as many conversions as were begun, up to where in the
    /// ring DMA writes next, which was read after that; `reading` is what stands at a place. Never while it
    /// is under way already.
    #[inline(always)]
    pub fn collect(&self, triggers: u32, position: u32, reading: impl Fn(usize) -> u16) {
        let mut made = self.made.load(Ordering::Relaxed);
        let waiting = Reader::<RING>::made(triggers, position)
            .map(|written| written.wrapping_sub(made.wrapping_mul(CONVERSIONS)))
            .filter(|waiting| *waiting <= RING as u32 - MARGIN);
        let (Some(mut waiting), false) = (waiting, self.is_torn()) else {
            self.torn.store(true, Ordering::Relaxed);
            return;
        };
        while waiting >= CONVERSIONS {
            let first = made.wrapping_mul(CONVERSIONS);
            let mut sum = 0;
            for k in 0..CONVERSIONS {
                sum += reading(first.wrapping_add(k) as usize % RING) & Converter::MASK;
            }
            self.sums[made as usize % KEPT].store(sum, Ordering::Relaxed);
            made = made.wrapping_add(1);
            waiting -= CONVERSIONS;
        }
        self.made.store(made, Ordering::Release);
    }

    /// Gives the device the samples that it has not had; what was overwritten before is lost. Whether one
    /// came: a board that measures is well, and its watchdog is fed.
    pub fn give<F: NorFlash, const LOCKABLE: bool>(
        &self,
        reader: &mut Reader<KEPT>,
        input: &mut Input<Converter>,
        device: &mut Device<F, LOCKABLE>,
    ) -> bool {
        let mut came = false;
        while self.give_one(reader, input, device) {
            came = true;
        }
        came
    }

    /// The same of one sample, for a board that has something else to do between two.
    pub fn give_one<F: NorFlash, const LOCKABLE: bool>(
        &self,
        reader: &mut Reader<KEPT>,
        input: &mut Input<Converter>,
        device: &mut Device<F, LOCKABLE>,
    ) -> bool {
        // Anew for each: the interrupt goes on.
        let made = self.made.load(Ordering::Acquire);
        match reader.overwritten(made, 1) {
            0 => {}
            missed => device.lost(missed),
        }
        let Some(at) = reader.next(made) else { return false };
        input.take(Some(self.sums[at].load(Ordering::Relaxed)), device);
        true
    }

    /// The converter says itself that a reading went missing.
    pub fn tear(&self) {
        self.torn.store(true, Ordering::Relaxed);
    }

    /// Whether the converter, DMA and this are to begin anew.
    #[inline(always)]
    pub fn is_torn(&self) -> bool {
        self.torn.load(Ordering::Relaxed)
    }

    /// Everything has begun anew after so many conversions were begun: how many samples that cost, to the
    /// nearest.
    pub fn begin_anew(&self, triggers: u32) -> u32 {
        let made = self.made.load(Ordering::Relaxed);
        let unused = triggers.wrapping_sub(made.wrapping_mul(CONVERSIONS));
        self.made.store(0, Ordering::Relaxed);
        self.torn.store(false, Ordering::Release);
        ((unused + CONVERSIONS / 2) / CONVERSIONS).max(1)
    }
}
