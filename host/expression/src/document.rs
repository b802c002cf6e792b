//! The entries of an own effect's file, and what is said where one is not what it has to be.

use super::{malformed, source};
use crate::error::{Error, Result};
use std::ops::Range;
use std::path::Path;
use toml::de::{DeTable, DeValue};
use toml::Spanned;
use yawrig_text::nearest;

const ENTRIES: [&str; 5] = ["id", "title", "moment", "parameters", "state"];
const OF_STATE: [&str; 4] = ["name", "unit", "rate", "start"];
const OF_PARAMETER: [&str; 4] = ["unit", "start", "min", "max"];
const EXAMPLE: &str = "c = { unit = \"rad/s2\", start = 0.05, min = 0.0 }";
const ENTRY: &str =
    "an entry is NAME = VALUE, such as title = \"My effect\"; a remark begins with #";

/// As it is written; nothing but the kind of each entry has been looked at.
pub struct Document {
    pub id: Spanned<String>,
    pub title: Spanned<String>,
    pub moment: Spanned<String>,
    /// In the order of the file.
    pub parameters: Vec<(Spanned<String>, Declared)>,
    /// In the order of the file.
    pub states: Vec<DeclaredState>,
}

pub struct DeclaredState {
    pub name: Spanned<String>,
    /// A pure number, as which an angle counts, where the file does not say.
    pub unit: Spanned<String>,
    pub rate: Spanned<String>,
    pub start: Option<Spanned<String>>,
}

pub struct Declared {
    pub unit: Spanned<String>,
    pub start: Spanned<f64>,
    pub min: Option<Spanned<f64>>,
    pub max: Option<Spanned<f64>>,
}

type Value<'a> = Spanned<DeValue<'a>>;

/// A file's name and text, for errors that point into it.
pub struct Text<'a> {
    pub file: &'a Path,
    pub text: &'a str,
}

impl Text<'_> {
    pub fn error<T>(&self, at: &Spanned<T>, message: &str, help: &str) -> Error {
        self.error_at(at.span(), message, help)
    }

    fn error_at(&self, at: Range<usize>, message: &str, help: &str) -> Error {
        source::error(self.file, self.text, at, message, help)
    }
}

/// One table of the file: the whole, or a parameter's.
struct Entries<'a> {
    place: &'a Text<'a>,
    table: &'a DeTable<'a>,
    /// ` of c` for a parameter's.
    of: String,
    /// Where what is missing would stand.
    span: Range<usize>,
}

impl Document {
    /// # Errors
    /// Pointing at the character: not TOML, an entry that is unknown, missing or of another kind.
    pub fn read(file: &Path, text: &str) -> Result<Self> {
        let place = &Text { file, text };
        let parsed = DeTable::parse(text).map_err(|e| {
            let span = e.span().unwrap_or(0..0);
            let (at, message, help) = malformed::value(text, span.start)
                .unwrap_or_else(|| (span, e.message().to_owned(), ENTRY.to_owned()));
            place.error_at(at, &message, &help)
        })?;
        let top = Entries { place, table: parsed.get_ref(), of: String::new(), span: 0..0 };
        top.check_names(&ENTRIES, "an effect has id, title, moment, [parameters] and [[state]]")?;
        let parameters = top.get("parameters").map_or(Ok(Vec::new()), |found| {
            let table = found.get_ref().as_table().ok_or_else(|| {
                let help = match found.get_ref() {
                    DeValue::Array(_) => "write [parameters] once, in single brackets".to_owned(),
                    _ => format!("write [parameters] on a line of its own, and below it a line such as {EXAMPLE}"),
                };
                let what = format!("parameters is to be a table, and not {}", kind(found));
                place.error(found, &what, &help)
            })?;
            let one = |(name, value)| declared(place, name, value);
            table.iter().map(one).collect::<Result<Vec<_>>>()
        });
        let mut document = Self {
            id: top.text("id", "id = \"my_effect\"")?,
            title: top.text("title", "title = \"My effect\"")?,
            moment: top.text("moment", "moment = \"-c * sign(r)\"")?,
            parameters: parameters?,
            states: top.get("state").map_or(Ok(Vec::new()), |found| states(place, found))?,
        };
        document.parameters.sort_by_key(|(name, _)| name.span().start);
        Ok(document)
    }
}

fn states(place: &Text, found: &Value) -> Result<Vec<DeclaredState>> {
    const EXAMPLE: &str = "name = \"z\", unit = \"rad\" and rate = \"(b - z) / T\"";
    let help = format!("write [[state]] on a line of its own, and below it {EXAMPLE}");
    let wrong = |found: &Value| {
        let what = format!("state is to be a table in double brackets, and not {}", kind(found));
        place.error(found, &what, &help)
    };
    let list = found.get_ref().as_array().ok_or_else(|| wrong(found))?;
    let one = |value: &Value| {
        let table = value.get_ref().as_table().ok_or_else(|| wrong(value))?;
        let entries = Entries { place, table, of: " of a state".to_owned(), span: value.span() };
        entries.check_names(&OF_STATE, "a state has name, unit, rate and start")?;
        let name = entries.text("name", "name = \"z\"")?;
        let pure = Spanned::new(name.span(), "1".to_owned());
        Ok(DeclaredState {
            name,
            unit: match entries.get("unit") {
                Some(_) => entries.text("unit", "unit = \"rad\"")?,
                None => pure,
            },
            rate: entries.text("rate", "rate = \"(b - z) / T\", how fast it changes")?,
            start: match entries.get("start").map(|found| (found.span(), found.get_ref())) {
                Some((span, DeValue::Float(_) | DeValue::Integer(_))) => {
                    Some(Spanned::new(span.clone(), place.text[span].to_owned()))
                }
                Some(_) => Some(entries.text("start", "start = \"b\", an expression in quotes")?),
                None => None,
            },
        })
    };
    list.iter().map(one).collect()
}

