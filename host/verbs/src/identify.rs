//! `identify`: natural frequency and damping of records.

use super::common::{bar, bare, print, AnalysisArgs};
use super::csv;
use super::releases::ReleaseArg;
use super::trials::{method as name, Trials};
use crate::answer::{self, Drawn, Progress};
use crate::batch::{self, Answer, How, Object, Refused, Tally, SCHEMA_VERSION};
use clap::{Args, ValueEnum};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use yawrig_base::error::{Error, Result};
use yawrig_base::files;
use yawrig_core::identify::cycle::Cycle;
use yawrig_core::identify::flag::Flag;
use yawrig_core::identify::{identify, Identification, Method, WindowEstimate};
use yawrig_core::quantity::{range_in_words, Quantity};
use yawrig_core::record::Record;
use yawrig_records::format;
use yawrig_report::units::sized;

/// Natural frequency and damping ratio of recorded releases, with their uncertainties.
///
/// Release, hold, end and offset are found in the record. A folder stands for the records in it. Exit code 3
/// where any file could not be used.
#[derive(Args, Debug, Clone)]
pub struct Identify {
    /// Records (CSV with time_s,yaw_deg, or another format; -: standard input) or folders of them
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// How
    #[arg(long, value_enum, default_value_t = MethodChoice::LeastSquares)]
    pub method: MethodChoice,
    #[command(flatten)]
    pub release: ReleaseArg,
    #[command(flatten)]
    pub analysis: AnalysisArgs,
    /// Print every window of three cycles, not a dozen of them; of several records all that is known of each,
    /// below their table
    #[arg(long)]
    pub all_windows: bool,
    /// Draw wn and zeta of all records against amplitude into this file
    #[arg(long, value_name = "FILE.svg", conflicts_with_all = ["json", "csv", "jsonl", "out"])]
    pub plot: Option<PathBuf>,
    /// Print one JSON object
    #[arg(short, long, conflicts_with_all = ["jsonl", "out"])]
    pub json: bool,
    /// Print CSV, a row for each record and method, units in the header
    #[arg(long, conflicts_with_all = ["json", "jsonl", "out"])]
    pub csv: bool,
    /// Print a line of JSON for each record
    #[arg(long, conflicts_with = "out")]
    pub jsonl: bool,
    /// Append a line of JSON for each record to this file as it comes; files
    /// that have one are not done again, unless record, options or version have changed
    #[arg(short, long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MethodChoice {
    LeastSquares,
    Conventional,
    Network,
    All,
}

impl MethodChoice {
    pub fn methods(self) -> &'static [Method] {
        match self {
            Self::LeastSquares => &[Method::LeastSquares],
            Self::Conventional => &[Method::Conventional],
            Self::Network => &[Method::Network],
            Self::All => &[Method::LeastSquares, Method::Conventional, Method::Network],
        }
    }
}

impl Identify {
    pub fn run(&self) -> Result<()> {
        let settings = self.analysis.settings()?;
        let files = self.release.of(&expanded(&self.files)?)?;
        if let Some(plot) = &self.plot {
            files::check_writable(plot)?;
        }
        let methods = self.method.methods();
        let selection = self.release.selection()?;
        let how = How { methods, settings: &settings, selection: &selection };
        let tally = if let Some(out) = &self.out {
            let bar = bar(files.len() as u64, "identifying");
            let tally = batch::to_log(&files, how, out, || bar.inc(1))?;
            bar.finish_and_clear();
            let stale = match tally.stale {
                0 => String::new(),
                n => format!(
                    "; {n} of them again: the record, the options or the version had changed"
                ),
            };
            yawrig_base::say!(
                "{}: {} identified, {} refused, {} already there{stale}",
                out.display(),
                tally.identified,
                tally.refused,
                tally.kept
            );
            tally
        } else if self.json {
            json(&files, how)?
        } else if self.csv {
            print(csv::IDENTIFIED)?;
            batch::in_order(&files, how, |answer| {
                complain(&answer);
                match answer {
                    Answer::Identified(found) => print(&csv::identified(&found)),
                    Answer::Refused(_) => Ok(()),
                }
            })?
        } else if self.jsonl {
            batch::in_order(&files, how, |answer| {
                complain(&answer);
                print(&batch::line(answer)?)
            })?
        } else {
            let mut trials = Trials::default();
            let mut each_alone = String::new();
            let bar = bar(files.len() as u64, "identifying");
            let done = batch::in_order(&files, how, |answer| {
                bar.suspend(|| complain(&answer));
                bar.inc(1);
                let Answer::Identified(found) = answer else { return Ok(()) };
                trials.add(&found);
                // One alone, the others refused, is no table.
                if self.all_windows || trials.count() == 1 {
                    let most = if self.all_windows { usize::MAX } else { WINDOWS_SHOWN };
                    each_alone.push_str(&table(&found, most));
                }
                Ok(())
            });
            bar.finish_and_clear();
            // What there is when the user stops it, too.
            let of_all = trials.table();
            if trials.count() > 1 && !self.all_windows {
                each_alone.clear();
            }
            let between = if of_all.is_empty() || each_alone.is_empty() { "" } else { "\n" };
            print(&format!("{of_all}{between}{each_alone}"))?;
            let tally = done?;
            if let Some(file) = self.plot.as_ref().filter(|_| tally.identified > 0) {
                files::write_atomically(file, trials.svg()?.as_bytes())?;
                if trials.not_drawn() > 0 {
                    yawrig_base::say!(
                        "{}: without the last {} records",
                        file.display(),
                        trials.not_drawn()
                    );
                }
            }
            tally
        };
        if tally.refused > 0 {
            let total = tally.refused + tally.identified;
            return Err(Error::data(format!(
                "{} of {total} files could not be used",
                tally.refused
            )));
        }
        Ok(())
    }
}

