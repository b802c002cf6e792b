//! Numbers that physics forbids, or that a record does not fix: their effect is refused, and it is said why.

use crate::effects::{Effect, Parameter, State, Terms};
use crate::fit::fitting::Fitted;
use crate::fit::free_decay::FreeDecay;
use crate::fit::joint::JointFit;
use crate::fit::structure::{WN, ZETA};
use crate::identify::WindowEstimate;
use crate::quantity::{Quantity, CHANCE};
use crate::statistics::median;
use std::f64::consts::{PI, TAU};

/// Amplitudes between the smallest and the largest at which damping is looked at, and angles in a cycle.
const LOSS_AMPLITUDES: usize = 12;
const PHASES: usize = 200;

/// Share of its frequency within which a line is at a harmonic, and factor within which its damping ratio is
/// one of the motion's at its amplitudes.
pub(crate) const HARMONIC: f64 = 0.01;
const ALIKE: f64 = 1.7;

/// An effect that cannot stand, and why.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Refusal {
    pub(crate) effect: Effect,
    pub(crate) reason: String,
}

/// The first effect of `model` that cannot stand, but for those that were `there` from the beginning, which
/// are the user's.
pub(super) fn refusal(model: &Fitted, decay: &FreeDecay, there: &[Effect]) -> Option<Refusal> {
    no_line(model, decay, there)
        .or_else(|| unknown(model, there, CHANCE))
        .or_else(|| feeding(model, decay, there))
}

/// A line that is none. A second mode nearer to the natural frequency than its own line is wide, or not
/// distinguished from two or three times that and dying out as that power of the amplitude does; a periodic
/// moment that the record does not distinguish from two or three times that.
fn no_line(model: &Fitted, decay: &FreeDecay, there: &[Effect]) -> Option<Refusal> {
    let mut new = model.structure.effects.iter().filter(|e| !there.contains(e));
    new.find_map(|effect| no_line_of(effect, model, decay))
}

fn no_line_of(effect: &Effect, model: &Fitted, decay: &FreeDecay) -> Option<Refusal> {
    let line = effect.line()?;
    let own = numbers_of(effect, &model.effect_parameters());
    let (Parameter { name: w, .. }, frequency) = own[line.frequency];
    let w_rad_s = frequency.value;
    // The motion's own windows: where the line outlasts it, theirs are the line's.
    let own_rad_s = model.parameters[WN];
    let is_own = |f: &f64| (f - own_rad_s).abs() <= (f - w_rad_s).abs();
    let windows = decay.windows.iter().map(|w| w.natural_frequency_rad_s);
    let mut windows: Vec<f64> = windows.filter(is_own).collect();
    let wn_rad_s = if windows.is_empty() { own_rad_s } else { median(&mut windows) };
    let refused = |reason| Some(Refusal { effect: effect.clone(), reason });
    let harmonic = |is_at: &dyn Fn(f64) -> bool| [2.0, 3.0].into_iter().find(|k| is_at(*k));
    let Some(damping) = line.damping else {
        let order = harmonic(&|k| frequency.holds(k * wn_rad_s, CHANCE))?;
        return refused(format!(
            "{w} = {frequency} rad/s is not distinguished from {order} times the natural frequency: a harmonic of the restoring moment or of the sensor would be there"
        ));
    };
    let zeta2 = own[damping].1.value;
    if (w_rad_s - wn_rad_s).abs() < zeta2 * w_rad_s {
        return refused(format!(
            "{w} = {w_rad_s:.4} rad/s is nearer to the natural frequency than its line is wide: it stands for what varies with the amplitude, no mode"
        ));
    }
    let is_near = |k: f64| (w_rad_s / wn_rad_s / k - 1.0).abs() < HARMONIC;
    let order = harmonic(&|k| is_near(k) || frequency.holds(k * wn_rad_s, CHANCE))?;
    let of_model = |w: &WindowEstimate| decay.measurand.of_model(w.amplitude_deg);
    let amplitudes = decay.windows.iter().map(of_model).chain([decay.amplitude_rad]);
    let zetas = amplitudes.map(|a| model.parameters[ZETA] + losses(model, a).iter().sum::<f64>());
    let (least, most) =
        zetas.fold((f64::INFINITY, 0.0f64), |(least, most), z| (least.min(z), most.max(z)));
    let dies_with_it = zeta2 > least / ALIKE && zeta2 < most * ALIKE;
    match dies_with_it {
        true => refused(format!(
            "{w} = {w_rad_s:.2} rad/s is {order} times the natural frequency and dies out as that power of the amplitude: a harmonic of the restoring moment or of the sensor, no mode"
        )),
        false => None,
    }
}

