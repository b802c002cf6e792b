//! The model of a file as the source of training windows.

use super::document::{self, Model};
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_core::effects::Effect;
use yawrig_train::augmented::{Augmented, Source};
use yawrig_train::draws::Ranges;

/// What a network is trained on where nothing else is asked for: a little wider than the rig's range, as a network is at
/// its worst at the edges.
pub const RANGES: Ranges = Ranges {
    natural_frequency_rad_s: [2.4, 28.0],
    damping_ratio: [0.0005, 0.105],
    noise: [0.002, 0.01],
};

/// The text of the model in `path`.
///
/// # Errors
/// Exit 3 where the file cannot be read.
pub fn read(path: &Path) -> Result<Source> {
    Ok(Source { path: path.to_owned(), text: document::read_text(path)? })
}

/// The model's effects; `None` where it has none and is the second-order response alone.
///
/// # Errors
/// Exit 2 for what a network cannot be trained on, exit 3 for a file that is no model or not fitted yet.
pub fn augmented(source: &Source) -> Result<Option<Augmented>> {
    let Source { path, text } = source;
    let model = Model::parse(text, path)?;
    let effects = model.effect_values(path)?;
    Augmented::new(effects, wind_speed(&model, path)?).map_err(|e| {
        let message = format!("{}: {}", path.display(), e.message);
        Error { message, ..e }
    })
}

/// The wind speed of the model's records, which the user's own effects may depend on.
fn wind_speed(model: &Model, path: &Path) -> Result<f64> {
    let uses_wind = model
        .effects
        .iter()
        .find(|e| matches!(&e.effect, Effect::Own(own) if own.program.uses_wind()));
    let mut speeds: Vec<f64> =
        model.records.iter().filter_map(|r| Some(r.made_under.as_ref()?.wind_speed_m_s)).collect();
    speeds.sort_by(f64::total_cmp);
    speeds.dedup();
    match (uses_wind, speeds.as_slice()) {
        (Some(entry), [_, _, ..]) => Err(Error::usage(format!(
            "{}: {} depends on the wind speed, and the records have {} of them",
            path.display(),
            entry.effect,
            speeds.len()
        ))
        .help("fit a model to the releases at one wind speed, and train on that")),
        (_, speeds) => Ok(speeds.last().copied().unwrap_or(0.0)),
    }
}
