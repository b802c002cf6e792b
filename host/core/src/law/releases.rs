//! Releases that are under one law: what is common to them, and what each has for itself.

use crate::diagnosis::over_pieces::{plain_start, Lengths};
use crate::error::Result;
use crate::fit::fitting::{Fitted, Structure};
use crate::fit::free_decay::{FreeDecay, BEGINNING};
use crate::fit::joint::{self, Release, Sharing};
use crate::fit::pieces::Own;
use crate::fit::segments::PieceFit;
use std::borrow::Cow;
use std::collections::BTreeSet;

/// Releases of one rig under one law, each about a rest angle of its own.
#[derive(Clone, Debug)]
pub struct Releases<'a> {
    /// The one from the largest yaw angle first: most of the law is seen there.
    decays: Vec<Cow<'a, FreeDecay>>,
    /// Of each: those of one number have natural frequency and damping ratio in common. The first has 0.
    modal: Vec<usize>,
    /// Where each stood among those given.
    given: Vec<usize>,
}

impl<'a> Releases<'a> {
    /// At least one release, each with the number of its condition (springs, wind): those of one number have
    /// natural frequency and damping ratio in common.
    pub fn new(releases: &[(&'a FreeDecay, usize)]) -> Self {
        let mut given: Vec<usize> = (0..releases.len()).collect();
        given.sort_by(|&a, &b| releases[b].0.amplitude_rad.total_cmp(&releases[a].0.amplitude_rad));
        let mut known = Vec::new();
        let number = |&i: &usize| {
            let modal = releases[i].1;
            known.iter().position(|k| *k == modal).unwrap_or_else(|| {
                known.push(modal);
                known.len() - 1
            })
        };
        let modal = given.iter().map(number).collect();
        Self { decays: given.iter().map(|&i| releases[i].0.smooth()).collect(), modal, given }
    }

    /// A release alone.
    pub fn one(decay: &'a FreeDecay) -> Self {
        Self::new(&[(decay, 0)])
    }

    /// The release from the largest yaw angle.
    pub fn first(&self) -> &FreeDecay {
        &self.decays[0]
    }

    /// The release, where there is one.
    pub(super) fn alone(&self) -> Option<&FreeDecay> {
        match &self.decays[..] {
            [decay] => Some(decay),
            _ => None,
        }
    }

    /// How many natural frequencies there are.
    fn modals(&self) -> usize {
        self.modal.iter().max().map_or(1, |most| most + 1)
    }

    /// Where the `i`th release has its own numbers.
    fn own(&self, i: usize) -> Own {
        let (modals, releases) = (self.modals(), self.decays.len());
        let begin = Own::ALONE.rest + 1;
        let rests = begin + 2 * (modals - 1);
        Own {
            modal: self.modal[i].checked_sub(1).map_or(Own::ALONE.modal, |k| begin + 2 * k),
            rest: i.checked_sub(1).map_or(Own::ALONE.rest, |k| rests + k),
            more: 2 * (modals - 1) + releases - 1,
        }
    }

    pub(crate) fn lengths(&self) -> Lengths {
        let each: Vec<(&FreeDecay, Own)> =
            self.decays.iter().enumerate().map(|(i, decay)| (&**decay, self.own(i))).collect();
        Lengths::of_all(&each)
    }

    /// The second-order response of each, taking energy out where all do, and the numbers from which its fit
    /// begins.
    pub(crate) fn plain_start(&self) -> (Structure, Vec<f64>) {
        let each: Vec<(Structure, [f64; 3])> = self.decays.iter().map(|d| plain_start(d)).collect();
        let own: Vec<Own> = (0..each.len()).map(|i| self.own(i)).collect();
        let mut common = vec![0.0; Own::ALONE.rest + 1 + own[0].more];
        // The larger release's wn and zeta where several have them in common.
        for (own, (_, [wn_rad_s, zeta, rest_rad])) in own.iter().zip(&each).rev() {
            (common[own.modal], common[own.modal + 1]) = (*wn_rad_s, *zeta);
            common[own.rest] = *rest_rad;
        }
        let fewest = each.into_iter().map(|(structure, _)| structure);
        let structure = fewest.min_by_key(|s| s.limits.len()).expect("a release");
        (structure, common)
    }

    /// wn (rad/s) and zeta of each release, in the order given.
    pub(super) fn modal(&self, common: &[f64]) -> Vec<[f64; 2]> {
        let mut out = vec![[0.0; 2]; self.given.len()];
        for (i, &given) in self.given.iter().enumerate() {
            let at = self.own(i).modal;
            out[given] = [common[at], common[at + 1]];
        }
        out
    }

    /// `common` with so much more linear damping, 2 zeta wn in 1/s, in each release; `None` where that makes
    /// one grow.
    pub(super) fn damped(&self, common: &[f64], more_per_s: f64) -> Option<Vec<f64>> {
        let mut out = common.to_vec();
        let modals: BTreeSet<usize> = (0..self.decays.len()).map(|i| self.own(i).modal).collect();
        for at in modals {
            out[at + 1] += more_per_s / (2.0 * out[at]);
            if out[at + 1] < 0.0 && common[at + 1] >= 0.0 {
                return None;
            }
        }
        Some(out)
    }

    /// Numbers of each release at its beginning, in the order given, where its pieces have led.
    pub(crate) fn begun(&self, fit: &PieceFit) -> Vec<Vec<f64>> {
        let mut out = vec![Vec::new(); self.given.len()];
        self.given.iter().zip(self.begins(fit)).for_each(|(&given, begin)| out[given] = begin);
        out
    }

    /// The same, from the release with the largest angle on.
    fn begins(&self, fit: &PieceFit) -> Vec<Vec<f64>> {
        let first = |i: usize| fit.own.iter().position(|own| *own == self.own(i));
        let of = |i: usize| fit.numbers(first(i).expect("a piece of each release"));
        (0..self.decays.len()).map(of).collect()
    }

    /// All fitted whole, long ones' beginnings, from where their pieces have led, by fixed steps and then by steps
    /// that adapt; the first release's share of it.
    pub(super) fn whole(&self, fit: &PieceFit) -> Result<Fitted> {
        let begun = |d: &Cow<'_, FreeDecay>| d.yaw_rad.len().min(BEGINNING);
        let whole = self.decays.iter().map(|d| Release { decay: d, count: begun(d) });
        let releases: Vec<Release> = whole.collect();
        let effects = vec![vec![Some(0); releases.len()]; fit.structure.effects.len()];
        let sharing = Sharing { modal: self.modal.clone(), effects };
        let fitted = |swift: bool, starts: &[Vec<f64>]| {
            let structure = Structure { swift, ..fit.structure.clone() };
            let fit = joint::fit(&releases, &structure, &sharing, starts);
            self.first().stop.check()?;
            Ok(fit)
        };
        let near: Vec<Vec<f64>> =
            fitted(true, &self.begins(fit))?.fits.into_iter().map(|fit| fit.parameters).collect();
        Ok(fitted(false, &near)?.fits.swap_remove(0))
    }
}
