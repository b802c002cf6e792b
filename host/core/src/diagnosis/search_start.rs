//! What a search begins with: the model that is there, and every effect beside it, one at a time.

use crate::diagnosis::answer::Options;
use crate::effects::Effect;
use crate::error::{Error, Result};
use crate::fit::fitting::{fit_added, fit_plain_within, Fitted, Structure};
use crate::fit::free_decay::FreeDecay;
use crate::par_map::ParMap;

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

/// Effects of the library that `decay` may show beside those that are `there`: those to be tried; and those
/// that a measured law among them bends to, of which no record says that they are not the law's.
fn tried_and_held(decay: &FreeDecay, there: &[Effect]) -> (Vec<Effect>, Vec<Effect>) {
    let may_show = |e: &Effect| {
        decay.amplitude_rad >= e.distinct_from_rad()
            && e.is_seen_in(&decay.measurand)
            && !there.contains(e)
    };
    let held = |e: &Effect| there.iter().filter_map(Effect::measured).any(|law| law.holds(e));
    Effect::deterministic().filter(may_show).partition(|e| !held(e))
}

/// Effects of the library to be tried beside those that are `there`.
pub(super) fn library(decay: &FreeDecay, there: &[Effect]) -> Vec<Effect> {
    tried_and_held(decay, there).0
}

/// Effects of the library that one of `decays` may show, and a measured law that is `there` holds.
pub(super) fn held_by_law(decays: &[FreeDecay], there: &[Effect]) -> Vec<Effect> {
    let mut held: Vec<Effect> =
        decays.iter().flat_map(|decay| tried_and_held(decay, there).1).collect();
    held.sort_unstable();
    held.dedup();
    held
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
    pub(crate) fn new(decay: &FreeDecay, options: &Options) -> Result<Self> {
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
        let singles = candidates.iter().par_map(|e| fit_added(decay, &plain, e)).collect();
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
