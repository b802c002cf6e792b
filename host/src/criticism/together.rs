//! Which effects the releases of a campaign need: each release searched alone, then all judged as one.

use super::diagnose::Options;
use super::effects::Effect;
use super::fitting::{fit_added, fit_removed, Fitted};
use super::origin::weighted_mean;
use super::search::{self, Found, LEAST_SHARE_SQUARED, MARGIN};
use super::swing::Swing;
use crate::error::Result;
use crate::interrupt;
use crate::quantity::Quantity;
use rayon::prelude::*;

/// Effects tried together at most: those that single releases name, and the likeliest.
const MOST_PROPOSED: usize = 6;
const MOST_EFFECTS: usize = 4;

/// The releases with the wind speed of each.
pub struct Releases {
    pub swings: Vec<Swing>,
    pub wind_speed_m_s: Vec<f64>,
}

/// One structure, each release with numbers of its own.
#[derive(Clone)]
pub struct Model {
    pub effects: Vec<Effect>,
    pub fits: Vec<Fitted>,
}

/// An effect alone in all releases.
pub struct Single {
    pub effect: Effect,
    pub fits: Vec<Fitted>,
    pub evidence: f64,
}

pub struct Judged {
    /// Each release by itself.
    pub found: Vec<Found>,
    /// Best first.
    pub singles: Vec<Single>,
    /// From plain to final, an effect more each.
    pub path: Vec<Model>,
    pub indistinguishable: Vec<(Effect, Effect)>,
}

/// Pooled rms of the residuals over each release's noise.
pub fn over_noise<'a>(fits: impl IntoIterator<Item = &'a Fitted>, swings: &[Swing]) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for (fit, swing) in fits.into_iter().zip(swings) {
        sum += fit.count as f64 * fit.over_noise(swing).powi(2);
        n += fit.count as f64;
    }
    f64::sqrt(sum / f64::max(n, 1.0))
}

/// The first of an effect's numbers in a release.
pub fn coefficient(fit: &Fitted, effect: Effect) -> Option<Quantity> {
    let name = format!("{effect}.{}", effect.parameters()[0].name);
    fit.effect_parameters().into_iter().find(|(n, _)| *n == name).map(|(_, q)| q)
}

/// Gain in the information criterion by `effect`, which `larger` has and `smaller` has not. The best of: a coefficient
/// of its own in each release that needs one; one coefficient for all releases, for the wind-on or the wind-off ones.
fn evidence(releases: &Releases, smaller: &[Fitted], larger: &[Fitted], effect: Effect) -> f64 {
    let more = effect.parameters().len() as f64;
    let gains: Vec<(f64, f64)> = smaller
        .iter()
        .zip(larger)
        .map(|(small, large)| {
            let n = large.effective_count();
            let gain = n * (small.sum_of_squares / large.sum_of_squares).ln();
            (if large.converged { gain.max(0.0) } else { 0.0 }, n)
        })
        .collect();
    let own: f64 = gains.iter().map(|(gain, n)| (gain - more * n.ln()).max(0.0)).sum();
    if more > 1.0 || effect.belongs_to_release(0) {
        return own;
    }
    let sizes: Vec<Option<Quantity>> = larger.iter().map(|fit| coefficient(fit, effect)).collect();
    let one = |among: &dyn Fn(f64) -> bool| {
        let inside: Vec<usize> =
            (0..larger.len()).filter(|&i| among(releases.wind_speed_m_s[i])).collect();
        let known: Vec<Quantity> = inside.iter().filter_map(|&i| sizes[i]).collect();
        let Some(mean) = weighted_mean(known.iter().copied()) else { return 0.0 };
        let misfit: f64 = known
            .iter()
            .filter(|q| q.u > 0.0 && q.u.is_finite())
            .map(|q| ((q.value - mean.value) / q.u).powi(2))
            .sum();
        let (gain, n) =
            inside.iter().fold((0.0, 0.0), |s, &i| (s.0 + gains[i].0, s.1 + gains[i].1));
        gain - misfit - f64::max(n, 2.0).ln()
    };
    own.max(one(&|_| true)).max(one(&|v| v > 0.0)).max(one(&|v| v == 0.0))
}

/// Whether the effect shows in some release.
fn matters(releases: &Releases, smaller: &[Fitted], larger: &[Fitted]) -> bool {
    let share = |((small, large), swing): ((&Fitted, &Fitted), &Swing)| {
        large.converged
            && small.over_noise(swing).powi(2) - large.over_noise(swing).powi(2)
                > LEAST_SHARE_SQUARED
    };
    smaller.iter().zip(larger).zip(&releases.swings).any(share)
}