/// A named effect is so many standard uncertainties, what the model lacks among them, from zero; or the prediction
/// is better by it by as many standard errors.
pub(super) const OF_NAMED: f64 = 2.0;

/// Each number of `effect`, with what it is among `all` of its model.
fn numbers_of<'a>(
    effect: &'a Effect,
    all: &[(String, Quantity)],
) -> Vec<(&'a Parameter, Quantity)> {
    let found = |p: &'a Parameter| {
        let name = format!("{effect}.{}", p.name);
        (p, all.iter().find(|(n, _)| *n == name).expect("a number of the model").1)
    };
    effect.parameters().iter().map(found).collect()
}

/// Those of an effect's numbers that say whether it is there: of a line where there is none a frequency may
/// well be known.
fn sizes<'a>(
    effect: &Effect,
    own: &'a [(&Parameter, Quantity)],
) -> &'a [(&'a Parameter, Quantity)] {
    match effect.line() {
        Some(line) => &own[line.size..=line.size],
        None => own,
    }
}

/// Those effects of `model`, but for those that were `there`, none of whose sizes is more than `k` standard
/// uncertainties from zero.
pub(super) fn of_unknown_size(model: &Fitted, there: &[Effect], k: f64) -> Vec<Effect> {
    let numbers = model.effect_parameters();
    let may_be_none = |effect: &&Effect| {
        sizes(effect, &numbers_of(effect, &numbers)).iter().all(|(_, q)| q.holds(0.0, k))
    };
    let new = model.structure.effects.iter().filter(|e| !there.contains(e));
    new.filter(may_be_none).cloned().collect()
}

/// `model` with each of `effects` that it has known to be other than zero: its size that is most so for all that the model lacks
/// is [`OF_NAMED`] of its standard uncertainties from it, and the other numbers are what that makes of them.
pub(super) fn other_than_zero(model: Fitted, effects: &[Effect]) -> Fitted {
    let there: Vec<&Effect> =
        effects.iter().filter(|effect| model.structure.place(effect).is_some()).collect();
    there.into_iter().fold(model, |model, effect| {
        let numbers = model.effect_parameters();
        let own = numbers_of(effect, &numbers);
        let over = |(_, q): &&(&Parameter, Quantity)| q.value.abs() / q.u;
        let most = sizes(effect, &own).iter().max_by(|a, b| over(a).total_cmp(&over(b)));
        let Some((p, _)) = most.filter(|(_, q)| q.holds(0.0, OF_NAMED)) else { return model };
        let mut model = model.known_from_zero(&format!("{effect}.{}", p.name), OF_NAMED);
        model.needed.push(effect.clone());
        model
    })
}

/// The same of each release, and of what they have in common.
pub(super) fn other_than_zero_in_all(joint: &mut JointFit, effects: &[Effect]) {
    for fit in &mut joint.fits {
        *fit = other_than_zero(fit.clone(), effects);
    }
    effects.iter().for_each(|effect| joint.known_from_zero(effect, OF_NAMED));
}

/// An effect none of whose numbers is known to be more than `k` standard uncertainties from zero, or one with a
/// number at its bound.
pub(super) fn unknown(model: &Fitted, there: &[Effect], k: f64) -> Option<Refusal> {
    let numbers = model.effect_parameters();
    model.structure.effects.iter().filter(|e| !there.contains(e)).find_map(|effect| {
        let own = numbers_of(effect, &numbers);
        let refused = |reason: String| Some(Refusal { effect: effect.clone(), reason });
        let bounded = |(p, q): &&(&Parameter, Quantity)| q.value == p.min || q.value == p.max;
        if let Some((p, q)) = own.iter().find(bounded) {
            return refused(format!(
                "{} = {:.4} {} is at its bound: no value within makes the model fit better",
                p.name, q.value, p.unit
            ));
        }
        if let Some((p, _)) = own.iter().find(|(_, q)| q.u == 0.0 || !q.u.is_finite()) {
            return refused(format!("the record does not say how well {} is known", p.name));
        }
        let sizes = sizes(effect, &own);
        match sizes.iter().any(|(_, q)| !q.holds(0.0, k)) {
            true => None,
            false => {
                let (p, q) = sizes[0];
                refused(format!("{} = {q} {} is not known to be other than zero", p.name, p.unit))
            }
        }
    })
}

