//! An effect added to a fitted model.

use crate::model_fit::{better, continued, fit_jointly, Data, ADDED_WELL};
use rayon::prelude::*;
use yawrig_base::error::Result;
use yawrig_base::interrupt;
use yawrig_core::diagnosis::diagnose::fit_over_pieces;
use yawrig_core::effects::Effect;
use yawrig_core::fit::fitting::{fit_added, lines_anew, Fitted};
use yawrig_core::fit::joint::{self, JointFit};
use yawrig_core::fit::own;
use yawrig_core::fit::two_modes::with_lasting_mode;

/// `inner` with `effect` added.
///
/// # Errors
/// 130 where the user stops it.
pub fn add(data: &Data, inner: &JointFit, effect: Effect) -> Result<JointFit> {
    let structure = inner.structure.with(&effect);
    if effect.is_own() && data.fitted.len() > 1 {
        let (releases, sharing) = (data.releases(), data.sharing(structure.effects.len()));
        let fit = own::added(&releases, &sharing, inner, &effect);
        return Ok(nested(continued(&releases, &structure, &sharing, fit)?, inner));
    }
    let singles: Vec<Fitted> = data
        .fitted
        .par_iter()
        .zip(&inner.fits)
        .map(|(recorded, fit)| {
            interrupt::check()?;
            let decay = &recorded.decay;
            let single = fit_added(decay, fit, &effect);
            let lasting = |fit: Fitted| with_lasting_mode(decay, fit, &effect);
            if single.converged && single.over_noise(decay) < ADDED_WELL {
                return Ok(lasting(single));
            }
            // Far from the noise the way from the inner model may lead astray: the set as a whole does not.
            let set = fit_over_pieces(decay, &structure);
            let best = set
                .into_iter()
                .fold(single, |best, set| if better(&set, &best) { set } else { best });
            Ok(lasting(lines_anew(decay, best)))
        })
        .collect::<Result<_>>()?;
    // From the inner model as well, the effect at zero: so that it cannot fit worse than the inner model.
    let without = |(inner, single): (&Fitted, &Fitted)| {
        let mut numbers = single.varied(&effect).expect("it has been added").to_vec();
        // Its size, the two parts of a line, or the strength at each wind speed.
        let sizes = effect.strengths().max(2);
        numbers.iter_mut().take(sizes).for_each(|n| *n = 0.0);
        [&inner.parameters[..], &numbers].concat()
    };
    let zero: Vec<Vec<f64>> = inner.fits.iter().zip(&singles).map(without).collect();
    let others = if singles.len() > 1 { vec![zero.clone()] } else { Vec::new() };
    let fit = fit_jointly(data, &structure, &singles, &others)?;
    if fit.sum_of_squares <= inner.sum_of_squares {
        return Ok(fit);
    }
    // Another valley than the inner model's, or one that quick simulations have shifted.
    let (releases, sharing) = (data.releases(), data.sharing(structure.effects.len()));
    let beside = joint::fit(&releases, &structure.precisely(), &sharing, &zero);
    interrupt::check()?;
    Ok(nested(if beside.is_better_than(&fit) { beside } else { fit }, inner))
}

/// What fits worse than the model it contains has not converged.
fn nested(mut fit: JointFit, inner: &JointFit) -> JointFit {
    fit.converged &= fit.sum_of_squares <= inner.sum_of_squares * (1.0 + 1e-9);
    fit
}
