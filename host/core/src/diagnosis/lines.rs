//! Lines beside the effects that survive: pieces of a free decay do not show them, but the later part of the
//! record does, predicted from the earlier one. What drifts is none of them: in one release it varies with
//! the amplitude as a law does.

use crate::diagnosis::answer::earlier_count;
use crate::diagnosis::guards;
use crate::diagnosis::likelihood::is_explained;
use crate::diagnosis::prediction::MIN_GAIN;
use crate::diagnosis::search_start::library;
use crate::diagnosis::verdict::MAX_LEFT;
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::about_rest::added;
use crate::fit::fitting::{held_out_over_noise, refit, Fitted};
use crate::fit::free_decay::FreeDecay;
use crate::fit::two_modes::with_lasting_mode;
use crate::par_map::ParMap;
use crate::quantity::CHANCE;

/// A model that accounts for most of what a smaller one leaves, and the rms of its later part predicted from
/// the earlier one, rad.
pub(super) struct Longer {
    pub(super) model: Fitted,
    pub(super) held_out_rad: f64,
}

/// From `model` on, a line more each, as long as it accounts for most of what is left and predicts the later
/// part no worse, in which a mode may have died out. What was `there` from the beginning stands.
///
/// # Errors
/// Interrupted, once somebody asked for it.
pub(super) fn beside(decay: &FreeDecay, model: &Fitted, there: &[Effect]) -> Result<Vec<Longer>> {
    let count = earlier_count(decay);
    let held_out_rad =
        |model: &Fitted| decay.noise_rad * held_out_over_noise(decay, &refit(decay, model, count));
    let mut found: Vec<Longer> = Vec::new();
    loop {
        decay.stop.check()?;
        let here = found.last().map_or(model, |longer| &longer.model);
        let larger = best(decay, here, there)
            .map(|model| Longer { held_out_rad: held_out_rad(&model), model });
        let before = || found.last().map_or_else(|| held_out_rad(model), |l| l.held_out_rad);
        match larger.filter(|l| l.held_out_rad < (1.0 + MIN_GAIN) * before()) {
            Some(larger) => found.push(larger),
            None => return Ok(found),
        }
    }
}

/// `inner` with the one that leaves the least, if that is little.
fn best(decay: &FreeDecay, inner: &Fitted, there: &[Effect]) -> Option<Fitted> {
    if is_explained(inner, decay) {
        return None;
    }
    let others = &inner.structure.effects;
    let mut all = library(decay, others);
    all.retain(|e| e.line().is_some() && others.iter().all(|other| !other.excludes(e)));
    let stands = |larger: &Fitted| {
        larger.converged
            && larger.sum_of_squares < MAX_LEFT * inner.sum_of_squares
            && guards::refusal(larger, decay, there).is_none()
            && has_size(&larger.clone().with_discrepancy(decay))
    };
    all.iter()
        .par_map(|e| {
            let larger = with_lasting_mode(decay, added(decay, inner, e), e);
            stands(&larger).then_some(larger)
        })
        .flatten()
        .min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares))
}

/// Whether the size of the last effect of `model` is known to be other than zero.
fn has_size(model: &Fitted) -> bool {
    let size = model.structure.effects.last().and_then(|line| model.coefficient(line));
    size.is_some_and(|q| !q.holds(0.0, CHANCE))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fitting::fit_plain;
    use crate::record::Record;

    /// Two modes, or one and what its own law adds, and some noise.
    fn found(more_deg: impl Fn(f64) -> f64) -> (Fitted, Vec<Longer>) {
        let time_s: Vec<f64> = (0..6000).map(|k| f64::from(k) * 0.01).collect();
        let noise_deg = |t: f64| 0.002 * (12989.8 * t * t).sin();
        let yaw_deg =
            |t: &f64| 10.0 * (-0.02 * t).exp() * (6.0 * t).cos() + more_deg(*t) + noise_deg(*t);
        let yaw_deg = time_s.iter().map(yaw_deg).collect();
        let decay = FreeDecay::from_record(&Record::new("planted", time_s, yaw_deg)).unwrap();
        let plain = fit_plain(&decay, true, decay.yaw_rad.len());
        let longer = beside(&decay, &plain, &[]).unwrap();
        (plain, longer)
    }

    #[test]
    fn a_mode_far_above_the_noise_is_found_and_a_harmonic_is_none() {
        let second = |t: f64| 4.0 * (-0.1 * t).exp() * (14.3 * t + 0.5).cos();
        // Beside it what no line is.
        let third = |t: f64| 0.1 * (-0.06 * t).exp() * (18.0 * t).cos();
        let (plain, longer) = found(|t| second(t) + third(t));
        let [Longer { model, held_out_rad }] = &longer[..] else { panic!("{}", longer.len()) };
        let numbers = model.effect_parameters();
        let number = |name: &str| numbers.iter().find(|(n, _)| n.ends_with(name)).unwrap().1.value;
        println!("{numbers:?}, held out {held_out_rad}");
        assert!((number(".w2") / 14.3 - 1.0).abs() < 1e-3);
        assert!((number(".zeta2") * 14.3 / 0.1 - 1.0).abs() < 0.05);
        assert!(model.sum_of_squares < 0.01 * plain.sum_of_squares);
        assert!(found(third).1.is_empty());
    }

    /// Whichever is stronger: the natural frequency is that of the mode that lasts.
    #[test]
    fn the_mode_that_lasts_is_the_models_own() {
        let second = |t: f64| 30.0 * (-0.4 * t).exp() * (14.3 * t + 0.5).cos();
        let third = |t: f64| 0.2 * (-0.3 * t).exp() * (29.0 * t).cos();
        let (_, longer) = found(|t| second(t) + third(t));
        let [Longer { model, .. }] = &longer[..] else { panic!("{}", longer.len()) };
        let numbers = model.effect_parameters();
        let number = |name: &str| numbers.iter().find(|(n, _)| n.ends_with(name)).unwrap().1;
        println!("{} {numbers:?}", model.natural_frequency_rad_s());
        assert!((model.natural_frequency_rad_s().value / 6.0 - 1.0).abs() < 1e-3);
        assert!((number(".w2").value / 14.3 - 1.0).abs() < 1e-3);
    }
}
