//! Samples of a converter that DMA empties into a ring: each is the sum of its conversions, since 12 bits over 340 deg are
//! steps of 0.083 deg, and where noise of half a step blurs them the sum is four times finer. Its mean time is half a
//! millisecond early, the same for all.

use crate::device::Device;
use crate::ring::Reader;
use embedded_storage::nor_flash::NorFlash;
use yawrig_shared::wire::FULL_SCALE_COUNTS;

/// Conversions of a sample, all at one angle but for its noise.
pub const CONVERSIONS: u32 = 16;
/// Of 1000 samples a second.
pub const CONVERSIONS_HZ: u32 = 1000 * CONVERSIONS;

/// The period, as a timer's register holds it: one less, of clock cycles between two conversions. `None` where that leaves
/// a remainder: natural frequencies would be wrong by it.
pub const fn period(clock_hz: u32) -> Option<u32> {
    if clock_hz < CONVERSIONS_HZ || !clock_hz.is_multiple_of(CONVERSIONS_HZ) {
        return None;
    }
    Some(clock_hz / CONVERSIONS_HZ - 1)
}

const _: () = assert!(FULL_SCALE_COUNTS as u32 == CONVERSIONS * 0x0fff);

impl<const N: usize> Reader<N> {
    /// Gives the device the samples that it has not had, of as many conversions as [`Reader::made`] knows of, `reading`
    /// each from its place. Without that a conversion went missing: what the device has not had is lost, and the board
    /// begins anew. Whether a sample came: a board that measures is well, and its watchdog is fed; one whose timer or
    /// converter stands still is not, though it answers.
    pub fn give<F: NorFlash, const LOCKABLE: bool>(
        &mut self,
        triggers: u32,
        made: Option<u32>,
        reading: impl Fn(usize) -> u16,
        device: &mut Device<F, LOCKABLE>,
    ) -> bool {
        let Some(made) = made else {
            device.lost(self.begin_anew(triggers).div_ceil(CONVERSIONS).max(1));
            return false;
        };
        match self.overwritten(made, CONVERSIONS) {
            0 => {}
            missed => device.lost(missed / CONVERSIONS),
        }
        let mut came = false;
        while self.waiting(made) >= CONVERSIONS {
            let places = (0..CONVERSIONS).filter_map(|_| self.next(made));
            // As it is: a scale that were stretched to all of 16 bits would have steps, and be bent at each.
            device.sample(places.map(|at| reading(at) & 0x0fff).sum());
            device.work();
            came = true;
        }
        came
    }
}
