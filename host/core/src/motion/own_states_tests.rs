use super::*;
use crate::effects::{Effect, Terms};
use crate::motion::runge_kutta::stepped;
use crate::motion::simulate::Grid;
use std::sync::Arc;

fn own(states: &str, moment: &str) -> Effect {
    let text = format!(
        "id = \"late\"\ntitle = \"Late\"\nmoment = \"{moment}\"\n{states}\n[parameters]\n\
         c = {{ unit = \"1/s2\", start = 3.0 }}\nT = {{ unit = \"s\", start = 0.2, min = 0.001 }}\n"
    );
    let effect = yawrig_expression::from_text("late.toml".as_ref(), &text, &[]);
    Effect::Own(Arc::new(effect.unwrap_or_else(|e| panic!("{e}"))))
}

const LAG: &str = "[[state]]\nname = \"z\"\nunit = \"rad\"\nrate = \"(b - z) / T\"";
/// Its speed is limited by tanh, and it comes in two steps.
const TWO: &str = "[[state]]\nname = \"y\"\nunit = \"rad\"\nrate = \"0.3 * tanh((b - y) / 0.3) / T\"\n\
                   [[state]]\nname = \"z\"\nunit = \"rad\"\nrate = \"(y - z) / T\"\nstart = \"0.5 * b\"";

fn motion(effects: &[(Effect, &[f64])]) -> Motion {
    Motion {
        natural_frequency_rad_s: 7.0,
        damping_ratio: 0.05,
        yaw_rad: 0.2,
        rate_rad_s: 0.0,
        terms: Terms::new(effects.iter().cloned()),
    }
}

/// The state at `step_s` times each.
fn integrated(motion: &Motion, step_s: f64, count: usize) -> Vec<Vec<f64>> {
    let mut state = motion.state(0.0);
    let mut out = Vec::new();
    for k in 0..count {
        out.push(state.clone());
        stepped(motion, k as f64 * step_s, step_s, &mut state);
    }
    out
}

/// Beside effects with corners, too: to the steps of the comparison, which run over them.
#[test]
fn states_go_with_the_motion() {
    let numbers: &[f64] = &[3.0, 0.2];
    let friction = (Effect::CoulombFriction, &[0.05][..]);
    for (effects, most) in [
        (vec![(own(LAG, "-c * z"), numbers)], 1e-8),
        (vec![(own(TWO, "-c * z"), numbers)], 1e-8),
        (vec![(own(TWO, "-c * z"), numbers), friction, (Effect::Hysteresis, &[2.0, 0.05])], 1e-4),
    ] {
        let motion = motion(&effects);
        let grid = Grid { start_s: 0.0, step_s: 1e-3, count: 6000, mean_width_s: 0.0 };
        let readings = motion.readings(&grid);
        let off = integrated(&motion, 1e-3, 6000)
            .iter()
            .zip(&readings)
            .fold(0.0, |off: f64, (state, y)| off.max((state[0] - y).abs()));
        println!("{} effects: off by {off:.1e} rad", effects.len());
        assert!(off < most * 0.2, "{off}");
    }
}

/// Frequency and damping that are seen, of a model with a lag: the model's own come back from them, and
/// those of one with another lag that has them, too.
#[test]
fn models_of_the_same_slow_motion_swing_alike() {
    let lag = |c: f64, t: f64| motion(&[(own(LAG, "-c * z"), &[c, t])]);
    let first = lag(3.0, 0.2);
    let slow = first.slow_slopes().unwrap();
    let [wn, zeta] = first.of_slow_slopes(slow).unwrap();
    assert!((wn - 7.0).abs() < 1e-9 && (zeta - 0.05).abs() < 1e-10, "{wn} {zeta}");
    let mut other = lag(5.0, 0.2);
    [other.natural_frequency_rad_s, other.damping_ratio] = other.of_slow_slopes(slow).unwrap();
    assert!((other.natural_frequency_rad_s - 7.0).abs() > 0.01);
    let again = other.slow_slopes().unwrap();
    assert!(again.iter().zip(slow).all(|(a, b)| (a - b).abs() < 1e-9 * b.abs()));
    assert!(motion(&[]).slow_slopes().is_none());
}

