//! A doubt about a campaign, and the kinds there are.

use serde::{Deserialize, Serialize};

/// What a doubt is about; an entry `accept` of the campaign names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// An entry that the file may not have.
    Entry,
    /// An entry that is not there.
    Missing,
    /// A record that is not there or cannot be used.
    Record,
    /// A wind-on release without its wind-off one.
    Reference,
    /// A number beyond what is possible or usual in its unit.
    OutOfRange,
    /// A wind speed in another unit.
    WindUnit,
    /// A stiffness in another unit, or of one of two springs.
    StiffnessUnit,
    /// Two springs' stiffnesses exchanged.
    StiffnessExchanged,
    /// A spring that is not on the line through the others.
    SpringDisagrees,
    /// Two records, or two groups of them, exchanged.
    RecordsExchanged,
    /// The records of the two axes exchanged.
    AxesExchanged,
    /// Axes whose frequencies do not go together as on other springs.
    AxesDisagree,
    /// Wind off and wind on exchanged.
    WindExchanged,
    /// A wind-on record in which no wind was, or the other way round.
    NoWind,
    /// What the wind does is not what it does on other springs.
    WindDisagrees,
    /// A release that is not like its repeats.
    RepeatsDisagree,
    /// A record whose clock runs at another rate.
    Clock,
    /// A given inertia that the wind-off releases contradict.
    InertiaDisagrees,
    /// A given inertia in another unit.
    InertiaUnit,
    /// The inertias about the two axes exchanged.
    InertiaExchanged,
    /// An inertia that no such body has.
    InertiaOfNoBody,
    /// The two inertias do not go with the distance of the axes.
    OffsetDisagrees,
    /// Coefficients that no body has in wind of this speed and density.
    CoefficientsUnusual,
    /// One record as two releases.
    SameContent,
    /// Two records that share readings.
    SameRecord,
    /// A reading that is cut off.
    Clipped,
    /// Angles that were never read.
    DeadSpot,
    /// Samples lost.
    LostSamples,
}

impl Kind {
    /// As it stands in files.
    pub fn name(self) -> String {
        let mut name = String::new();
        for c in format!("{self:?}").chars() {
            if c.is_uppercase() && !name.is_empty() {
                name.push('_');
            }
            name.push(c.to_ascii_lowercase());
        }
        name
    }
}

/// Something that does not go together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Doubt {
    /// The campaign's file; filled in by who knows it, as is the line.
    pub file: Option<String>,
    /// In that file, counted from 1.
    pub line: Option<usize>,
    /// The entry, as `air.density_kg_m3`; of the release where there is one.
    pub field: Option<String>,
    /// What it is about.
    pub kind: Kind,
    /// One sentence for the user, without a full stop.
    pub message: String,
    /// The numbers behind it.
    pub evidence: String,
    /// Whether the campaign's file says that it was seen.
    pub accepted: bool,
    /// The release whose entry it is about, by index.
    #[serde(skip)]
    pub release: Option<usize>,
    /// No table can come of it.
    #[serde(skip)]
    pub is_error: bool,
}

impl Doubt {
    /// That `what` is doubtful.
    pub fn new(kind: Kind, message: impl Into<String>, evidence: impl Into<String>) -> Self {
        Self {
            file: None,
            line: None,
            field: None,
            kind,
            message: message.into(),
            evidence: evidence.into(),
            accepted: false,
            release: None,
            is_error: false,
        }
    }

    /// At this release's entry.
    #[must_use]
    pub fn at(self, release: usize, field: &str) -> Self {
        Self { release: Some(release), ..self.field(field) }
    }

    /// At this entry.
    #[must_use]
    pub fn field(self, field: &str) -> Self {
        Self { field: Some(field.to_owned()), ..self }
    }

    /// An error where `is_error`.
    #[must_use]
    pub fn error_if(self, is_error: bool) -> Self {
        Self { is_error, ..self }
    }
}
