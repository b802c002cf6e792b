//! What a page asks and what it does at once, whoever answers it.

use super::bench::Bench;
use super::own::Form;
use super::session::Use;
use super::{law, opened, own, show};
use serde::Deserialize;
use serde_json::{json, Value};
use std::path::Path;
use yawrig_base::error::{Exit, Result};
use yawrig_base::settings;
use yawrig_records::place::Times;
use yawrig_records::Selection;
use yawrig_report::{channels, html, of_model, Made};

/// Points of each curve where a page does not say how many it draws.
const POINTS: usize = 800;

/// A release, and a stretch of its time.
#[derive(Deserialize)]
pub struct Stretch {
    pub release: usize,
    pub from: Option<f64>,
    pub to: Option<f64>,
    pub points: Option<usize>,
    /// What is laid over it.
    pub ghost: Option<String>,
}

#[derive(Deserialize)]
pub struct OfRelease {
    pub release: usize,
}

#[derive(Deserialize)]
pub struct AsRead {
    pub file: String,
    pub reading: Selection,
}

#[derive(Deserialize)]
pub struct Previewed {
    pub release: Option<usize>,
    pub form: Form,
}

/// Bad data is an answer, not an error: the page asked what can be drawn.
fn or_fault(drawn: Result<Value>) -> Result<Value> {
    match drawn {
        Err(e) if e.exit == Exit::Data => {
            Ok(json!({"fault": {"message": e.message, "help": e.help}}))
        }
        other => other,
    }
}

/// The page that `yawrig report` writes of the model.
///
/// # Errors
/// Where there is no model yet, or a record of it cannot be read.
pub fn report(bench: &Bench) -> Result<Value> {
    let path = bench.session().model_path.clone();
    let made = Made::now(settings::command("report", &[&path.display().to_string()], &[]));
    let html = html::page(&of_model(&path, made)?)?;
    Ok(json!({ "html": html }))
}

/// Measurement, models and residuals of a stretch of time.
///
/// # Errors
/// Exit 2 where there is no such release.
pub fn curves(bench: &Bench, asked: &Stretch) -> Result<Value> {
    let (span, points) = ([asked.from, asked.to], asked.points.unwrap_or(POINTS));
    or_fault(show::curves(bench, asked.release, span, points, asked.ghost.as_deref()))
}

/// Verdict on a release, and where the model fails in a stretch of time.
///
/// # Errors
/// As [`curves`].
pub fn view(bench: &Bench, asked: &Stretch) -> Result<Value> {
    or_fault(show::view(bench, asked.release, [asked.from, asked.to], asked.ghost.as_deref()))
}

/// Effects that the model may lack, best first.
///
/// # Errors
/// As [`curves`].
pub fn candidates(bench: &Bench, asked: &OfRelease) -> Result<Value> {
    show::candidates(bench, asked.release)
}

/// The law that was measured, over the cuts of a release.
///
/// # Errors
/// As [`curves`].
pub fn law(bench: &Bench, asked: &OfRelease) -> Result<Value> {
    law::shown(bench, asked.release)
}

/// Whether a file can be read so.
///
/// # Errors
/// Exit 3 where it cannot be read at all.
pub fn as_read(asked: &AsRead) -> Result<Value> {
    channels::asked(Path::new(&asked.file), &asked.reading)
}

/// A user's own effect as far as it is typed.
pub fn preview(bench: &Bench, asked: &Previewed) -> Value {
    own::preview(bench, asked.release, &asked.form)
}

/// What is done at once.
#[derive(Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
pub enum Deed {
    Tick {
        releases: Vec<usize>,
        used: Use,
    },
    /// A record, or all that a campaign or a model names.
    Open {
        file: String,
        #[serde(default)]
        reading: Selection,
    },
    /// Analyses what lies between two times of a release's record.
    Between {
        release: usize,
        from_s: Option<f64>,
        to_s: Option<f64>,
    },
    /// Makes the form's effect one of those that can be tried and added.
    Define {
        form: Form,
    },
    /// Writes the form's effect to a file beside the model.
    Save {
        form: Form,
    },
}

impl Deed {
    /// # Errors
    /// Exit 2 or 3 where it cannot be done; then nothing has changed.
    pub fn run(self, bench: &Bench) -> Result<Value> {
        Ok(match self {
            Self::Tick { releases, used } => {
                let mut session = bench.session();
                for id in releases {
                    let release = session.release(id)?;
                    if let Some(fault) = release.source.fault().filter(|_| used != Use::Out) {
                        return Err(fault.clone());
                    }
                    session.releases[id].used = used;
                }
                json!({})
            }
            Self::Open { file, reading } => {
                json!({"release": opened::open(bench, &file, &reading)?})
            }
            Self::Between { release, from_s, to_s } => {
                opened::between(bench, release, Times { from_s, to_s })?;
                json!({ "release": release })
            }
            Self::Define { form } => {
                let effect = form.define()?;
                bench.session().take_own(effect.clone());
                json!({ "effect": effect })
            }
            Self::Save { form } => {
                let file = form.save(&bench.session().model_path)?;
                json!({"file": file.display().to_string()})
            }
        })
    }
}
