//! One error type for every verb: what failed, where and why, one thing to do, and the exit code.

use std::fmt;
use std::ops::Range;

/// Exit codes scripts rely on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    Internal = 1,
    Usage = 2,
    Data = 3,
    Device = 4,
    Flash = 5,
    Quality = 6,
    Timeout = 7,
    Interrupted = 130,
}

/// A failure as the user sees it.
#[derive(Debug, Clone)]
pub struct Error {
    pub exit: Exit,
    /// What failed, where (file and line, port, frame) and why.
    pub message: String,
    /// One thing to do about it; empty where there is none.
    pub help: String,
    /// Bytes of the text that was given, where the message points into one.
    pub span: Option<Range<usize>>,
}

pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    pub fn new(exit: Exit, message: impl Into<String>) -> Self {
        Self { exit, message: message.into(), help: String::new(), span: None }
    }
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = help.into();
        self
    }
    pub fn at(mut self, span: Range<usize>) -> Self {
        self.span = Some(span);
        self
    }
    pub fn internal(m: impl Into<String>) -> Self {
        Self::new(Exit::Internal, m)
    }
    pub fn usage(m: impl Into<String>) -> Self {
        Self::new(Exit::Usage, m)
    }
    pub fn data(m: impl Into<String>) -> Self {
        Self::new(Exit::Data, m)
    }
    pub fn device(m: impl Into<String>) -> Self {
        Self::new(Exit::Device, m)
    }
    pub fn interrupted() -> Self {
        Self::new(Exit::Interrupted, "interrupted")
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.message)?;
        if !self.help.is_empty() {
            write!(f, "\n  help: {}", self.help)?;
        }
        Ok(())
    }
}

impl std::error::Error for Error {}
