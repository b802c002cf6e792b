//! Fig 4.5: five random starts of 41-6-2 on 250 responses without noise, 2400 epochs.

use super::decays::{Cycles, Noise};
use super::lab::Spec;
use super::report::{extremes, percent, scientific, times, Outcome, Table};
use super::setting::StudySetting;
use yawrig_base::error::Result;
use yawrig_report::plot::{Axis, Curve, Plot};

/// Epochs shown.
const AT: [usize; 5] = [30, 100, 300, 900, 2400];

pub(super) fn run(setting: &StudySetting<'_>) -> Result<Outcome> {
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
    let (mut at_900, mut ended_sse, mut wn_percent) = (Vec::new(), Vec::new(), Vec::new());
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
        ended_sse.push(fit.sse());
        wn_percent.push(errors.natural_frequency_rms_percent);
        let points = history.iter().map(|e| (e.epoch as f64, e.errors.iter().sum())).collect();
        curves.push(Curve::line(format!("start {}", i + 1), points));
    }
    let [low, high] = extremes(fits.iter().map(|f| f.trained.gamma));
    let [sse_low, sse_high] = extremes(at_900);
    let [first, last] = extremes(fits.iter().map(|f| f.trained.epochs as f64));
    let [sse_best, sse_worst] = extremes(ended_sse.iter().copied());
    let [wn_best, wn_worst] = extremes(wn_percent.iter().copied());
    let findings = vec![
        format!(
            "Thesis: the five starts merge at about 900 epochs and end with about the same number of effective \
             parameters. Here: they end by themselves after {first:.0} to {last:.0} epochs, SSE at 900 {} to {}, effective \
             parameters {low:.0} to {high:.0}.",
            scientific(sse_low),
            scientific(sse_high)
        ),
        format!(
            "Where they end, the worst start's SSE is {} the best one's, and its test error of wn {}: {}.",
            times(sse_worst, sse_best),
            times(wn_worst, wn_best),
            match sse_worst < 1.1 * sse_best {
                true => "one minimum",
                false => "not one minimum, so several starts are worth their time, as the thesis advises",
            }
        ),
    ];
    let plot = Plot {
        title: "Five starts of 41-6-2 (Fig 4.5)".into(),
        x: Axis::logarithmic("epoch"),
        y: Axis::logarithmic("SSE, scaled"),
        curves,
    };
    Ok(Outcome { tables: vec![table], findings, plots: vec![plot] })
}
