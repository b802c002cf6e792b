//! What likelihood says of a fitted model near the noise.

use crate::bic;
use crate::effects::Effect;
use crate::fit::fitting::Fitted;
use crate::fit::free_decay::FreeDecay;

/// Residual over noise up to which a record counts as explained.
pub(crate) const EXPLAINED: f64 = 1.10;
/// Difference of BIC in favour of `larger`, on `effective` independent residuals.
pub fn evidence(smaller: &Fitted, larger: &Fitted, effective: f64) -> f64 {
    let more = larger.parameters.len() as f64 - smaller.parameters.len() as f64;
    bic::gain(smaller.sum_of_squares, larger.sum_of_squares, effective, more)
}

/// Whether residual and noise floor agree; in few means their ratio scatters more.
pub fn is_explained(fitted: &Fitted, decay: &FreeDecay) -> bool {
    let scatter = 3.0 / (2.0 * fitted.effective_count()).sqrt();
    fitted.over_noise(decay) <= EXPLAINED.max(1.0 + scatter.min(0.3))
}

/// What `model` holds beyond `plain`, whose effects come first in it.
pub fn beyond<'a>(plain: &Fitted, model: &'a Fitted) -> &'a [Effect] {
    &model.structure.effects[plain.structure.effects.len()..]
}
