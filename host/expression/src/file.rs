//! The file of a user's own effect, as TOML, and what is refused in it.

use super::document::{Declared, Document, Text};
use super::expression::{self, Flaw};
use super::naming::{is_name, named, one_line};
use super::program::{Program, MAX_PARAMETERS};
use super::samples::Subject;
use super::source::Place;
use super::state_file::{self, Numbers};
use super::units::{self, Unit, Wanted};
use super::{checks, OwnEffect, Parameter};
use crate::error::{Error, Result};
use std::borrow::Cow;
use std::path::Path;
use toml::Spanned;

/// Largest file read, bytes.
const LARGEST: u64 = 65_536;

/// Reads and checks `file`; `taken` are the identifiers of the library.
///
/// # Errors
/// Pointing at the character where there is one.
pub fn read(file: &Path, taken: &[&str]) -> Result<OwnEffect> {
    let unreadable = |why: &dyn std::fmt::Display| Error::Unreadable {
        file: file.display().to_string(),
        why: why.to_string(),
    };
    let about = std::fs::metadata(file).map_err(|e| unreadable(&e))?;
    if about.is_dir() {
        return Err(unreadable(&"it is a folder"));
    }
    if about.len() > LARGEST {
        return Err(unreadable(&format!("it is larger than {LARGEST} bytes")));
    }
    let bytes = std::fs::read(file).map_err(|e| unreadable(&e))?;
    let text = String::from_utf8(bytes).map_err(|e| {
        unreadable(&format!("byte {} is not UTF-8 text", e.utf8_error().valid_up_to()))
    })?;
    from_text(file, &text, taken)
}

/// As `read`, from the file's `text`.
///
/// # Errors
/// Those of `read`.
pub fn from_text(file: &Path, text: &str, taken: &[&str]) -> Result<OwnEffect> {
    compiled(file, text, taken, None)
}

/// What the checks along swings find, which take a tenth of a second.
pub(super) struct Checked {
    pub warnings: Vec<String>,
    pub size_parameter: Option<usize>,
    pub keeps_moving: bool,
}

/// As `from_text`; `known` is what the checks along swings would find.
pub(super) fn compiled(
    file: &Path,
    text: &str,
    taken: &[&str],
    known: Option<Checked>,
) -> Result<OwnEffect> {
    let document = Document::read(file, text)?;
    let place = Text { file, text };
    check_head(&place, &document, taken)?;
    let declared = &document.parameters;
    let (mut parameters, mut units, mut starts) = (Vec::new(), Vec::new(), Vec::new());
    for (name, d) in declared {
        let (parameter, unit) = parameter(&place, name, d)?;
        units.push((parameter.name.to_string(), unit));
        parameters.push(parameter);
        starts.push(*d.start.get_ref());
    }
    for state in &document.states {
        units.push(state_file::named(&place, state, &units)?);
    }
    state_file::check_count(&place, &document.states)?;
    let mut names: Vec<String> = units.iter().map(|u| u.0.clone()).collect();

    let written = document.moment.get_ref();
    let quoted = Place::new(text, document.moment.span(), written);
    let node = expression::parse(written).map_err(|flaw| quoted.error(file, text, &flaw))?;
    let program = Program::new(&node, &names).map_err(|flaw| quoted.error(file, text, &flaw))?;
    // A moment without parameters is fitted by a factor, which is 1 where it is right as it stands.
    let with_factor = format!("{FACTOR} * ({written})");
    let (moment, shift, node, program) = if declared.is_empty() {
        names.insert(0, FACTOR.to_owned());
        parameters.push(Parameter {
            name: FACTOR.into(),
            unit: "1".into(),
            min: f64::NEG_INFINITY,
            max: f64::INFINITY,
        });
        starts.push(1.0);
        let shift = FACTOR.len() + " * (".len();
        let node = expression::parse(&with_factor).expect("as its part");
        let program = Program::new(&node, &names).expect("as its part");
        (&with_factor, shift, node, program)
    } else {
        (written, 0, node, program)
    };
    let in_written = |span: &std::ops::Range<usize>| {
        let at = |place: usize| place.saturating_sub(shift).min(written.len());
        at(span.start)..at(span.end)
    };
    let pointed =
        |flaw: Flaw| quoted.error(file, text, &Flaw { span: in_written(&flaw.span), ..flaw });
    let numbers = Numbers { names: &names, units: &units, parameters: parameters.len() };
    let states = state_file::compiled(&place, &document.states, &numbers, &starts)?;
    let mut used = Vec::new();
    node.names(&mut used);
    let is_used = |name: &str| {
        used.iter().any(|u| u.0 == name) || states.iter().any(|s| s.uses.iter().any(|u| u == name))
    };
    if let Some((name, _)) = declared.iter().find(|(name, _)| !is_used(name.get_ref())) {
        let message = format!("the moment does not use the parameter \"{}\"", name.get_ref());
        return Err(place.error(name, &message, "use it in the moment or take it away"));
    }
    state_file::check_used(&place, &document.states, &used)?;
    let states: Vec<_> = states.into_iter().map(|s| s.state).collect();
    // A number without a name has no unit to be checked by.
    if !declared.is_empty() || !states.is_empty() {
        units::check(moment, &node, &units, &Wanted::moment()).map_err(pointed)?;
    }
    let first_use = |name: &str| used.iter().find(|u| u.0 == name).map(|u| u.1.clone());
    let subject = Subject {
        node: &node,
        program: &program,
        names: &names,
        states: &states,
        starts: &starts,
        bounds: parameters.iter().map(|p| (p.min, p.max)).collect(),
    };
    let warned = |flaw: &Flaw| {
        let at = quoted.of(&in_written(&flaw.span));
        format!("{}\n  help: {}", yawrig_text::pointed(file, text, at, &flaw.message), flaw.help)
    };
    let checked = match known {
        Some(known) => known,
        None => Checked {
            warnings: (checks::check(&subject, &first_use).map_err(pointed)?.iter())
                .map(warned)
                .collect(),
            size_parameter: checks::size_parameter(&subject),
            keeps_moving: checks::keeps_moving(&subject),
        },
    };
    let moment = one_line(moment, &node);
    let rates = states.iter().map(|s| format!(", {}' = {}", s.name, s.rate)).collect::<String>();
    Ok(OwnEffect {
        id: document.id.into_inner(),
        title: document.title.into_inner(),
        formula: format!("{moment}{rates}"),
        moment,
        warnings: checked.warnings,
        size_parameter: checked.size_parameter,
        keeps_moving: checked.keeps_moving,
        program,
        parameters,
        states,
        starts,
        text: text.to_owned(),
        words: None,
    })
}

