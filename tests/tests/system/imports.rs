//! Imports between the files of the workspace: none run in a circle, and crates import only those they are
//! built on.
//!
//! Read from the sources: `use` trees, and paths written out. A name that a module hands on with `pub use`
//! counts as that of the file it comes from. What only tests import does not count (`#[cfg(test)] mod x { }`,
//! and files whose names end in `tests.rs`).

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// A crate, its sources, the crates of the workspace that it may import, and what else it may not name.
struct Room {
    name: &'static str,
    sources: &'static str,
    imports: &'static [&'static str],
    never: &'static [&'static str],
}

/// Nothing that prints, reads or writes files, asks the surroundings, parses arguments or waits for others.
const PURE: &[&str] = &[
    "std::fs",
    "std::io",
    "std::env",
    "std::process",
    "std::net",
    "print",
    "println",
    "eprint",
    "eprintln",
    "clap",
    "toml",
    "axum",
    "tokio",
];
/// The library that programs are made of does not print, end the process, parse arguments or serve a page.
const NO_PROGRAM: &[&str] = &[
    "print",
    "println",
    "eprint",
    "eprintln",
    "std::io::stdout",
    "std::io::stderr",
    "std::process::exit",
    "clap",
    "indicatif",
    "comfy_table",
    "axum",
    "tokio",
];
/// The same, but for the page.
const SERVER: &[&str] = NO_PROGRAM.split_at(NO_PROGRAM.len() - 2).0;

const ROOMS: [Room; 18] = [
    Room { name: "yawrig_shared", sources: "shared/src", imports: &[], never: PURE },
    Room {
        name: "yawrig_firmware",
        sources: "firmware/src",
        imports: &["yawrig_shared"],
        never: PURE,
    },
    Room { name: "yawrig_text", sources: "host/text/src", imports: &[], never: PURE },
    Room {
        name: "yawrig_expression",
        sources: "host/expression/src",
        imports: &["yawrig_text"],
        never: NO_PROGRAM,
    },
    Room {
        name: "yawrig_base",
        sources: "host/base/src",
        imports: &["yawrig_core", "yawrig_expression", "yawrig_rig"],
        never: NO_PROGRAM,
    },
    Room {
        name: "yawrig_core",
        sources: "host/core/src",
        imports: &["yawrig_expression", "yawrig_firmware", "yawrig_shared"],
        never: PURE,
    },
    Room {
        name: "yawrig_rig",
        sources: "host/rig/src",
        imports: &["yawrig_expression", "yawrig_shared", "yawrig_text"],
        never: PURE,
    },
    Room {
        name: "yawrig_records",
        sources: "host/records/src",
        imports: &[
            "yawrig_base",
            "yawrig_core",
            "yawrig_expression",
            "yawrig_shared",
            "yawrig_text",
        ],
        never: NO_PROGRAM,
    },
    Room {
        name: "yawrig_train",
        sources: "host/train/src",
        imports: &["yawrig_base", "yawrig_core", "yawrig_shared"],
        never: NO_PROGRAM,
    },
    Room {
        name: "yawrig_link",
        sources: "host/link/src",
        imports: &[
            "yawrig_base",
            "yawrig_core",
            "yawrig_firmware",
            "yawrig_records",
            "yawrig_rig",
            "yawrig_shared",
            "yawrig_text",
        ],
        never: NO_PROGRAM,
    },
    Room {
        name: "yawrig_campaign",
        sources: "host/campaign/src",
        imports: &[
            "yawrig_base",
            "yawrig_core",
            "yawrig_records",
            "yawrig_rig",
            "yawrig_shared",
            "yawrig_text",
        ],
        never: NO_PROGRAM,
    },
    Room {
        name: "yawrig_measuring",
        sources: "host/measuring/src",
        imports: &["yawrig_base", "yawrig_campaign", "yawrig_core", "yawrig_link", "yawrig_shared"],
        never: NO_PROGRAM,
    },
    Room {
        name: "yawrig_model",
        sources: "host/model/src",
        imports: &[
            "yawrig_base",
            "yawrig_campaign",
            "yawrig_core",
            "yawrig_expression",
            "yawrig_records",
            "yawrig_shared",
            "yawrig_text",
            "yawrig_train",
        ],
        never: NO_PROGRAM,
    },
    Room {
        name: "yawrig_report",
        sources: "host/report/src",
        imports: &[
            "yawrig_base",
            "yawrig_campaign",
            "yawrig_core",
            "yawrig_model",
            "yawrig_records",
            "yawrig_shared",
        ],
        never: NO_PROGRAM,
    },
    Room {
        name: "yawrig_study",
        sources: "host/study/src",
        imports: &[
            "yawrig_base",
            "yawrig_campaign",
            "yawrig_core",
            "yawrig_firmware",
            "yawrig_report",
            "yawrig_rig",
            "yawrig_shared",
            "yawrig_train",
        ],
        never: NO_PROGRAM,
    },
    Room {
        name: "yawrig_workbench",
        sources: "host/workbench/src",
        imports: &[
            "yawrig_base",
            "yawrig_campaign",
            "yawrig_core",
            "yawrig_expression",
            "yawrig_link",
            "yawrig_measuring",
            "yawrig_model",
            "yawrig_records",
            "yawrig_report",
            "yawrig_shared",
        ],
        never: SERVER,
    },
    Room {
        name: "yawrig",
        sources: "host/src",
        imports: &[
            "yawrig_base",
            "yawrig_campaign",
            "yawrig_core",
            "yawrig_firmware",
            "yawrig_link",
            "yawrig_measuring",
            "yawrig_model",
            "yawrig_records",
            "yawrig_report",
            "yawrig_rig",
            "yawrig_shared",
            "yawrig_study",
            "yawrig_text",
            "yawrig_train",
            "yawrig_workbench",
        ],
        never: &[],
    },
    Room {
        name: "yawrig_python",
        sources: "host/python/src",
        imports: &["yawrig", "yawrig_base", "yawrig_core", "yawrig_records"],
        never: NO_PROGRAM,
    },
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a folder above").to_owned()
}

