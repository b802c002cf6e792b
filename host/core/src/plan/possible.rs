//! Rival models, and the releases that could be made to part them.

use crate::effects::{Effect, MeasuredLaw};
use crate::fit::joint::JointFit;
use crate::fit::structure::YAW;
use serde::Serialize;
use yawrig_shared::axis::Axis;

/// A model fitted to the records there are.
pub struct Rival<'a> {
    /// As the plan prints it.
    pub name: String,
    /// Fitted to the records there are.
    pub fit: &'a JointFit,
}

impl Rival<'_> {
    /// Its measured law, which within its range takes the shape of any formula, and says nothing beyond.
    pub(super) fn law(&self) -> Option<&MeasuredLaw> {
        self.fit.structure.effects.iter().find_map(Effect::measured)
    }

    /// Whether it is known what it does in `release`.
    pub(super) fn reaches(&self, release: &Possible) -> bool {
        let yaw_rad = release.amplitude_deg.to_radians();
        let rate_rad_s = yaw_rad * release.natural_frequency_rad_s;
        // A little beyond the range of a measured law it is still what was measured.
        self.law()
            .is_none_or(|law| yaw_rad <= 1.05 * law.yaw_rad && rate_rad_s <= 1.05 * law.rate_rad_s)
    }
}

/// A release that can be made.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Possible {
    /// Amplitude from which it is released.
    pub amplitude_deg: f64,
    /// Name of the springs; `None` outside a campaign.
    pub spring: Option<String>,
    /// Wind speed, 0: wind off; `None` outside a campaign.
    pub wind_speed_m_s: Option<f64>,
    /// The axis that the model turns about; `None` outside a campaign.
    pub axis: Option<Axis>,
    /// Length of the record.
    pub seconds: f64,
    /// Of the linear part, roughly.
    pub natural_frequency_rad_s: f64,
    /// Which of the releases there are it is most like: its sensor, its direction, its effects.
    #[serde(skip)]
    pub like: usize,
    /// Made under the condition of that release, so that natural frequency and damping ratio are known
    /// already.
    #[serde(skip)]
    pub repeated: bool,
}

/// The numbers of `rival` in `release` before it is fitted: moments are the same on every spring, and so is 2
/// zeta wn.
pub(super) fn numbers(rival: &Rival, release: &Possible) -> Vec<f64> {
    let mut p = rival.fit.fits[release.like].parameters.clone();
    if !release.repeated {
        let ratio = release.natural_frequency_rad_s / p[0];
        p[0] *= ratio;
        p[1] /= ratio;
    }
    p[YAW] = release.amplitude_deg.to_radians().copysign(p[YAW]);
    p[3] = 0.0;
    p
}
