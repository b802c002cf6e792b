//! Which effects a swing needs: each alone, the best together, the needless taken out again.

use super::diagnose::Options;
use super::effects::Effect;
use super::fitting::{fit_added, fit_plain, fit_removed, reordered, Fitted};
use super::swing::Swing;
use crate::error::Result;
use crate::interrupt;
use rayon::prelude::*;

/// Gain in the information criterion below which an effect is not believed.
pub const MARGIN: f64 = 10.0;
/// Residual over noise up to which a record counts as explained.
const EXPLAINED: f64 = 1.10;
/// An effect whose course is less than this share of the noise floor does not matter, squared.
const LEAST_SHARE_SQUARED: f64 = 0.03;
/// Models carried on to the next round.
const BEAM: usize = 4;
const MOST_EFFECTS: usize = 3;

/// What the search found.
pub struct Found {
    pub plain: Fitted,
    /// Every effect alone, in the order of the library.
    pub singles: Vec<Fitted>,
    /// The models from plain to final, an effect more each.
    pub path: Vec<Fitted>,
    pub explained: bool,
    /// For an accepted effect those that do as well in its place.
    pub indistinguishable: Vec<(Effect, Effect)>,
}

/// Difference of the Bayesian information criterion in favour of `larger`, on `effective` independent residuals.
pub fn evidence(smaller: &Fitted, larger: &Fitted, effective: f64) -> f64 {
    let more = larger.parameters.len() as f64 - smaller.parameters.len() as f64;
    effective * (smaller.sum_of_squares / larger.sum_of_squares).ln() - more * effective.ln()
}

/// Whether residual and noise floor agree; in few means their ratio scatters more.
pub fn is_explained(fitted: &Fitted, swing: &Swing) -> bool {
    let scatter = 3.0 / (2.0 * fitted.effective_count()).sqrt();
    fitted.over_noise(swing) <= EXPLAINED.max(1.0 + scatter.min(0.3))
}

/// Whether `larger` is worth its effect: believed, and of a size that shows.
fn is_worth(smaller: &Fitted, larger: &Fitted, swing: &Swing, effective: f64) -> bool {
    let share = smaller.over_noise(swing).powi(2) - larger.over_noise(swing).powi(2);
    larger.converged && evidence(smaller, larger, effective) > MARGIN && share > LEAST_SHARE_SQUARED
}

/// Searches.
///
/// # Errors
/// 130 where the user stops it.
pub fn search(swing: &Swing, options: &Options) -> Result<Found> {
    let zero_unknown = options.zero_unknown;
    let count = swing.yaw_rad.len();
    let plain = fit_plain(swing, zero_unknown, count);
    let mut candidates: Vec<Effect> =
        Effect::deterministic().filter(|e| !(zero_unknown && *e == Effect::StaticOffset)).collect();
    for own in options.own.iter().filter(|e| matches!(e, Effect::Own(_))) {
        if !candidates.contains(own) {
            candidates.push(*own);
        }
    }
    let singles: Vec<Fitted> =
        candidates.par_iter().map(|e| fit_added(swing, &plain, *e)).collect();
    interrupt::check()?;
    let best_count = |models: &[Fitted]| best(models).map_or(count as f64, Fitted::effective_count);

    // Rounds of pairs and threes, as long as the best so far is not down to the noise or gains by another.
    let mut rounds: Vec<Vec<Fitted>> = vec![singles.clone()];
    while rounds.len() < MOST_EFFECTS {
        let last = rounds.last().expect("a round");
        let Some(leader) = best(last) else { break };
        let smaller = if rounds.len() == 1 {
            plain.clone()
        } else {
            best(&rounds[rounds.len() - 2]).expect("a leader").clone()
        };
        // The round gained nothing even on the kindest count of residuals: no further one will.
        if !is_worth(&smaller, leader, swing, count as f64) {
            break;
        }
        let width = if is_explained(leader, swing) { 1 } else { BEAM };
        let next = expanded(swing, last, &candidates, width);
        interrupt::check()?;
        rounds.push(next);
    }

    let mut accepted = plain.clone();
    for round in &rounds {
        let effective = best_count(round);
        if let Some(leader) = best(round) {
            if is_worth(&accepted, leader, swing, effective) {
                accepted = leader.clone();
            }
        }
    }
    let accepted = pruned(swing, accepted);
    interrupt::check()?;
    let explained = is_explained(&accepted, swing);
    let indistinguishable =
        if explained { rivals(swing, &plain, &accepted, &candidates, &rounds) } else { Vec::new() };
    interrupt::check()?;
    let path = path(&plain, &accepted, &singles, swing);
    Ok(Found { plain, singles, path, explained, indistinguishable })
}