/// `text` without comments, and with nothing in its strings and character literals.
fn code(text: &str) -> String {
    let c: Vec<char> = text.chars().collect();
    let starts =
        |k: usize, what: &str| what.chars().enumerate().all(|(i, w)| c.get(k + i) == Some(&w));
    let mut out = String::new();
    let mut k = 0;
    while k < c.len() {
        let hashes = c[k + 1..].iter().take_while(|x| **x == '#').count();
        let is_word = |at: Option<&char>| at.is_some_and(|x| x.is_alphanumeric() || *x == '_');
        if starts(k, "//") {
            while k < c.len() && c[k] != '\n' {
                k += 1;
            }
        } else if starts(k, "/*") {
            let mut depth = 0;
            loop {
                if starts(k, "/*") {
                    (depth, k) = (depth + 1, k + 2);
                } else if starts(k, "*/") {
                    (depth, k) = (depth - 1, k + 2);
                } else {
                    k += 1;
                }
                if depth == 0 || k >= c.len() {
                    break;
                }
            }
        } else if c[k] == 'r'
            && c.get(k + 1 + hashes) == Some(&'"')
            && !(k > 0 && is_word(c.get(k - 1)))
        {
            let end = format!("\"{}", "#".repeat(hashes));
            k += hashes + 2;
            while k < c.len() && !starts(k, &end) {
                k += 1;
            }
            k += end.len();
        } else if c[k] == '"' {
            k += 1;
            while k < c.len() && c[k] != '"' {
                k += if c[k] == '\\' { 2 } else { 1 };
            }
            k += 1;
        } else if c[k] == '\'' && c.get(k + 1) == Some(&'\\') {
            k += 3;
            while k < c.len() && c[k] != '\'' {
                k += 1;
            }
            k += 1;
        } else if c[k] == '\'' && c.get(k + 2) == Some(&'\'') {
            k += 3;
        } else {
            out.push(c[k]);
            k += 1;
        }
    }
    out
}

