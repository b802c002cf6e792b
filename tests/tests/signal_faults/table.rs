//! Plays the cases and judges what the device says.

use crate::case::{Case, Must};
use crate::cases::cases;
use crate::faults::{Given, Signal};
use rayon::prelude::*;
use std::collections::BTreeSet;
use yawrig_link::follow::flag_names;
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{Flags, ReleaseResult, Reply, Request, Settings, WindowResult};
use yawrig_tests::desk::Desk;

/// Releases of short and of many windows, slow and fast.
const TRUTHS: [(f64, f64); 5] =
    [(3.5, 0.03), (7.5, 0.008), (12.0, 0.03), (16.0, 0.005), (24.0, 0.01)];
const SEEDS: u64 = 4;
/// Degrees a count, and on how many seeds: +-164 deg as usual, +-98 deg, and +-1800 deg.
const SCALES: [(f64, u64); 3] = [(0.005, SEEDS), (0.003, 1), (0.055, 1)];

/// What an answer may be off, per cent: the network's own error, which `device_in_memory` shows over the
/// whole range, and four times the Cramer-Rao bound of the windows behind it. Of three cycles with an
/// amplitude `a` and `n` samples with noise `s` that bound is sqrt(24) s / (a sqrt(n) 6 pi), for the damping
/// ratio and for the relative frequency.
fn allowed_percent(truth: &Modal, windows: &[WindowResult], noise_deg: f64) -> [f64; 2] {
    let information: f64 = windows
        .iter()
        .map(|w| {
            let samples = f64::from(w.end_sample.wrapping_sub(w.start_sample));
            let amplitude = f64::from(w.amplitude_deg);
            (amplitude * 6.0 * std::f64::consts::PI / noise_deg).powi(2) * samples / 24.0
        })
        .sum();
    let bound = 100.0 * 4.0 / information.sqrt();
    [0.1 + bound, 1.0 + (5e-3 + bound) / truth.damping_ratio]
}

fn misses_percent(result: &ReleaseResult, truth: &Modal) -> [f64; 2] {
    [
        100.0
            * (f64::from(result.natural_frequency_rad_s.value) / truth.natural_frequency_rad_s
                - 1.0),
        100.0 * (f64::from(result.damping_ratio.value) / truth.damping_ratio - 1.0),
    ]
}

/// What the device made of one signal.
pub struct Played {
    pub releases: Vec<ReleaseResult>,
    pub windows: Vec<WindowResult>,
}

pub fn play(given: &[Given], settings: Settings) -> Played {
    let mut desk = Desk::default();
    assert_eq!(desk.ask(&Request::Configure(settings)), Reply::Done);
    for &given in given {
        match given {
            Given::Yaw(yaw_deg) => {
                let counts = yaw_deg / f64::from(settings.degrees_per_count);
                let counts = counts.round() + f64::from(settings.zero_counts);
                desk.play([counts.clamp(0.0, f64::from(settings.full_scale_counts)) as u16]);
            }
            Given::Counts(counts) => desk.play([counts]),
            Given::Lost(count) => desk.lost(count),
        }
    }
    desk.end();
    Played { releases: desk.releases, windows: desk.windows }
}

/// Over all signals of a row.
#[derive(Default)]
struct Row {
    signals: usize,
    flagged: usize,
    right: usize,
    flags: BTreeSet<&'static str>,
    worst: [f64; 2],
    complaints: Vec<String>,
}

