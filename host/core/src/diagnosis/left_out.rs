//! Releases left out: what models of several releases predict of those that they were not fitted to.
//!
//! Where a model is not down to the noise, likelihood buys any effect that bends. An effect of all releases is
//! then one that helps where it was not fitted: in a release left out, whose state alone is estimated anew, the
//! effect's numbers being those of the others; or, of a number that no other release has, in the later part of
//! the release.

use crate::diagnosis::answer::FITTED_SHARE;
use crate::diagnosis::nested::{Judge, Nested};
use crate::diagnosis::prediction::Prediction;
use crate::diagnosis::releases::{from_others, ModelOfReleases};
use crate::diagnosis::several_fit::Together;
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::fitting::{fit_removed, held_out_over_noise, Fitted};
use crate::fit::free_decay::FreeDecay;
use crate::fit::joint::{self, JointFit, Release};
use crate::stop::Stop;

/// Of the releases, how many are left out at once: the others are to know their numbers as all do.
const SHARE: usize = 4;

/// Models of `decays` judged by what they predict.
pub(super) struct LeftOut<'a> {
    pub(super) decays: &'a [FreeDecay],
    /// Releases that are left out in turn.
    pub(super) which: &'a [usize],
    /// Effects that were there from the beginning.
    pub(super) there: usize,
    /// Those that stay whatever they predict.
    pub(super) stay: Vec<Effect>,
    /// A model of the releases with what they have in common.
    pub(super) together: &'a (dyn Fn(&ModelOfReleases) -> Result<Together> + Sync),
}

/// A model with its errors over the noise.
#[derive(Clone)]
pub(super) struct Judged {
    together: Together,
    /// Of each of the releases left out: in all of it from the others, and in its later part from its earlier
    /// one.
    errors: Vec<[(f64, f64); 2]>,
}

impl LeftOut<'_> {
    /// The models of `path`, from the one that is there, without what does not predict.
    pub(super) fn path(&self, mut path: Vec<Together>) -> Result<Vec<Together>> {
        let last = self.judged(path.pop().expect("a model"));
        let before = self.effects(&last).len();
        let kept = Nested::pruned(self, last)?;
        if self.effects(&kept.model).len() == before {
            path.push(kept.model.together);
            return Ok(path);
        }
        let plain = Judged { together: path.swap_remove(0), errors: Vec::new() };
        let path = kept.path(self, plain)?;
        Ok(path.into_iter().map(|judged| judged.together).collect())
    }

    fn judged(&self, together: Together) -> Judged {
        let joint = &together.joint;
        let starts: Vec<Vec<f64>> = joint.fits.iter().map(|f| f.parameters.clone()).collect();
        let early: Vec<Release> =
            self.decays.iter().map(|decay| Release::part(decay, FITTED_SHARE)).collect();
        let early = joint::fit(&early, &joint.structure, &joint.sharing, &starts);
        let later = |i: usize| {
            let n = self.decays[i].yaw_rad.len().saturating_sub(early.fits[i].count) as f64;
            (n * held_out_over_noise(&self.decays[i], &early.fits[i]).powi(2), n)
        };
        let whole = self.sets().into_iter().flat_map(|held| {
            let fits = from_others(self.decays, joint, &held, |_, _| None);
            let of = |(i, fit): (usize, Fitted)| {
                let over = fit.over_noise(&self.decays[i]);
                (fit.count as f64 * over * over, fit.count as f64)
            };
            held.into_iter().zip(fits).map(of).collect::<Vec<_>>()
        });
        let errors = whole.zip(self.which).map(|(whole, &i)| [whole, later(i)]).collect();
        Judged { together, errors }
    }

    /// The releases that are left out together.
    fn sets(&self) -> Vec<Vec<usize>> {
        let size = (self.decays.len() / SHARE).max(1);
        self.which.chunks(size).map(<[usize]>::to_vec).collect()
    }

    /// Whether another release knows the numbers of `effect` in `release` while that is left out; `None`: the
    /// release is without it.
    fn is_known(&self, joint: &JointFit, effect: usize, release: usize) -> Option<bool> {
        let groups = &joint.sharing.effects[effect];
        groups[release]?;
        let set = self.sets().into_iter().find(|set| set.contains(&release))?;
        let other = |i: &usize| !set.contains(i) && groups[*i] == groups[release];
        Some((0..self.decays.len()).any(|i| other(&i)))
    }
}

impl Judge for LeftOut<'_> {
    type Model = Judged;

    fn effects<'a>(&self, model: &'a Judged) -> &'a [Effect] {
        &model.together.joint.structure.effects[self.there..]
    }

    fn without(&self, model: &Judged, effect: &Effect) -> Option<Judged> {
        let joint = &model.together.joint;
        let fits = joint.fits.iter().zip(self.decays).map(|(fit, decay)| {
            match fit.structure.effects.contains(effect) {
                true => fit_removed(decay, fit, effect),
                false => fit.clone(),
            }
        });
        let fits = fits.collect();
        let effects = joint.structure.effects.iter().filter(|e| *e != effect).cloned().collect();
        let smaller = (self.together)(&ModelOfReleases { effects, fits }).ok()?;
        Some(self.judged(smaller))
    }

    fn is_worth(&self, smaller: &Judged, larger: &Judged) -> bool {
        let joint = &larger.together.joint;
        let effects = &smaller.together.joint.structure.effects;
        let more = joint.structure.effects.iter().position(|e| !effects.contains(e));
        let Some(more) = more else { return false };
        if self.stay.contains(&joint.structure.effects[more]) {
            return true;
        }
        // Only where it is, and by what can be predicted of it there.
        let known = |&i: &usize| self.is_known(joint, more, i);
        let kinds: Vec<Option<bool>> = self.which.iter().map(known).collect();
        let of = |judged: &Judged| {
            let each = judged.errors.iter().zip(&kinds);
            let errors = each.filter_map(|(e, known)| Some(e[usize::from(!(*known)?)]));
            Prediction::new(errors.filter(|(_, n)| *n > 0.0).collect())
        };
        of(larger).is_better_than(&of(smaller))
    }

    fn misfit(&self, model: &Judged) -> f64 {
        model.together.joint.over_noise()
    }

    fn stop(&self) -> &Stop {
        &self.decays[0].stop
    }
}
