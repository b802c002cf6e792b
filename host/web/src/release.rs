//! One release, and what is known of it.

use crate::asked::Stretch;
use serde_json::{json, Value};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use yawrig::answer::Answer;
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_core::diagnosis::diagnose::{Diagnosed, SECOND_ORDER};
use yawrig_core::effects::Effect;
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::quantity::Quantity;
use yawrig_model::effects::{named, ready_made_effects};
use yawrig_records::place::{parted, with_part, Part, Times};
use yawrig_records::Selection;
use yawrig_report::panels::{alike, candidate, trials, Panels, Span};
use yawrig_report::view::{options, Ghost, Loaded, View, DIAGNOSIS};

/// Points of each curve where a page does not say how many it draws.
const POINTS: usize = 1200;

pub struct Release {
    id: usize,
    path: PathBuf,
    reading: Selection,
    loaded: Loaded,
    view: Option<View>,
    identified: Option<Answer>,
    diagnosed: Option<Answer>,
    /// By name.
    ghosts: HashMap<String, Arc<Ghost>>,
}

impl Release {
    /// # Errors
    /// Exit 3 where it cannot be read.
    pub fn open(id: usize, path: &Path, reading: Selection) -> Result<Self> {
        let origin = match parted(path) {
            (file, Some(Part::Between(_))) => file,
            _ => path.to_owned(),
        };
        let loaded = Loaded::read(path, &origin, &reading, 0.0)?;
        Ok(Self {
            id,
            path: path.to_owned(),
            reading,
            loaded,
            view: None,
            identified: None,
            diagnosed: None,
            ghosts: HashMap::new(),
        })
    }

    pub fn file(&self) -> PathBuf {
        parted(&self.path).0
    }

    pub fn named(&self) -> Value {
        let fault = self.loaded.decay.as_ref().err();
        json!({
            "id": self.id,
            "name": self.path,
            "fault": fault.map(|e| json!({"message": e.message, "help": e.help})),
        })
    }

    /// Only what lies between these times, or all of it again.
    ///
    /// # Errors
    /// Exit 3 where no free decay lies between them.
    pub fn between(&self, [from_s, to_s]: Span) -> Result<Self> {
        let times = Times { from_s, to_s };
        let path = match times == Times::default() {
            true => self.file(),
            false => with_part(&self.file(), Part::Between(times)),
        };
        let cut = Self::open(self.id, &path, self.reading.clone())?;
        cut.decay()?;
        Ok(cut)
    }

    fn decay(&self) -> Result<&FreeDecay> {
        self.loaded.decay.as_ref().map_err(Clone::clone)
    }

    /// As the program is told of it.
    fn arguments(&self) -> Vec<String> {
        let mut all = vec![self.path.display().to_string()];
        for (name, value) in self.reading.settings() {
            all.extend([settings::name(name), value]);
        }
        all
    }

