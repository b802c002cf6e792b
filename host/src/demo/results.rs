//! What a demo keeps: its network, its findings as a report's data, and the report.

use super::{Made, Plan};
use std::path::{Path, PathBuf};
use yawrig_base::error::Result;
use yawrig_base::files;
use yawrig_core::derivatives::table::Point;
use yawrig_core::diagnosis::amplitude::{AmplitudePicture, AmplitudePoint};
use yawrig_core::quantity::Quantity;
use yawrig_core::record::Said;
use yawrig_link::follow::flag_names;
use yawrig_report::{
    Epoch, Estimate, HeldOut, Kind, PointReport, ReleaseReport, Report, SettingRow, TrainingReport,
};
use yawrig_rig::Truth;
use yawrig_shared::wire::Measured;
use yawrig_train::freeze;
use yawrig_train::network_training::{Outcome, Settings};
use yawrig_verbs::report::DEMO_FILE;

/// Names in a demo's folder, beside [`DEMO_FILE`].
pub const NETWORK: &str = "network.yrn";
pub const REPORT: &str = "report.html";

/// The first of `wanted`, `wanted-2`, `wanted-3` ... that is not there.
pub fn free_folder(wanted: &str) -> PathBuf {
    let first = PathBuf::from(wanted);
    if !first.exists() {
        return first;
    }
    let numbered = (2..).map(|k: u32| PathBuf::from(format!("{wanted}-{k}")));
    numbered.into_iter().find(|path| !path.exists()).unwrap_or(first)
}

/// Writes findings and network to `folder`, which is made where it is not there.
///
/// # Errors
/// Exit 3, naming the path and the system's reason.
pub fn keep(folder: &Path, report: &Report, network: &[u8]) -> Result<()> {
    files::make_folder(folder)?;
    files::write_atomically(&folder.join(NETWORK), network)?;
    files::write_atomically(&folder.join(DEMO_FILE), report.json()?.as_bytes())
}

/// The report of a demo.
pub fn report(
    plan: &Plan,
    device: &str,
    made: &[Made],
    points: &[(Point, Truth)],
    training: TrainingReport,
    by: yawrig_report::Made,
) -> Report {
    let mut report = Report::new(Kind::Demo, "Demo on the built-in rig".to_owned(), by);
    let rig = &plan.rig;
    report.settings = vec![
        SettingRow::new("device", device, ""),
        SettingRow::new("seed", plan.seed, ""),
        SettingRow::new("wind speed", plan.wind_speed_m_s, "m/s"),
        SettingRow::new("sensor noise, rms", plan.sensor.noise_deg, "deg"),
        SettingRow::new("released from", plan.start.amplitude_deg, "deg"),
        SettingRow::new("length", rig.model.length_m, "m"),
        SettingRow::new("frontal area", rig.model.frontal_area_m2, "m²"),
        SettingRow::new("air density", rig.air_density_kg_m3, "kg/m³"),
        SettingRow::new("spring arm", rig.spring_arm_m, "m"),
        SettingRow::new("axis offset", rig.axis_offset_m, "m"),
    ];
    report.points = points
        .iter()
        .map(|(point, t)| PointReport {
            truth: Some([t.cn_beta, t.cn_r, t.cy_beta, t.cy_r]),
            budget: None,
            ..PointReport::from(point)
        })
        .collect();
    let [beta, r] = super::misses(points);
    report.verdict = match points.is_empty() {
        true => "No table: the device has no estimate to rely on for some of the releases.".to_owned(),
        false => format!(
            "Of {} releases the device's answers make a table whose Cn_beta misses the planted truth by {:.3} % in the \
             median and Cn_r by {:.3} %.",
            made.len(),
            100.0 * beta.median,
            100.0 * r.median
        ),
    };
    report.releases = made.iter().map(release).collect();
    report.training = Some(training);
    report
}

fn release(made: &Made) -> ReleaseReport {
    let quantity = |m: Measured| Quantity::new(f64::from(m.value), f64::from(m.u));
    let estimate = Estimate {
        method: "device".to_owned(),
        natural_frequency_rad_s: quantity(made.result.natural_frequency_rad_s),
        damping_ratio: quantity(made.result.damping_ratio),
        residual_rms_deg: None,
        residual_over_noise: None,
        refused: false,
        remarks: flag_names(made.result.flags).iter().map(|f| (*f).to_owned()).collect(),
    };
    let first = made.windows.first().map_or(0, |w| w.start_sample);
    let point = |w: &yawrig_shared::wire::WindowResult| AmplitudePoint {
        time_s: 0.5e-3
            * f64::from(w.start_sample.wrapping_sub(first) + w.end_sample.wrapping_sub(first)),
        amplitude_deg: f64::from(w.amplitude_deg),
        natural_frequency_rad_s: Quantity::exact(f64::from(w.natural_frequency_rad_s)),
        damping_ratio: Quantity::exact(f64::from(w.damping_ratio)),
        midline_deg: Quantity::exact(f64::from(w.midline_deg)),
    };
    let measured: Vec<AmplitudePoint> = made.windows.iter().map(point).collect();
    let wind = made.condition.wind_speed_m_s;
    ReleaseReport {
        name: format!("{} {} axis, {wind} m/s", made.condition.spring.name, made.condition.axis),
        condition: None,
        held_out: false,
        samples: made.trace.as_ref().map_or(0, |t| t.of),
        rate_hz: f64::from(yawrig_shared::window::SAMPLE_RATE_HZ),
        noise_rms_deg: None,
        said: Said::default(),
        residual_over_noise: Vec::new(),
        estimates: if made.windows.is_empty() { Vec::new() } else { vec![estimate] },
        truth: Some([made.truth.natural_frequency_rad_s, made.truth.damping_ratio]),
        trace: made.trace.clone(),
        amplitude: (!measured.is_empty()).then(|| AmplitudePicture {
            said: Said::default(),
            measured,
            predictions: Vec::new(),
        }),
        at_amplitude: Vec::new(),
        answer: None,
        criticism: None,
    }
}

/// How the network came about.
pub fn training(settings: &Settings, outcome: &Outcome) -> TrainingReport {
    let trained = &outcome.trained;
    let rms = |sum: f64| (sum / settings.samples as f64).sqrt();
    let epoch = |e: &yawrig_train::Epoch| Epoch {
        epoch: e.epoch,
        natural_frequency_rms: rms(e.errors[0]),
        damping_ratio_rms: rms(e.errors[1]),
        effective_parameters: e.gamma,
    };
    let held_out = |e: &yawrig_train::HeldOutEpoch| HeldOut {
        epoch: e.epoch,
        natural_frequency_rms: e.rms[0],
        damping_ratio_rms: e.rms[1],
    };
    TrainingReport {
        topology: freeze::name(&outcome.topology),
        samples: settings.samples,
        epochs: trained.epochs,
        stopped: format!("{:?}", trained.stopped).to_lowercase(),
        test_rms_percent: [
            outcome.test.natural_frequency_rms_percent,
            outcome.test.damping_ratio_rms_percent,
        ],
        history: trained.history.iter().map(epoch).collect(),
        held_out: outcome.test_history.iter().map(held_out).collect(),
    }
}
