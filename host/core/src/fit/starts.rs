//! Where the fit of an added effect begins.

use crate::effects::{Effect, Seen};
use crate::fit::fitted::Fitted;
use crate::fit::free_decay::FreeDecay;

/// Starting values of what the fit varies; the first leaves the motion of `inner` as it is.
pub(crate) fn of(decay: &FreeDecay, inner: &Fitted, effect: &Effect) -> Vec<Vec<f64>> {
    effect.starts(&Seen {
        beats: decay.beats(),
        scale: decay.scale(),
        residuals_rad: &inner.residuals,
        step_s: decay.grid.step_s,
        per_cycle: decay.per_cycle(),
        natural_frequency_rad_s: inner.natural_frequency_rad_s().value,
    })
}
