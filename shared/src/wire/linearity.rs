//! A table for converter and sensor ([`crate::linearity`]) on its way, and what the device says of its own.

use crate::linearity::Head;
use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Corrections in one message.
pub const PART_KNOTS: usize = 128;

/// A table's head, with some of its corrections.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct LinearityPart {
    pub head: Head,
    /// The knot of the first of them.
    pub at: u16,
    pub corrections: Vec<i8, PART_KNOTS>,
}

/// The table that a device corrects its samples by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Linearity {
    /// Without knots there is none.
    pub knots: u16,
    /// Of so many releases.
    pub learned_from: u16,
    /// Its largest correction.
    pub largest_counts: u16,
    /// Why one that was written is none.
    pub absent: Option<Absent>,
}

/// Why a table that was written is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Absent {
    /// It is of another sensor, or of another board.
    Sensor,
    /// The flash does not hold it as it was written.
    Damaged,
    /// Its parts did not all come.
    Unfinished,
}
