//! Effects by name: those of the library, and the user's own by the path of their file.

use std::collections::HashSet;
use std::path::Path;
use std::sync::{Arc, LazyLock, Mutex};
use yawrig_base::error::{Error, Result};
use yawrig_core::effects::{Effect, MEASURED_LAW};
pub use yawrig_expression::is_file;
use yawrig_expression::{all_ready_made, ready_made, OwnEffect};
use yawrig_text::nearest;

/// An effect from the command line or a model file: an identifier, or the path of a file ending in `.toml`.
///
/// # Errors
/// Exit 2 for an identifier that there is not, with the nearest; exit 3 for a file that cannot be used.
pub fn named(text: &str) -> Result<Effect> {
    if is_file(text) {
        return load(Path::new(text));
    }
    if text == MEASURED_LAW {
        return Err(Error::usage("measured_law is estimated from the records of a model")
            .help("yawrig add measured_law; to look first: yawrig law FILE"));
    }
    let ready_made = || ready_made(text).map(Effect::Own);
    Effect::from_id(text).or_else(ready_made).ok_or_else(|| {
        let mut ids = Effect::ids();
        ids.extend(all_ready_made().iter().map(|own| &*own.id));
        let help = match nearest(text, ids.iter().copied()) {
            Some(near) => {
                format!("did you mean {near}? Your own is given as the path of its .toml file")
            }
            None => format!(
                "the effects are {}, or the path of your own effect's .toml file",
                ids.join(", ")
            ),
        };
        Error::usage(format!("there is no effect \"{text}\"")).help(help)
    })
}

/// Those with equations of their own that are known by name; they are tried where they are asked for.
pub fn ready_made_effects() -> impl Iterator<Item = Effect> {
    all_ready_made().iter().cloned().map(Effect::Own)
}

/// Reads a user's own effect.
///
/// # Errors
/// Exit 3: unreadable, or wrong, pointing at the character.
pub fn load(file: &Path) -> Result<Effect> {
    Ok(own(yawrig_expression::read(file, &Effect::ids())?))
}

/// A user's own effect from the `text` of its definition, which stands in `file`.
///
/// # Errors
/// Exit 3, pointing at the character in `text`.
pub fn defined(file: &Path, text: &str) -> Result<Effect> {
    Ok(own(yawrig_expression::from_text(file, text, &Effect::ids())?))
}

/// What has been warned of: a file is read more than once in a run.
static WARNED: LazyLock<Mutex<HashSet<String>>> = LazyLock::new(Mutex::default);

fn own(effect: OwnEffect) -> Effect {
    let mut warned = WARNED.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    for warning in &effect.warnings {
        if warned.insert(warning.clone()) {
            yawrig_base::warn!("{warning}");
        }
    }
    Effect::Own(Arc::new(effect))
}

/// Each effect once.
///
/// # Errors
/// Exit 3 where two files of different content have one identifier.
pub fn distinct(effects: Vec<Effect>) -> Result<Vec<Effect>> {
    let mut once: Vec<Effect> = Vec::new();
    for effect in effects {
        match (once.iter().find(|other| **other == effect), effect.bare()) {
            (None, _) => once.push(effect),
            (Some(Effect::Own(a)), Effect::Own(b)) if a.text != b.text => {
                return Err(Error::data(format!("two effects with the id \"{}\"", a.id))
                    .help("give each effect its own id"))
            }
            _ => {}
        }
    }
    Ok(once)
}
