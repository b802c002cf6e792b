//! Samples of a converter that DMA empties into a ring: each is the sum of its conversions
//! ([`crate::sensors::potentiometer`]).

use crate::device::Device;
use crate::input::Input;
use crate::ring::Reader;
use crate::sensors::potentiometer::Potentiometer;
use embedded_storage::nor_flash::NorFlash;
use yawrig_shared::wire::FULL_SCALE_COUNTS;

/// Conversions of a sample on our boards, all at one angle but for its noise.
pub const CONVERSIONS: u32 = 16;
/// Of 1000 samples a second.
pub const CONVERSIONS_HZ: u32 = 1000 * CONVERSIONS;

/// The period, as a timer's register holds it: one less, of clock cycles between two conversions. `None`
/// where that leaves a remainder: natural frequencies would be wrong by it.
pub const fn period(clock_hz: u32) -> Option<u32> {
    if clock_hz < CONVERSIONS_HZ || !clock_hz.is_multiple_of(CONVERSIONS_HZ) {
        return None;
    }
    Some(clock_hz / CONVERSIONS_HZ - 1)
}

const _: () = assert!(FULL_SCALE_COUNTS == Potentiometer::<CONVERSIONS>::FULL_SCALE_COUNTS);

impl<const N: usize> Reader<N> {
    /// Gives the device the samples that it has not had, of as many conversions as [`Reader::made`] knows of,
    /// `reading` each from its place. Without that a conversion went missing: what the device has not had is
    /// lost, to the nearest sample, and the board begins anew: half a sample that was on its way is none.
    /// Whether a sample came: a board that measures is well, and its watchdog is fed; one whose timer or
    /// converter stands still is not, though it answers.
    pub fn give<F: NorFlash, const LOCKABLE: bool, const C: u32, const BITS: u32>(
        &mut self,
        triggers: u32,
        made: Option<u32>,
        reading: impl Fn(usize) -> u16,
        input: &mut Input<Potentiometer<C, BITS>>,
        device: &mut Device<F, LOCKABLE>,
    ) -> bool {
        let Some(made) = made else {
            device.lost(((self.begin_anew(triggers) + C / 2) / C).max(1));
            return false;
        };
        match self.overwritten(made, C) {
            0 => {}
            missed => device.lost(missed / C),
        }
        let mut came = false;
        while self.waiting(made) >= C {
            let places = (0..C).filter_map(|_| self.next(made));
            let mask = Potentiometer::<C, BITS>::MASK;
            input.take(Some(places.map(|at| reading(at) & mask).sum()), device);
            came = true;
        }
        came
    }
}
