//! The form for a user's own effect: its text as a file, errors under the character, and what the moment
//! looks like.

use super::bench::Bench;
use serde::Deserialize;
use serde_json::{json, Value};
use std::fmt::Write as _;
use std::ops::Range;
use std::path::{Path, PathBuf};
use yawrig_base::disk;
use yawrig_base::error::{Error, Result};
use yawrig_base::files;
use yawrig_core::effects::Effect;
use yawrig_core::record::Measurand;
use yawrig_expression::{self, OwnEffect, State};
use yawrig_model::effects;
use yawrig_report::drawn::shorts;

/// Form fields as typed.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct Form {
    pub id: String,
    pub title: String,
    pub moment: String,
    #[serde(default)]
    pub parameters: Vec<FormParameter>,
    #[serde(default)]
    pub states: Vec<FormState>,
}

/// What the moment remembers, and how it changes.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct FormState {
    pub name: String,
    pub unit: String,
    pub rate: String,
    #[serde(default)]
    pub start: String,
}

#[derive(Clone, Debug, Default, Deserialize)]
pub struct FormParameter {
    pub name: String,
    pub unit: String,
    pub start: String,
    #[serde(default)]
    pub min: String,
    #[serde(default)]
    pub max: String,
}

/// The form as a file, and where in it each field stands.
struct Written {
    text: String,
    fields: Vec<(Range<usize>, String)>,
}

impl Written {
    /// `before`, the value as TOML, and its place as that of `field`.
    fn put(&mut self, before: &str, value: &str, is_text: bool, field: String) {
        self.text.push_str(before);
        // A field stays on one line.
        let value = value.replace(['\n', '\r'], " ");
        let shown = match is_text {
            true if value.contains(['"', '\\']) => toml::Value::String(value).to_string(),
            true => format!("\"{value}\""),
            false => value.trim().to_owned(),
        };
        let start = self.text.len();
        self.text.push_str(&shown);
        self.fields.push((start..self.text.len(), field));
    }
}

impl Form {
    fn written(&self) -> Written {
        let mut out = Written { text: String::new(), fields: Vec::new() };
        out.put("id = ", &self.id, true, "id".into());
        out.put("\ntitle = ", &self.title, true, "title".into());
        out.put("\nmoment = ", &self.moment, true, "moment".into());
        out.text.push_str("   # rad/s2\n");
        for (k, state) in self.states.iter().enumerate() {
            let field = |name: &str| format!("states.{k}.{name}");
            out.put("[[state]]\nname = ", &state.name, true, field("name"));
            out.put("\nunit = ", &state.unit, true, field("unit"));
            out.put("\nrate = ", &state.rate, true, field("rate"));
            if !state.start.trim().is_empty() {
                out.put("\nstart = ", &state.start, true, field("start"));
            }
            out.text.push('\n');
        }
        out.text.push_str("[parameters]\n");
        for (k, p) in self.parameters.iter().enumerate() {
            let field = |name: &str| format!("parameters.{k}.{name}");
            // What is no bare key in quotes, so that it is judged as a name.
            let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '_';
            let is_quoted = p.name.is_empty() || !p.name.chars().all(is_bare);
            out.put("", &p.name, is_quoted, field("name"));
            out.put(" = { unit = ", &p.unit, true, field("unit"));
            out.put(", start = ", &p.start, false, field("start"));
            for (name, value) in [("min", &p.min), ("max", &p.max)] {
                if !value.trim().is_empty() {
                    out.put(&format!(", {name} = "), value, false, field(name));
                }
            }
            out.text.push_str(" }\n");
        }
        out
    }

    /// What the file is called.
    fn file(&self) -> PathBuf {
        PathBuf::from(format!("{}.toml", self.id.trim()))
    }

    fn checked(&self) -> Result<OwnEffect> {
        Ok(yawrig_expression::from_text(&self.file(), &self.written().text, &Effect::ids())?)
    }

    /// Registers the effect.
    ///
    /// # Errors
    /// Those of [`effects::defined`].
    pub fn define(&self) -> Result<Effect> {
        effects::defined(&self.file(), &self.written().text)
    }

    /// Writes it beside the model, where `--effect` finds it.
    ///
    /// # Errors
    /// Those of [`effects::defined`]; exit 3 where another file has its name, or it cannot be written.
    pub fn save(&self, model: &Path) -> Result<PathBuf> {
        self.checked()?;
        let path = model.with_file_name(self.file());
        let text = self.written().text;
        match disk::read_to_string(&path) {
            Ok(there) if there == text => {}
            Ok(_) => {
                return Err(Error::data(format!(
                    "{} is there already, with another text",
                    path.display()
                ))
                .help("give the effect another id, or move that file away"))
            }
            Err(_) => files::write_atomically(&path, text.as_bytes())?,
        }
        Ok(path)
    }

