//! Figs 4.13 to 4.18 and Table 4.5: noise, inputs and structure; then the device's own features at 2 % noise.

use super::decays::{Cycles, Noise};
use super::information::{self, Limit};
use super::lab::{Draws, Fit, Spec};
use super::report::{extremes, percent, scientific, times, Outcome, Table, NOT_GIVEN};
use super::setting::StudySetting;
use yawrig_base::error::Result;
use yawrig_report::plot::{Axis, Curve, Plot};
use yawrig_train::errors::Errors;
use yawrig_train::Precision;

/// Rms on the impulse response.
const LEVELS: [f64; 5] = [0.02, 0.05, 0.1, 0.15, 0.2];
/// Points in the window and hidden layers.
const STRUCTURES: [(usize, &[usize]); 15] = [
    (40, &[6]),
    (40, &[6, 4]),
    (40, &[6, 8]),
    (40, &[12]),
    (40, &[12, 4]),
    (40, &[12, 8]),
    (40, &[20]),
    (40, &[20, 4]),
    (40, &[20, 8]),
    (50, &[6]),
    (50, &[12]),
    (50, &[20]),
    (60, &[6]),
    (60, &[12]),
    (60, &[20]),
];
/// Those that show whether size, a second layer or more points help.
const FEWER: [(usize, &[usize]); 6] =
    [(40, &[6]), (40, &[6, 4]), (40, &[12]), (40, &[20]), (50, &[6]), (60, &[6])];
/// Table 4.5: structure, SSE and effective parameters.
const TABLE_4_5: [(&str, f64, usize); 3] =
    [("41-6-2", 0.7011, 254), ("41-12-2", 0.4274, 499), ("41-20-2", 0.2534, 822)];
/// Of the peak, for the device's own features.
const OF_PEAK: f64 = 0.02;
const ENSEMBLE: usize = 4;

pub(super) fn run(setting: &StudySetting<'_>) -> Result<Outcome> {
    let (mut tables, curves, said) = structures(setting)?;
    let (own, finding) = own_features(setting)?;
    tables.push(own);
    let findings = vec![
        "Thesis: at 0.2 rms below 0.35 % for wn and about 9 % for zeta with 41-6-2; a second layer and more inputs do \
         not help; larger networks overfit; 254 of 266 parameters effective. It says neither how its percentages are \
         averaged nor how many noisy responses it trained on: hence 250 in all, and 250 at each of its ten levels."
            .into(),
        said,
        "The limit is that of unbiased estimates; a network knows the range that the draws come from and may do a \
         little better. The limit of wn does not hold here, since the thesis's duration is known exactly."
            .into(),
        finding,
    ];
    let plots = vec![Plot {
        title: "Noise against the error of zeta (Figs 4.14 to 4.18)".into(),
        x: Axis::linear("noise, rms on the impulse response"),
        y: Axis::linear("rms error of zeta, %"),
        curves,
    }];
    Ok(Outcome { tables, findings, plots })
}

fn kind(points: usize, noise: [f64; 2]) -> Cycles {
    Cycles { points, ..Cycles::thesis(Noise::OfImpulseResponse(noise)) }
}

/// One table: training responses, precision, and what is trained.
struct Part {
    samples: usize,
    precision: Precision,
    structures: &'static [(usize, &'static [usize])],
    epochs: usize,
}

/// 250 responses in all, as many as the thesis has without noise; then 250 at each of its ten noise levels.
const PARTS: [Part; 2] = [
    Part { samples: 250, precision: Precision::Shared, structures: &FEWER, epochs: 300 },
    Part { samples: 2500, precision: Precision::PerOutput, structures: &STRUCTURES, epochs: 100 },
];

