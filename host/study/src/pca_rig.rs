//! Tables 5.3 and 5.4: components of the whole record and of three cycles on releases of the virtual rig
//! whose frequency and damping vary with amplitude; and which change to the training improves the whole
//! record most.

use super::decays::{Begin, Noise, WholeRecord};
use super::lab::{Draws, Fit, Spec};
use super::pca_samples::{better_spec, thesis_spec};
use super::report::{percent, times, Outcome, Table};
use super::rig_records::{release, windows, Cut, EightSeconds};
use super::setting::StudySetting;
use rayon::prelude::*;
use yawrig_base::error::Result;
use yawrig_base::interrupt;
use yawrig_core::record::Record;
use yawrig_report::plot::{Axis as PlotAxis, Curve, Plot};
use yawrig_rig::{Condition, Rig, Spring, SPRINGS};
use yawrig_shared::axis::Axis;
use yawrig_shared::derivatives::YawDerivatives;
use yawrig_shared::features::FeatureKind;
use yawrig_shared::modal::Modal;
use yawrig_train::pca::Scale;
use yawrig_train::Precision;

const WIND_SPEED_M_S: f64 = 10.0;

/// Cn_beta and Cn_r by spring: Table 5.3's network, Table 5.4's with ten components and without.
const THESIS: [[[f64; 2]; 3]; 8] = [
    [[-0.086, -0.101], [0.5723, -0.0989], [0.5713, -0.0906]],
    [[-0.825, -0.031], [0.5748, -0.1080], [0.5621, -0.1088]],
    [[0.116, -0.111], [0.6075, -0.1124], [0.6011, -0.1181]],
    [[-0.228, -0.056], [0.5777, -0.1189], [0.5918, -0.1221]],
    [[2.646, -0.112], [0.5519, -0.1172], [0.5738, -0.1258]],
    [[1.759, 0.076], [0.6117, -0.1295], [0.6274, -0.1327]],
    [[-0.904, -0.077], [0.5879, -0.1179], [0.5703, -0.1160]],
    [[0.428, -0.115], [0.5004, -0.1185], [0.5593, -0.1170]],
];

/// A way to train on whole records and to cut them from releases.
struct Way {
    name: &'static str,
    kind: WholeRecord,
    spec: Spec,
    samples: usize,
    cut: Cut,
}

/// From the thesis's way on, one change after the other.
fn ways(setting: &StudySetting<'_>) -> Vec<Way> {
    let thesis = WholeRecord::thesis(Noise::OfImpulseResponse([0.02, 0.2]));
    let spec = Spec { precision: Precision::PerOutput, ..thesis_spec(setting.epochs(100)) };
    let scaled = WholeRecord {
        noise: Noise::OfPeak([0.002, 0.02]),
        by_rms: true,
        means: true,
        small_damping_share: 0.3,
        ..thesis
    };
    let jittered = WholeRecord { begin: Begin::Crossing { jitter_rad: 0.01 }, ..scaled };
    let varying = WholeRecord { damping_change: 0.5, frequency_change: 0.02, ..jittered };
    let better = |epochs| better_spec(0.01, setting.epochs(epochs));
    let way = |name, kind, spec, samples, cut| Way { name, kind, spec, samples, cut };
    vec![
        way("thesis, cut at the release", thesis, spec.clone(), 1000, Cut::Release),
        way("thesis, cut at a crossing", thesis, spec, 1000, Cut::Crossing),
        way("+ means, rms, 6000 records", scaled, better(120), 6000, Cut::Crossing),
        way("+ jitter of the crossing", jittered, better(120), 6000, Cut::Crossing),
        way("+ varying damping, frequency", varying, better(120), 6000, Cut::Crossing),
    ]
}

/// The same release on the linear rig and on the varying one.
struct Releases {
    condition: Condition,
    truth: Modal,
    /// Linear, then varying.
    records: [Record; 2],
}

fn releases(setting: &StudySetting<'_>, rig: &Rig) -> Result<Vec<Releases>> {
    let springs: &[Spring] = &SPRINGS[..setting.of(8, 2)];
    let conditions: Vec<Condition> = springs
        .iter()
        .flat_map(|&spring| {
            Axis::BOTH.into_iter().flat_map(move |axis| {
                [0.0, WIND_SPEED_M_S].map(|wind_speed_m_s| Condition {
                    spring,
                    axis,
                    wind_speed_m_s,
                })
            })
        })
        .collect();
    conditions
        .into_par_iter()
        .enumerate()
        .map(|(i, condition)| {
            interrupt::check()?;
            let seed = 900 + i as u64;
            let records =
                [release(rig, &condition, false, seed)?, release(rig, &condition, true, seed)?];
            Ok(Releases { condition, truth: rig.modal(&condition)?, records })
        })
        .collect()
}

