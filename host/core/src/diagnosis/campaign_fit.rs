//! A campaign's releases fitted with what their coefficients allow in common, and tried on what was held out.

use crate::bic::{self, MARGIN};
use crate::derivatives::campaign::Campaign as Made;
use crate::derivatives::condition::{settings, Setting};
use crate::diagnosis::answer::{Condition, HeldOut, FITTED_SHARE};
use crate::diagnosis::origin::{self, Origin, Plan, Seen, OWN};
use crate::diagnosis::releases::{predicted_over_noise, ModelOfReleases};
use crate::diagnosis::several_fit::{
    finished, sharing, structure, whole, SharedEffect, Source, Together,
};
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::fitting::{Fitted, Limit, Number, Structure};
use crate::fit::free_decay::FreeDecay;
use crate::fit::joint::{self, JointFit, Release, Sharing};
use crate::par_map::ParMap;
use crate::quantity::{weighted_mean, Quantity};
use crate::record::Record;
use crate::statistics::weighted_median;

pub(super) struct Campaign<'a> {
    pub(super) made: &'a Made,
    settings: Vec<Setting>,
    pub(super) records: &'a [Record],
    pub(super) decays: &'a [FreeDecay],
}

impl<'a> Campaign<'a> {
    pub(super) fn new(made: &'a Made, records: &'a [Record], decays: &'a [FreeDecay]) -> Self {
        Self { made, settings: settings(made), records, decays }
    }

    /// One coefficient for each condition.
    pub(super) fn by_condition(&self, of: impl Fn(usize) -> Option<Quantity>) -> Vec<Seen> {
        let seen = |setting: &Setting| {
            let condition = Condition::new(&self.made.release[setting.releases[0]]);
            Some(Seen {
                condition: Condition { wind_speed_m_s: setting.wind_speed_m_s, ..condition },
                coefficient: weighted_mean(setting.releases.iter().filter_map(|&i| of(i)))?,
            })
        };
        self.settings.iter().filter_map(seen).collect()
    }

    /// `model` with what its coefficients allow in common.
    pub(super) fn together(&self, model: &ModelOfReleases) -> Result<Together> {
        let stop = &self.decays[0].stop;
        let structure = structure(model);
        // Each release once more, for the uncertainties of coefficients that ended at zero.
        let start = |fit: &Fitted| fit.in_order_of(&structure);
        let alone = self.each_alone(&structure, model.fits.iter().map(start));
        stop.check()?;
        let tied = self.tied(&alone, &structure);
        stop.check()?;
        let fits: Vec<&Fitted> =
            tied.as_ref().unwrap_or(&alone).iter().map(|j| &j.fits[0]).collect();
        let effective: f64 = fits.iter().map(|fit| fit.effective_count()).sum();
        let attributed = |effect| self.attributed(effect, &fits, effective);
        let mut shared: Vec<SharedEffect> = model.effects.iter().map(attributed).collect();
        let together = |shared: &[SharedEffect]| {
            let sharing = sharing(shared, (0..fits.len()).collect());
            joint::fit_from(&whole(self.decays), &structure, &sharing, &fits)
        };
        // What is shared is chosen on the coefficients alone; whether it holds is tried on the releases.
        let squares: f64 = alone.iter().map(|joint| joint.sum_of_squares).sum();
        let numbers: usize = alone.iter().map(|joint| joint.parameters.len()).sum();
        let holds = |joint: &JointFit| {
            let fewer = numbers.saturating_sub(joint.parameters.len()) as f64;
            let lost = bic::gain(joint.sum_of_squares, squares, effective, fewer);
            joint.converged && lost < MARGIN
        };
        let mut joint = together(&shared);
        // A line may have another frequency in each release where the rest has one coefficient in all.
        for may_be_own in [has_more_than_a_size, |_: &Effect| true] {
            stop.check()?;
            let in_common = shared.iter_mut().filter(|e| e.plan.name != OWN);
            let in_common: Vec<&mut SharedEffect> =
                in_common.filter(|e| may_be_own(&e.effect)).collect();
            if holds(&joint) || in_common.is_empty() {
                continue;
            }
            in_common.into_iter().for_each(|e| e.plan = e.plan.of_each());
            joint = together(&shared);
        }
        let joint = finished(joint, self.decays);
        let held_out_over_noise = self.held_out_over_noise(&joint);
        Ok(Together { joint, shared, held_out_over_noise })
    }

