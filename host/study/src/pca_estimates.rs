//! Figs 5.12 and 5.13: estimates of 32-20-5-2 along lines of constant zeta and of constant wn.

use super::decays::{rows, Noise, WholeRecord};
use super::lab::{Draws, Spec};
use super::pca_samples::{better, better_spec, thesis_spec};
use super::report::{extremes, percent, Outcome, Table};
use super::setting::StudySetting;
use yawrig_base::error::Result;
use yawrig_report::plot::{Axis, Curve, Plot};
use yawrig_train::errors::Errors;
use yawrig_train::Precision;

const ZETA: [f64; 3] = [0.003, 0.009, 0.025];
const WN_RAD_S: [f64; 3] = [3.5, 15.5, 23.5];
/// Rms on the impulse response.
const LEVELS: [f64; 3] = [0.02, 0.1, 0.2];

/// Which of wn and zeta, the noise, and the median error of a line.
type LineError = (usize, f64, f64);

pub(super) fn run(setting: &StudySetting<'_>) -> Result<Outcome> {
    let noise = Noise::OfImpulseResponse([0.02, 0.2]);
    let thesis = WholeRecord::thesis(noise);
    let ours = better(noise);
    let sets = [thesis.draw(setting.draws(1000), 21), ours.draw(setting.draws(6000), 21)];
    let specs = [
        Spec { precision: Precision::PerOutput, ..thesis_spec(setting.epochs(100)) },
        better_spec(0.1, setting.epochs(120)),
    ];
    let jobs: Vec<_> = sets.iter().zip(specs).collect();
    let fits = setting.fit_all("pca-estimates", &jobs)?;
    let fits = [
        ("1000 records, appendix D", &fits[0], thesis),
        ("6000 records, one scale", &fits[1], ours),
    ];
    let mut all: [Vec<LineError>; 2] = Default::default();
    let mut tables = Vec::new();
    let mut plots = Vec::new();
    for (which, fixed, title) in [
        (0, ZETA, "wn at constant zeta (Fig 5.12)"),
        (1, WN_RAD_S, "zeta at constant wn (Fig 5.13)"),
    ] {
        let mut table = Table::new(
            title,
            &[
                "network",
                if which == 0 { "zeta" } else { "wn rad/s" },
                "noise",
                "rms %",
                "median %",
                "95 % below",
            ],
        );
        for ((name, fit, kind), all) in fits.iter().zip(&mut all) {
            for value in fixed {
                let mut curves = Vec::new();
                for level in LEVELS {
                    let draws = line(kind, level, which, value);
                    let figures = figures(&fit.errors(&draws), which);
                    all.push((which, level, figures[1]));
                    table.row([
                        (*name).to_owned(),
                        value.to_string(),
                        level.to_string(),
                        percent(figures[0]),
                        percent(figures[1]),
                        percent(figures[2]),
                    ]);
                    let points =
                        fit.pairs(&draws).iter().map(|(e, t)| (t[which], e[which])).collect();
                    curves.push(Curve::points(format!("noise {level}"), points));
                }
                let ends = range(which).map(|x| (x, x));
                curves.push(Curve::dashed("actual value", ends.into()));
                if value == fixed[0] {
                    let axis = if which == 0 { "wn, rad/s" } else { "zeta" };
                    plots.push(Plot {
                        title: format!("{title}: {value}; {name}"),
                        x: Axis::linear(format!("targeted {axis}")),
                        y: Axis::linear(format!("estimated {axis}")),
                        curves,
                    });
                }
            }
        }
        tables.push(table);
    }
    let said = fits.iter().zip(&all).map(|((name, _, _), all)| {
        format!("{name}: wn {}; zeta {}", by_level(all, 0), by_level(all, 1))
    });
    let findings = vec![format!(
        "Thesis: wn is estimated well at any noise, zeta not, but better at high natural frequency. Here, median errors \
         from the best line to the worst by noise: {}.",
        said.collect::<Vec<_>>().join(". ")
    )];
    Ok(Outcome { tables, findings, plots })
}

/// From the best line to the worst, at least noise and at most.
fn by_level(all: &[LineError], which: usize) -> String {
    let of = |level: f64| {
        let chosen = all.iter().filter(|(w, l, _)| *w == which && *l == level);
        extremes(chosen.map(|(_, _, median)| *median)).map(percent)
    };
    let [quiet, loud] = [LEVELS[0], LEVELS[LEVELS.len() - 1]];
    let [a, b] = [of(quiet), of(loud)];
    format!("{} to {} % at {quiet}, {} to {} % at {loud}", a[0], a[1], b[0], b[1])
}

fn figures(e: &Errors, which: usize) -> [f64; 3] {
    match which {
        0 => [
            e.natural_frequency_rms_percent,
            e.natural_frequency_median_percent,
            e.natural_frequency_p95_percent,
        ],
        _ => [
            e.damping_ratio_rms_percent,
            e.damping_ratio_median_percent,
            e.damping_ratio_p95_percent,
        ],
    }
}

/// What is varied: wn in rad/s, or zeta as in Fig 5.13.
fn range(which: usize) -> [f64; 2] {
    if which == 0 {
        [3.0, 26.0]
    } else {
        [0.002, 0.035]
    }
}

/// Records along a line on which only one of the two changes.
fn line(kind: &WholeRecord, level: f64, which: usize, fixed: f64) -> Draws {
    const POINTS: usize = 60;
    let [low, high] = range(which);
    let kind = WholeRecord { noise: Noise::OfImpulseResponse([level; 2]), ..*kind };
    let mut all = Draws { rows: Vec::new(), d: 0, truth: Vec::new() };
    for i in 0..POINTS {
        let moving = low + (high - low) * i as f64 / (POINTS - 1) as f64;
        let truth = if which == 0 { [moving, fixed] } else { [fixed, moving] };
        let one = rows(1, 5000 + i as u64, |random| kind.row(truth, random));
        all.rows.extend(one.rows);
        all.d = one.d;
        all.truth.extend(one.truth);
    }
    all
}
