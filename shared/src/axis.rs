//! About which axis a model is turned.

use core::fmt;
use core::str::FromStr;

/// The vertical axis the model turns about.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// The middle of the wheelbase.
    Mid,
    /// Ahead of it by the axis offset.
    Front,
}

impl Axis {
    pub const BOTH: [Self; 2] = [Self::Mid, Self::Front];

    /// As files and the command line write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mid => "mid",
            Self::Front => "front",
        }
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Axis {
    type Err = ();

    /// From the name that [`fmt::Display`] gives.
    fn from_str(text: &str) -> Result<Self, ()> {
        Self::BOTH.into_iter().find(|axis| axis.name() == text).ok_or(())
    }
}
