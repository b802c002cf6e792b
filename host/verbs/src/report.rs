//! `report`: one page about records, a campaign, a model or a demo.

use super::common::{print_json, print_line, AnalysisArgs, EffectsArg};
use super::identify::expanded;
use super::model::asked;
use super::releases::ReleaseArg;
use crate::answer::Answer;
use clap::Args;
use serde::de::IgnoredAny;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_base::files;
use yawrig_base::interrupt;
use yawrig_campaign::simulated::{refuse_existing, CAMPAIGN_FILE};
use yawrig_core::diagnosis::diagnose::Options;
use yawrig_model::document::{is_model, DEFAULT};
use yawrig_report::{
    charts, data, html, of_campaign, of_model, of_models, of_records, xlsx, Also, Kind, Made,
    Report,
};

/// What a demo keeps in its folder: its findings as a report's data.
pub const DEMO_FILE: &str = "demo.json";

/// Write what is known of records, a campaign, a model or a demo to one HTML file that needs no network.
///
/// Records are identified by every method and diagnosed; a campaign.toml comes to its derivatives and to what
/// its releases lack; a model.toml to its journal and how far it is from its records; a demo's folder to what
/// it found, beside the truth. Data, settings, versions and the command are in the page: --data takes the
/// data out again.
#[derive(Args, Debug, Clone)]
pub struct ReportArgs {
    /// Records, one campaign.toml, one model.toml, or the folder of a demo
    #[arg(value_name = "FILE|FOLDER", required_unless_present = "data")]
    pub files: Vec<PathBuf>,
    /// Where the page goes
    #[arg(short, long, value_name = "FILE", default_value = "report.html")]
    pub out: PathBuf,
    /// Overwrite what is there
    #[arg(long)]
    pub force: bool,
    /// Write the page's drawings to this folder, too, one SVG each
    #[arg(long, value_name = "FOLDER")]
    pub pictures: Option<PathBuf>,
    /// Write all tables to this workbook, too
    #[arg(long, value_name = "FILE.xlsx")]
    pub xlsx: Option<PathBuf>,
    /// Another campaign.toml, or the report of one, beside this campaign's derivatives
    #[arg(long, value_name = "OTHER")]
    pub beside: Option<PathBuf>,
    #[command(flatten)]
    pub release: ReleaseArg,
    #[command(flatten)]
    pub analysis: AnalysisArgs,
    #[command(flatten)]
    pub effects: EffectsArg,
    /// The sensor was not zeroed: fit its zero, and leave out the constant moment
    #[arg(long)]
    pub unknown_zero: bool,
    /// Print the report's data as one JSON object
    #[arg(short, long)]
    pub json: bool,
    /// Print the data that a report holds, and write nothing
    #[arg(long, value_name = "REPORT.html", exclusive = true)]
    pub data: Option<PathBuf>,
}

impl ReportArgs {
    pub fn run(&self) -> Result<()> {
        if let Some(page) = &self.data {
            return taken_out(page);
        }
        let report = self.written(asked(None).command)?;
        match self.json {
            true => print_json(&report),
            false => print_line(&self.out.display().to_string()),
        }
    }

