//! The report of records: each identified by every method and diagnosed.

use super::answer::{refuses, Answer};
use super::charts::{self, Chart};
use super::criticism::{candidates, capital, effects, pairs, status, steps, verdict, SECOND_ORDER};
use super::trace::{self, values};
use super::{
    Criticism, Estimate, Kind, Made, ReleaseReport, Report, SettingRow, SourceFile, TRACE_NUMBERS,
};
use std::path::PathBuf;
use std::slice::from_ref;
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_core::diagnosis::amplitude::picture;
use yawrig_core::diagnosis::compare::locate;
use yawrig_core::diagnosis::diagnose::{diagnose, Diagnosed, Grouping, Options};
use yawrig_core::fit::at_amplitude::at_amplitudes;
use yawrig_core::fit::fitting::{fit_plain_within, Fitted, Limit, Number, Structure};
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::identify::flag::Flag;
use yawrig_core::identify::{self, identify, Method};
use yawrig_core::quantity::range_in_words;
use yawrig_core::record::{Record, Said};
use yawrig_records::Selection;

/// Candidates whose prediction is drawn: the best of those that improve the fit.
const CANDIDATES: usize = 4;

/// The report of `files`, read as `reading` says.
///
/// # Errors
/// Exit 2 without files; those of [`identify()`] and [`diagnose`], each naming its file.
pub fn of_records(
    files: &[PathBuf],
    reading: &Selection,
    settings: &identify::Settings,
    options: &Options,
    made: Made,
) -> Result<Report> {
    let [first, ..] = files else {
        return Err(Error::usage("there is nothing to report on")
            .help("name records, a campaign.toml, a model.toml or a demo's folder"));
    };
    let title = match files.len() {
        1 => first.display().to_string(),
        n => format!("{n} records"),
    };
    let mut report = Report::new(Kind::Records, title, made);
    report.settings = analysis(settings);
    report.settings.push(SettingRow::new(
        "sensor's zero",
        if options.zero_unknown { "unknown, fitted" } else { "known" },
        "",
    ));
    for effect in &options.own {
        report.settings.push(SettingRow::new("effect of the user's own", effect.id(), ""));
    }
    for file in files {
        interrupt::check()?;
        yawrig_base::say!("judging {}", file.display());
        let record = yawrig_records::read_selected(file, reading)?;
        report.sources.push(SourceFile::new(file)?);
        let methods = [Method::LeastSquares, Method::Conventional, Method::Network];
        let identified = identify(&record, &methods, settings)?;
        let diagnosed = diagnose(from_ref(&record), &Grouping::default(), options)?;
        for warning in &diagnosed.decays[0].warnings {
            yawrig_base::warn!("{warning}");
        }
        let refused = refuses(diagnosed.diagnosis.status, false, diagnosed.last(0));
        let of = |e: &identify::Estimate| Estimate {
            refused,
            ..estimate(e, &diagnosed.decays[0], options.zero_unknown)
        };
        let estimates = identified.estimates.iter().map(of).collect();
        let notes = identified
            .unavailable
            .iter()
            .map(|u| format!("{}: {}: {}", file.display(), method_name(u.method), u.reason));
        report.notes.extend(notes);
        let numbers = TRACE_NUMBERS / files.len();
        let release = release(&record, &diagnosed, estimates, numbers, &mut report.verdict);
        report.releases.push(release);
    }
    if files.len() == 1 {
        report.criticism = report.releases[0].criticism.take();
    } else {
        let count = |wanted: &str| {
            let all = report.releases.iter().filter_map(|r| r.criticism.as_ref());
            all.filter(|c| c.status.as_deref() == Some(wanted)).count()
        };
        let [adequate, explained, mostly, unexplained] =
            ["adequate", "explained", "mostly_explained", "unexplained"].map(count);
        report.verdict = format!(
            "Of {} records the second-order model explains {adequate} as it is, {explained} with effects of the library \
             and {mostly} mostly; {unexplained} remain unexplained.",
            files.len()
        );
    }
    Ok(report)
}

/// The report of a record that was judged, for its drawings: without the estimates of methods.
pub fn of_diagnosed(record: &Record, diagnosed: &Diagnosed) -> Report {
    let made = Made::now(String::new());
    let mut report = Report::new(Kind::Records, record.file.display().to_string(), made);
    let mut release = release(record, diagnosed, Vec::new(), TRACE_NUMBERS, &mut report.verdict);
    report.criticism = release.criticism.take();
    report.releases.push(release);
    report
}

/// The drawings of a free decay beside `models`.
pub fn drawn_of(decay: &FreeDecay, models: &[(&str, &Fitted)]) -> [Chart; 2] {
    let trace = trace::of(decay, models, values(TRACE_NUMBERS, 2 + 2 * models.len()));
    [charts::residual(&trace), charts::amplitude(&picture(decay, models), None)]
}

/// How releases are analysed.
pub(super) fn analysis(settings: &identify::Settings) -> Vec<SettingRow> {
    vec![
        SettingRow::new("analysed from", settings.from_deg, "deg"),
        SettingRow::new("analysed down to", settings.to_deg, "deg"),
    ]
}

pub(super) fn method_name(method: Method) -> &'static str {
    match method {
        Method::LeastSquares => "least-squares",
        Method::Conventional => "conventional",
        Method::Network => "network",
    }
}

