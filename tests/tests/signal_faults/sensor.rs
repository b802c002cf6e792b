//! What is wrong with the sensor.

use crate::case::{case, Case, Must};
use crate::faults::{Given, Signal, HOLD_S, OFFSET_DEG};
use rand::Rng;
use std::f64::consts::TAU;
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::Flags;

pub fn cases() -> Vec<Case> {
    [ends(), stuck(), noise(), disconnected(), jumps(), drift()].into_iter().flatten().collect()
}

fn ends() -> Vec<Case> {
    let saturated = [
        ("converter ends at 13 deg", 13.0, Must::Either),
        ("converter ends at 8 deg", 8.0, Must::Flag),
        ("converter ends at 2 deg", 2.0, Must::Flag),
    ]
    .map(|(name, at_deg, must)| {
        let mut case = case(
            "saturated",
            must,
            &[Flags::SATURATED, Flags::DISTURBED],
            &[(name, at_deg)],
            |truth, seed, _| Signal::new(truth, seed).given(),
        );
        case.settings.full_scale_counts = ((OFFSET_DEG + at_deg) / 0.005) as u16 + 32768;
        case
    });
    let clipped = case(
        "clipped before the converter",
        Must::Either,
        &[Flags::DISTURBED, Flags::STUCK, Flags::SATURATED],
        &[("at 12 deg", 12.0), ("at 9.5 deg", 9.5), ("at 7 deg", 7.0), ("at 3 deg", 3.0)],
        |truth, seed, at_deg| yaw(clip(truth, seed, at_deg)),
    );
    saturated.into_iter().chain([clipped]).collect()
}

/// Clips at these degrees above and below rest.
fn clip(truth: Modal, seed: u64, at_deg: f64) -> Vec<f64> {
    let signal = Signal::new(truth, seed);
    let clip = |y: f64| y.clamp(OFFSET_DEG - at_deg, OFFSET_DEG + at_deg);
    signal.read(0.05).into_iter().map(clip).collect()
}

fn yaw(values: Vec<f64>) -> Vec<Given> {
    values.into_iter().map(Given::Yaw).collect()
}

fn stuck() -> Vec<Case> {
    vec![
        case(
            "stuck in mid-decay",
            Must::Either,
            &[Flags::STUCK, Flags::DISTURBED],
            &[("for 20 ms", 20.0), ("for 100 ms", 100.0), ("for 300 ms", 300.0)],
            stay,
        ),
        case(
            "stuck in mid-decay",
            Must::Flag,
            &[Flags::STUCK, Flags::DISTURBED],
            &[("for 0.6 s", 600.0), ("for 2 s", 2000.0), ("for good", 1e9)],
            stay,
        ),
        case(
            "stuck from the start",
            Must::Flag,
            &[Flags::STUCK],
            &[("for good", 0.0)],
            |truth, seed, _| {
                let signal = Signal::new(truth, seed);
                vec![Given::Yaw(17.3); signal.len()]
            },
        ),
    ]
}

fn stay(truth: Modal, seed: u64, ms: f64) -> Vec<Given> {
    let mut signal = Signal::new(truth, seed);
    let at = signal.any_moment();
    let mut yaw = signal.read(0.05);
    let end = (at + ms as usize).min(yaw.len());
    let at_deg = yaw[at];
    yaw[at..end].fill(at_deg);
    // A record long enough to be stuck in.
    let rest = if end == yaw.len() { 3000 } else { 0 };
    yaw.extend(std::iter::repeat_n(at_deg, rest));
    self::yaw(yaw)
}

fn noise() -> Vec<Case> {
    vec![
        Case {
            noise: Some(|rms_deg| rms_deg),
            ..case(
                "noisy",
                Must::Flag,
                &[Flags::NOISY],
                &[("0.3 deg", 0.3), ("0.5 deg", 0.5), ("1 deg", 1.0), ("2 deg", 2.0)],
                |truth, seed, noise_deg| Signal::new(truth, seed).given_with(noise_deg),
            )
        },
        Case {
            noise: Some(|rms_deg| 0.05 + 4.36 * rms_deg),
            ..case(
                "slow noise",
                Must::Either,
                &[Flags::NOISY, Flags::DISTURBED],
                &[
                    ("0.05 deg over 10 ms", 0.05),
                    ("0.2 deg over 10 ms", 0.2),
                    ("1 deg over 10 ms", 1.0),
                ],
                |truth, seed, rms_deg| {
                    let mut signal = Signal::new(truth, seed);
                    let mut slow = 0.0;
                    for k in 0..signal.len() {
                        // Twelve even draws make one near enough normal.
                        let fresh: f64 =
                            (0..12).map(|_| signal.random.random_range(-0.5..0.5)).sum();
                        slow = 0.9 * slow + (1.0_f64 - 0.81).sqrt() * rms_deg * fresh;
                        signal.yaw_deg[k] += slow;
                    }
                    signal.given()
                },
            )
        },
        case(
            "mains hum",
            Must::Either,
            &[Flags::NOISY, Flags::NO_SENSOR],
            &[
                ("0.05 deg", 0.05),
                ("0.1 deg", 0.1),
                ("0.3 deg", 0.3),
                ("1 deg", 1.0),
                ("5 deg", 5.0),
            ],
            |truth, seed, height_deg| {
                let mut signal = Signal::new(truth, seed);
                let phase = signal.random.random_range(0.0..TAU);
                for (k, y) in signal.yaw_deg.iter_mut().enumerate() {
                    *y += height_deg * (TAU * 50.0 * k as f64 * 1e-3 + phase).sin();
                }
                signal.given()
            },
        ),
    ]
}

