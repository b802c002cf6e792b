//! Why a user's own effect cannot be used.

use std::ops::Range;

/// Why a user's own effect cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// Its file cannot be read.
    #[error("cannot read {file}: {why}")]
    Unreadable { file: String, why: String },
    /// What it says is wrong: file, line and column, the line itself, and a caret under it.
    #[error("{message}")]
    Wrong {
        message: String,
        /// One thing to do about it.
        help: String,
        /// Bytes of the text.
        span: Range<usize>,
    },
}

pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// One thing to do about it.
    pub fn help(&self) -> &str {
        match self {
            Self::Unreadable { .. } => "give the path of an effect's TOML file",
            Self::Wrong { help, .. } => help,
        }
    }

    /// Bytes of the text that the message points into.
    pub fn span(&self) -> Option<Range<usize>> {
        match self {
            Self::Unreadable { .. } => None,
            Self::Wrong { span, .. } => Some(span.clone()),
        }
    }
}
