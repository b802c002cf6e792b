use super::*;
use crate::effects::{Effect, Terms};
use crate::fit::fitting::Structure;
use crate::fit::free_decay::Around;
use std::f64::consts::TAU;

const WN: f64 = 7.0;
const AMPLITUDE: f64 = 0.2;

fn released(damping_ratio: f64, terms: Terms) -> Motion {
    Motion {
        natural_frequency_rad_s: WN,
        damping_ratio,
        yaw_rad: AMPLITUDE,
        rate_rad_s: 0.0,
        terms,
    }
}

fn grid(step_s: f64, count: usize) -> Grid {
    Grid { start_s: 0.0, step_s, count, mean_width_s: 0.0 }
}

/// Half the step, a quarter of the error.
#[test]
fn the_error_falls_with_the_square_of_the_step() {
    let terms = Terms::new([
        (Effect::QuadraticDamping, &[0.3][..]),
        (Effect::CubicStiffness, &[80.0]),
        (Effect::QuadraticStiffness, &[20.0]),
        (Effect::StiffnessDrift, &[0.01]),
    ]);
    let motion = released(0.01, terms);
    let cycle = TAU / WN;
    let at_end = |per_cycle: usize| {
        let grid = grid(cycle / per_cycle as f64, 8 * per_cycle + 1);
        *motion.readings(&grid).last().unwrap()
    };
    let truth = at_end(50 * 64);
    let errors = [50, 100, 200].map(|n| (at_end(n) - truth).abs());
    for pair in errors.windows(2) {
        let ratio = pair[0] / pair[1];
        assert!((3.5..4.5).contains(&ratio), "{errors:?}");
    }
    assert!(errors[0] < 1e-3 * AMPLITUDE, "{errors:?}");
}

/// Strang's splitting keeps the energy of an undamped swing but for a ripple within the cycle.
#[test]
fn energy_is_kept_over_a_hundred_cycles() {
    let k3 = 200.0;
    let motion = released(0.0, Terms::new([(Effect::CubicStiffness, &[k3][..])]));
    let (b, r) = motion.readings_and_rates(&grid(TAU / WN / 48.0, 4800));
    let energy = |b: f64, r: f64| 0.5 * (r * r + WN * WN * b * b) + 0.25 * k3 * b.powi(4);
    let first = energy(b[0], r[0]);
    for k in 0..b.len() {
        assert!((energy(b[k], r[k]) / first - 1.0).abs() < 1e-3, "at {k}");
    }
}

/// Between two turning points friction shifts the middle by c/wn2: each half cycle takes 2 c/wn2, until a
/// turning point lies within c/wn2 of zero.
#[test]
fn dry_friction_stops_the_swing_where_the_closed_form_does() {
    let c = 0.37;
    let shift = c / (WN * WN);
    let motion = released(0.0, Terms::new([(Effect::CoulombFriction, &[c][..])]));
    let mut rest = AMPLITUDE;
    let mut halves = 0;
    while rest.abs() > shift {
        rest = -(rest.abs() - 2.0 * shift) * rest.signum();
        halves += 1;
    }
    let y = motion.readings(&grid(TAU / WN / 50.0, 25 * (halves + 4)));
    assert!((y.last().unwrap() - rest).abs() < 1e-9, "{} {rest}", y.last().unwrap());
    // It is still moving half a cycle before, at the turning point before the last.
    let before = y[25 * (halves - 1)];
    assert!((before.abs() - (rest.abs() + 2.0 * shift)).abs() < 1e-9 || rest.abs() < shift);
}

/// Sine arcs beyond the gap, straight lines through it: a period longer by the four times the half gap's
/// crossing.
#[test]
fn free_play_has_the_period_of_the_piecewise_solution() {
    let g = 0.03;
    let motion = released(0.0, Terms::new([(Effect::FreePlay, &[g][..])]));
    let period = TAU / WN + 4.0 * g / (WN * (AMPLITUDE - g));
    let y = motion.readings(&grid(period / 64.0, 64 * 10 + 1));
    for cycle in 0..=10 {
        assert!((y[64 * cycle] - AMPLITUDE).abs() < 1e-9, "cycle {cycle}: {}", y[64 * cycle]);
    }
    // An eighth of the way: the arc about the gap's edge.
    let arc = g + (AMPLITUDE - g) * (WN * period / 8.0).cos();
    assert!((y[8] - arc).abs() < 1e-9);
}