fn judge(case: &Case, severity: &str, size: f64, (scale, seeds): (f64, u64)) -> Row {
    let mut row = Row::default();
    let settings = case.settings_at(scale);
    for (wn, zeta) in TRUTHS {
        for seed in 0..seeds {
            let truth = Modal { natural_frequency_rad_s: wn, damping_ratio: zeta };
            let played = play(&(case.make)(truth, seed, size), settings);
            row.signals += 1;
            let mut complain = |what: String| {
                let what =
                    format!("{} {severity}: wn {wn} zeta {zeta} seed {seed}: {what}", case.name);
                row.complaints.push(what);
            };
            if played.releases.len() < case.least_releases {
                complain(format!("{} releases", played.releases.len()));
            }
            let mut all = Flags::default();
            let mut any_right = false;
            for result in &played.releases {
                all.set(result.flags);
                let miss = misses_percent(result, &truth);
                let of_it = |w: &&WindowResult| w.release == result.release;
                let windows: Vec<_> = played.windows.iter().filter(of_it).copied().collect();
                let mut allowed = allowed_percent(&truth, &windows, case.noise_deg(size));
                if case.within_its_own_u {
                    let own = [
                        result.natural_frequency_rad_s.u / result.natural_frequency_rad_s.value,
                        result.damping_ratio.u / result.damping_ratio.value,
                    ];
                    for (allowed, own) in allowed.iter_mut().zip(own) {
                        *allowed = allowed.max(400.0 * f64::from(own.abs()));
                    }
                }
                let right = result.windows > 0 && (0..2).all(|i| miss[i].abs() <= allowed[i]);
                any_right |= right;
                if result.windows > 0 && !result.flags.has(case.excuses) {
                    for (worst, miss) in row.worst.iter_mut().zip(miss) {
                        *worst = worst.max(miss.abs());
                    }
                    if !right {
                        complain(format!(
                            "wrong without its flag: wn {:+.3} %, zeta {:+.2} %, {} windows, {:?}",
                            miss[0],
                            miss[1],
                            result.windows,
                            flag_names(result.flags)
                        ));
                    }
                }
            }
            let flagged = all.has(case.excuses);
            row.flagged += usize::from(flagged);
            row.right += usize::from(any_right);
            row.flags.extend(flag_names(all));
            match case.must {
                Must::Flag if !flagged => complain(format!("not flagged: {:?}", flag_names(all))),
                Must::BeRightAndClean if !any_right || all != Flags::default() => {
                    complain(format!("not right and clean: {:?}", flag_names(all)));
                }
                Must::BeRightAndFlag if !any_right || !flagged => {
                    complain(format!("not right and flagged: {:?}", flag_names(all)));
                }
                _ => {}
            }
        }
    }
    row
}

#[test]
fn every_fault_is_named_or_the_answer_is_right() {
    let cases = cases();
    let rows: Vec<_> = cases
        .iter()
        .flat_map(|case| case.severities.iter().map(move |severity| (case, severity)))
        .flat_map(|(case, severity)| SCALES.map(|scale| (case, severity, scale)))
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(|(case, &(name, size), scale)| {
            let name = match scale.0 == SCALES[0].0 {
                true => name.to_owned(),
                false => format!("{name} ({} deg a count)", scale.0),
            };
            let row = judge(case, &name, size, scale);
            (case, name, row)
        })
        .collect();
    println!(
        "{:28} {:46} {:26} {:>7} {:>7}  {:>8} {:>8}  said",
        "fault", "severity", "must", "flagged", "right", "wn %", "zeta %"
    );
    for (case, severity, row) in &rows {
        println!(
            "{:28} {severity:46} {:26} {:3}/{:3} {:3}/{:3}  {:8.3} {:8.2}  {}",
            case.name,
            case.must_text(),
            row.flagged,
            row.signals,
            row.right,
            row.signals,
            row.worst[0],
            row.worst[1],
            row.flags.iter().copied().collect::<Vec<_>>().join(" ")
        );
    }
    println!("wn %, zeta %: the largest error of an answer that comes without the fault's flag");
    let complaints: Vec<&String> = rows.iter().flat_map(|(_, _, row)| &row.complaints).collect();
    assert!(complaints.is_empty(), "{} complaints:\n{complaints:#?}", complaints.len());
}

/// No flag where nothing is wrong. Outside the trained range is said at its very edge, and rightly.
#[test]
fn a_signal_in_order_has_no_flag() {
    let mut grid = Vec::new();
    for wn in [2.5, 3.3, 5.0, 7.5, 11.0, 15.5, 20.0, 26.5] {
        for zeta in [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1] {
            for noise_deg in [0.02, 0.05, 0.1, 0.2] {
                grid.push((wn, zeta, noise_deg));
            }
        }
    }
    let complaints: Vec<String> = grid
        .par_iter()
        .enumerate()
        .filter_map(|(n, &(wn, zeta, noise_deg))| {
            let truth = Modal { natural_frequency_rad_s: wn, damping_ratio: zeta };
            let given = Signal::new(truth, 100 + n as u64).given_with(noise_deg);
            let played = play(&given, Settings::default());
            let flags = played.releases.iter().fold(Flags::default(), |mut all, r| {
                all.set(r.flags);
                all
            });
            let edge = wn == 2.5 || wn == 26.5 || zeta == 0.001 || zeta == 0.1;
            let allowed = if edge { Flags::OUT_OF_RANGE.0 } else { 0 };
            let found = played.releases.len() == 1 && played.releases[0].windows > 0;
            (!found || flags.0 & !allowed != 0).then(|| {
                format!(
                    "wn {wn} zeta {zeta} noise {noise_deg}: {:?}, {} releases",
                    flag_names(flags),
                    played.releases.len()
                )
            })
        })
        .collect();
    println!("{} signals in order, {} flagged", grid.len(), complaints.len());
    assert!(complaints.is_empty(), "{complaints:#?}");
}
