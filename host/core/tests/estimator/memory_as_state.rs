//! Moments that follow another late, as states of a user's own effect: planted by an integration of its own,
//! found again. Every figure asserted is printed:
//! `cargo test --release -p yawrig-core --test estimator memory_as_state -- --nocapture`.

use crate::let_go::let_go;
use std::path::Path;
use std::slice::from_ref;
use std::sync::Arc;
use yawrig_core::diagnosis::diagnose::{diagnose, Grouping, Options, Status};
use yawrig_core::effects::Effect;
use yawrig_core::fit::fitting::{fit_added, fit_plain, held_out_over_noise, Fitted};
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::record::Record;

/// What is followed late, and its unit.
#[derive(Clone, Copy)]
struct Lag {
    follows: &'static str,
    unit: &'static str,
    per: &'static str,
    c: f64,
    lag_s: f64,
}

const OF_ANGLE: Lag = Lag { follows: "b", unit: "rad", per: "1/s2", c: 4.0, lag_s: 0.15 };
const OF_RATE: Lag = Lag { follows: "r", unit: "rad/s", per: "1/s", c: 0.8, lag_s: 0.3 };
const MODAL: [f64; 2] = [7.0, 0.04];

impl Lag {
    fn effect(&self) -> Effect {
        let Self { follows, unit, per, .. } = self;
        let text = format!(
            "id = \"lag\"\ntitle = \"A lag\"\nmoment = \"-c * z\"\n[[state]]\nname = \"z\"\nunit = \"{unit}\"\n\
             rate = \"({follows} - z) / T\"\n[parameters]\nc = {{ unit = \"{per}\", start = 1.0 }}\n\
             T = {{ unit = \"s\", start = 0.1, min = 0.001 }}\n"
        );
        let effect = yawrig_expression::from_text(Path::new("lag.toml"), &text, &[]);
        Effect::Own(Arc::new(effect.unwrap_or_else(|e| panic!("{e}"))))
    }

    /// Let go from this angle.
    fn release(&self, amplitude_deg: f64, seconds: f64, seed: u64) -> Record {
        let [wn, zeta] = MODAL;
        let slope = |[b, r, z]: [f64; 3]| {
            let followed = if self.follows == "b" { b } else { r };
            [r, -wn * wn * b - 2.0 * zeta * wn * r - self.c * z, (followed - z) / self.lag_s]
        };
        let b = amplitude_deg.to_radians();
        let_go([b, 0.0, if self.follows == "b" { b } else { 0.0 }], slope, seconds, seed)
    }
}

/// Of `decay`'s first `share`, with the effect.
fn fitted(lag: &Lag, decay: &FreeDecay, share: f64) -> Fitted {
    let count = (share * decay.yaw_rad.len() as f64) as usize;
    fit_added(decay, &fit_plain(decay, false, count), &lag.effect())
}

/// c and T of eight releases each. They go together with wn and zeta, so that of a release both are inside k = 2
/// or neither: of sixteen three or more outside are expected in 4 % of such tests.
#[test]
fn a_lag_of_angle_and_one_of_rate_are_found_again() {
    let mut outside = 0;
    for lag in [OF_ANGLE, OF_RATE] {
        for seed in 1..=8 {
            let decay =
                FreeDecay::from_record(&lag.release(15.0, 12.0, seed)).expect("a free decay");
            let fit = fitted(&lag, &decay, 1.0);
            let numbers = fit.effect_parameters();
            let off = |k: usize, truth: f64| (numbers[k].1.value - truth) / numbers[k].1.u;
            let far = [off(0, lag.c), off(1, lag.lag_s)];
            let left = fit.over_noise(&decay);
            let two_thirds = fitted(&lag, &decay, 2.0 / 3.0);
            let held_out = held_out_over_noise(&decay, &two_thirds);
            println!(
                "lag of {}, release {seed}: c {:?} T {:?}, off by {far:.2?} u; residual over noise {left:.3}, held out {held_out:.3}",
                lag.follows, numbers[0].1, numbers[1].1,
            );
            // Also where there is no u.
            outside += u32::from(!far.iter().all(|u| u.abs() <= 2.0));
            assert!(left <= 1.05 && held_out <= 1.1, "{left} {held_out}");
        }
    }
    assert!(outside <= 2, "{outside} of 16");
}

