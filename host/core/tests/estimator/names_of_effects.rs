//! No effect of the library is matched by its name outside its own file, the library's list, and the rig,
//! which writes each law anew: what is done with an effect follows from what it says of itself.
//!
//! Read from the sources, without comments and tests: variants of `Effect` in code, identifiers in strings.

use std::fs;
use std::path::{Path, PathBuf};
use yawrig_core::effects::Effect;

/// Where a name is the matter itself, and why.
const NAMED: [(&str, &str, &str); 3] = [
    ("src/demo/story.rs", "", "what the riddle gives the rig to hide, which parses it"),
    ("study/src/rig_records.rs", "", "what the study gives the rig, which parses it"),
    ("verbs/src/law.rs", "hysteresis", "a field of the JSON, whose name stays"),
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() {
            sources(&path, found);
        } else if name.ends_with(".rs") && !name.ends_with("tests.rs") {
            found.push(path);
        }
    }
}

/// Code, and what stands in strings, of `text` without its comments and its tests; lines stay where they are.
fn parted(text: &str) -> [String; 2] {
    let mut rest = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let mut parts = [String::new(), String::new()];
    while let Some(next) = rest.chars().next() {
        let (length, part) = if rest.starts_with("//") {
            (rest.find('\n').unwrap_or(rest.len()), None)
        } else if rest.starts_with("'\"'") {
            (3, None)
        } else if next == '"' {
            let mut escaped = false;
            let end = rest[1..].find(|c| {
                let ends = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                ends
            });
            (end.map_or(rest.len(), |at| at + 2), Some(1))
        } else {
            (next.len_utf8(), Some(0))
        };
        let (head, tail) = rest.split_at(length);
        for (k, out) in parts.iter_mut().enumerate() {
            match part == Some(k) {
                true => out.push_str(head),
                false => out.extend(head.chars().filter(|c| *c == '\n')),
            }
        }
        rest = tail;
    }
    parts
}

/// Lines of `text`, from 1 on, in which `word` stands as a whole.
fn lines_with(text: &str, word: &str) -> Vec<usize> {
    let is_of_word = |c: char| c.is_alphanumeric() || c == '_';
    let has = |line: &str| {
        line.match_indices(word).any(|(at, _)| {
            let (before, after) = (&line[..at], &line[at + word.len()..]);
            !before.ends_with(is_of_word) && !after.starts_with(is_of_word)
        })
    };
    (1..).zip(text.lines()).filter(|(_, line)| has(line)).map(|(n, _)| n).collect()
}

#[test]
fn no_effect_is_matched_by_its_name_outside_its_own_file() {
    let host = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a crate of host");
    let mut files = Vec::new();
    for entry in fs::read_dir(host).expect("host") {
        let folder = entry.expect("an entry").path();
        let folder = if folder.ends_with("src") { folder } else { folder.join("src") };
        if folder.is_dir() && !folder.starts_with(host.join("rig")) {
            sources(&folder, &mut files);
        }
    }
    files.retain(|f| !f.starts_with(host.join("core/src/effects")));
    assert!(files.len() > 100, "{} sources", files.len());
    let mut said = Vec::new();
    let mut used = [false; NAMED.len()];
    for file in files {
        let [code, strings] = parted(&fs::read_to_string(&file).expect("a source"));
        let place = file.strip_prefix(host).expect("in host").to_string_lossy().into_owned();
        for effect in Effect::ALL {
            let (variant, id) = (format!("{effect:?}"), effect.id());
            let found = [lines_with(&code, &variant), lines_with(&strings, id)].concat();
            let allowed = |(of, name, _): &(&str, &str, &str)| {
                *of == place && (name.is_empty() || *name == id)
            };
            match NAMED.iter().position(allowed) {
                Some(k) => used[k] |= !found.is_empty(),
                None => said.extend(found.iter().map(|line| format!("{place}:{line}: {id}"))),
            }
        }
    }
    assert!(said.is_empty(), "effects matched by name:\n{}", said.join("\n"));
    assert_eq!(used, [true; NAMED.len()], "an exception that is none any more");
}

#[test]
fn sources_are_parted_into_code_and_strings() {
    let text = "let a = \"x \\\" y\"; // \"no\"\nlet c = '\"'; let b = \"two\nlines\";\n#[cfg(test)]\nmod tests { \"z\" }";
    let [code, strings] = parted(text);
    assert!(code.starts_with("let a = ; \nlet c = ; let b = \n;\n"), "{code:?}");
    assert_eq!(strings.trim_end(), "\"x \\\" y\"\n\"two\nlines\"");
}
