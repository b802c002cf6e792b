//! Where the fit of an added effect begins.

use crate::effects::{Effect, Seen};
use crate::fit::fitting::Fitted;
use crate::fit::swing::Swing;

/// Starting values of what the fit varies; the first leaves the motion of `inner` as it is.
pub fn of(swing: &Swing, inner: &Fitted, effect: &Effect) -> Vec<Vec<f64>> {
    effect.starts(&Seen {
        scale: swing.scale(),
        residuals_rad: &inner.residuals,
        step_s: swing.grid.step_s,
        per_cycle: swing.per_cycle(),
        natural_frequency_rad_s: inner.natural_frequency_rad_s().value,
    })
}
