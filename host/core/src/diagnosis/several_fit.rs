//! The models of several releases of one rig: effects that all of them need at once, or those that survive
//! prediction, release by release.

use crate::diagnosis::alike::alike_in_releases;
use crate::diagnosis::alone::most_first;
use crate::diagnosis::answer::{Options, MOST_LEFT};
use crate::diagnosis::likelihood::MOST_EFFECTS;
use crate::diagnosis::releases::{
    from_others, mean_square, over_noise, ModelOfReleases, ReleaseAnswers, Releases,
};
use crate::diagnosis::shared_set::{Common, Set, Surviving};
use crate::diagnosis::survivors;
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::fitting::{fit_added, Fitted, Structure};
use crate::fit::floor;
use crate::fit::joint::{self, JointFit, Release, Sharing};
use crate::record::Record;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Models of all releases from plain to final, and what each predicts.
pub(super) struct Path {
    pub(super) effects: Vec<Effect>,
    pub(super) joint: JointFit,
    pub(super) held_out_over_noise: f64,
}

/// `model` with what is common in common.
pub(super) fn in_common_at_once(
    releases: &Releases,
    model: &ModelOfReleases,
    common: &Common,
) -> Path {
    let whole: Vec<Release> = releases.decays.iter().map(Release::whole).collect();
    let n = whole.len();
    let each = |is_own: bool| (0..n).map(move |i| if is_own { i } else { 0 });
    let groups = |e: &Effect| each(common.own.contains(e)).map(Some).collect();
    let sharing = Sharing {
        modal: each(!common.same_rig).collect(),
        effects: model.effects.iter().map(groups).collect(),
    };
    let structure = Structure { effects: model.effects.clone(), ..model.fits[0].structure.clone() };
    let fits: Vec<&Fitted> = model.fits.iter().collect();
    let joint = joint::fit_from(&whole, &structure, &sharing, &fits);
    // Each is held out once.
    let alone = |i| from_others(&releases.decays, &joint, &[i], |_, _| None);
    let held: Vec<Fitted> = (0..n).into_par_iter().flat_map(alone).collect();
    let held_out_over_noise = over_noise(&held, &releases.decays);
    let joint = joint.with_discrepancy(&whole);
    Path { effects: model.effects.clone(), joint, held_out_over_noise }
}

/// From `last` on, each line that most releases name, as long as it accounts for most of what is left.
fn lines_beside(
    releases: &Releases,
    judged: &ReleaseAnswers,
    common: &Common,
    last: &Path,
) -> Result<Vec<Path>> {
    let mut found: Vec<Path> = Vec::new();
    let lines = judged.alone.named().into_iter().filter(Effect::is_line);
    for line in lines.filter(|line| judged.alone.mostly(line, |_| true)) {
        releases.check()?;
        let here = found.last().unwrap_or(last);
        let inner = releases.decays.par_iter().zip(&here.joint.fits);
        let fits = inner.map(|(decay, fit)| fit_added(decay, fit, &line)).collect();
        let effects = here.effects.iter().cloned().chain([line]).collect();
        let longer = in_common_at_once(releases, &ModelOfReleases { effects, fits }, common);
        if longer.joint.sum_of_squares < MOST_LEFT * here.joint.sum_of_squares {
            found.push(longer);
        }
    }
    Ok(found)
}

/// The models whose effects survive prediction, release by release.
pub(super) fn by_prediction(
    records: &[Record],
    releases: &Releases,
    judged: &ReleaseAnswers,
    common: &Common,
    options: &Options,
    present: &[Effect],
) -> Result<(Vec<Path>, Vec<[Effect; 2]>)> {
    let begun: Vec<Surviving> = records
        .iter()
        .zip(&releases.decays)
        .map(|(record, decay)| {
            let survivors = survivors::search(decay, &options.own, &Structure::default())?;
            Ok(Surviving { decay: floor::with_steps(decay.clone(), record), survivors })
        })
        .collect::<Result<_>>()?;
    // From all that survives somewhere down to the plain model, what is missed least left out first.
    let effects = proposed(&begun, judged, present);
    let mut sets = vec![Set { begun: &begun, common, effects, stop: &options.stop }];
    let mut predictions = vec![sets[0].predicted()?];
    while let Some(larger) =
        sets.last().filter(|s| s.effects.len() > present.len()).map(|s| s.effects.clone())
    {
        let from = sets.last().expect("a set");
        let mut smaller = Vec::new();
        for effect in larger.iter().filter(|e| !present.contains(e)) {
            let set = from.without(effect);
            smaller.push((set.predicted()?, set));
        }
        let best = smaller
            .into_iter()
            .min_by(|a, b| a.0.rms_rad().total_cmp(&b.0.rms_rad()))
            .expect("an effect");
        predictions.push(best.0);
        sets.push(best.1);
    }
    sets.reverse();
    predictions.reverse();
    let mut last = 0;
    for larger in 1..sets.len() {
        if predictions[larger].is_better_than(&predictions[last]) {
            last = larger;
        }
    }
    sets.truncate(last + 1);
    let alike = alike_in_releases(&sets[last], &predictions[last], present)?;
    let noise_rad = mean_square(&releases.decays, |d| d.noise_rad);
    let whole: Vec<Release> = begun.iter().map(|b| Release::whole(&b.decay)).collect();
    let path = sets.iter().zip(&predictions).map(|(set, prediction)| Path {
        effects: set.effects.clone(),
        joint: set.whole().with_discrepancy(&whole),
        held_out_over_noise: prediction.rms_rad() / noise_rad,
    });
    let mut path: Vec<Path> = path.collect();
    let longer = lines_beside(releases, judged, common, path.last().expect("a model"))?;
    path.extend(longer);
    Ok((path, alike))
}

/// Effects that survive somewhere, those of most releases first, behind those that stay.
fn proposed(begun: &[Surviving], judged: &ReleaseAnswers, present: &[Effect]) -> Vec<Effect> {
    let mut votes: BTreeMap<Effect, usize> = BTreeMap::new();
    for effect in begun.iter().flat_map(|b| &b.alone().structure.effects) {
        *votes.entry(effect.clone()).or_default() += 1;
    }
    let of_pieces = |e: &Effect| e.is_strength_of_state() || e.is_own();
    for effect in judged.alone.named().into_iter().filter(of_pieces) {
        votes.entry(effect).or_insert(1);
    }
    votes.retain(|e, _| !present.contains(e) && !e.moves_rest());
    present.iter().cloned().chain(most_first(votes).into_iter().take(MOST_EFFECTS)).collect()
}
