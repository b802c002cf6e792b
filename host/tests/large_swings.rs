//! Swings as they are measured: large angles, a rest off the sensor's zero, steps of a coarse sensor, and more than one
//! loss at once. The truth is integrated by Runge-Kutta steps of its own, friction as a sign.

use yawrig_core::diagnosis::diagnose::{diagnose, Options, Status};
use yawrig_core::effects::Effect;
use yawrig_core::record::Record;

const WN: f64 = 5.5;
const FRICTION: f64 = 0.15;
const DRAG: f64 = 0.02;
const ZETA: f64 = 0.001;
const REST_DEG: f64 = 3.0;

/// A pendulum let go at `release_deg`, read in steps of `step_deg` at 150 Hz until it rests.
fn pendulum(release_deg: f64, step_deg: f64) -> Record {
    let moment = |b: f64, r: f64| {
        -WN * WN * b.sin() - 2.0 * ZETA * WN * r - DRAG * r.abs() * r - FRICTION * r.signum()
    };
    let h = 1.0 / 150.0 / 40.0;
    let (mut b, mut r) = (release_deg.to_radians(), 0.0_f64);
    let (mut time_s, mut yaw_deg) = (Vec::new(), Vec::new());
    for k in 0..6000 {
        time_s.push(f64::from(k) / 150.0);
        yaw_deg.push(((b.to_degrees() + REST_DEG) / step_deg).round() * step_deg);
        for _ in 0..40 {
            let at = |s: (f64, f64), w: f64| (b + w * s.0, r + w * s.1);
            let f = |(b, r): (f64, f64)| (r, moment(b, r));
            let k1 = f((b, r));
            let k2 = f(at(k1, 0.5 * h));
            let k3 = f(at(k2, 0.5 * h));
            let k4 = f(at(k3, h));
            b += h / 6.0 * (k1.0 + 2.0 * k2.0 + 2.0 * k3.0 + k4.0);
            r += h / 6.0 * (k1.1 + 2.0 * k2.1 + 2.0 * k3.1 + k4.1);
        }
        if b.abs() < 4f64.to_radians() && r.abs() < 4f64.to_radians() * WN {
            break;
        }
    }
    Record { file: "pendulum.csv".into(), time_s, yaw_deg }
}

#[test]
fn a_pendulum_from_120_deg_is_taken_apart() {
    let found = diagnose(&pendulum(120.0, 0.18), &Options::default()).expect("a swing");
    println!("{:?} {:?} {:?}", found.status, found.effects, found.sentence);
    for effect in [Effect::PendulumGravity, Effect::CoulombFriction, Effect::QuadraticDamping] {
        assert!(found.effects.contains(&effect), "{effect}");
    }
    assert!(matches!(found.status, Status::Explained | Status::MostlyExplained));
    let last = found.steps.last().expect("a step");
    let near = |name: &str, truth: f64, share: f64| {
        let value = last.parameters[name].value;
        assert!((value / truth - 1.0).abs() < share, "{name}: {value} for {truth}");
    };
    near("coulomb_friction.c", FRICTION, 0.05);
    near("quadratic_damping.d", DRAG, 0.1);
    near("pendulum_gravity.g", WN * WN, 0.02);
    let wn = found.modal.natural_frequency_rad_s.value;
    assert!((wn / WN - 1.0).abs() < 2e-3, "{wn}");
    let rest = found.rest_angle_deg.expect("a rest angle").value;
    assert!((rest - REST_DEG).abs() < 0.05, "{rest}");
    let held: Vec<f64> = found.steps.iter().map(|s| s.held_out_over_noise).collect();
    println!("held out over noise {held:.3?}");
    assert!(held.windows(2).all(|h| h[1] <= h[0]));
}
