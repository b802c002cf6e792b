//! What is done to the model.

use crate::case::{case, Case, Must};
use crate::faults::{motion, Given, Signal, HOLD_S, OFFSET_DEG};
use std::f64::consts::PI;
use yawrig_rig::{Effects, End, Samples, Sensor, Start};
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::Flags;

pub fn cases() -> Vec<Case> {
    [moments(), hands()].into_iter().flatten().collect()
}

fn moments() -> Vec<Case> {
    vec![
        case(
            "touched in mid-decay",
            Must::Either,
            &[Flags::DISTURBED],
            &[
                ("2 % of the amplitude", 0.02),
                ("10 % of the amplitude", 0.1),
                ("50 % of the amplitude", 0.5),
                ("200 % of the amplitude", 2.0),
            ],
            |truth, seed, share| {
                let mut signal = Signal::new(truth, seed);
                let at = signal.any_moment();
                // A push of 30 ms that leaves an oscillation of this share.
                let side = if seed % 2 == 0 { 1.0 } else { -1.0 };
                let height =
                    share * signal.amplitude_deg(at) / (0.02 * truth.natural_frequency_rad_s);
                signal.push(at, |k| {
                    (k < 30).then(|| side * height * (PI * (k as f64 + 0.5) / 30.0).sin())
                });
                signal.given()
            },
        ),
        case(
            "gust",
            Must::Either,
            &[Flags::DISTURBED],
            &[
                ("0.05 deg for 0.5 s", 0.05),
                ("0.3 deg for 0.5 s", 0.3),
                ("1 deg for 0.5 s", 1.0),
                ("3 deg for 0.5 s", 3.0),
            ],
            |truth, seed, height_deg| gust(truth, seed, height_deg, 500),
        ),
        case(
            "gust",
            Must::Either,
            // One that finds the model at rest again is the beginning of what it then measures.
            &[Flags::DISTURBED, Flags::MID_SWING],
            &[("0.1 deg for 3 s", 0.1), ("1 deg for 3 s", 1.0), ("5 deg for 3 s", 5.0)],
            |truth, seed, height_deg| gust(truth, seed, height_deg, 3000),
        ),
        Case {
            within_its_own_u: true,
            ..case(
                "turbulent wind",
                Must::Either,
                &[Flags::DISTURBED],
                &[("swings by 0.1 deg", 0.1), ("by 0.5 deg", 0.5), ("by 2 deg", 2.0)],
                turbulence,
            )
        },
    ]
}

fn hands() -> Vec<Case> {
    vec![
        case(
            "second release while running",
            Must::Either,
            &[Flags::DISTURBED, Flags::CUT_SHORT, Flags::MID_SWING],
            &[("held for 0.1 s", 0.1), ("held for 0.5 s", 0.5), ("held for 1 s", 1.0)],
            second_release,
        ),
        Case {
            least_releases: 2,
            ..case(
                "second release while running",
                Must::Either,
                &[Flags::DISTURBED, Flags::CUT_SHORT],
                &[("held for 2 s", 2.0)],
                second_release,
            )
        },
        case(
            "caught by hand",
            Must::Either,
            &[Flags::DISTURBED, Flags::CUT_SHORT],
            &[("at 10 deg within 0.2 s", 0.2)],
            |truth, seed, within_s| {
                let mut signal = Signal::new(truth, seed);
                let at = signal.any_moment();
                let within = (within_s * 1000.0) as usize;
                let from = signal.yaw_deg[at];
                signal.yaw_deg.truncate(at);
                signal.yaw_deg.extend((0..within).map(|k| eased(from, 10.0, k, within)));
                signal.yaw_deg.extend(std::iter::repeat_n(10.0, 4000));
                signal.given()
            },
        ),
    ]
}

fn gust(truth: Modal, seed: u64, height_deg: f64, length: usize) -> Vec<Given> {
    let mut signal = Signal::new(truth, seed);
    let at = signal.any_moment();
    // A value every 10 ms is smooth enough, and each costs a response.
    signal.push(at, |k| {
        let k = k - k % 10;
        (k < length).then(|| height_deg * (PI * k as f64 / length as f64).sin().powi(2))
    });
    signal.given()
}

/// Buffeting that alone would make the model swing by this rms.
fn turbulence(truth: Modal, seed: u64, rms_deg: f64) -> Vec<Given> {
    // White moment of intensity q: <b2> = q / (4 zeta wn^3).
    let wn = truth.natural_frequency_rad_s;
    let q = rms_deg.to_radians().powi(2) * 4.0 * truth.damping_ratio * wn.powi(3);
    let effect = format!("buffeting:q={q}").parse().expect("an effect");
    let effects = Effects::new(vec![effect]).expect("one effect");
    let seconds = HOLD_S + 15.0_f64.ln() / truth.decay_rate_per_s();
    let start = Start { amplitude_deg: 15.0, hold_s: HOLD_S, end: End::After(seconds) };
    let sensor = Sensor { offset_deg: OFFSET_DEG, ..Sensor::default() };
    let samples =
        Samples::with_effects(&truth, &effects, &start, &sensor, seed).expect("a release");
    samples.filter_map(|s| s.counts).map(Given::Counts).collect()
}

fn eased(from: f64, to: f64, k: usize, within: usize) -> f64 {
    let share = 0.5 - 0.5 * (PI * k as f64 / within as f64).cos();
    from + share * (to - from)
}

fn second_release(truth: Modal, seed: u64, held_s: f64) -> Vec<Given> {
    let mut signal = Signal::new(truth, seed);
    let at = signal.any_moment();
    let from = signal.yaw_deg[at];
    signal.yaw_deg.truncate(at);
    // Taken to 12 deg within 0.3 s, held there, let go.
    signal.yaw_deg.extend((0..300).map(|k| eased(from, 12.0, k, 300)));
    let down = End::Below { amplitude_deg: 0.3, at_most_s: 1800.0 };
    signal.yaw_deg.extend(motion(&truth, 12.0, held_s, down));
    signal.given()
}
