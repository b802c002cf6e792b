//! The releases that a page has opened.

use crate::asked::{AsRead, OfRelease, Order, Stretch};
use crate::release::Release;
use serde::de::DeserializeOwned;
use serde_json::{json, Value};
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_records::Selection;
use yawrig_report::channels;

#[derive(Default)]
pub struct Session {
    releases: Vec<Release>,
}

impl Session {
    /// Takes a file in; what is in it, where it has to be asked which of it is meant.
    ///
    /// # Errors
    /// Exit 2 for a name that is none of a file, 3 where nothing can be read of it.
    pub fn take(&mut self, name: &str, bytes: Vec<u8>) -> Result<String> {
        // As an argument it is a file's.
        if name.is_empty() || name.starts_with(['-', '.']) || name.contains(['/', '\\', '#']) {
            return Err(Error::usage(format!("{name:?} is no name of a record")).help("rename it"));
        }
        yawrig_records::hold(Path::new(name), bytes)?;
        Ok(channels::asked(Path::new(name), &Selection::default())?.to_string())
    }

    /// # Errors
    /// Those of what is asked; exit 1 for what is not known here.
    pub fn answer(&mut self, path: &str, asked: &str) -> Result<String> {
        let answer = match path {
            "/api/state" => self.state(),
            "/api/as_read" => {
                let AsRead { file, reading } = read(asked)?;
                channels::asked(Path::new(&file), &reading)?
            }
            "/api/curves" => {
                let asked: Stretch = read(asked)?;
                self.release(asked.release)?.curves(&asked)?
            }
            "/api/view" => {
                let asked: Stretch = read(asked)?;
                self.release(asked.release)?.view(&asked)?
            }
            "/api/candidates" => {
                let OfRelease { release } = read(asked)?;
                self.release(release)?.candidates()
            }
            "/api/identify" => {
                let OfRelease { release } = read(asked)?;
                return self.release(release)?.identified();
            }
            "/api/diagnose" => {
                let OfRelease { release } = read(asked)?;
                return self.release(release)?.diagnosis();
            }
            "/api/do" => self.act(read(asked)?)?,
            other => return Err(Error::internal(format!("{other} is not answered here"))),
        };
        Ok(answer.to_string())
    }

    fn act(&mut self, order: Order) -> Result<Value> {
        Ok(match order {
            Order::Open { file, reading } => {
                let file = Path::new(&file);
                // What was opened of that name is no longer there.
                let place = self.releases.iter().position(|r| r.file() == file);
                let id = place.unwrap_or(self.releases.len());
                let opened = Release::open(id, file, reading)?;
                match self.releases.get_mut(id) {
                    Some(release) => *release = opened,
                    None => self.releases.push(opened),
                }
                json!({ "release": id })
            }
            Order::Diagnose { release } => json!({ "message": self.release(release)?.diagnose()? }),
            Order::Try { release, effect } => {
                json!({ "message": self.release(release)?.try_effect(&effect)? })
            }
            Order::Between { release, from_s, to_s } => {
                let cut = self.release(release)?.between([from_s, to_s])?;
                self.releases[release] = cut;
                json!({})
            }
        })
    }

    fn state(&self) -> Value {
        json!({ "releases": self.releases.iter().map(Release::named).collect::<Vec<_>>() })
    }

    fn release(&mut self, id: usize) -> Result<&mut Release> {
        let missing = || Error::internal(format!("there is no release {id}"));
        self.releases.get_mut(id).ok_or_else(missing)
    }
}

fn read<T: DeserializeOwned>(asked: &str) -> Result<T> {
    serde_json::from_str(asked).map_err(|e| Error::internal(format!("what is asked: {e}")))
}
