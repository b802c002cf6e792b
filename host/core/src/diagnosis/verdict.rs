//! The verdict on releases, put together from the models that were chosen, and in words.

use crate::diagnosis::answer::{Candidate, Diagnosis, HeldOut, Left, ReleaseVerdict, Status, Step};
use crate::diagnosis::compare::{self, Where};
use crate::diagnosis::likelihood::{are_explained, is_explained};
use crate::discrepancy::ABOVE_NOISE;
use crate::effects::Effect;
use crate::fit::at_amplitude::at_amplitudes;
use crate::fit::fitting::{Fitted, Modal};
use crate::fit::free_decay::FreeDecay;
use crate::linearity::Jumps;
use crate::quantity::Quantity;
use crate::statistics::{rms, weighted_rms};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// What a diagnosis begins with where no model is there.
pub const SECOND_ORDER: &str = "the second-order model";

/// Of a smaller model's mean square, what a model leaves at most that accounts for most of it.
pub(crate) const MAX_LEFT: f64 = 0.25;

/// What is left where a model explains the record.
const NOISE: &str = "no more than the noise";

/// What a diagnosis begins with, where these effects are there already.
pub fn name_of(present: &[Effect]) -> &'static str {
    if present.is_empty() {
        SECOND_ORDER
    } else {
        "the present model"
    }
}

/// What was chosen, and by what.
pub(super) struct Chosen<'a> {
    /// `None`: what is left of the releases decides it.
    pub(super) status: Option<Status>,
    pub(super) effects: Vec<Effect>,
    pub(super) indistinguishable: Vec<[Effect; 2]>,
    pub(super) steps: Vec<Step>,
    pub(super) held_out: HeldOut,
    pub(super) candidates: Vec<Candidate>,
    /// What was there before, in words.
    pub(super) model: &'a str,
}

impl Diagnosis {
    /// The verdict in one line; `model` says what was there before.
    pub fn verdict(&self, model: &str) -> String {
        let names: Vec<&str> = self.effects.iter().map(Effect::id).collect();
        let named = names.join(", ");
        match self.status {
            Status::Adequate => format!("adequate: {model} explains it to its noise"),
            Status::Explained if model == SECOND_ORDER => format!("explained by {named}"),
            Status::Explained => format!("explained by {model} with {named}"),
            Status::MostlyExplained if names.is_empty() => format!("mostly explained by {model}"),
            Status::MostlyExplained => format!("mostly explained by {named}"),
            Status::Unexplained if names.is_empty() => {
                "unexplained: no effect of the library accounts for it".to_owned()
            }
            Status::Unexplained if self.effects.iter().any(Effect::is_random) => format!(
                "unexplained: {named} bring it to the noise, but beside random forcing much does; release it again: what \
                 is random does not repeat"
            ),
            Status::Unexplained if self.releases.iter().all(|release| release.explained) => {
                format!("unexplained: with {named} it is down to the noise, but its later part is not predicted")
            }
            Status::Unexplained => format!("unexplained: {named} helped, but not to the noise"),
        }
    }