pub(super) fn run(setting: &StudySetting<'_>) -> Result<Outcome> {
    let rig = Rig::default();
    (setting.progress)("pca-rig: releases");
    let releases = releases(setting, &rig)?;
    let ways = ways(setting);
    let sets: Vec<Draws> = ways.iter().map(|w| w.kind.draw(setting.draws(w.samples), 31)).collect();
    let jobs: Vec<_> = sets.iter().zip(&ways).map(|(set, w)| (set, w.spec.clone())).collect();
    let whole = setting.fit_all("pca-rig, whole records", &jobs)?;
    let three = three_cycles(setting)?;

    let mut holds = Table::new(
        "Networks against least squares over the same eight seconds, all springs, axes, wind off and on",
        &["training and cut", "rig", "wn median %", "largest %", "zeta median %", "largest %", "records"],
    );
    let mut bars = Vec::new();
    for (way, fit) in ways.iter().zip(&whole) {
        for (which, rig_name) in ["linear", "varying"].into_iter().enumerate() {
            let errors: Vec<[f64; 2]> =
                releases.iter().filter_map(|r| against_least_squares(way, fit, r, which)).collect();
            let sorted = |k: usize| {
                let mut all: Vec<f64> = errors.iter().map(|e| e[k]).collect();
                all.sort_by(f64::total_cmp);
                all
            };
            let (wn, zeta) = (sorted(0), sorted(1));
            let middle = |all: &[f64]| all.get(all.len() / 2).copied().unwrap_or(f64::NAN);
            let largest = |all: &[f64]| all.last().copied().unwrap_or(f64::NAN);
            holds.row([
                way.name.to_owned(),
                rig_name.to_owned(),
                percent(middle(&wn)),
                percent(largest(&wn)),
                percent(middle(&zeta)),
                percent(largest(&zeta)),
                errors.len().to_string(),
            ]);
            if which == 1 {
                bars.push((middle(&wn), middle(&zeta)));
            }
        }
    }
    let (derivatives, misses, plots) =
        derivatives(&rig, &releases, &columns(&ways, &whole, &three));
    let mut findings = findings(&ways, &bars);
    findings.extend(misses);
    let mut tables = vec![holds];
    tables.extend(derivatives);
    Ok(Outcome { tables, findings, plots })
}

/// Errors of wn and zeta in percent.
fn against_least_squares(way: &Way, fit: &Fit, r: &Releases, which: usize) -> Option<[f64; 2]> {
    let record = &r.records[which];
    let eight = EightSeconds::new(record, way.cut)?;
    let reference = eight.least_squares(record, r.truth.damped_frequency_rad_s())?;
    let found = fit.estimate(&eight.row(record, way.kind.means, way.kind.by_rms));
    Some([0, 1].map(|k| 100.0 * (found[k] / reference[k] - 1.0).abs()))
}

/// 41-6-2 and 10-6-2 on ten components, on the device's windows.
fn three_cycles(setting: &StudySetting<'_>) -> Result<Vec<Fit>> {
    let set = Draws::of_windows([0.002, 0.02], setting.draws(4000), 41)?;
    let plain = Spec { precision: Precision::PerOutput, ..Spec::new(&[6], setting.epochs(200)) };
    let components = Spec { components: Some((10, Scale::Common)), ..plain.clone() };
    setting.fit_all("pca-rig, three cycles", &[(&set, plain), (&set, components)])
}

/// Means over the windows of a release, weighted by the square of the amplitude, as noise is the same in all.
fn over_windows(fit: &Fit, record: &Record) -> Option<Modal> {
    let mut sums = [0.0; 3];
    for (_, features) in windows(record, FeatureKind::BinMeans) {
        let row: Vec<f64> = features.values.iter().map(|x| f64::from(*x)).collect();
        let found = fit.estimate(&row);
        let weight = f64::from(features.amplitude_deg).powi(2);
        sums = [sums[0] + weight * found[0], sums[1] + weight * found[1], sums[2] + weight];
    }
    (sums[2] > 0.0).then(|| Modal {
        natural_frequency_rad_s: sums[0] / sums[2],
        damping_ratio: sums[1] / sums[2],
    })
}

/// A column of the tables of derivatives: how wn and zeta are found in a release of the varying rig.
type Column<'a> = (&'static str, Box<dyn Fn(&Releases) -> Option<Modal> + 'a>);

fn columns<'a>(ways: &'a [Way], whole: &'a [Fit], three: &'a [Fit]) -> Vec<Column<'a>> {
    let last = ways.len() - 1;
    let by_record = move |at: usize, r: &Releases| {
        let record = &r.records[1];
        let way = &ways[at];
        let eight = EightSeconds::new(record, way.cut)?;
        let found = whole[at].estimate(&eight.row(record, way.kind.means, way.kind.by_rms));
        Some(Modal { natural_frequency_rad_s: found[0], damping_ratio: found[1] })
    };
    let least_squares = |r: &Releases| {
        let record = &r.records[1];
        let eight = EightSeconds::new(record, Cut::Crossing)?;
        let found = eight.least_squares(record, r.truth.damped_frequency_rad_s())?;
        Some(Modal { natural_frequency_rad_s: found[0], damping_ratio: found[1] })
    };
    vec![
        ("whole, thesis's way", Box::new(move |r| by_record(0, r))),
        ("whole, what holds", Box::new(move |r| by_record(last, r))),
        ("whole, least squares", Box::new(least_squares)),
        ("3 cycles, 10 components", Box::new(|r| over_windows(&three[1], &r.records[1]))),
        ("3 cycles, 41 inputs", Box::new(|r| over_windows(&three[0], &r.records[1]))),
    ]
}

