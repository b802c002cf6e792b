//! Models of several releases with what they have in common; and of a rig's releases those with effects that
//! all of them need at once, or that survive prediction over the pieces of all.

use crate::derivatives::campaign::Campaign;
use crate::diagnosis::account::{standing, Standing};
use crate::diagnosis::alike::alike;
use crate::diagnosis::guards::{self, Refusal};
use crate::diagnosis::origin::{Origin, Plan, Seen};
use crate::diagnosis::releases::{predicted_over_noise, ModelOfReleases, ReleaseAnswers};
use crate::diagnosis::survivors::{self, PredictedModel, Survivors};
use crate::diagnosis::together::Releases;
use crate::diagnosis::verdict::MAX_LEFT;
use crate::diagnosis::wind::GrowsAs;
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::fitting::{fit_added, Fitted, Structure};
use crate::fit::free_decay::FreeDecay;
use crate::fit::joint::{self, JointFit, Release, Sharing};
use crate::par_map::ParMap;
use crate::quantity::{weighted_mean, Quantity};
use crate::statistics::rms;
use std::collections::BTreeMap;

/// What the releases have in common.
#[derive(Clone, Debug, Default)]
pub struct Common {
    /// Natural frequency and damping ratio too.
    pub same_rig: bool,
    /// Effects of which each release has a coefficient of its own.
    pub own: Vec<Effect>,
}

/// What releases have to do with each other.
#[derive(Clone, Debug)]
pub enum Grouping<'a> {
    /// One rig in one condition; a release by itself is one of these.
    Rig(Common),
    /// A campaign's, in its order: wind, springs and axis of each are known. It begins from the
    /// second-order model, whatever is present.
    Campaign(&'a Campaign),
}

impl Default for Grouping<'_> {
    fn default() -> Self {
        Self::Rig(Common::default())
    }
}

impl Common {
    /// The effects' numbers that releases have in common; of those of several groups their mean.
    pub(super) fn numbers(&self, joint: &JointFit) -> BTreeMap<String, Quantity> {
        let mut numbers = BTreeMap::new();
        for effect in joint.structure.effects.iter().filter(|e| !self.own.contains(e)) {
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
                numbers.extend(mean.map(|mean| (name, mean)));
            }
        }
        numbers
    }
}

/// An effect of a model of several releases.
#[derive(Clone)]
pub(super) struct SharedEffect {
    pub(super) effect: Effect,
    /// Which releases share its coefficient.
    pub(super) plan: Plan,
    /// Of a campaign.
    pub(super) source: Option<Source>,
}

impl SharedEffect {
    /// Shared as `plan` says; one that turns out to be in the wind-off releases, too, is not the air's alone.
    pub(super) fn share_by(&mut self, plan: Plan) {
        let more = plan.groups.iter().flatten().count() > self.plan.groups.iter().flatten().count();
        if let (Some(source), true) = (&mut self.source, more) {
            source.origin = Origin::Undecided;
            source.reason.push_str("; but the releases with the wind off need it, too");
        }
        self.plan = plan;
    }
}

/// Where an effect comes from, why, and its coefficients from which that is decided.
#[derive(Clone)]
pub(super) struct Source {
    pub(super) origin: Origin,
    pub(super) reason: String,
    pub(super) seen: Vec<Seen>,
    /// Where more than a size has to go with the wind.
    pub(super) grows: Option<GrowsAs>,
}

/// A model of all releases at once.
#[derive(Clone)]
pub(super) struct Together {
    pub(super) joint: JointFit,
    pub(super) shared: Vec<SharedEffect>,
    /// Residual over noise on what it was not fitted to.
    pub(super) held_out_over_noise: f64,
}

/// What each of `model`'s releases is fitted with.
pub(super) fn structure(model: &ModelOfReleases) -> Structure {
    Structure { effects: model.effects.clone(), ..model.fits[0].structure.clone() }
}

/// `effects` shared as planned, natural frequency and damping ratio as `modal` says.
pub(super) fn sharing(effects: &[SharedEffect], modal: Vec<usize>) -> Sharing {
    Sharing { modal, effects: effects.iter().map(|e| e.plan.groups.clone()).collect() }
}

/// Simulated precisely, its uncertainties holding what the model lacks, too.
pub(super) fn finished(joint: JointFit, decays: &[FreeDecay]) -> JointFit {
    let whole = whole(decays);
    joint.polished(&whole).with_discrepancy(&whole)
}

pub(super) fn whole(decays: &[FreeDecay]) -> Vec<Release<'_>> {
    decays.iter().map(Release::whole).collect()
}

/// What survives prediction.
pub(super) struct Predicted {
    pub(super) path: Vec<Together>,
    pub(super) alike: Vec<[Effect; 2]>,
    /// Effects that the prediction alone tells from zero.
    pub(super) needed: Vec<Effect>,
    pub(super) refused: Vec<Refusal>,
}