    /// The error with its field, and the characters in it that it is about.
    fn pointed(&self, error: &Error) -> Value {
        let written = self.written();
        let text = &written.text;
        let first_line = unplaced(&error.message);
        let found = error.span.clone().and_then(|span| {
            let holds = |r: &Range<usize>| (r.start..=r.end).contains(&span.start);
            let (range, field) = written.fields.iter().find(|(range, _)| holds(range))?;
            let is_text = text[range.clone()].starts_with(['"', '\'']);
            // The value's first character follows its quote.
            let begin = range.start + usize::from(is_text);
            let column = text.get(begin..span.start.max(begin)).map_or(0, |t| t.chars().count());
            let end = span.end.min(range.end - usize::from(is_text && range.end > range.start));
            let width = text.get(span.start.max(begin)..end).map_or(0, |t| t.chars().count());
            Some(json!({"field": field, "column": column, "width": width.max(1)}))
        });
        json!({"message": first_line, "help": error.help, "at": found})
    }
}

/// The first line without file, line and column: the user has seen no file.
fn unplaced(message: &str) -> &str {
    let line = message.lines().next().unwrap_or_default();
    let told = line.split_once(".toml:").and_then(|(_, rest)| rest.splitn(3, ':').nth(2));
    told.unwrap_or(line).trim()
}

/// Points of a drawn law.
const POINTS: usize = 121;

/// Errors under the character, or the moment along the two cuts of the phase plane, with each parameter at
/// its start; no points where it depends on what went before.
pub fn preview(bench: &Bench, release: Option<usize>, form: &Form) -> Value {
    let effect = match form.checked() {
        Ok(effect) => effect,
        Err(error) => return json!({"error": form.pointed(&error)}),
    };
    let (measurand, wn, wind, yaw_max, rate_max) = {
        let session = bench.session();
        let view = release.and_then(|id| session.view(id)).and_then(|view| view.as_ref().ok());
        match view {
            Some(view) => {
                let wn = view.modal.natural_frequency_rad_s.value;
                let yaw = view.decay.amplitude_rad;
                let measurand = view.decay.measurand.clone();
                (measurand, wn, view.decay.wind_speed_m_s, yaw, yaw * wn)
            }
            None => (Measurand::default(), 7.5, 0.0, 0.26, 2.0),
        }
    };
    let law = |most: f64, at: &dyn Fn(f64) -> (f64, f64)| {
        let mut out = (Vec::new(), Vec::new());
        let points = if effect.states.is_empty() { POINTS } else { 0 };
        for k in 0..points {
            let x = most * (2.0 * k as f64 / (POINTS - 1) as f64 - 1.0);
            let (yaw_rad, rate_rad_s) = at(x);
            let state = State {
                yaw_rad,
                rate_rad_s,
                time_s: 0.0,
                natural_frequency_rad_s: wn,
                wind_speed_m_s: wind,
                rate_sign: sign(rate_rad_s),
                yaw_sign: sign(yaw_rad),
            };
            let moment = effect.program.evaluate(&state, &effect.starts);
            out.0.push(measurand.shown(x));
            out.1.push(Some(moment).filter(|m| m.is_finite()));
        }
        (shorts(out.0), shorts(out.1))
    };
    let (rate_deg_s, of_rate) = law(rate_max, &|r| (0.0, r));
    let (yaw_deg, of_yaw) = law(yaw_max, &|b| (b, 0.0));
    let mut warnings = String::new();
    for warning in &effect.warnings {
        let _ = writeln!(warnings, "{}", unplaced(warning));
        let help = warning.lines().map(str::trim).filter(|line| line.starts_with("help: "));
        help.for_each(|line| warnings.extend([line, "\n"]));
    }
    json!({
        "id": effect.id,
        "text": effect.text,
        "warnings": warnings.trim_end(),
        "damping_law": {"rate_deg_s": rate_deg_s, "moment_rad_s2": of_rate},
        "stiffness_law": {"yaw_deg": yaw_deg, "moment_rad_s2": of_yaw},
    })
}