/// Judges all releases as one.
///
/// # Errors
/// 130 where the user stops it.
pub fn judge(releases: &Releases, options: &Options) -> Result<Judged> {
    let found: Vec<Found> = releases
        .swings
        .par_iter()
        .map(|swing| search::search(swing, options.zero_unknown))
        .collect::<Result<_>>()?;
    let plain: Vec<Fitted> = found.iter().map(|f| f.plain.clone()).collect();
    let mut singles: Vec<Single> = (0..found[0].singles.len())
        .map(|k| {
            let effect = found[0].singles[k].structure.effects[0];
            let fits: Vec<Fitted> = found.iter().map(|f| f.singles[k].clone()).collect();
            let evidence = evidence(releases, &plain, &fits, effect);
            Single { effect, fits, evidence }
        })
        .collect();
    singles.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    let proposed = proposed(&found, &singles);

    let mut path = vec![Model { effects: Vec::new(), fits: plain }];
    while path.len() <= MOST_EFFECTS {
        let here = path.last().expect("the plain model");
        let next = proposed
            .iter()
            .filter(|e| !here.effects.contains(e))
            .map(|&effect| {
                let larger = added(releases, here, effect, &singles);
                (evidence(releases, &here.fits, &larger.fits, effect), larger)
            })
            .filter(|(evidence, larger)| {
                *evidence > MARGIN && matters(releases, &here.fits, &larger.fits)
            })
            .max_by(|a, b| a.0.total_cmp(&b.0));
        interrupt::check()?;
        let Some((_, next)) = next else { break };
        path.push(next);
    }
    let last = path.pop().expect("a model");
    let last_effects = last.effects.clone();
    let kept = pruned(releases, last)?;
    if kept.effects == last_effects || kept.effects.is_empty() {
        path.truncate(kept.effects.len());
    } else {
        // The way there once more, without what was taken out of it.
        path.truncate(1);
        for &effect in &kept.effects[..kept.effects.len() - 1] {
            path.push(added(releases, path.last().expect("a model"), effect, &singles));
        }
    }
    path.push(kept);
    let indistinguishable = rivals(releases, &path, &singles, &proposed);
    interrupt::check()?;
    Ok(Judged { found, singles, path, indistinguishable })
}

/// What single releases name, most often first, and then the likeliest.
fn proposed(found: &[Found], singles: &[Single]) -> Vec<Effect> {
    let votes = |effect: Effect| {
        let names = |f: &&Found| {
            let last = f.path.last().map_or(&[][..], |m| &m.structure.effects);
            last.contains(&effect) || f.indistinguishable.iter().any(|(_, b)| *b == effect)
        };
        found.iter().filter(names).count()
    };
    let mut all: Vec<(usize, f64, Effect)> = singles
        .iter()
        .map(|s| (votes(s.effect), s.evidence, s.effect))
        .filter(|(votes, evidence, _)| *votes > 0 || *evidence > MARGIN)
        .collect();
    all.sort_by(|a, b| b.0.cmp(&a.0).then(b.1.total_cmp(&a.1)));
    all.into_iter().take(MOST_PROPOSED).map(|(_, _, effect)| effect).collect()
}

fn added(releases: &Releases, inner: &Model, effect: Effect, singles: &[Single]) -> Model {
    let mut effects = inner.effects.clone();
    effects.push(effect);
    let known = singles.iter().find(|s| inner.effects.is_empty() && s.effect == effect);
    let fits = known.map_or_else(
        || {
            let each = inner.fits.par_iter().zip(&releases.swings);
            each.map(|(fit, swing)| fit_added(swing, fit, effect)).collect()
        },
        |single| single.fits.clone(),
    );
    Model { effects, fits }
}

fn removed(releases: &Releases, model: &Model, effect: Effect) -> Model {
    let effects = model.effects.iter().copied().filter(|e| *e != effect).collect();
    let each = model.fits.par_iter().zip(&releases.swings);
    Model { effects, fits: each.map(|(fit, swing)| fit_removed(swing, fit, effect)).collect() }
}

/// Takes out again what the others have made needless.
fn pruned(releases: &Releases, mut model: Model) -> Result<Model> {
    while model.effects.len() > 1 {
        let needless = model
            .effects
            .iter()
            .map(|&effect| {
                let smaller = removed(releases, &model, effect);
                let worth = evidence(releases, &smaller.fits, &model.fits, effect);
                let shows = matters(releases, &smaller.fits, &model.fits);
                (if shows { worth } else { 0.0 }, smaller)
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(worth, _)| *worth <= MARGIN);
        interrupt::check()?;
        match needless {
            Some((_, smaller)) => model = smaller,
            None => break,
        }
    }
    Ok(model)
}

/// Which effect does as well in the place of one of the model's.
fn rivals(
    releases: &Releases,
    path: &[Model],
    singles: &[Single],
    proposed: &[Effect],
) -> Vec<(Effect, Effect)> {
    let model = path.last().expect("a model");
    let mut out = Vec::new();
    for &inside in &model.effects {
        let inner = match model.effects.len() {
            1 => path[0].clone(),
            _ => removed(releases, model, inside),
        };
        let here = evidence(releases, &inner.fits, &model.fits, inside);
        let others: Vec<Effect> = match model.effects.len() {
            1 => singles.iter().map(|s| s.effect).collect(),
            _ => proposed.to_vec(),
        };
        for outside in others.into_iter().filter(|e| !model.effects.contains(e)) {
            let other = added(releases, &inner, outside, singles);
            let there = evidence(releases, &inner.fits, &other.fits, outside);
            let explained = other
                .fits
                .iter()
                .zip(&releases.swings)
                .all(|(fit, swing)| search::is_explained(fit, swing));
            if explained && here - there < MARGIN {
                out.push((inside, outside));
            }
        }
    }
    out
}