    fn each_alone(
        &self,
        structure: &Structure,
        starts: impl Iterator<Item = Vec<f64>>,
    ) -> Vec<JointFit> {
        let sharing = Sharing::none(1, structure.effects.len());
        let fit = |(release, start): (Release, Vec<f64>)| {
            joint::fit(&[release], structure, &sharing, &[start]).polished(&[release])
        };
        whole(self.decays).into_iter().zip(starts).par_map(fit).collect()
    }

    /// The same with a line's frequency, or a stop's place, as most know it: where there is none, the size of
    /// what fits the noise best says nothing. `None` where a release has another, or none knows it.
    fn tied(&self, alone: &[JointFit], structure: &Structure) -> Option<Vec<JointFit>> {
        let mut tied = structure.clone();
        for effect in &structure.effects {
            let is_common = |k: &usize| !effect.belongs_to_release(*k);
            for number in (1..effect.parameters().len()).filter(is_common) {
                let known = |fit: &JointFit| Some(fit.quantity(fit.place(effect, number, 0)?));
                let known = alone.iter().filter_map(known).filter(Quantity::is_known);
                let mut known: Vec<(f64, f64)> = known.map(|q| (q.value, q.u.powi(-2))).collect();
                // None where no release knows it.
                let value = Some(weighted_median(&mut known)).filter(|value| value.is_finite())?;
                let number = Number::Of(effect.clone(), number);
                tied.limits.push(Limit { number, low: value, high: value });
            }
        }
        let fewer = tied.limits.len() - structure.limits.len();
        let starts = alone.iter().map(|fit| fit.parameters.clone());
        let tied = (fewer > 0).then(|| self.each_alone(&tied, starts))?;
        let holds = |(tied, alone): (&JointFit, &JointFit)| {
            let n = alone.effective_count();
            bic::gain(tied.sum_of_squares, alone.sum_of_squares, n, fewer as f64) < MARGIN
        };
        tied.iter().zip(alone).all(holds).then_some(tied)
    }

    fn attributed(&self, effect: &Effect, fits: &[&Fitted], effective: f64) -> SharedEffect {
        let seen = self.by_condition(|i| fits[i].coefficient(effect));
        let (origin, mut reason) = origin::decide(&seen, &effect.parameters()[0].unit);
        if effect.moves_rest() && origin == Origin::Undecided {
            reason.push_str(
                "; a sensor that was not zeroed shows as a moment that changes with the stiffness: fit with an unknown zero",
            );
        }
        let all = Plan::of_all(origin, self.decays.iter().map(|d| d.wind_speed_m_s > 0.0));
        let plan = if has_more_than_a_size(effect) {
            all
        } else if effect.belongs_to_release(0) {
            all.of_each()
        } else {
            let unknown = Quantity::new(0.0, f64::INFINITY);
            let own = self.made.release.iter().zip(fits).map(|(entry, fit)| Seen {
                condition: Condition::new(entry),
                coefficient: fit.coefficient(effect).unwrap_or(unknown),
            });
            origin::plan(origin, &own.collect::<Vec<_>>(), effective)
        };
        let source = Some(Source { origin, reason, seen });
        SharedEffect { effect: effect.clone(), plan, source }
    }

    /// The last release of each condition that was repeated.
    fn last_repeats(&self) -> Vec<usize> {
        let repeated = self.settings.iter().filter(|s| s.releases.len() > 1);
        repeated.filter_map(|s| s.releases.last().copied()).collect()
    }

    /// On what models are tried.
    pub(super) fn held_out(&self) -> HeldOut {
        match self.last_repeats().is_empty() {
            true => HeldOut::LaterPart,
            false => HeldOut::Releases,
        }
    }

    fn held_out_over_noise(&self, joint: &JointFit) -> f64 {
        let held = self.last_repeats();
        if held.is_empty() {
            let starts: Vec<Vec<f64>> = joint.fits.iter().map(|f| f.parameters.clone()).collect();
            let early = self.decays.iter().map(|decay| Release::part(decay, FITTED_SHARE));
            let early: Vec<Release> = early.collect();
            let early = joint::fit(&early, &joint.structure, &joint.sharing, &starts);
            return early.held_out_over_noise(self.decays);
        }
        // By another release of the same condition, where it shares with none.
        let repeat_of = |release: usize, kept: &[usize]| {
            let setting = self.settings.iter().find(|s| s.releases.contains(&release))?;
            kept.iter().position(|j| setting.releases.contains(j))
        };
        predicted_over_noise(self.decays, joint, &[held], repeat_of)
    }
}

/// A frequency, a width: numbers that a size alone does not compare.
fn has_more_than_a_size(effect: &Effect) -> bool {
    effect.parameters().len() > 1
}
