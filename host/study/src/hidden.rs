//! Fig 4.10: two to fourteen hidden nodes on 250 responses without noise.

use super::decays::{Cycles, Noise};
use super::lab::Spec;
use super::report::{course, percent, scientific, Outcome, Table};
use super::setting::StudySetting;
use yawrig_base::error::Result;
use yawrig_report::plot::{Axis, Curve, Plot};

const HIDDEN: [usize; 7] = [2, 4, 6, 8, 10, 12, 14];

pub(super) fn run(setting: &StudySetting<'_>) -> Result<Outcome> {
    let kind = Cycles::thesis(Noise::None);
    let train = kind.draw(setting.draws(250), 11);
    let test = kind.draw(setting.tests(), 12);
    let epochs = setting.epochs(600);
    let jobs: Vec<_> = HIDDEN.iter().map(|&h| (&train, Spec::new(&[h], epochs))).collect();
    let fits = setting.fit_all("hidden", &jobs)?;
    let mut table = Table::new(
        format!("250 responses, {epochs} epochs, {} test responses", setting.tests()),
        &[
            "hidden",
            "SSE",
            "gamma",
            "of",
            "share %",
            "test wn rms %",
            "test zeta rms %",
            "median %",
            "95 % below",
        ],
    );
    let (mut curve, mut tested, mut shares) = (Vec::new(), Vec::new(), Vec::new());
    for (&h, fit) in HIDDEN.iter().zip(&fits) {
        let errors = fit.errors(&test);
        let parameters = fit.trained.weights.len();
        table.row([
            h.to_string(),
            scientific(fit.sse()),
            format!("{:.0}", fit.trained.gamma),
            parameters.to_string(),
            format!("{:.0}", 100.0 * fit.trained.gamma / parameters as f64),
            percent(errors.natural_frequency_rms_percent),
            percent(errors.damping_ratio_rms_percent),
            percent(errors.damping_ratio_median_percent),
            percent(errors.damping_ratio_p95_percent),
        ]);
        curve.push((h as f64, fit.sse()));
        tested.push((h, errors.damping_ratio_rms_percent));
        shares.push((h, 100.0 * fit.trained.gamma / parameters as f64));
    }
    let findings = vec![format!(
        "Thesis: SSE falls from about 1 at two nodes to 1e-8, and beyond ten nodes only 65 % of the parameters are \
         effective; six are enough. Here SSE by nodes: {}; rms error of zeta on the test set in %: {}; share of effective \
         parameters in %: {}.",
        course(&curve, scientific),
        course(&tested, percent),
        course(&shares, percent)
    )];
    let plot = Plot {
        title: "SSE against hidden nodes (Fig 4.10)".into(),
        x: Axis::linear("hidden nodes"),
        y: Axis::logarithmic("SSE, scaled"),
        curves: vec![Curve::line("41-n-2", curve)],
    };
    Ok(Outcome { tables: vec![table], findings, plots: vec![plot] })
}
