//! A campaign's releases fitted with what their coefficients allow in common, and tried on what was held out.

use crate::at_once::AtOnce;
use crate::bic::{self, MARGIN};
use crate::derivatives::campaign::Campaign as Made;
use crate::derivatives::condition::Setting;
use crate::diagnosis::answer::{HeldOut, Step, FITTED_SHARE};
use crate::diagnosis::buffeting::{self, Buffeted};
use crate::diagnosis::likelihood::are_explained;
use crate::diagnosis::origin::{self, weighted_mean, Origin, Plan, Seen, OWN};
use crate::diagnosis::releases::{
    from_others, over_noise, ModelOfReleases, ReleaseAnswers, Releases,
};
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::fitting::{Fitted, Limit, Number, Structure};
use crate::fit::free_decay::FreeDecay;
use crate::fit::joint::{self, JointFit, Release, Sharing};
use crate::quantity::Quantity;
use crate::record::Record;
use crate::statistics::weighted_median;
use std::collections::BTreeMap;

/// A model with the origin of its effects, and all releases fitted with the numbers they share.
pub(super) struct Shared {
    pub(crate) joint: JointFit,
    pub(crate) effects: Vec<SharedEffect>,
}

impl Shared {
    /// Whether every release is down to its noise.
    pub(super) fn is_explained(&self, decays: &[FreeDecay]) -> bool {
        are_explained(&self.joint.fits, decays)
    }
}

/// An effect of the model: where it comes from, why, and which releases share its coefficient.
pub(super) struct SharedEffect {
    pub(crate) effect: Effect,
    pub(crate) origin: Origin,
    pub(crate) reason: String,
    pub(crate) plan: Plan,
    pub(crate) seen: Vec<Seen>,
}

pub(super) struct Campaign<'a> {
    pub(crate) made: &'a Made,
    pub(crate) settings: Vec<Setting>,
    pub(crate) records: &'a [Record],
    pub(crate) releases: &'a Releases,
}