/// Where the motion begins later on, its states are those it has where they are linear, and about those where not;
/// within a cycle of the release exactly.
#[test]
fn a_motion_that_begins_later_on_has_its_states() {
    for (states, most) in [(LAG, 1e-10), (TWO, 0.03)] {
        let motion = motion(&[(own(states, "-c * z"), &[3.0, 0.2])]);
        let all = integrated(&motion, 1e-3, 9000);
        for (k, most) in
            [(0, 1e-12), (40, 1e-7), (700, 1e-7), (6000, most), (6100, most), (8300, most)]
        {
            let [yaw_rad, rate_rad_s] = [all[k][0], all[k][1]];
            let there = Motion { yaw_rad, rate_rad_s, ..motion.clone() };
            let found = there.own_states(k as f64 * 1e-3);
            let amplitude = yaw_rad.hypot(rate_rad_s / 7.0);
            let off = all[k][2..].iter().zip(&found).map(|(z, found)| (z - found).abs());
            let off = off.fold(0.0, f64::max) / amplitude;
            println!("{k} ms from the release: off by {off:.1e} of the amplitude");
            assert!(off <= most, "{k}: {off} {found:?} {:?}", &all[k][2..]);
        }
    }
}

/// Held by friction at the end, the states go on until they let it go or rest.
#[test]
fn states_go_on_while_friction_holds_the_model() {
    let effects = [(own(LAG, "c * (z - b)"), &[10.0, 0.5][..]), (Effect::CoulombFriction, &[0.9])];
    let motion = Motion { damping_ratio: 0.3, yaw_rad: 0.1, ..motion(&effects) };
    let grid = Grid { start_s: 0.0, step_s: 0.01, count: 800, mean_width_s: 0.0 };
    let (readings, rates) = motion.readings_and_rates(&grid);
    let (by_steps, all) = (integrated(&motion, 1e-4, 80_000), readings.len());
    let off = (0..all).fold(0.0, |off: f64, k| off.max((by_steps[100 * k][0] - readings[k]).abs()));
    println!(
        "off by {off:.1e} rad, held in {} of {all}",
        rates.iter().filter(|r| **r == 0.0).count()
    );
    assert!(off < 3e-4 && rates[all - 1] == 0.0, "{off}");
}

/// Linear states by fixed steps: to the error of the splitting, which is that of the moment, beside friction too.
#[test]
fn linear_states_are_followed_by_fixed_steps() {
    let lag = || (own(LAG, "-c * z"), &[3.0, 0.2][..]);
    let friction = (Effect::CoulombFriction, &[0.05][..]);
    let cubic = (Effect::CubicStiffness, &[30.0][..]);
    for effects in [vec![lag()], vec![lag(), friction.clone()], vec![lag(), cubic, friction]] {
        let precise = motion(&effects);
        let mut swift = precise.clone();
        swift.terms.swift = true;
        for start_s in [0.0, 9.0] {
            let grid = Grid { start_s, step_s: 0.018, count: 700, mean_width_s: 0.0 };
            let without = motion(&effects[1..]).readings(&grid);
            let all = precise.readings(&grid).into_iter().zip(swift.readings(&grid)).zip(without);
            let (off, acts) = all.fold((0.0f64, 0.0f64), |(off, acts), ((a, b), without)| {
                (off.max((a - b).abs()), acts.max((a - without).abs()))
            });
            println!(
                "{} effects from {start_s} s: off by {off:.1e} of {acts:.1e} rad",
                effects.len()
            );
            assert!(off < 2e-3 * acts, "{off} of {acts}");
        }
    }
}

/// Beside friction, or about a rest angle on a curved spring, linear states that begin later on are those of the way
/// there; beside a spring that changes the frequency by a quarter no way is found, and they are those of the plain
/// model, which is off by about as much.
#[test]
fn linear_states_begin_later_on_beside_what_bends() {
    let lag = || (own(LAG, "-c * z"), &[3.0, 0.2][..]);
    let about = [(Effect::StaticOffset, &[2.0][..]), (Effect::QuadraticStiffness, &[60.0])];
    for (beside, most) in [
        (vec![(Effect::CoulombFriction, &[0.05][..])], 1e-4),
        (about.to_vec(), 3e-3),
        (vec![(Effect::CubicStiffness, &[300.0])], 0.25),
    ] {
        let effects: Vec<_> = std::iter::once(lag()).chain(beside).collect();
        let motion = Motion { damping_ratio: 0.005, ..motion(&effects) };
        let all = integrated(&motion, 1e-3, 8500);
        for k in [4000, 4100, 6000, 6250, 8300] {
            let [yaw_rad, rate_rad_s] = [all[k][0], all[k][1]];
            let there = Motion { yaw_rad, rate_rad_s, ..motion.clone() };
            let found = there.own_states(k as f64 * 1e-3);
            let off = (all[k][2] - found[0]).abs() / yaw_rad.hypot(rate_rad_s / 7.0);
            println!("{} effects, {k} ms: off by {off:.1e} of the amplitude", effects.len());
            assert!(off <= most, "{off}");
        }
    }
}