fn disconnected() -> Vec<Case> {
    let kinds = [
        ("hum of 30 deg", 0.0),
        ("any counts", 1.0),
        ("the lower end", 2.0),
        ("the upper end", 3.0),
    ];
    vec![
        case(
            "disconnected from the start",
            Must::Flag,
            &[Flags::NO_SENSOR, Flags::SATURATED, Flags::STUCK],
            &kinds,
            |truth, seed, kind| {
                let signal = Signal::new(truth, seed);
                floating(signal, 0, kind)
            },
        ),
        case(
            "disconnected in mid-decay",
            Must::Flag,
            &[Flags::NO_SENSOR, Flags::SATURATED, Flags::STUCK, Flags::DISTURBED],
            &kinds,
            |truth, seed, kind| {
                let mut signal = Signal::new(truth, seed);
                let at = signal.any_moment();
                floating(signal, at, kind)
            },
        ),
        case(
            "disconnected, wandering",
            Must::Either,
            &[
                Flags::NO_SENSOR,
                Flags::NOISY,
                Flags::DISTURBED,
                Flags::TOO_SMALL,
                Flags::TOO_FEW_CYCLES,
            ],
            &[("0.02 deg a step", 0.02), ("0.1 deg a step", 0.1), ("0.5 deg a step", 0.5)],
            |truth, seed, step_deg| {
                let mut signal = Signal::new(truth, seed);
                let mut at_deg = 0.0;
                for k in 0..signal.len() {
                    at_deg += step_deg * signal.random.random_range(-1.7..1.7);
                    signal.yaw_deg[k] = at_deg;
                }
                signal.given()
            },
        ),
    ]
}

fn floating(mut signal: Signal, from: usize, kind: f64) -> Vec<Given> {
    let mut given = signal.given();
    given.extend(std::iter::repeat_n(Given::Counts(0), 3000));
    for (k, given) in given.iter_mut().enumerate().skip(from) {
        *given = match kind as u32 {
            0 => Given::Yaw(
                30.0 * (TAU * 50.0 * k as f64 * 1e-3).sin() + signal.random.random_range(-0.1..0.1),
            ),
            1 => Given::Counts(signal.random.random_range(1..65_535)),
            2 => Given::Counts(0),
            _ => Given::Counts(65_535),
        };
    }
    given
}

fn jumps() -> Vec<Case> {
    vec![
        case(
            "spikes",
            Must::BeRightAndFlag,
            &[Flags::SPIKES],
            &[("1 a second", 1.0), ("10 a second", 10.0), ("50 a second", 50.0)],
            |truth, seed, per_s| spikes(truth, seed, per_s, 6.0, 150.0),
        ),
        case(
            "small spikes",
            Must::Either,
            &[Flags::NOISY, Flags::SPIKES, Flags::DISTURBED],
            &[("1 a second", 1.0), ("10 a second", 10.0), ("50 a second", 50.0)],
            |truth, seed, per_s| spikes(truth, seed, per_s, 0.5, 4.0),
        ),
        case(
            "loose contact",
            Must::Either,
            &[Flags::SATURATED, Flags::DISTURBED, Flags::STUCK, Flags::SPIKES],
            &[("2 ms at zero", 2.0), ("10 ms", 10.0), ("100 ms", 100.0), ("1 s", 1000.0)],
            |truth, seed, ms| {
                let mut signal = Signal::new(truth, seed);
                let mut given = signal.given();
                for _ in 0..3 {
                    let at = signal.any_moment();
                    let end = (at + ms as usize).min(given.len());
                    given[at..end].fill(Given::Counts(0));
                }
                given
            },
        ),
    ]
}

/// One to three samples each, to either side.
fn spikes(truth: Modal, seed: u64, per_s: f64, least_deg: f64, most_deg: f64) -> Vec<Given> {
    let mut signal = Signal::new(truth, seed);
    let mut yaw = signal.read(0.05);
    let mut k = (HOLD_S * 1000.0) as usize;
    while k < yaw.len() {
        if signal.random.random_bool(per_s / 1000.0) {
            let side = if signal.random.random_bool(0.5) { 1.0 } else { -1.0 };
            for _ in 0..signal.random.random_range(1..=3) {
                if let Some(yaw) = yaw.get_mut(k) {
                    *yaw += side * signal.random.random_range(least_deg..most_deg);
                }
                k += 1;
            }
        }
        k += 1;
    }
    self::yaw(yaw)
}

fn drift() -> Vec<Case> {
    vec![case(
        "drifting zero",
        Must::Either,
        &[Flags::DISTURBED],
        &[
            ("0.005 deg/s", 0.005),
            ("0.02 deg/s", 0.02),
            ("0.1 deg/s", 0.1),
            ("0.5 deg/s", 0.5),
            ("3 deg/s", 3.0),
        ],
        |truth, seed, rate| {
            let mut signal = Signal::new(truth, seed);
            for (k, y) in signal.yaw_deg.iter_mut().enumerate() {
                // Over the whole record at most 60 deg: then the converter would end.
                *y += (rate * k as f64 * 1e-3).min(60.0);
            }
            signal.given()
        },
    )]
}
