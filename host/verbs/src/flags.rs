//! Errors and settings of the libraries, which know no flags, in the words of this program.

use yawrig_base::error::Error;
use yawrig_base::settings::{Command, Spelling};
use yawrig_core::error::Error as Core;
use yawrig_text::quoted;

/// Settings are flags, commands those of a shell.
pub struct Flags;

impl Spelling for Flags {
    fn name(&self, setting: &str) -> String {
        format!("--{}", setting.replace('_', "-"))
    }

    fn given(&self, setting: &str, value: &str) -> String {
        match value {
            "" => self.name(setting),
            value => format!("{} {}", self.name(setting), quoted(value)),
        }
    }

    fn command(&self, Command { verb, files, settings }: Command<'_>) -> String {
        let files = files.iter().map(|file| quoted(file));
        let settings = settings.iter().map(|(name, value)| self.given(name, value));
        let words = ["yawrig".to_owned(), verb.to_owned()].into_iter().chain(files).chain(settings);
        words.collect::<Vec<_>>().join(" ")
    }
}

/// Flags that say these settings, each behind a blank.
pub fn of(settings: &[(&str, String)]) -> String {
    settings.iter().map(|(name, value)| format!(" {}", Flags.given(name, value))).collect()
}

/// `error` with the flags that help.
pub fn named(error: Error) -> Error {
    let help = match error.cause.as_deref() {
        Some(Core::TooFewCycles { .. }) => {
            "record a longer free decay, or widen the amplitude window with --from-deg and --to-deg"
        }
        Some(Core::BeyondHalfTurn { .. }) => {
            "name the column yaw_deg if it is in degrees (`yawrig convert --unit deg` does); if that angle is meant, say so \
             with a --from-deg above it"
        }
        Some(Core::Elsewhere { .. }) => {
            "choose --from-deg and --to-deg between those of the record"
        }
        Some(Core::NoEstimate { .. }) => "try another --method",
        _ => return error,
    };
    error.help(help)
}