    /// `last` is the model of the verdict and `plain` that of which it is said what it misses, of each of
    /// `decays`. What only a campaign has is not in it.
    pub(super) fn new(
        files: &[String],
        decays: &[FreeDecay],
        [plain, last]: [&[Fitted]; 2],
        chosen: Chosen,
    ) -> Self {
        let Chosen { status, effects, indistinguishable, steps, held_out, candidates, model } =
            chosen;
        let worst = worst(last, decays);
        let where_ = compare::locate(&decays[worst], &last[worst]);
        let left = left([plain, last], decays, || match files {
            [_] => in_words(&decays[0], &where_),
            _ => format!("most of it in {}", files[worst]),
        });
        let shown = |rms_rad: f64| decays[0].measurand.shown(rms_rad);
        let each = files.iter().zip(decays).zip(plain.iter().zip(last));
        let each =
            each.map(|((file, decay), models)| ReleaseVerdict::new(file, decay, models, &effects));
        Self {
            said: decays[0].measurand.said(),
            noise_rms_deg: shown(rms(decays.iter().map(|d| d.sample_noise_rad))),
            mean_noise_deg: shown(rms(decays.iter().map(|d| d.noise_rad))),
            status: status.unwrap_or_else(|| left.status(are_explained(last, decays), &effects)),
            indistinguishable,
            needed_by_prediction: last.first().map_or_else(Vec::new, |fit| fit.needed.clone()),
            origin: BTreeMap::new(),
            origin_reason: BTreeMap::new(),
            grows_as: BTreeMap::new(),
            dimensionless: BTreeMap::new(),
            source: BTreeMap::new(),
            about_rest: last.iter().all(|fit| fit.rest_rad().is_some()),
            sharing: BTreeMap::new(),
            modal: match last {
                [only] => Some(only.modal()),
                _ => None,
            },
            steps,
            held_out,
            candidates,
            held_by_law: Vec::new(),
            coefficients: BTreeMap::new(),
            releases: each.collect(),
            where_,
            where_release: files[worst].clone(),
            sentence: sentence(&effects, &left, model),
            left,
            jumps: None,
            effects,
            derivatives: None,
        }
    }

    /// Of all releases.
    fn residual_over_noise(&self) -> f64 {
        rms(self.releases.iter().map(|r| r.residual_over_noise))
    }

    /// Made what a filter leaves that foresees all but what is random: innovations, which are in the releases.
    /// `model`: what was there before.
    pub(super) fn is_filtered(&mut self, status: Status, model: &str) {
        self.status = status;
        let rms_deg = self.residual_over_noise() * self.mean_noise_deg;
        let share = rms_deg / self.left.rms_deg;
        self.left.rms_deg = rms_deg;
        self.left.share_of_amplitude *= share;
        self.left.share_of_misfit *= share * share;
        if status == Status::Explained {
            self.left.where_ = NOISE.into();
        }
        self.sentence = sentence(&self.effects, &self.left, model);
    }

    /// Given jumps of the reading, in what is left.
    pub(super) fn has_jumps(&mut self, jumps: Option<Jumps>) {
        self.jumps = jumps;
        let Some(Jumps { at_deg, by_deg, .. }) = jumps else { return };
        let unit = &self.left.unit;
        let words = format!(
            "with jumps of the reading ({} {unit} at {} {unit}): a converter's or a sensor's, no moment does that",
            Rounded(by_deg),
            Rounded(at_deg)
        );
        // It ends with that.
        self.sentence.truncate(self.sentence.len() - self.left.where_.len());
        self.sentence += &words;
        self.left.where_ = words;
    }

    /// Given a last step of a random moment, of another course in each of the releases, which are filtered.
    pub(super) fn is_forced(
        &mut self,
        is_explained: bool,
        parameters: BTreeMap<String, Quantity>,
        model: &str,
    ) {
        let status = if is_explained { Status::Explained } else { Status::Unexplained };
        self.is_filtered(status, model);
        let rms_deg = rms(self.releases.iter().map(|r| r.residual_rms_deg));
        let over_noise = self.residual_over_noise();
        self.steps.push(Step::of_innovations(Effect::random(), rms_deg, over_noise, parameters));
    }
}

impl Step {
    /// What is random cannot be predicted; a filter's innovations are one step ahead throughout.
    pub(super) fn of_innovations(
        added: Effect,
        residual_rms_deg: f64,
        over_noise: f64,
        parameters: BTreeMap<String, Quantity>,
    ) -> Self {
        Self {
            added: Some(added),
            residual_rms_deg,
            residual_over_noise: over_noise,
            held_out_over_noise: over_noise,
            parameters,
        }
    }
}

