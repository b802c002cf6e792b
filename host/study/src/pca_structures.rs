//! Figs 5.9 and 5.10 (Table 5.1): twelve structures on 32 components, by noise.

use super::decays::{Noise, WholeRecord};
use super::information;
use super::lab::{Draws, Spec};
use super::pca_samples::{thesis_spec, times_s};
use super::report::{extremes, percent, times, Outcome, Table, NOT_GIVEN};
use super::setting::StudySetting;
use yawrig_base::error::Result;
use yawrig_report::plot::{Axis, Curve, Plot};
use yawrig_train::errors::Errors;
use yawrig_train::Precision;

const FIRST: [usize; 4] = [10, 15, 20, 25];
const SECOND: [usize; 3] = [0, 5, 10];
/// Rms on the impulse response.
const LEVELS: [f64; 4] = [0.02, 0.05, 0.1, 0.2];

pub(super) fn run(setting: &StudySetting<'_>) -> Result<Outcome> {
    let kind = |range| WholeRecord::thesis(Noise::OfImpulseResponse(range));
    let train = kind([0.02, 0.2]).draw(setting.draws(1000), 21);
    let structures: Vec<Vec<usize>> = SECOND
        .iter()
        .flat_map(|&second| {
            FIRST.map(|first| if second == 0 { vec![first] } else { vec![first, second] })
        })
        .collect();
    let spec = |hidden: &Vec<usize>| Spec {
        hidden: hidden.clone(),
        precision: Precision::PerOutput,
        ..thesis_spec(setting.epochs(100))
    };
    let jobs: Vec<_> = structures.iter().map(|hidden| (&train, spec(hidden))).collect();
    let fits = setting.fit_all("pca-structures", &jobs)?;
    let tests: Vec<Draws> = LEVELS.map(|l| kind([l, l]).draw(setting.tests(), 22)).into();
    let mut table = empty_table(setting.tests());
    let (mut curves, mut at_worst) = (Vec::new(), Vec::new());
    for (hidden, fit) in structures.iter().zip(&fits) {
        let errors: Vec<Errors> = tests.iter().map(|test| fit.errors(test)).collect();
        let name = yawrig_train::freeze::name(&fit.topology);
        table.row(fit.row_by_noise(&errors));
        let effective = fit.trained.gamma / fit.trained.weights.len() as f64;
        at_worst.push((hidden.len(), errors[LEVELS.len() - 1], effective));
        if hidden[0] == 20 {
            let points = LEVELS.iter().zip(&errors);
            let points = points.map(|(l, e)| (*l, e.damping_ratio_rms_percent)).collect();
            curves.push(Curve::line(name, points));
        }
    }
    let limits: Vec<_> = LEVELS
        .iter()
        .zip(&tests)
        .map(|(l, test)| information::over(&test.truth, times_s, |t| l / t[0]))
        .collect();
    let mut row = vec!["limit of 160 points".to_owned()];
    row.extend(limits.iter().map(|l| percent(l.natural_frequency_rms_percent)));
    row.extend(limits.iter().map(|l| percent(l.damping_ratio_rms_percent)));
    row.extend([NOT_GIVEN, NOT_GIVEN, NOT_GIVEN].map(str::to_owned));
    table.row(row);
    let points = LEVELS.iter().zip(&limits);
    let points = points.map(|(l, limit)| (*l, limit.damping_ratio_rms_percent)).collect();
    curves.push(Curve::dashed("information limit", points));
    curves.push(Curve::points("thesis (axis of Fig 5.10)", vec![(0.2, 30.0)]));
    let least = |layers: usize, of: fn(&Errors) -> f64| {
        let chosen = at_worst.iter().filter(|(n, _, _)| *n == layers);
        extremes(chosen.map(|(_, errors, _)| of(errors)))[0]
    };
    let rms = |e: &Errors| e.damping_ratio_rms_percent;
    let limit = limits[LEVELS.len() - 1].damping_ratio_rms_percent;
    let [fewest, most] = extremes(at_worst.iter().map(|(_, _, effective)| 100.0 * effective));
    let findings = vec![format!(
        "Thesis: two hidden layers are better than one, errors of wn up to 6 % and of zeta up to 30 % (its axes; how \
         they are averaged it does not say), and no order among the structures for zeta. Here, at {} rms, the least error \
         of zeta with one layer is {} % rms and {} % in the median, with two {} % and {} %: {} and {} the information \
         limit in the rms. {} to {} % of the parameters are effective. The rms is that of a few records of almost no \
         damping, hence the median beside it.",
        LEVELS[LEVELS.len() - 1],
        percent(least(1, rms)),
        percent(least(1, |e| e.damping_ratio_median_percent)),
        percent(least(2, rms)),
        percent(least(2, |e| e.damping_ratio_median_percent)),
        times(least(1, rms), limit),
        times(least(2, rms), limit),
        percent(fewest),
        percent(most)
    )];
    let plot = Plot {
        title: "Error of zeta against noise, first layer of 20 (Fig 5.10)".into(),
        x: Axis::linear("noise, rms on the impulse response"),
        y: Axis::logarithmic("rms error of zeta, %"),
        curves,
    };
    Ok(Outcome { tables: vec![table], findings, plots: vec![plot] })
}

fn empty_table(tests: usize) -> Table {
    let mut header = vec!["structure".to_owned()];
    header.extend(LEVELS.iter().map(|l| format!("wn {l}")));
    header.extend(LEVELS.iter().map(|l| format!("zeta {l}")));
    header.extend(["zeta median".to_owned(), "95 % below".to_owned(), "effective".to_owned()]);
    Table {
        caption: format!(
            "rms errors in % on {tests} test records by noise (rms on the impulse response); medians at 0.2"
        ),
        header,
        rows: Vec::new(),
    }
}
