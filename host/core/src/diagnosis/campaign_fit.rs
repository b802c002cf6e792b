//! A campaign's releases fitted with what their coefficients allow in common, and tried on what was held out.

use crate::bic::{self, MARGIN};
use crate::derivatives::campaign::Campaign as Made;
use crate::derivatives::condition::{settings, Setting};
use crate::diagnosis::answer::{Condition, HeldOut, FITTED_SHARE};
use crate::diagnosis::origin::{self, Origin, Plan, Seen};
use crate::diagnosis::releases::{predicted_over_noise, ModelOfReleases};
use crate::diagnosis::several_fit::{
    finished, sharing, structure, whole, SharedEffect, Source, Together,
};
use crate::diagnosis::wind::GrowsAs;
use crate::effects::{self, Effect};
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
        let start = |fit: &Fitted| (&structure, fit.in_order_of(&structure));
        let alone = self.each_alone(model.fits.iter().map(start));
        stop.check()?;
        let ways = self.ways(&alone, &structure);
        stop.check()?;
        let effective: f64 = alone.iter().map(JointFit::effective_count).sum();
        let together = |shared: &[SharedEffect], fits: &[&Fitted]| {
            let sharing = sharing(shared, (0..fits.len()).collect());
            joint::fit_from(&whole(self.decays), &structure, &sharing, fits)
        };
        let begun = ways.iter().map(|(each, by_wind)| {
            let fits: Vec<&Fitted> = each.iter().map(|joint| &joint.fits[0]).collect();
            let attributed = |effect| self.attributed(effect, &fits, effective, *by_wind);
            let shared: Vec<SharedEffect> = model.effects.iter().map(attributed).collect();
            (together(&shared, &fits), shared, fits)
        });
        let better = |a: (JointFit, _, _), b: (JointFit, _, _)| {
            let wins = b.0.bic().gain_over(&a.0.bic()) > 0.0 || !a.0.converged;
            if wins && b.0.converged {
                b
            } else {
                a
            }
        };
        let (mut joint, mut shared, fits) = begun.reduce(better).expect("one way at least");
        // What is shared is chosen on the coefficients alone; whether it holds is tried on the releases.
        let squares: f64 = alone.iter().map(|joint| joint.sum_of_squares).sum();
        let numbers: usize = alone.iter().map(|joint| joint.parameters.len()).sum();
        let holds = |joint: &JointFit| {
            let fewer = numbers.saturating_sub(joint.parameters.len()) as f64;
            let lost = bic::gain(joint.sum_of_squares, squares, effective, fewer);
            joint.converged && lost < MARGIN
        };
        let everywhere = Plan::of_all(Origin::Undecided, fits.iter().map(|_| true)).of_each();
        // A line may have another frequency in each release where the rest has one coefficient in all; and what is
        // little with the wind off may be needed there all the same.
        type Wider<'a> = dyn Fn(&SharedEffect) -> Plan + 'a;
        let line = |e: &SharedEffect| match has_more_than_a_size(&e.effect) {
            true => e.plan.of_each(),
            false => e.plan.clone(),
        };
        let wider: [&Wider; 3] = [&line, &|e| e.plan.of_each(), &|_| everywhere.clone()];
        for plan in wider {
            stop.check()?;
            let plans: Vec<Plan> = shared.iter().map(plan).collect();
            let same = |(e, plan): (&SharedEffect, &Plan)| e.plan.groups == plan.groups;
            if holds(&joint) || shared.iter().zip(&plans).all(same) {
                continue;
            }
            for (e, plan) in shared.iter_mut().zip(plans) {
                e.share_by(plan);
            }
            joint = together(&shared, &fits);
        }
        let grows: Vec<Option<GrowsAs>> =
            (0..shared.len()).map(|k| self.grows(&joint, &shared, k, effective)).collect();
        stop.check()?;
        let joint = finished(joint, self.decays);
        for (shared, grows) in shared.iter_mut().zip(grows) {
            if grows.is_some() {
                shared.source = Some(self.source_of_shared(&joint, shared, grows));
            }
        }
        let held_out_over_noise = self.held_out_over_noise(&joint);
        Ok(Together { joint, shared, held_out_over_noise })
    }

    /// Whether the numbers of the `k`th of the effects, which each wind speed has its own of in `joint`, go with the
    /// speed by their dimension: by how much worse that fits.
    fn grows(
        &self,
        joint: &JointFit,
        shared: &[SharedEffect],
        k: usize,
        effective: f64,
    ) -> Option<GrowsAs> {
        let SharedEffect { effect, plan, .. } = &shared[k];
        let of_each_wind = Plan::of_each_wind(&self.made.release);
        let reference_m_s =
            self.made.release.iter().map(|r| r.wind_speed_m_s).find(|v| *v > 0.0)?;
        if !has_more_than_a_size(effect) || plan.groups != of_each_wind.groups {
            return None;
        }
        let powers = effect.wind_powers(&[])?;
        let mut structure = joint.structure.clone();
        let place = structure.effects.iter().position(|e| e == effect)?;
        let source = effects::Source::Aerodynamic { reference_m_s };
        structure.effects[place] = effect.from_source(source)?;
        let mut shared = shared.to_vec();
        let is_on = self.decays.iter().map(|decay| decay.wind_speed_m_s > 0.0);
        shared[k].plan = Plan::of_all(Origin::Aerodynamic, is_on);
        let sharing = sharing(&shared, (0..self.decays.len()).collect());
        let start = |(i, fit): (usize, &Fitted)| {
            let mut p = fit.in_order_of(&fit.structure);
            let ratio = self.decays[i].wind_speed_m_s / reference_m_s;
            if let Some(at) = fit.structure.place(effect) {
                powers.iter().zip(&mut p[at..]).for_each(|(power, p)| *p /= ratio.powf(*power));
            }
            p
        };
        let starts: Vec<Vec<f64>> = joint.fits.iter().enumerate().map(start).collect();
        let by_dimension =
            joint::fit_or_lengthened(&whole(self.decays), &structure, &sharing, starts);
        let degrees = joint.parameters.len().saturating_sub(by_dimension.parameters.len());
        let worse = bic::gain(by_dimension.sum_of_squares, joint.sum_of_squares, effective, 0.0);
        (degrees > 0).then(|| GrowsAs { power: powers[0], chi_squared: worse.max(0.0), degrees })
    }

    /// As its numbers in common say it: each release by itself confuses a lag's size with its rate.
    fn source_of_shared(
        &self,
        joint: &JointFit,
        SharedEffect { effect, plan, source }: &SharedEffect,
        grows: Option<GrowsAs>,
    ) -> Source {
        let known = |i: usize| {
            let sharing = plan.groups.iter().filter(|group| **group == plan.groups[i]).count();
            let known = joint.quantity(joint.place(effect, 0, i)?);
            // Of the mean over all that share it the u is its own.
            Some(Quantity::new(known.value, known.u * (sharing as f64).sqrt()))
        };
        let off = |i: usize| {
            let here = Condition::new(&self.made.release[i]);
            let same = |s: &&Seen| s.is_of(&here);
            Some(source.as_ref()?.seen.iter().find(same)?.coefficient)
        };
        let seen = self.by_condition(|i| known(i).or_else(|| off(i)));
        let (origin, reason) = origin::decide(effect, &seen);
        Source { origin, reason, seen, grows }
    }

    /// Each release by its structure, begun there.
    fn each_alone<'b>(
        &self,
        starts: impl Iterator<Item = (&'b Structure, Vec<f64>)>,
    ) -> Vec<JointFit> {
        let fit = |(release, (structure, start)): (Release, (&Structure, Vec<f64>))| {
            let sharing = Sharing::none(1, structure.effects.len());
            joint::fit(&[release], structure, &sharing, &[start]).polished(&[release])
        };
        whole(self.decays).into_iter().zip(starts).par_map(fit).collect()
    }

    /// The releases' own fits with a line's frequency, or a stop's place, as most know it: as it is, and where it
    /// may go with the wind by its dimension, as the rate of a wake does, that way (`true`). Without wind, the
    /// size of what fits the noise best says nothing. `alone` where a release has another, or none knows it.
    fn ways(&self, alone: &[JointFit], structure: &Structure) -> Vec<(Vec<JointFit>, bool)> {
        let blown =
            |effect: &Effect| (1..effect.parameters().len()).any(|k| power(effect, k) != 0.0);
        let is_on = self.decays.iter().any(|decay| decay.wind_speed_m_s > 0.0);
        let may_be_blown = is_on && structure.effects.iter().any(blown);
        let ways = [false, true].into_iter().filter(|by_wind| may_be_blown || !by_wind);
        let tied = |by_wind| Some((self.tied_by(alone, structure, by_wind)?, by_wind));
        let tied: Vec<_> = ways.filter_map(tied).collect();
        if tied.is_empty() {
            vec![(alone.to_vec(), false)]
        } else {
            tied
        }
    }

    fn tied_by(
        &self,
        alone: &[JointFit],
        structure: &Structure,
        by_wind: bool,
    ) -> Option<Vec<JointFit>> {
        let speed = |i: usize| self.decays[i].wind_speed_m_s;
        let on = (0..alone.len()).map(speed).filter(|v| *v > 0.0);
        let least_m_s = on.fold(f64::INFINITY, f64::min);
        let mut tied = vec![structure.clone(); alone.len()];
        for effect in &structure.effects {
            let is_common = |k: &usize| !effect.belongs_to_release(*k);
            for number in (1..effect.parameters().len()).filter(is_common) {
                let power = if by_wind { power(effect, number) } else { 0.0 };
                // With the wind off what goes with it is asked for as at its lowest speed, and says nothing.
                let factor = |i: usize| match power != 0.0 {
                    true => speed(i).max(least_m_s).powf(power),
                    false => 1.0,
                };
                let known = |(i, fit): (usize, &JointFit)| {
                    let says = power == 0.0 || speed(i) > 0.0;
                    let known = fit.quantity(fit.place(effect, number, 0).filter(|_| says)?);
                    let weight = (known.u / factor(i)).powi(-2);
                    known.is_known().then(|| (known.value / factor(i), weight))
                };
                let mut known: Vec<(f64, f64)> =
                    alone.iter().enumerate().filter_map(known).collect();
                // None where no release knows it.
                let value = Some(weighted_median(&mut known)).filter(|value| value.is_finite())?;
                for (i, tied) in tied.iter_mut().enumerate() {
                    let (number, value) = (Number::Of(effect.clone(), number), value * factor(i));
                    tied.limits.push(Limit { number, low: value, high: value });
                }
            }
        }
        let fewer = tied[0].limits.len() - structure.limits.len();
        let starts = tied.iter().zip(alone.iter().map(|fit| fit.parameters.clone()));
        let tied = (fewer > 0).then(|| self.each_alone(starts))?;
        let holds = |(tied, alone): (&JointFit, &JointFit)| {
            let n = alone.effective_count();
            bic::gain(tied.sum_of_squares, alone.sum_of_squares, n, fewer as f64) < MARGIN
        };
        tied.iter().zip(alone).all(holds).then_some(tied)
    }

    /// `by_wind`: its numbers beside the size go with the wind by their dimension.
    fn attributed(
        &self,
        effect: &Effect,
        fits: &[&Fitted],
        effective: f64,
        by_wind: bool,
    ) -> SharedEffect {
        let seen = self.by_condition(|i| fits[i].coefficient(effect));
        let (origin, mut reason) = origin::decide(effect, &seen);
        if effect.moves_rest() && origin == Origin::Undecided {
            reason.push_str(
                "; a sensor that was not zeroed shows as a moment that changes with the stiffness: fit with an unknown zero",
            );
        }
        let all = Plan::of_all(origin, self.decays.iter().map(|d| d.wind_speed_m_s > 0.0));
        let goes_with_wind = (1..effect.parameters().len()).any(|k| power(effect, k) != 0.0);
        let plan = if by_wind && goes_with_wind {
            Plan::of_each_wind(&self.made.release)
        } else if has_more_than_a_size(effect) {
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
        let source = Some(Source { origin, reason, seen, grows: None });
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

/// The power of the wind speed with which a number goes by its dimension where the air makes the effect.
fn power(effect: &Effect, number: usize) -> f64 {
    effect.wind_powers(&[]).and_then(|powers| powers.get(number).copied()).unwrap_or(0.0)
}

/// A frequency, a width: numbers that a size alone does not compare.
fn has_more_than_a_size(effect: &Effect) -> bool {
    effect.parameters().len() > 1
}
