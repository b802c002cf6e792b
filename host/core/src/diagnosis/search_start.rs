//! What a search begins with: the model that is there, and every effect beside it, one at a time.

use crate::at_once::AtOnce;
use crate::diagnosis::answer::Options;
use crate::effects::Effect;
use crate::error::{Error, Result};
use crate::fit::fitting::{fit_added, fit_plain_within, Fitted, Structure};
use crate::fit::free_decay::FreeDecay;

/// The model that is there already ([`Options::present`]), fitted to `decay`.
///
/// # Errors
/// Where it cannot be fitted, or interrupted.
pub fn present(decay: &FreeDecay, options: &Options) -> Result<Fitted> {
    let Options { zero_unknown, present, .. } = options;
    let structure = Structure { zero_unknown: *zero_unknown, ..present.clone() };
    let plain = fit_plain_within(decay, &structure, decay.yaw_rad.len());
    let model = present.effects.iter().fold(plain, |model, e| fit_added(decay, &model, e));
    decay.stop.check()?;
    if model.converged || present.effects.is_empty() {
        return Ok(model);
    }
    Err(Error::NotFitted)
}

/// Effects of the library that a measured law among those that are `there` bends to: no record says that
/// they are not the law's.
pub(super) fn held_by_law(there: &[Effect]) -> Vec<Effect> {
    let held = |e: &Effect| there.iter().filter_map(Effect::measured).any(|law| law.holds(e));
    Effect::deterministic().filter(held).collect()
}

/// Effects of the library that `decay` may show beside those that are `there`.
pub(super) fn library(decay: &FreeDecay, there: &[Effect]) -> Vec<Effect> {
    let held = held_by_law(there);
    let may_show = |e: &Effect| {
        decay.amplitude_rad >= e.distinct_from_rad()
            && e.is_seen_in(&decay.measurand)
            && !there.contains(e)
            && !held.contains(e)
    };
    Effect::deterministic().filter(may_show).collect()
}

/// The present model with every candidate beside it, one at a time: what a search begins with.
#[derive(Clone)]
pub(crate) struct SearchStart {
    pub(crate) plain: Fitted,
    pub(crate) candidates: Vec<Effect>,
    /// In the order of the candidates.
    pub(crate) singles: Vec<Fitted>,
}

impl SearchStart {
    /// # Errors
    /// Where the present model cannot be fitted, or interrupted.
    pub(crate) fn of(decay: &FreeDecay, options: &Options) -> Result<Self> {
        let zero_unknown = options.zero_unknown;
        let plain = present(decay, options)?;
        let there = &plain.structure.effects;
        let mut candidates = library(decay, there);
        candidates.retain(|e| !(e.is_flexible() || zero_unknown && e.moves_rest()));
        for own in options.own.iter().filter(|e| e.is_own()) {
            if !candidates.contains(own) && !there.contains(own) {
                candidates.push(own.clone());
            }
        }
        let singles = candidates.iter().map_at_once(|e| fit_added(decay, &plain, e)).collect();
        decay.stop.check()?;
        Ok(Self { plain, candidates, singles })
    }

    pub(super) fn without(&self, effect: &Effect) -> Self {
        let mut less = self.clone();
        if let Some(at) = less.candidates.iter().position(|e| e == effect) {
            less.candidates.remove(at);
            less.singles.remove(at);
        }
        less
    }
}
