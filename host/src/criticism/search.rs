//! Which effects a swing needs: each alone, the best together, the needless taken out again.

use super::effects::Effect;
use super::fitting::{fit_added, fit_plain, fit_removed, promise, reordered, Fitted};
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
const MOST_EFFECTS: usize = 4;
/// Effects tried beside each model of a round after the first, those that promise most.
const BRANCHES: usize = 5;
/// Evidence that a linear step must promise for an effect to be tried beside a model that explains the swing.
const PROMISING: f64 = 3.0;
/// Share of an effect's linear gain that one must reach to be tried in its place.
const RIVALLING: f64 = 0.7;

/// What the search found.
pub struct Found {
    /// The swing with the noise floor as the best model shows it.
    pub swing: Swing,
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
pub fn search(swing: &Swing, zero_unknown: bool) -> Result<Found> {
    let count = swing.yaw_rad.len();
    let plain = fit_plain(swing, zero_unknown, count);
    let candidates: Vec<Effect> =
        Effect::deterministic().filter(|e| !(zero_unknown && *e == Effect::StaticOffset)).collect();
    let singles: Vec<Fitted> =
        candidates.par_iter().map(|e| fit_added(swing, &plain, *e)).collect();
    interrupt::check()?;
    let leading = best(&singles).filter(|s| criterion(s) < criterion(&plain)).unwrap_or(&plain);
    let mut swing = swing.clone().sharpened(&leading.residuals);
    let best_count = |models: &[Fitted]| best(models).map_or(count as f64, Fitted::effective_count);

    // Rounds of pairs, threes and fours, as long as the best so far is not down to the noise or gains by another.
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
        if !is_worth(&smaller, leader, &swing, count as f64) {
            break;
        }
        let next = if is_explained(leader, &swing) {
            beside(&swing, leader, &candidates)
        } else {
            expanded(&swing, last, &candidates, if rounds.len() < 3 { BEAM } else { 1 })
        };
        interrupt::check()?;
        if let Some(better) = best(&next).filter(|n| criterion(n) < criterion(leader)) {
            swing = swing.sharpened(&better.residuals);
        }
        rounds.push(next);
    }

    let mut accepted = plain.clone();
    for round in &rounds {
        let effective = best_count(round);
        if let Some(leader) = best(round) {
            if is_worth(&accepted, leader, &swing, effective) {
                accepted = leader.clone();
            }
        }
    }
    let accepted = pruned(&swing, accepted);
    interrupt::check()?;
    let explained = is_explained(&accepted, &swing);
    let indistinguishable =
        if explained { rivals(&swing, &accepted, &candidates, &rounds) } else { Vec::new() };
    interrupt::check()?;
    let path = path(&plain, &accepted, &singles, &swing);
    Ok(Found { swing, plain, singles, path, explained, indistinguishable })
}

/// The converged model with the smallest criterion.
fn best(models: &[Fitted]) -> Option<&Fitted> {
    models.iter().filter(|m| m.converged).min_by(|a, b| criterion(a).total_cmp(&criterion(b)))
}

fn criterion(model: &Fitted) -> f64 {
    let n = model.count as f64;
    n * (model.sum_of_squares / n).ln() + model.parameters.len() as f64 * n.ln()
}

/// `model`, which explains the swing, with every other effect that promises evidence beside it.
fn beside(swing: &Swing, model: &Fitted, all: &[Effect]) -> Vec<Fitted> {
    let n = model.effective_count();
    all.par_iter()
        .filter(|e| !model.structure.effects.contains(e))
        .filter(|e| {
            let (left, more) = promise(swing, model, **e);
            n * (model.sum_of_squares / left).ln() - more as f64 * n.ln() > PROMISING
        })
        .map(|e| fit_added(swing, model, *e))
        .collect()
}

/// Each of the `width` best with the effects that promise most beside it, each set once.
fn expanded(swing: &Swing, round: &[Fitted], all: &[Effect], width: usize) -> Vec<Fitted> {
    let mut order: Vec<&Fitted> = round.iter().filter(|m| m.converged).collect();
    order.sort_by(|a, b| criterion(a).total_cmp(&criterion(b)));
    order.truncate(width);
    let promised: Vec<Vec<(f64, Effect)>> = order
        .par_iter()
        .map(|inner| {
            let mut out: Vec<(f64, Effect)> = all
                .par_iter()
                .filter(|e| !inner.structure.effects.contains(e))
                .map(|e| (promise(swing, inner, *e).0, *e))
                .collect();
            out.sort_by(|a, b| a.0.total_cmp(&b.0));
            out
        })
        .collect();
    let mut seen: Vec<Vec<Effect>> = Vec::new();
    let mut jobs = Vec::new();
    for (inner, promised) in order.into_iter().zip(promised) {
        for (_, effect) in promised.into_iter().take(BRANCHES) {
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
    model: &Fitted,
    candidates: &[Effect],
    rounds: &[Vec<Fitted>],
) -> Vec<(Effect, Effect)> {
    let effects = &model.structure.effects;
    let effective = model.effective_count();
    let as_good = |other: &Fitted| {
        other.converged && is_explained(other, swing) && evidence(other, model, effective) < MARGIN
    };
    let outside: Vec<Effect> =
        candidates.iter().copied().filter(|c| !effects.contains(c)).collect();
    let in_place_of = |inside: &Effect| -> Vec<(Effect, Effect)> {
        if effects.len() == 1 {
            let singles = rounds[0].iter().filter(|m| m.structure.effects != *effects);
            return singles
                .filter(|m| as_good(m))
                .map(|m| (*inside, m.structure.effects[0]))
                .collect();
        }
        let inner = fit_removed(swing, model, *inside);
        let gain = |e: Effect| inner.sum_of_squares - promise(swing, &inner, e).0;
        let least = RIVALLING * gain(*inside);
        outside
            .par_iter()
            .filter(|e| gain(**e) >= least && as_good(&fit_added(swing, &inner, **e)))
            .map(|e| (*inside, *e))
            .collect()
    };
    effects.par_iter().flat_map_iter(in_place_of).collect()
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
