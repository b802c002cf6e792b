//! Why the rig cannot do what is asked.

/// Why the rig cannot do what is asked.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// There is no such spring or effect, or it leaves no free decay.
    #[error("{message}")]
    Wrong {
        quantity: Quantity,
        message: String,
        /// One thing to do about it.
        help: String,
    },
    #[error(transparent)]
    OwnEffect(#[from] yawrig_expression::Error),
}

/// What a refusal is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    Effect,
    Spring,
    WindSpeed,
}

pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    pub(crate) fn wrong(
        quantity: Quantity,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        Self::Wrong { quantity, message: message.into(), help: help.into() }
    }

    /// One thing to do about it.
    pub fn help(&self) -> &str {
        match self {
            Self::Wrong { help, .. } => help,
            Self::OwnEffect(error) => error.help(),
        }
    }
}
