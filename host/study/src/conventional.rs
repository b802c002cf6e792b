//! Table 4.7: the conventional method and the network on three responses at ten noise levels.

use super::decays::impulse_response;
use super::report::{extremes, percent, Outcome, Table};
use super::setting::StudySetting;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;
use yawrig_base::error::Result;
use yawrig_base::interrupt;
use yawrig_core::identify::{identify, Identification, Method, Settings};
use yawrig_core::record::Record;
use yawrig_core::statistics::median;
use yawrig_report::plot::{Axis, Curve, Plot};

/// wn in rad/s and zeta of the three responses.
pub const SAMPLES: [(f64, f64); 3] = [(7.5, 0.012), (15.5, 0.003), (23.5, 0.006)];

/// wn and zeta as a method found them.
type WnAndZeta = (f64, f64);

/// Noise (rms on the impulse response), then the thesis's wn and zeta of each response by its conventional
/// method and by its network.
pub const THESIS: [(f64, [WnAndZeta; 3], [WnAndZeta; 3]); 10] = [
    (
        0.02,
        [(7.33, 0.0122), (15.36, 0.0030), (23.39, 0.0060)],
        [(7.50, 0.0116), (15.48, 0.0026), (23.55, 0.0056)],
    ),
    (
        0.04,
        [(7.34, 0.0121), (15.36, 0.0030), (23.39, 0.0060)],
        [(7.50, 0.0116), (15.48, 0.0027), (23.55, 0.0055)],
    ),
    (
        0.06,
        [(7.33, 0.0121), (15.36, 0.0030), (23.39, 0.0060)],
        [(7.50, 0.0118), (15.48, 0.0027), (23.54, 0.0055)],
    ),
    (
        0.08,
        [(7.33, 0.0118), (15.36, 0.0030), (23.39, 0.0060)],
        [(7.50, 0.0113), (15.47, 0.0026), (23.53, 0.0058)],
    ),
    (
        0.10,
        [(7.33, 0.0118), (15.36, 0.0029), (23.39, 0.0059)],
        [(7.49, 0.0121), (15.48, 0.0028), (23.52, 0.0059)],
    ),
    (
        0.12,
        [(7.34, 0.0118), (15.36, 0.0029), (23.39, 0.0059)],
        [(7.49, 0.0120), (15.47, 0.0025), (23.54, 0.0060)],
    ),
    (
        0.14,
        [(7.33, 0.0117), (15.36, 0.0029), (23.39, 0.0059)],
        [(7.51, 0.0123), (15.48, 0.0029), (23.55, 0.0060)],
    ),
    (
        0.16,
        [(7.33, 0.0117), (15.36, 0.0029), (23.39, 0.0058)],
        [(7.48, 0.0118), (15.48, 0.0030), (23.55, 0.0055)],
    ),
    (
        0.18,
        [(7.34, 0.0112), (15.36, 0.0029), (23.39, 0.0057)],
        [(7.46, 0.0115), (15.48, 0.0034), (23.56, 0.0064)],
    ),
    (
        0.20,
        [(7.33, 0.0116), (15.36, 0.0029), (23.39, 0.0057)],
        [(7.53, 0.0112), (15.46, 0.0022), (23.51, 0.0057)],
    ),
];

const METHODS: [(Method, &str); 3] = [
    (Method::Conventional, "conventional"),
    (Method::Network, "network"),
    (Method::LeastSquares, "least squares"),
];

/// The thesis's impulse response, peak about wn, at 1 kHz until it has fallen to a half.
fn record((wn, zeta): (f64, f64), noise: f64, seed: u64) -> Record {
    let peak = wn / (1.0 - zeta * zeta).sqrt();
    let samples = ((peak / 0.5).ln() / (zeta * wn) * 1000.0) as usize;
    let time_s: Vec<f64> = (0..samples).map(|k| k as f64 * 1e-3).collect();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut reading = |t: &f64| {
        let error: f64 = random.sample(StandardNormal);
        peak * impulse_response([wn, zeta], *t) + noise * error
    };
    let yaw_deg = time_s.iter().map(&mut reading).collect();
    Record::new("response", time_s, yaw_deg)
}

fn value(found: &Identification, method: Method) -> Option<[f64; 2]> {
    let estimate = found.estimates.iter().find(|e| e.method == method)?;
    Some([estimate.natural_frequency_rad_s.value, estimate.damping_ratio.value])
}

