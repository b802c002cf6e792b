//! What a sensor errs by, as a table by its reading, learned from free decays that were read through it.
//!
//! Over a decay each reading is passed hundreds of times, at a known phase. What is fitted is
//!
//! ```text
//! reading = angle + error(angle),   angle = offset(t) + A(t) cos P(t) + A^3 e/12 cos 3 P(t)
//! ```
//!
//! with the error straight between knots, the same in all releases, and of each release its own offset, ln A
//! and P: polynomials of the time. So nothing is learned from how the amplitude falls or the frequency
//! changes, which is the rig's own, but only from the shape of a cycle. There a damping law has its harmonics
//! in quadrature, which no function of the angle has; what is left is a stiffness law, whose third harmonic is
//! a twelfth of the relative change `e A^2` of the frequency that it makes (Duffing 1918), which the phases
//! show: it is taken out as a cubic one's, and a tenth of it stays in the uncertainty. An offset and a gain of
//! the error cannot be learned and change neither frequency nor damping: they are left out.
//!
//! Normal equations with the releases' own parameters eliminated (Schur complement), Gauss-Newton.

mod damping;
mod fit;
mod jumps;
mod start;
mod sweep;
mod table;

use crate::error::{Error, Result};
use crate::identify::{self, Settings};
use crate::record::Record;
pub use jumps::Jumps;
use start::{Swing, MIN_CYCLES};
pub use sweep::{Sweep, Swept};
pub use table::{Knots, Learned};

/// A cycle's samples at least: with fewer a reading's phase says little.
const MIN_PER_CYCLE: f64 = 20.0;

/// Free decays that were read through one sensor.
#[derive(Clone, Debug)]
pub struct Swings(Vec<Swing>);

impl Swings {
    /// The free decays of `records`, one each.
    ///
    /// # Errors
    /// Naming the record: no oscillation, too few samples a cycle.
    pub fn new(records: &[Record]) -> Result<Self> {
        let swing = |record: &Record| -> Result<Swing> {
            let settings = Settings { from_deg: 360.0, to_deg: 1e-3, ..Settings::default() };
            let prepared =
                identify::prepare(record, &settings).map_err(|refusal| refusal.of(record))?;
            let stretch = prepared.stretch();
            let frequency = prepared.span.frequency_rad_s;
            let per_cycle = std::f64::consts::TAU / frequency / stretch.step_s;
            if per_cycle < MIN_PER_CYCLE {
                let record = record.file.display().to_string();
                return Err(Error::TooCoarse { record, per_cycle, fewest: MIN_PER_CYCLE });
            }
            // All of them: what is taken for an outlier there may be a jump of the converter.
            let samples: Vec<(f64, f64)> =
                stretch.time_s.iter().copied().zip(stretch.yaw_deg.iter().copied()).collect();
            let cycles = samples.len() as f64 / per_cycle;
            Swing::new(&samples, frequency).ok_or_else(|| Error::TooFewCycles {
                record: record.file.display().to_string(),
                cycles,
                fewest: MIN_CYCLES as f64,
            })
        };
        records.iter().map(swing).collect::<Result<_>>().map(Self)
    }

    /// The lowest and the highest reading.
    pub fn range_deg(&self) -> [f64; 2] {
        let all = || self.0.iter().flat_map(|swing| swing.samples.iter().map(|sample| sample.1));
        [all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max)]
    }

    /// The largest amplitude, and where it swings about: the mean over the releases.
    pub fn amplitude_and_offset_deg(&self) -> [f64; 2] {
        let largest = self.0.iter().map(Swing::amplitude_deg).fold(0.0, f64::max);
        let offset = self.0.iter().map(Swing::offset_deg).sum::<f64>() / self.0.len() as f64;
        [largest, offset]
    }

    /// How many.
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// The table at these knots; its uncertainty is that of damping ratios that are had from this amplitude
    /// down.
    ///
    /// # Errors
    /// Where the releases do not determine it.
    pub fn learn(&self, knots: Knots, from_deg: f64) -> Result<Learned> {
        fit::learn(&self.0, knots, from_deg)
    }
}
