//! Imports between the files of the workspace, and between their folders: none run in a circle, and crates import
//! only those they are built on.
//!
//! Read from the sources: `use` trees, and paths written out. A name that a module hands on with `pub use`
//! counts as that of the file it comes from. What only tests import does not count (`#[cfg(test)] mod x { }`,
//! and files whose names end in `tests.rs`).

use crate::arrows::circles;
use proc_macro2::{Delimiter, Spacing, TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// A crate's folder, the crates of the workspace that it may import, and what else it may not name.
pub type Room = (&'static str, &'static str, &'static str);

/// Nothing that prints, reads or writes files, asks the surroundings, parses arguments or waits for others.
const PURE: &str = "std::fs std::io std::env std::process std::net print println eprint eprintln \
    clap toml axum tokio";
/// The library that programs are made of does not print, end the process, parse arguments or serve a page.
const NO_PROGRAM: &str = "print println eprint eprintln std::io::stdout std::io::stderr \
    std::process::exit clap indicatif comfy_table axum tokio";
/// The same, but for the page.
const SERVER: &str = NO_PROGRAM.split_at(NO_PROGRAM.len() - "axum tokio".len()).0;

pub const ROOMS: [Room; 21] = [
    ("shared", "", PURE),
    ("firmware", "shared", PURE),
    ("host/text", "", PURE),
    ("host/expression", "text", NO_PROGRAM),
    ("host/base", "core expression rig", NO_PROGRAM),
    ("host/core", "expression firmware shared", PURE),
    ("host/rig", "expression shared text", PURE),
    ("host/records", "base core expression shared text", NO_PROGRAM),
    ("host/train", "base core shared", NO_PROGRAM),
    ("host/protocol", "base core shared", NO_PROGRAM),
    ("host/link", "base core firmware protocol records rig shared text", NO_PROGRAM),
    ("host/campaign", "base core records rig shared text", NO_PROGRAM),
    ("host/measuring", "base campaign core link shared", NO_PROGRAM),
    ("host/model", "base campaign core expression records shared text train", NO_PROGRAM),
    ("host/report", "base campaign core model records shared", NO_PROGRAM),
    ("host/session", "base campaign core expression model protocol records report", NO_PROGRAM),
    ("host/verbs", "base campaign core model records report rig shared text", ""),
    ("host/study", "base campaign core firmware report rig shared train", NO_PROGRAM),
    (
        "host/workbench",
        "base campaign core link measuring model records report session shared",
        SERVER,
    ),
    (
        "host",
        "base campaign core link measuring model records report rig shared study text train verbs \
         workbench",
        "",
    ),
    ("host/python", "base core records verbs", NO_PROGRAM),
];

/// How a crate is called in the sources, by the last part of its folder.
fn named(folder: &str) -> String {
    match folder.rsplit('/').next() {
        Some("host" | "yawrig") | None => "yawrig".to_owned(),
        Some(name) => format!("yawrig_{name}"),
    }
}

pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a folder above").to_owned()
}

/// Words, `::`, and every other character by itself; what is no code, and modules for tests, left out.
pub fn tokens(text: &str) -> Vec<String> {
    const FOR_TESTS: [&str; 8] = ["#", "[", "cfg", "(", "test", ")", "]", "mod"];
    fn gather(code: TokenStream, out: &mut Vec<String>) {
        let mut is_half = false;
        for tree in code {
            let mark = match tree {
                TokenTree::Group(group) => {
                    let [open, close] = match group.delimiter() {
                        Delimiter::Brace => ["{", "}"],
                        Delimiter::Parenthesis => ["(", ")"],
                        Delimiter::Bracket => ["[", "]"],
                        Delimiter::None => ["", ""],
                    };
                    let before = out.len().checked_sub(FOR_TESTS.len() + 1);
                    let is_tests = before.is_some_and(|k| out[k..out.len() - 1] == FOR_TESTS);
                    out.push(open.to_owned());
                    if open != "{" || !is_tests {
                        gather(group.stream(), out);
                    }
                    close.to_owned()
                }
                TokenTree::Punct(mark) if is_half => {
                    is_half = false;
                    out.pop();
                    format!(":{mark}")
                }
                TokenTree::Punct(mark) => {
                    is_half = mark.as_char() == ':' && mark.spacing() == Spacing::Joint;
                    mark.to_string()
                }
                TokenTree::Ident(word) => word.to_string(),
                TokenTree::Literal(_) => "0".to_owned(),
            };
            out.push(mark);
        }
    }
    let mut out = Vec::new();
    gather(text.parse().expect("Rust"), &mut out);
    out
}

fn is_word(token: &str) -> bool {
    token.starts_with(|x: char| x.is_alphabetic() || x == '_')
}

/// What one file says of others.
#[derive(Default)]
pub struct File {
    /// Paths it names, whether with `use` or written out; `!` at the end of a macro's.
    paths: Vec<Vec<String>>,
    /// Names handed on by `pub use`, each with its path; `*` for all of a module.
    handed_on: Vec<(String, Vec<String>)>,
}

impl File {
    fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let tokens = tokens(&text);
        let mut file = Self::default();
        let is = |k: usize, what: &str| tokens.get(k).is_some_and(|token| token == what);
        let mut k = 0;
        while k < tokens.len() {
            if tokens[k] == "use" {
                let is_pub = k > 0 && (tokens[k - 1] == "pub" || tokens[k - 1] == ")");
                let length = tokens[k..].iter().position(|token| token == ";").expect("an end");
                file.tree(&tokens[k..=k + length], is_pub);
                k += length;
            } else if is_word(&tokens[k])
                && !(k > 0 && (tokens[k - 1] == "::" || tokens[k - 1] == "."))
            {
                let mut path = vec![tokens[k].clone()];
                k += 1;
                while is(k, "::") && tokens.get(k + 1).is_some_and(|t| is_word(t)) {
                    path.push(tokens[k + 1].clone());
                    k += 2;
                }
                if is(k, "!") && !is(k + 1, "=") {
                    path.push("!".to_owned());
                }
                // A word by itself is as likely a variable.
                if path.len() > 1 {
                    file.paths.push(path);
                }
            } else {
                k += 1;
            }
        }
        file
    }

    /// A whole `use`, its end included.
    fn tree(&mut self, tokens: &[String], is_pub: bool) {
        let (mut before, mut path) = (Vec::new(), Vec::<String>::new());
        for pair in tokens.windows(2) {
            let last = pair[0].as_str();
            match pair[1].as_str() {
                "::" | "as" => {}
                "self" if last == "{" || last == "," => {}
                "{" => before.push(path.clone()),
                end @ ("," | "}" | ";") => {
                    let own = path.last().filter(|_| last == "self");
                    let name = own.cloned().unwrap_or_else(|| last.to_owned());
                    match is_pub {
                        _ if ["{", "}", ","].contains(&last) => {}
                        true => self.handed_on.push((name, path.clone())),
                        false => self.paths.push(path.clone()),
                    }
                    path = before.last().cloned().unwrap_or_default();
                    if end == "}" {
                        before.pop();
                    }
                }
                _ if last == "as" => {}
                word => path.push(word.to_owned()),
            }
        }
    }
}

