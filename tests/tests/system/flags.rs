//! Flags of the program, which its libraries do not name.

use crate::imports::{root, Modules, ROOMS};
use std::fs;

/// Crates that name flags; what the others say of settings, the program spells (`yawrig_base::settings`).
const NAME_FLAGS: [&str; 7] = [
    "host",
    "host/python",
    "host/report",
    "host/session",
    "host/study",
    "host/verbs",
    "host/workbench",
];
/// Of another program.
const FOREIGN_FLAGS: [&str; 1] = ["--pdeathsig"];

/// Flags in a line, as `--rate-hz`; a rule of dashes is none, nor is what stands inside a word.
fn flags(line: &str) -> Vec<&str> {
    let starts = line.match_indices("--").map(|(at, _)| at);
    let flag = |at: usize| {
        let after = &line[at + 2..];
        let length = after.find(|c: char| !c.is_ascii_alphanumeric() && c != '-');
        let is_flag = after.starts_with(|c: char| c.is_ascii_lowercase())
            && !line[..at].ends_with(|c: char| c.is_alphanumeric() || c == '-');
        is_flag.then(|| &line[at..at + 2 + length.unwrap_or(after.len())])
    };
    starts.filter_map(flag).collect()
}

#[test]
fn libraries_name_no_flags() {
    let mut wrong = Vec::new();
    for room in ROOMS.iter().filter(|room| !NAME_FLAGS.contains(&room.0)) {
        for (name, _) in Modules::read(room).files.values() {
            let path = root().join(room.0).join("src").join(name);
            let text = fs::read_to_string(&path).expect("it was read");
            for (index, line) in text.lines().enumerate() {
                let named = flags(line).into_iter().filter(|flag| !FOREIGN_FLAGS.contains(flag));
                wrong.extend(named.map(|flag| format!("{}:{}: {flag}", path.display(), index + 1)));
            }
        }
    }
    assert!(wrong.is_empty(), "flags in libraries:\n{}", wrong.join("\n"));
}

#[test]
fn flags_are_told_from_dashes() {
    let line = r#"help("--yaw {} or --rate-hz") // ----- a--b x --- {}--{} "--""#;
    assert_eq!(flags(line), ["--yaw", "--rate-hz"]);
}
