//! Which effects a free decay needs: each alone, the best in one model, the needless taken out again.

use crate::bic::{self, MARGIN};
use crate::diagnosis::flexible;
use crate::diagnosis::guards::{self, Refusal, OF_NAMED};
pub use crate::diagnosis::likelihood::is_explained;
pub(crate) use crate::diagnosis::likelihood::{beyond, delta_bic};
use crate::diagnosis::likelihood::{may_rival, BREADTH, DECISIVE, NEAR_NOISE};
use crate::diagnosis::nested::{self, Judge, Nested};
use crate::diagnosis::prediction::MIN_GAIN;
pub use crate::diagnosis::search_start::present;
pub(crate) use crate::diagnosis::search_start::SearchStart;
use crate::effects::Effect;
use crate::error::Result;
use crate::fit::about_rest::{added, removed};
use crate::fit::fitting::{polished, Fitted};
use crate::fit::free_decay::FreeDecay;
use crate::fit::linear_gain::Screen;
use crate::par_map::ParMap;
use crate::stop::Stop;

/// Effects that likelihood may name: of a record of a few cycles five or six explain anything.
const MAX_BY_LIKELIHOOD: usize = 4;

/// What the search found.
pub(crate) struct SearchResult {
    /// The free decay with the noise floor as the best model shows it.
    pub(crate) decay: FreeDecay,
    pub(crate) plain: Fitted,
    /// Every effect alone, in the order of the library.
    pub(crate) singles: Vec<Fitted>,
    /// The models from plain to final, an effect more each.
    pub(crate) path: Vec<Fitted>,
    /// For an accepted effect those that do as well in its place.
    pub(crate) indistinguishable: Vec<[Effect; 2]>,
    /// Effects that helped and cannot stand.
    pub(crate) refused: Vec<Refusal>,
}

/// Whether `larger` is worth its effect.
fn is_worth(smaller: &Fitted, larger: &Fitted, effective: f64) -> bool {
    larger.converged && delta_bic(smaller, larger, effective) > MARGIN
}

/// Searches for what the present model lacks; where an effect comes out that cannot stand, again without it.
///
/// # Errors
/// Interrupted, once somebody asked for it.
pub(crate) fn search(decay: &FreeDecay, start: &SearchStart) -> Result<SearchResult> {
    let singles = &start.singles;
    let mut start = start.clone();
    let mut refused: Vec<Refusal> = Vec::new();
    loop {
        let (decay, rounds, mut accepted) = search_from(decay, &start, &refused)?;
        let refusal = loop {
            let there = &start.plain.structure.effects;
            let refusal = guards::refusal(&accepted.model, &decay, there)
                .or_else(|| simpler(&accepted.model, &decay, there));
            if refusal.is_some() {
                break refusal;
            }
            let unknown = unknown_as_told(&accepted.model, &decay, &start.plain);
            let Some(refusal) = unknown else { break None };
            let less = polished(removed(&decay, &accepted.model, &refusal.effect), &decay);
            let judge = ByEvidence { decay: &decay, start: &start, precisely: true };
            accepted = Nested::pruned(&judge, less)?;
            start = start.without(&refusal.effect);
            refused.push(refusal);
        };
        if let Some(refusal) = refusal {
            start = start.without(&refusal.effect);
            refused.push(refusal);
            continue;
        }
        let SearchStart { plain, candidates, .. } = &start;
        let decay = sharpened(decay, &accepted.model);
        let indistinguishable = match is_explained(&accepted.model, &decay) {
            true => rivals(&decay, plain, &accepted, candidates, &rounds),
            false => Vec::new(),
        };
        decay.stop.check()?;
        let judge = ByEvidence { decay: &decay, start: &start, precisely: false };
        let path = accepted.path(&judge, plain.clone())?;
        let (plain, singles) = (start.plain, singles.clone());
        return Ok(SearchResult { decay, plain, singles, path, indistinguishable, refused });
    }
}

