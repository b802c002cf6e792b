//! The drawings of a report that need no script: SVG that takes its colours from the page, or stands alone.

use super::escape::escaped;
use super::trace::{ModelTrace, Trace};
use super::{Criticism, PointReport, Report, TrainingReport};
use crate::drawn;
use crate::plot::{svg, svg_in_columns, Axis, Curve, Plot};
use yawrig_base::error::Result;
use yawrig_core::derivatives::at::At;
use yawrig_core::derivatives::critical::CriticalSpeed;
use yawrig_core::diagnosis::amplitude::{AmplitudePicture, AmplitudePoint};
use yawrig_core::quantity::Quantity;

/// A drawing: its name, caption and plots.
#[derive(Clone, Debug)]
pub struct Chart {
    /// File name without extension.
    pub name: &'static str,
    pub caption: String,
    pub plots: Vec<Plot>,
}

impl Chart {
    /// As a file of its own.
    ///
    /// # Errors
    /// Exit 1, for a defect of this program only.
    pub fn file(&self) -> Result<String> {
        // Values and misses side by side.
        let has_misses = self.name == "derivatives" && self.plots.len() > 4;
        svg_in_columns(&self.plots, if has_misses { 2 } else { 1 })
    }

    /// As part of a page, whose style sheet gives each colour that of the page.
    ///
    /// # Errors
    /// As [`Chart::file`].
    pub fn inline(&self) -> Result<String> {
        let text = svg(&self.plots)?;
        // As wide as there is room for.
        let Some((head, rest)) = text.split_once('>') else { return Ok(text) };
        let (width, height) = (attribute(head, "width"), attribute(head, "height"));
        Ok(format!(
            "<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\">{rest}",
            escaped(&self.caption)
        ))
    }
}

fn attribute<'a>(tag: &'a str, name: &str) -> &'a str {
    let from = tag.split_once(&format!(" {name}=\"")).map_or("", |(_, rest)| rest);
    from.split_once('"').map_or("0", |(value, _)| value)
}

/// Every name of a [`Chart`].
pub const NAMES: [&str; 7] =
    ["staircase", "derivatives", "critical_speed", "residual", "amplitude", "laws", "training"];

/// All of a report, those of the releases apart.
pub fn of(report: &Report) -> Vec<Chart> {
    let mut all = Vec::new();
    all.extend(report.criticism.as_ref().and_then(staircase));
    if !report.points.is_empty() {
        all.push(derivatives(report));
    }
    all.extend(critical_speed(&report.critical_speed));
    if let [release] = report.releases.as_slice() {
        all.extend(release.trace.as_ref().map(residual));
        all.extend(release.amplitude.as_ref().map(|picture| amplitude(picture, release.truth)));
    }
    all.extend(report.criticism.as_ref().and_then(laws));
    all.extend(report.training.as_ref().map(training));
    all
}

/// Residual over noise, fitted and held out, over the steps.
pub fn staircase(criticism: &Criticism) -> Option<Chart> {
    if criticism.steps.is_empty() {
        return None;
    }
    let stairs = |of: fn(&super::StaircaseStep) -> f64| {
        let step = |(k, s): (usize, &super::StaircaseStep)| {
            [(k as f64 - 0.5, of(s)), (k as f64 + 0.5, of(s))]
        };
        criticism.steps.iter().enumerate().flat_map(step).collect::<Vec<_>>()
    };
    let n = criticism.steps.len() as f64;
    let names = criticism.steps.iter().map(|s| s.name.clone()).collect();
    Some(Chart {
        name: "staircase",
        caption: format!(
            "Residual over noise after each step; 1 is the noise itself. Held out: {}.",
            criticism.held_out
        ),
        plots: vec![Plot {
            title: "Residual over noise".to_owned(),
            x: Axis::named("model", names),
            y: Axis::logarithmic("residual / noise"),
            curves: vec![
                Curve::plain("fitted", stairs(|s| s.residual_over_noise)),
                Curve::dashed("held out", stairs(|s| s.held_out_over_noise)),
                Curve::dashed("the noise", vec![(-0.5, 1.0), (n - 0.5, 1.0)]),
            ],
        }],
    })
}

