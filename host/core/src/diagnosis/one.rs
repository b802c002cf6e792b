//! The verdict on one release: which models are looked for, and whose answer stands.

use crate::diagnosis::account::{self, Account};
use crate::diagnosis::alike::alike;
use crate::diagnosis::answer::{hold_least, Diagnosed, Diagnosis, HeldOut, Options, Status, Step};
use crate::diagnosis::by_likelihood::{by_likelihood, Likely};
use crate::diagnosis::guards;
use crate::diagnosis::likelihood::NEAR_NOISE;
use crate::diagnosis::search::SearchStart;
use crate::diagnosis::survivors;
use crate::diagnosis::verdict::{name_of, Chosen};
use crate::discrepancy::ABOVE_NOISE;
use crate::effects::Effect;
use crate::error::{Error, Result};
use crate::fit::fitting::Fitted;
use crate::fit::free_decay::{FreeDecay, BEGINNING};
use crate::record::Record;
use std::slice::from_ref;

pub(super) fn of_one(record: &Record, decay: FreeDecay, options: &Options) -> Result<Diagnosed> {
    let options = &options.of(&decay);
    let present = &options.present;
    // Pieces of a free decay do not show what follows time, and a flexible effect is not looked for beside
    // another.
    if !present.effects.iter().all(Effect::shows_in_pieces) {
        let start = SearchStart::new(&decay, options)?;
        return Ok(by_likelihood(record, &decay, &start)?.answer(record));
    }
    let survivors = survivors::search(&decay, &options.own, present)?;
    let rest_is_known = options.zero_unknown || present.effects.iter().any(Effect::moves_rest);
    let mut account = account::account(&decay, survivors, rest_is_known)?;
    let best = &account.last().model;
    let decay = with_floor_of(decay, best);
    let name = name_of(&present.effects);
    let likely = match likely(record, &decay, options) {
        // About the sensor's zero the present model may have no fit where it has one about its rest angle.
        Err(Error::NotFitted) => return by_prediction(record, decay, account, name),
        likely => likely?,
    };
    // What is random predicts nothing: it may stand beside effects that predict most of the record, where it
    // is believed, not in their place.
    let stands = |found: &Diagnosed| {
        let Diagnosis { effects, status, .. } = &found.diagnosis;
        if !effects.iter().any(Effect::is_random) {
            return *status != Status::Unexplained;
        }
        let mut beside = effects.iter().filter(|e| !e.is_random()).peekable();
        let beside_them = beside.peek().is_some() && beside.all(|e| account.effects.contains(e));
        !account.explains_most() || *status == Status::Explained && beside_them
    };
    // Why a line is none, which pieces do not show.
    let mut refused = likely.candidates();
    refused.retain(|c| c.reason.is_some() && c.effect.line().is_some());
    if likely.explains() {
        let diagnosed = likely.answer(record);
        if stands(&diagnosed) {
            return Ok(diagnosed);
        }
    }
    account.candidates.extend(refused);
    decay.stop.check()?;
    by_prediction(record, decay, account, name)
}

/// What likelihood finds in `decay`: a model that explains it explains its beginning, too, so that of a long one
/// ever longer beginnings are searched, as far as they are explained.
fn likely(record: &Record, decay: &FreeDecay, options: &Options) -> Result<Likely> {
    let beginnings = std::iter::successors(Some(BEGINNING), |count| Some(2 * count));
    for count in beginnings.take_while(|count| 2 * count <= decay.yaw_rad.len()) {
        let part = decay.beginning(count);
        let found = by_likelihood(record, &part, &SearchStart::new(&part, options)?)?;
        if !found.explains() {
            return Ok(found);
        }
    }
    by_likelihood(record, decay, &SearchStart::new(decay, options)?)
}

/// `decay` with the floor of coloured noise as `model` shows it, where the one does not account for what the
/// model leaves and the other does: in a short record the oscillation hides where such noise is strongest.
fn with_floor_of(decay: FreeDecay, model: &Fitted) -> FreeDecay {
    if model.over_noise(&decay) < ABOVE_NOISE {
        return decay;
    }
    let shown = decay.clone().with_noise_of(&model.residuals);
    let accounts_for_it = model.over_noise(&shown) < NEAR_NOISE;
    if accounts_for_it {
        shown
    } else {
        decay
    }
}

/// The answer that survives prediction.
fn by_prediction(
    record: &Record,
    decay: FreeDecay,
    account: Account,
    model: &str,
) -> Result<Diagnosed> {
    let last = &account.last().model;
    let step = |s: &account::Step| Step {
        added: s.added.clone(),
        residual_rms_deg: decay.raw_rms_deg(s.model.rms_rad()),
        residual_over_noise: s.model.over_noise(&decay),
        held_out_over_noise: s.held_out_rad / decay.noise_rad,
        parameters: s.parameters.clone(),
    };
    let allowed = |rival: &survivors::PredictedModel| {
        let model = account::of_judged(&decay, &account.survivors, rival);
        guards::refusal(&model, &decay, account.survivors.there()).is_none()
    };
    let mut steps: Vec<Step> = account.steps.iter().map(step).collect();
    hold_least(&mut steps);
    let chosen = Chosen {
        status: None,
        effects: account.effects.clone(),
        indistinguishable: alike(&account.survivors, allowed)?,
        steps,
        held_out: HeldOut::Pieces,
        candidates: account.candidates.clone(),
        model,
    };
    let models = [from_ref(account.plain()), from_ref(last)];
    let diagnosis = Diagnosis::new(&[record.name()], from_ref(&decay), models, chosen);
    let path = account.steps.into_iter().map(|s| vec![s.model]).collect();
    Ok(Diagnosed { diagnosis, decays: vec![decay], singles: Vec::new(), path })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Of a second-order response of 45 000 means the whole is the answer, though its beginning is searched first;
    /// where the natural frequency leaps in the beginning, no model explains it, and the whole is not asked.
    #[test]
    fn a_long_release_is_searched_as_far_as_something_explains_it() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let mut found = |leap: f64| {
            let sample = |k: u32| {
                let t = f64::from(k) * 0.02;
                let phase = 6.0 * t + leap * (t - 100.0).max(0.0);
                let z: f64 = StandardNormal.sample(&mut rng);
                (t, 12.0 * (-0.003 * t).exp() * phase.cos() + 0.05 * z)
            };
            let (time_s, yaw_deg) = (0..45_000).map(sample).unzip();
            let record = Record::new("long", time_s, yaw_deg);
            let decay = FreeDecay::from_record(&record).expect("a free decay");
            assert!(decay.yaw_rad.len() > 2 * BEGINNING, "{}", decay.yaw_rad.len());
            let found = likely(&record, &decay, &Options::default()).expect("an answer");
            (found.explains(), found.answer(&record).decays[0].yaw_rad.len(), decay.yaw_rad.len())
        };
        let (explains, searched, all) = found(0.0);
        assert!(explains && searched == all, "{explains}, {searched} of {all}");
        let (explains, searched, _) = found(0.05);
        assert!(!explains && searched == BEGINNING, "{explains}, {searched}");
    }
}
