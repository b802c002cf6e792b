//! Fig 4.5: five random starts of 41-6-2 on 250 responses without noise, 2400 epochs.

use super::decays::{Cycles, Noise};
use super::lab::Spec;
use super::report::{percent, scientific, Report, Table};
use super::{reported, Setting};
use crate::plot::{Axis, Curve, Plot};
use yawrig_base::error::Result;

/// Epochs shown.
const AT: [usize; 5] = [30, 100, 300, 900, 2400];

pub(super) fn run(setting: &Setting<'_>) -> Result<Report> {
    let kind = Cycles::thesis(Noise::None);
    let train = kind.draw(setting.draws(250), 11);
    let test = kind.draw(setting.tests(), 12);
    let epochs = setting.epochs(2400);
    let jobs: Vec<_> =
        (1..=5).map(|seed| (&train, Spec { seed, ..Spec::new(&[6], epochs) })).collect();
    let fits = setting.fit_all("starts", &jobs)?;
    let mut header = vec!["start".to_owned()];
    header.extend(AT.iter().map(|at| format!("SSE at {at}")));
    header.extend(["gamma", "epochs", "test wn rms %", "test zeta rms %"].map(str::to_owned));
    let mut table = Table {
        caption: "SSE on the training set (scaled units), effective parameters of 266".into(),
        header,
        rows: Vec::new(),
    };
    let mut curves = Vec::new();
    let mut at_900 = Vec::new();
    for (i, fit) in fits.iter().enumerate() {
        let history = &fit.trained.history;
        let sse = |at: usize| -> f64 {
            let epoch = &history[at.min(history.len()) - 1];
            epoch.errors.iter().sum()
        };
        let errors = fit.errors(&test);
        let mut row = vec![format!("{}", i + 1)];
        row.extend(AT.map(|at| scientific(sse(at))));
        row.push(format!("{:.0}", fit.trained.gamma));
        row.push(fit.trained.epochs.to_string());
        row.push(percent(errors.natural_frequency_rms_percent));
        row.push(percent(errors.damping_ratio_rms_percent));
        table.row(row);
        at_900.push(sse(900));
        let points = history.iter().map(|e| (e.epoch as f64, e.errors.iter().sum())).collect();
        curves.push(Curve::line(format!("start {}", i + 1), points));
    }
    let gammas: Vec<f64> = fits.iter().map(|f| f.trained.gamma).collect();
    let (low, high) = extremes(&gammas);
    let (sse_low, sse_high) = extremes(&at_900);
    let ended: Vec<f64> = fits.iter().map(|f| f.trained.epochs as f64).collect();
    let (first, last) = extremes(&ended);
    let findings = vec![
        format!(
            "Thesis: the five starts merge at about 900 epochs and end with about the same number of effective \
             parameters. Here: they end by themselves after {first:.0} to {last:.0} epochs, SSE {} to {}, effective \
             parameters {low:.0} to {high:.0}.",
            scientific(sse_low),
            scientific(sse_high)
        ),
        "They merge earlier, since each step is bent along the valley (a second solve with the same factor), and not \
         into one minimum: the duration has to be bent into a frequency, which a network can do in better and worse \
         ways. Several starts, chosen by evidence, are worth their time, as the thesis advises."
            .into(),
    ];
    let plot = Plot {
        title: "Five starts of 41-6-2 (Fig 4.5)".into(),
        x: Axis::logarithmic("epoch"),
        y: Axis::logarithmic("SSE, scaled"),
        curves,
    };
    reported("starts", vec![table], findings, vec![plot])
}

fn extremes(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)))
}