/// Without wind nothing feeds the motion: where the damping would be below zero, of the model as a whole at
/// some amplitude or of its plain part, the effect that makes it so.
fn feeding(model: &Fitted, decay: &FreeDecay, there: &[Effect]) -> Option<Refusal> {
    let of_model = |w: &WindowEstimate| decay.measurand.of_model(w.amplitude_deg);
    let amplitudes: Vec<f64> = decay.windows.iter().map(of_model).collect();
    let largest = amplitudes.iter().copied().fold(0.0, f64::max);
    let least = amplitudes.iter().copied().fold(largest, f64::min);
    let grows = decay.windows.iter().any(|w| w.damping_ratio < 0.0);
    if decay.wind_speed_m_s > 0.0 || grows || least <= 0.0 {
        return None;
    }
    let zeta = model.damping_ratio();
    let effects = &model.structure.effects;
    let new = || (0..effects.len()).filter(|k| !there.contains(&effects[*k]));
    for k in 0..=LOSS_AMPLITUDES {
        let amplitude = least * (largest / least).powf(k as f64 / LOSS_AMPLITUDES as f64);
        let each = losses(model, amplitude);
        let total = zeta.value + each.iter().sum::<f64>();
        // But for rounding: what takes nothing out adds up to nearly nothing.
        if total < -f64::EPSILON {
            let worst = new().min_by(|a, b| each[*a].total_cmp(&each[*b]))?;
            return Some(Refusal {
                effect: effects[worst].clone(),
                reason: format!(
                    "with it the damping ratio would be {total:.4} at {:.2} {}, and without wind nothing feeds the motion",
                    decay.measurand.shown(amplitude),
                    decay.measurand.coordinate_unit()
                ),
            });
        }
    }
    if zeta.value + CHANCE * zeta.u < 0.0 {
        let each = losses(model, largest);
        let most = new().max_by(|a, b| each[*a].total_cmp(&each[*b]))?;
        return Some(Refusal {
            effect: effects[most].clone(),
            reason: format!(
                "it needs a damping ratio of {zeta} beside it, and without wind nothing feeds the motion"
            ),
        });
    }
    None
}

/// Of each effect of `model`, the damping ratio that takes as much energy out of a cycle of this amplitude.
fn losses(model: &Fitted, amplitude_rad: f64) -> Vec<f64> {
    let of = |effect: &Effect| {
        let mut terms = Terms::default();
        effect.write(model.varied(effect).unwrap_or_default(), &mut terms);
        equivalent_damping_ratio(&terms, model.parameters[WN], amplitude_rad)
    };
    model.structure.effects.iter().map(of).collect()
}