fn declared(
    place: &Text,
    name: &Spanned<std::borrow::Cow<str>>,
    value: &Value,
) -> Result<(Spanned<String>, Declared)> {
    let called = name.get_ref();
    let table = value.get_ref().as_table().ok_or_else(|| {
        let what = format!(
            "the parameter {called} is to have a unit and a start, and not {}",
            kind(value)
        );
        let help = match value.get_ref() {
            DeValue::Integer(_) | DeValue::Float(_) => {
                format!(
                    "write {called} = {{ unit = \"1\", start = {} }}, with its unit",
                    &place.text[value.span()]
                )
            }
            _ => {
                format!("write {called} = {{ unit = \"1\", start = 0.5 }}, with its unit and start")
            }
        };
        place.error(value, &what, &help)
    })?;
    let of = format!(" of {called}");
    let entries = Entries { place, table, of, span: name.span() };
    entries.check_names(&OF_PARAMETER, "a parameter has unit, start, min and max")?;
    let name = Spanned::new(name.span(), called.clone().into_owned());
    let declared = Declared {
        unit: entries.text("unit", "unit = \"rad/s2\", or \"1\" for a pure number")?,
        start: entries
            .required("start", "start = 0.05, a typical size")?
            .number(&entries, "start")?,
        min: entries.optional_number("min")?,
        max: entries.optional_number("max")?,
    };
    Ok((name, declared))
}

impl<'a> Entries<'a> {
    fn get(&self, name: &str) -> Option<&'a Value<'a>> {
        self.table.get(name)
    }

    /// Whether all that is written here is known.
    fn check_names(&self, known: &[&str], all: &str) -> Result<()> {
        let mut unknown: Vec<_> =
            self.table.keys().filter(|key| !known.contains(&key.get_ref().as_ref())).collect();
        unknown.sort_by_key(|key| key.span().start);
        let Some(key) = unknown.first() else { return Ok(()) };
        let name = key.get_ref();
        // What is there already was not meant.
        let free = known.iter().copied().filter(|known| self.get(known).is_none());
        let help = match nearest(name, free) {
            Some(near) => format!("did you mean {near}? {all}"),
            None => format!("take it away: {all}"),
        };
        let whose = if self.of.is_empty() { " of an effect".to_owned() } else { self.of.clone() };
        Err(self.place.error(key, &format!("\"{name}\" is no entry{whose}"), &help))
    }

    fn required(&self, name: &str, example: &str) -> Result<UnexpectedValue<'a>> {
        self.get(name).map(UnexpectedValue).ok_or_else(|| {
            let what = format!("{name}{} is missing", self.of);
            self.place.error_at(self.span.clone(), &what, &format!("add {example}"))
        })
    }

    fn text(&self, name: &str, example: &str) -> Result<Spanned<String>> {
        let UnexpectedValue(value) = self.required(name, example)?;
        match value.get_ref() {
            DeValue::String(text) => Ok(Spanned::new(value.span(), text.clone().into_owned())),
            _ => {
                let what =
                    format!("{name}{} is to be a text in quotes, and not {}", self.of, kind(value));
                Err(self.place.error(value, &what, &format!("write {example}")))
            }
        }
    }

    fn optional_number(&self, name: &str) -> Result<Option<Spanned<f64>>> {
        self.get(name).map(|value| UnexpectedValue(value).number(self, name)).transpose()
    }
}

struct UnexpectedValue<'a>(&'a Value<'a>);

impl UnexpectedValue<'_> {
    fn number(&self, entries: &Entries, name: &str) -> Result<Spanned<f64>> {
        let value = self.0;
        let number = match value.get_ref() {
            DeValue::Float(float) => float.as_str().parse().ok(),
            DeValue::Integer(whole) => {
                i128::from_str_radix(whole.as_str(), whole.radix()).ok().map(|n| n as f64)
            }
            _ => None,
        };
        if let Some(number) = number {
            return Ok(Spanned::new(value.span(), number));
        }
        let what = format!("{name}{} is to be a number, and not {}", entries.of, kind(value));
        let help = match value.get_ref() {
            DeValue::String(text) if text.trim().parse::<f64>().is_ok() => {
                format!("take the quotes away: {name} = {}", text.trim())
            }
            DeValue::Integer(_) => "write it with a decimal point".to_owned(),
            _ if name == "start" => "write a typical size such as 0.05".to_owned(),
            _ => {
                format!("write one number such as 0.0, or leave {name} out where there is no bound")
            }
        };
        Err(entries.place.error(value, &what, &help))
    }
}

/// What stands there, in words.
fn kind(value: &Value) -> String {
    match value.get_ref() {
        DeValue::String(text) => {
            let short: String = text.chars().take(30).collect();
            let dots = if short.len() < text.len() { "…" } else { "" };
            format!("the text {:?}", format!("{short}{dots}"))
        }
        DeValue::Integer(whole) if whole.as_str().len() > 30 => "so large a number".to_owned(),
        DeValue::Integer(whole) => format!("the number {whole}"),
        DeValue::Float(float) => format!("the number {float}"),
        DeValue::Boolean(value) => format!("{value}"),
        DeValue::Datetime(_) => "a date or a time".to_owned(),
        DeValue::Array(_) => "a list in brackets".to_owned(),
        DeValue::Table(_) => "a table".to_owned(),
    }
}

#[cfg(test)]
#[path = "document_tests.rs"]
mod tests;
