//! Which effects the releases of a campaign need: each has coefficients of its own, and all are judged as one.

use crate::bic::{self, MARGIN};
use crate::diagnosis::diagnose::Options;
use crate::diagnosis::forced::forced_rather_than;
use crate::diagnosis::origin::weighted_mean;
use crate::diagnosis::search;
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::fitting::{fit_added, fit_plain, fit_removed, Fitted};
use crate::fit::free_decay::FreeDecay;
use crate::quantity::Quantity;
use rayon::prelude::*;

/// Every effect is tried on so many releases, those that are explained worst; the likeliest then on all.
const SCREENED: usize = 8;
const MOST_PROPOSED: usize = 3;
const MOST_EFFECTS: usize = 4;
/// Evidence for a line over that for an effect of the state, from which on the line comes first.
const CLEARLY: f64 = 1.5;
/// An effect whose course is less than this share of the noise floor in every release does not matter, squared: more
/// than in one record, the largest of many being more by chance.
const LEAST_SHARE_SQUARED: f64 = 0.03;

/// The releases with the wind speed of each.
pub(crate) struct Releases<'a> {
    pub decays: Vec<&'a FreeDecay>,
    pub wind_speed_m_s: Vec<f64>,
}

impl Releases<'_> {
    /// # Errors
    /// [`Error::Interrupted`](crate::error::Error::Interrupted) once somebody has asked for it.
    pub(crate) fn check(&self) -> Result<()> {
        self.decays.iter().try_for_each(|decay| decay.stop.check())
    }

    fn pick(&self, which: &[usize]) -> Self {
        Self {
            decays: which.iter().map(|&i| self.decays[i]).collect(),
            wind_speed_m_s: which.iter().map(|&i| self.wind_speed_m_s[i]).collect(),
        }
    }
}

/// One structure, each release with numbers of its own.
#[derive(Clone)]
pub(crate) struct Model {
    pub effects: Vec<Effect>,
    pub fits: Vec<Fitted>,
}

impl Model {
    fn pick(&self, which: &[usize]) -> Self {
        let fits = which.iter().map(|&i| self.fits[i].clone()).collect();
        Self { effects: self.effects.clone(), fits }
    }

    /// The releases it explains worst.
    fn worst(&self, releases: &Releases) -> Vec<usize> {
        let over: Vec<f64> =
            self.fits.iter().zip(&releases.decays).map(|(f, decay)| f.over_noise(decay)).collect();
        let mut all: Vec<usize> = (0..over.len()).collect();
        all.sort_by(|&a, &b| over[b].total_cmp(&over[a]));
        all.truncate(SCREENED);
        all.sort_unstable();
        all
    }
}

/// An effect added to a model in the screened releases.
pub(crate) struct Single {
    pub effect: Effect,
    pub residual_over_noise: f64,
    pub evidence: f64,
    pub converged: bool,
    model: Model,
}

pub(crate) struct Judged {
    /// Every effect alone, best first, in the releases that the plain model explains worst.
    pub singles: Vec<Single>,
    /// From plain to final, an effect more each.
    pub path: Vec<Model>,
    pub indistinguishable: Vec<(Effect, Effect)>,
}

/// Pooled rms of the residuals over each release's noise.
pub(crate) fn over_noise<'a>(
    fits: impl IntoIterator<Item = &'a Fitted>,
    decays: &[&FreeDecay],
) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for (fit, decay) in fits.into_iter().zip(decays) {
        sum += fit.count as f64 * fit.over_noise(decay).powi(2);
        n += fit.count as f64;
    }
    f64::sqrt(sum / f64::max(n, 1.0))
}

/// The first of an effect's numbers in a release.
pub(crate) fn coefficient(fit: &Fitted, effect: &Effect) -> Option<Quantity> {
    let name = format!("{effect}.{}", effect.parameters()[0].name);
    fit.effect_parameters().into_iter().find(|(n, _)| *n == name).map(|(_, q)| q)
}

