//! Against closed forms, with steps and modes of the rig's range.

use super::*;
use crate::motion::{End, Samples, Start};
use crate::{Sensor, LIBRARY};

const WN: f64 = 7.5;

fn modal(damping_ratio: f64) -> Modal {
    Modal { natural_frequency_rad_s: WN, damping_ratio }
}

fn effects(texts: &[&str]) -> Effects {
    Effects::new(texts.iter().map(|text| text.parse().unwrap()).collect()).unwrap()
}

fn trajectory(damping_ratio: f64, texts: &[&str], released_rad: f64) -> Trajectory {
    Trajectory::new(Moments::new(&modal(damping_ratio), &effects(texts)), released_rad, 1)
}

/// Steps of `h` until it has turned `count` times more or ten minutes have passed: the turning points, rad.
fn turning_points(trajectory: &mut Trajectory, h: f64, count: usize) -> Vec<f64> {
    let mut found = Vec::new();
    let mut last = trajectory.turned_at;
    while found.len() < count && trajectory.time_s < 600.0 {
        trajectory.advance(h);
        if last.is_some() && trajectory.turned_at != last {
            found.extend(trajectory.turned_at);
        }
        last = trajectory.turned_at;
    }
    found
}

/// Each half swing is a cosine about +-c / wn^2, so that the amplitude falls by 4 c / wn^2 a cycle, to a
/// standstill at the first turning point within c / wn^2 of the middle.
#[test]
fn friction_alone_takes_4_c_over_wn2_a_cycle_and_sticks_in_its_band() {
    for (c, released) in [(0.12, 0.2), (0.5, 0.2), (0.3, -0.15), (0.7, 0.3)] {
        let band = c / (WN * WN);
        let mut trajectory = trajectory(0.0, &[&format!("coulomb_friction:c={c}")], released);
        let mut expected = vec![];
        let mut turn: f64 = released;
        while turn.abs() > band {
            turn = -turn.signum() * (turn.abs() - 2.0 * band);
            expected.push(turn);
        }
        let found = turning_points(&mut trajectory, 1e-3, expected.len());
        for (found, expected) in found.iter().zip(&expected) {
            assert!((found - expected).abs() < 1e-9, "{c}: {found} is not {expected}");
        }
        assert_eq!(found.len(), expected.len());
        let stopped = trajectory.state;
        assert_eq!(stopped[1], 0.0, "at rest, not slow");
        assert!(stopped[0].abs() <= band);
        // It stays there for good.
        for _ in 0..10_000 {
            trajectory.advance(1e-3);
        }
        assert_eq!(trajectory.state, stopped);
    }
}

#[test]
fn what_the_friction_lets_go_again_starts_when_the_forcing_exceeds_it() {
    // Held at 0 by 0.2 against 0.5 sin(3 t): free at asin(0.4) / 3.
    let texts = ["coulomb_friction:c=0.2", "harmonic_forcing:f=0.5,w=3,phi=-1.5707963267948966"];
    let mut trajectory = trajectory(0.01, &texts, 0.0);
    let freed_s = 0.4f64.asin() / 3.0;
    while trajectory.time_s < freed_s - 1e-3 {
        trajectory.advance(1e-3);
        assert!(trajectory.state.iter().all(|x| *x == 0.0));
    }
    for _ in 0..2 {
        trajectory.advance(1e-3);
    }
    // From there b'' = 0.5 * 3 cos(3 t) (t - t0) to first order: r = 0.75 cos(3 t0) (t - t0)^2.
    let after_s = trajectory.time_s - freed_s;
    let expected = 0.75 * (3.0 * freed_s).cos() * after_s * after_s;
    assert!(
        (trajectory.state[1] / expected - 1.0).abs() < 0.01,
        "{} {expected}",
        trajectory.state[1]
    );
}

