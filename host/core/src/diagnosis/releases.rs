//! Which effects several releases need: each is judged by itself, and what their answers name is tried in all
//! of them, each with numbers of its own.

use crate::bic::{self, MARGIN};
use crate::diagnosis::alone::Alone;
use crate::diagnosis::answer::Options;
use crate::diagnosis::flexible::is_simple;
use crate::diagnosis::guards;
use crate::diagnosis::likelihood::MAX_EFFECTS;
use crate::diagnosis::nested::{Judge, Nested};
use crate::diagnosis::search::sharpened;
use crate::diagnosis::search_start::library;
use crate::effects::{Acts, Effect};
use crate::error::Result;
use crate::fit::fitting::{
    fit_added, fit_plain_within, fit_removed, refitted, Fitted, Limit, Number, Structure,
};
use crate::fit::free_decay::FreeDecay;
use crate::fit::joint::{self, JointFit, Release, Sharing};
use crate::fit::structure::{WN, ZETA};
use crate::par_map::ParMap;
use crate::quantity::{chi_squared, weighted_mean, Quantity};
use crate::record::{same_measurand, Record};
use crate::statistics::{weighted_median, weighted_rms};
use crate::stop::Stop;

/// The free decays of `records`, with the wind speed of each.
///
/// # Errors
/// Naming the record without one; interrupted.
pub(super) fn free_decays(
    records: &[Record],
    wind_speed_m_s: impl Iterator<Item = f64>,
    stop: &Stop,
) -> Result<Vec<FreeDecay>> {
    let one = |(record, wind_speed_m_s): (&Record, f64)| {
        stop.check()?;
        Ok(FreeDecay { wind_speed_m_s, stop: stop.clone(), ..FreeDecay::from_record(record)? })
    };
    // Collected first, so that of several bad records always the first is named.
    let each = records.iter().zip(wind_speed_m_s);
    let decays: Vec<Result<FreeDecay>> = each.par_map(one).collect();
    same_measurand(records)?;
    decays.into_iter().collect()
}

/// One structure, each release with numbers of its own.
#[derive(Clone)]
pub(super) struct ModelOfReleases {
    pub(super) effects: Vec<Effect>,
    pub(super) fits: Vec<Fitted>,
}

impl ModelOfReleases {
    /// Whether it moves at all as the releases do: what has no motion with some numbers has no residual.
    fn is_fitted(&self) -> bool {
        self.fits.iter().all(|fit| fit.sum_of_squares.is_finite())
    }

    /// The releases it explains worst, as many as are judged by themselves.
    fn worst(&self, decays: &[FreeDecay]) -> Vec<usize> {
        let over: Vec<f64> = self.fits.iter().zip(decays).map(|(f, d)| f.over_noise(d)).collect();
        let mut all: Vec<usize> = (0..over.len()).collect();
        all.sort_by(|&a, &b| over[b].total_cmp(&over[a]));
        all.truncate(8);
        all.sort_unstable();
        all
    }
}

pub(super) struct ReleaseAnswers {
    pub(super) alone: Alone,
    /// From the model that is there to the final one, an effect more each.
    pub(super) path: Vec<ModelOfReleases>,
}

/// Pooled rms of the residuals over each release's noise.
fn over_noise<'a>(
    fits: impl IntoIterator<Item = &'a Fitted>,
    decays: impl IntoIterator<Item = &'a FreeDecay>,
) -> f64 {
    let each = fits.into_iter().zip(decays);
    weighted_rms(each.map(|(fit, decay)| (fit.count as f64, fit.over_noise(decay))))
}

/// Judges all releases as one, from a model of `structure` on. Noise floors become those that the releases'
/// own answers show.
///
/// # Errors
/// Where a model that is there cannot be fitted; interrupted.
pub(super) fn judge(
    records: &[Record],
    decays: &mut [FreeDecay],
    structure: &Structure,
    options: &Options,
) -> Result<ReleaseAnswers> {
    let plain = |decay: &FreeDecay| {
        let plain = fit_plain_within(decay, structure, decay.yaw_rad.len());
        structure.effects.iter().fold(plain, |model, effect| fit_added(decay, &model, effect))
    };
    let fits = decays.iter().par_map(plain).collect();
    let plain = ModelOfReleases { effects: structure.effects.clone(), fits };
    options.stop.check()?;
    let alone = Alone::new(records, plain.worst(decays), decays, options)?;
    for (of, release) in alone.answers.iter().zip(&alone.which) {
        decays[*release] = of.decays[0].clone();
    }
    let path = Search { decays, alone: &alone, plain }.path()?;
    for (decay, fit) in decays.iter_mut().zip(&path[path.len() - 1].fits) {
        *decay = sharpened(decay.clone(), fit);
    }
    Ok(ReleaseAnswers { alone, path })
}

