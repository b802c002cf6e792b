//! Table 4.2 and Fig 4.11: six nodes, then none to eight in a second hidden layer, without noise.

use super::beside_thesis;
use super::decays::{Cycles, Noise};
use super::lab::Spec;
use super::report::{extremes, percent, scientific, times, Outcome, Table};
use super::setting::StudySetting;
use yawrig_base::error::Result;
use yawrig_report::plot::{Axis, Curve, Plot};

/// Nodes of the second layer, then MSE of wn and zeta on the training set and on the test set.
pub(super) const THESIS: [(usize, [f64; 4]); 5] = [
    (0, [6.39e-7, 4.86e-12, 7.81e-4, 2.03e-9]),
    (2, [1.00e-7, 1.11e-12, 1.00e-3, 1.25e-9]),
    (4, [1.08e-8, 2.36e-13, 9.71e-4, 1.69e-9]),
    (6, [1.26e-8, 3.95e-13, 1.12e-4, 2.95e-9]),
    (8, [3.55e-9, 1.22e-13, 9.92e-5, 4.04e-9]),
];

pub(super) fn run(setting: &StudySetting<'_>) -> Result<Outcome> {
    let kind = Cycles::thesis(Noise::None);
    let train = kind.draw(setting.draws(250), 11);
    let test = kind.draw(setting.tests(), 12);
    let epochs = setting.epochs(1000);
    let hidden = |second: usize| if second == 0 { vec![6] } else { vec![6, second] };
    let jobs: Vec<_> =
        THESIS.iter().map(|(j, _)| (&train, Spec::new(&hidden(*j), epochs))).collect();
    let fits = setting.fit_all("second-layer", &jobs)?;
    let mut table = Table::new(
        format!(
            "MSE after {epochs} epochs; the thesis's in brackets ({} test responses)",
            setting.tests()
        ),
        &[&["second", "SSE"], &beside_thesis::COLUMNS[..]].concat(),
    );
    let (mut curve, mut tested, mut all_mse) = (Vec::new(), Vec::new(), Vec::new());
    for ((second, thesis), fit) in THESIS.iter().zip(&fits) {
        let (on_train, on_test) = (fit.errors(&train), fit.errors(&test));
        let ours = beside_thesis::mse(&on_train, &on_test);
        let mut row = vec![second.to_string(), scientific(fit.sse())];
        row.extend(beside_thesis::cells(ours, *thesis, &on_test));
        table.row(row);
        all_mse.push(ours);
        curve.push((*second as f64, fit.sse()));
        tested.push((*second as f64, on_test.damping_ratio_mse));
    }
    let theirs = THESIS.map(|(_, mse)| mse);
    let apart = |all: &[[f64; 4]]| {
        let [wn, zeta] =
            [0, 1].map(|k| extremes(all.iter().map(|mse| mse[k + 2] / mse[k])).map(percent));
        format!("{} to {} times (wn) and {} to {} times (zeta)", wn[0], wn[1], zeta[0], zeta[1])
    };
    let gain = |all: &[[f64; 4]], k: usize| {
        let [least, _] = extremes(all[1..].iter().map(|mse| mse[k]));
        times(least, all[0][k])
    };
    let findings = vec![
        format!(
            "Thesis: with 250 samples the single layer is enough; its test errors are {} its training errors: \
             overfitting. Here: {}.",
            apart(&theirs),
            apart(&all_mse)
        ),
        format!(
            "The best second layer's MSE over that of none, test set: wn {}, zeta {} (thesis {} and {}). Without noise, \
             that is; see noise.",
            gain(&all_mse, 2),
            gain(&all_mse, 3),
            gain(&theirs, 2),
            gain(&theirs, 3)
        ),
    ];
    let plot = Plot {
        title: "A second hidden layer (Fig 4.11)".into(),
        x: Axis::linear("nodes in the second layer"),
        y: Axis::logarithmic("SSE, scaled; MSE of zeta"),
        curves: vec![
            Curve::line("SSE, training set", curve),
            Curve::line("MSE of zeta, test set", tested),
            Curve::dashed(
                "MSE of zeta, test set (thesis)",
                THESIS.iter().map(|(j, mse)| (*j as f64, mse[3])).collect(),
            ),
        ],
    };
    Ok(Outcome { tables: vec![table], findings, plots: vec![plot] })
}
