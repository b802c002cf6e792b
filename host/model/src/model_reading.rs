//! Reading `model.toml`: every entry checked, errors pointing at the character.

mod raw;

use super::{edits, effects, sources};
use crate::document::{
    is_own, of_file, read_text, EffectEntry, MadeUnder, ModalEntry, Model, ParameterEntry,
    RecordEntry, DAMPING_RATIO, NATURAL_FREQUENCY, SCHEMA_VERSION,
};
use crate::journal::Journal;
use raw::{RawEffect, RawModal, RawModel, RawParameter, RawRecord, Version};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use toml::Spanned;
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_core::effects::{Effect, Knots, MeasuredLaw, Part, MAX_OWN, MEASURED_LAW};
use yawrig_core::record::Measurand;
use yawrig_expression::is_file;
use yawrig_text::pointed;

/// What a number must satisfy.
struct Law<'a> {
    name: String,
    unit: &'a str,
    min: f64,
    max: f64,
}

impl Model {
    /// Reads and checks `path`.
    ///
    /// # Errors
    /// Exit 3, naming file and line: not there, not TOML, an entry missing, unknown or out of range, an
    /// effect that the library does not hold.
    pub fn read(path: &Path) -> Result<Self> {
        let text = read_text(path)?;
        // What is wrong with the journal is for those who read it for its own sake.
        let steps = Journal::new(path).unwrap_or_default().steps;
        Ok(edits::seen(Self::parse(&text, path)?, &text, path, &steps))
    }

    /// The model in `text`, which was read from `path`, with its numbers as they stand there.
    ///
    /// # Errors
    /// As [`Model::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        Reader { text, path }.model()
    }
}

/// Reads the `text` of the model's file `path`.
struct Reader<'a> {
    text: &'a str,
    path: &'a Path,
}