/// Whatever only takes energy out: never a step that gains any, at coarse and fine steps.
#[test]
fn friction_drag_and_play_never_gain_energy() {
    for texts in [
        &["coulomb_friction:c=0.12"][..],
        &["quadratic_damping:d=0.8"],
        &["cubic_damping:c=2"],
        &["coulomb_friction:c=0.3", "free_play:g=0.02", "cubic_stiffness:k3=40"],
        &["coulomb_friction:c=0.05", "static_offset:m=0.4", "quadratic_stiffness:k2=30"],
    ] {
        for h in [1e-3, 0.25e-3] {
            let mut trajectory = trajectory(0.002, texts, 0.25);
            let energy =
                |s: &Trajectory| 0.5 * s.state[1] * s.state[1] + s.moments.potential(s.state[0]);
            let first = energy(&trajectory);
            let mut last = first;
            while trajectory.time_s < 30.0 {
                trajectory.advance(h);
                // 1e-13 of the energy at the release: rounding, and the method's own gain of (wn h)^6 / 72.
                assert!(
                    energy(&trajectory) <= last + 1e-13 * first.abs(),
                    "{texts:?} {}",
                    trajectory.time_s
                );
                last = energy(&trajectory);
            }
            assert!(last < 0.9 * first, "{texts:?}");
        }
    }
}

/// Energy balance of b'' + d |r| r + wn^2 b = 0 over a half swing, y = r^2: dy/db = 2 (d y - wn^2 b) for r <
/// 0, so that (1 + 2 d a) exp(-2 d a) is the same at both turning points, +a before and -a after with d's
/// sign.
#[test]
fn drag_obeys_its_amplitude_law() {
    let d = 0.8;
    let mut trajectory = trajectory(0.0, &["quadratic_damping:d=0.8"], 0.3);
    let found = turning_points(&mut trajectory, 1e-3, 20);
    let mut before = 0.3f64;
    for (turn, found) in found.iter().enumerate() {
        let after = found.abs();
        let side = |a: f64| (1.0 + 2.0 * d * a) * (-2.0 * d * a).exp();
        assert!((side(before) - side(-after)).abs() < 1e-10, "{turn}: {before} {after}");
        assert_eq!(found.signum(), if turn % 2 == 0 { -1.0 } else { 1.0 });
        before = after;
    }
    // To first order 1/a grows by 8 d / 3 a cycle; ten cycles from 0.3 rad.
    assert!(((1.0 / before - 1.0 / 0.3) / (10.0 * 8.0 * d / 3.0) - 1.0).abs() < 0.02, "{before}");
}

/// Half a cosine of amplitude a - g at each end and two crossings of 2 g at wn (a - g).
#[test]
fn free_play_lengthens_the_period() {
    let (a, g) = (0.2, 0.03);
    let mut trajectory = trajectory(0.0, &["free_play:g=0.03"], a);
    let expected_s = (2.0 * PI + 4.0 * g / (a - g)) / WN;
    let cycles = 20;
    let mut last = (0.0, a);
    let mut crossings = Vec::new();
    while crossings.len() <= cycles {
        trajectory.advance(1e-3);
        let now = (trajectory.time_s, trajectory.state[0]);
        if last.1 < 0.0 && now.1 >= 0.0 {
            // In the dead zone the rate is constant: the interpolation is exact.
            crossings.push(last.0 - last.1 * (now.0 - last.0) / (now.1 - last.1));
        }
        last = now;
    }
    let found_s = (crossings[cycles] - crossings[0]) / cycles as f64;
    assert!((found_s - expected_s).abs() < 1e-9, "{found_s} is not {expected_s}");
}