/// Fewer than four among them, one with friction among others without, and all with so much of it that they
/// stick.
#[test]
fn motions_followed_together_are_those_followed_alone() {
    let followed = |frictions: &[f64], force_rad_s2: f64| {
        let motion = |(i, friction): (usize, &f64)| {
            let terms = Terms::new([
                (Effect::CubicDamping, &[0.5 * i as f64][..]),
                (Effect::HarmonicForcing, &[force_rad_s2, 11.0, 0.4]),
                (Effect::StaticOffset, &[0.2]),
                (Effect::SecondMode, &[0.01, 0.0, 20.0, 0.01]),
                (Effect::CoulombFriction, &[*friction]),
            ]);
            released(0.01, terms)
        };
        let all: Vec<Motion> = frictions.iter().enumerate().map(motion).collect();
        let grid = Grid { start_s: 0.3, step_s: TAU / WN / 50.0, count: 600, mean_width_s: 0.01 };
        let together = readings_of_all(&all, &grid);
        for (motion, together) in all.iter().zip(&together) {
            let alone = motion.readings(&grid);
            for (a, b) in alone.iter().zip(together) {
                assert!((a - b).abs() < 1e-12);
            }
        }
        let sticks = |m: &&Motion| {
            let (_, rates) = m.readings_and_rates(&grid);
            rates[590..].iter().all(|r| *r == 0.0)
        };
        all.iter().filter(sticks).count()
    };
    assert_eq!(followed(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.05, 0.0], 0.3), 0);
    assert_eq!(followed(&[0.05, 0.06, 0.04, 0.05, 0.05, 0.05], 0.3), 0);
    assert_eq!(followed(&[0.5, 0.6, 0.4, 0.5, 0.5, 0.55, 0.5, 0.5, 0.5], 0.0), 9);
}

/// A spring that yields takes the area of its loop out of the energy.
#[test]
fn hysteresis_takes_its_loop_out_of_the_energy() {
    let (h, y) = (1.0, 0.002);
    let motion = released(0.0, Terms::new([(Effect::Hysteresis, &[h, y][..])]));
    let half = grid(0.5 * TAU / (WN * 400.0), 401 + 40);
    let (b, r) = motion.readings_and_rates(&half);
    let turn = r.windows(2).position(|r| r[0] < 0.0 && r[1] >= 0.0).expect("a turn");
    let energy = |b: f64, r: f64| 0.5 * (WN * WN * b * b + r * r);
    let lost = energy(AMPLITUDE, 0.0) - energy(b[turn], r[turn]);
    // From yielding one way to yielding the other; at a hundred yield angles nothing is left to come.
    let path = AMPLITUDE - b[turn];
    let expected = h * y * (path - 2.0 * y);
    assert!((lost / expected - 1.0).abs() < 1e-3, "{lost} {expected}");
}

