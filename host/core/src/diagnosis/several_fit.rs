//! The models of several releases of one rig: effects that all of them need at once, or those that survive
//! prediction over the pieces of all.

use crate::at_once::AtOnce;
use crate::diagnosis::account;
use crate::diagnosis::alike::alike;
use crate::diagnosis::answer::Options;
use crate::diagnosis::guards::{self, Refusal};
use crate::diagnosis::releases::{
    from_others, over_noise, ModelOfReleases, ReleaseAnswers, Releases,
};
use crate::diagnosis::survivors::{self, PredictedModel, Survivors};
use crate::diagnosis::verdict::{mean_square, MOST_LEFT};
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::fitting::{fit_added, Fitted, Structure};
use crate::fit::free_decay::FreeDecay;
use crate::fit::joint::{self, JointFit, Release, Sharing};
use crate::law;

/// What the releases have in common.
#[derive(Clone, Debug, Default)]
pub struct Common {
    /// Natural frequency and damping ratio too.
    pub same_rig: bool,
    /// Effects of which each release has a coefficient of its own.
    pub own: Vec<Effect>,
}

/// Models of all releases from plain to final, and what each predicts.
pub(super) struct Path {
    pub(super) effects: Vec<Effect>,
    pub(super) joint: JointFit,
    pub(super) held_out_over_noise: f64,
}

/// Which releases have one coefficient of each of `effects`, and one natural frequency and damping ratio.
fn sharing(releases: &Releases, effects: &[Effect], common: &Common) -> Sharing {
    let n = releases.decays.len();
    let each = |is_own: bool| (0..n).map(move |i| if is_own { i } else { 0 });
    let groups = |e: &Effect| each(common.own.contains(e)).map(Some).collect();
    Sharing {
        modal: each(!common.same_rig).collect(),
        effects: effects.iter().map(groups).collect(),
    }
}

/// `model` with what is common in common.
pub(super) fn in_common_at_once(
    releases: &Releases,
    model: &ModelOfReleases,
    common: &Common,
) -> Path {
    let whole: Vec<Release> = releases.decays.iter().map(Release::whole).collect();
    let n = whole.len();
    let sharing = sharing(releases, &model.effects, common);
    let structure = Structure { effects: model.effects.clone(), ..model.fits[0].structure.clone() };
    let fits: Vec<&Fitted> = model.fits.iter().collect();
    let joint = joint::fit_from(&whole, &structure, &sharing, &fits);
    // Each is held out once.
    let alone = |i| from_others(&releases.decays, &joint, &[i], |_, _| None);
    let held: Vec<Fitted> = (0..n).map_at_once(alone).flatten().collect();
    let held_out_over_noise = over_noise(&held, &releases.decays);
    let joint = joint.polished(&whole).with_discrepancy(&whole);
    Path { effects: model.effects.clone(), joint, held_out_over_noise }
}

/// From `last` on, each line that most releases name, or one of them where it dies out, as long as it accounts
/// for most of what is left.
fn lines_beside(
    releases: &Releases,
    judged: &ReleaseAnswers,
    common: &Common,
    last: &Path,
) -> Result<Vec<Path>> {
    let mut found: Vec<Path> = Vec::new();
    let lines = judged.alone.named().into_iter().filter(Effect::is_line);
    for line in lines.filter(|line| line.dies_out() || judged.alone.mostly(line)) {
        releases.check()?;
        let here = found.last().unwrap_or(last);
        let inner = releases.decays.iter().zip(&here.joint.fits);
        let fits = inner.map_at_once(|(decay, fit)| fit_added(decay, fit, &line)).collect();
        let effects = here.effects.iter().cloned().chain([line]).collect();
        let longer = in_common_at_once(releases, &ModelOfReleases { effects, fits }, common);
        if longer.joint.sum_of_squares < MOST_LEFT * here.joint.sum_of_squares {
            found.push(longer);
        }
    }
    Ok(found)
}

/// What survives prediction.
pub(super) struct Predicted {
    pub(super) path: Vec<Path>,
    pub(super) alike: Vec<[Effect; 2]>,
    pub(super) refused: Vec<Refusal>,
}

/// The models whose effects survive prediction, over the pieces of all releases.
pub(super) fn by_prediction(
    releases: &Releases,
    judged: &ReleaseAnswers,
    common: &Common,
    options: &Options,
    present: &Structure,
) -> Result<Predicted> {
    let modal = |i: usize| if common.same_rig { 0 } else { i };
    let each: Vec<(&FreeDecay, usize)> =
        releases.decays.iter().enumerate().map(|(i, decay)| (decay, modal(i))).collect();
    let pooled = law::releases::Releases::new(&each);
    let survivors = survivors::search_all(&pooled, &options.own, present)?;
    let decays = &releases.decays;
    let whole: Vec<Release> = decays.iter().map(Release::whole).collect();
    let joint = |_: &Survivors, judged: &PredictedModel| {
        let fit = &judged.model.fit;
        let sharing = sharing(releases, &fit.structure.effects, common);
        joint::fit_or_lengthened(&whole, &fit.structure, &sharing, pooled.begun(fit))
    };
    let (survivors, last, refused) =
        account::standing(decays, survivors, joint, |joint| &joint.fits)?;
    let stands = |rival: &PredictedModel| {
        let fits = joint(&survivors, rival).fits;
        let there = survivors.there();
        fits.iter().zip(decays).all(|(fit, decay)| guards::refusal(fit, decay, there).is_none())
    };
    let alike = alike(&survivors, stands)?;
    let noise_rad = mean_square(decays, |d| d.noise_rad);
    let (_, smaller) = survivors.path.split_last().expect("the plain model");
    let mut joints = Vec::new();
    for judged in smaller {
        releases.check()?;
        joints.push(joint(&survivors, judged));
    }
    joints.push(last);
    let path = joints.into_iter().zip(&survivors.path).map(|(joint, judged)| Path {
        effects: joint.structure.effects.clone(),
        joint: joint.polished(&whole).with_discrepancy(&whole),
        held_out_over_noise: judged.prediction.rms_rad() / noise_rad,
    });
    let mut path: Vec<Path> = path.collect();
    let longer = lines_beside(releases, judged, common, path.last().expect("a model"))?;
    path.extend(longer);
    Ok(Predicted { path, alike, refused })
}