/// The converged model with the smallest criterion.
fn best(models: &[Fitted]) -> Option<&Fitted> {
    models.iter().filter(|m| m.converged).min_by(|a, b| criterion(a).total_cmp(&criterion(b)))
}

fn criterion(model: &Fitted) -> f64 {
    let n = model.count as f64;
    n * (model.sum_of_squares / n).ln() + model.parameters.len() as f64 * n.ln()
}

/// Each of the `width` best with every other effect, each set once.
fn expanded(swing: &Swing, round: &[Fitted], all: &[Effect], width: usize) -> Vec<Fitted> {
    let mut order: Vec<&Fitted> = round.iter().filter(|m| m.converged).collect();
    order.sort_by(|a, b| criterion(a).total_cmp(&criterion(b)));
    let mut seen: Vec<Vec<Effect>> = Vec::new();
    let mut jobs = Vec::new();
    for inner in order.into_iter().take(width) {
        for &effect in all.iter().filter(|e| !inner.structure.effects.contains(e)) {
            let mut set = inner.structure.with(effect).effects;
            set.sort_unstable();
            if !seen.contains(&set) {
                seen.push(set);
                jobs.push((inner, effect));
            }
        }
    }
    jobs.into_par_iter().map(|(inner, effect)| fit_added(swing, inner, effect)).collect()
}

/// Takes out again what the others have made needless.
fn pruned(swing: &Swing, mut model: Fitted) -> Fitted {
    loop {
        let effective = model.effective_count();
        let smaller: Vec<Fitted> = model
            .structure
            .effects
            .clone()
            .into_par_iter()
            .map(|effect| fit_removed(swing, &model, effect))
            .collect();
        let needless = smaller
            .into_iter()
            .filter(|s| s.converged && !is_worth(s, &model, swing, effective))
            .min_by(|a, b| criterion(a).total_cmp(&criterion(b)));
        match needless {
            Some(smaller) => model = smaller,
            None => return model,
        }
    }
}

/// Which effect outside the model does as well in the place of one inside.
fn rivals(
    swing: &Swing,
    plain: &Fitted,
    model: &Fitted,
    candidates: &[Effect],
    rounds: &[Vec<Fitted>],
) -> Vec<(Effect, Effect)> {
    let effects = &model.structure.effects;
    let jobs: Vec<(Effect, Effect)> = effects
        .iter()
        .flat_map(|e| candidates.iter().filter(|c| !effects.contains(c)).map(move |c| (*e, *c)))
        .collect();
    let effective = model.effective_count();
    jobs.into_par_iter()
        .filter(|&(inside, outside)| {
            let mut set = model.structure.without(inside).with(outside).effects;
            set.sort_unstable();
            let known = rounds.iter().flatten().find(|m| {
                let mut other = m.structure.effects.clone();
                other.sort_unstable();
                other == set
            });
            let fitted;
            let other = match known {
                Some(m) => m,
                None if effects.len() == 1 => {
                    fitted = fit_added(swing, plain, outside);
                    &fitted
                }
                None => {
                    let inner = fit_removed(swing, model, inside);
                    fitted = fit_added(swing, &inner, outside);
                    &fitted
                }
            };
            other.converged
                && is_explained(other, swing)
                && evidence(other, model, effective) < MARGIN
        })
        .collect()
}

/// From plain to `model`, each time the effect that helps most; the last holds its effects in that order.
fn path(plain: &Fitted, model: &Fitted, singles: &[Fitted], swing: &Swing) -> Vec<Fitted> {
    let mut left = model.structure.effects.clone();
    let single = |e: Effect| singles.iter().find(|s| s.structure.effects == [e]);
    left.sort_by(|a, b| {
        let sum = |e: &Effect| single(*e).map_or(f64::INFINITY, |s| s.sum_of_squares);
        sum(a).total_cmp(&sum(b))
    });
    let mut out = vec![plain.clone()];
    for (k, &effect) in left.iter().enumerate() {
        let inner = out.last().expect("the plain model");
        let next = match single(effect) {
            _ if k + 1 == left.len() => reordered(swing, model, &left),
            Some(s) if k == 0 => s.clone(),
            _ => fit_added(swing, inner, effect),
        };
        out.push(next);
    }
    out
}
