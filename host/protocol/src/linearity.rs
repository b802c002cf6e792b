//! What a device has of a table for its converter and sensor, in words and as JSON.

use serde_json::{json, Value};
use yawrig_shared::wire::{Absent, Linearity, Settings};

/// Counts of a code of 12 bits, where the device's converter gives so many codes.
const CODES: f64 = 4095.0;

/// What a table of a sweep has for the number of releases that it is learned from, of which three are the fewest.
pub const FROM_SWEEP: u16 = 1;

/// Counts of a code.
pub fn code_counts(settings: &Settings) -> f64 {
    (f64::from(settings.full_scale_counts) / CODES).max(1.0)
}

/// Counts as codes of 12 bits.
pub fn codes(counts: f64, settings: &Settings) -> f64 {
    counts / code_counts(settings)
}

/// What a device says of its table, as JSON: null where there is none.
pub fn json(linearity: &Linearity, settings: &Settings) -> Value {
    let Linearity { knots, learned_from, largest_counts, .. } = *linearity;
    if knots == 0 {
        return Value::Null;
    }
    let largest_codes = codes(f64::from(largest_counts), settings);
    let by = if learned_from == FROM_SWEEP { "sweep" } else { "releases" };
    json!({"by": by, "learned_from": learned_from, "knots": knots, "largest_codes": largest_codes})
}

/// Why a table that was written is not used, as JSON names it.
pub fn absent_name(absent: Absent) -> &'static str {
    match absent {
        Absent::Sensor => "sensor",
        Absent::Damaged => "damaged",
        Absent::Unfinished => "unfinished",
    }
}

/// The same in words.
pub fn text(linearity: &Linearity, settings: &Settings) -> String {
    let Linearity { knots, learned_from, largest_counts, absent } = *linearity;
    match absent {
        Some(Absent::Sensor) => {
            return "not corrected: its table is of another sensor or board".to_owned()
        }
        Some(Absent::Damaged) => {
            return "not corrected: its flash does not hold its table as it was written; write it again"
                .to_owned()
        }
        Some(Absent::Unfinished) => {
            return "not corrected: a table is being written, or was not written to its end".to_owned()
        }
        None => {}
    }
    match knots {
        0 => "not corrected for its converter's error".to_owned(),
        _ => {
            let from = match learned_from {
                FROM_SWEEP => "a sweep".to_owned(),
                releases => format!("{releases} releases"),
            };
            let most = codes(f64::from(largest_counts), settings);
            format!("corrected by a table of {knots} knots from {from}, by up to {most:.1} codes")
        }
    }
}