    /// The report's data, as `--json` prints them; `command` is what the page says it was made by.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn answer(&self, command: String) -> Result<Answer> {
        Answer::new(&self.written(command)?, self.out.display().to_string())
    }

    fn written(&self, command: String) -> Result<Report> {
        self.check()?;
        let report = self.report(command)?;
        write(&report, &self.out)?;
        if let Some(file) = &self.xlsx {
            files::write_atomically(file, &xlsx::workbook(&report)?)?;
            yawrig_base::say!("{}", file.display());
        }
        for chart in self.pictures.iter().flat_map(|_| charts::of(&report)) {
            let file = self.picture(chart.name);
            files::write_atomically(&file, chart.file()?.as_bytes())?;
            yawrig_base::say!("{}", file.display());
        }
        Ok(report)
    }

    fn picture(&self, name: &str) -> PathBuf {
        self.pictures.as_deref().unwrap_or(Path::new("")).join(format!("{name}.svg"))
    }

    /// Whether there is room, asked before the work.
    fn check(&self) -> Result<()> {
        for file in [Some(&self.out), self.xlsx.as_ref()].into_iter().flatten() {
            if !self.force {
                refuse_existing(file)?;
            }
            files::check_writable(file)?;
        }
        let Some(folder) = &self.pictures else { return Ok(()) };
        files::make_folder(folder)?;
        match charts::NAMES.iter().map(|name| self.picture(name)).find(|file| file.exists()) {
            Some(file) if !self.force => refuse_existing(&file),
            _ => files::check_writable(&self.picture(charts::NAMES[0])),
        }
    }

    fn report(&self, command: String) -> Result<Report> {
        let settings = self.analysis.settings()?;
        let own = self.effects.effects()?;
        let options = Options {
            zero_unknown: self.unknown_zero,
            own,
            stop: interrupt::stop(),
            ..Options::default()
        };
        let made = Made::now(command);
        let also = Also { settings: &settings, options: &options, beside: self.beside.as_deref() };
        let report = self.of_files(&also, made)?;
        match (&self.beside, report.kind) {
            (Some(_), kind) if kind != Kind::Campaign => {
                Err(Error::usage("--beside without a campaign").help(
                    "name a campaign.toml, whose derivatives another's are put beside: yawrig report campaign.toml --beside OTHER.toml",
                ))
            }
            _ => Ok(report),
        }
    }

    fn of_files(&self, also: &Also, made: Made) -> Result<Report> {
        let Also { settings, options, .. } = *also;
        match self.files.as_slice() {
            [folder] if folder.is_dir() => self.of_folder(folder, also, made),
            [file] if is_toml(file) && is_model(file) => of_model(file, made),
            files if files.len() > 1 && files.iter().all(|f| is_toml(f) && is_model(f)) => {
                of_models(files, made)
            }
            [file] if is_toml(file) => of_campaign(file, also, made),
            files => {
                if let Some(other) = files.iter().find(|f| is_toml(f) || f.is_dir()) {
                    return Err(Error::usage(format!("{} beside other files", other.display()))
                        .help(
                        "report on several records or several models at once, but on a campaign or a folder alone",
                    ));
                }
                of_records(
                    &self.release.of(files)?,
                    &self.release.selection()?,
                    settings,
                    options,
                    made,
                )
            }
        }
    }

    fn of_folder(&self, folder: &Path, also: &Also, made: Made) -> Result<Report> {
        let [demo, model, campaign] =
            [DEMO_FILE, DEFAULT, CAMPAIGN_FILE].map(|name| folder.join(name));
        if demo.exists() {
            return of_demo(&demo);
        }
        if model.exists() {
            return of_model(&model, made);
        }
        if campaign.exists() {
            return of_campaign(&campaign, also, made);
        }
        let records = expanded(&[folder.to_owned()]).map_err(|_| {
            Error::data(format!(
                "{}: there is neither {DEMO_FILE} nor {DEFAULT} nor {CAMPAIGN_FILE} nor a record in it",
                folder.display(),
            ))
            .help("give a folder that holds one of them")
        })?;
        of_records(&records, &self.release.selection()?, also.settings, also.options, made)
    }
}

fn of_demo(file: &Path) -> Result<Report> {
    let wrong = |why: &dyn std::fmt::Display| {
        Error::data(format!("{}: {why}", file.display())).help("run `yawrig demo` again")
    };
    let text = std::fs::read_to_string(file).map_err(|e| wrong(&e))?;
    serde_json::from_str(&text).map_err(|e| wrong(&format!("not what a demo keeps: {e}")))
}

fn is_toml(file: &Path) -> bool {
    file.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

/// Writes `report` as a page to `out` and says how large it is.
///
/// # Errors
/// Those of [`html::page`], or names the path and the system's reason.
pub fn write(report: &Report, out: &Path) -> Result<()> {
    let page = html::page(report)?;
    files::write_atomically(out, page.as_bytes())?;
    yawrig_base::say!("{}: {:.0} kB", out.display(), page.len() as f64 / 1e3);
    Ok(())
}

fn taken_out(page: &Path) -> Result<()> {
    let no_report = |why: &dyn std::fmt::Display| {
        Error::data(format!("{}: {why}", page.display()))
            .help("name a page that `yawrig report` has written")
    };
    let text = std::fs::read_to_string(page).map_err(|e| no_report(&e))?;
    let data = data::of(&text).ok_or_else(|| no_report(&"there is no report's data in it"))?;
    let _: IgnoredAny =
        serde_json::from_str(data).map_err(|e| no_report(&format!("its data are spoilt: {e}")))?;
    print_line(data)
}
