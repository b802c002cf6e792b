//! What a converter and its sensor err by: a table of corrections by reading.
//!
//! Between two knots a correction lies on a straight line, beyond the first and the last it stays: there the
//! table knows nothing, and a step would be worse. Corrected readings rise with the readings they are of, so
//! no angle is had twice. Whole numbers throughout: some twenty instructions on any processor.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Most knots of a table: one a code of a converter of 12 bits over a swing of 21 deg to either side, of a
/// potentiometer of 340 deg. Through measured chips that leaves damping ratios 0.01 % off; one every two codes
/// leaves 0.03 % where a swing crosses a jump, and 8 of 160 beyond 3 u, one every four codes 15.
pub const KNOTS: usize = 512;
/// Fewest.
pub const MIN_KNOTS: usize = 16;
/// Bits of the largest spacing and of the largest unit of a correction.
const MAX_BITS: [u8; 2] = [8, 3];

/// How a table is to be read, and what it is of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Head {
    /// The reading of the first knot.
    pub first_counts: u16,
    /// Knots are two to the power of this apart, counts.
    pub spacing_bits: u8,
    /// And corrections are given in two to the power of this, counts.
    pub unit_bits: u8,
    pub knots: u16,
    /// Of so many releases; 1: of a sweep against a reference.
    pub learned_from: u16,
    /// What its own uncertainty does to a damping ratio, relative, as a standard uncertainty.
    pub damping_u: f32,
}

/// A table.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    head: Head,
    corrections: [i8; KNOTS],
}

impl Default for Table {
    fn default() -> Self {
        Self::new()
    }
}

impl Table {
    /// Corrects nothing.
    #[inline(always)]
    pub const fn new() -> Self {
        let head = Head {
            first_counts: 0,
            spacing_bits: 0,
            unit_bits: 0,
            knots: 0,
            learned_from: 0,
            damping_u: 0.0,
        };
        Self { head, corrections: [0; KNOTS] }
    }

    pub fn head(&self) -> &Head {
        &self.head
    }

    /// A correction for each knot, in the head's unit.
    pub fn corrections(&self) -> &[i8] {
        self.corrections.get(..usize::from(self.head.knots)).unwrap_or_default()
    }

    /// Begins a table with this head, all of whose corrections are still to come.
    pub fn begin(&mut self, head: &Head) {
        self.head = *head;
        self.corrections = [0; KNOTS];
    }

    /// Corrections from a knot on; false where there are no such knots.
    pub fn put(&mut self, at: usize, corrections: &[i8]) -> bool {
        let end = at.saturating_add(corrections.len());
        let within = end <= usize::from(self.head.knots);
        match self.corrections.get_mut(at..end).filter(|_| within) {
            Some(room) => {
                room.copy_from_slice(corrections);
                true
            }
            None => false,
        }
    }

    /// Whether it is one: its knots are readings, its uncertainty is a number, and corrected readings rise
    /// with readings.
    pub fn is_sound(&self) -> bool {
        let Head { first_counts, spacing_bits, unit_bits, knots, learned_from, damping_u } =
            self.head;
        let spacing = 1_i32 << spacing_bits.min(MAX_BITS[0]);
        let end = i32::from(first_counts) + spacing * i32::from(knots).saturating_sub(1);
        let rises = |pair: &[i8]| match pair {
            [one, next] => (i32::from(*next) - i32::from(*one)) << unit_bits > -spacing,
            _ => true,
        };
        spacing_bits <= MAX_BITS[0]
            && unit_bits <= MAX_BITS[1]
            && (MIN_KNOTS..=KNOTS).contains(&usize::from(knots))
            && end <= i32::from(u16::MAX)
            && learned_from > 0
            && (0.0..1.0).contains(&damping_u)
            && self.corrections().windows(2).all(rises)
    }

    /// The largest correction, counts.
    pub fn largest_counts(&self) -> u16 {
        let largest = self.corrections().iter().map(|c| c.unsigned_abs()).max().unwrap_or(0);
        u16::from(largest) << self.head.unit_bits
    }

