//! Which effects several releases need: each is judged by itself, and what their answers name is tried in all
//! of them, each with numbers of its own.

use crate::at_once::AtOnce;
use crate::bic::{self, MARGIN};
use crate::diagnosis::alone::Alone;
use crate::diagnosis::answer::Options;
use crate::diagnosis::likelihood::MOST_EFFECTS;
use crate::diagnosis::origin::weighted_mean;
use crate::diagnosis::search::sharpened;
use crate::effects::{Acts, Effect};
use crate::error::Result;
use crate::fit::fitting::{
    fit_added, fit_plain_within, fit_removed, refitted, Fitted, Limit, Number, Structure,
};
use crate::fit::free_decay::FreeDecay;
use crate::fit::joint::{self, JointFit, Release, Sharing};
use crate::quantity::Quantity;
use crate::record::{same_measurand, Record};

/// So many releases are judged by themselves, those that the model explains worst that is there already.
const JUDGED: usize = 8;

/// The releases with the wind speed of each.
pub(crate) struct Releases {
    pub(crate) decays: Vec<FreeDecay>,
    pub(crate) wind_speed_m_s: Vec<f64>,
}

impl Releases {
    /// # Errors
    /// Naming the record without a free decay.
    pub(crate) fn of(
        records: &[Record],
        wind_speed_m_s: Vec<f64>,
        options: &Options,
    ) -> Result<Self> {
        let one = |(record, wind_speed_m_s): (&Record, &f64)| {
            let (wind_speed_m_s, stop) = (*wind_speed_m_s, options.stop.clone());
            stop.check()?;
            Ok(FreeDecay { wind_speed_m_s, stop, ..FreeDecay::of(record)? })
        };
        // Collected first, so that of several bad records always the first is named.
        let decays: Vec<Result<FreeDecay>> =
            records.iter().zip(&wind_speed_m_s).map_at_once(one).collect();
        same_measurand(records)?;
        Ok(Self { decays: decays.into_iter().collect::<Result<_>>()?, wind_speed_m_s })
    }

    /// # Errors
    /// [`Error::Interrupted`](crate::error::Error::Interrupted) once somebody has asked for it.
    pub(crate) fn check(&self) -> Result<()> {
        self.decays.iter().try_for_each(|decay| decay.stop.check())
    }
}

/// One structure, each release with numbers of its own.
#[derive(Clone)]
pub(crate) struct ModelOfReleases {
    pub(crate) effects: Vec<Effect>,
    pub(crate) fits: Vec<Fitted>,
}

impl ModelOfReleases {
    /// Whether it moves at all as the releases do: what has no motion with some numbers has no residual.
    fn is_fitted(&self) -> bool {
        self.fits.iter().all(|fit| fit.sum_of_squares.is_finite())
    }

    /// The releases it explains worst.
    fn worst(&self, releases: &Releases) -> Vec<usize> {
        let over: Vec<f64> =
            self.fits.iter().zip(&releases.decays).map(|(f, decay)| f.over_noise(decay)).collect();
        let mut all: Vec<usize> = (0..over.len()).collect();
        all.sort_by(|&a, &b| over[b].total_cmp(&over[a]));
        all.truncate(JUDGED);
        all.sort_unstable();
        all
    }
}

pub(crate) struct ReleaseAnswers {
    pub(crate) alone: Alone,
    /// From the model that is there to the final one, an effect more each.
    pub(crate) path: Vec<ModelOfReleases>,
}

/// Pooled rms of the residuals over each release's noise.
pub(crate) fn over_noise<'a>(
    fits: impl IntoIterator<Item = &'a Fitted>,
    decays: impl IntoIterator<Item = &'a FreeDecay>,
) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for (fit, decay) in fits.into_iter().zip(decays) {
        sum += fit.count as f64 * fit.over_noise(decay).powi(2);
        n += fit.count as f64;
    }
    f64::sqrt(sum / f64::max(n, 1.0))
}

