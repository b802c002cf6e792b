//! Fig 4.6: one to four cycles of thirty points each, with 6, 8 and 10 hidden nodes.

use super::decays::{Cycles, Noise};
use super::information;
use super::lab::Spec;
use super::report::{course, percent, scientific, Outcome, Table};
use super::setting::StudySetting;
use yawrig_base::error::Result;
use yawrig_report::plot::{Axis, Curve, Plot};

const HIDDEN: [usize; 3] = [6, 8, 10];
/// Noise for which the information limit is shown, share of the peak.
const NOISE: f64 = 0.02;

pub(super) fn run(setting: &StudySetting<'_>) -> Result<Outcome> {
    let kind = |cycles| Cycles { cycles, points: 30 * cycles, ..Cycles::thesis(Noise::None) };
    let sets: Vec<_> = (1..=4).map(|c| kind(c).draw(setting.draws(250), 11)).collect();
    let epochs = setting.epochs(300);
    let jobs: Vec<_> = sets
        .iter()
        .flat_map(|set| HIDDEN.map(|hidden| (set, Spec::new(&[hidden], epochs))))
        .collect();
    let fits = setting.fit_all("cycles", &jobs)?;
    let mut table = Table::new(
        format!(
            "SSE on 250 responses after {epochs} epochs; rms errors on {} others",
            setting.tests()
        ),
        &[
            "cycles",
            "inputs",
            "hidden",
            "SSE",
            "test wn rms %",
            "test zeta rms %",
            "median %",
            "95 % below",
            "zeta limit at 2 % noise",
        ],
    );
    let mut curves: Vec<Curve> =
        HIDDEN.iter().map(|h| Curve::line(format!("{h} hidden nodes"), Vec::new())).collect();
    let (mut least_sse, mut limits) = (Vec::new(), Vec::new());
    for (i, fit) in fits.iter().enumerate() {
        let (cycles, hidden) = (i / HIDDEN.len() + 1, i % HIDDEN.len());
        let test = kind(cycles).draw(setting.tests(), 12);
        let errors = fit.errors(&test);
        let limit = information::over(&test.truth, |t| kind(cycles).times_s(t), |_| NOISE);
        table.row([
            cycles.to_string(),
            (30 * cycles + 1).to_string(),
            HIDDEN[hidden].to_string(),
            scientific(fit.sse()),
            percent(errors.natural_frequency_rms_percent),
            percent(errors.damping_ratio_rms_percent),
            percent(errors.damping_ratio_median_percent),
            percent(errors.damping_ratio_p95_percent),
            percent(limit.damping_ratio_rms_percent),
        ]);
        curves[hidden].points.push((cycles as f64, fit.sse()));
        if hidden == 0 {
            least_sse.push((cycles, fit.sse()));
            limits.push((cycles, limit.damping_ratio_rms_percent));
        }
        least_sse[cycles - 1].1 = least_sse[cycles - 1].1.min(fit.sse());
    }
    let findings = vec![
        format!(
            "Thesis: SSE falls with the cycles, all below 1e-5 (Fig 4.6's axis), and three are enough. Here, without noise, \
             the least SSE of the three sizes by cycles: {}.",
            course(&least_sse, scientific)
        ),
        format!(
            "Noise, which the thesis's study leaves out: the information limit of zeta at 2 % noise in %, by cycles: {}.",
            course(&limits, percent)
        ),
    ];
    let plot = Plot {
        title: "SSE against cycles in the window (Fig 4.6)".into(),
        x: Axis::linear("cycles"),
        y: Axis::logarithmic("SSE, scaled"),
        curves,
    };
    Ok(Outcome { tables: vec![table], findings, plots: vec![plot] })
}
