//! Models within each other, whatever they are judged by: effects are added to one, what others have made needless
//! is taken out of it, and from the model that is there to the final one the way is shown.

use crate::effects::Effect;
use crate::error::Result;
use crate::par_map::ParMap;
use crate::stop::Stop;
use std::slice::from_ref;

/// Those of `all` that may be beside the effects that are `there`.
pub(super) fn beside<'a>(
    there: &'a [Effect],
    all: &'a [Effect],
) -> impl Iterator<Item = &'a Effect> {
    all.iter().filter(|e| there.iter().all(|t| t != *e && !t.excludes(e)))
}

/// Each of `models` (its effects with it) fitted `with` each of the effects to be tried beside it, every set of
/// effects once.
pub(super) fn expanded<'a, M: Sync + 'a, N: Send>(
    models: impl IntoIterator<Item = (&'a M, &'a [Effect], Vec<Effect>)>,
    with: impl Fn(&M, &Effect) -> N + Sync,
) -> Vec<N> {
    let mut seen: Vec<Vec<Effect>> = Vec::new();
    let mut jobs: Vec<(&M, Effect)> = Vec::new();
    for (model, there, tried) in models {
        for effect in tried {
            let mut set = [there, from_ref(&effect)].concat();
            set.sort_unstable();
            if !seen.contains(&set) {
                seen.push(set);
                jobs.push((model, effect));
            }
        }
    }
    jobs.into_iter().par_map(|(model, effect)| with(model, &effect)).collect()
}

/// What models are judged by: their evidence, or what they predict.
pub(super) trait Judge: Sync {
    /// A set of effects, fitted.
    type Model: Clone + Send + Sync;

    /// Its effects beyond those that were there from the beginning.
    fn effects<'a>(&self, model: &'a Self::Model) -> &'a [Effect];

    /// `model` less one of them; `None` where it cannot be fitted.
    fn without(&self, model: &Self::Model, effect: &Effect) -> Option<Self::Model>;

    /// Whether `larger` is worth the effect that it has beyond `smaller`.
    fn is_worth(&self, smaller: &Self::Model, larger: &Self::Model) -> bool;

    /// By which models of as many effects are ranked, the least first.
    fn misfit(&self, model: &Self::Model) -> f64;

    /// The search ends when this asks for it.
    fn stop(&self) -> &Stop;
}

/// A model, and it less each of its effects in their order, where that has been asked for.
#[derive(Clone)]
pub(super) struct Nested<M> {
    pub(super) model: M,
    pub(super) without: Vec<Option<M>>,
}

impl<M: Clone + Send + Sync> Nested<M> {
    fn new<J: Judge<Model = M>>(judge: &J, model: M) -> Self {
        let effects = judge.effects(&model).iter();
        let without = effects.par_map(|effect| judge.without(&model, effect)).collect();
        Self { model, without }
    }

    /// Less what the others have made needless.
    ///
    /// # Errors
    /// Interrupted, once somebody asked for it.
    pub(super) fn pruned<J: Judge<Model = M>>(judge: &J, model: M) -> Result<Self> {
        let mut here = Self::new(judge, model);
        while let Some(smaller) = here.least(judge, |smaller| !judge.is_worth(smaller, &here.model))
        {
            judge.stop().check()?;
            here = Self::new(judge, smaller);
        }
        judge.stop().check()?;
        Ok(here)
    }

    fn least<J: Judge<Model = M>>(&self, judge: &J, among: impl Fn(&M) -> bool) -> Option<M> {
        let smaller = self.without.iter().flatten().filter(|smaller| among(smaller));
        let least = smaller.min_by(|a, b| judge.misfit(a).total_cmp(&judge.misfit(b)));
        least.cloned()
    }

    /// From `plain`, the model that is there, to this one, an effect more each: what is missed least is
    /// taken out first.
    ///
    /// # Errors
    /// Interrupted, once somebody asked for it.
    pub(super) fn path<J: Judge<Model = M>>(self, judge: &J, plain: M) -> Result<Vec<M>> {
        let mut here = self;
        let mut path = Vec::new();
        while judge.effects(&here.model).len() > 1 {
            judge.stop().check()?;
            if here.without.is_empty() {
                here = Self::new(judge, here.model);
            }
            let Some(smaller) = here.least(judge, |_| true) else { break };
            path.push(std::mem::replace(&mut here, smaller.into()).model);
        }
        let is_plain = judge.effects(&here.model).is_empty();
        path.push(here.model);
        path.extend((!is_plain).then_some(plain));
        path.reverse();
        Ok(path)
    }
}

impl<M> From<M> for Nested<M> {
    fn from(model: M) -> Self {
        Self { model, without: Vec::new() }
    }
}
