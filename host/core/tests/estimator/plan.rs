//! The proposed release, made on the rig, against one drawn at random: after which of them does the right
//! rival stand?
//!
//! Every figure asserted is printed:
//! `cargo test --release -p yawrig-core --test estimator plan -- --nocapture`. YAWRIG_PLAN says how many
//! cases, YAWRIG_SEED moves them.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use yawrig_core::bic::{self, MARGIN};
use yawrig_core::effects::Effect;
use yawrig_core::fit::fitting::{fit_added, fit_plain, Fitted, Structure};
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::fit::joint::{self, JointFit, Release, Sharing};
use yawrig_core::plan::{rank, Possible, Ranked, Rival};
use yawrig_core::record::Record;
use yawrig_rig::{Effects, End, Samples, Sensor, Start};
use yawrig_shared::modal::Modal;

/// Alike in a record of one size.
const PAIRS: [[Effect; 2]; 4] = [
    [Effect::QuadraticDamping, Effect::CubicDamping],
    [Effect::CoulombFriction, Effect::QuadraticDamping],
    [Effect::CubicStiffness, Effect::OddQuadraticStiffness],
    [Effect::CubicStiffness, Effect::QuinticStiffness],
];
const RATE_HZ: f64 = 100.0;
const NOISE_DEG: f64 = 0.05;

fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|n| n.parse().ok()).unwrap_or(default)
}

struct Case {
    modal: Modal,
    effect: Effect,
    size: f64,
    other: Effect,
    amplitude_deg: f64,
    seconds: f64,
    seed: u64,
}

impl Case {
    /// A release on a spring of this natural frequency; damping over the inertia stays.
    fn release(&self, amplitude_deg: f64, seconds: f64, wn: f64, seed: u64) -> Option<FreeDecay> {
        let damping_ratio = self.modal.damping_ratio * self.modal.natural_frequency_rad_s / wn;
        let modal = Modal { natural_frequency_rad_s: wn, damping_ratio };
        let name = &self.effect.parameters()[0].name;
        let planted = format!("{}:{name}={}", self.effect, self.size).parse().expect("an effect");
        let effects = Effects::new(vec![planted]).expect("effects");
        let start = Start { amplitude_deg, hold_s: 0.0, end: End::After(seconds) };
        let sensor = Sensor {
            noise_deg: NOISE_DEG,
            adc_step_deg: 0.001,
            rate_hz: RATE_HZ,
            ..Sensor::default()
        };
        let samples = Samples::with_effects(&modal, &effects, &start, &sensor, seed).ok()?;
        let yaw_deg: Vec<f64> = samples.map(|s| s.yaw_deg).collect();
        let time_s = (0..yaw_deg.len()).map(|k| k as f64 / RATE_HZ).collect();
        FreeDecay::from_record(&Record::new("planted", time_s, yaw_deg)).ok()
    }

    fn first(&self) -> Option<FreeDecay> {
        self.release(
            self.amplitude_deg,
            self.seconds,
            self.modal.natural_frequency_rad_s,
            self.seed,
        )
    }
}

/// `effect` fitted to all of `decays` with one coefficient; the repeated ones share natural frequency and
/// damping.
fn fitted(decays: &[&FreeDecay], effect: &Effect, repeated: bool) -> JointFit {
    let single = |decay: &&FreeDecay| {
        fit_added(decay, &fit_plain(decay, false, decay.yaw_rad.len()), effect)
    };
    let singles: Vec<Fitted> = decays.iter().map(single).collect();
    let structure = Structure { effects: vec![effect.clone()], ..Structure::default() };
    let groups = if repeated { vec![0; decays.len()] } else { (0..decays.len()).collect() };
    let sharing = Sharing { modal: groups, effects: vec![vec![Some(0); decays.len()]] };
    let releases: Vec<Release> = decays.iter().map(|d| Release::whole(d)).collect();
    joint::fit_from(&releases, &structure, &sharing, &singles.iter().collect::<Vec<_>>())
}

/// By how much of BIC `a` is better than `b`, which has as many numbers.
fn better(a: &JointFit, b: &JointFit) -> f64 {
    bic::gain(b.sum_of_squares, a.sum_of_squares, a.effective_count(), 0.0)
}