/// In the steady state the angle's variance is q / (4 zeta wn^3), whatever the step.
///
/// Its estimate over a time T has the relative spread sqrt(2 / (2 zeta wn T)): 0.0183 for T = 20000 s and
/// zeta = 0.02.
#[test]
fn buffeting_has_its_variance_at_every_step() {
    let (q, zeta, seconds) = (0.02, 0.02, 20_000.0);
    let expected = q / (4.0 * zeta * WN.powi(3));
    let spread = (1.0 / (zeta * WN * seconds)).sqrt();
    for h in [4e-3, 1e-3] {
        let mut trajectory = trajectory(zeta, &["buffeting:q=0.02"], 0.01);
        let (mut sum, mut count) = (0.0, 0.0);
        while trajectory.time_s < seconds {
            trajectory.advance(h);
            if trajectory.time_s > 50.0 {
                sum += trajectory.state[0] * trajectory.state[0];
                count += 1.0;
            }
        }
        let ratio = sum / count / expected;
        println!("step {h} s: variance over q / (4 zeta wn^3) {ratio:.4}, spread {spread:.4}");
        assert!((ratio - 1.0).abs() < 3.0 * spread, "{h}: {ratio}, spread {spread}");
    }
}

/// Far from resonance, once the swing has died, what is left is the response in closed form.
#[test]
fn forcing_leaves_its_steady_response() {
    let (f, w, phi, zeta) = (0.4, 11.0, 0.7, 0.05);
    let mut trajectory = trajectory(zeta, &["harmonic_forcing:f=0.4,w=11,phi=0.7"], 0.1);
    while trajectory.time_s < 120.0 {
        trajectory.advance(0.25e-3);
    }
    let (stiff, damp) = (WN * WN - w * w, 2.0 * zeta * WN * w);
    let expected = f / stiff.hypot(damp) * (w * trajectory.time_s + phi - damp.atan2(stiff)).cos();
    assert!((trajectory.state[0] - expected).abs() < 1e-9, "{} {expected}", trajectory.state[0]);
}

fn record(texts: &[&str], amplitude_deg: f64) -> Vec<f64> {
    let start = Start { amplitude_deg, hold_s: 0.2, end: End::After(10.0) };
    let sensor = Sensor { noise_deg: 0.0, adc_step_deg: 0.0, rate_hz: 200.0, ..Sensor::default() };
    Samples::with_effects(&modal(0.01), &effects(texts), &start, &sensor, 1)
        .unwrap()
        .map(|sample| sample.yaw_deg)
        .collect()
}