/// The derivatives against reduced frequency with bars of two standard uncertainties.
pub fn derivatives(report: &Report) -> Chart {
    type Of = fn(&PointReport) -> Option<Quantity>;
    let all: [(&str, Of); 4] = [
        ("Cn_beta", |p| Some(p.cn_beta)),
        ("Cn_r", |p| Some(p.cn_r)),
        ("Cy_beta", |p| p.cy_beta),
        ("Cy_r", |p| p.cy_r),
    ];
    let plot = |(k, (name, of)): (usize, (&str, Of))| {
        let bars = |points: &[PointReport]| {
            let bar = |p: &PointReport| of(p).map(|q| (p.reduced_frequency, q.value, 2.0 * q.u));
            points.iter().filter_map(bar).collect::<Vec<_>>()
        };
        let measured = bars(&report.points);
        if measured.is_empty() {
            return None;
        }
        let truth: Vec<(f64, f64)> =
            report.points.iter().filter_map(|p| Some((p.reduced_frequency, p.truth?[k]))).collect();
        let mut curves = Vec::new();
        let mut ats: Vec<&At> = report.points.iter().map(|p| &p.at).collect();
        ats.dedup();
        if ats.len() > 1 {
            // Each setting has a curve of its own.
            let mut told: Vec<&At> = Vec::new();
            for at in ats {
                if !told.contains(&at) {
                    told.push(at);
                    let its: Vec<PointReport> =
                        report.points.iter().filter(|p| p.at == *at).cloned().collect();
                    curves.push(Curve::bars(format!("{at}, k = 2"), bars(&its)));
                }
            }
        } else if report.points_before.is_empty() {
            curves.push(Curve::bars("measured, k = 2", measured));
        } else {
            curves.push(Curve::bars("with the effects, k = 2", measured));
            curves.push(Curve::bars("second order, k = 2", bars(&report.points_before)));
        }
        if let Some(beside) = &report.beside {
            curves.push(Curve::bars(format!("{}, k = 2", beside.name), bars(&beside.points)));
        }
        if !truth.is_empty() {
            curves.push(Curve::crosses("truth", truth));
        }
        Some(Plot {
            title: format!("{name} per rad"),
            x: Axis::linear("reduced frequency km = pi f l / V"),
            y: Axis::linear(if name == "Cn_r" { "Cn_r - Cn_betadot" } else { name }),
            curves,
        })
    };
    // Beside the values bars are too short to be seen.
    let miss = |(k, (name, of)): (usize, (&str, Of))| {
        let off = |p: &PointReport| {
            let (q, truth) = (of(p)?, p.truth?[k]);
            Some((p.reduced_frequency, q.value - truth, 2.0 * q.u))
        };
        let misses: Vec<(f64, f64, f64)> = report.points.iter().filter_map(off).collect();
        let ends = [misses.first()?.0, misses.last()?.0];
        Some(Plot {
            title: format!("{name}: measured less truth"),
            x: Axis::linear("reduced frequency km = pi f l / V"),
            y: Axis::linear("per rad"),
            curves: vec![
                Curve::bars("measured less truth, k = 2", misses),
                Curve::dashed("no miss", ends.map(|x| (x, 0.0)).to_vec()),
            ],
        })
    };
    Chart {
        name: "derivatives",
        caption: "Derivatives against reduced frequency, bars of two standard uncertainties (k = 2). Cn_r is the \
                  combined damping derivative Cn_r - Cn_betadot: in pure yaw the two are one motion."
            .to_owned(),
        plots: all.into_iter().enumerate().flat_map(|at| [plot(at), miss(at)]).flatten().collect(),
    }
}