/// Gain in the information criterion by `effect`, which `larger` has and `smaller` has not. The best of: a
/// coefficient of its own in each release that needs one; one coefficient for all releases, for the wind-on
/// or the wind-off ones.
fn evidence(releases: &Releases, smaller: &[Fitted], larger: &[Fitted], effect: &Effect) -> f64 {
    let more = effect.parameters().len() as f64;
    let gains: Vec<(f64, f64)> = smaller
        .iter()
        .zip(larger)
        .map(|(small, large)| {
            let n = large.effective_count();
            let gain = bic::gain(small.sum_of_squares, large.sum_of_squares, n, 0.0);
            (if large.converged { gain.max(0.0) } else { 0.0 }, n)
        })
        .collect();
    let own: f64 = gains.iter().map(|(gain, n)| (gain - bic::cost(more, *n)).max(0.0)).sum();
    if more > 1.0 || effect.belongs_to_release(0) {
        return own;
    }
    let sizes: Vec<Option<Quantity>> = larger.iter().map(|fit| fit.coefficient(effect)).collect();
    let one = |among: &dyn Fn(f64) -> bool| {
        let inside: Vec<usize> =
            (0..larger.len()).filter(|&i| among(releases.wind_speed_m_s[i])).collect();
        let known: Vec<Quantity> = inside.iter().filter_map(|&i| sizes[i]).collect();
        let Some(mean) = weighted_mean(known.iter().copied()) else { return 0.0 };
        let misfit: f64 = known
            .iter()
            .filter(|q| q.u > 0.0 && q.u.is_finite())
            .map(|q| ((q.value - mean.value) / q.u).powi(2))
            .sum();
        let (gain, n) =
            inside.iter().fold((0.0, 0.0), |s, &i| (s.0 + gains[i].0, s.1 + gains[i].1));
        gain - misfit - bic::cost(1.0, f64::max(n, 2.0))
    };
    own.max(one(&|_| true)).max(one(&|v| v > 0.0)).max(one(&|v| v == 0.0))
}

/// Judges all releases as one, from a model of `structure` on. Noise floors become those that the releases'
/// own answers show.
///
/// # Errors
/// Where a model that is there cannot be fitted; interrupted.
pub(crate) fn judge(
    records: &[Record],
    releases: &mut Releases,
    structure: &Structure,
    options: &Options,
) -> Result<ReleaseAnswers> {
    let plain = |decay: &FreeDecay| {
        let plain = fit_plain_within(decay, structure, decay.yaw_rad.len());
        structure.effects.iter().fold(plain, |model, effect| fit_added(decay, &model, effect))
    };
    let effects = structure.effects.clone();
    let there = effects.len();
    let plain =
        ModelOfReleases { effects, fits: releases.decays.iter().map_at_once(plain).collect() };
    releases.check()?;
    let alone = Alone::of(records, plain.worst(releases), &releases.decays, options)?;
    for (of, release) in alone.answers.iter().zip(&alone.which) {
        releases.decays[*release] = of.decays[0].clone();
    }
    let known = |e: &Effect| plain.effects.contains(e) || structure.zero_unknown && e.moves_rest();
    let mut named = alone.named();
    named.retain(|effect| !known(effect));
    // What lasts does so in every release of a rig, or in all with the wind on; what depends on the amplitude may
    // show in one only.
    let lasts = |e: &Effect| !matches!(e.acts_on(), Acts::State | Acts::Sensor) && !e.dies_out();
    named.retain(|effect| !lasts(effect) || alone.mostly(effect));
    named.truncate(MOST_EFFECTS);
    // Beside a constant moment effects act about the sensor's zero, or about the angle of rest.
    let moves_rest = named.iter().any(Effect::moves_rest);
    let both = [false, true].into_iter().filter(|about_rest| moves_rest || !about_rest);
    let both = both.map(|about_rest| begun(releases, &alone, &plain, &named, about_rest));
    let both: Vec<ModelOfReleases> = both.collect::<Result<_>>()?;
    let over = |model: &ModelOfReleases| over_noise(&model.fits, &releases.decays);
    let all = both.into_iter().min_by(|a, b| over(a).total_cmp(&over(b))).expect("a model");
    // From all down to what is there, what is missed least taken out first.
    let mut path = vec![pruned(releases, &alone, all, there)?];
    while let Some(larger) = path.last().filter(|model| model.effects.len() > there + 1) {
        let smaller = larger.effects[there..]
            .iter()
            .map(|effect| removed(releases, &alone, larger, effect))
            .collect::<Result<Vec<_>>>()?;
        let worst = |model: &ModelOfReleases| over_noise(&model.fits, &releases.decays);
        let fitted = smaller.into_iter().filter(ModelOfReleases::is_fitted);
        path.push(match fitted.min_by(|a, b| worst(a).total_cmp(&worst(b))) {
            Some(least) => least,
            // From the beginning, where none is to be had from here.
            None => {
                let about_rest = larger.fits[0].structure.about_rest;
                let less = &larger.effects[there..larger.effects.len() - 1];
                begun(releases, &alone, &plain, less, about_rest)?
            }
        });
    }
    if path[path.len() - 1].effects.len() > there {
        path.push(plain);
    }
    path.reverse();
    // In the order in which they help.
    for k in 1..path.len() {
        let before = path[k - 1].effects.clone();
        let new = path[k].effects.iter().find(|e| !before.contains(e)).cloned();
        path[k].effects = before.into_iter().chain(new).collect();
    }
    for (decay, fit) in releases.decays.iter_mut().zip(&path[path.len() - 1].fits) {
        *decay = sharpened(decay.clone(), fit);
    }
    Ok(ReleaseAnswers { alone, path })
}

