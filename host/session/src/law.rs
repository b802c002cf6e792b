//! The law that the ticked releases show, over the cuts of the missing moment, with the formulas it may be.

use super::bench::Bench;
use super::shown_law::{about, ShownLaw};
use serde_json::{json, Value};
use std::path::Path;
use std::sync::Arc;
use yawrig_base::error::{Error, Result};
use yawrig_core::law::estimate::{Curve, Measured};
use yawrig_core::law::left::{Left, Over};
use yawrig_core::law::tables::Point;
use yawrig_core::motion::simulate::Motion;
use yawrig_core::record::Measurand;
use yawrig_model::document::Model;
use yawrig_model::law::beside;
use yawrig_model::measured::largest;
use yawrig_model::model_fit::Data;
use yawrig_report::drawn::{short, shorts};
use yawrig_report::view::View;

/// Where the file of a formula is written that is added, beside the model.
const FOLDER: &str = "found";
/// Formulas that are drawn and can be added.
const SHOWN: usize = 5;
/// Points of a curve from one end to the other, as many as the measured law's tables have.
const POINTS: i32 = 41;

/// Measures the law of `model`, whose file is `path`, `dissipative` or not; a sentence about it.
///
/// # Errors
/// Exit 2 where no release is ticked to be fitted, else those of [`beside`].
pub fn measure(bench: &Bench, model: &Model, path: &Path, dissipative: bool) -> Result<String> {
    if model.records.iter().all(|r| r.held_out) {
        return Err(Error::usage("no release is ticked to be fitted")
            .help("tick one in the list on the left"));
    }
    let keep = |law: Option<ShownLaw>| {
        bench.session().shown_law = law.map(Arc::new);
        bench.tell(&json!({"kind": "law"}));
    };
    let data = Data::new(model, path)?;
    let file = largest(&data).path.clone();
    let law = |curve, measured: Option<&Measured>, found| {
        let (about, file) = (about(model), file.clone());
        let folder = path.with_file_name(FOLDER);
        ShownLaw { about, file, curve, measured: measured.cloned(), found, folder }
    };
    let show = |curve, measured: Option<&Measured>| keep(Some(law(curve, measured, None)));
    match beside(model, &data, dissipative, &show) {
        Ok(found) => {
            let measured = &found.measured;
            let said = format!(
                "measured_law: residual over noise {:.2} → {:.2}, held out {:.2} → {:.2}",
                measured.plain_residual_over_noise,
                measured.residual_over_noise,
                measured.plain_held_out_over_noise,
                measured.held_out_over_noise,
            );
            let (curve, measured) = (found.curve.clone(), found.measured.clone());
            keep(Some(law(curve, Some(&measured), Some(found))));
            Ok(said)
        }
        Err(error) => {
            keep(None);
            Err(error)
        }
    }
}

/// A model's curve through a cut, less what the view's model has there already.
struct Cuts<'a> {
    view: &'a View,
    law: &'a Curve,
    /// Of the view's model on the sensor, rad.
    zero_rad: f64,
}

impl<'a> Cuts<'a> {
    fn new(view: &'a View, law: &'a Curve) -> Self {
        // The zero of a rate is none of the angle's.
        let zero = view.fitted.sensor_zero_rad().filter(|_| view.decay.measurand.shows_rest());
        let zero_rad = zero.map_or(0.0, |q| q.value);
        Self { view, law, zero_rad }
    }

    /// Of `motion`, which rests at `rest_rad` on the sensor; `u` is that of stiffness and damping at each
    /// point.
    fn json(&self, motion: &Motion, rest_rad: f64, u: Option<[Vec<f64>; 2]>) -> Value {
        let measurand = &self.view.decay.measurand;
        let (shows_rest, shown) = (measurand.shows_rest(), |x: f64| measurand.shown(x));
        let present = self.view.fitted.motion();
        let missing = |sensor_rad: f64, rate_rad_s: f64| {
            let rest_rad = if shows_rest { rest_rad } else { 0.0 };
            motion.acceleration_rad_s2(sensor_rad - rest_rad, rate_rad_s)
                - present.acceleration_rad_s2(sensor_rad - self.zero_rad, rate_rad_s)
        };
        let grid = |reach: f64| {
            (0..POINTS).map(move |k| reach * f64::from(2 * k + 1 - POINTS) / f64::from(POINTS - 1))
        };
        let [of_yaw, of_rate] = u.map_or([None, None], |[a, b]| [Some(shorts(a)), Some(shorts(b))]);
        let rates = || grid(self.law.rate_rad_s);
        let rest_rad_of_law = if shows_rest { self.law.rest_rad } else { 0.0 };
        let angles = || grid(self.law.yaw_rad).map(|b| b + rest_rad_of_law);
        json!({
            "damping_law": {
                "rate_deg_s": shorts(rates().map(shown)),
                "moment_rad_s2": shorts(rates().map(|r| missing(self.zero_rad, r))),
                "u": of_rate,
            },
            "stiffness_law": {
                "yaw_deg": shorts(angles().map(|s| shown(s - self.zero_rad))),
                "moment_rad_s2": shorts(angles().map(|s| missing(s, 0.0))),
                "u": of_yaw,
            },
        })
    }
}

