//! Figs 5.5 and 5.6: how many components, by error and by variance.

use super::decays::{Noise, WholeRecord};
use super::lab::Spec;
use super::pca_samples::thesis_spec;
use super::report::{percent, scientific, times, Outcome, Table, NOT_GIVEN};
use super::setting::StudySetting;
use yawrig_base::error::{Error, Result};
use yawrig_report::plot::{Axis, Curve, Plot};
use yawrig_train::pca::{Projection, Scale};

const COUNTS: [usize; 8] = [10, 15, 20, 25, 30, 32, 45, 60];
/// Read off Fig 5.5's axis: SSE below 0.4 at ten, levelling off at twenty.
const THESIS_SSE_AT_TEN: f64 = 0.4;
const THESIS_SHARE_AT_32: f64 = 80.2;

pub(super) fn run(setting: &StudySetting<'_>) -> Result<Outcome> {
    let kind = WholeRecord::thesis(Noise::None);
    let train = kind.draw(setting.draws(1000), 21);
    let test = kind.draw(setting.tests(), 22);
    let spec = thesis_spec(setting.epochs(150));
    let jobs: Vec<_> = COUNTS
        .iter()
        .map(|&n| (&train, Spec { components: Some((n, Scale::Each)), ..spec.clone() }))
        .collect();
    let fits = setting.fit_all("pca-components", &jobs)?;
    let projection = Projection::new(&train.rows, train.d, 60, Scale::Each)
        .ok_or_else(|| Error::internal("the records have no sixty components"))?;
    let mut table = Table::new(
        format!(
            "n-20-5-2 on {} whole records without noise, {} test records",
            train.truth.len(),
            setting.tests()
        ),
        &[
            "components",
            "variance %",
            "(thesis)",
            "SSE",
            "test wn rms %",
            "test zeta rms %",
            "median %",
            "95 % below",
        ],
    );
    let (mut sse, mut tested) = (Vec::new(), Vec::new());
    for (&n, fit) in COUNTS.iter().zip(&fits) {
        let errors = fit.errors(&test);
        table.row([
            n.to_string(),
            format!("{:.1}", 100.0 * projection.explained(n)),
            if n == 32 { format!("({THESIS_SHARE_AT_32})") } else { NOT_GIVEN.into() },
            scientific(fit.sse()),
            percent(errors.natural_frequency_rms_percent),
            percent(errors.damping_ratio_rms_percent),
            percent(errors.damping_ratio_median_percent),
            percent(errors.damping_ratio_p95_percent),
        ]);
        sse.push((n as f64, fit.sse()));
        tested.push((n as f64, errors.damping_ratio_rms_percent));
    }
    let by_error = |a: &usize, b: &usize| tested[*a].1.total_cmp(&tested[*b].1);
    let best = (0..COUNTS.len()).min_by(by_error).unwrap_or_default();
    let last = COUNTS.len() - 1;
    // Kaiser's criterion is meant for inputs of variance one.
    let mean = projection.variances.iter().sum::<f64>() / projection.variances.len() as f64;
    let kaiser = projection.variances.iter().filter(|v| **v >= mean).count();
    let to_80 = (1..=60).find(|n| projection.explained(*n) >= 0.8).unwrap_or(60);
    // Fig 5.13 ends at 0.04: lightly damped records may have had a larger share.
    let lighter = WholeRecord { small_damping_share: 0.5, ..kind }.draw(setting.draws(1000), 21);
    let lighter = Projection::new(&lighter.rows, lighter.d, 32, Scale::Each)
        .ok_or_else(|| Error::internal("the records have no 32 components"))?;
    let findings = vec![
        format!(
            "Thesis: SSE from {THESIS_SSE_AT_TEN} (its axis) at ten components levels off at twenty; 32 hold {THESIS_SHARE_AT_32} % of \
             the variance. Here 80 % takes {to_80}, 32 hold {:.1} %, and {kaiser} have more than the average variance \
             (Kaiser). It depends on the draws: with half of the records drawn evenly in the logarithm of zeta, 32 hold \
             {:.1} %.",
            100.0 * projection.explained(32),
            100.0 * lighter.explained(32)
        ),
        format!(
            "Least test error of zeta with {} components, {} % rms; with {} the SSE on the training set is {} as large, the \
             test error {}. Appendix D scales each component by its own range, which makes the last, of hardly any \
             variance, as large as the first.",
            COUNTS[best],
            percent(tested[best].1),
            COUNTS[last],
            times(sse[last].1, sse[best].1),
            times(tested[last].1, tested[best].1)
        ),
    ];
    let plots = plots(&projection, sse, tested);
    Ok(Outcome { tables: vec![table], findings, plots })
}

/// `sse` and `tested`: of each number of components.
fn plots(projection: &Projection, sse: Vec<(f64, f64)>, tested: Vec<(f64, f64)>) -> Vec<Plot> {
    let cumulative = (1..=60).map(|n| (n as f64, 100.0 * projection.explained(n))).collect();
    vec![
        Plot {
            title: "SSE and test error against components (Fig 5.5)".into(),
            x: Axis::linear("components"),
            y: Axis::logarithmic("SSE, scaled; rms error of zeta, %"),
            curves: vec![
                Curve::line("SSE, training set", sse),
                Curve::line("zeta rms %, test set", tested),
                Curve::points("SSE, thesis (end of its axis)", vec![(10.0, THESIS_SSE_AT_TEN)]),
            ],
        },
        Plot {
            title: "Variance held by the first components (Fig 5.6 b)".into(),
            x: Axis::linear("components"),
            y: Axis::linear("share of the variance, %"),
            curves: vec![
                Curve::line("here", cumulative),
                Curve::points("thesis", vec![(32.0, THESIS_SHARE_AT_32)]),
            ],
        },
    ]
}