/// What a model of all releases is looked for from: what was said of each, and the model that is there.
struct Search<'a> {
    decays: &'a [FreeDecay],
    alone: &'a Alone,
    plain: ModelOfReleases,
}

impl Search<'_> {
    /// From the model that is there to the final one, an effect more each.
    fn path(self) -> Result<Vec<ModelOfReleases>> {
        let named = self.named();
        // Beside a constant moment effects act about the sensor's zero, or about the angle of rest.
        let moves_rest = named.iter().any(Effect::moves_rest);
        let both = [false, true].into_iter().filter(|about_rest| moves_rest || !about_rest);
        let both = both.map(|about_rest| self.begun(&named, about_rest));
        let both = both.collect::<Result<Vec<_>>>()?;
        let nearer =
            |a: &ModelOfReleases, b: &ModelOfReleases| self.misfit(a).total_cmp(&self.misfit(b));
        let all = both.into_iter().min_by(nearer).expect("a model");
        self.bent(Nested::pruned(&self, all)?)?.path(&self, self.plain.clone())
    }

    /// `here`, or one effect that bends in the place of its several, where that is nearer to all releases.
    fn bent(&self, here: Nested<ModelOfReleases>) -> Result<Nested<ModelOfReleases>> {
        if self.effects(&here.model).len() < 2 {
            return Ok(here);
        }
        let about_rest = here.model.fits[0].structure.about_rest;
        let stands = |bent: &ModelOfReleases| {
            self.misfit(bent) < self.misfit(&here.model)
                && bent.fits.iter().zip(self.decays).all(|(fit, decay)| {
                    !is_simple(fit, decay)
                        && guards::refusal(fit, decay, &self.plain.effects).is_none()
                })
        };
        let mut flexible = library(&self.decays[0], &here.model.effects);
        flexible.retain(Effect::is_flexible);
        let bent = flexible.into_iter().map(|effect| self.begun(&[effect], about_rest));
        let bent = bent.collect::<Result<Vec<_>>>()?.into_iter().filter(stands);
        let nearest = bent.min_by(|a, b| self.misfit(a).total_cmp(&self.misfit(b)));
        Ok(nearest.map_or(here, Nested::from))
    }

    /// What the releases' answers name beyond what is there.
    fn named(&self) -> Vec<Effect> {
        let zero_unknown = self.plain.fits[0].structure.zero_unknown;
        let known = |e: &Effect| self.plain.effects.contains(e) || zero_unknown && e.moves_rest();
        // What lasts does so in every release of a rig, or in all with the wind on; what depends on the
        // amplitude may show in one only.
        let lasts =
            |e: &Effect| !matches!(e.acts_on(), Acts::State | Acts::Sensor) && !e.dies_out();
        let mut named = self.alone.named();
        named.retain(|e| !known(e) && (!lasts(e) || self.alone.mostly(e)));
        named.truncate(MAX_EFFECTS);
        named
    }

    /// The model with all `named` effects, each release from its own answer.
    fn begun(&self, named: &[Effect], about_rest: bool) -> Result<ModelOfReleases> {
        let effects: Vec<Effect> = self.plain.effects.iter().chain(named).cloned().collect();
        let one = |(i, plain): (usize, &Fitted)| {
            let decay = &self.decays[i];
            decay.stop.check()?;
            let structure =
                Structure { effects: effects.clone(), about_rest, ..plain.structure.clone() };
            let own = self.alone.of_release(i).map(|answer| answer.last(0));
            let own = own.and_then(|model| {
                let Structure { effects: own, zero_unknown, .. } = &model.structure;
                let has = |e: &&Effect| own.contains(e) || e.moves_rest() && *zero_unknown;
                let there = effects.iter().filter(has).cloned().collect();
                let there = Structure { effects: there, ..structure.clone() };
                Some(refitted(decay, &there, &model.numbers_for(&there)?))
            });
            let mut start = own.unwrap_or_else(|| plain.clone());
            start.structure.about_rest = about_rest;
            let missing = effects.iter().filter(|e| !start.structure.effects.contains(e));
            let model = missing.fold(start.clone(), |model, e| fit_added(decay, &model, e));
            let numbers = model.numbers_for(&structure).expect("all effects");
            Ok(refitted(decay, &structure, &numbers))
        };
        let fits = self.plain.fits.iter().enumerate().par_map(one).collect::<Result<_>>()?;
        let all = ModelOfReleases { effects, fits };
        named.iter().try_fold(all, |model, effect| self.shown_by_others(model, effect))
    }

    /// `model`, each release that does not name `effect` begun, too, where those that do have ended: of a number
    /// beside a size little is seen where the size is little.
    fn shown_by_others(
        &self,
        mut model: ModelOfReleases,
        effect: &Effect,
    ) -> Result<ModelOfReleases> {
        let names = |&i: &usize| {
            let own = self.alone.of_release(i);
            own.is_some_and(|answer| answer.diagnosis.effects.contains(effect))
        };
        let shown = (0..model.fits.len()).filter(names);
        let shown: Vec<&[f64]> = shown.filter_map(|i| model.fits[i].varied(effect)).collect();
        if effect.parameters().len() == 1 || shown.is_empty() {
            return Ok(model);
        }
        let middle = |k: usize| {
            let mut of_each: Vec<(f64, f64)> = shown.iter().map(|own| (own[k], 1.0)).collect();
            weighted_median(&mut of_each)
        };
        let begin: Vec<(usize, f64)> = (0..shown[0].len())
            .filter(|&k| !effect.belongs_to_release(k))
            .map(|k| (k, middle(k)))
            .collect();
        let one = |(i, fit): (usize, &Fitted)| {
            let decay = &self.decays[i];
            decay.stop.check()?;
            let Some(place) = fit.structure.place(effect).filter(|_| !names(&i)) else {
                return Ok(fit.clone());
            };
            let mut start = fit.parameters.clone();
            begin.iter().for_each(|(k, number)| start[place + k] = *number);
            let other = refitted(decay, &fit.structure, &start);
            Ok(if other.sum_of_squares < fit.sum_of_squares { other } else { fit.clone() })
        };
        model.fits = model.fits.iter().enumerate().par_map(one).collect::<Result<_>>()?;
        Ok(model)
    }

    /// Without `effect`; from where a release's own answer is, where that is nearer.
    fn removed(&self, model: &ModelOfReleases, effect: &Effect) -> Result<ModelOfReleases> {
        let one = |(i, larger): (usize, &Fitted)| {
            let decay = &self.decays[i];
            decay.stop.check()?;
            let fitted = fit_removed(decay, larger, effect);
            let same = |model: &&Fitted| {
                let (a, b) = (&model.structure.effects, &fitted.structure.effects);
                let rest = |e: &Effect| fitted.structure.zero_unknown && e.moves_rest();
                b.iter().all(|e| a.contains(e)) && a.iter().all(|e| b.contains(e) || rest(e))
            };
            let known = self.alone.of_release(i).and_then(|answer| answer.models(0).find(same));
            let known = known.and_then(|model| {
                let start = model.numbers_for(&fitted.structure)?;
                Some(refitted(decay, &fitted.structure, &start))
            });
            let nearer = |known: &Fitted| known.sum_of_squares < fitted.sum_of_squares;
            Ok(known.filter(nearer).unwrap_or(fitted))
        };
        let fits = model.fits.iter().enumerate().par_map(one).collect::<Result<_>>()?;
        let effects = model.effects.iter().filter(|&e| e != effect).cloned().collect();
        Ok(ModelOfReleases { effects, fits })
    }

    /// Gain in the information criterion by `effect`, which `larger` has and `smaller` has not. The best of:
    /// a coefficient of its own in each release that needs one; one coefficient for all releases, for the
    /// wind-on or the wind-off ones.
    fn delta_bic(&self, smaller: &[Fitted], larger: &[Fitted], effect: &Effect) -> f64 {
        let more = effect.parameters().len() as f64;
        let gain = |(small, large): (&Fitted, &Fitted)| {
            let n = large.effective_count();
            let gain = bic::gain(small.sum_of_squares, large.sum_of_squares, n, 0.0);
            (if large.converged { gain.max(0.0) } else { 0.0 }, n)
        };
        let gains: Vec<(f64, f64)> = smaller.iter().zip(larger).map(gain).collect();
        let own: f64 = gains.iter().map(|(gain, n)| (gain - bic::cost(more, *n)).max(0.0)).sum();
        if more > 1.0 || effect.belongs_to_release(0) {
            return own;
        }
        let one = |among: fn(f64) -> bool| {
            let inside: Vec<usize> =
                (0..larger.len()).filter(|&i| among(self.decays[i].wind_speed_m_s)).collect();
            let sizes = inside.iter().filter_map(|&i| larger[i].coefficient(effect));
            let sizes: Vec<Quantity> = sizes.collect();
            let Some(mean) = weighted_mean(sizes.iter().copied()) else { return 0.0 };
            let sum = |s: (f64, f64), &i: &usize| (s.0 + gains[i].0, s.1 + gains[i].1);
            let (gain, n) = inside.iter().fold((0.0, 0.0), sum);
            gain - chi_squared(sizes, mean.value) - bic::cost(1.0, f64::max(n, 2.0))
        };
        own.max(one(|_| true)).max(one(|v| v > 0.0)).max(one(|v| v == 0.0))
    }
}