/// A record in which two rivals are both seen, and alike.
fn drawn(seed: u64) -> (Case, FreeDecay, [JointFit; 2]) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    loop {
        let mut pair = PAIRS[rng.random_range(0..PAIRS.len())].clone();
        if rng.random_bool(0.5) {
            pair.swap(0, 1);
        }
        let [effect, other] = pair;
        let wn = rng.random_range(4.0..12.0);
        let amplitude_deg: f64 = rng.random_range(5.0..8.0);
        let a = amplitude_deg.to_radians();
        // Of the spring's moment, or the damping ratio, at that amplitude.
        let share = rng.random_range(0.001..0.006);
        let size = share
            * match effect {
                Effect::CoulombFriction => wn * wn * a,
                Effect::QuadraticDamping => 1.0 / a,
                Effect::CubicDamping => 4.0 * wn / (a * a),
                Effect::CubicStiffness => wn * wn / (a * a),
                Effect::OddQuadraticStiffness => wn * wn / a,
                _ => wn * wn / a.powi(4),
            };
        let modal =
            Modal { natural_frequency_rad_s: wn, damping_ratio: rng.random_range(0.003..0.01) };
        let seconds = 20.0 * std::f64::consts::TAU / wn;
        let seed = rng.random();
        let case = Case { modal, effect, size, other, amplitude_deg, seconds, seed };
        let Some(decay) = case.first() else { continue };
        let fits = [&case.effect, &case.other].map(|e| fitted(&[&decay], e, false));
        let n = decay.yaw_rad.len();
        let plain = fit_plain(&decay, false, n);
        let squares = plain.sum_of_squares / decay.noise_rad.powi(2);
        let seen = |fit: &JointFit| {
            bic::gain(squares, fit.sum_of_squares, fit.effective_count(), 1.0) > MARGIN
        };
        let alike = better(&fits[0], &fits[1]).abs() < MARGIN;
        if alike && fits.iter().all(|fit| fit.converged && seen(fit)) {
            return (case, decay, fits);
        }
    }
}

/// Whether the right rival stands after the release: by the margin.
fn stands(case: &Case, old: &FreeDecay, release: &Possible, seed: u64) -> Option<bool> {
    let wn = release.natural_frequency_rad_s;
    let new = case.release(release.amplitude_deg, release.seconds, wn, seed)?;
    let [right, wrong] =
        [&case.effect, &case.other].map(|e| fitted(&[old, &new], e, release.repeated));
    Some(better(&right, &wrong) > MARGIN)
}

#[test]
fn the_right_rival_stands_after_the_proposed_release() {
    let count = number("YAWRIG_PLAN", 10);
    let shift = 1000 * number("YAWRIG_SEED", 0);
    let results: Vec<(bool, Option<bool>)> = (0..count)
        .into_par_iter()
        .map(|k| {
            let (case, decay, fits) = drawn(shift + k);
            let names = [case.effect.to_string(), case.other.to_string()];
            let rivals: Vec<Rival> = names
                .iter()
                .zip(&fits)
                .map(|(name, fit)| Rival { name: name.clone(), fit })
                .collect();
            let wn = fits[0].parameters[0];
            let mut possible = Vec::new();
            for amplitude_deg in [3.0, 6.0, 12.0, 20.0] {
                for length in [1.0, 2.0] {
                    for (ratio, repeated) in [(1.0, true), (0.6, false), (1.6, false)] {
                        possible.push(Possible {
                            amplitude_deg,
                            spring: None,
                            wind_speed_m_s: None,
                            axis: None,
                            seconds: length * case.seconds,
                            natural_frequency_rad_s: ratio * wn,
                            like: 0,
                            repeated,
                        });
                    }
                }
            }
            let ranked = rank(&rivals, &[&decay], &possible, &|| {}).expect("a plan");
            let best: &Ranked = &ranked[0];
            let proposed = stands(&case, &decay, &best.release, case.seed ^ 1).unwrap_or(false);
            let mut rng = ChaCha8Rng::seed_from_u64(case.seed);
            let any = &possible[rng.random_range(0..possible.len())];
            let random = stands(&case, &decay, any, case.seed ^ 1);
            println!(
                "{} for {}: {:.0} deg, {:.0} s, wn {:.1} of {wn:.1}: {:.1} sigma, chance {:.2}: {proposed}; {:.0} deg, {:.0} s, wn {:.1}: {random:?}",
                case.effect,
                case.other,
                best.release.amplitude_deg,
                best.release.seconds,
                best.release.natural_frequency_rad_s,
                best.separation_sigma,
                best.chance_to_decide,
                any.amplitude_deg,
                any.seconds,
                any.natural_frequency_rad_s,
            );
            (proposed, random)
        })
        .collect();
    let proposed = results.iter().filter(|r| r.0).count();
    let random = results.iter().filter(|r| r.1 == Some(true)).count();
    println!("the right rival stands after the proposed release in {proposed} of {count}, after a random one in {random}");
    assert!(proposed as f64 >= 0.9 * count as f64, "{proposed} of {count}");
}
