//! What several verbs share: options, bars and JSON on stdout.

use super::choices::{Decay, SpectralPeak};
use clap::Args;
use comfy_table::Table;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use std::collections::HashSet;
use std::io::{IsTerminal, Write};
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_base::files;
use yawrig_campaign::simulated::refuse_existing;
use yawrig_core::effects::{Effect, MAX_OWN};
use yawrig_core::identify::conventional;
use yawrig_core::identify::Settings;
use yawrig_model::effects;

/// Version of every JSON object this program prints.
pub const SCHEMA_VERSION: u32 = 1;

/// How releases are analysed.
#[derive(Args, Debug, Clone)]
pub struct AnalysisArgs {
    /// Amplitude at which the analysis starts [default: 10]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    pub from_deg: Option<f64>,
    /// Amplitude at which it ends [default: 1]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    pub to_deg: Option<f64>,
    /// Conventional method: how the damped frequency is read off the spectrum
    #[arg(long, value_enum, default_value_t)]
    pub spectral_peak: SpectralPeak,
    /// Conventional method: how the decay is read off the maxima
    #[arg(long, value_enum, default_value_t)]
    pub decay: Decay,
}

impl AnalysisArgs {
    /// # Errors
    /// Exit 2 for amplitudes between which there is no window.
    pub fn settings(&self) -> Result<Settings> {
        let usual = Settings::default();
        let from_deg = self.from_deg.unwrap_or(usual.from_deg);
        let to_deg = self.to_deg.unwrap_or(usual.to_deg);
        within("--from-deg", from_deg, 0.0, MAX_DEG)?;
        if !(to_deg > 0.0 && from_deg > to_deg) {
            return Err(Error::usage(format!(
                "--from-deg {from_deg} and --to-deg {to_deg}: no amplitude window"
            ))
            .help("give a larger --from-deg than --to-deg, both above 0"));
        }
        Ok(Settings {
            from_deg,
            to_deg,
            only_between: self.from_deg.is_some() || self.to_deg.is_some(),
            conventional: conventional::Options {
                spectral_peak: self.spectral_peak.into(),
                decay: self.decay.into(),
            },
        })
    }
}

/// Ten turns: what a torsion pendulum is wound up by.
const MAX_DEG: f64 = 3600.0;

#[derive(Args, Debug, Clone)]
pub struct EffectsArg {
    /// An effect of the library by its id, or your own from a file ending in .toml (repeatable)
    #[arg(long = "effect", value_name = "EFFECT")]
    effects: Vec<String>,
}

impl EffectsArg {
    /// The user's own among them, each with its file.
    ///
    /// # Errors
    /// As [`Self::effects`].
    pub fn own_files(&self) -> Result<Vec<(Effect, String)>> {
        let files = self.effects.iter().filter(|text| effects::is_file(text));
        files.map(|file| Ok((effects::named(file)?, file.clone()))).collect()
    }

    /// # Errors
    /// Exit 2 for an id that there is not, or too many own effects; exit 3 for a file that cannot be used.
    pub fn effects(&self) -> Result<Vec<Effect>> {
        let named = self.effects.iter().map(|text| effects::named(text));
        let effects = effects::distinct(named.collect::<Result<_>>()?)?;
        let own: HashSet<&Effect> = effects.iter().filter(|e| e.is_own()).collect();
        if own.len() > MAX_OWN {
            return Err(Error::usage(format!("--effect: more than {MAX_OWN} effects of your own"))
                .help("take fewer at a time"));
        }
        Ok(effects)
    }
}

/// Prints one JSON object on stdout.
pub fn print_json(value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value)
        .map_err(|e| Error::internal(format!("cannot write JSON: {e}")))?;
    print_line(&text)
}

/// Prints one JSON object on a line of stdout, at once.
pub fn print_json_line(value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string(value)
        .map_err(|e| Error::internal(format!("cannot write JSON: {e}")))?;
    print_line(&text)
}

/// Prints a line on stdout, at once.
///
/// # Errors
/// As [`print()`].
pub fn print_line(text: &str) -> Result<()> {
    print(&format!("{text}\n"))
}

/// Prints on stdout, at once.
///
/// # Errors
/// A reader that has gone away (`| head`) ends the program quietly, as it does others.
pub fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    let done = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    match done {
        Ok(()) => Ok(()),
        Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => std::process::exit(0),
        Err(e) => Err(Error::internal(format!("cannot write to stdout: {e}"))),
    }
}

/// A table without lines, its columns but the first to the right.
pub fn bare(header: &[&str]) -> Table {
    with_words(header, &[])
}

/// The same, where the columns of these numbers hold words and go to the left.
pub fn with_words(header: &[&str], words: &[usize]) -> Table {
    let mut table = Table::new();
    table.load_preset(comfy_table::presets::NOTHING).set_header(header);
    for (k, column) in table.column_iter_mut().enumerate() {
        if k > 0 && !words.contains(&k) {
            column.set_cell_alignment(comfy_table::CellAlignment::Right);
        }
    }
    table
}

/// `text` in lines of at most `width` columns, the further ones with `indent` before them; a longer word has
/// its own.
pub fn wrapped(text: &str, width: usize, indent: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            Some(_) => lines.push(format!("{indent}{word}")),
            None => lines.push(word.to_owned()),
        }
    }
    lines
}

/// A bar on stderr where that is a terminal, else nothing.
pub fn bar(length: u64, what: &'static str) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{msg:12} [{bar:40}] {pos}/{len} {elapsed}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length).with_style(style).with_message(what)
}

/// The network's identity as files and screens show it.
pub fn network_id(id: u32) -> String {
    format!("{id:08x}")
}

/// Whether a flag's value makes sense.
///
/// # Errors
/// Exit 2, naming the flag, for a value that is not between the two.
pub fn within(flag: &str, value: f64, least: f64, most: f64) -> Result<()> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(Error::usage(format!("{flag} {value} is not between {least} and {most}"))
        .help(format!("give {flag} a value in that range")))
}

/// Whether these files can be written in `folder`, which may not be there yet.
///
/// # Errors
/// Exit 2 where one is there and `force` is not set, 3 where there is no room.
pub fn writable(folder: &Path, force: bool, files: &[&str]) -> Result<()> {
    if folder.exists() && !folder.is_dir() {
        return Err(files::cannot_write(folder, &"it is a file, and a folder is wanted"));
    }
    if !folder.is_dir() {
        return files::check_writable(folder);
    }
    for file in files.iter().map(|name| folder.join(name)) {
        if !force {
            refuse_existing(&file)?;
        }
        files::check_writable(&file)?;
    }
    Ok(())
}
