//! The names of `CONTRIBUTING.md`, "Names": what is written, and what is not.

use crate::imports::{root, tokens, Modules, ROOMS};
use std::fs;

/// Of each row of the table: what is not written, and in what.
fn banned() -> Vec<(String, String)> {
    let text = fs::read_to_string(root().join("CONTRIBUTING.md")).expect("the page");
    let rows = text.split("## Names").nth(1).and_then(|rest| rest.split("\n## ").next());
    let rows = rows.expect("the table").lines().filter(|line| line.starts_with("| `"));
    let cells = rows.map(|row| row.split('|').map(str::trim).collect::<Vec<_>>());
    let words = |cells: Vec<&str>| -> Vec<(String, String)> {
        let of = |word: &str| (word.trim_matches('`').to_owned(), cells[3].to_owned());
        cells[2].split(", ").map(of).collect()
    };
    cells.flat_map(words).collect()
}

/// Whether the function whose parameters begin at `open` takes no `self` and gives its own type.
fn constructs(tokens: &[String], open: usize) -> bool {
    let mut depth = 0;
    let closes = |token: &String| {
        depth += match token.as_str() {
            "(" => 1,
            ")" => -1,
            _ => 0,
        };
        depth == 0
    };
    let Some(length) = tokens[open..].iter().position(closes) else { return false };
    let (given, after) = tokens[open..].split_at(length);
    let body = after.iter().position(|t| t == "{" || t == ";").unwrap_or(after.len());
    let is_method = given.iter().take(6).any(|t| t == "self");
    !is_method && after[..body].iter().any(|t| t == "Self")
}

/// What of the `banned` names a source defines.
fn defined(text: &str, banned: &[(String, String)]) -> Vec<String> {
    let tokens = tokens(text);
    let mut found = Vec::new();
    for (k, pair) in tokens.windows(2).enumerate() {
        let name = &pair[1];
        let is_bad = |(word, kind): &(String, String)| match (pair[0].as_str(), kind.as_str()) {
            ("const" | "static", "constants") => {
                let part = word.trim_end_matches('_');
                name.split('_').any(|own| own == part)
            }
            ("fn", "functions") => name == word,
            ("fn", "constructors") => {
                let open = tokens[k..].iter().position(|t| t == "(");
                name == word && open.is_some_and(|open| constructs(&tokens, k + open))
            }
            _ => false,
        };
        if banned.iter().any(is_bad) {
            found.push(name.clone());
        }
    }
    found
}

#[test]
fn names_are_those_of_the_field() {
    let banned = banned();
    assert!(banned.len() >= 6, "{banned:?}");
    let mut found = Vec::new();
    for room @ (folder, ..) in &ROOMS {
        for (file, _) in Modules::read(room).files.values() {
            let text = fs::read_to_string(root().join(folder).join("src").join(file));
            let names = defined(&text.expect("a source"), &banned);
            found.extend(names.into_iter().map(|name| format!("{folder}/src/{file}: {name}")));
        }
    }
    assert!(found.is_empty(), "not as CONTRIBUTING.md writes them:\n{}", found.join("\n"));
    // It sees what it looks for.
    let bad = "const MOST_BYTES: u8 = 1; impl T { fn of(x: u8) -> Option<Self> { None } \
        fn of(&self) -> Self { T } fn evidence() {} }";
    assert_eq!(defined(bad, &banned), ["MOST_BYTES", "of", "evidence"]);
}
