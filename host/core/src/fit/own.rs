//! A user's own effect added to several releases at once. Its simulations take long, so its numbers are
//! looked for in the two releases that need it most, from there in all together, and by fixed steps as long
//! as it is not steep; the last fit is by steps that adapt themselves.

use crate::effects::Effect;
use crate::fit::fitting::{enough, fit_added, Fitted, Structure};
use crate::fit::joint::{self, JointFit, Release, Sharing};

/// `inner` with `effect` added, whose numbers `sharing` gives to all releases; never worse than `inner` where
/// the effect can vanish.
pub fn added(
    releases: &[Release],
    sharing: &Sharing,
    inner: &JointFit,
    effect: &Effect,
) -> JointFit {
    let structure = inner.structure.with(effect);
    let swift = Structure { swift: true, ..structure.clone() };
    let from = |numbers: &[f64]| {
        let start = |fit: &Fitted| [&fit.parameters[..], numbers].concat();
        let starts: Vec<_> = inner.fits.iter().map(start).collect();
        joint::fit(releases, &swift, sharing, &starts)
    };
    let finished = |fit: JointFit| {
        let starts: Vec<_> = fit.fits.iter().map(|fit| fit.parameters.clone()).collect();
        joint::fit(releases, &structure, sharing, &starts)
    };
    let mut order: Vec<usize> = (0..releases.len()).collect();
    let misfit = |k: &usize| inner.fits[*k].over_noise(releases[*k].decay);
    order.sort_by(|a, b| misfit(b).total_cmp(&misfit(a)));
    let better = |best: Option<JointFit>, fit: JointFit| match best {
        Some(best) if !fit.is_better_than(&best) => best,
        _ => fit,
    };
    let mut best: Option<JointFit> = None;
    for &k in order.iter().take(2) {
        let mut alone = inner.fits[k].clone();
        alone.structure.swift = true;
        let single = fit_added(releases[k].decay, &alone, effect);
        let fit = better(best.take(), from(single.varied(effect).expect("it has been added")));
        let surely = fit.converged && fit.sum_of_squares <= enough(fit.count);
        best = Some(fit);
        if surely {
            break;
        }
    }
    let best = finished(best.expect("a release"));
    if best.sum_of_squares <= inner.sum_of_squares {
        return best;
    }
    let Release { decay, .. } = releases[order[0]];
    let starts = crate::fit::starts::of(decay, &inner.fits[order[0]], effect);
    better(Some(best), finished(from(&starts[0])))
}