/// Releases of one rig in one condition.
pub(super) struct Rig<'a> {
    pub(super) decays: &'a [FreeDecay],
    pub(super) common: &'a Common,
}

impl Rig<'_> {
    /// Place of the natural frequency and damping ratio of each release.
    fn modal(&self) -> Vec<usize> {
        (0..self.decays.len()).map(|i| if self.common.same_rig { 0 } else { i }).collect()
    }

    fn shared(&self, effects: &[Effect]) -> Vec<SharedEffect> {
        let all = Plan::of_all(Origin::Undecided, self.decays.iter().map(|_| true));
        let plan = |e: &Effect| match self.common.own.contains(e) {
            true => all.of_each(),
            false => all.clone(),
        };
        let shared = |e: &Effect| SharedEffect { effect: e.clone(), plan: plan(e), source: None };
        effects.iter().map(shared).collect()
    }

    /// `model` with what is common in common.
    pub(super) fn together(&self, model: &ModelOfReleases) -> Together {
        let shared = self.shared(&model.effects);
        let sharing = sharing(&shared, self.modal());
        let fits: Vec<&Fitted> = model.fits.iter().collect();
        let joint = joint::fit_from(&whole(self.decays), &structure(model), &sharing, &fits);
        let joint = finished(joint, self.decays);
        // Each is held out once.
        let each: Vec<Vec<usize>> = (0..fits.len()).map(|i| vec![i]).collect();
        let held_out_over_noise = predicted_over_noise(self.decays, &joint, &each, |_, _| None);
        Together { joint, shared, held_out_over_noise }
    }

    /// From `last` on, each line that most releases name, or one of them where it dies out, as long as it
    /// accounts for most of what is left.
    fn lines_beside(&self, judged: &ReleaseAnswers, last: &Together) -> Result<Vec<Together>> {
        let mut found: Vec<Together> = Vec::new();
        let lines = judged.alone.named().into_iter().filter(Effect::is_line);
        for line in lines.filter(|line| line.dies_out() || judged.alone.mostly(line)) {
            self.decays[0].stop.check()?;
            let here = &found.last().unwrap_or(last).joint;
            let inner = self.decays.iter().zip(&here.fits);
            let fits = inner.par_map(|(decay, fit)| fit_added(decay, fit, &line)).collect();
            let effects = here.structure.with(&line).effects;
            let longer = self.together(&ModelOfReleases { effects, fits });
            if longer.joint.sum_of_squares < MAX_LEFT * here.sum_of_squares {
                found.push(longer);
            }
        }
        Ok(found)
    }

    /// The models whose effects, the user's `own` among them, survive prediction beside what is `present`,
    /// over the pieces of all releases.
    pub(super) fn by_prediction(
        &self,
        judged: &ReleaseAnswers,
        own: &[Effect],
        present: &Structure,
    ) -> Result<Predicted> {
        let decays = self.decays;
        let each: Vec<(&FreeDecay, usize)> = decays.iter().zip(self.modal()).collect();
        let pooled = Releases::new(&each);
        let survivors = survivors::search_all(&pooled, own, present)?;
        let joint = |_: &Survivors, judged: &PredictedModel| {
            let fit = &judged.model.fit;
            let sharing = sharing(&self.shared(&fit.structure.effects), self.modal());
            joint::fit_or_lengthened(&whole(decays), &fit.structure, &sharing, pooled.begun(fit))
        };
        // What only makes up for the error of quick simulations is seen to be nothing in a precise one.
        let precisely = |survivors: &Survivors, judged: &PredictedModel| {
            joint(survivors, judged).polished(&whole(decays))
        };
        let as_told = |joint: JointFit| joint.with_discrepancy(&whole(decays));
        let Standing { survivors, last, needed, refused } =
            standing(decays, survivors, precisely, as_told, |joint| &joint.fits)?;
        let stands = |rival: &PredictedModel| {
            let fits = joint(&survivors, rival).fits;
            let there = survivors.there();
            fits.iter().zip(decays).all(|(fit, decay)| guards::refusal(fit, decay, there).is_none())
        };
        let alike = alike(&survivors, stands)?;
        let noise_rad = rms(decays.iter().map(|d| d.noise_rad));
        let (_, smaller) = survivors.path.split_last().expect("the plain model");
        let mut joints = Vec::new();
        for judged in smaller {
            decays[0].stop.check()?;
            joints.push(finished(joint(&survivors, judged), decays));
        }
        joints.push(last);
        let path = joints.into_iter().zip(&survivors.path).map(|(joint, judged)| Together {
            shared: self.shared(&joint.structure.effects),
            joint,
            held_out_over_noise: judged.prediction.rms_rad() / noise_rad,
        });
        let mut path: Vec<Together> = path.collect();
        let longer = self.lines_beside(judged, path.last().expect("a model"))?;
        path.extend(longer);
        Ok(Predicted { path, alike, needed, refused })
    }
}
