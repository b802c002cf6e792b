//! What a reader of an estimate must know besides its numbers.

use serde::{Deserialize, Serialize};

/// Written to JSON by its name in snake case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Flag {
    /// The samples are not evenly spaced.
    IrregularTimeStamps,
    /// Several samples share a time stamp.
    StampsSpread,
    /// The method works on an even grid that was interpolated.
    Resampled,
    /// Short gaps hold a fit to their neighbourhood.
    GapsFilled,
    /// Wild samples do not count.
    OutliersExcluded,
    /// The release came before the record.
    StartsInMidSwing,
    /// Something kept the amplitude up until the release.
    DrivenBefore,
    /// Something still drove the model after the release.
    PushedAtStart,
    /// Something stopped or drove the model before it came to rest.
    StoppedEarly,
    /// What was analysed lies partly beyond the amplitudes that were asked for.
    AmplitudeOutsideWindow,
    /// The smallest amplitude that was asked for is not reached.
    EndsAboveWindow,
    /// The uncertainties rest on little.
    FewCycles,
    /// The damping ratio is negative.
    Grows,
    /// The damping is not linear.
    AmplitudeDependentDamping,
    /// The stiffness is not linear.
    AmplitudeDependentFrequency,
    /// The second-order model lacks something: [`crate::diagnosis`] says what.
    ResidualAboveNoise,
    /// Conventional method: its filter needs a faster record.
    LowPassNotApplied,
    /// Conventional method: its filter may damp the oscillation itself.
    LowPassTooNear,
    /// Network: at least one window is extrapolated.
    OutsideTrainedRange,
    /// Others than the analysed release are in the record.
    SeveralReleases,
    /// Most samples stand for several, as a sensor slower than the record leaves them.
    RepeatedValues,
    /// No decay shows in many cycles.
    DoesNotDieAway,
    /// The stamps are so coarse that the record's rate is a good part of the frequency's uncertainty.
    RateUncertain,
}

impl Flag {
    /// The reason in words, for a table.
    pub fn reason(self) -> &'static str {
        match self {
            Flag::IrregularTimeStamps => "time stamps are irregular; each sample is used at its own time",
            Flag::StampsSpread => {
                "several samples share a time stamp; they are spread evenly by their number, which is the better clock"
            }
            Flag::Resampled => "resampled to an even rate",
            Flag::GapsFilled => {
                "samples are missing; what lies there is taken from a fit to the cycles about it"
            }
            Flag::OutliersExcluded => "outliers were left out",
            Flag::StartsInMidSwing => "the record starts in the middle of the oscillation; the release is not in it",
            Flag::DrivenBefore => "the model was driven until the release; that part was left out",
            Flag::PushedAtStart => "the model was still pushed at the start, or another motion was larger; that part was left out",
            Flag::StoppedEarly => "the oscillation was stopped or pushed before it had died out; analysed up to there",
            Flag::AmplitudeOutsideWindow => {
                "fewer than three cycles inside the asked amplitude window; analysed on what there is"
            }
            Flag::EndsAboveWindow => "the record ends before the lower end of the amplitude window",
            Flag::FewCycles => "fewer than six cycles",
            Flag::Grows => "the oscillation grows: negative damping",
            Flag::AmplitudeDependentDamping => {
                "damping changes with amplitude; the value is a mean over the window"
            }
            Flag::AmplitudeDependentFrequency => {
                "frequency changes with amplitude; the value is a mean over the window"
            }
            Flag::ResidualAboveNoise => "one damped mode with these values does not explain the record to its noise",
            Flag::LowPassNotApplied => "the sampling rate is too low for the 10 Hz low-pass",
            Flag::LowPassTooNear => "the oscillation is too near the 10 Hz low-pass",
            Flag::SeveralReleases => "the record holds several releases; the longest is analysed",
            Flag::RepeatedValues => {
                "each value stands several times, as from a sensor slower than the record: the noise is that of fewer samples"
            }
            Flag::DoesNotDieAway => "does not die away: a hum or a driven motion is no free decay",
            Flag::RateUncertain => {
                "time stamps are coarse: the rate is known only as well as they tell it, and that is in the frequency's ±"
            }
            Flag::OutsideTrainedRange => "a window lies outside the range the network was trained on",
        }
    }
}
