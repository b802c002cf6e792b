//! A rate and an acceleration of a motion with planted numbers, from the rig's integrator: fitted as what
//! they are, they give the numbers that the angle gives.

use std::f64::consts::PI;
use std::slice::from_ref;
use yawrig_core::diagnosis::diagnose::{diagnose, Grouping, Options, Status};
use yawrig_core::effects::Effect;
use yawrig_core::fit::fitting::{fit_added, fit_plain_within, Fitted, Structure};
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::identify::{identify, Begin, Method, Settings};
use yawrig_core::quantity::Quantity;
use yawrig_core::record::{Called, Derivative, Measurand, Record};
use yawrig_rig::{Effects, Samples, Sees, Sensor, Start};
use yawrig_shared::modal::Modal;

const WN: f64 = 7.5;
const ZETA: f64 = 0.012;
const DERIVATIVES: [(Derivative, Sees); 3] = [
    (Derivative::None, Sees::Angle),
    (Derivative::Rate, Sees::Rate),
    (Derivative::Acceleration, Sees::Acceleration),
];

/// Held for two seconds and let go from 15 deg; a zero that is off, and noise of 0.5 % of the largest
/// reading.
fn released(seen: (Derivative, Sees), effects: &str, rate_hz: f64, seed: u64) -> Record {
    let (derivative, sees) = seen;
    let modal = Modal { natural_frequency_rad_s: WN, damping_ratio: ZETA };
    let hidden = effects.split_whitespace().map(|e| e.parse().unwrap()).collect();
    let effects = Effects::new(hidden).unwrap();
    let largest = derivative.recorded(15.0, WN);
    let sensor = Sensor {
        sees,
        rate_hz,
        noise_deg: 0.005 * largest,
        offset_deg: if sees == Sees::Angle { 0.0 } else { 0.05 * largest },
        adc_step_deg: 0.0,
        ..Sensor::default()
    };
    let start = Start::default().limited(&modal, &effects);
    let samples = Samples::with_effects(&modal, &effects, &start, &sensor, seed).unwrap();
    let (time_s, yaw_deg) = samples.map(|s| (s.time_s, s.yaw_deg)).unzip();
    let mut record = Record::new(format!("{sees:?}"), time_s, yaw_deg);
    record.measurand = Measurand::angular(derivative);
    record
}

fn near(what: &str, found: Quantity, truth: f64, k: f64) {
    println!("{what}: {found}, planted {truth}: {:+.2} u", (found.value - truth) / found.u);
    assert!(found.holds(truth, k), "{what}: {found} and not {truth}");
}

#[test]
fn every_derivative_is_identified_as_the_angle_is() {
    for (k, seen) in DERIVATIVES.into_iter().enumerate() {
        for rate_hz in [1000.0, 83.0] {
            let record = released(seen, "", rate_hz, 11 + k as u64);
            let found = identify(&record, &[Method::LeastSquares], &Settings::default()).unwrap();
            let estimate = &found.estimates[0];
            let what = format!("{} at {rate_hz} Hz", record.measurand.quantity());
            near(&format!("{what}, wn"), estimate.natural_frequency_rad_s, WN, 3.0);
            near(&format!("{what}, zeta"), estimate.damping_ratio, ZETA, 3.0);
            // Amplitudes are the motion's, noise is the record's.
            let w = &found.window;
            assert!(w.from_deg > 9.0 && w.from_deg < 10.5, "{what}: from {}", w.from_deg);
            assert!(w.to_deg > 0.9 && w.to_deg < 1.3, "{what}: to {}", w.to_deg);
            let noise = 0.005 * seen.0.recorded(15.0, WN);
            assert!((found.noise_rms_deg / noise - 1.0).abs() < 0.1, "{}", found.noise_rms_deg);
            assert_eq!(found.begins, Begin::Held, "{what}");
            let late = found.release_time_s - 2.0;
            assert!(late.abs() < 0.05 * 2.0 * PI / WN, "{what}: released {late} s late");
        }
    }
}

/// What is fitted with one effect, from the record of a motion with it.
fn fitted(record: &Record, effect: &Effect) -> (FreeDecay, Fitted) {
    let decay = FreeDecay::from_record(record).unwrap();
    let zero_unknown = !record.measurand.shows_rest();
    let structure = Structure { zero_unknown, ..Structure::default() };
    let plain = fit_plain_within(&decay, &structure, decay.yaw_rad.len());
    let added = fit_added(&decay, &plain, effect);
    (decay, added)
}