/// Identifier, title, and how many parameters there are.
fn check_head(place: &Text, document: &Document, taken: &[&str]) -> Result<()> {
    check_id(place, &document.id, taken)?;
    if document.title.get_ref().trim().is_empty() {
        return Err(place.error(&document.title, "the title is empty", "say what the effect is"));
    }
    document.parameters.get(MAX_PARAMETERS).map_or(Ok(()), |(name, _)| {
        let message = format!("more than {MAX_PARAMETERS} parameters");
        Err(place.error(name, &message, "no record tells so many apart"))
    })
}

fn check_id(place: &Text, id: &Spanned<String>, taken: &[&str]) -> Result<()> {
    let name = id.get_ref();
    if !is_name(name) {
        let message = format!("\"{name}\" is no identifier");
        return Err(place.error(id, &message, IDENTIFIER));
    }
    if taken.contains(&name.as_str()) {
        let message = format!("\"{name}\" is an effect of the library");
        return Err(place.error(id, &message, "give your own effect another id"));
    }
    Ok(())
}

/// What a moment without parameters is multiplied by.
const FACTOR: &str = "factor";
const IDENTIFIER: &str = "lower-case letters, digits and _, a letter first, at most 40";

fn parameter(place: &Text, name: &Spanned<String>, d: &Declared) -> Result<(Parameter, Unit)> {
    let called = name.get_ref();
    let unit = named(place, name, &d.unit, "parameter")?;
    for (what, value) in
        [("start", Some(&d.start)), ("min", d.min.as_ref()), ("max", d.max.as_ref())]
    {
        if let Some(value) = value.filter(|v| !v.get_ref().is_finite()) {
            let message = format!("{what} of {called} is not finite");
            return Err(place.error(
                value,
                &message,
                "leave min or max out where there is no bound",
            ));
        }
    }
    let start = *d.start.get_ref();
    let min = d.min.as_ref().map_or(f64::NEG_INFINITY, |v| *v.get_ref());
    let max = d.max.as_ref().map_or(f64::INFINITY, |v| *v.get_ref());
    if min >= max {
        let at = d.min.as_ref().or(d.max.as_ref()).unwrap_or(&d.start);
        let message = format!("min of {called}, {min}, is not below its max, {max}");
        return Err(place.error(at, &message, "leave room between them"));
    }
    if !(min..=max).contains(&start) {
        let message = format!("start of {called}, {start}, is not between its bounds");
        return Err(place.error(&d.start, &message, "start within min and max"));
    }
    if start == 0.0 {
        let message = format!("start of {called} is zero");
        let help = "give a typical size: the fit takes its steps from it, and tries none as well";
        return Err(place.error(&d.start, &message, help));
    }
    let owned = |text: &str| Cow::Owned(text.to_owned());
    let parameter = Parameter { name: owned(called), unit: owned(d.unit.get_ref()), min, max };
    Ok((parameter, unit))
}