/// Gain in the information criterion by `effect`, which `larger` has and `smaller` has not. The best of: a coefficient
/// of its own in each release that needs one; one coefficient for all releases, for the wind-on or the wind-off ones.
fn evidence(
    releases: &Releases<'_>,
    smaller: &[Fitted],
    larger: &[Fitted],
    effect: &Effect,
) -> f64 {
    let more = effect.parameters().len() as f64;
    let gains: Vec<(f64, f64)> = smaller
        .iter()
        .zip(larger)
        .map(|(small, large)| {
            let n = large.effective_count();
            let gain = bic::gain(small.sum_of_squares, large.sum_of_squares, n, 0.0);
            (if large.converged { gain.max(0.0) } else { 0.0 }, n)
        })
        .collect();
    let own: f64 = gains.iter().map(|(gain, n)| (gain - bic::cost(more, *n)).max(0.0)).sum();
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
        gain - misfit - bic::cost(1.0, f64::max(n, 2.0))
    };
    own.max(one(&|_| true)).max(one(&|v| v > 0.0)).max(one(&|v| v == 0.0))
}

/// Whether the effect shows in some release.
fn matters(releases: &Releases, smaller: &[Fitted], larger: &[Fitted]) -> bool {
    let share = |((small, large), decay): ((&Fitted, &Fitted), &&FreeDecay)| {
        large.converged
            && small.over_noise(decay).powi(2) - large.over_noise(decay).powi(2)
                > LEAST_SHARE_SQUARED
    };
    smaller.iter().zip(larger).zip(&releases.decays).any(share)
}

/// Judges all releases as one.
///
/// # Errors
/// Interrupted, once somebody asked for it.
pub(crate) fn judge(releases: &Releases, options: &Options) -> Result<Judged> {
    let zero = options.zero_unknown;
    let plain = Model {
        effects: Vec::new(),
        fits: releases
            .decays
            .par_iter()
            .map(|decay| fit_plain(decay, zero, decay.yaw_rad.len()))
            .collect(),
    };
    let library: Vec<Effect> = Effect::deterministic()
        .filter(|e| !(zero && e.moves_rest()) && e.distinct_from_rad() == 0.0)
        .filter(|e| !e.is_flexible())
        .chain(options.own.iter().filter(|e| e.is_own()).cloned())
        .collect();
    let singles = screened(releases, &plain, &library)?;
    let mut path = vec![plain];
    while path.len() <= MOST_EFFECTS {
        let here = path.last().expect("the plain model");
        let others;
        let screen = if here.effects.is_empty() {
            &singles
        } else {
            others = screened(releases, here, &library)?;
            &others
        };
        let proposed: Vec<(f64, Model)> = screen
            .iter()
            .filter(|single| single.evidence > 0.0)
            .take(MOST_PROPOSED)
            .map(|single| {
                let larger = added(releases, here, &single.effect)?;
                Ok((evidence(releases, &here.fits, &larger.fits, &single.effect), larger))
            })
            .collect::<Result<_>>()?;
        let next = proposed
            .into_iter()
            .filter(|(evidence, larger)| {
                *evidence > MARGIN && matters(releases, &here.fits, &larger.fits)
            })
            .max_by(|a, b| clear_of_lines(a).total_cmp(&clear_of_lines(b)));
        let Some((_, next)) = next else { break };
        path.push(next);
        // Chance is not chased with ever more effects.
        if path.len() == 2 && is_forced(releases, &path[0], &path[1]) {
            break;
        }
    }
    let last = path.pop().expect("a model");
    let all = last.effects.clone();
    let kept = pruned(releases, last)?;
    if kept.effects == all || kept.effects.is_empty() {
        path.truncate(kept.effects.len());
    } else {
        // The way there once more, without what was taken out of it.
        path.truncate(1);
        for effect in &kept.effects[..kept.effects.len() - 1] {
            path.push(added(releases, path.last().expect("a model"), &effect.clone())?);
        }
    }
    path.push(kept);
    let indistinguishable = rivals(releases, &path, &singles, &library)?;
    Ok(Judged { singles, path, indistinguishable })
}

/// The evidence for a model's last effect against others': what adds a line, with numbers for each release, stands for much
/// that bends where the right effects are not all there yet.
fn clear_of_lines((evidence, model): &(f64, Model)) -> f64 {
    let is_line = model.effects.last().is_some_and(|e| e.line().is_some());
    if is_line {
        evidence / CLEARLY
    } else {
        *evidence
    }
}

