//! The faults, what is done to the signal and what the device must say.

use crate::faults::{motion, Given, Signal, HOLD_S, OFFSET_DEG};
use rand::Rng;
use std::f64::consts::{PI, TAU};
use yawrig_rig::{Effects, End, Samples, Sensor, Start};
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{Flags, Settings};

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Must {
    /// Every answer is right, or has the flag.
    Either,
    /// The flag.
    Flag,
    /// One answer is right, and no flag at all.
    BeRightAndClean,
    /// One answer is right, and the flag.
    BeRightAndFlag,
}

type Make = Box<dyn Fn(Modal, u64, f64) -> Vec<Given> + Sync>;

pub struct Case {
    pub name: &'static str,
    pub must: Must,
    /// Flags by which an answer may be wrong.
    pub excuses: Flags,
    pub settings: Settings,
    /// White noise of a sample at this severity as the Cramer-Rao bound takes it; none: 0.05 deg.
    pub noise: Option<fn(f64) -> f64>,
    /// Chance itself moves the model: an answer is right within four of its own standard uncertainties.
    pub within_its_own_u: bool,
    pub least_releases: usize,
    /// What is done, and how much of it.
    pub severities: Vec<(&'static str, f64)>,
    pub make: Make,
}

impl Case {
    pub fn noise_deg(&self, size: f64) -> f64 {
        self.noise.map_or(0.05, |noise| noise(size))
    }

    /// The same potentiometer on a converter with other counts.
    pub fn settings_at(&self, degrees_per_count: f64) -> Settings {
        let usual = Settings::default();
        let full = self.settings.full_scale_counts;
        let full_scale_counts = if full == usual.full_scale_counts {
            full
        } else {
            let ends_deg = f64::from(full - usual.zero_counts) * 0.005;
            usual.zero_counts + (ends_deg / degrees_per_count) as u16
        };
        let degrees_per_count = degrees_per_count as f32;
        Settings { degrees_per_count, full_scale_counts, ..self.settings }
    }