/// A crate's modules by their path in it.
pub struct Modules {
    name: String,
    pub files: BTreeMap<Vec<String>, (String, File)>,
}

impl Modules {
    pub fn read((folder, ..): &Room) -> Self {
        let mut modules = Self { name: named(folder), files: BTreeMap::new() };
        let folder = root().join(folder).join("src");
        modules.gather(&folder, &folder);
        assert!(!modules.files.is_empty(), "no sources in {}", folder.display());
        modules
    }

    fn gather(&mut self, folder: &Path, root: &Path) {
        for entry in fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                self.gather(&path, root);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let name = path.strip_prefix(root).expect("inside").display().to_string();
                if name.ends_with("tests.rs") {
                    continue;
                }
                let mut module: Vec<String> =
                    name.trim_end_matches(".rs").split('/').map(str::to_owned).collect();
                if ["mod", "lib"].contains(&module.last().expect("a name").as_str()) {
                    module.pop();
                }
                self.files.insert(module, (name, File::read(&path)));
            }
        }
    }

    /// The module of this crate in which `path`, written in the module `from`, is to be looked up, and the
    /// whole path from the crate's root; none for what is of another crate or no module's.
    fn absolute(&self, from: &[String], path: &[String]) -> Option<Vec<String>> {
        let first = path.first()?.as_str();
        let mut base = from.to_vec();
        let mut rest = path;
        match first {
            "crate" => (base, rest) = (Vec::new(), &path[1..]),
            "self" => rest = &path[1..],
            "super" => {
                while rest.first().is_some_and(|word| word == "super") {
                    base.pop();
                    rest = &rest[1..];
                }
            }
            name if name == self.name => (base, rest) = (Vec::new(), &path[1..]),
            child => {
                base.push(child.to_owned());
                if !self.files.contains_key(&base) {
                    return None;
                }
                rest = &path[1..];
            }
        }
        base.extend(rest.iter().cloned());
        Some(base)
    }

    /// The module that what stands at `path` comes from.
    fn home(&self, path: &[String]) -> Vec<String> {
        let mut path = path.to_vec();
        for _ in 0..8 {
            let held =
                (0..=path.len()).rev().find(|n| self.files.contains_key(&path[..*n])).unwrap_or(0);
            let (module, rest) = path.split_at(held);
            let (Some((_, file)), Some(name)) = (self.files.get(module), rest.first()) else {
                return module.to_vec();
            };
            let Some((_, from)) = file.handed_on.iter().find(|(known, _)| known == name) else {
                return module.to_vec();
            };
            let Some(mut next) = self.absolute(module, from) else { return module.to_vec() };
            next.extend(rest[1..].iter().cloned());
            path = next;
        }
        path
    }

    /// Every file with those it imports.
    fn arrows(&self) -> BTreeMap<&str, BTreeSet<&str>> {
        let mut arrows: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
        for (module, (name, file)) in &self.files {
            let imported = arrows.entry(name).or_default();
            for path in &file.paths {
                let Some(path) = self.absolute(module, path) else { continue };
                if let Some((other, _)) = self.files.get(&self.home(&path))
                    && other != name
                {
                    imported.insert(other);
                }
            }
        }
        arrows
    }
}

