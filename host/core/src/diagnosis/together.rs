//! Releases that are under one law, measured or looked for: what is common to them, and what each has for itself.

use crate::diagnosis::over_pieces::{plain_start, Lengths};
use crate::error::Result;
use crate::fit::fitting::{Fitted, Structure};
use crate::fit::free_decay::{FreeDecay, BEGINNING};
use crate::fit::joint::{self, Release, Sharing};
use crate::fit::layout::Layout;
use crate::fit::segments::PieceFit;
use crate::fit::structure::{WN, ZETA};
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
    pub(crate) fn alone(&self) -> Option<&FreeDecay> {
        match &self.decays[..] {
            [decay] => Some(decay),
            _ => None,
        }
    }

    pub(crate) fn lengths(&self) -> Lengths {
        let each: Vec<&FreeDecay> = self.decays.iter().map(|decay| &**decay).collect();
        Lengths::of_all(&each, &self.modal)
    }

    /// Where the numbers of `structure` are, each release being a block.
    fn layout(&self, structure: &Structure) -> Layout {
        Layout::of_pieces(structure, &self.modal, (0..self.decays.len()).collect())
    }

    /// The second-order response of each, taking energy out where all do, and the numbers from which its fit
    /// begins.
    pub(crate) fn plain_start(&self) -> (Structure, Vec<f64>) {
        let each: Vec<(Structure, [f64; 3])> = self.decays.iter().map(|d| plain_start(d)).collect();
        let fewest = each.iter().min_by_key(|(structure, _)| structure.limits.len());
        let structure = fewest.expect("a release").0.clone();
        let layout = self.layout(&structure);
        let mut common = vec![0.0; layout.shared_count()];
        // The larger release's wn and zeta where several have them in common.
        for (i, (_, [wn_rad_s, zeta, rest_rad])) in each.iter().enumerate().rev() {
            let at = layout.modal(i);
            (common[at], common[at + 1]) = (*wn_rad_s, *zeta);
            common[layout.zero(i, &structure).expect("a rest angle")] = *rest_rad;
        }
        (structure, common)
    }

    /// wn (rad/s) and zeta of each release, in the order given.
    pub(crate) fn modal(&self, fit: &PieceFit) -> Vec<[f64; 2]> {
        let mut out = vec![[0.0; 2]; self.given.len()];
        for (&given, numbers) in self.given.iter().zip(self.begins(fit)) {
            out[given] = [numbers[WN], numbers[ZETA]];
        }
        out
    }

    /// `common` with so much more linear damping, 2 zeta wn in 1/s, in each release; `None` where that makes
    /// one grow.
    pub(crate) fn damped(&self, common: &[f64], more_per_s: f64) -> Option<Vec<f64>> {
        let mut out = common.to_vec();
        let layout = self.layout(&Structure::default());
        let modals: BTreeSet<usize> = (0..self.decays.len()).map(|i| layout.modal(i)).collect();
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
        let of = |i: usize| fit.numbers(fit.layout.block_of(i).expect("a piece of each release"));
        (0..self.decays.len()).map(of).collect()
    }

    /// All fitted whole, long ones' beginnings, from where their pieces have led, by fixed steps and then by steps
    /// that adapt; the first release's share of it.
    pub(crate) fn whole(&self, fit: &PieceFit) -> Result<Fitted> {
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