    pub fn must_text(&self) -> String {
        let names = yawrig_link::follow::flag_names(self.excuses).join("|");
        match self.must {
            Must::Either => format!("right or {names}"),
            Must::Flag => names,
            Must::BeRightAndClean => "right, no flag".into(),
            Must::BeRightAndFlag => format!("right and {names}"),
        }
    }
}

fn case(
    name: &'static str,
    must: Must,
    excuses: &[Flags],
    severities: &[(&'static str, f64)],
    make: impl Fn(Modal, u64, f64) -> Vec<Given> + Sync + 'static,
) -> Case {
    let excuses = excuses.iter().fold(Flags::default(), |mut all, flag| {
        all.set(*flag);
        all
    });
    let severities = severities.to_vec();
    Case {
        name,
        must,
        excuses,
        settings: Settings::default(),
        noise: None,
        within_its_own_u: false,
        least_releases: 1,
        severities,
        make: Box::new(make),
    }
}

pub fn cases() -> Vec<Case> {
    let mut all = Vec::new();
    in_order(&mut all);
    sensor(&mut all);
    line(&mut all);
    model(&mut all);
    all
}

fn in_order(all: &mut Vec<Case>) {
    all.push(case("nothing", Must::BeRightAndClean, &[], &[("", 0.0)], |truth, seed, _| {
        Signal::new(truth, seed).given()
    }));
    all.push(case(
        "wrong direction",
        Must::BeRightAndClean,
        &[],
        &[("let go at -15 deg", -15.0), ("at -11 deg", -11.0)],
        |truth, seed, from| Signal::released(truth, from, seed).given(),
    ));
    all.push(case(
        "jittering samples",
        Must::BeRightAndClean,
        &[],
        &[("by up to 5 %", 0.05), ("by up to 20 %", 0.2)],
        |truth, seed, share| Signal::jittered(truth, share, seed).given(),
    ));
}

/// Clips at these degrees above and below rest.
fn clipped(truth: Modal, seed: u64, at_deg: f64) -> Vec<f64> {
    let signal = Signal::new(truth, seed);
    let clip = |y: f64| y.clamp(OFFSET_DEG - at_deg, OFFSET_DEG + at_deg);
    signal.read(0.05).into_iter().map(clip).collect()
}

fn yaw(values: Vec<f64>) -> Vec<Given> {
    values.into_iter().map(Given::Yaw).collect()
}

fn sensor(all: &mut Vec<Case>) {
    for (name, at_deg, must) in [
        ("converter ends at 13 deg", 13.0, Must::Either),
        ("converter ends at 8 deg", 8.0, Must::Flag),
        ("converter ends at 2 deg", 2.0, Must::Flag),
    ] {
        let mut case = case(
            "saturated",
            must,
            &[Flags::SATURATED, Flags::DISTURBED],
            &[(name, at_deg)],
            |truth, seed, _| Signal::new(truth, seed).given(),
        );
        case.settings.full_scale_counts = ((OFFSET_DEG + at_deg) / 0.005) as u16 + 32768;
        all.push(case);
    }
    all.push(case(
        "clipped before the converter",
        Must::Either,
        &[Flags::DISTURBED, Flags::STUCK, Flags::SATURATED],
        &[("at 12 deg", 12.0), ("at 9.5 deg", 9.5), ("at 7 deg", 7.0), ("at 3 deg", 3.0)],
        |truth, seed, at_deg| yaw(clipped(truth, seed, at_deg)),
    ));
    all.push(case(
        "stuck in mid-decay",
        Must::Either,
        &[Flags::STUCK, Flags::DISTURBED],
        &[("for 20 ms", 20.0), ("for 100 ms", 100.0), ("for 300 ms", 300.0)],
        stuck,
    ));
    all.push(case(
        "stuck in mid-decay",
        Must::Flag,
        &[Flags::STUCK, Flags::DISTURBED],
        &[("for 0.6 s", 600.0), ("for 2 s", 2000.0), ("for good", 1e9)],
        stuck,
    ));
    all.push(case(
        "stuck from the start",
        Must::Flag,
        &[Flags::STUCK],
        &[("for good", 0.0)],
        |truth, seed, _| {
            let signal = Signal::new(truth, seed);
            vec![Given::Yaw(17.3); signal.len()]
        },
    ));
    all.push(Case {
        noise: Some(|rms_deg| rms_deg),
        ..case(
            "noisy",
            Must::Flag,
            &[Flags::NOISY],
            &[("0.3 deg", 0.3), ("0.5 deg", 0.5), ("1 deg", 1.0), ("2 deg", 2.0)],
            |truth, seed, noise_deg| Signal::new(truth, seed).given_with(noise_deg),
        )
    });
    all.push(Case {
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
                    let fresh: f64 = (0..12).map(|_| signal.random.random_range(-0.5..0.5)).sum();
                    slow = 0.9 * slow + (1.0_f64 - 0.81).sqrt() * rms_deg * fresh;
                    signal.yaw_deg[k] += slow;
                }
                signal.given()
            },
        )
    });
    all.push(case(
        "mains hum",
        Must::Either,
        &[Flags::NOISY, Flags::NO_SENSOR],
        &[("0.05 deg", 0.05), ("0.1 deg", 0.1), ("0.3 deg", 0.3), ("1 deg", 1.0), ("5 deg", 5.0)],
        |truth, seed, height_deg| {
            let mut signal = Signal::new(truth, seed);
            let phase = signal.random.random_range(0.0..TAU);
            for (k, y) in signal.yaw_deg.iter_mut().enumerate() {
                *y += height_deg * (TAU * 50.0 * k as f64 * 1e-3 + phase).sin();
            }
            signal.given()
        },
    ));
    disconnected(all);
    all.push(case(
        "spikes",
        Must::BeRightAndFlag,
        &[Flags::SPIKES],
        &[("1 a second", 1.0), ("10 a second", 10.0), ("50 a second", 50.0)],
        |truth, seed, per_s| spikes(truth, seed, per_s, 6.0, 150.0),
    ));
    all.push(case(
        "small spikes",
        Must::Either,
        &[Flags::NOISY, Flags::SPIKES, Flags::DISTURBED],
        &[("1 a second", 1.0), ("10 a second", 10.0), ("50 a second", 50.0)],
        |truth, seed, per_s| spikes(truth, seed, per_s, 0.5, 4.0),
    ));
    all.push(case(
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
    ));
    all.push(case(
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
    ));
}