/// Lags planted alone and beside another effect, from 12 deg at 7.5 rad/s: named unasked, with their numbers. Those
/// of a release go together, so the lags' sizes are counted: of six two or more are outside k = 2 in 3 % of such
/// tests. The third lag is faint: plain, it leaves 1.6 times the noise, and of ten records of it eight are named.
#[test]
fn a_moment_that_follows_late_is_named_unasked() {
    type Beside = fn(f64, f64) -> f64;
    let none: Beside = |_, _| 0.0;
    let cube: Beside = |b, _| -60.0 * b.powi(3);
    let drag: Beside = |_, r| -0.5 * r * r.abs();
    let mut outside = 0;
    for ([a, rate], beside, name, planted, seed) in [
        ([4.0, 3.0], none, "", 0.0, 31),
        ([2.0, 1.0], none, "", 0.0, 32),
        ([6.0, 8.0], none, "", 0.0, 37),
        ([4.0, 3.0], cube, "cubic_stiffness.k3", 60.0, 34),
        ([2.0, 1.0], cube, "cubic_stiffness.k3", 60.0, 35),
        ([4.0, 3.0], drag, "quadratic_damping.d", 0.5, 36),
    ] {
        let slope = |[b, r, x]: [f64; 3]| {
            [r, -56.25 * b - 2.0 * 0.006 * 7.5 * r - a * x + beside(b, r), r - rate * x]
        };
        let record = let_go([12f64.to_radians(), 0.0, 0.0], slope, 17.0, seed);
        let found = diagnose(from_ref(&record), &Grouping::default(), &Options::default()).unwrap();
        let found = found.diagnosis;
        let last = found.steps.last().expect("a step");
        let names: Vec<&str> = found.effects.iter().map(Effect::id).collect();
        println!("{:?} {names:?} {:.3}", found.status, last.residual_over_noise);
        let mut expected = vec!["first_order_lag"];
        expected.extend(name.split('.').next().filter(|id| !id.is_empty()));
        assert_eq!(found.status, Status::Explained);
        // What is printed of it is of a lag, not of a file that somebody wrote.
        let lag = found.effects.iter().find(|e| e.id() == "first_order_lag").expect("the lag");
        assert!(lag.card().cause.contains("wake"), "{}", lag.card().cause);
        assert!(names.len() == expected.len() && expected.iter().all(|id| names.contains(id)));
        let all = [("first_order_lag.a", a), ("first_order_lag.rate", rate), (name, planted)];
        for (number, truth) in all.into_iter().filter(|(number, _)| !number.is_empty()) {
            let q = last.parameters[number];
            let off = (q.value - truth) / q.u;
            println!("  {number} {:.5} ± {:.5}, off by {off:.2} u", q.value, q.u);
            outside += u32::from(number.ends_with(".a") && off.abs() > 2.0);
        }
    }
    assert!(outside < 2, "{outside} of six");
}

/// Eight releases of a lag that stiffens the rig by a quarter: for a cycle no mode holds its swing. Of eight sizes
/// three or more outside k = 2 are expected in 1 % of such tests.
#[test]
fn a_strong_lag_is_released_where_it_was_let_go() {
    let mut outside = 0;
    for seed in 51..=58 {
        let slope = |[b, r, x]: [f64; 3]| [r, -49.0 * b - 0.084 * r - 13.0 * x, r - x / 0.3];
        let record = let_go([12f64.to_radians(), 0.0, 0.0], slope, 17.0, seed);
        let found = diagnose(from_ref(&record), &Grouping::default(), &Options::default()).unwrap();
        let released_s = FreeDecay::from_record(&record).expect("a free decay").release_time_s;
        let last = found.diagnosis.steps.last().expect("a step");
        let names: Vec<&str> = found.diagnosis.effects.iter().map(Effect::id).collect();
        let q = last.parameters["first_order_lag.a"];
        println!("released at {released_s:.4} s, {names:?}, a {:.3} ± {:.3}", q.value, q.u);
        assert!((released_s - 1.0).abs() < 0.02, "{released_s}");
        assert_eq!(names, ["first_order_lag"]);
        outside += u32::from((q.value - 13.0).abs() > 2.0 * q.u);
    }
    assert!(outside < 3, "{outside} of eight");
}
