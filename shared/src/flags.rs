//! What is the matter with a result.
//!
//! Not by a crate: the bits on the wire and the names in files are given, and beside them two methods are all
//! there is.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// What is the matter with a result, as bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Flags(pub u32);

impl Flags {
    /// Never rose above the lower end of the analysed range.
    pub const TOO_SMALL: Self = Self(1);
    /// No three cycles between the two ends of the range.
    pub const TOO_FEW_CYCLES: Self = Self(2);
    /// The converter was at one of its ends.
    pub const SATURATED: Self = Self(4);
    pub const LOST_SAMPLES: Self = Self(8);
    /// Outside what the network was trained on.
    pub const OUT_OF_RANGE: Self = Self(16);
    /// Was swinging already when first seen.
    pub const MID_SWING: Self = Self(32);
    /// Ended by the host or by a new release before the lower end of the range.
    pub const CUT_SHORT: Self = Self(64);
    /// No network passed its checks on this device.
    pub const NO_NETWORK: Self = Self(128);
    /// The second-order model does not explain the record: something is missing in it.
    pub const MISFIT: Self = Self(256);
    /// No damped oscillation could be fitted to the record; the network's estimate stands.
    pub const NOT_REFINED: Self = Self(16384);
    /// The reading stood still while the model swung.
    pub const STUCK: Self = Self(512);
    /// More noise, or hum, than a potentiometer in order has.
    pub const NOISY: Self = Self(1024);
    /// Wild samples, for a tenth of a second at most, were bridged or left out.
    pub const SPIKES: Self = Self(2048);
    /// No potentiometer's signal at all: nothing is connected.
    pub const NO_SENSOR: Self = Self(4096);
    /// A window is not one damped oscillation: a touch, a gust, a drift.
    pub const DISTURBED: Self = Self(8192);
    /// Wind on, and there is no wind-off release of this spring and axis to hold it against: no derivatives.
    pub const NO_REFERENCE: Self = Self(32768);

    /// The sensor says of its magnet that it is missing, too weak or too strong.
    pub const MAGNET: Self = Self(65536);
    /// An encoder's counts between two passes of its index are no whole turns.
    pub const LOST_COUNTS: Self = Self(131_072);

    /// The model may lack something: what that may do to the refined values is in their uncertainties.
    pub const WIDENED: Self = Self(262_144);
    /// The mean over the windows is further from the refined estimate than both are uncertain.
    pub const WINDOWS_DIFFER: Self = Self(524_288);

    /// Every flag with its name in files and on screen.
    pub const NAMES: [(Self, &'static str); 20] = [
        (Self::TOO_SMALL, "too_small"),
        (Self::TOO_FEW_CYCLES, "too_few_cycles"),
        (Self::SATURATED, "saturated"),
        (Self::LOST_SAMPLES, "lost_samples"),
        (Self::OUT_OF_RANGE, "out_of_trained_range"),
        (Self::MID_SWING, "started_in_mid_swing"),
        (Self::CUT_SHORT, "cut_short"),
        (Self::NO_NETWORK, "no_network"),
        (Self::STUCK, "stuck"),
        (Self::NOISY, "noisy"),
        (Self::SPIKES, "spikes"),
        (Self::NO_SENSOR, "no_sensor"),
        (Self::DISTURBED, "disturbed"),
        (Self::MISFIT, "misfit"),
        (Self::NOT_REFINED, "not_refined"),
        (Self::NO_REFERENCE, "no_reference"),
        (Self::MAGNET, "magnet"),
        (Self::LOST_COUNTS, "lost_counts"),
        (Self::WIDENED, "widened"),
        (Self::WINDOWS_DIFFER, "windows_differ"),
    ];

    pub fn set(&mut self, flag: Self) {
        self.0 |= flag.0;
    }

    pub fn has(self, flag: Self) -> bool {
        self.0 & flag.0 != 0
    }

    /// These but that one.
    #[must_use]
    pub fn without(self, flag: Self) -> Self {
        Self(self.0 & !flag.0)
    }

    /// Whether a wind-off release is no reference for others: anything is the matter with it but that little
    /// of it was seen, or what its uncertainties hold.
    pub fn unfit_as_reference(self) -> bool {
        let fit = [Self::CUT_SHORT, Self::MID_SWING, Self::WIDENED, Self::WINDOWS_DIFFER];
        fit.into_iter().fold(self, Self::without) != Self::default()
    }

    /// What of a release's flags matters to the fit to its record: not what concerns the windows and the
    /// network, nor what is not in the record, nor noise, which its uncertainty holds.
    pub fn of_record(self) -> Self {
        let not_its_own = [
            Self::TOO_SMALL,
            Self::TOO_FEW_CYCLES,
            Self::OUT_OF_RANGE,
            Self::SATURATED,
            Self::LOST_SAMPLES,
            Self::SPIKES,
            Self::NOISY,
            Self::WINDOWS_DIFFER,
        ];
        not_its_own.into_iter().fold(self, Self::without)
    }

    /// Whether the value that has these flags is none to rely on. [`crate::wire::counting`] asks it of both that
    /// a release may have.
    pub fn unusable(self) -> bool {
        let unusable = [
            Self::TOO_SMALL,
            Self::TOO_FEW_CYCLES,
            Self::SATURATED,
            Self::LOST_SAMPLES,
            Self::OUT_OF_RANGE,
            Self::NO_NETWORK,
            Self::NOT_REFINED,
            Self::STUCK,
            Self::NO_SENSOR,
            Self::LOST_COUNTS,
        ];
        unusable.into_iter().any(|flag| self.has(flag))
    }
}
