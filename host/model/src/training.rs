//! The model of a file as the source of training windows.

use super::document::{self, is_own, Model};
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_core::effects::Effect;
use yawrig_train::augmented::{Asked, Augmented, Source};
use yawrig_train::draws::Ranges;

/// What a network is trained on where nothing else is asked for: a little wider than the rig's range, as a
/// network is at its worst at the edges.
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

/// The model's effects, with the numbers of theirs that the network is to say; `None` where it has none and
/// is the second-order response alone.
///
/// # Errors
/// Exit 2 for what a network cannot be trained on, exit 3 for a file that is no model or not fitted yet.
pub fn augmented(source: &Source, asked: &[Asked]) -> Result<Option<Augmented>> {
    let Source { path, text } = source;
    let model = Model::parse(text, path)?;
    let effects = model.effect_values(path)?;
    let augmented = Augmented::new(effects, wind_speeds(&model, path)?);
    let augmented = augmented.and_then(|a| a.map(|a| a.asking(asked)).transpose());
    augmented.map_err(|e| {
        let message = format!("{}: {}", path.display(), e.message);
        Error { message, ..e }
    })
}

/// Shares of the model's own value between which a number is drawn where no range is given.
const AROUND: [f64; 2] = [0.5, 1.5];

/// The number `name`, `effect.number`, of the model's effects, and what it is to be drawn from: the range
/// given, or one around the model's value.
///
/// # Errors
/// Exit 2 where a network cannot say it, or the range is none for it.
pub fn asked(source: &Source, name: &str, range: Option<[f64; 2]>) -> Result<Asked> {
    let Source { path, text } = source;
    let model = Model::parse(text, path)?;
    let numbers = model.effects.iter().flat_map(|entry| {
        let of = entry.effect.parameters().iter().zip(&entry.parameters).enumerate();
        of.map(move |(index, (parameter, number))| (&entry.effect, index, parameter, number))
    });
    let all: Vec<_> = numbers.map(|n| (format!("{}.{}", n.0, n.2.name), n)).collect();
    let refused = |why: String| Error::usage(format!("{}: {why}", path.display()));
    let Some((_, (effect, index, parameter, number))) = all.iter().find(|(n, _)| n == name) else {
        let names: Vec<&str> = all.iter().map(|(name, _)| name.as_str()).collect();
        let help = match names[..] {
            [] => "add the effect first, or leave the number out".to_owned(),
            _ => format!("its numbers are {}", names.join(", ")),
        };
        return Err(refused(format!("{name} is no number of an effect in it")).help(help));
    };
    if is_own(effect, *index) {
        let why =
            format!("{name} is another one in each release, and is not told from its windows");
        return Err(refused(why).help("leave it out"));
    }
    if effect.measured().is_some() {
        let why =
            format!("{name} is a point of a curve, of which no other is known to change with it");
        return Err(refused(why).help("ask for a number of a named effect"));
    }
    if !number.free {
        let why = format!("{name} is fixed (free = false): what does not vary need not be told");
        return Err(refused(why).help("let it be fitted, or leave it out"));
    }
    let given = settings::given("outputs", &format!("...,{name}=LOW..HIGH"));
    let value = number.value.unwrap_or_default();
    let around = AROUND.map(|share| share * value);
    let [low, high] = range.unwrap_or([around[0].min(around[1]), around[0].max(around[1])]);
    let bounds = [number.min.max(parameter.min), number.max.min(parameter.max)];
    let clamped = |x: f64| if range.is_none() { x.clamp(bounds[0], bounds[1]) } else { x };
    let range = [clamped(low), clamped(high)];
    if !(range.iter().all(|x| x.is_finite()) && range[0] < range[1]) {
        let why = format!("{name} from {} to {} is no range to train on", range[0], range[1]);
        return Err(refused(why).help(format!("give one that rises: {given}")));
    }
    if range[0] < bounds[0] || range[1] > bounds[1] {
        let why = format!(
            "{name} from {} to {} goes beyond its bounds, {} to {}",
            range[0], range[1], bounds[0], bounds[1]
        );
        return Err(refused(why).help(format!("give a narrower one: {given}")));
    }
    Ok(Asked { name: name.to_owned(), unit: parameter.unit.to_string(), range })
}

/// Whether its strength goes with the wind.
fn knows_wind(effect: &Effect) -> bool {
    effect.source() != yawrig_core::effects::Source::Mechanical
}

/// The wind speeds of the model's records that its effects may depend on.
fn wind_speeds(model: &Model, path: &Path) -> Result<Vec<f64>> {
    let uses_wind = model
        .effects
        .iter()
        .find(|e| matches!(e.effect.bare(), Effect::Own(own) if own.program.uses_wind()));
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
        (_, speeds) if model.effects.iter().any(|e| knows_wind(&e.effect)) => Ok(speeds.to_vec()),
        (_, speeds) => Ok(speeds.last().copied().into_iter().collect()),
    }
}