fn sign(x: f64) -> f64 {
    if x == 0.0 {
        0.0
    } else {
        x.signum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn form(moment: &str) -> Form {
        Form {
            id: "mine".into(),
            title: "My \"own\" effect".into(),
            moment: moment.into(),
            parameters: vec![FormParameter {
                name: "c".into(),
                unit: "rad/s2".into(),
                start: "0.05".into(),
                min: "0".into(),
                max: String::new(),
            }],
            states: Vec::new(),
        }
    }

    /// A moment that follows the angle late.
    fn late() -> Form {
        let state = |rate: &str| FormState {
            name: "z".into(),
            unit: "rad".into(),
            rate: rate.into(),
            start: String::new(),
        };
        Form { states: vec![state("b - z")], ..form("-c * z") }
    }

    fn at(form: &Form) -> (String, u64, u64) {
        let error = form.pointed(&form.checked().unwrap_err());
        let at = &error["at"];
        let field = at["field"].as_str().unwrap_or_else(|| panic!("{error}")).to_owned();
        assert!(!error["message"].as_str().unwrap().contains(".toml"), "{error}");
        (field, at["column"].as_u64().unwrap(), at["width"].as_u64().unwrap())
    }

    #[test]
    fn a_good_form_is_an_effect() {
        let effect = form("-c * tanh(r / 0.002)").checked().unwrap();
        assert_eq!((effect.id.as_str(), effect.starts[0]), ("mine", 0.05));
        assert_eq!(effect.title, "My \"own\" effect");
    }

    #[test]
    fn a_form_with_a_state_is_an_effect_with_memory() {
        let mut late = late();
        late.parameters.push(FormParameter {
            name: "T".into(),
            unit: "s".into(),
            start: "0.3".into(),
            ..FormParameter::default()
        });
        // What rad a second is wanted for, where b - z is rad.
        assert_eq!(at(&late), ("states.0.rate".into(), 0, 5));
        late.states[0].rate = "(b - z) / T".into();
        late.states[0].start = "0.5 * b".into();
        let effect = late.checked().unwrap();
        assert_eq!((effect.states.len(), effect.parameters.len()), (1, 2));
        assert!(effect.text.contains("[[state]]\nname = \"z\"\nunit = \"rad\""), "{}", effect.text);
        late.states[0].start = "q".into();
        assert_eq!(at(&late), ("states.0.start".into(), 0, 1));
    }

    #[test]
    fn errors_point_at_the_character_of_the_field() {
        // The unclosed bracket.
        assert_eq!(at(&form("-c * tanh(r / 0.002")), ("moment".into(), 9, 1));
        assert_eq!(at(&form("-c * tahn(r)")), ("moment".into(), 5, 4));
        assert_eq!(at(&form("-c * b * §")).0, "moment");
        assert_eq!(at(&Form { id: "Mine".into(), ..form("-c * sign(r)") }), ("id".into(), 0, 4));
        let mut wrong = form("-c * sign(r)");
        wrong.parameters[0].start = "0".into();
        assert_eq!(at(&wrong), ("parameters.0.start".into(), 0, 1));
        for (typed, what, width) in [
            ("five", "start is to be a number, and not five", 4),
            ("0,05", "start is to be a number, and not 0,05", 4),
            ("\"fast\"", "start of c is to be a number, and not the text \"fast\"", 4),
            ("[1]", "start of c is to be a number, and not a list in brackets", 3),
            ("", "nothing stands behind start =", 1),
        ] {
            wrong.parameters[0].start = typed.into();
            let error = wrong.pointed(&wrong.checked().unwrap_err());
            assert_eq!(error["message"], what);
            assert!(!error["help"].as_str().unwrap().is_empty());
            let (field, _, wide) = at(&wrong);
            assert_eq!((field.as_str(), wide), ("parameters.0.start", width), "{typed}");
        }
        wrong.parameters[0].start = "0.05".into();
        wrong.parameters[0].min = "none".into();
        assert_eq!(at(&wrong), ("parameters.0.min".into(), 0, 4));
        wrong.parameters[0].min = "0".into();
        wrong.parameters[0].name = "c d".into();
        assert_eq!(at(&wrong), ("parameters.0.name".into(), 0, 3));
        wrong.parameters[0].name = String::new();
        assert_eq!(at(&wrong).0, "parameters.0.name");
        wrong.parameters[0].name = "c".into();
        wrong.parameters[0].start = "0.1".into();
        wrong.parameters[0].unit = "rad/furlong".into();
        let (field, column, width) = at(&wrong);
        assert_eq!((field.as_str(), column, width), ("parameters.0.unit", 4, 7));
    }

    #[test]
    fn a_saved_effect_is_read_back_and_never_written_over() {
        let folder = tempfile::tempdir().unwrap();
        let model = folder.path().join("model.toml");
        let path = form("-c * sign(r)").save(&model).unwrap();
        assert_eq!(
            yawrig_expression::from_text(&path, &std::fs::read_to_string(&path).unwrap(), &[])
                .unwrap()
                .id,
            "mine"
        );
        form("-c * sign(r)").save(&model).unwrap();
        let error = form("-2 * c * sign(r)").save(&model).unwrap_err();
        assert!(error.message.contains("there already"), "{error}");
    }
}
