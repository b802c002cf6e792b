//! `demo --hidden`: an effect hidden in releases, found by typing the commands that it prints, and revealed.

use serde_json::Value;
use std::path::Path;
use yawrig_tests::process::{yawrig, Ended};

fn run(folder: &Path, command: &str) -> Ended {
    yawrig(command).in_folder(folder).run()
}

fn rms(errors: &Value, of: &str) -> f64 {
    errors[of].as_f64().unwrap_or_else(|| panic!("{of} of {errors}"))
}

/// What must hold of a riddle solved.
fn solved(revealed: &Value) {
    assert_eq!(revealed["model"]["named_right"], true, "{revealed}");
    for parameter in revealed["hidden"]["parameters"].as_array().expect("parameters") {
        let (value, u) = (&parameter["found"]["value"], &parameter["found"]["u"]);
        println!("{}: {value} +- {u}, truth {}", parameter["name"], parameter["truth"]);
    }
    for (who, least) in [("host", 5.0), ("device", 2.0)] {
        let errors = &revealed[who];
        let ratio =
            |of: &str| rms(errors, &format!("{of}_before")) / rms(errors, &format!("{of}_after"));
        let (frequency, damping) = (ratio("natural_frequency"), ratio("damping_ratio"));
        println!("{who}: wn {frequency:.1} times less, zeta {damping:.1} times less");
        assert!(frequency.max(damping) > least, "{who}: {errors}");
    }
}

#[test]
fn every_step_at_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let revealed = run(folder.path(), "demo --hidden 5 --json").exits(0).json();
    solved(&revealed);
    assert_eq!(revealed["folder"], "yawrig-hidden");
    for name in ["campaign.toml", "model.toml", "network.yrn", "report.html", "sealed-truth.txt"] {
        assert!(folder.path().join("yawrig-hidden").join(name).is_file(), "{name}");
    }
    // The same again from what lies there.
    let again = run(folder.path(), "demo --reveal yawrig-hidden --json").exits(0).json();
    for of in ["hidden", "model", "host", "device", "releases"] {
        assert_eq!(again[of], revealed[of], "{of}");
    }
}

/// Types every command that `demo --hidden` prints, in their order.
#[test]
fn step_by_step_as_it_is_printed() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let begun = run(folder, "demo --hidden 1 --out riddle").exits(0);
    let sealed = std::fs::read_to_string(folder.join("riddle/sealed-truth.txt")).expect("a seal");
    assert!(sealed.contains("sealed") && !sealed.contains("effect:"), "{sealed}");
    let commands: Vec<&str> =
        begun.stdout.lines().filter_map(|line| line.strip_prefix("  yawrig ")).collect();
    let verbs: Vec<&str> = commands.iter().filter_map(|c| c.split(' ').next()).collect();
    assert_eq!(verbs, ["compare", "diagnose", "fit", "add", "train", "replay", "replay", "demo"]);
    let mut effect = String::new();
    let [steps @ .., reveal] = commands.as_slice() else { panic!("no commands") };
    for command in steps {
        let ended = run(folder, &command.replace("EFFECT", &effect)).exits(0);
        if command.starts_with("diagnose") {
            let found = ended.stdout.split("explained by ").nth(1).expect("an effect");
            effect = found.split_whitespace().next().expect("a word").to_owned();
        }
    }
    solved(&run(folder, &format!("{reveal} --json")).exits(0).json());
    let said = run(folder, reveal).exits(0).stdout;
    assert!(said.contains("named right") && said.contains("times less"), "{said}");
}

#[test]
fn a_riddle_not_solved_and_one_that_is_not_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    run(folder, "demo --hidden 3 --out riddle").exits(0);
    run(folder, "demo --hidden 3 --out riddle").exits(2).says("is there already").helps();
    let said = run(folder, "demo --reveal riddle").exits(0).stdout;
    assert!(said.contains("hidden: ") && said.contains("there is no model.toml"), "{said}");
    run(folder, "demo --reveal .").exits(3).says("sealed-truth.txt").helps();
    std::fs::write(folder.join("riddle/sealed-truth.txt"), "sealed: x\n00").expect("room for it");
    run(folder, "demo --reveal riddle").exits(3).says("the seal is broken").helps();
    run(folder, "demo --hidden 3 --wind 5").exits(2);
}