impl Campaign<'_> {
    fn whole(&self) -> Vec<Release<'_>> {
        self.releases.decays.iter().map(Release::whole).collect()
    }

    /// One coefficient for each condition.
    pub(super) fn by_condition(&self, of: impl Fn(usize) -> Option<Quantity>) -> Vec<Seen> {
        let seen = |setting: &Setting| {
            Some(Seen {
                spring: setting.spring.clone(),
                axis: setting.axis,
                wind_speed_m_s: setting.wind_speed_m_s,
                coefficient: weighted_mean(setting.releases.iter().filter_map(|&i| of(i)))?,
            })
        };
        self.settings.iter().filter_map(seen).collect()
    }

    /// The model with what its coefficients allow in common.
    pub(super) fn shared(&self, model: &ModelOfReleases) -> Result<Shared> {
        let whole = self.whole();
        let effects = &model.effects;
        let structure = Structure { effects: effects.clone(), ..model.fits[0].structure.clone() };
        let own = Sharing::none(whole.len(), effects.len());
        let alone = self.alone(&whole, model, &structure);
        self.releases.check()?;
        let tied = self.tied(&whole, &alone, &structure);
        self.releases.check()?;
        let fits: Vec<&Fitted> =
            tied.as_ref().unwrap_or(&alone).iter().map(|j| &j.fits[0]).collect();
        let effective: f64 = fits.iter().map(|fit| fit.effective_count()).sum();
        let mut attributed: Vec<SharedEffect> =
            effects.iter().map(|effect| self.attributed(effect, &fits, effective)).collect();
        let together = |attributed: &[SharedEffect]| {
            let groups = attributed.iter().map(|e| e.plan.groups.clone()).collect();
            joint::fit_from(&whole, &structure, &Sharing { effects: groups, ..own.clone() }, &fits)
        };
        // What is shared is chosen on the coefficients alone; whether it holds is tried on the releases.
        let squares: f64 = alone.iter().map(|joint| joint.sum_of_squares).sum();
        let numbers: usize = alone.iter().map(|joint| joint.parameters.len()).sum();
        let holds = |joint: &JointFit| {
            let fewer = numbers.saturating_sub(joint.parameters.len()) as f64;
            let lost = bic::gain(joint.sum_of_squares, squares, effective, fewer);
            joint.converged && lost < MARGIN
        };
        let mut joint = together(&attributed);
        // A line may have another frequency in each release where the rest has one coefficient in all.
        for may_be_own in [has_more_than_a_size, |_: &Effect| true] {
            self.releases.check()?;
            let shared = attributed.iter_mut().filter(|e| e.plan.name != OWN);
            let shared: Vec<&mut SharedEffect> = shared.filter(|e| may_be_own(&e.effect)).collect();
            if holds(&joint) || shared.is_empty() {
                continue;
            }
            shared.into_iter().for_each(|e| e.plan = e.plan.of_each());
            joint = together(&attributed);
        }
        let joint = joint.polished(&whole).with_discrepancy(&whole);
        Ok(Shared { joint, effects: attributed })
    }

    /// Each release once more, for the uncertainties of coefficients that ended at zero.
    fn alone(
        &self,
        whole: &[Release],
        model: &ModelOfReleases,
        structure: &Structure,
    ) -> Vec<JointFit> {
        let start = |fit: &Fitted| fit.in_order_of(structure).0;
        each_alone(whole, structure, model.fits.iter().map(start).collect())
    }

    /// The same with a line's frequency, or a stop's place, as most know it: where there is none, the size of what
    /// fits the noise best says nothing. `None` where a release has another, or none knows it.
    fn tied(
        &self,
        whole: &[Release],
        alone: &[JointFit],
        structure: &Structure,
    ) -> Option<Vec<JointFit>> {
        let mut tied = structure.clone();
        for effect in &structure.effects {
            let is_common = |k: &usize| !effect.belongs_to_release(*k);
            for number in (1..effect.parameters().len()).filter(is_common) {
                let known = |fit: &JointFit| Some(fit.quantity(fit.place(effect, number, 0)?));
                let known = alone.iter().filter_map(known).filter(|q| q.u > 0.0 && q.u.is_finite());
                let mut known: Vec<(f64, f64)> = known.map(|q| (q.value, q.u.powi(-2))).collect();
                // None where no release knows it.
                let value = Some(weighted_median(&mut known)).filter(|value| value.is_finite())?;
                let number = Number::Of(effect.clone(), number);
                tied.limits.push(Limit { number, low: value, high: value });
            }
        }
        let fewer = tied.limits.len() - structure.limits.len();
        let starts = alone.iter().map(|fit| fit.parameters.clone()).collect();
        let tied = (fewer > 0).then(|| each_alone(whole, &tied, starts))?;
        let holds = |(tied, alone): (&JointFit, &JointFit)| {
            let n = alone.effective_count();
            bic::gain(tied.sum_of_squares, alone.sum_of_squares, n, fewer as f64) < MARGIN
        };
        tied.iter().zip(alone).all(holds).then_some(tied)
    }

    fn attributed(&self, effect: &Effect, fits: &[&Fitted], effective: f64) -> SharedEffect {
        let parameter = &effect.parameters()[0];
        let seen = self.by_condition(|i| fits[i].coefficient(effect));
        let (origin, mut reason) = origin::decide(&seen, &parameter.unit);
        if effect.moves_rest() && origin == Origin::Undecided {
            reason.push_str(
                "; a sensor that was not zeroed shows as a moment that changes with the stiffness: fit with an unknown zero",
            );
        }
        let is_on = self.releases.wind_speed_m_s.iter().map(|v| *v > 0.0);
        let plan = if effect.belongs_to_release(0) || has_more_than_a_size(effect) {
            let all = Plan::of_all(origin, is_on);
            if has_more_than_a_size(effect) {
                all
            } else {
                all.of_each()
            }
        } else {
            let own: Vec<Seen> = (0..fits.len())
                .map(|i| {
                    let entry = &self.made.release[i];
                    Seen {
                        spring: entry.spring.clone(),
                        axis: entry.axis,
                        wind_speed_m_s: entry.wind_speed_m_s,
                        coefficient: fits[i]
                            .coefficient(effect)
                            .unwrap_or(Quantity::new(0.0, f64::INFINITY)),
                    }
                })
                .collect();
            origin::plan(origin, &own, effective)
        };
        SharedEffect { effect: effect.clone(), origin, reason, plan, seen }
    }

    /// Residual over noise on what a model was not fitted to.
    pub(super) fn held_out(&self, shared: &Shared) -> (HeldOut, f64) {
        let joint = &shared.joint;
        let decays = &self.releases.decays;
        let held: Vec<usize> = self
            .settings
            .iter()
            .filter(|s| s.releases.len() > 1)
            .filter_map(|s| s.releases.last().copied())
            .collect();
        if held.is_empty() {
            let starts: Vec<Vec<f64>> = joint.fits.iter().map(|f| f.parameters.clone()).collect();
            let early: Vec<Release> =
                decays.iter().map(|decay| Release::part(decay, FITTED_SHARE)).collect();
            let early = joint::fit(&early, &joint.structure, &joint.sharing, &starts);
            let later = early.held_out_over_noise(decays);
            return (HeldOut::LaterPart, later.unwrap_or(f64::NAN));
        }
        let fits = from_others(decays, joint, &held, |i, kept| self.repeat_of(i, kept));
        (HeldOut::Releases, over_noise(&fits, held.iter().map(|&i| &decays[i])))
    }

    /// Place in `kept` of another release of the same condition.
    fn repeat_of(&self, release: usize, kept: &[usize]) -> Option<usize> {
        let setting = self.settings.iter().find(|s| s.releases.contains(&release))?;
        kept.iter().position(|j| setting.releases.contains(j))
    }

    pub(super) fn step(&self, shared: &Shared) -> (HeldOut, Step) {
        let joint = &shared.joint;
        let decays = &self.releases.decays;
        let raw = joint.fits.iter().zip(decays).map(|(fit, decay)| {
            let n = (fit.count * decay.block) as f64;
            (n, n * decay.raw_rms_deg(fit.rms_rad()).powi(2))
        });
        let (n, squares) = raw.fold((0.0, 0.0), |s, (n, q)| (s.0 + n, s.1 + q));
        let (kind, held_out_over_noise) = self.held_out(shared);
        let step = Step {
            added: joint.structure.effects.last().cloned(),
            residual_rms_deg: (squares / n).sqrt(),
            residual_over_noise: joint.over_noise(),
            held_out_over_noise,
            parameters: in_common(joint),
        };
        (kind, step)
    }

    /// Random forcing in most releases with the wind on, or with it off, where definite effects do not
    /// explain them.
    pub(super) fn randomly_forced(
        &self,
        judged: &ReleaseAnswers,
        last: &Shared,
    ) -> Option<Vec<Buffeted>> {
        if last.is_explained(&self.releases.decays) && last.effects.len() < 2 {
            return None;
        }
        if !judged.alone.mostly(&Effect::random()) {
            return None;
        }
        let each = self.releases.decays.iter().zip(&judged.path[0].fits);
        each.map_at_once(|(decay, plain)| buffeting::fit(decay, plain)).collect()
    }
}

