//! The valley of moments with states of their own. Once a model swings they change its frequency and damping as the
//! spring and the damper do, so that their numbers go far while what is seen stays: by hundreds of its standard
//! uncertainties for each. A straight step along that valley leaves it; one in the frequency and damping that are
//! seen, in place of the model's own, does not.

use crate::fit::problem::{has_states, Part};
use crate::fit::structure::{WN, ZETA};

/// Of a step, over which the slope at its beginning is taken.
const SHARE: f64 = 1e-3;

/// Natural frequency and damping ratio of each of `parts` at the end `to` of a step: those with which the slow
/// motion is where the step leads it to first order.
pub(crate) fn bend(parts: &[Part], from: &[f64], to: &mut [f64]) {
    let mut done = Vec::new();
    for part in parts.iter().filter(|part| has_states(&part.structure)) {
        let [wn, zeta] = [WN, ZETA].map(|number| part.places[number]);
        if done.contains(&wn) || ![WN, ZETA].iter().all(|number| part.free.contains(number)) {
            continue;
        }
        done.push(wn);
        let at = |share: f64| {
            let number = |&k: &usize| from[k] + share * (to[k] - from[k]);
            part.motion(&part.places.iter().map(number).collect::<Vec<_>>()).0
        };
        let slopes = [-SHARE, 0.0, SHARE].map(|share| at(share).slow_slopes());
        let [Some(before), Some(here), Some(after)] = slopes else { continue };
        let end = |k: usize| here[k] + (after[k] - before[k]) / (2.0 * SHARE);
        if let Some(own) = at(1.0).of_slow_slopes([end(0), end(1)]) {
            [to[wn], to[zeta]] = own;
        }
    }
}
