//! The effects that survive prediction, where the misfit is above the noise and likelihood means nothing.
//!
//! Rest angle, natural frequency and damping ratio are in every model, and what depends on the angle acts
//! about the rest. Effects are added one at a time, the one whose addition predicts best first, as long as
//! the prediction of what was not fitted gains by it; what others have made needless is taken out again.

use crate::diagnosis::flexible::simplest;
use crate::diagnosis::likelihood::{BREADTH, MAX_EFFECTS};
use crate::diagnosis::nested::{beside, expanded, Judge, Nested};
use crate::diagnosis::over_pieces::{fitted, plain_start, with_from, without, Lengths, Model};
use crate::diagnosis::prediction::{predict, Prediction, MIN_GAIN};
use crate::diagnosis::search_start::library;
use crate::diagnosis::together::Releases;
use crate::effects::{Effect, Series};
use crate::error::Result;
use crate::fit::fitting::Structure;
use crate::fit::free_decay::FreeDecay;
use crate::fit::pieces::Piece;
use crate::fit::segments::{fit_pieces, FIRST};
use crate::par_map::ParMap;
use crate::quantity::Quantity;
use crate::stop::Stop;

/// Share by which an effect that bends to what simpler ones explain has to predict better.
const CLEAR_GAIN: f64 = 0.4;

/// A model with what it predicts.
#[derive(Clone, Debug)]
pub(crate) struct PredictedModel {
    pub(crate) model: Model,
    pub(crate) prediction: Prediction,
}

fn with(lengths: &Lengths, inner: &Model, effect: &Effect) -> Model {
    // The numbers of a user's own need not be a strength: a width of zero is none.
    let start = effect.is_own().then(|| rough_start(lengths, inner, effect)).flatten();
    let start = start.unwrap_or_else(|| vec![0.0; effect.parameters().len()]);
    with_from(lengths, inner, effect, &start)
}

/// The start from which a rough fit to long pieces comes lowest.
fn rough_start(lengths: &Lengths, inner: &Model, effect: &Effect) -> Option<Vec<f64>> {
    let structure = inner.fit.structure.with(effect);
    let pieces: Vec<&Piece> = lengths.long.decays.iter().collect();
    let rough = |start: Vec<f64>| {
        let common = [&inner.fit.common[..], &start].concat();
        let states = &inner.fit.states;
        let fit = fit_pieces(&pieces, &structure, &common, states, FIRST);
        (fit.sum(), start)
    };
    let fits = lengths.starts(effect).into_iter().par_map(rough);
    fits.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, start)| start)
}

pub(super) fn judged(lengths: &Lengths, model: Model) -> PredictedModel {
    let prediction = predict(&lengths.predicted, &lengths.long, &model.fit);
    PredictedModel { model, prediction }
}

impl PredictedModel {
    pub(super) fn predicts_better_than(&self, other: &Self) -> bool {
        self.prediction.is_better_than(&other.prediction)
    }

    /// The same for an effect that bends to what simpler ones explain.
    fn predicts_clearly_better_than(&self, other: &Self) -> bool {
        self.predicts_better_than(other)
            && self.prediction.rms_rad() < (1.0 - CLEAR_GAIN) * other.prediction.rms_rad()
    }
}

/// Every set with an effect more than one of `models`, fitted, best first.
fn with_each(lengths: &Lengths, models: &[Model], all: &[Effect]) -> Vec<Model> {
    let tried = models.iter().map(|model| {
        let there = &model.fit.structure.effects[..];
        (model, there, beside(there, all).cloned().collect())
    });
    let mut out = expanded(tried, |model, effect| with(lengths, model, effect));
    out.sort_by(|a, b| a.fit.sum().total_cmp(&b.fit.sum()));
    out
}

/// Effects of the state: what follows time alone, or adds a line, is tried last, elsewhere. The rest angle is
/// in every model.
fn candidates(decay: &FreeDecay, there: &[Effect]) -> Vec<Effect> {
    let mut all = library(decay, there);
    let is_higher = |e: &Effect| e.series() == Some(Series::HigherTerm);
    all.retain(|e| e.is_strength_of_state() && !e.moves_rest() && !is_higher(e));
    all
}

/// What was found.
pub(crate) struct Survivors {
    pub(crate) lengths: Lengths,
    /// From the plain model on, an effect more each.
    pub(crate) path: Vec<PredictedModel>,
    /// Every effect alone, best first.
    pub(crate) singles: Vec<Model>,
    /// Every set that was fitted on the way.
    pub(crate) sets: Vec<Model>,
    /// What survives of the simple effects alone.
    simple: Nested<PredictedModel>,
}

