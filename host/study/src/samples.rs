//! Table 4.1 and Fig 4.9: 50 to 300 training responses for 41-6-2 without noise.

use super::beside_thesis;
use super::decays::{Cycles, Noise};
use super::lab::Spec;
use super::report::{scientific, times, Outcome, Table};
use super::second_layer::THESIS as SECOND_LAYER;
use super::setting::StudySetting;
use yawrig_base::error::Result;
use yawrig_report::plot::{Axis, Curve, Plot};

/// Training samples, then MSE of wn and zeta on the training set and on the test set.
const THESIS: [(usize, [f64; 4]); 6] = [
    (50, [1e-5, 3.4411e-10, 0.8687, 4.65e-6]),
    (100, [1e-5, 7.9773e-10, 0.0488, 4.1554e-8]),
    (150, [1.5e-4, 3.8335e-9, 0.0116, 1.8051e-8]),
    (200, [1.9e-4, 2.0986e-9, 0.0056, 3.9502e-9]),
    (250, [2.1e-3, 5.4253e-9, 0.0052, 1.2479e-8]),
    (300, [1.9e-3, 7.2328e-9, 0.0033, 1.3569e-8]),
];

pub(super) fn run(setting: &StudySetting<'_>) -> Result<Outcome> {
    let epochs = setting.epochs(1000);
    let mut tables = Vec::new();
    let mut curves =
        vec![Curve::dashed("thesis", THESIS.iter().map(|(n, mse)| (*n as f64, mse[2])).collect())];
    let mut zeta_curves =
        vec![Curve::dashed("thesis", THESIS.iter().map(|(n, mse)| (*n as f64, mse[3])).collect())];
    let mut by_features = Vec::new();
    for (name, reciprocal) in [("the thesis's features", false), ("reciprocal duration", true)] {
        let kind = Cycles { reciprocal, ..Cycles::thesis(Noise::None) };
        let all = kind.draw(setting.draws(300), 11);
        let test = kind.draw(setting.tests(), 12);
        let sets: Vec<_> =
            THESIS.map(|(n, _)| all.first(n.min(all.truth.len()))).into_iter().collect();
        let jobs: Vec<_> = sets.iter().map(|set| (set, Spec::new(&[6], epochs))).collect();
        let fits = setting.fit_all("samples", &jobs)?;
        let mut table = Table::new(
            format!("MSE, {name}; the thesis's in brackets ({} test responses)", setting.tests()),
            &[&["samples"], &beside_thesis::COLUMNS[..], &["gamma"]].concat(),
        );
        let (mut wn, mut zeta) = (Vec::new(), Vec::new());
        for (((n, thesis), set), fit) in THESIS.iter().zip(&sets).zip(&fits) {
            let (train, test) = (fit.errors(set), fit.errors(&test));
            let mut row = vec![n.to_string()];
            row.extend(beside_thesis::cells(beside_thesis::mse(&train, &test), *thesis, &test));
            row.push(format!("{:.0}", fit.trained.gamma));
            table.row(row);
            wn.push((*n as f64, test.natural_frequency_mse));
            zeta.push((*n as f64, test.damping_ratio_mse));
        }
        tables.push(table);
        let both =
            wn.iter().zip(&zeta).map(|(wn, zeta): (&(f64, f64), &(f64, f64))| [wn.1, zeta.1]);
        by_features.push(both.collect::<Vec<_>>());
        curves.push(Curve::line(name, wn));
        zeta_curves.push(Curve::line(name, zeta));
    }
    let (at_250, thesis) = (THESIS[4].0, THESIS[4].1);
    let [ours, reciprocal] = [0, 1].map(|k| &by_features[k]);
    let table_4_2 = SECOND_LAYER[0].1[0];
    let findings = vec![
        format!(
            "Thesis: 250 samples are enough, test MSE then {} (rad/s)^2 and {}, and the training error grows with the \
             samples. Here, with the same features and {at_250} samples, {} and {}: {} and {} the thesis's. The thesis's \
             Table 4.2 has the same network at a training MSE of wn of {}, {} that of Table 4.1.",
            scientific(thesis[2]),
            scientific(thesis[3]),
            scientific(ours[4][0]),
            scientific(ours[4][1]),
            times(ours[4][0], thesis[2]),
            times(ours[4][1], thesis[3]),
            scientific(table_4_2),
            times(table_4_2, thesis[0])
        ),
        format!(
            "With the reciprocal of the duration as last input and the points over their rms, wn is nearly proportional to \
             an input: test MSE of wn {} at {at_250} samples and {} at {}, {} that of the thesis's features there.",
            scientific(reciprocal[4][0]),
            scientific(reciprocal[1][0]),
            THESIS[1].0,
            times(reciprocal[1][0], ours[1][0])
        ),
    ];
    let plot = |title: &str, unit: &str, curves| Plot {
        title: title.into(),
        x: Axis::linear("training samples"),
        y: Axis::logarithmic(unit),
        curves,
    };
    let plots = vec![
        plot("Test error of wn (Fig 4.9)", "MSE, (rad/s)^2", curves),
        plot("Test error of zeta (Fig 4.9)", "MSE", zeta_curves),
    ];
    Ok(Outcome { tables, findings, plots })
}
