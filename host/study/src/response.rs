//! Fig 4.20: natural frequency and damping ratio window by window through one response of spring K4.

use super::report::{extremes, percent, Outcome, Table};
use super::rig_records::{at_amplitude, release, windows};
use super::setting::StudySetting;
use yawrig_base::error::{Error, Result};
use yawrig_report::plot::{Axis as PlotAxis, Curve, Plot};
use yawrig_rig::{Condition, Rig, Spring};
use yawrig_shared::axis::Axis;
use yawrig_shared::blob;

/// Thesis, ten windows in the order they stand in the figure's text; the figure itself orders them in time.
const THESIS_WN_RAD_S: [f64; 2] = [12.72, 12.92];
const THESIS_ZETA: [f64; 2] = [0.0055, 0.0068];

pub(super) fn run(setting: &StudySetting<'_>) -> Result<Outcome> {
    let rig = Rig::default();
    let condition =
        Condition { spring: Spring::named("K4")?, axis: Axis::Mid, wind_speed_m_s: 10.0 };
    let small = rig.modal(&condition)?;
    let (_, payload) = blob::decode(yawrig_firmware::BUILT_IN)
        .map_err(|e| Error::internal(format!("the network compiled in is broken: {e:?}")))?;
    let network = payload.network;
    let mut tables = Vec::new();
    let (mut wn_curves, mut zeta_curves) = (Vec::new(), Vec::new());
    let mut found = Vec::new();
    for (name, vary) in [("linear rig", false), ("softening springs and drag", true)] {
        (setting.progress)(&format!("response: {name}"));
        let record = release(&rig, &condition, vary, 7)?;
        let mut table = Table::new(
            format!("K4 at 10 m/s, {name}: every window of three cycles from 10 deg to 1 deg"),
            &["from s", "amplitude deg", "wn rad/s", "planted", "zeta", "planted"],
        );
        let (mut wn, mut zeta, mut wn_true, mut zeta_true) = (vec![], vec![], vec![], vec![]);
        for (window, features) in windows(&record, network.features) {
            let found = network.estimate(&features);
            let found = [found.natural_frequency_rad_s, found.damping_ratio].map(f64::from);
            let amplitude_deg = f64::from(features.amplitude_deg);
            let planted = match vary {
                true => at_amplitude(&small, amplitude_deg.to_radians()),
                false => [small.natural_frequency_rad_s, small.damping_ratio],
            };
            let from_s = f64::from(window.start.since(0)) * 1e-3;
            table.row([
                format!("{from_s:.2}"),
                format!("{amplitude_deg:.2}"),
                format!("{:.3}", found[0]),
                format!("{:.3}", planted[0]),
                format!("{:.5}", found[1]),
                format!("{:.5}", planted[1]),
            ]);
            wn.push((amplitude_deg, found[0]));
            zeta.push((amplitude_deg, found[1]));
            wn_true.push((amplitude_deg, planted[0]));
            zeta_true.push((amplitude_deg, planted[1]));
        }
        found.push((name, [wn.clone(), wn_true.clone()], [zeta.clone(), zeta_true.clone()]));
        wn_curves.push(Curve::points(name, wn));
        wn_curves.push(Curve::dashed(format!("{name}, planted"), wn_true));
        zeta_curves.push(Curve::points(name, zeta));
        zeta_curves.push(Curve::dashed(format!("{name}, planted"), zeta_true));
        tables.push(table);
    }
    let mut findings = vec![format!(
        "Thesis, ten windows: wn {} to {} rad/s, a spread of {} %, zeta {} to {}, averaged before derivatives are computed. \
         Nobody knows the truth of that response; here it is planted.",
        THESIS_WN_RAD_S[0],
        THESIS_WN_RAD_S[1],
        percent(spread(THESIS_WN_RAD_S)),
        THESIS_ZETA[0],
        THESIS_ZETA[1]
    )];
    findings.extend(found.iter().map(finding));
    let plot = |title: &str, unit: &str, curves| Plot {
        title: title.into(),
        x: PlotAxis::linear("amplitude, deg"),
        y: PlotAxis::linear(unit),
        curves,
    };
    let plots = vec![
        plot("Natural frequency through a response of K4 (Fig 4.20)", "wn, rad/s", wn_curves),
        plot("Damping ratio through a response of K4 (Fig 4.20)", "zeta", zeta_curves),
    ];
    Ok(Outcome { tables, findings, plots })
}

/// What is found on a rig, and what is planted: of wn and of zeta against amplitude.
type Found = (&'static str, [Points; 2], [Points; 2]);
type Points = Vec<(f64, f64)>;

fn finding((name, [wn, wn_true], [zeta, zeta_true]): &Found) -> String {
    let [of_wn, planted] = [wn, wn_true].map(|points| extremes(points.iter().map(|p| p.1)));
    let of_zeta = extremes(zeta.iter().map(|p| p.1));
    format!(
        "{name}: wn {:.3} to {:.3} rad/s, a spread of {} % where {} % were planted, off the planted curve {} % rms; \
         zeta {:.5} to {:.5}, off {} % rms",
        of_wn[0],
        of_wn[1],
        percent(spread(of_wn)),
        percent(spread(planted)),
        percent(off(wn, wn_true)),
        of_zeta[0],
        of_zeta[1],
        percent(off(zeta, zeta_true))
    )
}

/// Percent of the mean of both.
fn spread([low, high]: [f64; 2]) -> f64 {
    100.0 * (high - low) / (0.5 * (high + low))
}

/// Rms of the difference from what was planted, percent of it.
fn off(found: &[(f64, f64)], planted: &[(f64, f64)]) -> f64 {
    let squares = found.iter().zip(planted).map(|(f, p)| (f.1 / p.1 - 1.0).powi(2));
    100.0 * (squares.sum::<f64>() / found.len() as f64).sqrt()
}
