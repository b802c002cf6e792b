//! Settings in errors as Python calls them.

use yawrig_base::settings::{Command, Spelling};
use yawrig_verbs::flags::Flags;

/// Keyword arguments of `yawrig.read`.
const READ: [&str; 7] = ["time", "yaw", "unit", "time_unit", "rate_hz", "quantity", "motion"];

/// Settings are keyword arguments; what only the program does is its command.
pub struct Keywords;

impl Spelling for Keywords {
    fn name(&self, setting: &str) -> String {
        setting.to_owned()
    }

    fn given(&self, setting: &str, value: &str) -> String {
        match (setting, value) {
            ("rate_hz", _) => format!("{setting}={value}"),
            (_, "") => format!("{setting}=True"),
            _ => format!("{setting}={value:?}"),
        }
    }

    fn command(&self, command: Command<'_>) -> String {
        let Command { verb, files, settings } = command;
        let is_read = settings.iter().all(|(name, _)| READ.contains(name));
        match (verb, files) {
            ("convert", [file, ..]) if is_read => {
                let settings = settings.iter().map(|(name, value)| self.given(name, value));
                let all: Vec<String> = [format!("{file:?}")].into_iter().chain(settings).collect();
                format!("yawrig.read({})", all.join(", "))
            }
            _ => Flags.command(command),
        }
    }
}
