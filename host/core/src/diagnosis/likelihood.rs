//! What likelihood says of a fitted model near the noise.

use crate::bic;
use crate::effects::Effect;
use crate::fit::fitting::Fitted;
use crate::fit::free_decay::FreeDecay;

/// Residual over noise up to which a record counts as explained.
pub(crate) const EXPLAINED: f64 = 1.10;
/// Variance of the ratio of a residual to its floor over that of the residual alone: third differences of the same readings,
/// from which the floor is known, have 924/400 of it, and the readings in common.
const OF_RATIO: f64 = 924.0 / 400.0 - 1.0;
/// Residual of the plain model over the noise up to which likelihood is asked: of what is farther off it says little.
pub(crate) const USED_UP_TO: f64 = 40.0;

/// Difference of BIC in favour of `larger`, on `effective` independent residuals.
pub(crate) fn evidence(smaller: &Fitted, larger: &Fitted, effective: f64) -> f64 {
    let more = larger.parameters.len() as f64 - smaller.parameters.len() as f64;
    bic::gain(smaller.sum_of_squares, larger.sum_of_squares, effective, more)
}

/// Residual over noise up to which so many independent residuals agree with their floor: of few the ratio scatters more.
pub(super) fn explained_up_to(independent: f64) -> f64 {
    let scatter = 3.0 * (OF_RATIO / (2.0 * independent)).sqrt();
    EXPLAINED.max(1.0 + scatter.min(0.3))
}

/// Whether residual and noise floor agree.
pub fn is_explained(fitted: &Fitted, decay: &FreeDecay) -> bool {
    fitted.over_noise(decay) <= explained_up_to(fitted.effective_count())
}

/// The same of every release.
pub(super) fn are_explained(fits: &[Fitted], decays: &[FreeDecay]) -> bool {
    fits.iter().zip(decays).all(|(fit, decay)| is_explained(fit, decay))
}

/// What `model` holds beyond `plain`, whose effects come first in it.
pub(crate) fn beyond<'a>(plain: &Fitted, model: &'a Fitted) -> &'a [Effect] {
    &model.structure.effects[plain.structure.effects.len()..]
}
