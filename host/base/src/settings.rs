//! Settings and commands as errors name them: in the words of the program that a library is part of.
//!
//! A setting is called as its field is, `rate_hz`; on a command line that is a flag.

use std::sync::OnceLock;

static SPELLING: OnceLock<&'static dyn Spelling> = OnceLock::new();

/// Something to do, with what it is done to.
#[derive(Clone, Copy, Debug)]
pub struct Command<'a> {
    /// Of the program, `convert`.
    pub verb: &'a str,
    /// As they are, not quoted.
    pub files: &'a [&'a str],
    /// Names and values, not quoted; a value is empty where the name is all there is to say.
    pub settings: &'a [(&'a str, &'a str)],
}

/// How a program calls its settings and commands.
pub trait Spelling: Sync {
    fn name(&self, setting: &str) -> String;
    fn given(&self, setting: &str, value: &str) -> String;
    fn command(&self, command: Command<'_>) -> String;
}

/// What no program spells is called by its name.
struct Plain;

impl Spelling for Plain {
    fn name(&self, setting: &str) -> String {
        setting.to_owned()
    }

    fn given(&self, setting: &str, value: &str) -> String {
        format!("{setting} = {value}")
    }

    fn command(&self, Command { verb, files, settings }: Command<'_>) -> String {
        let settings: Vec<String> = settings.iter().map(|(name, v)| self.given(name, v)).collect();
        let with = if settings.is_empty() { "" } else { " with " };
        [verb].iter().chain(files).copied().collect::<Vec<_>>().join(" ")
            + with
            + &settings.join(", ")
    }
}

/// Has settings and commands called as `spelling` does from now on; the first is kept.
pub fn spell(spelling: &'static dyn Spelling) {
    SPELLING.get_or_init(|| spelling);
}

fn spelling() -> &'static dyn Spelling {
    SPELLING.get().copied().unwrap_or(&Plain)
}

/// What the setting is called.
pub fn name(setting: &str) -> String {
    spelling().name(setting)
}

/// The setting with a value for it.
pub fn given(setting: &str, value: &str) -> String {
    spelling().given(setting, value)
}

/// What to type.
pub fn command(verb: &str, files: &[&str], settings: &[(&str, &str)]) -> String {
    spelling().command(Command { verb, files, settings })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_program_settings_are_called_as_their_fields() {
        assert_eq!(name("rate_hz"), "rate_hz");
        let said = command("convert", &["r.csv", "record.csv"], &[("yaw", "1"), ("unit", "deg")]);
        assert_eq!(said, "convert r.csv record.csv with yaw = 1, unit = deg");
    }
}
