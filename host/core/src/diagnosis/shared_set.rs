//! A set of effects on several releases of one rig: fitted to all, and each release predicted from the
//! others.

use crate::diagnosis::over_pieces;
use crate::diagnosis::prediction::Prediction;
use crate::diagnosis::survivors::Survivors;
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::fitting::{Limit, Number, Structure};
use crate::fit::free_decay::FreeDecay;
use crate::fit::joint::{self, JointFit, Release, Sharing};
use crate::fit::segments::{fit_from, PieceFit, ROUGH};
use crate::stop::Stop;
use rayon::prelude::*;

/// What the releases have in common.
#[derive(Clone, Debug, Default)]
pub struct Common {
    /// Natural frequency and damping ratio too.
    pub same_rig: bool,
    /// Effects of which each release has a coefficient of its own.
    pub own: Vec<Effect>,
}

/// A release with what survives in it alone.
pub(super) struct Surviving {
    pub(crate) decay: FreeDecay,
    pub(crate) survivors: Survivors,
}

impl Surviving {
    pub(super) fn alone(&self) -> &PieceFit {
        &self.survivors.path.last().expect("the plain model").model.fit
    }

    /// Numbers of `effect` in the release alone.
    pub(super) fn numbers(&self, effect: &Effect) -> Option<&[f64]> {
        let fit = self.alone();
        let k = fit.structure.effects.iter().position(|e| e == effect)?;
        let at = fit.start_of(k);
        Some(&fit.common[at..at + effect.parameters().len()])
    }
}

pub(super) struct Set<'a> {
    pub(crate) begun: &'a [Surviving],
    pub(crate) common: &'a Common,
    pub(crate) effects: Vec<Effect>,
    pub(crate) stop: &'a Stop,
}

impl Set<'_> {
    pub(super) fn without(&self, effect: &Effect) -> Self {
        let effects = self.effects.iter().filter(|e| *e != effect).cloned().collect();
        Self { effects, ..*self }
    }

    pub(super) fn with(&self, effect: &Effect) -> Self {
        let effects = self.effects.iter().chain([effect]).cloned().collect();
        Self { effects, ..*self }
    }

    fn structure(&self, release: usize) -> Structure {
        let effects = self.effects.clone();
        Structure { effects, ..self.begun[release].alone().structure.clone() }
    }

    /// Whose coefficients of each effect `which` have, of whom `of` says which release it is.
    fn sharing(&self, of: &[usize]) -> Sharing {
        let groups = |e: &Effect| {
            let own = self.common.own.contains(e);
            of.iter().map(|&i| Some(if own { i } else { 0 })).collect()
        };
        let modal = of.iter().map(|&i| if self.common.same_rig { 0 } else { i }).collect();
        Sharing { modal, effects: self.effects.iter().map(groups).collect() }
    }

    /// Mean of each effect's numbers over those of `which` in which it survives.
    fn mean(&self, which: &[usize]) -> Vec<Vec<f64>> {
        let of = |effect: &Effect| {
            let known: Vec<&[f64]> =
                which.iter().filter_map(|&i| self.begun[i].numbers(effect)).collect();
            let n = known.len().max(1) as f64;
            let number = |k: usize| known.iter().map(|p| p[k]).sum::<f64>() / n;
            (0..effect.parameters().len()).map(number).collect()
        };
        self.effects.iter().map(of).collect()
    }

    /// Release `i` on its long pieces with these numbers of the effects that it has not for itself, and where
    /// it is the same rig these modal values.
    fn given(&self, i: usize, numbers: &[Vec<f64>], modal: Option<[f64; 2]>) -> PieceFit {
        let begun = &self.begun[i];
        let mut structure = self.structure(i);
        let mut common = begun.alone().common[..3].to_vec();
        let mut fix = |number, value| {
            structure.limits.push(Limit { number, low: value, high: value });
        };
        if let Some([wn, zeta]) = modal {
            (common[0], common[1]) = (wn, zeta);
            fix(Number::NaturalFrequency, wn);
            fix(Number::DampingRatio, zeta);
        }
        for (effect, numbers) in self.effects.iter().zip(numbers) {
            let own = self.common.own.contains(effect);
            for (k, value) in numbers.iter().enumerate() {
                if !own && !effect.belongs_to_release(k) {
                    fix(Number::Of(effect.clone(), k), *value);
                }
            }
            common.extend(numbers);
        }
        fit_from(&begun.survivors.lengths.long, &structure, &common, ROUGH)
    }

    /// The long pieces of `which` fitted at once.
    pub(super) fn fitted(&self, which: &[usize]) -> JointFit {
        let mean = self.mean(which);
        let fits: Vec<PieceFit> = which.par_iter().map(|&i| self.given(i, &mean, None)).collect();
        let (mut releases, mut starts, mut of) = (Vec::new(), Vec::new(), Vec::new());
        for (&i, fit) in which.iter().zip(&fits) {
            for (k, piece) in self.begun[i].survivors.lengths.long.decays.iter().enumerate() {
                releases.push(Release::whole(piece));
                starts.push(fit.numbers(k));
                of.push(i);
            }
        }
        joint::fit(&releases, &self.structure(which[0]), &self.sharing(&of), &starts)
    }

    /// The numbers of each effect in `fit`'s first release, and its modal values.
    pub(super) fn numbers(&self, fit: &JointFit) -> (Vec<Vec<f64>>, [f64; 2]) {
        let of =
            |effect: &Effect| fit.fits[0].varied(effect).map_or_else(Vec::new, <[f64]>::to_vec);
        let modal = [fit.fits[0].parameters[0], fit.fits[0].parameters[1]];
        (self.effects.iter().map(of).collect(), modal)
    }

    /// Each release predicted from the others.
    pub(super) fn predicted(&self) -> Result<Prediction> {
        let all: Vec<usize> = (0..self.begun.len()).collect();
        let mut errors = Vec::new();
        for i in all.iter().copied() {
            self.stop.check()?;
            let others: Vec<usize> = all.iter().copied().filter(|j| *j != i).collect();
            let (numbers, modal) = self.numbers(&self.fitted(&others));
            let fit = self.given(i, &numbers, self.common.same_rig.then_some(modal));
            let pieces = &self.begun[i].survivors.lengths.long.decays;
            errors
                .extend(fit.squares.iter().zip(pieces).map(|(s, p)| (*s, p.yaw_rad.len() as f64)));
        }
        Ok(Prediction::of(errors))
    }

    /// All releases whole, from where their pieces lead.
    pub(super) fn whole(&self) -> JointFit {
        let all: Vec<usize> = (0..self.begun.len()).collect();
        let (numbers, _) = self.numbers(&self.fitted(&all));
        let starts: Vec<Vec<f64>> = all
            .par_iter()
            .map(|&i| {
                let begun = &self.begun[i];
                let pieces = self.given(i, &numbers, None);
                over_pieces::whole(&begun.decay, &begun.survivors.lengths, &pieces).numbers(0)
            })
            .collect();
        let releases: Vec<Release> = self.begun.iter().map(|b| Release::whole(&b.decay)).collect();
        joint::fit(&releases, &self.structure(0), &self.sharing(&all), &starts)
    }
}
