//! The program's help: its verbs by what they are for.

use super::Cli;
use clap::{Command, CommandFactory, FromArgMatches};
use std::fmt::Write;

/// What verbs are for, and which.
const GROUPS: [(&str, &[&str]); 6] = [
    ("Begin here", &["demo", "workbench", "doctor"]),
    ("What records say", &["identify", "derivatives", "campaign", "convert", "simulate"]),
    ("What the model lacks", &["compare", "diagnose", "law", "plan"]),
    ("The model", &["fit", "add", "remove", "reject", "history", "export", "report"]),
    ("The device", &["train", "flash", "device", "monitor", "replay", "ports", "keygen"]),
    ("Besides", &["study", "completions", "help"]),
];
/// Columns of the help, and of the names with the spaces about them.
const WIDTH: usize = 80;
const NAMES: usize = 15;
/// Bold, for a heading underlined, and what ends it: as other headings are; a pipe gets them without.
const BOLD: &str = "\x1b[1m";
const HEADING: &str = "\x1b[1m\x1b[4m";
const PLAIN: &str = "\x1b[0m";

impl Cli {
    /// The command line's arguments; help, versions and errors end the process.
    pub fn from_command_line() -> Self {
        let mut command = Self::command();
        command.build();
        let help = by_group(&command);
        let matches = command.help_template(help).get_matches();
        Self::from_arg_matches(&matches).unwrap_or_else(|e| e.exit())
    }
}

fn by_group(command: &Command) -> String {
    let mut text = "{about-with-newline}\n{usage-heading} {usage}\n".to_owned();
    for (title, names) in GROUPS {
        let _ = write!(text, "\n{HEADING}{title}:{PLAIN}\n");
        for verb in names.iter().filter_map(|name| command.find_subcommand(name)) {
            let about = verb.get_about().map(ToString::to_string).unwrap_or_default();
            let name = verb.get_name();
            let _ = write!(text, "  {BOLD}{name}{PLAIN}{:1$}", "", NAMES - 2 - name.len());
            let mut column = NAMES;
            for word in about.split_whitespace() {
                if column + word.chars().count() > WIDTH {
                    text.truncate(text.trim_end_matches(' ').len());
                    let _ = write!(text, "\n{:NAMES$}", "");
                    column = NAMES;
                }
                let _ = write!(text, "{word} ");
                column += word.chars().count() + 1;
            }
            text.truncate(text.trim_end_matches(' ').len());
            text.push('\n');
        }
    }
    let _ = write!(text, "\n{HEADING}Options:{PLAIN}\n{{options}}");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_verb_is_in_one_group() {
        let mut command = Cli::command();
        command.build();
        let mut verbs: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
        let mut grouped = GROUPS.map(|(_, names)| names.to_vec()).concat();
        verbs.sort_unstable();
        grouped.sort_unstable();
        assert_eq!(verbs, grouped);
    }
}
