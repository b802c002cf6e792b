//! Circles among things that point to each other.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// All that can be come to from `from`, each with the file before it.
fn reached<'a>(
    arrows: &BTreeMap<&'a str, BTreeSet<&'a str>>,
    from: &'a str,
) -> BTreeMap<&'a str, &'a str> {
    let mut before = BTreeMap::new();
    let mut waiting = VecDeque::from([from]);
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

/// Those that point to each other, all ways round; with the shortest circle through the first of them.
pub fn circles<'a>(
    arrows: &BTreeMap<&'a str, BTreeSet<&'a str>>,
) -> Vec<(BTreeSet<&'a str>, String)> {
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