pub(super) fn run(setting: &StudySetting<'_>) -> Result<Outcome> {
    let seeds = setting.of(20, 2) as u64;
    let methods = METHODS.map(|(method, _)| method);
    let mut tables = Vec::new();
    let mut plots = Vec::new();
    let mut findings = vec!["The conventional method's frequency is a bin of its spectrum, and which bin depends on how long a \
                             stretch is transformed, which the thesis does not say. Here its peaks are taken after the low-pass."
        .to_owned()];
    for (which, &(wn, zeta)) in SAMPLES.iter().enumerate() {
        let mut table = Table::new(
            format!(
                "wn {wn} rad/s, zeta {zeta}: median of {seeds} seeds; largest errors of zeta in %"
            ),
            &[
                "noise",
                "thesis conv.",
                "thesis netw.",
                "conv.",
                "network",
                "least sq.",
                "conv. %",
                "network %",
                "least sq. %",
            ],
        );
        // Of each method, then the thesis's two: errors of wn and of zeta at each noise level, percent.
        let mut off: [Vec<[f64; 2]>; 5] = Default::default();
        let mut curves: Vec<Curve> =
            METHODS.iter().map(|(_, name)| Curve::line(*name, Vec::new())).collect();
        let mut thesis_curves = [
            Curve::dashed("conventional, thesis", Vec::new()),
            Curve::dashed("network, thesis", Vec::new()),
        ];
        for (noise, conventional, network) in THESIS {
            interrupt::check()?;
            let all: Vec<Identification> = (0..seeds)
                .into_par_iter()
                .map(|seed| {
                    identify(&record((wn, zeta), noise, seed), &methods, &Settings::default())
                })
                .collect::<yawrig_core::error::Result<_>>()?;
            let pair = |(w, z): WnAndZeta| format!("{w:.2} {z:.4}");
            let mut row =
                vec![format!("{noise:.2}"), pair(conventional[which]), pair(network[which])];
            let mut worst = Vec::new();
            let percent_off = |[w, z]: [f64; 2]| [100.0 * (w / wn - 1.0), 100.0 * (z / zeta - 1.0)];
            for ((method, curve), off) in methods.iter().zip(&mut curves).zip(&mut off) {
                let values: Vec<[f64; 2]> =
                    all.iter().filter_map(|found| value(found, *method)).collect();
                let middle =
                    [0, 1].map(|k| median(&mut values.iter().map(|v| v[k]).collect::<Vec<_>>()));
                row.push(pair(middle.into()));
                let errors = values.iter().map(|v| percent_off(*v)[1].abs());
                worst.push(percent(errors.fold(0.0, f64::max)));
                off.push(percent_off(middle));
                curve.points.push((noise, percent_off(middle)[1]));
            }
            row.extend(worst);
            table.row(row);
            let thesis = thesis_curves.iter_mut().zip([conventional, network]).zip(&mut off[3..]);
            for ((curve, found), off) in thesis {
                let error = percent_off(found[which].into());
                off.push(error);
                curve.points.push((noise, error[1]));
            }
            (setting.progress)(&format!("conventional: wn {wn} rad/s, noise {noise}"));
        }
        findings.push(finding((wn, zeta), &off));
        tables.push(table);
        plots.push(Plot {
            title: format!("zeta, wn {wn} rad/s, zeta {zeta} (Table 4.7)"),
            x: Axis::linear("noise, rms on the impulse response"),
            y: Axis::linear("error of zeta, % (median)"),
            curves: curves.into_iter().chain(thesis_curves).collect(),
        });
    }
    Ok(Outcome { tables, findings, plots })
}

/// `off`: errors of wn and zeta in percent at each noise level, of our methods and of the thesis's two.
fn finding((wn, zeta): WnAndZeta, off: &[Vec<[f64; 2]>; 5]) -> String {
    let [a, b, c] = METHODS.map(|(_, name)| name);
    let names = [a, b, c, "thesis's conventional", "thesis's network"];
    let said = names.iter().zip(off).map(|(name, off)| {
        let [wn, zeta] = [0, 1].map(|k| extremes(off.iter().map(|o| o[k])));
        format!("{name} wn {:+.2} to {:+.2}, zeta {:+.1} to {:+.1}", wn[0], wn[1], zeta[0], zeta[1])
    });
    format!(
        "wn {wn} rad/s, zeta {zeta}: errors in % from the least to the largest over the noise levels, medians here and \
         one response a level in the thesis: {}.",
        said.collect::<Vec<_>>().join("; ")
    )
}
