//! `yawrig study`: reruns studies of the thesis.

use clap::Args;
use std::path::{Path, PathBuf};
use std::time::Instant;
use yawrig_base::error::Result;
use yawrig_base::files;
use yawrig_base::interrupt;
use yawrig_report::plot;
use yawrig_study::{Report, Size, Study, StudySetting, STUDIES};
use yawrig_verbs::common::{bare, print_json, print_line, wrapped, SCHEMA_VERSION};

/// Rerun a study of the thesis: its table beside the thesis's numbers, and a plot
#[derive(Args, Debug)]
#[command(after_help = list())]
pub struct StudyArgs {
    /// Which one, or `all`
    name: String,
    /// Folder to write the plots to, one SVG a study
    #[arg(short, long, value_name = "DIR", default_value = ".")]
    out: PathBuf,
    /// Print one JSON object
    #[arg(short, long)]
    json: bool,
    /// Few epochs and draws, to see that it runs
    #[arg(long, hide = true)]
    quick: bool,
}

fn list() -> String {
    let lines = STUDIES.iter().map(|study| format!("  {:16} {}", study.name, study.reruns));
    format!("Studies:\n{}\n  {:16} every one", lines.collect::<Vec<_>>().join("\n"), "all")
}

impl StudyArgs {
    pub fn run(&self) -> Result<()> {
        let studies: Vec<&Study> = match self.name.as_str() {
            "all" => STUDIES.iter().collect(),
            name => vec![Study::named(name)?],
        };
        files::make_folder(&self.out)?;
        for study in &studies {
            files::check_writable(&self.plot(study.name))?;
        }
        let size = if self.quick { Size::Quick } else { Size::Full };
        let setting = StudySetting { size, progress: &|step| crate::say!("{step}") };
        let mut all = Vec::new();
        for study in studies {
            interrupt::check()?;
            let begun = Instant::now();
            let report = study.run(&setting)?;
            let seconds = begun.elapsed().as_secs_f64();
            let file = self.plot(study.name);
            files::write_atomically(&file, plot::svg(&report.plots)?.as_bytes())?;
            if self.json {
                let mut value = serde_json::to_value(&report).unwrap_or_default();
                value["seconds"] = seconds.into();
                value["plot"] = file.display().to_string().into();
                all.push(value);
            } else {
                print_line(&to_text(&report, seconds, &file))?;
            }
        }
        if self.json {
            print_json(&serde_json::json!({"schema_version": SCHEMA_VERSION, "studies": all}))?;
        }
        Ok(())
    }

    fn plot(&self, name: &str) -> PathBuf {
        self.out.join(format!("study-{name}.svg"))
    }
}

fn to_text(report: &Report, seconds: f64, plot: &Path) -> String {
    let mut text = format!("{}: {} ({seconds:.0} s)\n", report.study, report.title);
    for table in &report.tables {
        let header: Vec<&str> = table.header.iter().map(String::as_str).collect();
        let mut shown = bare(&header);
        for row in &table.rows {
            shown.add_row(row);
        }
        text += &format!("\n{}\n{}\n", table.caption, shown.trim_fmt());
    }
    for finding in &report.findings {
        text += &format!("\n{}\n", wrapped(finding, 100, "").join("\n"));
    }
    text + &format!("\nplot: {}\n", plot.display())
}
