//! What the book draws and lists from the project is as the project is now.

use crate::pages::root;
use std::process::Command;
use yawrig_shared::flags::Flags;

/// What a script of the book's folder prints.
fn printed_by(script: &str) -> String {
    let mut command = Command::new(root().join("docs").join(script));
    let output = command.env("YAWRIG", yawrig_tests::process::binary()).output().expect("a script");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{script}: {said}");
    String::from_utf8(output.stdout).expect("text")
}

fn page(name: &str) -> String {
    std::fs::read_to_string(root().join("docs/src").join(name)).expect("a page")
}

#[test]
fn verbs_and_flags_are_those_of_the_program() {
    let now = printed_by("verbs");
    assert!(now.lines().count() > 300, "{now}");
    assert!(now == page("reference/verbs.md"), "run: docs/verbs > docs/src/reference/verbs.md");
}

#[test]
fn crates_and_arrows_are_those_of_the_manifests() {
    let now = printed_by("architecture");
    assert!(now.contains("host/core"), "{now}");
    let page = page("developers/architecture.svg");
    assert!(now == page, "run: docs/architecture > docs/src/developers/architecture.svg");
}

/// Each with whether the network's result counts and whether it concerns the refined estimate.
#[test]
fn flags_of_the_device_are_all_listed() {
    let page = page("device/device.md");
    let yes = |is: bool| if is { "yes" } else { "no" };
    for (flag, name) in Flags::NAMES {
        let row = page.lines().find(|line| line.starts_with(&format!("| `{name}` |")));
        let row = row.unwrap_or_else(|| panic!("{name} is not listed"));
        let concerns = flag.of_record() == flag;
        let end = format!("| {} | {} |", yes(!flag.unusable()), yes(concerns));
        assert!(row.ends_with(&end), "{row}: {end}");
    }
}

/// Names as the JSON has them, from the variants as they are written.
#[test]
fn what_is_said_besides_an_answer_is_all_listed() {
    let source = std::fs::read_to_string(root().join("host/core/src/identify/flag.rs"));
    let source = source.expect("the flags");
    let (_, variants) = source.split_once("pub enum Flag {").expect("the enum");
    let variants = variants.lines().take_while(|line| *line != "}").map(str::trim);
    let names = variants.filter_map(|line| line.strip_suffix(',')).map(|variant| {
        let snake = |c: char| match c.is_uppercase() {
            true => format!("_{}", c.to_lowercase()),
            false => c.to_string(),
        };
        variant.chars().map(snake).collect::<String>()
    });
    let page = page("how-to/identify.md");
    let mut count = 0;
    for name in names {
        let name = name.trim_start_matches('_');
        assert!(page.contains(&format!("`{name}`")), "{name} is not listed");
        count += 1;
    }
    assert!(count > 15, "{count}");
}
