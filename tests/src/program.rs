//! The built program, and that it is of the sources as they are now.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::SystemTime;

const BUILD: &str = "cargo build --release -p yawrig";

/// The program that was built with these tests: `target/<profile>/yawrig`.
///
/// # Panics
/// Where it is not there, or older than sources these tests were built from.
pub fn binary() -> &'static Path {
    static BINARY: OnceLock<PathBuf> = OnceLock::new();
    BINARY.get_or_init(|| {
        let tests = std::env::current_exe().expect("this program's own path");
        let profile = tests.ancestors().nth(2).expect("target/<profile>/deps/<test>");
        let binary = profile.join("yawrig");
        assert!(binary.is_file(), "{} is not there: run {BUILD}", binary.display());
        if let Some(newer) = newer_source(&sources(profile), age(&binary), age(&tests)) {
            panic!("{} is older than {}: run {BUILD}", binary.display(), newer.display());
        }
        binary
    })
}

fn age(path: &Path) -> Option<SystemTime> {
    path.metadata().and_then(|about| about.modified()).ok()
}

/// Every file of the workspace that the program is made of, pages and tables included: the compiler lists
/// them for each crate in the form of a makefile, `RESULT: FILE FILE`, from the workspace's folder on, a
/// blank within a name as `\ `. Cargo's own list of them all, `yawrig.d`, is there only where the program was
/// built by itself, not for its tests.
fn sources(profile: &Path) -> Vec<PathBuf> {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
    let lists = profile.join("deps").read_dir().expect("what was built").flatten();
    let lists = lists.map(|entry| entry.path()).filter(|path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        // What comes after the program makes it no older.
        name.starts_with("yawrig") && !name.starts_with("yawrig_tests") && name.ends_with(".d")
    });
    let rules: Vec<String> = lists
        .filter_map(|list| std::fs::read_to_string(list).ok())
        .flat_map(|text| text.lines().map(str::to_owned).collect::<Vec<_>>())
        .collect();
    let mut sources = Vec::new();
    for (result, files) in rules.iter().filter_map(|rule| rule.split_once(": ")) {
        // Not what the unit tests of a crate are made of besides, nor what the lints look at.
        if result.ends_with(".rlib") || files.ends_with("src/main.rs") {
            let files = files.trim_end().replace("\\ ", "\0");
            sources.extend(files.split(' ').map(|file| workspace.join(file.replace('\0', " "))));
        }
    }
    sources
}

/// A source younger than the program though these tests know it: `cargo test -p` of this package
/// alone builds the library and not the program.
fn newer_source(
    sources: &[PathBuf],
    built: Option<SystemTime>,
    tested: Option<SystemTime>,
) -> Option<&Path> {
    let newer = |path: &&PathBuf| age(path).is_some_and(|at| Some(at) > built && Some(at) < tested);
    sources.iter().find(newer).map(PathBuf::as_path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// Every crate of the workspace is part of the program but the tests and the module for Python.
    #[test]
    fn a_change_in_any_crate_is_newer_than_the_program() {
        let sources = sources(binary().parent().expect("target/<profile>"));
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
        let manifest = std::fs::read_to_string(root.join("Cargo.toml")).expect("the workspace");
        let manifest: toml::Table = toml::from_str(&manifest).expect("TOML");
        let members = manifest["workspace"]["members"].as_array().expect("crates");
        let crates = members.iter().filter_map(|name| name.as_str());
        let crates = crates.filter(|name| !["tests", "host/python"].contains(name));
        let libraries = crates.map(|name| format!("{name}/src/lib.rs"));
        for file in libraries.chain(["host/src/main.rs".to_owned()]) {
            assert!(root.join(&file).is_file(), "{file}");
            let of = |source: &&PathBuf| **source == root.join(&file);
            let source = sources.iter().find(of).unwrap_or_else(|| panic!("{file} is looked over"));
            let at = age(source).expect("its time");
            let (before, after) = (at - Duration::from_secs(1), at + Duration::from_secs(1));
            let one = std::slice::from_ref(source);
            assert_eq!(newer_source(one, Some(before), Some(after)), Some(source.as_path()));
            // Built with it; and changed since, which these tests do not know either.
            assert_eq!(newer_source(one, Some(at), Some(after)), None);
            assert_eq!(newer_source(one, Some(before), Some(at)), None);
        }
        assert!(sources.iter().any(|s| s.ends_with("assets/report.js")), "{sources:?}");
        let later = [root.join("tests"), root.join("host/python")];
        assert!(!sources.iter().any(|s| later.iter().any(|folder| s.starts_with(folder))));
    }
}