/// Pieces of a swing that begin in its middle follow the same motion as the whole.
#[test]
fn a_piece_of_a_hysteretic_swing_is_the_swing() {
    let motion = released(0.002, Terms::new([(Effect::Hysteresis, &[2.0, 0.08][..])]));
    let whole = grid(TAU / WN / 50.0, 1000);
    let (b, r) = motion.readings_and_rates(&whole);
    let from = 320;
    let piece = Motion { yaw_rad: b[from], rate_rad_s: r[from], ..motion.clone() };
    let later = Grid { start_s: whole.time_s(from), count: 300, ..whole };
    let (again, _) = piece.readings_and_rates(&later);
    let error = again.iter().zip(&b[from..]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let plain = Motion { terms: Terms::default(), ..piece };
    let (without, _) = plain.readings_and_rates(&later);
    let effect = without.iter().zip(&b[from..]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(error < 0.05 * effect, "{error} of {effect}");
}

/// The splitting's error is the effect's, a step's phase; steps that adapt themselves have none to speak of.
#[test]
fn a_precise_motion_is_that_of_a_hundred_times_finer_steps() {
    for (effect, size) in [
        (Effect::CubicStiffness, 60.0),
        (Effect::QuadraticDamping, 0.5),
        (Effect::CoulombFriction, 0.05),
    ] {
        let grid = Grid { start_s: 0.0, step_s: TAU / 7.0 / 50.0, count: 2000, mean_width_s: 0.0 };
        let of = |grid: &Grid, precise: bool| {
            let mut terms = Terms::new([(effect.clone(), &[size][..])]);
            terms.precise = precise;
            Motion { yaw_rad: 0.17, ..released(0.003, terms) }.readings(grid)
        };
        let fine = Grid { step_s: grid.step_s / 100.0, count: 100 * grid.count, ..grid };
        let fine: Vec<f64> = of(&fine, false).into_iter().step_by(100).collect();
        let worst = |y: Vec<f64>| {
            y.iter().zip(&fine).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / 0.17
        };
        let [split, precise] = [false, true].map(|precise| worst(of(&grid, precise)));
        println!("{effect}: split {split:.1e}, precise {precise:.1e} of the amplitude");
        assert!(precise < 2e-8 && split < 1e-3, "{effect}: {split:e} {precise:e}");
    }
}

/// Differences by a number are those of the motions: they take the same steps.
#[test]
fn a_steep_own_effect_changes_smoothly_with_its_number() {
    let text = "id = \"steep\"\ntitle = \"Steep\"\nmoment = \"-c * tanh(r / 0.002)\"\n\
        [parameters]\nc = { unit = \"rad/s2\", start = 0.05, min = 0.0 }\n";
    let own = yawrig_expression::from_text("steep.toml".as_ref(), text, &[]).expect("valid");
    let effect = Effect::Own(std::sync::Arc::new(own));
    let grid = grid(TAU / WN / 50.0, 400);
    let largest = |of: &dyn Fn(usize) -> f64| (0..grid.count).map(of).fold(0.0, f64::max);
    let bend = |y: &[Vec<f64>]| largest(&|k| (y[0][k] - 2.0 * y[1][k] + y[2][k]).abs());
    let (mut bend_together, mut bend_alone) = (0.0, 0.0);
    for i in 0..40 {
        let c = 0.03 + 0.001 * f64::from(i);
        let at = |k: f64| released(0.005, Terms::new([(effect.clone(), &[c + k * 4.5e-5][..])]));
        let motions = [0.0, 1.0, 2.0].map(at);
        let together = readings_of_all(&motions, &grid);
        let alone: Vec<Vec<f64>> = motions.iter().map(|m| m.readings(&grid)).collect();
        let slope = largest(&|k| (together[1][k] - together[0][k]).abs());
        let apart = largest(&|k| (together[2][k] - alone[2][k]).abs());
        assert!(apart < 1e-6 * AMPLITUDE, "{apart}");
        bend_together = f64::max(bend_together, bend(&together) / slope);
        bend_alone = f64::max(bend_alone, bend(&alone) / slope);
    }
    assert!(bend_together < 2e-3, "{bend_together}");
    assert!(bend_together < 0.1 * bend_alone, "{bend_together} {bend_alone}");
}

/// Means over a block are those of the motion sampled a hundred times as often, under gravity at large angles
/// as well.
#[test]
fn means_over_a_width_are_those_of_the_samples_in_it() {
    const FINE: usize = 100;
    let mut terms = Terms::new([(Effect::PendulumGravity, &[WN * WN][..])]);
    terms.precise = true;
    let motion = Motion { yaw_rad: 1.0, ..released(0.01, terms) };
    let width_s = TAU / WN / 50.0;
    let fine = grid(width_s / FINE as f64, 300 * FINE);
    let (yaw_rad, rate_rad_s) = motion.readings_and_rates(&fine);
    // From the middle of the first on.
    let begun = Motion { yaw_rad: yaw_rad[FINE / 2], rate_rad_s: rate_rad_s[FINE / 2], ..motion };
    let means = begun.readings(&Grid { mean_width_s: width_s, ..grid(width_s, 299) });
    for (k, mean) in means.iter().enumerate() {
        let samples = &yaw_rad[k * FINE..=(k + 1) * FINE];
        let ends = 0.5 * (samples[0] + samples[FINE]);
        let truth = (samples[1..FINE].iter().sum::<f64>() + ends) / FINE as f64;
        assert!((mean - truth).abs() < 2e-5, "{k}: {mean} {truth}");
    }
}

/// Where a periodic moment is far above dry friction and the spring's moment below both, no turn is a stop:
/// whether the model is held is a matter of all moments together. At fifty times as many steps it moves the
/// same, and it follows small changes of its numbers.
#[test]
fn what_drives_it_beyond_dry_friction_lets_it_not_stick() {
    let (count, fine) = (1500, 50);
    let of = |c: f64, frequency_rad_s: f64, steps: usize| {
        let effects = [
            (Effect::CoulombFriction, &[c][..]),
            (Effect::HarmonicForcing, &[19.0, frequency_rad_s, 1.2]),
        ];
        let motion =
            Motion { natural_frequency_rad_s: 20.0, ..released(0.017, Terms::new(effects)) };
        let fine = motion.readings(&grid(0.006 / steps as f64, count * steps));
        fine.into_iter().step_by(steps).collect::<Vec<f64>>()
    };
    let apart = |a: &[f64], b: &[f64]| {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / AMPLITUDE
    };
    let mut most = [0.0f64; 2];
    for k in 0..40 {
        let frequency_rad_s = 55.0 + 0.01 * f64::from(k);
        let moved = of(0.5, frequency_rad_s, 1);
        most[0] = most[0].max(apart(&moved, &of(0.5, frequency_rad_s, fine)));
        most[1] = most[1].max(apart(&moved, &of(0.5, frequency_rad_s + 1e-6, 1)));
    }
    println!("of the amplitude {most:?}");
    assert!(most[0] < 5e-3 && most[1] < 1e-4, "{most:?}");
}

/// What is smooth is not constant over a step in which the model turns.
#[test]
fn turning_beside_what_is_smooth_errs_no_more_than_a_kick() {
    let (count, fine) = (1500, 50);
    for beside in [(Effect::CubicStiffness, &[30.0][..]), (Effect::QuadraticDamping, &[0.5])] {
        let effects = [(Effect::CoulombFriction, &[0.02][..]), beside.clone()];
        let motion = released(0.01, Terms::new(effects));
        let of = |steps: usize| {
            let fine = motion.readings(&grid(TAU / WN / 48.0 / steps as f64, count * steps));
            fine.into_iter().step_by(steps).collect::<Vec<f64>>()
        };
        let apart = of(1).iter().zip(of(fine)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("{}: {:.1e} of the amplitude", beside.0, apart / AMPLITUDE);
        assert!(apart < 5e-5 * AMPLITUDE, "{}: {apart}", beside.0);
    }
}

/// What drives it turns within a step of where the model leaves its rest, at 19.13 s.
#[test]
fn a_model_that_leaves_its_rest_and_comes_back_within_a_step_goes_on() {
    let effects = vec![Effect::HarmonicForcing, Effect::CoulombFriction];
    let structure = Structure { effects, ..Structure::default() };
    let modal = [7.599854483010372, 0.027871124018427132, -0.34246924598467515, 0.5157363216163653];
    let forcing = [0.2994525004802462, -0.2713336076572081, 17.261910125882867];
    let p = [&modal[..], &forcing, &[0.003389976232617813]].concat();
    let [quick, precise] = [structure.clone(), structure.precisely()]
        .map(|structure| structure.motion(&p, Around::default()).0);
    let mut most = 0.0f64;
    for start in 0..40 {
        let start_s = 0.0245 + 1e-4 * f64::from(start);
        let grid = Grid { start_s, step_s: 0.016, count: 1300, mean_width_s: 0.016 };
        let [quick, precise] = [&quick, &precise].map(|motion| motion.readings(&grid));
        assert!(precise.iter().all(|y| y.is_finite()), "begun at {start_s} s");
        most = quick.iter().zip(&precise).map(|(a, b)| (a - b).abs()).fold(most, f64::max);
    }
    println!("at most {most:.1e} rad apart");
    assert!(most < 1e-4);
}