/// Residual over noise of the second-order model with these values, as everywhere on block means: the
/// release's own initial state is fitted, and its zero where that is unknown.
pub(super) fn over_noise(
    decay: &FreeDecay,
    natural_frequency_rad_s: f64,
    damping_ratio: f64,
    zero_unknown: bool,
) -> f64 {
    let fixed = |number, value| Limit { number, low: value, high: value };
    let structure = Structure {
        zero_unknown,
        limits: vec![
            fixed(Number::NaturalFrequency, natural_frequency_rad_s),
            fixed(Number::DampingRatio, damping_ratio),
        ],
        ..Structure::default()
    };
    fit_plain_within(decay, &structure, decay.yaw_rad.len()).over_noise(decay)
}

fn estimate(estimate: &identify::Estimate, decay: &FreeDecay, zero_unknown: bool) -> Estimate {
    let (wn, zeta) = (estimate.natural_frequency_rad_s, estimate.damping_ratio);
    Estimate {
        method: method_name(estimate.method).to_owned(),
        natural_frequency_rad_s: estimate.natural_frequency_rad_s,
        damping_ratio: estimate.damping_ratio,
        residual_rms_deg: Some(estimate.residual_rms_deg),
        residual_over_noise: Some(over_noise(decay, wn.value, zeta.value, zero_unknown)),
        refused: false,
        remarks: estimate.flags.iter().map(|flag| remark(estimate, *flag)).collect(),
    }
}

/// What a flag says, and how far what changes with amplitude does so.
fn remark(estimate: &identify::Estimate, flag: Flag) -> String {
    let range = match flag {
        Flag::AmplitudeDependentFrequency => estimate.natural_frequency_range_rad_s,
        Flag::AmplitudeDependentDamping => estimate.damping_ratio_range,
        _ => return flag.reason().to_owned(),
    };
    range_in_words(range)
        .map_or(flag.reason().to_owned(), |range| format!("{}, which has {range}", flag.reason()))
}

fn release(
    record: &Record,
    diagnosed: &Diagnosed,
    estimates: Vec<Estimate>,
    numbers: usize,
    sentence: &mut String,
) -> ReleaseReport {
    let Diagnosed { diagnosis: d, decays, singles, path } = diagnosed;
    let decay = &decays[0];
    *sentence = verdict(d);
    let (plain, last) = (&path[0][0], diagnosed.last(0));
    let with = with_effects(last);
    let mut models: Vec<(&str, &Fitted)> = vec![(SECOND_ORDER, plain)];
    if path.len() > 1 {
        models.push((&with, last));
    }
    let values_of = d.steps.last().map(|s| s.parameters.clone()).unwrap_or_default();
    let wheres = models.iter().map(|(n, m)| ((*n).to_owned(), locate(decay, m))).collect();
    let criticism = Criticism {
        said: d.said.clone(),
        status: Some(status(d.status)),
        sentences: std::iter::once(capital(&d.sentence)).chain(d.refusals()).collect(),
        steps: steps(&d.steps, SECOND_ORDER),
        held_out: d.held_out.words().to_owned(),
        candidates: candidates(&d.candidates),
        effects: effects(&d.said.measurand(), &d.effects, &values_of),
        indistinguishable: pairs(&d.indistinguishable),
        wheres,
        where_file: record.file.display().to_string(),
    };
    let verdict = &d.releases[0];
    let over_noise = verdict.residual_over_noise;
    let answer = Answer::new(&with, &verdict.modal, &criticism.effects, over_noise);
    // In the order of their evidence.
    let alone = d.candidates.iter().filter(|c| c.converged && c.delta_bic > 0.0).filter_map(|c| {
        let of = |single: &&Fitted| single.structure.effects.last() == Some(&c.effect);
        Some((c.effect.id(), singles.iter().find(of)?))
    });
    let mut drawn = models.clone();
    let known = |effects: &[yawrig_core::effects::Effect]| effects == last.structure.effects;
    drawn.extend(alone.filter(|(_, m)| !known(&m.structure.effects)).take(CANDIDATES));
    drawn_release(
        record,
        decay,
        &models,
        &drawn,
        numbers,
        ReleaseReport {
            estimates,
            answer: Some(answer),
            criticism: Some(criticism),
            ..blank(record.file.display().to_string())
        },
    )
}

/// `second order + coulomb_friction`.
pub fn with_effects(model: &Fitted) -> String {
    let ids = model.structure.effects.iter().map(|e| format!(" + {e}"));
    format!("{SECOND_ORDER}{}", ids.collect::<String>())
}

pub(super) fn blank(name: String) -> ReleaseReport {
    ReleaseReport {
        name,
        condition: None,
        held_out: false,
        samples: 0,
        rate_hz: 0.0,
        noise_rms_deg: None,
        said: Said::default(),
        residual_over_noise: Vec::new(),
        estimates: Vec::new(),
        truth: None,
        trace: None,
        amplitude: None,
        at_amplitude: Vec::new(),
        answer: None,
        criticism: None,
    }
}

/// `release` with its drawings: `models` over the record, `predicted` over amplitude.
pub(super) fn drawn_release(
    record: &Record,
    decay: &FreeDecay,
    models: &[(&str, &Fitted)],
    predicted: &[(&str, &Fitted)],
    numbers: usize,
    release: ReleaseReport,
) -> ReleaseReport {
    ReleaseReport {
        samples: record.len(),
        rate_hz: record.timing().rate_hz,
        noise_rms_deg: Some(decay.measurand.shown(decay.sample_noise_rad)),
        said: decay.measurand.said(),
        residual_over_noise: models.iter().map(|(_, m)| m.over_noise(decay)).collect(),
        trace: Some(trace::of(decay, models, values(numbers, 2 + 2 * models.len()))),
        amplitude: Some(picture(decay, predicted)),
        at_amplitude: models.last().map_or_else(Vec::new, |(_, m)| at_amplitudes(decay, m)),
        ..release
    }
}