impl Identify {
    /// The answer about `records`, which are in memory. One that cannot be used is refused in it, or, alone,
    /// an error.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn answer(&self, mut records: Vec<Record>, progress: &Progress) -> Result<answer::Answer> {
        let (settings, methods) = (self.analysis.settings()?, self.method.methods());
        if let [record] = &records[..] {
            let found = identify(record, methods, &settings)?;
            let first = &found.estimates[0];
            let (wn, zeta) = (first.natural_frequency_rad_s, first.damping_ratio);
            let [of_wn, of_zeta] = [
                with_range(wn, first.natural_frequency_range_rad_s),
                with_range(zeta, first.damping_ratio_range),
            ];
            let sentence = format!("natural frequency {of_wn} rad/s, damping ratio {of_zeta}");
            let text = table(&found, WINDOWS_SHOWN);
            let object =
                Object { schema_version: SCHEMA_VERSION, records: vec![found], refused: vec![] };
            let drawn = Drawn::Identified(Box::new(records.remove(0)), [wn.value, zeta.value]);
            return Ok(answer::Answer::new(&object, sentence)?.printed(text).drawn_from(drawn));
        }
        let done = AtomicUsize::new(0);
        let each = || progress(done.fetch_add(1, Ordering::Relaxed) + 1, records.len());
        let object = batch::in_memory(&records, methods, &settings, each)?;
        let (found, refused) = (object.records.len(), object.refused.len());
        answer::Answer::new(&object, format!("{found} identified, {refused} refused"))
    }
}

/// Folders replaced by the records in them, in order of their names.
///
/// # Errors
/// Exit 3 for a folder that cannot be read or has no record in it.
pub fn expanded(files: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut out = Vec::new();
    for file in files {
        if !file.is_dir() {
            out.push(file.clone());
            continue;
        }
        let fail = |e: std::io::Error| Error::data(format!("cannot read {}: {e}", file.display()));
        let mut inside = Vec::new();
        for entry in std::fs::read_dir(file).map_err(fail)? {
            let path = entry.map_err(fail)?.path();
            if format::is_named_so(&path) {
                inside.push(path);
            }
        }
        if inside.is_empty() {
            return Err(Error::data(format!("{}: no record in it", file.display()))
                .help("give a folder that holds records"));
        }
        inside.sort();
        out.extend(inside);
    }
    Ok(out)
}