fn stuck(truth: Modal, seed: u64, ms: f64) -> Vec<Given> {
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

fn disconnected(all: &mut Vec<Case>) {
    let kinds = [
        ("hum of 30 deg", 0.0),
        ("any counts", 1.0),
        ("the lower end", 2.0),
        ("the upper end", 3.0),
    ];
    all.push(case(
        "disconnected from the start",
        Must::Flag,
        &[Flags::NO_SENSOR, Flags::SATURATED, Flags::STUCK],
        &kinds,
        |truth, seed, kind| {
            let signal = Signal::new(truth, seed);
            floating(signal, 0, kind)
        },
    ));
    all.push(case(
        "disconnected in mid-decay",
        Must::Flag,
        &[Flags::NO_SENSOR, Flags::SATURATED, Flags::STUCK, Flags::DISTURBED],
        &kinds,
        |truth, seed, kind| {
            let mut signal = Signal::new(truth, seed);
            let at = signal.any_moment();
            floating(signal, at, kind)
        },
    ));
    all.push(case(
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
    ));
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

fn line(all: &mut Vec<Case>) {
    all.push(case(
        "samples missing, counted",
        Must::BeRightAndFlag,
        &[Flags::LOST_SAMPLES],
        &[("1 in one place", 1.0), ("15 in one place", 15.0), ("20 in one place", 20.0)],
        |truth, seed, count| missing(truth, seed, count as usize, true),
    ));
    all.push(case(
        "samples missing, counted",
        Must::Flag,
        &[Flags::LOST_SAMPLES],
        &[("200 in one place", 200.0), ("2000 in one place", 2000.0)],
        |truth, seed, count| missing(truth, seed, count as usize, true),
    ));
    all.push(case(
        "samples missing, not counted",
        Must::Either,
        &[Flags::DISTURBED],
        &[("1 in one place", 1.0), ("10 in one place", 10.0), ("100 in one place", 100.0)],
        |truth, seed, count| missing(truth, seed, count as usize, false),
    ));
}

fn missing(truth: Modal, seed: u64, count: usize, counted: bool) -> Vec<Given> {
    let mut signal = Signal::new(truth, seed);
    let share = signal.random.random_range(0.02..0.22);
    let at = signal.moment(share);
    let mut given = signal.given();
    let end = (at + count).min(given.len());
    let said = counted.then_some(Given::Lost((end - at) as u32));
    given.splice(at..end, said);
    given
}

fn model(all: &mut Vec<Case>) {
    all.push(case(
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
            let height = share * signal.amplitude_deg(at) / (0.02 * truth.natural_frequency_rad_s);
            signal.push(at, |k| {
                (k < 30).then(|| side * height * (PI * (k as f64 + 0.5) / 30.0).sin())
            });
            signal.given()
        },
    ));
    all.push(case(
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
    ));
    all.push(case(
        "gust",
        Must::Either,
        // One that finds the model at rest again is the beginning of what it then measures.
        &[Flags::DISTURBED, Flags::MID_SWING],
        &[("0.1 deg for 3 s", 0.1), ("1 deg for 3 s", 1.0), ("5 deg for 3 s", 5.0)],
        |truth, seed, height_deg| gust(truth, seed, height_deg, 3000),
    ));
    all.push(Case {
        within_its_own_u: true,
        ..case(
            "turbulent wind",
            Must::Either,
            &[Flags::DISTURBED],
            &[("swings by 0.1 deg", 0.1), ("by 0.5 deg", 0.5), ("by 2 deg", 2.0)],
            turbulence,
        )
    });
    all.push(case(
        "second release while running",
        Must::Either,
        &[Flags::DISTURBED, Flags::CUT_SHORT, Flags::MID_SWING],
        &[("held for 0.1 s", 0.1), ("held for 0.5 s", 0.5), ("held for 1 s", 1.0)],
        second_release,
    ));
    all.push(Case {
        least_releases: 2,
        ..case(
            "second release while running",
            Must::Either,
            &[Flags::DISTURBED, Flags::CUT_SHORT],
            &[("held for 2 s", 2.0)],
            second_release,
        )
    });
    all.push(case(
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
    ));
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
