//! What a file holds, for a page that asks which of it is meant where the file does not say so itself.

use serde_json::{json, Value};
use std::path::Path;
use yawrig_base::error::Result;
use yawrig_records::{channels, read_selected, Selection};

/// Points of a channel's sketch.
const SKETCHED: usize = 160;

/// Whether `file` can be read as it is, and if not, why and what is in it.
///
/// # Errors
/// Exit 3 where nothing can be read of it.
pub fn asked(file: &Path, reading: &Selection) -> Result<Value> {
    let error = match read_selected(file, reading) {
        Ok(_) => return Ok(json!({"file": file, "is_clear": true})),
        Err(error) => error,
    };
    // What has no channels cannot be asked about.
    let Ok(all) = channels(file) else { return Err(error) };
    let described = all.iter().map(|channel| {
        let values = channel.values.as_deref().unwrap_or_default();
        json!({
            "name": channel.name,
            "unit": channel.unit,
            "numbers": values.iter().filter(|v| v.is_finite()).count(),
            "wrong": channel.values.as_ref().err(),
            "sketch": sketch(values),
        })
    });
    Ok(json!({
        "file": file,
        "is_clear": false,
        "why": error.message,
        "help": error.help,
        "channels": described.collect::<Vec<_>>(),
    }))
}

/// The least and the largest of each stretch, between 0 and 1; a gap is null.
fn sketch(values: &[f64]) -> Vec<Option<f64>> {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let (low, high) =
        finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let share = |v: f64| match high > low {
        true => (v - low) / (high - low),
        false => 0.5,
    };
    let length = values.len().div_ceil(SKETCHED / 2).max(1);
    let ends = |part: &[f64]| {
        let inside = part.iter().copied().filter(|v| v.is_finite());
        let (l, h) =
            inside.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        [l, h].map(|v| Some(share(v)).filter(|_| l <= h))
    };
    values.chunks(length).flat_map(ends).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sketch_holds_the_ends_of_each_stretch() {
        let values: Vec<f64> =
            (0..8000).map(|k| if k == 4000 { 9.0 } else { f64::from(k % 2) }).collect();
        let drawn = sketch(&values);
        assert_eq!(drawn.len(), SKETCHED);
        assert_eq!(drawn.iter().flatten().fold(0.0f64, |m, v| m.max(*v)), 1.0);
        assert_eq!(drawn[0], Some(0.0));
        assert_eq!(sketch(&[f64::NAN, f64::NAN]), [None, None, None, None]);
        assert_eq!(sketch(&[3.0]), [Some(0.5), Some(0.5)]);
    }
}