/// `fit` in every release, unless the user stops it; from where the release's own answer is, where that is
/// nearer.
fn each(
    releases: &Releases,
    alone: &Alone,
    inner: &ModelOfReleases,
    fit: impl Fn(&FreeDecay, &Fitted) -> Fitted + Sync,
) -> Result<Vec<Fitted>> {
    let one = |(i, inner): (usize, &Fitted)| {
        let decay = &releases.decays[i];
        decay.stop.check()?;
        let fitted = fit(decay, inner);
        let same = |model: &&Fitted| {
            let (a, b) = (&model.structure.effects, &fitted.structure.effects);
            let rest = |e: &Effect| fitted.structure.zero_unknown && e.moves_rest();
            b.iter().all(|e| a.contains(e)) && a.iter().all(|e| b.contains(e) || rest(e))
        };
        let known = alone.of_release(i).and_then(|answer| answer.models(0).find(same));
        let known = known.and_then(|model| {
            let start = model.numbers_for(&fitted.structure)?;
            Some(refitted(decay, &fitted.structure, &start))
        });
        let nearer = |known: &Fitted| known.sum_of_squares < fitted.sum_of_squares;
        Ok(known.filter(nearer).unwrap_or(fitted))
    };
    inner.fits.iter().enumerate().map_at_once(one).collect()
}

/// The model with all `named` effects, each release from its own answer.
fn begun(
    releases: &Releases,
    alone: &Alone,
    plain: &ModelOfReleases,
    named: &[Effect],
    about_rest: bool,
) -> Result<ModelOfReleases> {
    let effects: Vec<Effect> = plain.effects.iter().chain(named).cloned().collect();
    let one = |(i, plain): (usize, &Fitted)| {
        let decay = &releases.decays[i];
        decay.stop.check()?;
        let structure =
            Structure { effects: effects.clone(), about_rest, ..plain.structure.clone() };
        let own = alone.of_release(i).map(|answer| answer.last(0));
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
    let fits = plain.fits.iter().enumerate().map_at_once(one).collect::<Result<_>>()?;
    Ok(ModelOfReleases { effects, fits })
}

fn removed(
    releases: &Releases,
    alone: &Alone,
    model: &ModelOfReleases,
    effect: &Effect,
) -> Result<ModelOfReleases> {
    let effects = model.effects.iter().filter(|&e| *e != *effect).cloned().collect();
    let fits = each(releases, alone, model, |decay, fit| fit_removed(decay, fit, effect))?;
    Ok(ModelOfReleases { effects, fits })
}

/// Takes out again what the others have made needless, but for what is `there` from the beginning.
fn pruned(
    releases: &Releases,
    alone: &Alone,
    mut model: ModelOfReleases,
    there: usize,
) -> Result<ModelOfReleases> {
    while model.effects.len() > there {
        let without: Vec<(f64, ModelOfReleases)> = model.effects[there..]
            .iter()
            .map(|effect| {
                let smaller = removed(releases, alone, &model, effect)?;
                Ok((evidence(releases, &smaller.fits, &model.fits, effect), smaller))
            })
            .collect::<Result<_>>()?;
        let needless = without
            .into_iter()
            .filter(|(_, smaller)| smaller.is_fitted())
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(worth, _)| *worth <= MARGIN);
        match needless {
            Some((_, smaller)) => model = smaller,
            None => break,
        }
    }
    Ok(model)
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
            fix(Number::NaturalFrequency, others.fits[partner].parameters[0]);
            fix(Number::DampingRatio, others.fits[partner].parameters[1]);
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
    held.iter().map_at_once(known).collect()
}