/// Lines with their axes, and a frequency that is spoken of, Hz.
fn left(measurand: &Measurand, left: &Left, frequency_rad_s: Option<f64>) -> Value {
    let hz = |w_rad_s: f64| w_rad_s / std::f64::consts::TAU;
    let (same, percent) = (|value: f64| value, |share: f64| 100.0 * share);
    let shown = |x: f64| measurand.shown(x);
    type Unit<'a> = &'a dyn Fn(f64) -> f64;
    let beyond = format!("beyond the law ({})", measurand.unit());
    let (x_label, x_unit, y_label, y_unit): (String, Unit<'_>, String, Unit<'_>) = match left.over {
        Over::Time => ("time since the release (s)".to_owned(), &same, beyond, &shown),
        Over::Frequency => {
            ("frequency (Hz)".to_owned(), &hz, "share of power (%)".to_owned(), &percent)
        }
        Over::Reading => {
            (format!("{} shown ({})", measurand.word(), measurand.unit()), &shown, beyond, &shown)
        }
        Over::Turns => {
            let of = format!("{} ({})", measurand.coordinate(), measurand.coordinate_unit());
            let moment = format!("its moment ({})", measurand.parameter_unit("rad/s²"));
            (of, &shown, moment, &same)
        }
    };
    let of = |values: &[f64], unit: Unit<'_>| shorts(values.iter().map(|v| unit(*v)));
    let line = |[x, y]: &[Vec<f64>; 2]| json!({"x": of(x, x_unit), "y": of(y, y_unit)});
    json!({
        "x_label": x_label, "y_label": y_label,
        "at": frequency_rad_s.filter(|_| left.over == Over::Frequency).map(|w| short(hz(w))),
        "lines": left.lines.iter().map(line).collect::<Vec<_>>(),
    })
}

/// The law over the cuts of a release, with its k = 2 band once that is known, and the formulas; null where
/// there is none.
///
/// # Errors
/// Exit 2 where there is no such release.
pub fn shown(bench: &Bench, id: usize) -> Result<Value> {
    let (law, view) = {
        let session = bench.session();
        session.release(id)?;
        let view = session.view(id).and_then(|v| v.as_ref().ok()).cloned();
        (session.law(), view)
    };
    let Some(law) = law else { return Ok(Value::Null) };
    let cuts = view.as_deref().map(|view| Cuts::new(view, &law.curve));
    let u = law.measured.as_ref().map(|measured| {
        let of = |points: Vec<Point>| points.iter().map(|p| p.moment_rad_s2.u).collect::<Vec<_>>();
        [of(measured.tables().total_stiffness()), of(measured.tables().total_damping())]
    });
    let measurand = view.as_deref().map(|v| v.decay.measurand.clone()).unwrap_or_default();
    let mut out = json!({
        "file": law.file.display().to_string(),
        "yaw_deg": short(measurand.shown(law.curve.yaw_rad)),
        "rate_deg_s": short(measurand.shown(law.curve.rate_rad_s)),
        "units": [measurand.coordinate_unit().to_owned(), measurand.rate_unit()],
        "cuts": cuts.as_ref().map(|c| c.json(&law.curve.motion, law.curve.rest_rad, u)),
    });
    if let Some(m) = &law.measured {
        let residual = [m.plain_residual_over_noise, m.residual_over_noise].map(short);
        let held_out = [m.plain_held_out_over_noise, m.held_out_over_noise].map(short);
        out["measured"] = json!({"may_drive": !m.law.dissipative, "residual_over_noise": residual, "held_out_over_noise": held_out});
    }
    let Some(found) = &law.found else { return Ok(out) };
    let ranked = found.names.ranked.iter().zip(law.files()).take(SHOWN);
    let names = ranked.map(|(name, file)| {
        let rest_rad = name.fit.sensor_zero_rad().map_or(0.0, |q| q.value);
        let number = |(n, q): &(String, yawrig_core::quantity::Quantity)| match q.u.is_finite() {
            true => format!("{n} {q}"),
            false => format!("{n} {:.4}", q.value),
        };
        json!({
            "form": name.effect.id(),
            "title": name.effect.card().title,
            "formula": name.effect.card().formula,
            "file": file.path,
            "residual_over_noise": short(name.residual_over_noise),
            "held_out_over_noise": short(name.held_out_over_noise),
            "numbers": name.parameters.iter().map(number).collect::<Vec<_>>().join(", "),
            "cuts": cuts.as_ref().map(|c| c.json(&name.fit.motion(), rest_rad, None)),
        })
    });
    out["found"] = json!({
        "names": names.collect::<Vec<_>>(),
        "alike": found.alike(),
        "memory": found.memory(),
        "beside": found.beside(),
        "left": found.left.as_ref().map(|l| left(&measurand, l, found.names.beside.as_ref().and_then(|b| b.frequency_rad_s))),
        "remembers": found.names.memory.as_ref().map(|m| m.effect.id().to_owned()),
    });
    Ok(out)
}
