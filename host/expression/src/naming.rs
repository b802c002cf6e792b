//! How an own effect's file writes expressions on one line, and names what it has.

use super::document::Text;
use super::expression::Node;
use super::program::{function, FUNCTIONS, INPUTS};
use super::source::Place;
use super::units::Unit;
use crate::error::Result;
use toml::Spanned;

const LONGEST_NAME: usize = 40;

/// An expression as cards show it.
pub(super) fn one_line(text: &str, node: &Node) -> String {
    let start = node.span.start.min(text.len() - text.trim_start().len());
    text[start..].split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The unit of a number called so, `what` it is.
pub(super) fn named(
    place: &Text,
    name: &Spanned<String>,
    unit: &Spanned<String>,
    what: &str,
) -> Result<Unit> {
    let called = name.get_ref();
    let reserved = INPUTS.iter().any(|i| i.0 == called) || called == "pi";
    if reserved || function(called).is_some() {
        let message = format!("\"{called}\" is reserved");
        let names = INPUTS.iter().map(|i| i.0).chain(["pi"]).chain(FUNCTIONS.iter().map(|f| f.0));
        let help = format!("take another name than {}", names.collect::<Vec<_>>().join(", "));
        return Err(place.error(name, &message, &help));
    }
    if !is_name(called) && !called.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        || called.starts_with(|c: char| c.is_ascii_digit())
        || called.is_empty()
        || called.len() > LONGEST_NAME
    {
        let message = format!("\"{called}\" is no name of a {what}");
        return Err(place.error(
            name,
            &message,
            "letters, digits and _, a letter first, at most 40",
        ));
    }
    let quoted = Place::new(place.text, unit.span(), unit.get_ref());
    Unit::parse(unit.get_ref()).map_err(|flaw| quoted.error(place.file, place.text, &flaw))
}

pub(super) fn is_name(name: &str) -> bool {
    let other = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(other)
        && name.len() <= LONGEST_NAME
}