/// The tables of derivatives on the varying rig at the middle axis, what they say, and their plots.
fn derivatives(
    rig: &Rig,
    releases: &[Releases],
    columns: &[Column<'_>],
) -> (Vec<Table>, Vec<String>, Vec<Plot>) {
    let mut tables = Vec::new();
    let mut plots = Vec::new();
    let mut misses = Vec::new();
    for (k, name) in ["Cn_beta", "Cn_r"].into_iter().enumerate() {
        let mut header = vec!["spring", "planted", "thesis whole", "thesis 10 comp.", "thesis 41"];
        header.extend(columns.iter().map(|(name, _)| *name));
        let mut table = Table::new(
            format!("{name} at the middle axis on the varying rig (Tables 5.3 and 5.4)"),
            &header,
        );
        let mut curves: Vec<Curve> =
            columns.iter().map(|(name, _)| Curve::line(*name, Vec::new())).collect();
        let mut truth_curve = Vec::new();
        let mut thesis_curve = Vec::new();
        let mut off = vec![Vec::new(); columns.len()];
        let mid = releases.iter().filter(|r| r.condition.axis == Axis::Mid);
        let (wind_off, wind_on): (Vec<_>, Vec<_>) =
            mid.partition(|r| r.condition.wind_speed_m_s == 0.0);
        for (i, (without, with)) in wind_off.into_iter().zip(wind_on).enumerate() {
            let spring = &with.condition.spring;
            let planted = rig.truth(spring);
            let planted = [planted.cn_beta, planted.cn_r][k];
            let mut row = vec![spring.name.to_owned(), format!("{planted:.4}")];
            row.extend(THESIS[i].map(|t| format!("{:.4}", t[k])));
            truth_curve.push(((i + 1) as f64, planted));
            thesis_curve.push(((i + 1) as f64, THESIS[i][0][k]));
            for (c, (_, method)) in columns.iter().enumerate() {
                let found = method(without).zip(method(with)).map(|(off, on)| {
                    let wind = rig.wind(WIND_SPEED_M_S);
                    let inertia = rig.inertia_kg_m2(Axis::Mid);
                    let d = YawDerivatives::from_releases(&on, &off, inertia, &wind, &rig.model);
                    [d.cn_beta, d.cn_r][k]
                });
                row.push(found.map_or("too short".into(), |v| format!("{v:.4}")));
                if let Some(value) = found {
                    curves[c].points.push(((i + 1) as f64, value));
                    off[c].push(100.0 * (value / planted - 1.0).abs());
                }
            }
            table.row(row);
        }
        let mut said = Vec::new();
        for ((name, _), off) in columns.iter().zip(&mut off) {
            off.sort_by(f64::total_cmp);
            let middle = off.get(off.len() / 2).copied().unwrap_or(f64::NAN);
            let largest = off.last().copied().unwrap_or(f64::NAN);
            said.push(format!("{name} {} ({})", percent(middle), percent(largest)));
        }
        misses
            .push(format!("{name} off what was planted, % median (largest): {}.", said.join("; ")));
        tables.push(table);
        // Left out of the plot: its scale would hide the other curves.
        curves.remove(0);
        curves.push(Curve::dashed("planted", truth_curve));
        curves.push(Curve::points("thesis, whole record", thesis_curve));
        plots.push(Plot {
            title: format!("{name} by spring (Tables 5.3 and 5.4)"),
            x: PlotAxis::linear("spring, K1 to K8"),
            y: PlotAxis::linear(format!("{name}, 1/rad")),
            curves,
        });
    }
    (tables, misses, plots)
}

/// `medians`: of wn and zeta on the varying rig, by way.
fn findings(ways: &[Way], medians: &[(f64, f64)]) -> Vec<String> {
    let said = ways.iter().zip(medians).map(|(way, (wn, zeta))| {
        format!("{}, wn {} %, zeta {} %", way.name, percent(*wn), percent(*zeta))
    });
    let gain = |k: &usize| {
        let (before, after) = (medians[k - 1], medians[*k]);
        f64::sqrt((before.0 / after.0) * (before.1 / after.1))
    };
    let best = (1..medians.len()).max_by(|a, b| gain(a).total_cmp(&gain(b)));
    let best = best.map_or(String::new(), |k| {
        format!(
            " The step that gains most is \"{}\": wn {} and zeta {} what they were.",
            ways[k].name,
            times(medians[k].0, medians[k - 1].0),
            times(medians[k].1, medians[k - 1].1)
        )
    });
    vec![format!(
        "Thesis: the whole record fails on the rig (Table 5.3), it says because of noise and of frequency and damping that \
         vary; where it cut its records it does not say. Median errors on the varying rig, one step after the other: \
         {}.{best}",
        said.collect::<Vec<_>>().join("; ")
    )]
}