/// The model from which effects are looked for: the second-order response about a rest angle of its own, with
/// the effects of `present`.
fn base(lengths: &Lengths, begin: (Structure, Vec<f64>), present: &Structure) -> Model {
    let (mut structure, start) = begin;
    structure.limits.extend(present.limits.iter().cloned());
    let plain = fitted(lengths, &structure, &start, None);
    // A constant moment is the rest angle's.
    let effects = present.effects.iter().filter(|e| !e.moves_rest());
    effects.fold(plain, |model, effect| with(lengths, &model, effect))
}

/// Searches for the effects that survive prediction beside those of `present`, a user's `own` among them.
///
/// # Errors
/// Interrupted, once somebody asked for it.
pub(crate) fn search(decay: &FreeDecay, own: &[Effect], present: &Structure) -> Result<Survivors> {
    let (structure, start) = plain_start(decay);
    searched(decay, Lengths::new(decay), (structure, start.to_vec()), own, present)
}

/// The same over the pieces of all `releases`, each with what it has for itself.
///
/// # Errors
/// Interrupted, once somebody asked for it.
pub(super) fn search_all(
    releases: &Releases,
    own: &[Effect],
    present: &Structure,
) -> Result<Survivors> {
    searched(releases.first(), releases.lengths(), releases.plain_start(), own, present)
}

/// Over the pieces in `lengths`, which have been cut from `decay` or from smaller ones besides.
fn searched(
    decay: &FreeDecay,
    lengths: Lengths,
    begin: (Structure, Vec<f64>),
    own: &[Effect],
    present: &Structure,
) -> Result<Survivors> {
    let plain = judged(&lengths, base(&lengths, begin, present));
    let there = &plain.model.fit.structure.effects;
    let all = candidates(decay, there);
    // Sets of one more effect each, the best fits carried on.
    let mut rounds: Vec<Vec<Model>> = vec![vec![plain.model.clone()]];
    while rounds.len() <= MAX_EFFECTS {
        decay.stop.check()?;
        let last = rounds.last().expect("a round");
        let next = with_each(&lengths, &last[..last.len().min(BREADTH)], &all);
        let Some(best) = next.first() else { break };
        let gains =
            rounds.len() == 1 || best.fit.sum() < (1.0 - MIN_GAIN).powi(2) * last[0].fit.sum();
        if !gains {
            break;
        }
        rounds.push(next);
    }
    decay.stop.check()?;
    let tried: Vec<Vec<PredictedModel>> = rounds[1..]
        .iter()
        .par_map(|round| {
            let round = &round[..round.len().min(BREADTH)];
            round.iter().par_map(|m| judged(&lengths, m.clone())).collect()
        })
        .collect();
    let mut here = plain.clone();
    for round in tried {
        decay.stop.check()?;
        let best = round
            .into_iter()
            .filter(|l| l.predicts_better_than(&here))
            .min_by(|a, b| a.prediction.rms_rad().total_cmp(&b.prediction.rms_rad()));
        if let Some(best) = best {
            here = best;
        }
    }
    let judge = ByPrediction { lengths: &lengths, there: there.len() };
    let own: Vec<Effect> =
        own.iter().filter(|e| e.is_own() && !there.contains(e)).cloned().collect();
    // A user's own are slower than the library's, and tried where those have gone as far as they can.
    let simple = grown(&judge, Nested::pruned(&judge, here)?, &own)?;
    let path = bent(decay, &judge, &plain, simple.clone(), &all)?.path(&judge, plain.clone())?;
    let mut singles = rounds.get(1).cloned().unwrap_or_default();
    singles.extend(own.iter().par_map(|e| with(&lengths, &plain.model, e)));
    singles.sort_by(|a, b| a.fit.sum().total_cmp(&b.fit.sum()));
    let sets = rounds.into_iter().flatten().collect();
    Ok(Survivors { path, singles, sets, lengths, simple })
}

/// `here` with those of `effects` beside which it predicts better, one after the other, and what they leave
/// needed.
fn grown(
    judge: &ByPrediction,
    mut here: Nested<PredictedModel>,
    effects: &[Effect],
) -> Result<Nested<PredictedModel>> {
    let lengths = judge.lengths;
    loop {
        lengths.stop.check()?;
        let inner = &here.model;
        let better = beside(&inner.model.fit.structure.effects, effects)
            .par_map(|e| judged(lengths, with(lengths, &inner.model, e)))
            .filter(|with| judge.is_worth(inner, with))
            .min_by(|a, b| judge.misfit(a).total_cmp(&judge.misfit(b)));
        match better {
            Some(better) => here = Nested::pruned(judge, better)?,
            None => return Ok(here),
        }
    }
}

