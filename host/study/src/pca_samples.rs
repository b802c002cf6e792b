//! Fig 5.4: 500 to 2000 whole records for 32-20-5-2; then more records, drawn differently.

use super::decays::{Noise, WholeRecord, RECORD_POINTS, RECORD_S};
use super::information;
use super::lab::{Draws, Spec};
use super::report::{course, percent, scientific, Outcome, Table, NOT_GIVEN};
use super::setting::StudySetting;
use yawrig_base::error::Result;
use yawrig_report::plot::{Axis, Curve, Plot};
use yawrig_train::errors::Errors;
use yawrig_train::pca::Scale;
use yawrig_train::Precision;

const SAMPLES: [usize; 4] = [500, 1000, 1500, 2000];
/// Thesis's axes end here: wn MSE, zeta MSE.
const THESIS_AXES: [f64; 2] = [3e-3, 4.5e-7];

/// Appendix D's network: 32 components, each to [-1, 1], two hidden layers.
pub(super) fn thesis_spec(epochs: usize) -> Spec {
    Spec { components: Some((32, Scale::Each)), own_last: false, ..Spec::new(&[20, 5], epochs) }
}

/// Times of the points of a whole record, s.
pub(super) fn times_s(_: [f64; 2]) -> Vec<f64> {
    (0..RECORD_POINTS).map(|i| RECORD_S * i as f64 / RECORD_POINTS as f64).collect()
}

/// The thesis's records, over their rms and a third of them drawn evenly in the logarithm of zeta.
pub(super) fn better(noise: Noise) -> WholeRecord {
    WholeRecord { by_rms: true, small_damping_share: 0.3, ..WholeRecord::thesis(noise) }
}

/// One precision each where there is noise, one scale for all components.
pub(super) fn better_spec(noise: f64, epochs: usize) -> Spec {
    let precision = if noise > 0.0 { Precision::PerOutput } else { Precision::Shared };
    Spec { components: Some((32, Scale::Common)), precision, ..thesis_spec(epochs) }
}

pub(super) fn run(setting: &StudySetting<'_>) -> Result<Outcome> {
    let kind = WholeRecord::thesis(Noise::None);
    let all = kind.draw(setting.draws(2000), 21);
    let test = kind.draw(setting.tests(), 22);
    let sets: Vec<Draws> = SAMPLES.map(|n| all.first(n.min(all.truth.len()))).into();
    let spec = thesis_spec(setting.epochs(200));
    let jobs: Vec<_> = sets.iter().map(|set| (set, spec.clone())).collect();
    let fits = setting.fit_all("pca-samples", &jobs)?;
    let mut table = Table::new(
        format!("32-20-5-2, no noise, appendix D's scaling; {} test records", setting.tests()),
        &[
            "samples",
            "train wn MSE",
            "train zeta MSE",
            "test wn MSE",
            "test zeta MSE",
            "zeta rms %",
            "median %",
            "95 % below",
        ],
    );
    let (mut wn, mut zeta) = ([vec![], vec![]], [vec![], vec![]]);
    for ((n, set), fit) in SAMPLES.iter().zip(&sets).zip(&fits) {
        let (on_train, on_test) = (fit.errors(set), fit.errors(&test));
        table.row([
            n.to_string(),
            scientific(on_train.natural_frequency_mse),
            scientific(on_train.damping_ratio_mse),
            scientific(on_test.natural_frequency_mse),
            scientific(on_test.damping_ratio_mse),
            percent(on_test.damping_ratio_rms_percent),
            percent(on_test.damping_ratio_median_percent),
            percent(on_test.damping_ratio_p95_percent),
        ]);
        for (at, e) in [on_train, on_test].iter().enumerate() {
            wn[at].push((*n as f64, e.natural_frequency_mse));
            zeta[at].push((*n as f64, e.damping_ratio_mse));
        }
    }
    let (needed, finding) = as_many_as_it_needs(setting)?;
    let findings = vec![
        format!(
            "Thesis: 1000 samples give proper estimates, 2000 better ones that \"may lead to exhaustion\"; its axes end \
             at {} (rad/s)^2 and {}. Here MSE of zeta by samples, training set: {}; test set: {}.",
            scientific(THESIS_AXES[0]),
            scientific(THESIS_AXES[1]),
            course(&zeta[0], scientific),
            course(&zeta[1], scientific)
        ),
        finding,
    ];
    let plot = |title: &str, unit: &str, [train, test]: [Vec<(f64, f64)>; 2], top: f64| Plot {
        title: title.into(),
        x: Axis::linear("training records"),
        y: Axis::logarithmic(unit),
        curves: vec![
            Curve::line("training set", train),
            Curve::line("test set", test),
            Curve::dashed("end of the thesis's axis", vec![(500.0, top), (2000.0, top)]),
        ],
    };
    let plots = vec![
        plot("Error of wn (Fig 5.4 a)", "MSE, (rad/s)^2", wn, THESIS_AXES[0]),
        plot("Error of zeta (Fig 5.4 b)", "MSE", zeta, THESIS_AXES[1]),
    ];
    Ok(Outcome { tables: vec![table, needed], findings, plots })
}

fn as_many_as_it_needs(setting: &StudySetting<'_>) -> Result<(Table, String)> {
    let cases = [(0.0, 4000), (0.01, 8000)];
    let noise = |level: f64| match level {
        0.0 => Noise::None,
        level => Noise::OfPeak([level; 2]),
    };
    let sets: Vec<Draws> =
        cases.map(|(level, n)| better(noise(level)).draw(setting.draws(n), 21)).into();
    let jobs: Vec<_> = sets
        .iter()
        .zip(cases)
        .map(|(set, (level, _))| (set, better_spec(level, setting.epochs(150))))
        .collect();
    let fits = setting.fit_all("pca-samples, as many as it needs", &jobs)?;
    let mut table = Table::new(
        "32-20-5-2 with one scale for all components, records over their rms, a third of the training records drawn \
         evenly in the logarithm of zeta; tested on even draws",
        &["noise % of peak", "samples", "wn rms %", "limit", "zeta rms %", "limit", "median %", "95 % below"],
    );
    let mut found = Vec::new();
    for ((level, _), (set, fit)) in cases.iter().zip(sets.iter().zip(&fits)) {
        let test = WholeRecord { small_damping_share: 0.0, ..better(noise(*level)) }
            .draw(setting.tests(), 22);
        let errors: Errors = fit.errors(&test);
        let limit = information::over(&test.truth, times_s, |_| *level);
        let given = |x: f64| if *level > 0.0 { percent(x) } else { NOT_GIVEN.into() };
        table.row([
            percent(100.0 * level),
            set.truth.len().to_string(),
            percent(errors.natural_frequency_rms_percent),
            given(limit.natural_frequency_rms_percent),
            format!("{:.2}", errors.damping_ratio_rms_percent),
            given(limit.damping_ratio_rms_percent),
            percent(errors.damping_ratio_median_percent),
            percent(errors.damping_ratio_p95_percent),
        ]);
        found.push((errors, limit));
    }
    let finding = format!(
        "With what it needs, 32-20-5-2 reaches zeta {:.2} % rms without noise and {:.1} % at noise of 1 % of the peak \
         (information limit of the 160 points {:.1} %; thesis: 10 to 30 %, Fig 5.10).",
        found[0].0.damping_ratio_rms_percent,
        found[1].0.damping_ratio_rms_percent,
        found[1].1.damping_ratio_rms_percent
    );
    Ok((table, finding))
}
