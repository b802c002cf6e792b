//! Effects whose sizes may be zero for all that a model lacks: the prediction decides whether name or uncertainty is
//! wrong.
//!
//! What the model lacks may stand in for an effect, as a law of the frequency for a cubic stiffness: its ± then
//! reaches zero, though without it the rest of the model predicts worse. With a coefficient that is z standard
//! uncertainties from zero the squares of what was not fitted are less by z2, give or take 2 z: by z/2 standard
//! errors. So the one by which an effect is needed is two uncertainties, and no less is stated.

use crate::diagnosis::guards::{self, OF_NAMED};
use crate::diagnosis::over_pieces::{without, Lengths, Model};
use crate::diagnosis::prediction::MIN_GAIN;
use crate::diagnosis::survivors::{judged, PredictedModel};
use crate::effects::{Acts, Effect};
use crate::fit::fitting::Fitted;
use crate::fit::free_decay::FreeDecay;
use crate::fit::pieces::Piece;
use crate::fit::segments::{fit_from, SETTLED};
use crate::par_map::ParMap;

/// What the prediction says of effects of a model whose sizes may be zero.
pub(super) struct Unknown {
    /// The model less the one that is missed least, where what is gained by it is within chance in the mean over
    /// the pieces and next to nothing of the error of all.
    pub(super) needless: Option<PredictedModel>,
    /// Those that are other than zero: without them it predicts worse.
    pub(super) needed: Vec<Effect>,
}

impl Unknown {
    pub(super) fn new(lengths: &Lengths, of: &PredictedModel, effects: Vec<Effect>) -> Self {
        let less = |effect: &Effect| judged(lengths, without(lengths, &of.model, effect));
        let gain = |less: &PredictedModel| of.prediction.gain_over(&less.prediction);
        let error = |of: &PredictedModel| of.prediction.rms_rad();
        let is_needless =
            |m: &&PredictedModel| gain(m) < OF_NAMED && (1.0 - MIN_GAIN) * error(m) < error(of);
        let less: Vec<PredictedModel> = effects.iter().par_map(less).collect();
        let needless = less.iter().filter(is_needless);
        let needless = needless.min_by(|a, b| error(a).total_cmp(&error(b))).cloned();
        let each = effects.into_iter().zip(&less);
        let needed = each.filter(|(_, less)| of.predicts_better_than(less));
        Self { needless, needed: needed.map(|(effect, _)| effect).collect() }
    }
}

/// `model`, fitted to all of `decay`, with the effects told from zero that what it lacks leaves open and the
/// prediction does not. As it is where what it leaves is noise, or it has what pieces do not show.
#[must_use]
pub fn told(decay: &FreeDecay, model: Fitted) -> Fitted {
    let structure = &model.structure;
    let unknown = guards::of_unknown_size(&model, &[], OF_NAMED);
    let shows = |e: &Effect| e.acts_on() == Acts::State || e.is_own();
    let shows = structure.effects.iter().all(shows) && !structure.has_law();
    if model.discrepancy.is_none() || unknown.is_empty() || !shows {
        return model;
    }
    let lengths = Lengths::new(decay);
    let (common, _) = Piece::layout(&[&Piece::whole(decay)], structure).parted(&model.parameters);
    let fit = fit_from(&lengths.long, structure, &common, SETTLED);
    let here = judged(&lengths, Model { short: fit.clone(), fit });
    let Unknown { needed, .. } = Unknown::new(&lengths, &here, unknown);
    guards::other_than_zero(model, &needed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fitting::{fit_added, fit_plain};
    use crate::record::Record;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Of a restoring moment with the power 2.5 of the angle a cubic and a quintic stiffness make most; where the
    /// quintic one could be none for all that is lacking (its covariance nine times what it is), the prediction
    /// says that it is not, and nothing is less known for it. A quadratic one, which is not there, stays unknown.
    #[test]
    fn what_prediction_needs_is_two_uncertainties_from_zero() {
        let (wn, step_s) = (7.0f64, 1e-4);
        let (mut yaw_rad, mut rate_rad_s) = (0.3f64, 0.0f64);
        let mut record = Record::new("mine", Vec::new(), Vec::new());
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for k in 0..300_000 {
            if k % 100 == 0 {
                record.time_s.push(f64::from(k) * step_s);
                let noise: f64 = StandardNormal.sample(&mut rng);
                record.yaw_deg.push(yaw_rad.to_degrees() + 0.008 * noise);
            }
            let bent = -100.0 * yaw_rad * yaw_rad.abs().powf(1.5);
            // Symplectic: the step's error is far below the noise.
            rate_rad_s -= step_s * (wn * wn * yaw_rad + bent + 2.0 * 0.01 * wn * rate_rad_s);
            yaw_rad += step_s * rate_rad_s;
        }
        let decay = FreeDecay::from_record(&record).expect("a decay");
        let open = |second: &Effect| {
            let plain = fit_plain(&decay, false, decay.yaw_rad.len());
            let first = fit_added(&decay, &plain, &Effect::CubicStiffness);
            let mut fit = fit_added(&decay, &first, second).with_discrepancy(&decay);
            fit.covariance.iter_mut().for_each(|c| *c *= 9.0);
            assert!(guards::of_unknown_size(&fit, &[], OF_NAMED).contains(second));
            fit
        };
        let all = |fit: &Fitted| {
            let modal = [fit.natural_frequency_rad_s(), fit.damping_ratio()];
            modal.into_iter().chain(fit.effect_parameters().into_iter().map(|(_, q)| q))
        };
        let quintic = open(&Effect::QuinticStiffness);
        let known = told(&decay, quintic.clone());
        assert_eq!(known.needed, [Effect::QuinticStiffness]);
        assert_eq!(guards::of_unknown_size(&known, &[], OF_NAMED), []);
        for (before, after) in all(&quintic).zip(all(&known)) {
            println!("{before} -> {after}");
            assert!(after.value == before.value && after.u <= before.u, "{before} {after}");
        }
        let none = told(&decay, open(&Effect::QuadraticStiffness));
        assert_eq!(none.needed, []);
    }
}