/// Zeta of small amplitudes against wind speed with its band, and where it falls through zero.
pub fn critical_speed(all: &[CriticalSpeed]) -> Option<Chart> {
    let plot = |critical: &CriticalSpeed| {
        let line = |k: f64| -> Vec<(f64, f64)> {
            let at = |q: Quantity| q.value + k * q.u;
            critical.damping.iter().map(|d| (d.wind_speed_m_s, at(d.damping_ratio))).collect()
        };
        let speed = critical.wind_speed_m_s;
        // As far as to where it falls through zero, as the law has it.
        let mut law = line(0.0);
        law.push((speed.value, 0.0));
        law.sort_by(|a, b| a.0.total_cmp(&b.0));
        // The band's two edges are one curve, broken by what is no number; so are the speed's.
        let broken = vec![(f64::NAN, f64::NAN)];
        let band = [line(-2.0), broken.clone(), line(2.0)].concat();
        let ends = band.iter().map(|p| p.1).filter(|y| y.is_finite());
        let (low, high) = ends.fold((0.0_f64, 0.0_f64), |(l, h), y| (l.min(y), h.max(y)));
        let upright = |k: f64| [low, high].map(|y| (speed.value + k * speed.u, y)).to_vec();
        let uprights = [upright(-2.0), broken.clone(), upright(0.0), broken, upright(2.0)].concat();
        let speeds = law.iter().chain(&uprights).map(|p| p.0);
        let CriticalSpeed { spring, axis, at, .. } = critical;
        let setting = if at.is_empty() { String::new() } else { format!(", {at}") };
        Plot {
            title: format!("Damping ratio at rest: spring {spring}, axis {axis}{setting}"),
            x: Axis::linear("wind speed V (m/s)").over(speeds),
            y: Axis::linear("zeta at rest"),
            curves: vec![
                Curve::line("at the speeds measured, by the law", law.clone()),
                Curve::dashed("its k = 2", band),
                Curve::dashed(format!("critical speed {speed} m/s, k = 2"), uprights),
            ],
        }
    };
    (!all.is_empty()).then(|| Chart {
        name: "critical_speed",
        caption: "Damping ratio of small amplitudes against wind speed, and the speed from which on the model swings \
                  by itself; bands of two standard uncertainties (k = 2)."
            .to_owned(),
        plots: all.iter().map(plot).collect(),
    })
}

/// Values of a curve in [`residual`].
const RESIDUAL_VALUES: usize = 800;

/// What each model leaves of a record, for a file: the page itself draws this to be zoomed.
pub fn residual(trace: &Trace) -> Chart {
    let time_s = drawn::times(&trace.time_s, RESIDUAL_VALUES);
    let curve = |m: &ModelTrace| {
        let residual = drawn::decimated(&m.residual_deg, RESIDUAL_VALUES);
        Curve::plain(&m.name, time_s.iter().copied().zip(residual).collect())
    };
    Chart {
        name: "residual",
        caption: "Measured less model, decimated by minimum and maximum.".to_owned(),
        plots: vec![Plot {
            title: "Residual: measured less model".to_owned(),
            x: Axis::linear("time from the release (s)"),
            y: Axis::linear(format!("residual ({})", trace.said.measurand().unit())),
            curves: trace.models.iter().map(curve).collect(),
        }],
    }
}

/// Natural frequency, damping ratio and mid-line against amplitude, with what each model predicts.
pub fn amplitude(picture: &AmplitudePicture, truth: Option<[f64; 2]>) -> Chart {
    type Of = fn(&AmplitudePoint) -> Quantity;
    let measurand = picture.said.measurand();
    let mid_line = format!("mid-line ({})", measurand.unit());
    let all: [(&str, &str, Of); 3] = [
        ("Natural frequency", "wn (rad/s)", |p| p.natural_frequency_rad_s),
        ("Damping ratio", "zeta", |p| p.damping_ratio),
        ("Mid-line", &mid_line, |p| p.midline_deg),
    ];
    let plot = |(k, (title, label, of)): (usize, (&str, &str, Of))| {
        let bar = |p: &AmplitudePoint| (p.amplitude_deg, of(p).value, 2.0 * of(p).u);
        let mut curves =
            vec![Curve::bars("measured, k = 2", picture.measured.iter().map(bar).collect())];
        for prediction in &picture.predictions {
            let at = |p: &AmplitudePoint| (p.amplitude_deg, of(p).value);
            curves.push(Curve::plain(&prediction.name, prediction.points.iter().map(at).collect()));
        }
        if let (Some(truth), true) = (truth, k < 2) {
            let ends = picture.measured.iter().map(|p| p.amplitude_deg);
            let (low, high) = ends.fold((f64::MAX, 0.0_f64), |(l, h), a| (l.min(a), h.max(a)));
            curves.push(Curve::dashed("planted", vec![(low, truth[k]), (high, truth[k])]));
        }
        // The axis keeps to the measurement: a candidate far from it would flatten everything else.
        let about = picture.measured.iter();
        let second_order = picture.predictions.first().into_iter().flat_map(|p| p.points.iter());
        let ends = about.clone().map(|p| p.amplitude_deg);
        let reach = about.map(bar).flat_map(|(_, value, bar)| [value - bar, value + bar]);
        Plot {
            title: format!("{title} against amplitude"),
            x: Axis::linear(format!("amplitude ({})", measurand.coordinate_unit())).over(ends),
            y: Axis::linear(label).over(reach.chain(second_order.map(|p| of(p).value))),
            curves,
        }
    };
    Chart {
        name: "amplitude",
        caption: "Three cycles each. The lines are each model's own simulation, cut into windows and fitted as the \
                  measurement is; a second-order model's lie flat. A line ends at the frame where its model is far \
                  from what is measured."
            .to_owned(),
        plots: all.into_iter().enumerate().map(plot).collect(),
    }
}

