//! Whether a reading jumps from one angle to the next. A moment's jump comes through two integrations and leaves a
//! course without fine structure; a converter's or a worn track's is in the reading as it is.

use super::{Knots, Swings};
use crate::record::Record;
use serde::Serialize;

/// Steps of a table that follows what moments do to the shape of a cycle, and of one that follows jumps.
const SMOOTH: usize = 8;
const FINE: usize = 64;
/// Of the mean square that the smooth table leaves, what the fine one takes out of it at least. Of 29 measured decays
/// by encoders, cameras and gyroscopes it takes out 17 % at most; of twelve through four measured converters 21 to
/// 95 % in nine, 8 to 10 % in three.
const MIN_SHARE: f64 = 0.2;

/// Jumps of the reading.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Jumps {
    /// Of the mean square of what no smooth law of the reading accounts for.
    pub share: f64,
    /// The reading at which it jumps most, in the record's unit.
    pub at_deg: f64,
    /// How much it jumps there, from one sixty-fourth of its range to the next.
    pub by_deg: f64,
}

impl Jumps {
    /// Of the sensor by which a release was read; none where it shows none, or cannot: it needs eight cycles and twenty
    /// samples in each.
    pub fn of_reading(release: &Record) -> Option<Self> {
        let swings = Swings::new(std::slice::from_ref(release)).ok()?;
        let [low, high] = swings.range_deg();
        let [amplitude_deg, _] = swings.amplitude_and_offset_deg();
        let knots = |steps: usize| Knots {
            first_deg: low,
            step_deg: (high - low) / steps as f64,
            count: steps + 1,
        };
        let learned = |steps| swings.learn(knots(steps), amplitude_deg);
        let (smooth, fine) = (learned(SMOOTH).ok()?, learned(FINE).ok()?);
        let share = 1.0 - (fine.left_rms_deg / smooth.left_rms_deg).powi(2);
        if !fine.beyond_noise || share < MIN_SHARE {
            return None;
        }
        let jump = |pair: &[f64]| pair[0] - pair[1];
        let jumps = fine.corrections_deg.windows(2).map(jump).enumerate();
        let (knot, by_deg) = jumps.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        Some(Self { share, at_deg: knots(FINE).deg(knot), by_deg: by_deg.abs() })
    }
}
