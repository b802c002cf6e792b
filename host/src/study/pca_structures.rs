//! Figs 5.9 and 5.10 (Table 5.1): twelve structures on 32 components, by noise.

use super::decays::{Noise, WholeRecord};
use super::information;
use super::lab::{Draws, Spec};
use super::pca_samples::{thesis_spec, times_s};
use super::report::{percent, Report, Table, NOT_GIVEN};
use super::{reported, Setting};
use crate::plot::{Axis, Curve, Plot};
use yawrig_base::error::Result;
use yawrig_train::errors::Errors;
use yawrig_train::Precision;

const FIRST: [usize; 4] = [10, 15, 20, 25];
const SECOND: [usize; 3] = [0, 5, 10];
/// Rms on the impulse response.
const LEVELS: [f64; 4] = [0.02, 0.05, 0.1, 0.2];

pub(super) fn run(setting: &Setting<'_>) -> Result<Report> {
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
    let mut header = vec!["structure".to_owned()];
    header.extend(LEVELS.iter().map(|l| format!("wn {l}")));
    header.extend(LEVELS.iter().map(|l| format!("zeta {l}")));
    header.extend(["zeta median".to_owned(), "95 % below".to_owned(), "effective".to_owned()]);
    let mut table = Table {
        caption: format!(
            "rms errors in % on {} test records by noise (rms on the impulse response); medians at 0.2",
            setting.tests()
        ),
        header,
        rows: Vec::new(),
    };
    let mut curves = Vec::new();
    for (hidden, fit) in structures.iter().zip(&fits) {
        let errors: Vec<Errors> = tests.iter().map(|test| fit.errors(test)).collect();
        let name = yawrig_train::freeze::name(&fit.topology);
        table.row(fit.row_by_noise(&errors));
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
    let findings = vec![
        "Thesis: two hidden layers are better than one, errors of wn up to 6 % and of zeta up to 30 % (its axes; how \
         they are averaged it does not say), and no order among the structures for zeta. Here two layers are better \
         too, and there is no order among them. The rms is that of a few records of almost no damping, hence the \
         median beside it. All lie far above the information limit, nearly all parameters are effective: a thousand \
         records are too few (see pca-samples), and appendix D's scaling brings components of little variance, mostly \
         noise, to the size of the others."
            .into(),
    ];
    let plot = Plot {
        title: "Error of zeta against noise, first layer of 20 (Fig 5.10)".into(),
        x: Axis::linear("noise, rms on the impulse response"),
        y: Axis::logarithmic("rms error of zeta, %"),
        curves,
    };
    reported("pca-structures", vec![table], findings, vec![plot])
}
