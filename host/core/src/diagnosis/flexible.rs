//! Effects that bend to what simpler ones explain: near the noise one stands only where it is clearly
//! likelier, or likelier than several.

use crate::diagnosis::guards::Refusal;
use crate::diagnosis::likelihood::{
    beyond, delta_bic, is_explained, may_rival, may_rival_leaving, BREADTH, DECISIVE, NEAR_NOISE,
};
use crate::diagnosis::search_start::library;
use crate::effects::Effect;
use crate::fit::about_rest::added;
use crate::fit::fitting::{fit_near, refitted, Fitted, Structure};
use crate::fit::free_decay::FreeDecay;
use crate::fit::linear_gain::Screen;
use crate::par_map::ParMap;
use crate::quantity::Quantity;
use yawrig_expression::all_ready_made;

/// Whether what bends in `model` bends to what an effect with a name of its own is.
pub(super) fn is_simple(model: &Fitted, decay: &FreeDecay) -> bool {
    simpler_one(model, decay).is_some()
}

/// The effect of `model` that does.
pub(super) fn simpler_one<'a>(model: &'a Fitted, decay: &FreeDecay) -> Option<&'a Effect> {
    let numbers = model.effect_parameters();
    let mut numbers = numbers.iter().map(|(_, q)| *q);
    model.structure.effects.iter().find(|effect| {
        let own: Vec<Quantity> = numbers.by_ref().take(effect.parameters().len()).collect();
        effect.is_simpler_one(&own, decay.amplitude_rad)
    })
}

/// A model with one flexible effect that is decisively likelier than `accepted`, or as likely with fewer
/// effects: alone, beside one of the simple effects, or beside all of them; none of those `refused`.
pub(super) fn instead(
    decay: &FreeDecay,
    plain: &Fitted,
    accepted: &Fitted,
    singles: &[Fitted],
    refused: &[Refusal],
) -> Option<Fitted> {
    let simple = beyond(plain, accepted);
    let alone = |single: &&Fitted| beyond(plain, single).iter().all(|e| simple.contains(e));
    let mut inner: Vec<&Fitted> = vec![plain];
    if accepted.over_noise(decay) < NEAR_NOISE && simple.len() > 1 {
        inner.extend(singles.iter().filter(|s| s.converged).filter(alone));
        if !is_explained(accepted, decay) {
            inner.push(accepted);
        }
    }
    let mut flexible = library(decay, &plain.structure.effects);
    flexible.retain(|e| e.is_flexible() && refused.iter().all(|refusal| refusal.effect != *e));
    let gain = |larger: &Fitted| delta_bic(accepted, larger, larger.effective_count());
    let screens: Vec<Screen> =
        inner.into_iter().par_map(|inner| Screen::new(decay, inner)).collect();
    let late = late(decay, &screens[0], accepted, singles, refused);
    let better: Vec<(f64, Fitted)> = screens
        .iter()
        .flat_map(|screen| flexible.iter().map(move |effect| (screen, effect)))
        .par_map(|(screen, effect)| {
            may_rival(screen, effect, accepted).then(|| added(decay, screen.inner, effect))
        })
        .flatten()
        .chain(late)
        .filter(|larger| larger.converged && !is_simple(larger, decay))
        .map(|larger| (gain(&larger), larger))
        .filter(|(gain, larger)| {
            let is_fewer = beyond(plain, larger).len() < simple.len();
            is_fewer && *gain > 0.0 || *gain > DECISIVE
        })
        .collect();
    let numbers = |(_, larger): &(f64, Fitted)| larger.parameters.len();
    let is_ahead = |larger: &(f64, Fitted), best: &(f64, Fitted), has_more| {
        larger.0 - best.0 > if has_more { DECISIVE } else { 0.0 }
    };
    simplest(better, numbers, is_ahead).map(|(_, larger)| larger)
}

/// Of `all` one that no other `is_ahead` of, which is told whether that has more numbers: a stop that takes energy
/// out holds one that takes none, and has to be further ahead.
pub(super) fn simplest<T>(
    mut all: Vec<T>,
    numbers: impl Fn(&T) -> usize,
    is_ahead: impl Fn(&T, &T, bool) -> bool,
) -> Option<T> {
    all.sort_by_key(&numbers);
    all.into_iter().reduce(|best, other| {
        match is_ahead(&other, &best, numbers(&other) > numbers(&best)) {
            true => other,
            false => best,
        }
    })
}

/// The model of `plain`, alone or with the effect of one of the best of `singles`, and a moment that follows late,
/// where that explains the record: such effects are slow, and one is fitted only where a linear step says that it
/// may be as good as `accepted`.
fn late(
    decay: &FreeDecay,
    plain: &Screen,
    accepted: &Fitted,
    singles: &[Fitted],
    refused: &[Refusal],
) -> Vec<Fitted> {
    if is_explained(plain.inner, decay) {
        return Vec::new();
    }
    let mut best: Vec<&Fitted> = singles.iter().filter(|single| single.converged).collect();
    best.sort_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares));
    best.truncate(BREADTH);
    let best: Vec<Screen> = best.into_iter().par_map(|single| Screen::new(decay, single)).collect();
    let known = |effect: &Effect| {
        let there = &plain.inner.structure.effects;
        there.contains(effect) || refused.iter().any(|refusal| refusal.effect == *effect)
    };
    let ready_made = all_ready_made().iter().cloned().map(Effect::Own);
    let ready_made: Vec<Effect> = ready_made.filter(|effect| !known(effect)).collect();
    let with = |(screen, effect): (&Screen, &Effect)| {
        let begun = screen.begun_with(effect)?;
        let leaves = (begun.left, effect.parameters().len());
        if !may_rival_leaving(screen, leaves, accepted) {
            return None;
        }
        let quick = fit_near(decay, &begun.structure, &begun.parameters, screen.inner.count);
        is_explained(&quick, decay).then(|| {
            let structure = Structure { swift: false, ..begun.structure };
            refitted(decay, &structure, &quick.parameters)
        })
    };
    let screens = std::iter::once(plain).chain(&best);
    screens
        .flat_map(|screen| ready_made.iter().map(move |effect| (screen, effect)))
        .par_map(with)
        .flatten()
        .collect()
}