impl Judge for Search<'_> {
    type Model = ModelOfReleases;

    fn effects<'a>(&self, model: &'a ModelOfReleases) -> &'a [Effect] {
        &model.effects[self.plain.effects.len()..]
    }
    fn without(&self, model: &ModelOfReleases, effect: &Effect) -> Option<ModelOfReleases> {
        let smaller = self.removed(model, effect).ok()?;
        if smaller.is_fitted() {
            return Some(smaller);
        }
        // From the beginning, where it is not to be had from the larger one.
        let named = &smaller.effects[self.plain.effects.len()..];
        self.begun(named, model.fits[0].structure.about_rest).ok()
    }
    fn is_worth(&self, smaller: &ModelOfReleases, larger: &ModelOfReleases) -> bool {
        let mut more = larger.effects.iter().filter(|e| !smaller.effects.contains(e));
        !smaller.is_fitted()
            || more.any(|e| self.delta_bic(&smaller.fits, &larger.fits, e) > MARGIN)
    }
    fn misfit(&self, model: &ModelOfReleases) -> f64 {
        over_noise(&model.fits, self.decays)
    }
    fn stop(&self) -> &Stop {
        &self.decays[0].stop
    }
}

/// The releases `held` fitted with what they have in common with the others known from these; their own
/// numbers are estimated anew. `repeat_of`: the place, among the others, of one that stands for a release
/// which shares with none.
pub(super) fn from_others(
    decays: &[FreeDecay],
    joint: &JointFit,
    held: &[usize],
    repeat_of: impl Fn(usize, &[usize]) -> Option<usize> + Sync,
) -> Vec<Fitted> {
    let kept: Vec<usize> = (0..decays.len()).filter(|i| !held.contains(i)).collect();
    let part = |groups: &Vec<Option<usize>>| kept.iter().map(|&i| groups[i]).collect();
    let sharing = Sharing {
        modal: kept.iter().map(|&i| joint.sharing.modal[i]).collect(),
        effects: joint.sharing.effects.iter().map(part).collect(),
    };
    let whole: Vec<Release> = kept.iter().map(|&i| Release::whole(&decays[i])).collect();
    let starts: Vec<Vec<f64>> = kept.iter().map(|&i| joint.fits[i].parameters.clone()).collect();
    let others = joint::fit(&whole, &joint.structure, &sharing, &starts);
    let known = |&release: &usize| {
        let mut structure = joint.fits[release].structure.clone();
        let mut fix = |number, value| {
            structure.limits.push(Limit { number, low: value, high: value });
        };
        let modal = sharing.modal.iter().position(|m| *m == joint.sharing.modal[release]);
        if let Some(partner) = modal {
            fix(Number::NaturalFrequency, others.fits[partner].parameters[WN]);
            fix(Number::DampingRatio, others.fits[partner].parameters[ZETA]);
        }
        for (effect, groups) in joint.structure.effects.iter().zip(&joint.sharing.effects) {
            let partner = kept.iter().position(|&j| groups[j] == groups[release]);
            let Some(partner) = partner.or_else(|| repeat_of(release, &kept)) else { continue };
            for number in (0..effect.parameters().len()).filter(|k| !effect.belongs_to_release(*k))
            {
                if let Some(at) = others.place(effect, number, partner) {
                    fix(Number::Of(effect.clone(), number), others.parameters[at]);
                }
            }
        }
        refitted(&decays[release], &structure, &joint.fits[release].parameters)
    };
    held.iter().par_map(known).collect()
}

/// Residual over noise of each of the `sets` of releases, as the others predict it ([`from_others`]).
pub(super) fn predicted_over_noise(
    decays: &[FreeDecay],
    joint: &JointFit,
    sets: &[Vec<usize>],
    repeat_of: impl Fn(usize, &[usize]) -> Option<usize> + Sync,
) -> f64 {
    let predicted = sets.iter().par_map(|held| from_others(decays, joint, held, &repeat_of));
    let fits: Vec<Fitted> = predicted.flatten().collect();
    over_noise(&fits, sets.iter().flatten().map(|&i| &decays[i]))
}