/// An effect of `model`, which explains the record, whose size may be zero as it will be told.
fn unknown_as_told(model: &Fitted, decay: &FreeDecay, plain: &Fitted) -> Option<Refusal> {
    let explains = is_explained(model, decay) && !beyond(plain, model).is_empty();
    let told = explains.then(|| model.clone().with_discrepancy(decay))?;
    guards::unknown(&told, &plain.structure.effects, OF_NAMED)
}

/// The effect of `model` that precisely simulated is not told from a simpler one.
fn simpler(model: &Fitted, decay: &FreeDecay, there: &[Effect]) -> Option<Refusal> {
    let effect = flexible::simpler_one(model, decay).filter(|effect| !there.contains(effect))?;
    let reason = "with these numbers it is what a simpler effect is".to_owned();
    Some(Refusal { effect: effect.clone(), reason })
}

/// `decay` with the noise floor as the `leader` shows it, where that is near it: what is far off shows more
/// than noise.
pub(super) fn sharpened(decay: FreeDecay, leader: &Fitted) -> FreeDecay {
    match leader.over_noise(&decay) < NEAR_NOISE {
        true => decay.with_noise_of(&leader.residuals),
        false => decay,
    }
}

/// The free decay as the best model shows it, the models of each round, and the one with the effects that are
/// needed.
fn search_from(
    decay: &FreeDecay,
    start: &SearchStart,
    refused: &[Refusal],
) -> Result<(FreeDecay, Vec<Vec<Fitted>>, Nested<Fitted>)> {
    let SearchStart { plain, candidates, singles } = start;
    let leading = best(singles).filter(|s| criterion(s) < criterion(plain)).unwrap_or(plain);
    let mut decay = sharpened(decay.clone(), leading);

    // Rounds of pairs, threes and fours, as long as the best so far is not down to the noise or gains by
    // another.
    let mut rounds: Vec<Vec<Fitted>> = vec![singles.clone()];
    while rounds.len() < MAX_BY_LIKELIHOOD {
        let last = rounds.last().expect("a round");
        let Some(leader) = best(last) else { break };
        let smaller = rounds.iter().nth_back(1).and_then(|round| best(round)).unwrap_or(plain);
        // The round gained nothing even on the kindest count of residuals, or far from the noise next to
        // nothing: no further one will.
        let next_to_nothing = rounds.len() > 1
            && leader.over_noise(&decay) > NEAR_NOISE
            && leader.rms_rad() > (1.0 - MIN_GAIN) * smaller.rms_rad();
        if next_to_nothing || !is_worth(smaller, leader, decay.yaw_rad.len() as f64) {
            break;
        }
        let next = if is_explained(leader, &decay) {
            let mut next = beside(&decay, leader, candidates);
            if has_line(leader) {
                // Two effects of the state may look like a line and one of them.
                let near = |m: &&Fitted| !has_line(m) && m.over_noise(&decay) < NEAR_NOISE;
                let steady: Vec<Fitted> = last.iter().filter(near).cloned().collect();
                next.extend(expanded(&decay, &steady, candidates, BREADTH));
            }
            next
        } else {
            expanded(&decay, last, candidates, if rounds.len() < 3 { BREADTH } else { 1 })
        };
        decay.stop.check()?;
        if let Some(better) = best(&next).filter(|n| criterion(n) < criterion(leader)) {
            decay = sharpened(decay, better);
        }
        rounds.push(next);
    }

    let mut accepted = plain.clone();
    for leader in rounds.iter().filter_map(|round| best(round)) {
        if is_worth(&accepted, leader, leader.effective_count()) {
            accepted = leader.clone();
        }
    }
    let judge = ByEvidence { decay: &decay, start, precisely: false };
    let mut accepted = Nested::pruned(&judge, accepted)?;
    if let Some(bent) = flexible::instead(&decay, plain, &accepted.model, singles, refused) {
        accepted = Nested::pruned(&judge, bent)?;
    }
    let quick = accepted.model.parameters.clone();
    accepted.model = polished(accepted.model, &decay);
    if accepted.model.parameters != quick && is_explained(&accepted.model, &decay) {
        // What is needed only to make up for the error of quick simulations is needless.
        let judge = ByEvidence { precisely: true, ..judge };
        accepted = Nested::pruned(&judge, accepted.model)?;
    }
    Ok((decay, rounds, accepted))
}

