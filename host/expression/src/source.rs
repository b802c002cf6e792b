//! Errors that point at the character, as compilers do.

use super::expression::Flaw;
use crate::error::{Error, Exit};
use std::fmt::Write as _;
use std::ops::Range;
use std::path::Path;

/// `flaw` at `span` (bytes) of the file's `text`: file, line and column, the line itself and a caret under it.
pub fn error(file: &Path, text: &str, span: Range<usize>, message: &str, help: &str) -> Error {
    Error::new(Exit::Data, pointed(file, text, span.clone(), message)).help(help).at(span)
}

/// The message alone.
pub fn pointed(file: &Path, text: &str, span: Range<usize>, message: &str) -> String {
    let floor = |mut at: usize| {
        at = at.min(text.len());
        while !text.is_char_boundary(at) {
            at -= 1;
        }
        at
    };
    let (start, end) = (floor(span.start), floor(span.end));
    let line_start = text[..start].rfind('\n').map_or(0, |n| n + 1);
    let line_number = text[..start].matches('\n').count() + 1;
    let line = text[line_start..].lines().next().unwrap_or("");
    let before = &text[line_start..start];
    let column = before.chars().count() + 1;
    let line_end = line_start + line.len();
    let width = text[start..end.clamp(start, line_end.max(start))].chars().count().max(1);
    // Tabs keep their width, whatever that is.
    let indent: String = before.chars().map(|c| if c == '\t' { '\t' } else { ' ' }).collect();
    let gutter = " ".repeat(line_number.to_string().len());
    let mut out = format!("{}:{line_number}:{column}: {message}\n", file.display());
    let _ = writeln!(out, "  {line_number} | {line}");
    let _ = write!(out, "  {gutter} | {indent}{}", "^".repeat(width));
    out
}

/// Where byte ranges of a TOML string's value stand in the file.
pub struct Place {
    /// Of the value, quotes included.
    pub quoted: Range<usize>,
    /// Of its first character; `None` where escapes make characters of the value and of the file differ.
    first: Option<usize>,
}

impl Place {
    pub fn new(text: &str, quoted: Range<usize>, value: &str) -> Self {
        let first = text[quoted.clone()].find(value).map(|at| quoted.start + at);
        Self { quoted, first: first.filter(|_| !value.is_empty()) }
    }

    pub fn of(&self, span: &Range<usize>) -> Range<usize> {
        match self.first {
            Some(first) => first + span.start..first + span.end,
            None => self.quoted.clone(),
        }
    }

    pub fn error(&self, file: &Path, text: &str, flaw: &Flaw) -> Error {
        error(file, text, self.of(&flaw.span), &flaw.message, &flaw.help)
    }
}

/// The name nearest to a misspelt one, if any is near.
pub fn nearest<'a>(wrong: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    names
        .into_iter()
        .map(|name| (strsim::damerau_levenshtein(wrong, name), name))
        .filter(|(distance, name)| *distance <= (name.len().max(wrong.chars().count()) + 1) / 3)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, name)| name)
}