/// Whether most releases with the wind on, or with it off, are randomly forced rather than explained by `best`.
pub(crate) fn is_forced(releases: &Releases, plain: &Model, best: &Model) -> bool {
    let each = releases.decays.par_iter().zip(&plain.fits).zip(&best.fits);
    let forced: Vec<bool> = each
        .map(|((decay, plain), best)| {
            !search::is_explained(best, decay) && forced_rather_than(decay, plain, best).is_some()
        })
        .collect();
    let mostly = |on: bool| {
        let inside = forced.iter().zip(&releases.wind_speed_m_s).filter(|(_, v)| (**v > 0.0) == on);
        let (all, some) = inside.fold((0, 0), |(n, k), (f, _)| (n + 1, k + usize::from(*f)));
        2 * some > all
    };
    mostly(true) || mostly(false)
}

/// Every other effect added to `inner` in the releases it explains worst; the likeliest first.
fn screened(releases: &Releases, inner: &Model, library: &[Effect]) -> Result<Vec<Single>> {
    let which = inner.worst(releases);
    let (releases, inner) = (releases.pick(&which), inner.pick(&which));
    let mut out: Vec<Single> = library
        .par_iter()
        .filter(|e| !inner.effects.contains(e))
        .map(|effect| {
            let model = added(&releases, &inner, effect)?;
            Ok(Single {
                effect: effect.clone(),
                residual_over_noise: over_noise(&model.fits, &releases.decays),
                evidence: evidence(&releases, &inner.fits, &model.fits, effect),
                converged: model.fits.iter().all(|fit| fit.converged),
                model,
            })
        })
        .collect::<Result<_>>()?;
    out.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    Ok(out)
}

/// `fit` in every release, unless the user stops it.
fn each(
    releases: &Releases,
    inner: &Model,
    fit: impl Fn(&FreeDecay, &Fitted) -> Fitted + Sync,
) -> Result<Vec<Fitted>> {
    let all = inner.fits.par_iter().zip(&releases.decays);
    all.map(|(inner, decay)| decay.stop.check().map(|()| fit(decay, inner))).collect()
}

fn added(releases: &Releases, inner: &Model, effect: &Effect) -> Result<Model> {
    let mut effects = inner.effects.clone();
    effects.push(effect.clone());
    let fits = each(releases, inner, |decay, fit| fit_added(decay, fit, effect))?;
    Ok(Model { effects, fits })
}

fn removed(releases: &Releases, model: &Model, effect: &Effect) -> Result<Model> {
    let effects = model.effects.iter().filter(|&e| *e != *effect).cloned().collect();
    let fits = each(releases, model, |decay, fit| fit_removed(decay, fit, effect))?;
    Ok(Model { effects, fits })
}

/// Takes out again what the others have made needless.
fn pruned(releases: &Releases, mut model: Model) -> Result<Model> {
    while model.effects.len() > 1 {
        let without: Vec<(f64, Model)> = model
            .effects
            .iter()
            .map(|effect| {
                let smaller = removed(releases, &model, effect)?;
                let worth = evidence(releases, &smaller.fits, &model.fits, effect);
                let shows = matters(releases, &smaller.fits, &model.fits);
                Ok((if shows { worth } else { 0.0 }, smaller))
            })
            .collect::<Result<_>>()?;
        let needless = without
            .into_iter()
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(worth, _)| *worth <= MARGIN);
        match needless {
            Some((_, smaller)) => model = smaller,
            None => break,
        }
    }
    Ok(model)
}

/// Which effect does as well in the place of one of the model's, in the releases that the plain model explains worst.
fn rivals(
    releases: &Releases,
    path: &[Model],
    singles: &[Single],
    library: &[Effect],
) -> Result<Vec<(Effect, Effect)>> {
    let which = path[0].worst(releases);
    let releases = &releases.pick(&which);
    let model = path.last().expect("a model").pick(&which);
    let mut out = Vec::new();
    for inside in &model.effects {
        let alone = model.effects.len() == 1;
        let inner = if alone { path[0].pick(&which) } else { removed(releases, &model, inside)? };
        let here = evidence(releases, &inner.fits, &model.fits, inside);
        for outside in library.iter().filter(|e| !model.effects.contains(e)) {
            let known = singles.iter().find(|s| alone && s.effect == *outside);
            let other = match known {
                Some(single) => single.model.clone(),
                None => added(releases, &inner, outside)?,
            };
            let there = evidence(releases, &inner.fits, &other.fits, outside);
            let mut each = other.fits.iter().zip(&releases.decays);
            if here - there < MARGIN && each.all(|(fit, decay)| search::is_explained(fit, decay)) {
                out.push((inside.clone(), outside.clone()));
            }
        }
    }
    Ok(out)
}
