//! Two tracks whose edges a timer or a state machine counts, and an index once a turn.
//!
//! Where the model was when counting began is zero. The index is what shows that no edge was missed: between
//! two of its passes there are whole turns.

use super::turns::{Turns, DEGREES_PER_COUNT};
use crate::sensor::{About, Reading, Sensor};
use yawrig_shared::wire::{self, Flags, SensorKind};

/// Edges between two passes of the index may be off by so many: it is as wide as a few of them.
const INDEX_WIDTH: i32 = 2;

/// What has been counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counted {
    /// The counter, which goes round.
    pub counts: u16,
    /// The same where the index last passed, if it has since the last reading.
    pub index: Option<u16>,
}

/// One of so many edges a turn.
#[derive(Clone, Copy, Debug)]
pub struct Quadrature {
    rate_hz: u16,
    turns: Turns,
    last: Option<u16>,
    /// Edges since the index last passed, less whole turns.
    since_index: Option<i32>,
}

impl Quadrature {
    /// Of so many edges a turn, four times the lines of the disk, read at this rate.
    pub const fn new(edges: u32, rate_hz: u16) -> Self {
        Self { rate_hz, turns: Turns::new(edges), last: None, since_index: None }
    }
}

impl Sensor for Quadrature {
    type Raw = Counted;

    fn about(&self) -> About {
        About {
            sensor: wire::Sensor {
                kind: SensorKind::Quadrature,
                rate_hz: self.rate_hz,
                delay_us: 0,
            },
            degrees_per_count: Some(DEGREES_PER_COUNT),
            step_deg: self.turns.step_deg(),
            full_scale_counts: u16::MAX,
        }
    }

    #[inline]
    fn reading(&mut self, Counted { counts, index }: Counted) -> Reading {
        let edges = self.turns.per_turn();
        let step =
            i32::from(counts.wrapping_sub(self.last.replace(counts).unwrap_or(counts)) as i16);
        self.turns.turn_by(step);
        let mut flags = Flags::default();
        self.since_index = self.since_index.map(|since| (since + step) % edges);
        if let Some(index) = index {
            let since_pass = i32::from(counts.wrapping_sub(index) as i16);
            if let Some(since) = self.since_index {
                let off = (since - since_pass).rem_euclid(edges);
                if off.min(edges - off) > INDEX_WIDTH {
                    flags.set(Flags::LOST_COUNTS);
                }
            }
            self.since_index = Some(since_pass);
        }
        Reading { fine: Some(self.turns.fine()), flags }
    }
}