    /// What is to be added to a reading, in parts of a count: so many bits finer.
    #[inline]
    fn correction(&self, counts: u16) -> (i32, u8) {
        let Head { first_counts, spacing_bits, unit_bits, knots, .. } = self.head;
        let last = usize::from(knots).wrapping_sub(1) & (KNOTS - 1);
        let from_first = (i32::from(counts) - i32::from(first_counts)).max(0);
        let knot = ((from_first >> spacing_bits) as usize).min(last);
        let beyond = if knot == last { 0 } else { from_first & ((1 << spacing_bits) - 1) };
        // In range, both: `last` is less than [`KNOTS`], a power of two.
        let at = i32::from(self.corrections[knot & (KNOTS - 1)]);
        let next = i32::from(self.corrections[(knot + 1) & (KNOTS - 1)]);
        (((at << spacing_bits) + (next - at) * beyond) << unit_bits, spacing_bits)
    }

    /// A reading without what the table knows of its error.
    #[inline]
    pub fn corrected(&self, counts: u16) -> u16 {
        let (correction, bits) = self.correction(counts);
        let half = (1 << bits) >> 1;
        let corrected = i32::from(counts) + ((correction + half) >> bits);
        corrected.clamp(0, i32::from(u16::MAX)) as u16
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(spacing_bits: u8, unit_bits: u8, corrections: &[i8]) -> Table {
        let mut table = Table::new();
        let knots = corrections.len() as u16;
        let head = Head {
            first_counts: 1000,
            spacing_bits,
            unit_bits,
            knots,
            learned_from: 8,
            damping_u: 1e-4,
        };
        table.begin(&head);
        assert!(table.put(0, corrections));
        table
    }

    #[test]
    fn between_knots_it_is_straight_and_beyond_them_it_stays() {
        let mut corrections = [0; MIN_KNOTS];
        (corrections[0], corrections[1], corrections[15]) = (-4, 4, 10);
        let table = table(4, 1, &corrections);
        assert!(table.is_sound());
        assert_eq!(table.largest_counts(), 20);
        let expected = [
            (0, 0),
            (500, 492),
            (1000, 992),
            (1004, 1000),
            (1008, 1008),
            (1016, 1024),
            (1024, 1028),
            (1032, 1032),
            (1232, 1242),
            (1240, 1260),
            (40_000, 40_020),
            (65_530, 65_535),
        ];
        for (counts, corrected) in expected {
            assert_eq!(table.corrected(counts), corrected, "{counts}");
        }
    }

    #[test]
    fn a_table_of_nothing_corrects_nothing() {
        for counts in 0..=u16::MAX {
            assert_eq!(Table::new().corrected(counts), counts);
        }
        assert!(!Table::new().is_sound());
    }

    #[test]
    fn what_is_no_table_is_known() {
        let good = table(4, 1, &[1; 20]);
        assert!(good.is_sound());
        let with = |change: &dyn Fn(&mut Head)| {
            let mut table = good.clone();
            change(&mut table.head);
            table.is_sound()
        };
        assert!(with(&|_| {}));
        assert!(!with(&|head| head.spacing_bits = 9));
        assert!(!with(&|head| head.unit_bits = 4));
        assert!(!with(&|head| head.knots = 15));
        assert!(!with(&|head| head.knots = 513));
        assert!(!with(&|head| head.first_counts = 65_300));
        assert!(!with(&|head| head.learned_from = 0));
        assert!(!with(&|head| head.damping_u = f32::NAN));
        let mut falls = [0; 20];
        falls[7] = -8;
        assert!(!table(4, 1, &falls).is_sound());
        falls[7] = -7;
        assert!(table(4, 1, &falls).is_sound());
        // Nor is there room beyond the last knot.
        assert!(!good.clone().put(19, &[1, 2]));
        assert!(!good.clone().put(usize::MAX, &[1]));
    }

    /// Whatever a head says: no reading makes it panic.
    #[test]
    fn no_head_is_too_odd_to_be_asked() {
        for knots in [0, 1, 511, 512, 513, u16::MAX] {
            for spacing_bits in 0..=8 {
                let mut table = table(spacing_bits, 3, &[i8::MIN; KNOTS]);
                table.head.knots = knots;
                for counts in (0..=u16::MAX).step_by(97) {
                    table.corrected(counts);
                    table.largest_counts();
                }
            }
        }
    }
}
