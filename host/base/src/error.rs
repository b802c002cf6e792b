//! One error type for every verb: what failed, where and why, one thing to do, and the exit code.

use crate::settings;
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
    /// What the core refused: a program can say its remedy in its own words.
    pub cause: Option<Box<yawrig_core::error::Error>>,
}

pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    pub fn new(exit: Exit, message: impl Into<String>) -> Self {
        Self { exit, message: message.into(), help: String::new(), span: None, cause: None }
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

impl From<yawrig_core::error::Error> for Error {
    fn from(error: yawrig_core::error::Error) -> Self {
        use yawrig_core::error::Error as Core;
        let (exit, help) = match &error {
            Core::NoRelease => (Exit::Usage, "give at least one record"),
            Core::NoOscillation { .. } => {
                (Exit::Data, "check that the record holds a released free decay in its second column")
            }
            Core::TooFewCycles { .. } => (
                Exit::Data,
                "record a longer free decay, or widen the amplitude window",
            ),
            Core::BeyondHalfTurn { .. } => (
                Exit::Data,
                "see that its unit is that of the record; if that angle is meant, let the amplitude window begin above it",
            ),
            Core::Elsewhere { .. } => {
                (Exit::Data, "choose an amplitude window between those of the record")
            }
            Core::NoEstimate { .. } => (Exit::Data, "try another method"),
            Core::TooFewSamples { .. } => (Exit::Data, ""),
            Core::TooSlow { .. } => {
                (Exit::Data, "`yawrig identify` takes it as it is; a device wants it measured faster")
            }
            Core::Gaps { .. } => {
                (Exit::Data, "correct the time stamps, or cut the record where they jump")
            }
            Core::TooCoarse { .. } => (
                Exit::Data,
                "see that time_s is in seconds; measure again with more samples a second",
            ),
            Core::OtherMeasurand { .. } => {
                (Exit::Data, "give records of one quantity and unit, or one after the other")
            }
            Core::NotFitted => (
                Exit::Quality,
                "`yawrig compare` shows where it fails; `yawrig remove` takes an effect out",
            ),
            Core::NoMiddleAxis => (
                Exit::Data,
                "add releases with axis = \"mid\": Cn_beta and Cn_r are those of the middle axis",
            ),
            Core::NoLaw => (Exit::Quality, "measure it from a longer release, or one from a larger amplitude"),
            Core::NoTable => (Exit::Data, "give longer releases, from different amplitudes"),
            Core::Interrupted => (Exit::Interrupted, ""),
        };
        let named = Self::new(exit, error.to_string()).help(help);
        Self { cause: Some(Box::new(error)), ..named }
    }
}

impl From<yawrig_rig::Error> for Error {
    fn from(error: yawrig_rig::Error) -> Self {
        use yawrig_rig::{Error as Rig, Quantity};
        match error {
            Rig::OwnEffect(error) => error.into(),
            Rig::Wrong { quantity, message, help } => {
                let setting = match quantity {
                    Quantity::Effect => "effect",
                    Quantity::Spring => "spring",
                    Quantity::WindSpeed => "wind",
                };
                Self::usage(format!("{}: {message}", settings::name(setting))).help(help)
            }
        }
    }
}

impl From<yawrig_expression::Error> for Error {
    fn from(error: yawrig_expression::Error) -> Self {
        let span = error.span();
        Self { span, ..Self::data(error.to_string()).help(error.help()) }
    }
}