#[test]
fn every_derivative_is_fitted_as_the_angle_is() {
    for (hidden, name, truth) in [
        ("cubic_stiffness:k3=40", "k3", 40.0),
        ("coulomb_friction:c=0.05", "c", 0.05),
        ("quadratic_damping:d=0.08", "d", 0.08),
        ("hysteresis:h=4,y=0.05", "h", 4.0),
        ("free_play:g=0.004", "g", 0.004),
    ] {
        let effect = Effect::from_id(hidden.split(':').next().unwrap()).unwrap();
        for (k, seen) in DERIVATIVES.into_iter().enumerate() {
            let record = released(seen, hidden, 500.0, 31 + k as u64);
            let (decay, fit) = fitted(&record, &effect);
            let what = format!("{} of {effect}", record.measurand.quantity());
            let over_noise = fit.over_noise(&decay);
            println!("{what}: {over_noise:.3} times the noise");
            // Corners of a moment are jumps of an acceleration's slope, which the floor takes for noise.
            let least = if seen.0 == Derivative::Acceleration { 0.8 } else { 0.9 };
            assert!((least..1.1).contains(&over_noise), "{what}: {over_noise}");
            let numbers = fit.effect_parameters();
            let name = format!("{effect}.{name}");
            let of = numbers.iter().find(|(n, _)| *n == name).expect("a number").1;
            if !fit.converged {
                // The slope of an acceleration jumps at the edges of the play: no step of the fit gains any
                // more, and what has not converged has no uncertainty.
                let acceleration = seen.0 == Derivative::Acceleration;
                assert!(
                    acceleration && effect.id() == "free_play" && of.u.is_nan(),
                    "{what}: {of}"
                );
                continue;
            }
            near(&what, of, truth, 3.0);
            near(&format!("{what}, wn"), fit.natural_frequency_rad_s(), WN, 3.0);
            near(&format!("{what}, zeta"), fit.damping_ratio(), ZETA, 3.0);
        }
    }
}

#[test]
fn what_is_missing_is_named_from_every_derivative() {
    for hidden in
        ["", "coulomb_friction:c=0.08", "cubic_stiffness:k3=60", "quadratic_damping:d=0.15"]
    {
        let effect = hidden.split(':').next().and_then(Effect::from_id);
        for (k, seen) in DERIVATIVES.into_iter().enumerate() {
            let record = released(seen, hidden, 500.0, 51 + k as u64);
            let found = diagnose(from_ref(&record), &Grouping::default(), &Options::default())
                .unwrap()
                .diagnosis;
            let what = format!("{} of {hidden:?}", record.measurand.quantity());
            println!("{what}: {:?} {:?}", found.status, found.effects);
            let status = if effect.is_some() { Status::Explained } else { Status::Adequate };
            assert_eq!((found.status, &found.effects[..]), (status, effect.as_slice()), "{what}");
            near(&format!("{what}, wn"), found.modal.unwrap().natural_frequency_rad_s, WN, 3.0);
            near(&format!("{what}, zeta"), found.modal.unwrap().damping_ratio, ZETA, 3.0);
        }
    }
}

/// The same numbers called a displacement, whatever their size: wn and zeta are the same, and an effect is
/// per unit of it.
#[test]
fn a_displacement_is_the_angle_in_another_unit() {
    let effect = Effect::from_id("cubic_stiffness").unwrap();
    let angle = released(DERIVATIVES[0], "cubic_stiffness:k3=40", 500.0, 71);
    let (_, of_angle) = fitted(&angle, &effect);
    // Metres of a beam, pixels of a camera, counts of a converter.
    for per_rad in [0.02, 350.0, 4e6] {
        let mut record = angle.clone();
        record.yaw_deg.iter_mut().for_each(|y| *y = y.to_radians() * per_rad);
        record.measurand = Measurand::linear(Derivative::None, "m");
        let found = identify(&record, &[Method::LeastSquares], &Settings::default()).unwrap();
        assert!((found.window.from_deg / (15f64.to_radians() * per_rad) - 1.0).abs() < 0.1);
        let (_, fit) = fitted(&record, &effect);
        let (wn, of) = (fit.natural_frequency_rad_s(), of_angle.natural_frequency_rad_s());
        assert!((wn.value - of.value).abs() < 0.02 * of.u, "{per_rad}: {wn} and {of}");
        let k3 = fit.effect_parameters()[0].1.value * per_rad * per_rad;
        let of = of_angle.effect_parameters()[0].1;
        println!("{per_rad} per rad: k3 {k3} and {of}");
        assert!((k3 - of.value).abs() < 0.02 * of.u, "{per_rad}: {k3} and {of}");
    }
    // No sine is offered.
    assert!(!Effect::from_id("pendulum_gravity")
        .unwrap()
        .is_seen_in(&Measurand::linear(Derivative::None, "m")));
}

/// What to do about an effect is said in words of the motion it was found in.
#[test]
fn cards_speak_of_the_motion() {
    let wind = ["wind off", "wind on", "the wind", "tunnel", "yaw", "sideslip", "vertical"];
    let rigs = ["springs", "every spring", "another spring"];
    let forbidden = [
        (Called::Pendulum, [&wind[..], &rigs].concat()),
        (Called::Roll, [&wind[..], &rigs].concat()),
        (Called::Displacement, wind.to_vec()),
    ];
    let own = yawrig_core::effects::Effect::Own(
        yawrig_expression::ready_made("first_order_lag").expect("it is there"),
    );
    for (motion, forbidden) in forbidden {
        let measurand = Measurand::default().called(motion);
        for effect in Effect::ALL.into_iter().chain([own.clone()]) {
            let card = effect.card_in(&measurand);
            for said in [card.cause, card.fingerprint, card.confirm, card.remove, card.release] {
                for word in &forbidden {
                    assert!(!said.contains(word), "{motion:?}, {effect}: {said}");
                }
            }
            assert_eq!(card.title, effect.card().title);
        }
    }
    let pendulum = Measurand::default().called(Called::Pendulum);
    assert!(Effect::PendulumGravity.card_in(&pendulum).cause.contains("its weight"));
    // A rig in the wind, by pitch as by yaw.
    let pitch = Measurand::default().called(Called::Pitch);
    assert_eq!(Effect::PendulumGravity.card_in(&pitch), Effect::PendulumGravity.card());
}