impl ReleaseVerdict {
    fn new(
        file: &str,
        decay: &FreeDecay,
        (plain, last): (&Fitted, &Fitted),
        effects: &[Effect],
    ) -> Self {
        let mut parameters: BTreeMap<String, Quantity> =
            last.effect_parameters().into_iter().collect();
        if effects.iter().any(Effect::moves_rest) && last.structure.zero_unknown {
            parameters.extend([moment_of_rest(last)]);
        }
        Self {
            file: file.to_owned(),
            condition: None,
            noise_rms_deg: decay.measurand.shown(decay.sample_noise_rad),
            modal: last.modal(),
            rest_angle_deg: last.rest_rad().map(|rest| rest.by(|x| decay.measurand.shown(x))),
            before_over_noise: plain.over_noise(decay),
            residual_rms_deg: decay.raw_rms_deg(last.rms_rad()),
            residual_over_noise: last.over_noise(decay),
            explained: is_explained(last, decay),
            parameters,
            at_amplitude: at_amplitudes(decay, last),
            covariance: last.named_covariance(),
            roll: None,
        }
    }

    /// Given the numbers of `model`, another fit of the same effects.
    pub(super) fn has_numbers_of(&mut self, decay: &FreeDecay, model: &Fitted) {
        self.modal = model.modal();
        self.parameters = model.effect_parameters().into_iter().collect();
        self.at_amplitude = at_amplitudes(decay, model);
        self.covariance = model.named_covariance();
    }

    /// Given innovations for residuals.
    pub(super) fn is_filtered(&mut self, decay: &FreeDecay, over_noise: f64) {
        self.residual_rms_deg = decay.raw_rms_deg(over_noise * decay.noise_rad);
        self.residual_over_noise = over_noise;
        self.explained = over_noise <= ABOVE_NOISE;
    }

    /// What is random has no course at an amplitude.
    pub(super) fn has_no_definite_model(&mut self, modal: Modal) {
        self.modal = modal;
        self.at_amplitude.clear();
        self.covariance = None;
    }
}

impl Left {
    /// What is to be said where `effects` leave this: of a definite model, chosen by what it predicts. One
    /// that leaves less than a hundredth of the amplitude mostly explains a record.
    fn status(&self, is_explained: bool, effects: &[Effect]) -> Status {
        let more = effects.iter().any(|e| !e.moves_rest());
        match (is_explained, effects.is_empty()) {
            (true, true) => Status::Adequate,
            (true, false) => Status::Explained,
            (false, _) if self.share_of_amplitude < 0.01 => Status::MostlyExplained,
            (false, _) if more && self.share_of_misfit < MAX_LEFT => Status::MostlyExplained,
            (false, _) => Status::Unexplained,
        }
    }
}

/// What the `last` model of each release leaves of what the `plain` one misses; `words` say where, if it is
/// more than noise.
fn left(
    [plain, last]: [&[Fitted]; 2],
    decays: &[FreeDecay],
    words: impl FnOnce() -> String,
) -> Left {
    let squares = |fits: &[Fitted]| fits.iter().map(|f| f.sum_of_squares).sum::<f64>();
    let rms_rad = weighted_rms(last.iter().map(|f| (f.count as f64, f.rms_rad())));
    let amplitude_rad = decays.iter().map(FreeDecay::reading_rad).fold(0.0, f64::max);
    Left {
        rms_deg: decays[0].measurand.shown(rms_rad),
        unit: decays[0].measurand.unit().to_owned(),
        share_of_amplitude: rms_rad / amplitude_rad,
        share_of_misfit: (squares(last) / squares(plain)).min(1.0),
        where_: match are_explained(last, decays) {
            true => NOISE.into(),
            false => words(),
        },
    }
}

/// The release that is explained worst.
fn worst(fits: &[Fitted], decays: &[FreeDecay]) -> usize {
    let over = |i: &usize| fits[*i].over_noise(&decays[*i]);
    (0..fits.len()).max_by(|a, b| over(a).total_cmp(&over(b))).unwrap_or(0)
}

