//! What the program prints of a record: the object of `--json`, and the text without.

use serde::Deserialize;
use serde_json::{json, Value};
use std::collections::HashMap;
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_session::steps::keep_diagnosed;
use yawrig_session::Bench;
use yawrig_verbs::answer::Answer;
use yawrig_verbs::diagnose::Diagnose;
use yawrig_verbs::identify::Identify;
use yawrig_verbs::parsed;

#[derive(Deserialize)]
pub struct Asked {
    release: usize,
    verb: String,
}

/// What was printed, by verb and what it was told.
#[derive(Default)]
pub struct Printed(HashMap<(String, Vec<String>), Answer>);

impl Printed {
    /// What `verb` prints of a release, as the record alone shows it.
    ///
    /// # Errors
    /// Exit 3 where there is no free decay in it.
    pub fn of(&mut self, bench: &Bench, asked: &Asked) -> Result<String> {
        let arguments = told(bench, asked.release)?;
        let key = (asked.verb.clone(), arguments);
        if !self.0.contains_key(&key) {
            let answer = match asked.verb.as_str() {
                // Its table is printed of a record in memory.
                "identify" => {
                    let source = bench.session().release(asked.release)?.source.clone();
                    let record = source.loaded().map_err(Clone::clone)?.record.clone();
                    parsed::<Identify>(&key.1)?.answer(vec![record], &|_, _| {})?
                }
                // By its name, as the program reads it: the commands that make the model name it.
                "diagnose" => parsed::<Diagnose>(&key.1)?.answer(Vec::new())?,
                other => return Err(Error::internal(format!("{other} is not printed here"))),
            };
            self.0.insert(key.clone(), answer);
        }
        self.0.get(&key).map_or_else(|| Ok(Value::Null.to_string()), whole)
    }

    /// What is missing in a release beside a second-order model, found once for the page and for what is
    /// printed; the verdict. None where the model has more in it.
    ///
    /// # Errors
    /// Exit 3 where there is no free decay in it.
    pub fn diagnose(&mut self, bench: &Bench, release: usize) -> Result<Option<String>> {
        let arguments = told(bench, release)?;
        let (source, key) = {
            let session = bench.session();
            let has_effects =
                session.standing.model.as_ref().is_some_and(|m| !m.effects.is_empty());
            if has_effects || !session.own.is_empty() {
                return Ok(None);
            }
            (session.release(release)?.source.clone(), session.standing.key)
        };
        let answer = parsed::<Diagnose>(&arguments)?.answer(Vec::new())?;
        if let Some(found) = answer.diagnosed() {
            keep_diagnosed(bench, release, &source, key, found.clone())?;
        }
        let verdict = answer.sentence.clone();
        self.0.insert(("diagnose".to_owned(), arguments), answer);
        Ok(Some(verdict))
    }
}

/// As the program is told of a release.
fn told(bench: &Bench, release: usize) -> Result<Vec<String>> {
    let session = bench.session();
    let release = session.release(release)?;
    let mut all = vec![release.source.path.display().to_string()];
    for (name, value) in release.entry.reading.settings() {
        all.extend([settings::name(name), value]);
    }
    Ok(all)
}

/// An answer's object as it is printed, its text and its verdict.
fn whole(answer: &Answer) -> Result<String> {
    let _: Value = serde_json::from_str(&answer.json)
        .map_err(|e| Error::internal(format!("what was printed: {e}")))?;
    let (text, verdict) = (json!(answer.text), json!(answer.sentence));
    // The object last, as it was printed.
    Ok(format!(r#"{{"text":{text},"sentence":{verdict},"json":{}}}"#, answer.json))
}