/// Whether a simpler effect has another name for the last of `model`.
fn is_simpler_one(lengths: &Lengths, model: &Model) -> bool {
    let fit = &model.fit;
    fit.structure.effects.last().is_some_and(|effect| {
        let varied = &fit.common[fit.common.len() - effect.parameters().len()..];
        let users: Vec<Quantity> =
            effect.published(varied).0.into_iter().map(Quantity::exact).collect();
        effect.is_simpler_one(&users, lengths.scale.amplitude_rad)
    })
}

/// `here`, or where one that bends to much predicts clearly better, that one with those of `simple` that it leaves
/// needed. It is tried beside what is there and beside the `plain` model: simple effects that stand for what it is
/// keep it from its numbers.
fn bent(
    decay: &FreeDecay,
    judge: &ByPrediction,
    plain: &PredictedModel,
    here: Nested<PredictedModel>,
    simple: &[Effect],
) -> Result<Nested<PredictedModel>> {
    let (lengths, inner) = (judge.lengths, &here.model);
    lengths.stop.check()?;
    let mut flexible = library(decay, &plain.model.fit.structure.effects);
    flexible.retain(Effect::is_flexible);
    let has_simple = !judge.effects(inner).is_empty();
    let bent_beside = |of: &PredictedModel| {
        let all = flexible.iter().par_map(|effect| {
            let start = rough_start(lengths, &of.model, effect)?;
            let bent = with_from(lengths, &of.model, effect, &start);
            (!is_simpler_one(lengths, &bent)).then(|| judged(lengths, bent))
        });
        all.flatten().filter(|with| with.predicts_clearly_better_than(inner)).collect::<Vec<_>>()
    };
    let mut better = bent_beside(inner);
    if has_simple {
        better.extend(bent_beside(plain));
    }
    let numbers = |judged: &PredictedModel| judged.model.fit.common.len();
    let is_ahead = |with: &PredictedModel, best: &PredictedModel, has_more| match has_more {
        true => with.predicts_clearly_better_than(best),
        false => with.prediction.rms_rad() < best.prediction.rms_rad(),
    };
    let better = simplest(better, numbers, is_ahead);
    better.map_or(Ok(here), |better| grown(judge, Nested::pruned(judge, better)?, simple))
}

/// Judges models far from the noise, where prediction holds.
struct ByPrediction<'a> {
    lengths: &'a Lengths,
    /// Effects that were there from the beginning.
    there: usize,
}

impl Judge for ByPrediction<'_> {
    type Model = PredictedModel;

    fn effects<'a>(&self, judged: &'a PredictedModel) -> &'a [Effect] {
        &judged.model.fit.structure.effects[self.there..]
    }
    fn without(&self, larger: &PredictedModel, effect: &Effect) -> Option<PredictedModel> {
        Some(judged(self.lengths, without(self.lengths, &larger.model, effect)))
    }
    fn is_worth(&self, smaller: &PredictedModel, larger: &PredictedModel) -> bool {
        larger.predicts_better_than(smaller)
    }
    fn misfit(&self, judged: &PredictedModel) -> f64 {
        judged.prediction.rms_rad()
    }
    fn stop(&self) -> &Stop {
        &self.lengths.stop
    }
}

impl Survivors {
    pub(super) fn last(&self) -> &PredictedModel {
        self.path.last().expect("the plain model")
    }

    /// Effects that were there from the beginning.
    pub(super) fn there(&self) -> &[Effect] {
        &self.path[0].model.fit.structure.effects
    }

    /// The same with the simple effects alone.
    ///
    /// # Errors
    /// Interrupted, once somebody asked for it.
    pub(crate) fn simple(self) -> Result<Self> {
        let simple = self.simple.clone();
        self.up_to(simple)
    }

    /// The same without `effect`.
    ///
    /// # Errors
    /// Interrupted, once somebody asked for it.
    pub(crate) fn without(self, effect: &Effect) -> Result<Self> {
        let less = judged(&self.lengths, without(&self.lengths, &self.last().model, effect));
        self.up_to(less.into())
    }

    pub(super) fn up_to(mut self, last: Nested<PredictedModel>) -> Result<Self> {
        let judge = ByPrediction { lengths: &self.lengths, there: self.there().len() };
        self.path = last.path(&judge, self.path[0].clone())?;
        Ok(self)
    }
}

/// `like` fitted again with another structure of the same numbers, and judged.
pub(crate) fn refit(
    lengths: &Lengths,
    structure: &Structure,
    like: &PredictedModel,
) -> PredictedModel {
    let model = fitted(lengths, structure, &like.model.short.common, Some(&like.model.fit.common));
    judged(lengths, model)
}