fn structures(setting: &StudySetting<'_>) -> Result<(Vec<Table>, Vec<Curve>, String)> {
    let points = [40, 50, 60];
    let tests: Vec<Vec<Draws>> = points
        .iter()
        .map(|&p| LEVELS.iter().map(|&l| kind(p, [l, l]).draw(setting.tests(), 12)).collect())
        .collect();
    let mut tables = Vec::new();
    let mut curves = Vec::new();
    let mut said = String::new();
    for part in &PARTS {
        let sets = points.map(|p| kind(p, [0.02, 0.2]).draw(setting.draws(part.samples), 11));
        let at = |p: usize| points.iter().position(|q| *q == p).unwrap_or(0);
        let spec = |hidden: &[usize]| Spec {
            precision: part.precision,
            ..Spec::new(hidden, setting.epochs(part.epochs))
        };
        let jobs: Vec<(&Draws, Spec)> =
            part.structures.iter().map(|(p, hidden)| (&sets[at(*p)], spec(hidden))).collect();
        let fits = setting.fit_all(&format!("noise, {} responses", part.samples), &jobs)?;
        let mut header = vec!["structure".to_owned()];
        header.extend(LEVELS.iter().map(|l| format!("wn {l}")));
        header.extend(LEVELS.iter().map(|l| format!("zeta {l}")));
        header.extend(["median", "95 % below", "effective"].map(str::to_owned));
        let precision = match part.precision {
            Precision::Shared => "one precision for both outputs",
            Precision::PerOutput => "a precision each",
        };
        let mut table = Table {
            caption: format!(
                "{} training responses, {precision}: rms errors in % on {} test responses by noise (rms on the impulse \
                 response); median and 95th percentile of zeta at 0.2",
                sets[0].truth.len(),
                setting.tests()
            ),
            header,
            rows: Vec::new(),
        };
        let mut at_worst = Vec::new();
        for ((p, hidden), fit) in part.structures.iter().zip(&fits) {
            let errors: Vec<Errors> = tests[at(*p)].iter().map(|test| fit.errors(test)).collect();
            let name = yawrig_train::freeze::name(&fit.topology);
            table.row(fit.row_by_noise(&errors));
            at_worst.push((*p, *hidden, errors[LEVELS.len() - 1]));
            if hidden.len() == 1 && *p == 40 {
                let points = LEVELS.iter().zip(&errors);
                let points = points.map(|(l, e)| (*l, e.damping_ratio_rms_percent)).collect();
                curves.push(Curve::line(format!("{name}, {} responses", part.samples), points));
            }
        }
        tables.push(table);
        said += &compared(part, &fits, &at_worst);
        if part.structures.len() == STRUCTURES.len() {
            tables.push(table_4_5(&fits));
        }
    }
    for (tests, p) in tests.iter().zip(points) {
        let limits: Vec<Limit> = LEVELS
            .iter()
            .zip(tests)
            .map(|(l, test)| {
                information::over(&test.truth, |t| kind(p, [0.0; 2]).times_s(t), |t| l / t[0])
            })
            .collect();
        let mut row = vec![format!("limit of {p} points")];
        row.extend(limits.iter().map(|l| percent(l.natural_frequency_rms_percent)));
        row.extend(limits.iter().map(|l| percent(l.damping_ratio_rms_percent)));
        row.extend([NOT_GIVEN, NOT_GIVEN, NOT_GIVEN].map(str::to_owned));
        for table in tables.iter_mut().filter(|t| t.header.len() == row.len()) {
            table.row(row.clone());
        }
        if p == 40 {
            let points = LEVELS.iter().zip(&limits);
            let points = points.map(|(l, limit)| (*l, limit.damping_ratio_rms_percent)).collect();
            curves.push(Curve::dashed("information limit, 40 points", points));
        }
    }
    curves.push(Curve::points("thesis, 41-6-2", vec![(0.2, 9.0)]));
    Ok((tables, curves, said))
}

/// What a table says at the most noise: against Table 4.5, of one layer and two, of more points.
fn compared(part: &Part, fits: &[Fit], at_worst: &[(usize, &[usize], Errors)]) -> String {
    let mut out = format!("{} responses at {} rms. ", part.samples, LEVELS[LEVELS.len() - 1]);
    for (name, sse, effective) in TABLE_4_5 {
        if let Some(fit) = fits.iter().find(|f| yawrig_train::freeze::name(&f.topology) == name) {
            out += &format!(
                "{name}: SSE {} Table 4.5's, effective parameters {}. ",
                times(fit.sse(), sse),
                times(fit.trained.gamma, effective as f64)
            );
        }
    }
    let least = |points: Option<usize>, layers: usize, of: fn(&Errors) -> f64| {
        let chosen = at_worst.iter().filter(|(p, hidden, _)| {
            hidden.len() == layers && points.is_none_or(|points| points == *p)
        });
        percent(extremes(chosen.map(|(_, _, errors)| of(errors)))[0])
    };
    let median = |e: &Errors| e.damping_ratio_median_percent;
    out += &format!(
        "Least error with one layer and with two, at 40 points: wn {} and {} % rms, zeta {} and {} % rms, {} and {} % median. ",
        least(Some(40), 1, |e| e.natural_frequency_rms_percent),
        least(Some(40), 2, |e| e.natural_frequency_rms_percent),
        least(Some(40), 1, |e| e.damping_ratio_rms_percent),
        least(Some(40), 2, |e| e.damping_ratio_rms_percent),
        least(Some(40), 1, median),
        least(Some(40), 2, median),
    );
    let worst = at_worst.iter().zip(fits).max_by(|a, b| {
        a.0 .2.damping_ratio_rms_percent.total_cmp(&b.0 .2.damping_ratio_rms_percent)
    });
    if let Some(((_, _, errors), fit)) = worst {
        out += &format!(
            "Worst in the rms of zeta is {} with {} %. ",
            yawrig_train::freeze::name(&fit.topology),
            percent(errors.damping_ratio_rms_percent)
        );
    }
    out += &format!(
        "Least median of zeta by points: {} % with 40, {} % with 50, {} % with 60. ",
        least(Some(40), 1, median),
        least(Some(50), 1, median),
        least(Some(60), 1, median)
    );
    out
}