/// The constant moment under which `model` rests where it does, over Izz, as the parameter of that effect.
pub(super) fn moment_of_rest(model: &Fitted) -> (String, Quantity) {
    let stiffness = model.parameters[0].powi(2);
    let rest = model.rest_rad().expect("a rest angle that was fitted");
    (Effect::of_rest().first_name(), Quantity::new(stiffness * rest.value, stiffness * rest.u))
}

/// Of which kind what is left is, and at which amplitudes.
fn in_words(decay: &FreeDecay, where_: &Where) -> String {
    let hz = decay.frequency_rad_s / TAU;
    let share = |from: f64, to: f64| {
        let inside = where_.frequency.iter().filter(|f| f.hz >= from * hz && f.hz < to * hz);
        inside.map(|f| f.share).sum::<f64>()
    };
    let kinds = [
        (share(0.0, 0.6), "slow"),
        (share(0.6, 1.5), "at the fundamental"),
        (share(1.5, 2.5), "at the second harmonic"),
        (share(2.5, 3.5), "at the third harmonic"),
        (share(3.5, f64::INFINITY), "at high harmonics"),
    ];
    let kind = kinds.iter().max_by(|a, b| a.0.total_cmp(&b.0)).map_or("", |k| k.1);
    let bins = &where_.amplitude;
    let unit = decay.measurand.coordinate_unit();
    let all = rms(bins.iter().map(|b| b.rms_deg));
    // Named where a third more is left there than at all amplitudes.
    let out = |b: &compare::AmplitudeBin| b.rms_deg > 1.3 * all;
    let above = bins.iter().rev().take_while(|b| out(b)).last();
    let below = bins.iter().take_while(|b| out(b)).last();
    match (above, below) {
        (Some(bin), _) => format!("{kind}, above {} {unit}", Rounded(bin.from_deg)),
        (None, Some(bin)) => format!("{kind}, below {} {unit}", Rounded(bin.to_deg)),
        (None, None) => format!("{kind}, at all amplitudes"),
    }
}

/// To two figures.
struct Rounded(f64);

impl std::fmt::Display for Rounded {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let digits = (1.0 - self.0.abs().max(1e-9).log10().floor()).max(0.0) as usize;
        write!(f, "{:.*}", digits, self.0)
    }
}

/// The sentence that stands for the answer.
fn sentence(effects: &[Effect], left: &Left, model: &str) -> String {
    let names: Vec<String> = effects.iter().map(|e| e.card().title.to_lowercase()).collect();
    let rest = format!(
        "{} {} ({} %) is left, {}",
        Rounded(left.rms_deg),
        left.unit,
        Rounded(100.0 * left.share_of_amplitude),
        left.where_
    );
    let Some((last, others)) = names.split_last() else {
        return format!("no effect of the library predicts better than {model}; {rest}");
    };
    let (list, verb) = match others {
        [] => (last.clone(), "accounts"),
        _ => (format!("{} and {last}", others.join(", ")), "account"),
    };
    let accounted = 100.0 * (1.0 - left.share_of_misfit);
    let digits = if accounted > 99.0 { 2 } else { 1 };
    // What a model misses whose rest angle is fitted is none of a constant moment's.
    if format!("{accounted:.digits$}") == "0.0" {
        return format!(
            "beside {list} no effect of the library predicts better than {model}; {rest}"
        );
    }
    format!("{list} {verb} for {accounted:.digits$} % of what {model} misses; {rest}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_accounts_for_nothing_is_not_said_to() {
        let said = |share_of_misfit: f64| {
            let left = Left {
                rms_deg: 0.035,
                unit: "deg".into(),
                share_of_amplitude: 0.1,
                share_of_misfit,
                where_: "slow".into(),
            };
            sentence(&[Effect::of_rest()], &left, SECOND_ORDER)
        };
        assert_eq!(
            said(1.0),
            "beside constant moment no effect of the library predicts better than the second-order model; 0.035 deg (10 %) is left, slow"
        );
        assert!(said(0.2).starts_with("constant moment accounts for 80.0 % of what"));
    }
}