/// Damping ratio that takes as much energy out of a cycle of this amplitude as the moments do.
fn equivalent_damping_ratio(terms: &Terms, wn: f64, amplitude_rad: f64) -> f64 {
    let mut lost = 0.0;
    for k in 0..PHASES {
        let (sin, cos) = (TAU * (k as f64 + 0.5) / PHASES as f64).sin_cos();
        let (yaw_rad, rate_rad_s) = (amplitude_rad * cos, -amplitude_rad * wn * sin);
        let state = State { yaw_rad, rate_rad_s, time_s: 0.0, spring_moment_rad_s2: 0.0 };
        lost -= terms.smooth_moment(&state, 0.0) * rate_rad_s;
    }
    let smooth = lost * TAU / (PHASES as f64 * wn) / (TAU * (wn * amplitude_rad).powi(2));
    smooth + 2.0 * terms.dry_friction_rad_s2 / (PI * wn * wn * amplitude_rad)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fitting::Structure;
    use crate::record::Record;
    use nalgebra::DMatrix;

    /// Against the closed forms of describing functions.
    #[test]
    fn damping_over_a_cycle_is_that_of_the_describing_functions() {
        let (wn, a) = (7.0, 0.2);
        for (effect, p, expected) in [
            (Effect::CoulombFriction, 0.1, 2.0 * 0.1 / (PI * wn * wn * a)),
            (Effect::QuadraticDamping, 0.3, 4.0 * 0.3 * a / (3.0 * PI)),
            (Effect::CubicDamping, -2.0, -2.0 * a * a / (8.0 * wn)),
            (Effect::CubicStiffness, 40.0, 0.0),
        ] {
            let terms = Terms::new([(effect.clone(), &[p][..])]);
            let found = equivalent_damping_ratio(&terms, wn, a);
            assert!((found - expected).abs() < 1e-4 * expected.abs().max(1e-3), "{effect} {found}");
        }
    }

    /// A release from 12 deg down to 1 deg, and a model of it with given numbers and a covariance.
    fn model(
        zeta: f64,
        effects: &[(Effect, f64, f64)],
        correlation: f64,
        wind: f64,
    ) -> (Fitted, FreeDecay) {
        let time_s: Vec<f64> = (0..6000).map(|k| f64::from(k) / 200.0).collect();
        let yaw_deg = time_s.iter().map(|t| 12.0 * (-0.08 * t).exp() * (7.0 * t).cos()).collect();
        let record = Record::new("mine", time_s, yaw_deg);
        let decay = FreeDecay { wind_speed_m_s: wind, ..FreeDecay::from_record(&record).unwrap() };
        let structure = Structure {
            effects: effects.iter().map(|e| e.0.clone()).collect(),
            ..Structure::default()
        };
        let mut p = vec![7.0, zeta, 0.2, 0.0];
        let mut u = vec![1e-4, 1e-4, 1e-4, 1e-4];
        for (_, value, uncertainty) in effects {
            p.push(*value);
            u.push(*uncertainty);
        }
        let n = p.len();
        let tied = |a: usize, b: usize| a != b && a >= 4 && b >= 4;
        let covariance = DMatrix::from_fn(n, n, |a, b| {
            let r = if a == b { 1.0 } else { f64::from(u8::from(tied(a, b))) * correlation };
            r * u[a] * u[b]
        });
        let residuals: Vec<f64> =
            (0..1000).map(|k| if k % 2 == 0 { 1e-4 } else { -1e-4 }).collect();
        (Fitted::new(structure, p, residuals, true, Some(covariance), decay.around()), decay)
    }

    #[test]
    fn a_line_at_a_harmonic_that_dies_out_as_one_is_none_nor_one_at_the_natural_frequency() {
        // Frequency and its uncertainty, and of a mode the damping ratio.
        for (effect, w_rad_s, u, zeta2, refused) in [
            (Effect::SecondMode, 14.02, 1e-4, 0.012, true),
            (Effect::SecondMode, 21.0, 1e-4, 0.011, true),
            (Effect::SecondMode, 14.3, 1e-4, 0.012, false),
            (Effect::SecondMode, 14.3, 0.15, 0.012, true),
            (Effect::SecondMode, 14.0, 1e-4, 0.003, false),
            (Effect::SecondMode, 7.05, 1e-4, 0.03, true),
            (Effect::SecondMode, 7.4, 1e-4, 0.01, false),
            (Effect::HarmonicForcing, 21.1, 0.05, 0.1, true),
            (Effect::HarmonicForcing, 21.1, 0.02, 0.1, false),
            (Effect::HarmonicForcing, 17.0, 0.05, 0.1, false),
        ] {
            let (_, decay) = model(0.0114, &[], 0.0, 0.0);
            let structure = Structure { effects: vec![effect.clone()], ..Structure::default() };
            let mut p = vec![7.0, 0.0114, 0.2, 0.0];
            let users = effect.parameters().iter().map(|p| match &*p.name {
                "w2" | "w" => w_rad_s,
                "zeta2" => zeta2,
                _ => 0.1,
            });
            p.extend(effect.varied(&users.collect::<Vec<f64>>()));
            let white = (0..1000).map(|k| if k % 2 == 0 { 1e-4 } else { -1e-4 }).collect();
            let covariance = DMatrix::identity(p.len(), p.len()) * (u * u);
            let model = Fitted::new(structure, p, white, true, Some(covariance), decay.around());
            let found = no_line(&model, &decay, &[]).map(|r| r.reason);
            assert_eq!(found.is_some(), refused, "{effect} {w_rad_s} {u} {zeta2}: {found:?}");
        }
    }

    #[test]
    fn what_cannot_be_is_refused_and_it_is_said_why() {
        let friction = (Effect::CoulombFriction, 0.1, 0.001);
        let drag = (Effect::QuadraticDamping, 0.3, 0.001);
        let falling = (Effect::CubicDamping, -20.0, 0.1);
        let at_bound = (Effect::QuadraticDamping, 0.0, 0.001);
        let near_bound = (Effect::QuadraticDamping, 1e-9, 0.001);
        let unknown = (Effect::CubicStiffness, 1.0, 0.9);
        for (zeta, effects, correlation, wind, words) in [
            (0.01, vec![friction.clone(), drag.clone()], 0.5, 0.0, None),
            (0.01, vec![at_bound], 0.0, 0.0, Some("at its bound")),
            (0.01, vec![near_bound], 0.0, 0.0, Some("not known to be other than zero")),
            (0.01, vec![unknown], 0.0, 0.0, Some("other than zero")),
            (0.01, vec![falling.clone()], 0.0, 0.0, Some("would be -0.00")),
            (0.01, vec![falling], 0.0, 10.0, None),
            (-0.002, vec![drag.clone(), friction.clone()], 0.0, 0.0, Some("needs a damping ratio")),
            (-0.002, vec![drag, friction], 0.0, 10.0, None),
        ] {
            let (model, decay) = model(zeta, &effects, correlation, wind);
            let found = refusal(&model, &decay, &[]).map(|r| r.reason);
            assert_eq!(refusal(&model, &decay, &model.structure.effects), None);
            match (words, &found) {
                (None, None) => {}
                (Some(words), Some(reason)) if reason.contains(words) => {}
                _ => panic!("{zeta} {effects:?} {wind}: {found:?}"),
            }
        }
    }
}
