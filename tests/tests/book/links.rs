//! Links and names of files in README, CONTRIBUTING, CHANGELOG and the book: each leads to a file and a
//! heading there is.

use crate::pages::{listed, root};
use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

/// All that is wrong with the links of the project in `root`.
fn faults(root: &Path) -> Vec<String> {
    let book = root.join("docs/src");
    let mut pages = Vec::new();
    gather(&book, &mut pages);
    let mut faults = Vec::new();
    let there: BTreeSet<PathBuf> = pages
        .iter()
        .map(|p| p.strip_prefix(&book).expect("of the book").to_owned())
        .filter(|p| *p != Path::new("SUMMARY.md"))
        .collect();
    let listed = listed(root);
    if there != listed.iter().cloned().collect() || there.len() != listed.len() {
        faults.push(format!("SUMMARY.md lists {listed:?}, there are {there:?}"));
    }
    for name in ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"] {
        pages.push(root.join(name));
    }
    for page in &pages {
        let text = prose(&std::fs::read_to_string(page).expect("a page"));
        for link in links(&text) {
            if let Some(fault) = fault(&book, page, link) {
                let page = page.strip_prefix(root).expect("of the project");
                faults.push(format!("{}: {link}: {fault}", page.display()));
            }
        }
        if page.ends_with("CHANGELOG.md") {
            continue; // What it names may be gone.
        }
        for name in names_of_files(root, &text) {
            if !root.join(name).exists() {
                faults.push(format!("{}: there is no {name}", page.display()));
            }
        }
    }
    faults
}

fn gather(folder: &Path, pages: &mut Vec<PathBuf>) {
    for entry in folder.read_dir().expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            gather(&path, pages);
        } else if path.extension().is_some_and(|e| e == "md") {
            pages.push(path);
        }
    }
}

/// A page without its blocks of code.
fn prose(text: &str) -> String {
    let parts = text.split("\n```").enumerate().filter(|(k, _)| k % 2 == 0);
    parts.map(|(_, part)| part).collect::<Vec<_>>().join("\n")
}

fn links(text: &str) -> impl Iterator<Item = &str> {
    let targets = text.split("](").skip(1).filter_map(|rest| Some(rest.split_once(')')?.0));
    targets.filter(|target| !target.starts_with("http"))
}

/// Whole names of files and folders of the project between backticks; `NAME` stands for any.
fn names_of_files<'a>(root: &'a Path, text: &'a str) -> impl Iterator<Item = &'a str> {
    let spans = text.split('`').skip(1).step_by(2);
    spans.filter(|span| {
        let first = span.split_once('/').map_or("", |(first, _)| first);
        let of_project = !first.is_empty() && root.join(first).is_dir();
        let any =
            span.contains(char::is_whitespace) || span.contains("NAME") || span.contains("IMAGE");
        // What is built is not there in a fresh clone.
        of_project && !any && !span.starts_with("target/")
    })
}

fn fault(book: &Path, page: &Path, link: &str) -> Option<&'static str> {
    let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
    let target = match file {
        "" => page.to_owned(),
        file => normal(&page.parent().expect("its folder").join(file)),
    };
    if page.starts_with(book) && !target.starts_with(book) {
        return Some("leads out of the book");
    }
    let Ok(bytes) = std::fs::read(&target) else { return Some("no such file") };
    let has = |text: String| text.lines().filter_map(heading).any(|heading| heading == anchor);
    let found = anchor.is_empty() || has(String::from_utf8_lossy(&bytes).into_owned());
    (!found).then_some("no such heading")
}

/// Without `..`, whose folder may not be a file's.
fn normal(path: &Path) -> PathBuf {
    path.components().fold(PathBuf::new(), |mut whole, part| {
        match part {
            Component::ParentDir => drop(whole.pop()),
            part => whole.push(part),
        }
        whole
    })
}

/// The anchor of a line that is a heading, as GitHub and mdBook make it.
fn heading(line: &str) -> Option<String> {
    let title = line.trim_start_matches('#').strip_prefix(' ').filter(|_| line.starts_with('#'))?;
    let kept = title.trim().chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    Some(kept.collect::<String>().to_lowercase().replace(' ', "-"))
}

#[test]
fn every_link_leads_somewhere_and_the_summary_lists_every_page() {
    let faults = faults(&root());
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn what_leads_nowhere_is_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path();
    std::fs::create_dir_all(root.join("docs/src/a")).expect("folders");
    let write = |name: &str, text: &str| std::fs::write(root.join(name), text).expect("a file");
    write("docs/src/SUMMARY.md", "- [A](a/a.md)\n- [B](b.md)\n");
    write("docs/src/b.md", "# What it's: (b)\n");
    write("docs/src/a/a.md", "# A\n[b](../b.md#what-its-b) [self](#a)\n```text\n[no](link)\n```\n");
    write(
        "README.md",
        "[a](docs/src/a/a.md#a) [web](https://example.org) `docs/src/b.md` `docs/NAME.md`",
    );
    write("CONTRIBUTING.md", "");
    write("CHANGELOG.md", "`docs/gone.md`");
    assert_eq!(faults(root), Vec::<String>::new());
    write("docs/src/c.md", "# C\n");
    write("docs/src/b.md", "[out](../../README.md) [a](a/a.md#other) [self](#nowhere)\n");
    write("README.md", "[x](docs/x.md) `docs/y.md`");
    let all = faults(root).join("\n");
    assert_eq!(faults(root).len(), 7, "{all}");
    for part in
        ["SUMMARY.md lists", "out of the book", "#other", "#nowhere", "no such file", "docs/y.md"]
    {
        assert!(all.contains(part), "{part}: {all}");
    }
}