#[test]
fn every_effect_shows_and_every_parameter_counts() {
    let plain = record(&[], 12.0);
    for kind in LIBRARY.iter() {
        let text = &format!("{}:{}", kind.id, kind.example);
        let effect: crate::Effect = text.parse().unwrap();
        assert_eq!(effect.id(), kind.id);
        let with = record(&[text], 12.0);
        assert_eq!(with.len(), plain.len());
        let rms = |a: &[f64], b: &[f64]| {
            (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
        };
        assert!(rms(&with, &plain) > 0.1, "{text}: {}", rms(&with, &plain));
        for (parameter, value) in effect.parameters() {
            let other = text.replacen(
                &format!("{}={value}", parameter.name),
                &format!("{}={}", parameter.name, value * 1.2),
                1,
            );
            assert_ne!(other, *text);
            assert!(rms(&record(&[&other], 12.0), &with) > 1e-3, "{other}");
        }
    }
}

/// What treats both sides alike gives the mirrored record from the mirrored release, to the last bit.
#[test]
fn a_mirrored_release_is_the_mirrored_record() {
    let one_sided = |id: &str| {
        let sided = [
            "quadratic_stiffness",
            "static_offset",
            "one_sided_stop",
            "two_stops",
            "damped_stop",
            "damped_stops",
        ];
        let driven = ["harmonic_forcing", "buffeting"];
        let reading = ["second_mode", "sensor_nonlinearity", "baseline_drift"];
        sided.contains(&id) || driven.contains(&id) || reading.contains(&id)
    };
    for kind in LIBRARY.iter().filter(|kind| !one_sided(&kind.id)) {
        let text = format!("{}:{}", kind.id, kind.example);
        let mirrored: Vec<f64> = record(&[&text], -12.0).iter().map(|yaw| -yaw).collect();
        assert_eq!(record(&[&text], 12.0), mirrored, "{text}");
    }
}

/// Fourth order across every corner: half the step, a sixteenth of the error, against a step 32 times finer.
#[test]
fn halving_the_step_divides_the_error_by_sixteen() {
    let texts = [
        "coulomb_friction:c=0.3",
        "free_play:g=0.02",
        "quadratic_damping:d=0.5",
        "harmonic_forcing:f=0.2,w=11,phi=0.5",
    ];
    let end = |steps: u32| {
        let mut trajectory = trajectory(0.01, &texts, 0.3);
        for _ in 0..steps {
            trajectory.advance(4.0 / f64::from(steps));
        }
        trajectory.state[0]
    };
    let exact = end(400 * 32);
    let [coarse, fine, finer] = [400, 800, 1600].map(|steps| (end(steps) - exact).abs());
    println!("{coarse:e} {fine:e} {finer:e}");
    for ratio in [coarse / fine, fine / finer] {
        assert!((12.0..20.0).contains(&ratio), "{ratio}: {coarse:e} {fine:e} {finer:e}");
    }
}

#[test]
fn a_release_that_says_nothing_is_refused() {
    for (texts, words) in [
        (&["coulomb_friction:c=20"][..], "nothing moves"),
        (&["free_play:g=0.5"], "nothing moves"),
        (&["cubic_stiffness:k3=-5000"], "right round"),
        (&["static_offset:m=300"], "right round"),
        (&["harmonic_forcing:f=1,w=7,phi=0"], "harmonic_forcing"),
        (&["second_mode:amplitude=0.01,phase=0,w2=8,zeta2=0.01"], "second_mode"),
        (&["second_mode:amplitude=0.01,phase=0,w2=1,zeta2=0.01"], "second_mode"),
    ] {
        let error = check(&modal(0.01), &effects(texts), 0.2).unwrap_err();
        assert!(error.to_string().contains(words), "{texts:?}: {error}");
    }
}

/// Friction stops the model at 3 deg, play at up to 2: the record ends soon after all the same.
#[test]
fn a_model_at_rest_ends_the_record() {
    for text in ["coulomb_friction:c=3", "free_play:g=0.04"] {
        let start = Start { amplitude_deg: 12.0, ..Start::default() };
        let sensor = Sensor { rate_hz: 100.0, ..Sensor::default() };
        let samples = Samples::with_effects(&modal(0.01), &effects(&[text]), &start, &sensor, 1);
        let seconds = samples.unwrap().count() as f64 / 100.0;
        println!("{text}: {seconds} s");
        assert!((3.0..400.0).contains(&seconds), "{text}: {seconds}");
    }
}

/// Driven for ever: over when the swing would have died without; with no damping, after a minute.
#[test]
fn a_driven_model_ends_the_record() {
    for (text, damping_ratio, expected_s) in [
        ("buffeting:q=0.1", 0.01, 1.0 + (12f64 / 0.8).ln() / (0.01 * WN)),
        ("harmonic_forcing:f=5,w=11,phi=0", 0.01, 1.0 + (12f64 / 0.8).ln() / (0.01 * WN)),
        ("buffeting:q=0.1", 0.0, 61.0),
    ] {
        let (modal, effects) = (modal(damping_ratio), effects(&[text]));
        let start = Start { amplitude_deg: 12.0, hold_s: 1.0, ..Start::default() };
        let sensor = Sensor { rate_hz: 100.0, ..Sensor::default() };
        let start = start.limited(&modal, &effects);
        let samples = Samples::with_effects(&modal, &effects, &start, &sensor, 1).unwrap();
        let last_s = samples.last().unwrap().time_s;
        assert!((last_s - expected_s).abs() <= 0.01, "{text}: {last_s} is not {expected_s}");
    }
}