fn has_line(model: &Fitted) -> bool {
    model.structure.effects.iter().any(|e| e.line().is_some())
}

/// The converged model with the smallest criterion.
pub(super) fn best(models: &[Fitted]) -> Option<&Fitted> {
    models.iter().filter(|m| m.converged).min_by(|a, b| criterion(a).total_cmp(&criterion(b)))
}

pub(super) fn criterion(model: &Fitted) -> f64 {
    bic::of_squares(model.sum_of_squares, model.count as f64, model.parameters.len())
}

/// Every other effect for which a linear step predicts evidence beside `model`, which explains the record,
/// fitted with it: the one with the most and those not decisively behind.
fn beside(decay: &FreeDecay, model: &Fitted, all: &[Effect]) -> Vec<Fitted> {
    let n = model.effective_count();
    let screen = Screen::new(decay, model);
    let others = all.iter().filter(|e| !model.structure.effects.contains(e));
    let predicted = others.par_map(|e| {
        let (left, more) = screen.left_with(e);
        (bic::gain(model.sum_of_squares, left, n, more as f64), e)
    });
    let predicted: Vec<(f64, &Effect)> = predicted.collect();
    // A user's own has no linear step.
    let of_library = predicted.iter().filter(|p| !p.1.is_own());
    let most = of_library.map(|p| p.0).fold(f64::NEG_INFINITY, f64::max);
    let tried = |p: &&(f64, &Effect)| p.0 > MARGIN.max(most - DECISIVE) || p.1.is_own();
    predicted.iter().filter(tried).par_map(|(_, e)| added(decay, model, e)).collect()
}

/// Each of the `width` best with the effects of the largest linear gain beside it, each set once: the leader's
/// with every effect where it is one far from the noise, and where it is near those only that may be as good.
fn expanded(decay: &FreeDecay, round: &[Fitted], all: &[Effect], width: usize) -> Vec<Fitted> {
    let mut order: Vec<&Fitted> = round.iter().filter(|m| m.converged).collect();
    order.sort_by(|a, b| criterion(a).total_cmp(&criterion(b)));
    order.truncate(width);
    let near = |m: &Fitted| m.over_noise(decay) < NEAR_NOISE;
    let leader = order.first().copied().filter(|m| near(m));
    let promising = order.iter().enumerate().par_map(|(k, inner)| {
        let screen = Screen::new(decay, inner);
        let mut out: Vec<(f64, Effect)> = all
            .iter()
            .filter(|e| !inner.structure.effects.contains(e))
            .par_map(|e| {
                let may = e.is_own() || leader.is_none_or(|m| may_rival(&screen, e, m));
                may.then(|| (screen.left_with(e).0, e.clone()))
            })
            .flatten()
            .collect();
        out.sort_by(|a, b| a.0.total_cmp(&b.0));
        // From near the noise a linear step is to be believed.
        let n = inner.effective_count();
        let least = out.iter().find(|p| !p.1.is_own()).map_or(0.0, |p| p.0);
        let behind = |left: f64| near(inner) && bic::gain(left, least, n, 0.0) > DECISIVE;
        // From farther off it is not: beside the leader every effect is tried. For speed beside one alone.
        let all = k == 0 && !near(inner) && inner.structure.effects.len() < 2;
        let promising = out.into_iter().take_while(|p| !behind(p.0));
        promising.take(if all { usize::MAX } else { BREADTH }).map(|p| p.1).collect()
    });
    let tried = order.iter().zip(promising).map(|(&m, tried)| (m, &m.structure.effects[..], tried));
    nested::expanded(tried, |inner, effect| added(decay, inner, effect))
}

/// Judges models by likelihood.
struct ByEvidence<'a> {
    decay: &'a FreeDecay,
    start: &'a SearchStart,
    /// Whether models are simulated without the error of a step.
    precisely: bool,
}