fn each_alone(whole: &[Release], structure: &Structure, starts: Vec<Vec<f64>>) -> Vec<JointFit> {
    let sharing = Sharing::none(1, structure.effects.len());
    let fit = |(release, start): (&Release, Vec<f64>)| {
        joint::fit(&[*release], structure, &sharing, &[start]).polished(&[*release])
    };
    whole.iter().zip(starts).map_at_once(fit).collect()
}

/// A frequency, a width: numbers that a size alone does not compare.
fn has_more_than_a_size(effect: &Effect) -> bool {
    effect.parameters().len() > 1
}

/// The effects' numbers that releases have in common; of those of several groups their mean.
pub(super) fn in_common(joint: &JointFit) -> BTreeMap<String, Quantity> {
    let mut parameters = BTreeMap::new();
    for effect in &joint.structure.effects {
        for (index, parameter) in effect.parameters().iter().enumerate() {
            let Some(number) = effect.varied_place(index) else { continue };
            if effect.belongs_to_release(number) {
                continue;
            }
            // Once for each group, whatever releases share it.
            let mut places: Vec<usize> =
                (0..joint.fits.len()).filter_map(|i| joint.place(effect, number, i)).collect();
            places.sort_unstable();
            places.dedup();
            let mean = weighted_mean(places.into_iter().map(|at| joint.quantity(at)));
            let name = format!("{}.{}", effect, parameter.name);
            parameters.extend(mean.map(|mean| (name, mean)));
        }
    }
    parameters
}