/// The moment that is missing, on the phase plane's two cuts.
pub fn laws(criticism: &Criticism) -> Option<Chart> {
    let damping = criticism.wheres.iter().map(|(name, w)| {
        let bar = |p: &yawrig_core::diagnosis::compare::DampingPoint| {
            (p.rate_deg_s, p.moment_rad_s2, 2.0 * p.u_rad_s2)
        };
        Curve::bars(name, w.damping_law.iter().map(bar).collect())
    });
    let stiffness = criticism.wheres.iter().map(|(name, w)| {
        let bar = |p: &yawrig_core::diagnosis::compare::StiffnessPoint| {
            (p.yaw_deg, p.moment_rad_s2, 2.0 * p.u_rad_s2)
        };
        Curve::bars(name, w.stiffness_law.iter().map(bar).collect())
    });
    let (damping, stiffness): (Vec<_>, Vec<_>) = (damping.collect(), stiffness.collect());
    if damping.iter().chain(&stiffness).all(|c| c.points.is_empty()) {
        return None;
    }
    let measurand = criticism.said.measurand();
    let moment = format!("moment / Izz ({})", measurand.parameter_unit("rad/s²"));
    let (word, rate) = (measurand.word(), measurand.rate());
    let (of, per_s) = (measurand.coordinate_unit(), measurand.rate_unit());
    Some(Chart {
        name: "laws",
        caption: format!(
            "The moment over the inertia that each model lacks in {}, bars of two standard uncertainties: at zero {word} \
             (the damping law) and at zero rate (the stiffness law).",
            criticism.where_file
        ),
        plots: vec![
            Plot {
                title: format!("Missing moment at zero {word}"),
                x: Axis::linear(format!("{rate} ({per_s})")),
                y: Axis::linear(&moment),
                curves: damping,
            },
            Plot {
                title: "Missing moment at zero rate".to_owned(),
                x: Axis::linear(format!("{word} ({of})")),
                y: Axis::linear(&moment),
                curves: stiffness,
            },
        ],
    })
}

/// Errors and effective parameters over the epochs.
pub fn training(training: &TrainingReport) -> Chart {
    let over = |of: fn(&super::Epoch) -> f64| {
        training.history.iter().map(|e| (e.epoch as f64, of(e))).collect::<Vec<_>>()
    };
    let held_out = |of: fn(&super::HeldOut) -> f64| {
        training.held_out.iter().map(|e| (e.epoch as f64, of(e))).collect::<Vec<_>>()
    };
    Chart {
        name: "training",
        caption: "Rms error over the training windows and over others that are held out, each output going from -1 to 1 \
                  over its range; and the effective number of parameters, which Bayesian regularisation leaves of the network's."
            .to_owned(),
        plots: vec![
            Plot {
                title: format!("Training of {}", training.topology),
                x: Axis::logarithmic("epoch"),
                y: Axis::logarithmic("rms error, scaled"),
                curves: vec![
                    Curve::plain("natural frequency", over(|e| e.natural_frequency_rms)),
                    Curve::plain("damping ratio", over(|e| e.damping_ratio_rms)),
                    Curve::dashed(
                        "natural frequency, held out",
                        held_out(|e| e.natural_frequency_rms),
                    ),
                    Curve::dashed("damping ratio, held out", held_out(|e| e.damping_ratio_rms)),
                ],
            },
            Plot {
                title: "Effective parameters".to_owned(),
                x: Axis::logarithmic("epoch"),
                y: Axis::linear("effective parameters"),
                curves: vec![Curve::plain("effective", over(|e| e.effective_parameters))],
            },
        ],
    }
}