impl Reader<'_> {
    fn line(&self, span: &Range<usize>) -> usize {
        let end = span.start.min(self.text.len());
        self.text.as_bytes()[..end].iter().filter(|byte| **byte == b'\n').count() + 1
    }

    fn error(&self, span: &Range<usize>, what: impl std::fmt::Display) -> Error {
        Error::data(pointed(self.path, self.text, span.clone(), &what.to_string()))
    }

    fn name(&self) -> std::path::Display<'_> {
        Path::new(self.path.file_name().unwrap_or_default()).display()
    }

    fn malformed(&self, e: &toml::de::Error) -> Error {
        self.error(&e.span().unwrap_or(0..0), e.message().trim_end()).help(format!(
            "correct the entry; `{}` goes back to any step",
            settings::command("history", &[], &[("return", "N")])
        ))
    }

    fn model(&self) -> Result<Model> {
        let version: Version = toml::from_str(self.text).map_err(|e| self.malformed(&e))?;
        if *version.schema_version.get_ref() != SCHEMA_VERSION {
            let what = format!("schema_version is {}", version.schema_version.get_ref());
            return Err(self
                .error(&version.schema_version.span(), what)
                .help(format!("this program reads schema_version {SCHEMA_VERSION}")));
        }
        let raw: RawModel = toml::from_str(self.text).map_err(|e| self.malformed(&e))?;
        // What cannot be written back, such as a whole number beyond 64 bits, must not be read.
        if let Err(e) = self.text.parse::<toml_edit::DocumentMut>() {
            let what = e.message().trim().to_owned();
            return Err(self
                .error(&e.span().unwrap_or_default(), what)
                .help("write numbers of that size with a decimal point"));
        }
        let mut records: Vec<RecordEntry> = Vec::new();
        for entry in &raw.record {
            let record = self.record(entry)?;
            if let Some(other) = records.iter().find(|r| r.file == record.file) {
                let what = format!("{} is listed already, on line {}", other.file, other.line);
                return Err(self.error(&entry.span(), what).help("list each record once"));
            }
            records.push(record);
        }
        let mut modal = BTreeMap::new();
        for (condition, entry) in &raw.modal {
            if !records.iter().any(|r| r.condition == *condition.get_ref()) {
                let what = format!("no record has the condition \"{}\"", condition.get_ref());
                let help = "conditions are named by [[record]]; correct or delete the table";
                return Err(self.error(&condition.span(), what).help(help));
            }
            modal.insert(condition.get_ref().clone(), self.modal(entry)?);
        }
        let winds = Model { records: records.clone(), ..Model::default() }.wind_speeds();
        let mut effects: Vec<EffectEntry> = Vec::new();
        for entry in &raw.effect {
            let id = entry.id.get_ref();
            if effects.iter().any(|e| e.effect.id() == id) {
                let what = format!("{id} is in the model twice");
                return Err(self.error(&entry.id.span(), what).help("delete one [[effect]]"));
            }
            let effect = self.effect(entry, &raw.recorded.measurand(), &winds)?;
            if raw.unknown_zero && effect.effect.moves_rest() {
                let what = format!(
                    "{id} beside unknown_zero: a constant moment cannot be distinguished from it"
                );
                return Err(self.error(&entry.id.span(), what).help("delete one of the two"));
            }
            effects.push(effect);
            let own = effects.iter().filter(|e| e.effect.is_own()).count();
            if own > MAX_OWN {
                let what = format!("more than {MAX_OWN} effects of your own");
                return Err(self.error(&entry.id.span(), what).help("take fewer at a time"));
            }
        }
        let RawModel { unknown_zero, recorded, .. } = raw;
        Ok(Model { unknown_zero, recorded, records, modal, effects })
    }

    fn record(&self, entry: &Spanned<RawRecord>) -> Result<RecordEntry> {
        let raw = entry.get_ref();
        let made_under = match (&raw.spring, raw.axis, raw.wind_speed_m_s) {
            (None, None, None) => None,
            (Some(spring), Some(axis), Some(wind_speed_m_s))
                if wind_speed_m_s.is_finite() && wind_speed_m_s >= 0.0 =>
            {
                Some(MadeUnder { spring: spring.clone(), axis, wind_speed_m_s })
            }
            _ => return Err(self
                .error(
                    &entry.span(),
                    "spring, axis and wind_speed_m_s (0 or more) are given all three or not at all",
                )
                .help("give all three, or none")),
        };
        let condition = match (&raw.condition, &made_under) {
            (Some(condition), _) => condition.clone(),
            (None, Some(made)) => made.condition(),
            (None, None) => of_file(raw.file.get_ref()),
        };
        Ok(RecordEntry {
            file: raw.file.get_ref().clone(),
            condition,
            reading: raw.reading.clone(),
            held_out: raw.held_out,
            made_under,
            crc32: raw.crc32.clone(),
            line: self.line(&raw.file.span()),
        })
    }

    fn modal(&self, raw: &RawModal) -> Result<ModalEntry> {
        let law =
            |name: &str, unit, [min, max]: [f64; 2]| Law { name: name.into(), unit, min, max };
        let wn = law("natural_frequency_rad_s", "rad/s", NATURAL_FREQUENCY);
        let zeta = law("damping_ratio", "1", DAMPING_RATIO);
        let mut entry = ModalEntry::default();
        if let Some(raw) = &raw.natural_frequency_rad_s {
            // As earlier versions wrote its bounds.
            let mut raw = raw.clone();
            let entries = raw.get_mut();
            entries.min = entries.min.filter(|min| *min != 0.0);
            entries.max = entries.max.filter(|max| max.is_finite());
            entry.natural_frequency_rad_s = self.parameter(&raw, &wn)?;
        }
        if let Some(raw) = &raw.damping_ratio {
            entry.damping_ratio = self.parameter(raw, &zeta)?;
        }
        Ok(entry)
    }

    fn effect(
        &self,
        raw: &RawEffect,
        measurand: &Measurand,
        winds_m_s: &[f64],
    ) -> Result<EffectEntry> {
        let id = raw.id.get_ref();
        let effect = match &raw.definition {
            Some(definition) => {
                let file = self.path.with_file_name(format!("{id} in {}", self.name()));
                effects::defined(&file, definition.get_ref())?
            }
            None if id == MEASURED_LAW => self.law(raw)?,
            None if is_file(id) => {
                effects::load(&self.path.parent().unwrap_or(Path::new("")).join(id))?
            }
            None => effects::named(id).map_err(|e| {
                self.error(&raw.id.span(), e.message)
                    .help(format!("{}, with its text as definition", e.help))
            })?,
        };
        if raw.definition.is_some() && effect.id() != id {
            let what = format!("the definition is that of \"{effect}\", not of \"{id}\"");
            return Err(self.error(&raw.id.span(), what).help("give both the same id"));
        }
        if effect.is_random() {
            return Err(self
                .error(&raw.id.span(), format!("{id} is random and cannot be simulated"))
                .help("delete the entry; `yawrig diagnose` judges it by a filter"));
        }
        let effect = self.sourced(&effect, raw, winds_m_s)?;
        let mut entry = EffectEntry::unfitted(effect.clone());
        for (name, parameter) in &raw.parameters {
            let known = effect.parameters();
            let Some(at) = known.iter().position(|p| p.name == *name.get_ref()) else {
                let names: Vec<&str> = known.iter().map(|p| &*p.name).collect();
                let what = format!("{effect} has no parameter \"{}\"", name.get_ref());
                let help = format!("its parameters: {}", names.join(", "));
                return Err(self.error(&name.span(), what).help(help));
            };
            let p = &known[at];
            let unit = &effect.unit_in(measurand, &p.name);
            let law = Law { name: format!("{effect}.{}", p.name), unit, min: p.min, max: p.max };
            entry.parameters[at] = self.parameter(parameter, &law)?;
        }
        let numbers = || entry.parameters.iter().enumerate();
        let shared = || numbers().filter(|(index, _)| !is_own(&effect, *index)).map(|(_, p)| p);
        if shared().any(|p| p.value.is_some()) && shared().any(|p| p.value.is_none()) {
            let what = format!("{effect} has values for some of its parameters only");
            return Err(self.error(&raw.id.span(), what).help("give all of them, or none"));
        }
        // Size and phase of a line are fitted as cosine and sine part.
        let line = || numbers().filter(|(index, _)| effect.varied_place(*index).is_none());
        let kept = |(index, p): (usize, &ParameterEntry)| {
            let known = &effect.parameters()[index];
            !p.free || (p.min, p.max) != (known.min, known.max)
        };
        if line().any(kept) && line().any(|(_, p)| p.free) {
            let names: Vec<&str> = line().map(|(i, _)| &*effect.parameters()[i].name).collect();
            let what = format!(
                "{effect}: {} are free within no bounds, or all fixed",
                names.join(" and ")
            );
            return Err(self
                .error(&raw.id.span(), what)
                .help("free them and delete their bounds, or fix all"));
        }
        Ok(entry)
    }

    /// `effect` with the source that the entry gives it; where its wind speeds are not given, by those of the
    /// records.
    fn sourced(&self, effect: &Effect, raw: &RawEffect, winds_m_s: &[f64]) -> Result<Effect> {
        let mut speeds = winds_m_s.to_vec();
        if let Some(given) = &raw.wind_speeds_m_s {
            speeds.clone_from(given.get_ref());
            if speeds.iter().any(|v| !(v.is_finite() && *v >= 0.0))
                || !speeds.windows(2).all(|v| v[0] < v[1])
            {
                return Err(self
                    .error(&given.span(), "wind speeds rise from 0 (off) or more")
                    .help("give each once, the lowest first"));
            }
        }
        if let Some(given) = &raw.reference_wind_m_s {
            let reference = *given.get_ref();
            if !(reference.is_finite() && reference > 0.0) {
                let what = "the reference wind speed is above 0";
                return Err(self.error(&given.span(), what).help("give a speed with the wind on"));
            }
            speeds = vec![reference];
        }
        sources::sourced(effect, raw.source, &speeds)
            .map_err(|e| self.error(&raw.id.span(), e.message).help(e.help))
    }

    fn law(&self, raw: &RawEffect) -> Result<Effect> {
        let Some(law) = &raw.law else {
            return Err(self
                .error(&raw.id.span(), "measured_law has no [effect.law]")
                .help("delete the entry and measure it: yawrig add measured_law"));
        };
        let at = law.get_ref();
        let curves = [at.stiffness, at.uneven_stiffness, at.damping, at.uneven_damping];
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let rises = |k: &Knots| {
            positive(k[0]) && k.windows(2).all(|k| k[0] < k[1]) && k.last() == Some(&1.0)
        };
        if ![at.yaw_deg, at.rate_deg_s].into_iter().all(positive)
            || !curves.iter().flatten().all(|c| positive(c.weight) && rises(&c.knots))
            || !at.damping_line.iter().flatten().all(|x| x.is_finite())
        {
            return Err(self
                .error(
                    &law.span(),
                    "yaw_deg, rate_deg_s and the weight of each curve are above zero, and its knots rise to 1",
                )
                .help("delete the entry and measure the law again: yawrig add measured_law"));
        }
        let of = || Part::ALL.into_iter().zip(curves);
        let parts = of().filter_map(|(p, c)| Some((p, c?.weight)));
        let mut knots = Part::ALL.map(Part::even_knots);
        of().filter_map(|(p, c)| Some((p, c?.knots))).for_each(|(p, k)| knots[p as usize] = k);
        let (yaw_rad, rate_rad_s) = (at.yaw_deg.to_radians(), at.rate_deg_s.to_radians());
        let law =
            MeasuredLaw::new(yaw_rad, rate_rad_s, parts.collect(), at.friction, at.dissipative);
        let law = law.placed(knots).without_line(at.damping_line);
        Ok(Effect::Measured(Arc::new(law)))
    }

    fn parameter(&self, entry: &Spanned<RawParameter>, law: &Law) -> Result<ParameterEntry> {
        let (raw, name) = (entry.get_ref(), &law.name);
        let wrong = |what: String, help: String| Err(self.error(&entry.span(), what).help(help));
        if let Some(unit) = raw.unit.as_ref().filter(|unit| *unit != law.unit) {
            let what = format!("{name} is in {}, not in {unit}", law.unit);
            return wrong(what, format!("convert the value and write unit = \"{}\"", law.unit));
        }
        let (min, max) = (raw.min.unwrap_or(law.min), raw.max.unwrap_or(law.max));
        if !(min <= max && min >= law.min && max <= law.max) {
            let what = format!("{name}: min = {min}, max = {max}");
            return wrong(what, format!("keep {} <= min <= max <= {}", law.min, law.max));
        }
        let free = raw.free.unwrap_or(true);
        match raw.value {
            None if !free => {
                return wrong(format!("{name} is not free and has no value"), "give value".into())
            }
            Some(value) if !(value.is_finite() && min <= value && value <= max) => {
                let what = format!("{name}: value {value} is not between min {min} and max {max}");
                let help = match value < law.min || value > law.max {
                    true => format!(
                        "give a value from {} to {}, or delete it: a fit finds it",
                        law.min, law.max
                    ),
                    false => "move the value or the bounds".into(),
                };
                return wrong(what, help);
            }
            _ => {}
        }
        if raw.u.is_some_and(|u| !(u.is_finite() && u >= 0.0)) {
            let what = format!("{name}: u is not a standard uncertainty");
            return wrong(what, "give 0 or a positive number, or delete it".into());
        }
        Ok(ParameterEntry { value: raw.value, u: raw.u, min, max, free })
    }
}
