//! Errors that point at the character, as compilers do.

use super::expression::Flaw;
use crate::error::Error;
use std::ops::Range;
use std::path::Path;
use yawrig_text::pointed;

/// `message` about `span` (bytes) of the file's `text`, pointing at the character.
pub fn error(file: &Path, text: &str, span: Range<usize>, message: &str, help: &str) -> Error {
    let message = pointed(file, text, span.clone(), message);
    Error::Wrong { message, help: help.to_owned(), span }
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