    fn panels<'a>(&'a self, asked: &Stretch) -> Panels<'a> {
        Panels {
            release: self.id,
            loaded: &self.loaded,
            view: self.view.as_ref(),
            ghost: asked.ghost.as_ref().and_then(|name| self.ghosts.get(name)).map(Arc::as_ref),
            span: [asked.from, asked.to],
        }
    }

    /// # Errors
    /// Exit 2 where nothing of the record lies in the stretch.
    pub fn curves(&self, asked: &Stretch) -> Result<Value> {
        let cut_s = match parted(&self.path).1 {
            Some(Part::Between(Times { from_s, to_s })) => Some([from_s, to_s]),
            _ => None,
        };
        self.panels(asked).curves(asked.points.unwrap_or(POINTS), cut_s)
    }

    /// # Errors
    /// Exit 3 where there is no free decay in it.
    pub fn view(&mut self, asked: &Stretch) -> Result<Value> {
        if self.view.is_none() {
            self.view = Some(View::second_order(self.decay()?.clone(), false)?);
        }
        let Some(view) = &self.view else { return Ok(Value::Null) };
        let mut out = self.panels(asked).of(view, &trials(self.ghosts.values().cloned()));
        out["later_over_noise"] = json!(view.later_over_noise);
        Ok(out)
    }

    /// The object that `identify --json` prints, and what is printed without.
    ///
    /// # Errors
    /// Exit 3 where it cannot be identified.
    pub fn identified(&mut self) -> Result<String> {
        if self.identified.is_none() {
            let records = vec![self.loaded.record.clone()];
            let verb = yawrig::cli::answer("identify", &self.arguments(), records, &|_, _| {});
            self.identified = Some(verb?);
        }
        told(self.identified.as_ref())
    }

    /// What is missing; the verdict.
    ///
    /// # Errors
    /// Exit 3 where there is no free decay in it.
    pub fn diagnose(&mut self) -> Result<String> {
        // By its name, as the program reads it: the commands that make the model name it.
        let answer = yawrig::cli::answer("diagnose", &self.arguments(), Vec::new(), &|_, _| {})?;
        if let Some(found) = answer.diagnosed() {
            let all = Ghost::all_of(found).into_iter();
            self.ghosts.extend(all.map(|ghost| (ghost.name.clone(), Arc::new(ghost))));
        }
        let verdict = answer.sentence.clone();
        self.diagnosed = Some(answer);
        Ok(verdict)
    }

    /// The object that `diagnose --json` prints, and what is printed without; null before it was asked.
    pub fn diagnosis(&self) -> Result<String> {
        told(self.diagnosed.as_ref())
    }

    fn diagnosed(&self) -> Option<&Diagnosed> {
        self.diagnosed.as_ref().and_then(Answer::diagnosed)
    }

    /// Fits the second-order model with an effect, to be laid over the panels.
    ///
    /// # Errors
    /// Exit 2 where there is no such effect, 6 where it cannot be fitted.
    pub fn try_effect(&mut self, effect: &str) -> Result<String> {
        let effect: Effect = named(effect)?;
        let decay = self.decay()?;
        let ghost = Ghost::fit(decay, &options(None, decay, false, &[])?, &effect)?;
        let said = ghost.said();
        self.ghosts.insert(ghost.name.clone(), Arc::new(ghost));
        Ok(said)
    }

    /// Effects that may be missing, those first that a diagnosis has ranked.
    pub fn candidates(&self) -> Value {
        let found = self.diagnosed();
        let ranked =
            found.iter().flat_map(|d| d.diagnosis.candidates.iter().map(|c| c.effect.clone()));
        let mut order: Vec<Effect> = Vec::new();
        for effect in ranked.chain(Effect::ALL).chain(ready_made_effects()) {
            if !order.contains(&effect) {
                order.push(effect);
            }
        }
        let row = |effect: Effect| {
            let tried = self.ghosts.get(effect.id()).map(Arc::as_ref);
            let mut out = candidate(effect, &self.loaded.record.measurand, found, tried);
            out["rejected"] = Value::Null;
            out
        };
        json!({
            "release": self.id,
            "verdict": found.map(|d| d.diagnosis.verdict(SECOND_ORDER)),
            "status": found.map(|d| d.diagnosis.status),
            "sentence": found.map(|d| &d.diagnosis.sentence),
            "left": found.map(|d| &d.diagnosis.left),
            "refused": found.map(|d| d.diagnosis.refusals()),
            "is_drawn": self.ghosts.contains_key(DIAGNOSIS),
            "alike": alike(found),
            "together": null,
            "ticked": 1,
            "candidates": order.into_iter().map(row).collect::<Vec<_>>(),
        })
    }
}

/// An answer's object as it is printed, its text and its verdict, and natural frequency and damping ratio in
/// figures.
fn told(answer: Option<&Answer>) -> Result<String> {
    let Some(answer) = answer else { return Ok(Value::Null.to_string()) };
    let object: Value = serde_json::from_str(&answer.json)
        .map_err(|e| Error::internal(format!("what was printed: {e}")))?;
    let estimate = object.pointer("/records/0/estimates/0").or_else(|| object.get("modal"));
    let figure = |name: &str| {
        let [value, u] = ["value", "u"].map(|part| estimate?[name][part].as_f64());
        Some(Quantity { value: value?, u: u.unwrap_or(f64::NAN) }.to_string())
    };
    let shown = json!({
        "natural_frequency_rad_s": figure("natural_frequency_rad_s"),
        "damping_ratio": figure("damping_ratio"),
    });
    let (text, verdict) = (json!(answer.text), json!(answer.sentence));
    // The object last, as it was printed.
    Ok(format!(r#"{{"text":{text},"sentence":{verdict},"shown":{shown},"json":{}}}"#, answer.json))
}