/// One object, written as the answers come.
fn json(files: &[PathBuf], how: How<'_>) -> Result<Tally> {
    let mut refused: Vec<Refused> = Vec::new();
    let mut separator = "";
    print(&format!(r#"{{"schema_version":{SCHEMA_VERSION},"records":["#))?;
    let tally = batch::in_order(files, how, |answer| {
        complain(&answer);
        match answer {
            Answer::Identified(found) => {
                print(&format!("{separator}{}", to_json(&found)?))?;
                separator = ",";
            }
            Answer::Refused(why) => refused.push(why),
        }
        Ok(())
    })?;
    print(&format!("],\"refused\":{}}}\n", to_json(&refused)?))?;
    Ok(tally)
}

fn to_json(value: &impl serde::Serialize) -> Result<String> {
    serde_json::to_string(value).map_err(|e| Error::internal(e.to_string()))
}

fn complain(answer: &Answer) {
    if let Answer::Refused(why) = answer {
        yawrig_base::say!("yawrig: {}", why.refused);
    }
}

/// Windows that a table of one record shows: as many as tell how wn and zeta go with amplitude.
const WINDOWS_SHOWN: usize = 12;

/// What was found in a record, to be read, with so many of its windows at most.
pub fn table(found: &Identification, most_windows: usize) -> String {
    let mut text = String::new();
    let w = &found.window;
    let measurand = found.said.measurand();
    let quantity = match measurand.is_angle() {
        true => String::new(),
        false => format!(": {} in {}", measurand.recorded(), measurand.unit()),
    };
    let _ = writeln!(
        text,
        "{}{quantity}\n  released at {:.3} s ({}), analysed from {:.3} to {:.3} s ({}), {} to {} {} in {:.1} cycles, {:.2} Hz, noise {} {}, {} outliers",
        found.file,
        found.release_time_s,
        found.begins.words(),
        w.from_s,
        w.to_s,
        found.ends.words(),
        sized(&measurand, w.from_deg, 2),
        sized(&measurand, w.to_deg, 2),
        measurand.coordinate_unit(),
        w.cycles,
        found.rate_hz,
        sized(&measurand, found.noise_rms_deg, 4),
        measurand.unit(),
        found.outliers
    );
    let residual = format!("residual ({})", measurand.unit());
    let mut rows = bare(&["method", "wn (rad/s)", "zeta", &residual]);
    for estimate in &found.estimates {
        rows.add_row([
            name(estimate.method).to_owned(),
            with_range(estimate.natural_frequency_rad_s, estimate.natural_frequency_range_rad_s),
            with_range(estimate.damping_ratio, estimate.damping_ratio_range),
            sized(&measurand, estimate.residual_rms_deg, 4),
        ]);
    }
    let _ = writeln!(text, "{}", rows.trim_fmt());
    if let Some(estimate) = found.estimates.first() {
        let Cycle { frequency_hz, period_s, quality_factor, logarithmic_decrement } =
            &estimate.cycle;
        let q = quality_factor.map_or("none".to_owned(), |q| q.to_string());
        let _ = writeln!(
            text,
            "  frequency {frequency_hz} Hz (damped), period {period_s} s, Q {q}, logarithmic decrement {logarithmic_decrement}"
        );
    }
    for missing in &found.unavailable {
        let _ = writeln!(text, " {} none: {}", name(missing.method), missing.reason);
    }
    text.push_str(&notes(found));
    let windows = found.estimates.iter().find(|e| most_windows > 0 && !e.windows.is_empty());
    if let Some(estimate) = windows {
        let amplitude = format!("amplitude ({})", measurand.coordinate_unit());
        let mut rows = bare(&["time (s)", &amplitude, "wn (rad/s)", "zeta"]);
        let shown = shown(&estimate.windows, most_windows);
        for window in &shown {
            rows.add_row([
                format!("{:.3}", window.time_s),
                sized(&measurand, window.amplitude_deg, 3),
                format!("{:.4}", window.natural_frequency_rad_s),
                format!("{:.5}", window.damping_ratio),
            ]);
        }
        let _ = writeln!(text, "{}", rows.trim_fmt());
        if shown.len() < estimate.windows.len() {
            let (some, all) = (shown.len(), estimate.windows.len());
            let _ = writeln!(text, "  {some} of {all} windows; --all-windows prints every one");
        }
    }
    text
}

/// A value, and how far it changes over the window.
fn with_range(value: Quantity, range: [f64; 2]) -> String {
    match range_in_words(range) {
        Some(range) => format!("{value} ({range})"),
        None => value.to_string(),
    }
}

/// So many of the windows at most, the nearest to evenly spaced logarithms of the amplitude.
fn shown(windows: &[WindowEstimate], most: usize) -> Vec<&WindowEstimate> {
    if windows.len() <= most {
        return windows.iter().collect();
    }
    let ln = |w: &WindowEstimate| w.amplitude_deg.max(f64::MIN_POSITIVE).ln();
    let all = || windows.iter().map(ln);
    let (low, high) =
        (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    let nearest = |k: usize| {
        let at = high + (low - high) * k as f64 / (most - 1) as f64;
        let off = |k: &usize| (ln(&windows[*k]) - at).abs();
        (0..windows.len()).min_by(|a, b| off(a).total_cmp(&off(b)))
    };
    let mut places: Vec<usize> = (0..most).filter_map(nearest).collect();
    places.sort_unstable();
    places.dedup();
    places.into_iter().map(|k| &windows[k]).collect()
}

/// What is to be known of a record and its estimates, a line each.
fn notes(found: &Identification) -> String {
    let (mut text, mut said) = (String::new(), Vec::new());
    for flag in found.estimates.iter().flat_map(|e| &e.flags) {
        if !said.contains(flag) {
            said.push(*flag);
            let whose: Vec<&str> = (found.estimates.iter())
                .filter(|e| e.flags.contains(flag))
                .map(|e| name(e.method))
                .collect();
            // Of one method's values only where others have none such.
            let whose = match whose.len() == found.estimates.len() {
                true => String::new(),
                false => format!("{}: ", whose.join(", ")),
            };
            let more = match flag {
                Flag::SeveralReleases => {
                    let others = found.other_releases.iter();
                    let at: Vec<String> =
                        others.map(|o| format!("{:.3} to {:.3} s", o.from_s, o.to_s)).collect();
                    format!(", and not {}: --release 1 or --release all", at.join(", "))
                }
                _ => String::new(),
            };
            let _ = writeln!(text, "  note: {whose}{}{more}", flag.reason());
        }
    }
    text
}