fn table_4_5(fits: &[Fit]) -> Table {
    let mut table = Table::new(
        "Table 4.5: SSE on the training set and effective parameters",
        &["structure", "SSE", "(thesis)", "effective", "(thesis)", "of"],
    );
    for (name, sse, effective) in TABLE_4_5 {
        let Some(fit) = fits.iter().find(|f| yawrig_train::freeze::name(&f.topology) == name)
        else {
            continue;
        };
        table.row([
            name.to_owned(),
            format!("{:.4}", fit.sse()),
            format!("({sse})"),
            format!("{:.0}", fit.trained.gamma),
            format!("({effective})"),
            fit.trained.weights.len().to_string(),
        ]);
    }
    table
}

/// The device's bins with the duration it estimates itself.
fn own_features(setting: &StudySetting<'_>) -> Result<(Table, String)> {
    let windows = |count, seed| Draws::of_windows([OF_PEAK; 2], count, seed);
    let test = windows(setting.tests(), 12)?;
    let sets: Vec<Draws> = (0..ENSEMBLE as u64)
        .map(|i| windows(setting.draws(8000), 100 + i))
        .collect::<Result<_>>()?;
    let spec = |seed| Spec {
        seed,
        precision: Precision::PerOutput,
        ..Spec::new(&[6], setting.epochs(200))
    };
    let jobs: Vec<_> = sets.iter().zip(1..).map(|(set, seed)| (set, spec(seed))).collect();
    let fits = setting.fit_all("device's features", &jobs)?;
    let mean = |row: &[f64]| {
        let sums = fits.iter().map(|f| f.estimate(row));
        let sum = sums.fold([0.0; 2], |s, e| [s[0] + e[0], s[1] + e[1]]);
        sum.map(|s| s / fits.len() as f64)
    };
    let of_mean: Vec<_> = test.each().map(|(row, truth)| (mean(row), truth)).collect();
    let whole = information::over(&test.truth, information::every_millisecond, |_| OF_PEAK);
    let forty =
        information::over(&test.truth, |t| Cycles::thesis(Noise::None).times_s(t), |_| OF_PEAK);
    let mut table = Table::new(
        format!(
            "Noise 2 % of the peak, duration estimated: the device's forty bin means, {} training windows, {} test \
             windows",
            sets[0].truth.len(),
            setting.tests()
        ),
        &["network", "wn rms %", "wn 95 % below", "zeta MSE", "zeta rms %", "median %", "95 % below", "effective"],
    );
    let mut row = |name: String, e: &Errors, gamma: String| {
        table.row([
            name,
            format!("{:.4}", e.natural_frequency_rms_percent),
            format!("{:.4}", e.natural_frequency_p95_percent),
            scientific(e.damping_ratio_mse),
            format!("{:.2}", e.damping_ratio_rms_percent),
            format!("{:.2}", e.damping_ratio_median_percent),
            format!("{:.2}", e.damping_ratio_p95_percent),
            gamma,
        ]);
    };
    for (i, fit) in fits.iter().enumerate() {
        let gamma = format!("{:.0}", fit.trained.gamma);
        row(format!("41-6-2, set {}", i + 1), &fit.errors(&test), gamma);
    }
    let ensemble = Errors::new(&of_mean);
    row(format!("mean of these {ENSEMBLE}"), &ensemble, NOT_GIVEN.into());
    for (name, limit) in [("limit of the whole record", whole), ("limit of 40 points", forty)] {
        table.row([
            name.to_owned(),
            format!("{:.4}", limit.natural_frequency_rms_percent),
            NOT_GIVEN.into(),
            NOT_GIVEN.into(),
            format!("{:.2}", limit.damping_ratio_rms_percent),
            NOT_GIVEN.into(),
            NOT_GIVEN.into(),
            NOT_GIVEN.into(),
        ]);
    }
    let one = fits[0].errors(&test);
    let finding = format!(
        "With means over forty bins of the 1 kHz record, 2 % noise and the duration estimated by the device's own \
         code: wn {:.3} % and zeta {:.2} % rms with one 41-6-2, zeta {:.2} % with the mean of {ENSEMBLE} (thesis, \
         points: 0.35 % and 9 %; the limit of unbiased estimates is {:.2} % from the record and {:.1} % from forty points).",
        one.natural_frequency_rms_percent,
        one.damping_ratio_rms_percent,
        ensemble.damping_ratio_rms_percent,
        whole.damping_ratio_rms_percent,
        forty.damping_ratio_rms_percent
    );
    Ok((table, finding))
}