/// Words, `::`, and every other character by itself.
fn tokens(code: &str) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    let mut rest = code.chars().peekable();
    while let Some(first) = rest.next() {
        if first.is_alphanumeric() || first == '_' {
            let mut word = first.to_string();
            while let Some(next) = rest.next_if(|x| x.is_alphanumeric() || *x == '_') {
                word.push(next);
            }
            out.push(word);
        } else if first == ':' && rest.next_if_eq(&':').is_some() {
            out.push("::".to_owned());
        } else if !first.is_whitespace() {
            out.push(first.to_string());
        }
    }
    out
}

fn is_word(token: &str) -> bool {
    token.starts_with(|x: char| x.is_alphabetic() || x == '_')
}

/// The index after the bracket that closes the one at `open`.
fn closed(tokens: &[String], open: usize) -> usize {
    let mut depth = 0;
    for (k, token) in tokens.iter().enumerate().skip(open) {
        depth += match token.as_str() {
            "{" => 1,
            "}" => -1,
            _ => 0,
        };
        if depth == 0 {
            return k + 1;
        }
    }
    tokens.len()
}

/// What one file says of others.
#[derive(Default)]
struct File {
    /// Paths it names, whether with `use` or written out; `!` at the end of a macro's.
    paths: Vec<Vec<String>>,
    /// Names handed on by `pub use`, each with its path; `*` for all of a module.
    handed_on: Vec<(String, Vec<String>)>,
}