#[test]
fn no_circle_between_files() {
    let mut wrong = Vec::new();
    for room in &ROOMS {
        let modules = Modules::read(room);
        for (files, way) in circles(&modules.arrows()) {
            wrong.push(format!("{}: {way}; in all {files:?}", room.0));
        }
    }
    assert!(wrong.is_empty(), "imports in a circle:\n{}", wrong.join("\n"));
}

/// Those of a crate's folders, and of its files that are in none, by those of what they hold.
fn of_folders<'a>(
    arrows: &BTreeMap<&'a str, BTreeSet<&'a str>>,
) -> BTreeMap<&'a str, BTreeSet<&'a str>> {
    let folder = |name: &'a str| name.split(['/', '.']).next().expect("a name");
    let mut folders: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for (name, imported) in arrows {
        let from = folder(name);
        let others = imported.iter().map(|other| folder(other));
        // A crate's root hands on what is in all of them.
        let others = others.filter(|other| ![from, "lib"].contains(other) && from != "lib");
        folders.entry(from).or_default().extend(others);
    }
    folders
}

#[test]
fn no_circle_between_folders() {
    let mut wrong = Vec::new();
    for room in &ROOMS {
        let modules = Modules::read(room);
        for (folders, way) in circles(&of_folders(&modules.arrows())) {
            wrong.push(format!("{}: {way}; in all {folders:?}", room.0));
        }
    }
    assert!(wrong.is_empty(), "folders that import each other:\n{}", wrong.join("\n"));
}

#[test]
fn crates_import_only_what_they_are_built_on() {
    let mut wrong = Vec::new();
    for room @ (folder, imports, never) in &ROOMS {
        let may: Vec<String> = imports.split(' ').chain([*folder]).map(named).collect();
        for (name, file) in Modules::read(room).files.values() {
            for path in file.paths.iter().chain(file.handed_on.iter().map(|(_, path)| path)) {
                let (first, whole) = (&path[0], path.join("::") + "::");
                let is_ours = first == "yawrig" || first.starts_with("yawrig_");
                let is_never = |never: &&str| whole.starts_with(&format!("{never}::"));
                if path.len() > 1 && is_ours && !may.contains(first) {
                    wrong.push(format!("{folder}: {name} imports {first}"));
                } else if let Some(never) = never.split_whitespace().find(is_never) {
                    wrong.push(format!("{folder}: {name} names {never}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "imports across walls:\n{}", wrong.join("\n"));
}

#[test]
fn every_way_to_import_is_read() {
    let text = r##"
        //! use crate::comment;
        use crate::a::{self, b::{C, D as E}};
        pub use super::f::G;
        const TEXT: &str = "use crate::text; \" crate::text";
        const RAW: &str = r#"use crate::raw;"#;
        const QUOTE: char = '"';
        fn g() { println!("use crate::printed"); if a != b {} }
        fn h() -> super::i::J { crate::k::l::<u8>('\'', 'x') }
        #[cfg(test)]
        mod tests { use crate::tested; fn m() { { } } }
        use yawrig_core::n;
    "##;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.rs");
    fs::write(&path, text).expect("room for it");
    let file = File::read(&path);
    let joined: Vec<String> = file.paths.iter().map(|p| p.join("::")).collect();
    let expected = [
        "crate::a",
        "crate::a::b::C",
        "crate::a::b::D",
        "println::!",
        "super::i::J",
        "crate::k::l",
        "yawrig_core::n",
    ];
    assert_eq!(joined, expected);
    assert_eq!(file.handed_on, [("G".to_owned(), ["super", "f", "G"].map(str::to_owned).to_vec())]);
}
