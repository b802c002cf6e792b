//! The valley of moments with states of their own. Once a model swings they change its frequency and damping as the
//! spring and the damper do, so that their numbers go far while what is seen stays: by hundreds of its standard
//! uncertainties for each. A straight step along that valley leaves it; one in the frequency and damping that are
//! seen, in place of the model's own, does not.

use crate::motion::simulate::Motion;

/// Of a step, over which the slope at its beginning is taken.
const SHARE: f64 = 1e-3;

/// Natural frequency and damping ratio of the model at the end of a step, of which `at` is the motion at a share:
/// those with which the slow motion is where the step leads it to first order. `None` without states, or where
/// these are not linear.
pub(crate) fn end(at: impl Fn(f64) -> Motion) -> Option<[f64; 2]> {
    let slopes = |share: f64| at(share).slow_slopes();
    let (before, here, after) = (slopes(-SHARE)?, slopes(0.0)?, slopes(SHARE)?);
    let end = [0, 1].map(|k| here[k] + (after[k] - before[k]) / (2.0 * SHARE));
    at(1.0).of_slow_slopes(end)
}