impl File {
    fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let tokens = tokens(&code(&text));
        let mut file = Self::default();
        let is = |k: usize, what: &[&str]| {
            what.iter().enumerate().all(|(i, w)| tokens.get(k + i).is_some_and(|t| t == w))
        };
        let mut k = 0;
        while k < tokens.len() {
            if is(k, &["#", "[", "cfg", "(", "test", ")", "]", "mod"]) {
                let name = k + 8;
                k = if is(name + 1, &["{"]) { closed(&tokens, name + 1) } else { name + 1 };
            } else if tokens[k] == "use" {
                let is_pub = k > 0 && (tokens[k - 1] == "pub" || tokens[k - 1] == ")");
                k = file.tree(&tokens, k + 1, &[], is_pub);
            } else if is_word(&tokens[k])
                && !(k > 0 && (tokens[k - 1] == "::" || tokens[k - 1] == "."))
            {
                let mut path = vec![tokens[k].clone()];
                k += 1;
                while tokens.get(k).is_some_and(|t| t == "::")
                    && tokens.get(k + 1).is_some_and(|t| is_word(t))
                {
                    path.push(tokens[k + 1].clone());
                    k += 2;
                }
                if is(k, &["!"]) && !is(k + 1, &["="]) {
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

    /// One branch of a `use`, from token `k` on; the index after it.
    fn tree(&mut self, tokens: &[String], mut k: usize, before: &[String], is_pub: bool) -> usize {
        let mut path = before.to_vec();
        loop {
            match tokens.get(k).map(String::as_str) {
                Some("{") => {
                    k += 1;
                    while tokens.get(k).is_some_and(|t| t != "}") {
                        k = self.tree(tokens, k, &path, is_pub);
                        if tokens.get(k).is_some_and(|t| t == ",") {
                            k += 1;
                        }
                    }
                    return k + 1;
                }
                Some("::") => k += 1,
                Some("self") if path.len() > before.len() || !before.is_empty() => k += 1,
                Some("*") => {
                    path.push("*".to_owned());
                    k += 1;
                }
                Some("as") => {
                    self.leaf(&path, &tokens[k + 1], is_pub);
                    return k + 2;
                }
                Some(word) if is_word(word) => {
                    path.push(word.to_owned());
                    k += 1;
                }
                _ => {
                    let name = path.last().cloned().unwrap_or_default();
                    self.leaf(&path, &name, is_pub);
                    return k;
                }
            }
        }
    }

    fn leaf(&mut self, path: &[String], name: &str, is_pub: bool) {
        match is_pub {
            true => self.handed_on.push((name.to_owned(), path.to_vec())),
            false => self.paths.push(path.to_vec()),
        }
    }
}

/// A crate's modules by their path in it.
struct Modules {
    room: &'static Room,
    files: BTreeMap<Vec<String>, (String, File)>,
}

impl Modules {
    fn read(room: &'static Room) -> Self {
        let folder = root().join(room.sources);
        let mut modules = Self { room, files: BTreeMap::new() };
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
            name if name == self.room.name => (base, rest) = (Vec::new(), &path[1..]),
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

/// All that can be come to from `from`, each with the file before it.
fn reached<'a>(
    arrows: &BTreeMap<&'a str, BTreeSet<&'a str>>,
    from: &'a str,
) -> BTreeMap<&'a str, &'a str> {
    let mut before = BTreeMap::new();
    let mut waiting = std::collections::VecDeque::from([from]);
    while let Some(file) = waiting.pop_front() {
        for next in &arrows[file] {
            if !before.contains_key(next) {
                before.insert(*next, file);
                waiting.push_back(next);
            }
        }
    }
    before
}

/// Files that import each other, all ways round; with the shortest circle through the first of them.
fn circles<'a>(arrows: &BTreeMap<&'a str, BTreeSet<&'a str>>) -> Vec<(BTreeSet<&'a str>, String)> {
    let all: BTreeMap<&str, BTreeMap<&str, &str>> =
        arrows.keys().map(|file| (*file, reached(arrows, file))).collect();
    let mut out: Vec<(BTreeSet<&str>, String)> = Vec::new();
    for (&file, from_it) in &all {
        if !from_it.contains_key(file) || out.iter().any(|(files, _)| files.contains(file)) {
            continue;
        }
        let files = from_it.keys().copied().filter(|other| all[other].contains_key(file)).collect();
        let mut way = vec![file];
        loop {
            let before = from_it[way[way.len() - 1]];
            way.push(before);
            if before == file {
                break;
            }
        }
        way.reverse();
        out.push((files, way.join(" -> ")));
    }
    out
}

#[test]
fn no_circle_between_files() {
    let mut wrong = Vec::new();
    for room in &ROOMS {
        let modules = Modules::read(room);
        for (files, way) in circles(&modules.arrows()) {
            wrong.push(format!("{}: {way}; in all {files:?}", room.sources));
        }
    }
    assert!(wrong.is_empty(), "imports in a circle:\n{}", wrong.join("\n"));
}

#[test]
fn crates_import_only_what_they_are_built_on() {
    let mut wrong = Vec::new();
    for room in &ROOMS {
        for (name, file) in Modules::read(room).files.values() {
            for path in file.paths.iter().chain(file.handed_on.iter().map(|(_, path)| path)) {
                let first = path[0].as_str();
                let is_ours = first == "yawrig" || first.starts_with("yawrig_");
                let whole = path.join("::");
                let is_never =
                    |never: &&&str| whole == **never || whole.starts_with(&format!("{never}::"));
                if path.len() > 1 && is_ours && first != room.name && !room.imports.contains(&first)
                {
                    wrong.push(format!("{}/{name}: imports {first}", room.sources));
                } else if let Some(never) = room.never.iter().find(is_never) {
                    wrong.push(format!("{}/{name}: names {never}", room.sources));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "imports across walls:\n{}", wrong.join("\n"));
}

/// Crates that name no flags: what they say of settings, the program spells (`yawrig_base::settings`).
const FLAGLESS: [&str; 13] = [
    "yawrig_shared",
    "yawrig_firmware",
    "yawrig_text",
    "yawrig_expression",
    "yawrig_base",
    "yawrig_core",
    "yawrig_rig",
    "yawrig_records",
    "yawrig_train",
    "yawrig_link",
    "yawrig_campaign",
    "yawrig_measuring",
    "yawrig_model",
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
    for room in ROOMS.iter().filter(|room| FLAGLESS.contains(&room.name)) {
        for (name, _) in Modules::read(room).files.values() {
            let path = root().join(room.sources).join(name);
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

#[test]
fn a_circle_is_found_and_named() {
    let arrows = BTreeMap::from([
        ("a.rs", BTreeSet::from(["b.rs", "d.rs"])),
        ("b.rs", BTreeSet::from(["c.rs"])),
        ("c.rs", BTreeSet::from(["a.rs"])),
        ("d.rs", BTreeSet::new()),
    ]);
    let found = circles(&arrows);
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].0, BTreeSet::from(["a.rs", "b.rs", "c.rs"]));
    assert_eq!(found[0].1, "a.rs -> b.rs -> c.rs -> a.rs");
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
