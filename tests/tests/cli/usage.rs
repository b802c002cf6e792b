//! Help, unknown words and readers that go away.

use yawrig_tests::process::yawrig;

const VERBS: [&str; 23] = [
    "demo",
    "compare",
    "diagnose",
    "fit",
    "add",
    "remove",
    "history",
    "derivatives",
    "identify",
    "simulate",
    "study",
    "train",
    "flash",
    "device",
    "monitor",
    "replay",
    "ports",
    "convert",
    "doctor",
    "completions",
    "report",
    "workbench",
    "keygen",
];

#[test]
fn every_verb_explains_itself() {
    let help = yawrig("--help").run().exits(0);
    for verb in VERBS {
        assert!(help.stdout.contains(&format!("\n  {verb} ")), "{}", help.report());
        let own = yawrig(verb).and("--help").run().exits(0);
        assert!(own.stdout.contains(&format!("Usage: yawrig {verb}")), "{}", own.report());
        let has_no_letter = |line: &str| {
            let option = line.strip_prefix("      ").and_then(|rest| rest.split(' ').next());
            ["--out", "--device", "--model", "--json"].map(Some).contains(&option)
        };
        assert!(!own.stdout.lines().any(has_no_letter), "{}", own.report());
    }
    let version = yawrig("--version").run().exits(0);
    assert_eq!(version.stdout.trim(), format!("yawrig {}", env!("CARGO_PKG_VERSION")));
}

#[test]
fn unknown_words_are_usage_errors() {
    yawrig("").run().exits(2);
    yawrig("dance").run().exits(2).says("unrecognized subcommand 'dance'");
    for verb in VERBS {
        let ended = yawrig(verb).and("--dance").run().exits(2);
        assert_eq!(ended.stdout, "");
        ended.says("'--dance'");
    }
    yawrig("flash").run().exits(2).says("<NETWORK>");
    yawrig("replay").run().exits(2).says("<FILES>");
    yawrig("simulate").run().exits(2);
    yawrig("convert").run().exits(2).says("<FROM>");
    yawrig("completions").run().exits(2).says("<SHELL>");
    yawrig("monitor --record r --replay r").run().exits(2);
}

#[test]
fn numbers_that_make_no_sense_are_usage_errors() {
    for command in [
        "monitor --speed 0",
        "monitor --speed nan",
        "monitor --seconds -1",
        "monitor --seconds nan",
        "monitor --seconds inf",
        "monitor --seconds 1e300",
        "monitor --releases -1",
        "monitor --releases many",
        "replay --from-deg 1 --to-deg 10 r.csv",
        "replay --from-deg nan r.csv",
        "replay --to-deg 0 r.csv",
        "replay --to-deg -1 r.csv",
        "identify --from-deg -1 r.csv",
        "simulate --out r.csv --spring K1 --wind -5",
        "simulate --out r.csv --spring K1 --seconds -5",
        "replay --from-deg 1e300 r.csv",
        "simulate --out r.csv --spring K9",
        "simulate --out r.csv --spring K1 --wind nan",
        "simulate --out r.csv --natural-frequency 7",
        "simulate --out r.csv --natural-frequency 7 --damping 2",
    ] {
        let ended = yawrig(command).run().exits(2);
        assert_eq!(ended.stdout, "", "{}", ended.report());
        // A number below zero is a number.
        assert!(!ended.stderr.contains("unexpected argument"), "{}", ended.report());
    }
}

#[test]
fn a_reader_that_goes_away_ends_it_quietly() {
    let folder = tempfile::tempdir().expect("a folder");
    let record = folder.path().join("r.csv");
    let make =
        || yawrig("simulate --force --natural-frequency 7 --damping 0.02 --out").and(&record);
    make().run().exits(0);
    let campaign = folder.path().join("campaign");
    for (command, bytes) in [
        (make(), 0),
        (make().and("--json"), 0),
        (yawrig("simulate --campaign").and(&campaign), 0),
        (yawrig("simulate --force --json --campaign").and(&campaign), 10),
        (yawrig("replay").and(&record), 30),
        (yawrig("replay --json").and(&record), 0),
        (yawrig("identify").and(&record), 5),
        (yawrig("identify --json").and(&record), 0),
        (yawrig("monitor --speed 50"), 100),
        (yawrig("monitor --speed 50 --jsonl"), 1),
        (yawrig("device"), 0),
        (yawrig("device --json"), 0),
        (yawrig("ports --json"), 0),
        (yawrig("--help"), 0),
        (yawrig("demo --no-report"), 50),
    ] {
        let ended = command.start_with_short_reader(bytes).ends();
        // Whoever has said all it had to say before its reader went has ended well, too.
        let ended = ended.exits(0);
        assert!(!ended.stderr.contains("yawrig: "), "{}", ended.report());
    }
}

#[test]
fn what_nobody_hears_on_stderr_is_no_reason_to_fail() {
    yawrig("device --json").unheard().run().exits(0).json();
    yawrig("monitor --speed 200 --releases 1").unheard().run().exits(0);
    yawrig("demo --wind 0").unheard().run().exits(2);
    // `2>&1 | head`
    yawrig("demo --no-report").unheard().start_with_short_reader(1).ends().exits(0);
}
