//! The releases of a rig, each judged by itself, and what their answers say together.

use crate::diagnosis::answer::{Candidate, Diagnosed, Options, Status};
use crate::diagnosis::one::of_one;
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::free_decay::FreeDecay;
use crate::par_map::ParMap;
use crate::record::Record;
use std::collections::BTreeMap;

pub(crate) struct Alone {
    /// Which releases were judged, and what was said of each.
    pub(crate) which: Vec<usize>,
    pub(crate) answers: Vec<Diagnosed>,
}

impl Alone {
    /// # Errors
    /// A present model that cannot be fitted; interrupted.
    pub(crate) fn new(
        records: &[Record],
        which: Vec<usize>,
        decays: &[FreeDecay],
        options: &Options,
    ) -> Result<Self> {
        let one = |&i: &usize| {
            let options = options.in_wind(decays[i].wind_speed_m_s);
            of_one(&records[i], decays[i].clone(), &options)
        };
        let answers = which.iter().par_map(one).collect::<Result<_>>()?;
        Ok(Self { which, answers })
    }

    /// What was said of a release, where it was judged.
    pub(crate) fn of_release(&self, release: usize) -> Option<&Diagnosed> {
        self.which.iter().position(|&i| i == release).map(|k| &self.answers[k])
    }

    fn names(&self, answer: usize, effect: &Effect) -> bool {
        self.answers[answer].diagnosis.effects.contains(effect)
    }

    /// Effects with a definite course that are named, those of most releases first; of as many in the order
    /// of the library.
    pub(crate) fn named(&self) -> Vec<Effect> {
        let mut votes: BTreeMap<Effect, usize> = BTreeMap::new();
        let definite = |e: &&Effect| !e.is_random();
        for effect in self.answers.iter().flat_map(|a| &a.diagnosis.effects).filter(definite) {
            *votes.entry(effect.clone()).or_default() += 1;
        }
        let mut all: Vec<(Effect, usize)> = votes.into_iter().collect();
        all.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
        all.into_iter().map(|(effect, _)| effect).collect()
    }

    /// Whether most of the releases judged name `effect` that have the wind on, or most that have it off.
    pub(crate) fn mostly(&self, effect: &Effect) -> bool {
        let is_on = |k: usize| self.answers[k].decays[0].wind_speed_m_s > 0.0;
        [true, false].into_iter().any(|on| {
            let inside: Vec<usize> = (0..self.which.len()).filter(|&k| is_on(k) == on).collect();
            2 * inside.iter().filter(|&&k| self.names(k, effect)).count() > inside.len()
        })
    }

    /// Where every release judged is adequate by itself, the same.
    pub(crate) fn adequate(&self) -> Option<Status> {
        let is = |answer: &Diagnosed| answer.diagnosis.status == Status::Adequate;
        self.answers.iter().all(is).then_some(Status::Adequate)
    }

    /// Pairs of one of `effects` and another that none of the releases distinguishes which name either.
    pub(crate) fn indistinguishable(&self, effects: &[Effect]) -> Vec<[Effect; 2]> {
        let same = |a: &[Effect; 2], b: &[Effect; 2]| a.iter().all(|e| b.contains(e));
        let mut out: Vec<[Effect; 2]> = Vec::new();
        for pair in self.answers.iter().flat_map(|a| &a.diagnosis.indistinguishable) {
            let [a, b] = pair;
            let ordered = match (effects.contains(a), effects.contains(b)) {
                (true, false) => [a.clone(), b.clone()],
                (false, true) => [b.clone(), a.clone()],
                _ => continue,
            };
            let all = (0..self.answers.len())
                .filter(|&k| self.names(k, a) || self.names(k, b))
                .all(|k| self.answers[k].diagnosis.indistinguishable.iter().any(|p| same(p, pair)));
            if all && !out.contains(&ordered) {
                out.push(ordered);
            }
        }
        out.sort_unstable();
        out
    }

    /// Every effect alone, best first: the releases' gains added.
    pub(crate) fn candidates(&self) -> Vec<Candidate> {
        let mut all: BTreeMap<Effect, (Candidate, f64)> = BTreeMap::new();
        for answer in &self.answers {
            let n = answer.decays[0].yaw_rad.len() as f64;
            for c in &answer.diagnosis.candidates {
                let square = n * c.residual_over_noise.powi(2);
                let first =
                    || (Candidate { residual_over_noise: 0.0, delta_bic: 0.0, ..c.clone() }, 0.0);
                let (sum, count) = all.entry(c.effect.clone()).or_insert_with(first);
                sum.residual_over_noise += square;
                sum.delta_bic += c.delta_bic;
                sum.converged &= c.converged;
                if sum.reason.is_none() {
                    sum.reason.clone_from(&c.reason);
                }
                *count += n;
            }
        }
        let mean = |(c, n): (Candidate, f64)| {
            let residual_over_noise = (c.residual_over_noise / n).sqrt();
            Candidate { residual_over_noise, ..c }
        };
        let mut out: Vec<Candidate> = all.into_values().map(mean).collect();
        out.sort_by(|a, b| b.delta_bic.total_cmp(&a.delta_bic));
        out
    }
}
