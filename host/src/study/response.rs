//! Fig 4.20: natural frequency and damping ratio window by window through one response of spring K4.

use super::report::{Report, Table};
use super::rig_records::{at_amplitude, release, windows};
use super::{reported, Setting};
use crate::plot::{Axis as PlotAxis, Curve, Plot};
use yawrig_base::error::{Error, Result};
use yawrig_rig::{Condition, Rig, Spring};
use yawrig_shared::axis::Axis;
use yawrig_shared::blob;

/// Thesis, ten windows in the order they stand in the figure's text; the figure itself orders them in time.
const THESIS_WN_RAD_S: [f64; 2] = [12.72, 12.92];
const THESIS_ZETA: [f64; 2] = [0.0055, 0.0068];

pub(super) fn run(setting: &Setting<'_>) -> Result<Report> {
    let rig = Rig::default();
    let condition =
        Condition { spring: Spring::named("K4")?, axis: Axis::Mid, wind_speed_m_s: 10.0 };
    let small = rig.modal(&condition)?;
    let (_, payload) = blob::decode(yawrig_firmware::BUILT_IN)
        .map_err(|e| Error::internal(format!("the network compiled in is broken: {e:?}")))?;
    let network = payload.network;
    let mut tables = Vec::new();
    let (mut wn_curves, mut zeta_curves) = (Vec::new(), Vec::new());
    let mut spans = Vec::new();
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
        let span = |points: &[(f64, f64)]| {
            points.iter().fold([f64::MAX, f64::MIN], |[l, h], p| [l.min(p.1), h.max(p.1)])
        };
        spans.push((name, span(&wn), span(&zeta)));
        wn_curves.push(Curve::points(name, wn));
        wn_curves.push(Curve::dashed(format!("{name}, planted"), wn_true));
        zeta_curves.push(Curve::points(name, zeta));
        zeta_curves.push(Curve::dashed(format!("{name}, planted"), zeta_true));
        tables.push(table);
    }
    let mut findings = vec![format!(
        "Thesis, ten windows: wn {} to {} rad/s, zeta {} to {}, averaged before derivatives are computed. Nobody knows \
         the truth of that response; here it is planted.",
        THESIS_WN_RAD_S[0], THESIS_WN_RAD_S[1], THESIS_ZETA[0], THESIS_ZETA[1]
    )];
    for (name, wn, zeta) in spans {
        findings.push(format!(
            "{name}: wn {:.3} to {:.3} rad/s, zeta {:.5} to {:.5}",
            wn[0], wn[1], zeta[0], zeta[1]
        ));
    }
    findings.push(
        "A linear rig's windows scatter by the sensor's noise alone, more the smaller the swing. A spread of 1.6 % in \
         wn, as in the thesis, is far beyond that: its rig was not linear, and a mean over windows is a mean over \
         amplitudes. The windows follow the planted curve, so the variation is physics and not the network's scatter."
            .into(),
    );
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
    reported("response", tables, findings, plots)
}