impl Judge for ByEvidence<'_> {
    type Model = Fitted;

    fn effects<'a>(&self, model: &'a Fitted) -> &'a [Effect] {
        beyond(&self.start.plain, model)
    }
    fn without(&self, model: &Fitted, effect: &Effect) -> Option<Fitted> {
        let left = model.structure.without(effect).effects;
        let known = self.start.singles.iter().find(|s| s.structure.effects == left && s.converged);
        let smaller = known.cloned().unwrap_or_else(|| removed(self.decay, model, effect));
        Some(if self.precisely { polished(smaller, self.decay) } else { smaller })
    }
    fn is_worth(&self, smaller: &Fitted, larger: &Fitted) -> bool {
        !smaller.converged || is_worth(smaller, larger, larger.effective_count())
    }
    fn misfit(&self, model: &Fitted) -> f64 {
        criterion(model)
    }
    fn stop(&self) -> &Stop {
        &self.decay.stop
    }
}

/// Which effect outside the model does as well in the place of one inside.
fn rivals(
    decay: &FreeDecay,
    plain: &Fitted,
    Nested { model, without }: &Nested<Fitted>,
    candidates: &[Effect],
    rounds: &[Vec<Fitted>],
) -> Vec<[Effect; 2]> {
    let effects = beyond(plain, model);
    let effective = model.effective_count();
    let as_good = |other: &Fitted| {
        other.converged && is_explained(other, decay) && delta_bic(other, model, effective) < MARGIN
    };
    let outside: Vec<Effect> =
        candidates.iter().filter(|&c| !effects.contains(c)).cloned().collect();
    let in_place_of = |(inside, inner): (&Effect, &Fitted)| -> Vec<[Effect; 2]> {
        if effects.len() == 1 {
            let others = rounds[0].iter().filter(|m| outside.contains(&beyond(plain, m)[0]));
            return others
                .filter(|m| as_good(m))
                .map(|m| [inside.clone(), beyond(plain, m)[0].clone()])
                .collect();
        }
        let screen = Screen::new(decay, inner);
        outside
            .iter()
            .par_map(|e| {
                let rivals = may_rival(&screen, e, model) && as_good(&added(decay, inner, e));
                rivals.then(|| [inside.clone(), e.clone()])
            })
            .flatten()
            .collect()
    };
    let each = effects.iter().zip(without).filter_map(|(e, inner)| Some((e, inner.as_ref()?)));
    each.par_map(in_place_of).flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fitting::{fit_added, fit_plain};
    use crate::record::Record;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// A model never fits worse than one it contains, and on noise alone what it gains is not believed.
    #[test]
    fn an_effect_that_is_not_there_is_nested_and_not_believed() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let (time_s, yaw_deg): (Vec<f64>, Vec<f64>) = (0..6000)
            .map(|k| {
                let t = f64::from(k) / 300.0;
                let z: f64 = StandardNormal.sample(&mut rng);
                (t, 12.0 * (-0.06 * t).exp() * (6.0 * t).cos() + 0.04 * z)
            })
            .unzip();
        let record = Record::new("noise", time_s, yaw_deg);
        let decay = FreeDecay::from_record(&record).unwrap();
        let plain = fit_plain(&decay, false, decay.yaw_rad.len());
        assert!(is_explained(&plain, &decay), "{}", plain.over_noise(&decay));
        let screen = Screen::new(&decay, &plain);
        for effect in Effect::deterministic() {
            let larger = fit_added(&decay, &plain, &effect);
            assert!(larger.sum_of_squares <= plain.sum_of_squares * (1.0 + 1e-9), "{effect}");
            let gain = delta_bic(&plain, &larger, 1000.0);
            let more = (larger.parameters.len() - plain.parameters.len()) as f64;
            let by_hand =
                1000.0 * (plain.sum_of_squares / larger.sum_of_squares).ln() - more * 1000f64.ln();
            assert!((gain - by_hand).abs() < 1e-9 && gain < MARGIN, "{effect}: {gain}");
            // A linear step predicts no more than noise either.
            let (left, _) = screen.left_with(&effect);
            assert!(left > 0.98 * plain.sum_of_squares, "{effect}");
        }
    }
}
