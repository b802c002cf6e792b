//! The session of a page: its files are in memory, and what it asks is answered as the workbench's server
//! answers it.

use crate::printed::Printed;
use serde::de::DeserializeOwned;
use serde::Deserialize;
use serde_json::{json, Value};
use std::path::{Component, Path, PathBuf};
use yawrig_base::disk;
use yawrig_base::error::{Error, Result};
use yawrig_records::Selection;
use yawrig_report::channels;
use yawrig_session::job::Job;
use yawrig_session::requests::{self, Deed};
use yawrig_session::steps::{make_view, run, without_view};
use yawrig_session::{Bench, Kept, Opened, Told};

/// What begins and ends a session.
#[derive(Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
enum Order {
    /// Goes on with what was kept, its files being there again.
    Restore { kept: Kept },
    /// Forgets all files.
    Close,
    #[serde(untagged)]
    Job(Job),
    #[serde(untagged)]
    Deed(Deed),
}

/// Releases that are looked at.
#[derive(Deserialize)]
struct Wanted {
    wanted: Vec<usize>,
}

pub struct Session {
    bench: Bench,
    printed: Printed,
    told: fn() -> Box<Told>,
}

impl Session {
    /// Without a file; each piece of news goes to what `told` gives.
    ///
    /// # Errors
    /// Those of a session without a file: none.
    pub fn new(told: fn() -> Box<Told>) -> Result<Self> {
        let empty = yawrig_session::Session::new(&Opened::default())?;
        Ok(Self { bench: Bench::new(empty, told()), printed: Printed::default(), told })
    }

    /// Takes a file in; what is in it, where it has to be asked which of it is meant.
    ///
    /// # Errors
    /// Exit 2 for a name that is none of a file, 3 where nothing can be read of it.
    pub fn take(&mut self, name: &str, bytes: Vec<u8>) -> Result<Value> {
        let path = Path::new(name);
        let is_plain = path.components().all(|c| matches!(c, Component::Normal(_)));
        // As an argument it is a file's.
        if name.is_empty()
            || !is_plain
            || name.starts_with(['-', '.'])
            || name.contains(['\\', '#'])
        {
            return Err(Error::usage(format!("{name:?} is no name of a record")).help("rename it"));
        }
        disk::hold(path, bytes);
        let is_record = !path.extension().is_some_and(|e| e == "toml" || e == "jsonl");
        match is_record {
            true => channels::asked(path, &Selection::default()),
            false => Ok(json!({"file": name, "is_clear": true})),
        }
    }

    /// # Errors
    /// Those of what is asked; exit 1 for what is not known here.
    pub fn answer(&mut self, path: &str, asked: &str) -> Result<String> {
        let bench = &self.bench;
        let answer = match path {
            "/api/state" => yawrig_session::state(bench, None, None),
            "/api/effects" => yawrig_session::library(),
            "/api/as_read" => requests::as_read(&read(asked)?)?,
            "/api/curves" => requests::curves(bench, &read(asked)?)?,
            "/api/view" => requests::view(bench, &read(asked)?)?,
            "/api/candidates" => requests::candidates(bench, &read(asked)?)?,
            "/api/law" => requests::law(bench, &read(asked)?)?,
            "/api/derivatives" => yawrig_session::derivatives(bench),
            "/api/preview" => requests::preview(bench, &read(asked)?),
            "/api/ready" => ready(bench, &read(asked)?),
            "/api/held" => json!({ "files": files() }),
            "/api/kept" => json!({ "kept": Kept::new(&bench.session()), "files": files() }),
            "/api/printed" => return self.printed.of(bench, &read(asked)?),
            "/api/report" => requests::report(bench)?,
            "/api/do" => self.act(read(asked)?)?,
            other => return Err(Error::internal(format!("{other} is not answered here"))),
        };
        Ok(answer.to_string())
    }

    fn act(&mut self, order: Order) -> Result<Value> {
        Ok(match order {
            Order::Job(job) => {
                if let Some(id) = job.needs() {
                    self.bench.session().effect(id)?;
                }
                let done = match &job {
                    Job::Diagnose { release } => self.printed.diagnose(&self.bench, *release)?,
                    _ => None,
                };
                let message = done.map_or_else(|| run(&self.bench, &job), Ok)?;
                self.bench.session().refresh();
                json!({ "message": message })
            }
            Order::Deed(deed) => deed.run(&self.bench)?,
            Order::Restore { kept } => {
                self.bench = kept.again((self.told)())?;
                json!({})
            }
            Order::Close => {
                for path in disk::names() {
                    // It was there a moment ago.
                    let _ = disk::remove_file(path);
                }
                *self = Self::new(self.told)?;
                json!({})
            }
        })
    }
}

/// Names of the files and by what they are known again.
fn files() -> Vec<Value> {
    let file = |path: PathBuf| {
        let sum = yawrig_records::content(&path).map(|content| content.crc32);
        json!({"name": path, "crc32": sum})
    };
    disk::names().into_iter().map(file).collect()
}

/// Makes one view ready; whether there was one to be made.
fn ready(bench: &Bench, asked: &Wanted) -> Value {
    let next = without_view(bench, asked.wanted.clone());
    if let Some(id) = next.first() {
        make_view(bench, *id);
    }
    json!({ "release": next.first() })
}

fn read<T: DeserializeOwned>(asked: &str) -> Result<T> {
    serde_json::from_str(asked).map_err(|e| Error::internal(format!("what is asked: {e}")))
}
