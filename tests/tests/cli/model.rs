//! The loop: a record with a hidden effect, compared, diagnosed, the effect added, and the way back.

use nix::sys::signal::Signal;
use serde_json::Value;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use yawrig_tests::process::{yawrig, yawrig_as_anybody, Ended, Yawrig};

/// Planted; the rig's integrator is not the fits'.
const FRICTION: f64 = 0.06;
const NATURAL_FREQUENCY: f64 = 7.5;
const DAMPING: f64 = 0.008;

pub struct Bench {
    pub folder: TempDir,
}

impl Bench {
    /// A folder with a record of a rig that rubs.
    pub fn new() -> Self {
        let bench = Self { folder: tempfile::tempdir().expect("a folder") };
        bench.simulate("r.csv", &format!("--effect coulomb_friction:c={FRICTION} --seed 7"));
        bench
    }

    pub fn simulate(&self, name: &str, how: &str) {
        let rig = format!("--natural-frequency {NATURAL_FREQUENCY} --damping {DAMPING}");
        self.of(&format!("simulate {rig} --out {name} {how}")).run().exits(0);
    }

    pub fn of(&self, arguments: &str) -> Yawrig {
        yawrig(arguments).in_folder(self.folder.path())
    }

    pub fn json(&self, arguments: &str) -> Value {
        self.of(arguments).and("--json").run().exits(0).json()
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).expect(name)
    }

    fn replace(&self, from: &str, to: &str) {
        let text = self.text("model.toml");
        assert!(text.contains(from), "{from} is not in\n{text}");
        std::fs::write(self.path("model.toml"), text.replacen(from, to, 1)).expect("room for it");
    }

    fn names(&self) -> Vec<String> {
        let entries = self.folder.path().read_dir().expect("a folder").flatten();
        let mut names: Vec<String> =
            entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// What `arguments` are refused with, the model and its journal being left as they were.
    pub fn refuses(&self, arguments: &str, code: i32) -> Ended {
        let state = || {
            let read = |name| std::fs::read(self.path(name)).ok();
            (read("model.toml"), read("model.journal.jsonl"), self.names())
        };
        let before = state();
        let ended = self.of(arguments).run().exits(code).helps();
        assert_eq!(ended.stdout, "");
        assert!(state() == before, "{}", ended.report());
        ended
    }
}

pub fn number(object: &Value, field: &str) -> f64 {
    object[field].as_f64().unwrap_or_else(|| panic!("{field} of {object}"))
}

fn friction(object: &Value) -> f64 {
    number(&object["parameters"]["coulomb_friction.c"], "value")
}

#[test]
fn the_whole_loop() {
    let bench = Bench::new();
    let fitted = bench.json("fit r.csv");
    assert_eq!((&fitted["step"], &fitted["added"]), (&1.into(), &Value::Null));
    assert!(number(&fitted, "residual_over_noise") > 5.0, "{fitted}");

    // It fails, and shows where: what is missing opposes the motion at either sign of the rate, less what the
    // fit's linear damping has taken up.
    let compared = bench.json("compare");
    let residual = number(&compared, "residual_over_noise");
    assert!((residual / number(&fitted, "residual_over_noise") - 1.0).abs() < 1e-3);
    let located = &compared["where"];
    for field in ["time", "amplitude", "phase", "frequency", "damping_law", "stiffness_law"] {
        assert!(located[field].as_array().is_some_and(|a| a.len() >= 3), "{field} of {located}");
    }
    assert!(number(located, "correlation") > 10.0 * number(located, "correlation_of_white"));
    let slow: Vec<f64> = located["damping_law"]
        .as_array()
        .expect("the damping law")
        .iter()
        .filter(|p| number(p, "rate_deg_s").abs() < 30.0)
        .map(|p| number(p, "rate_deg_s").signum() * number(p, "moment_rad_s2"))
        .collect();
    assert!(slow.len() >= 2 && slow.iter().all(|m| *m < 0.0), "{slow:?}");

    let diagnosed = bench.json("diagnose r.csv");
    assert_eq!(diagnosed["effects"], serde_json::json!(["coulomb_friction"]));

    let added = bench.json("add coulomb_friction --why because");
    assert_eq!((&added["step"], &added["added"]), (&2.into(), &"coulomb_friction".into()));
    assert!(number(&added, "residual_over_noise") <= 1.05, "{added}");
    assert!(number(&added, "held_out_over_noise") <= 1.10, "{added}");
    assert!(number(&added["before"], "residual_over_noise") > 5.0, "{added}");
    assert!(number(&added, "evidence") > 100.0, "{added}");
    for (quantity, truth) in [
        (&added["parameters"]["coulomb_friction.c"], FRICTION),
        (&added["modal"]["natural_frequency_rad_s"], NATURAL_FREQUENCY),
        (&added["modal"]["damping_ratio"], DAMPING),
    ] {
        // Three standard uncertainties: one record in a hundred and twenty is farther out by chance.
        let miss = (number(quantity, "value") - truth).abs();
        assert!(miss < 3.0 * number(quantity, "u"), "{quantity} for {truth}");
    }
    let now = bench.json("compare");
    assert!(number(&now, "residual_over_noise") <= 1.05, "{now}");
    assert!((friction(&now) - friction(&added)).abs() < 1e-6);

    // Out again, and back by the journal.
    let with = bench.text("model.toml");
    let removed = bench.json("remove coulomb_friction");
    assert_eq!(removed["removed"], "coulomb_friction");
    let back = number(&removed, "residual_over_noise");
    assert!((back / residual - 1.0).abs() < 1e-3, "{back} for {residual}");
    bench.of("history --return 2").run().exits(0).says("step 4");
    assert_eq!(bench.text("model.toml"), with);
    let history = bench.json("history");
    let steps = history["steps"].as_array().expect("steps");
    let actions: Vec<&str> = steps.iter().filter_map(|s| s["action"].as_str()).collect();
    assert_eq!(actions, ["fit", "add", "remove", "return"]);
    assert_eq!(steps[1]["why"], "because");
    assert_eq!(steps[1]["model"], with.as_str());
    assert!(steps[1]["command"].as_str().is_some_and(|c| c.starts_with("yawrig add")));
    assert_eq!(history["edited"], false);
    assert_eq!(bench.names(), ["model.journal.jsonl", "model.toml", "r.csv"]);
}

#[test]
fn a_rejected_effect_stands_in_the_journal_with_its_reason_and_changes_nothing() {
    let bench = Bench::new();
    bench.json("fit r.csv");
    let model = bench.text("model.toml");
    let rejected = bench.of("reject cubic_damping --json --why").and("the wind was off").run();
    let rejected = rejected.exits(0).json();
    assert_eq!(
        (&rejected["step"], &rejected["rejected"], &rejected["why"]),
        (&2.into(), &"cubic_damping".into(), &"the wind was off".into())
    );
    assert_eq!(bench.text("model.toml"), model);
    let history = bench.json("history");
    let step = &history["steps"][1];
    assert_eq!((&step["action"], &step["rejected"]), (&"reject".into(), &"cubic_damping".into()));
    assert_eq!(step["command"], "yawrig reject cubic_damping --json --why \"the wind was off\"");
    assert_eq!(
        (&step["why"], &step["after"]),
        (&"the wind was off".into(), &history["steps"][0]["after"])
    );
    assert_eq!(history["edited"], false);
    let text = bench.of("history").run().exits(0).stdout;
    assert!(text.contains("reject cubic_damping") && text.contains("the wind was off"), "{text}");

    bench.of("reject free_play --why small").run().exits(0);
    bench.of("reject cubic_damping").run().exits(2).says("--why");
    bench.refuses("reject cubic_damping --why=", 2).says("--why is empty");
    bench.refuses("reject cubic_dampin --why no", 2).says("did you mean cubic_damping");
    bench.of("add coulomb_friction").run().exits(0);
    bench.refuses("reject coulomb_friction --why no", 2).says("is in the model");
    bench.refuses("reject free_play --why no --model absent.toml", 3).says("absent.toml");
}

#[test]
fn what_a_user_reads() {
    let bench = Bench::new();
    let fit = bench.of("fit r.csv").run().exits(0);
    assert!(fit.stdout.contains("model.toml, step 1: fitted"), "{}", fit.report());
    let compare = bench.of("compare").run().exits(0);
    for words in [
        "second order",
        "not white",
        "time (s)",
        "amplitude (deg)",
        "rate at zero yaw (deg/s)",
        "yaw at zero rate (deg)",
        "frequency (Hz)",
        "wn (rad/s)     zeta",
    ] {
        assert!(compare.stdout.contains(words), "{words:?} is missing from {}", compare.report());
    }
    let add = bench.of("add coulomb_friction --why").and("it rubs, I think").run().exits(0);
    assert!(add.stdout.contains("step 2: added coulomb_friction"), "{}", add.report());
    assert!(add.stdout.contains(" -> "), "{}", add.report());
    let history = bench.of("history").run().exits(0);
    assert!(history.stdout.contains("it rubs, I think"), "{}", history.report());
}

#[test]
fn what_is_edited_by_hand_is_kept_to() {
    let bench = Bench::new();
    bench.json("fit r.csv");
    bench.json("add coulomb_friction");
    let value = friction(&bench.json("compare"));
    // Fixed at another value, with a comment.
    let line =
        bench.text("model.toml").lines().find(|l| l.starts_with("c = ")).expect("c").to_owned();
    bench.replace(&line, "c = { value = 0.03, free = false } # from the workshop");
    let fixed = bench.json("fit");
    assert_eq!(friction(&fixed), 0.03);
    assert!(number(&fixed, "residual_over_noise") > 1.5, "{fixed}");
    assert!(bench.text("model.toml").contains("# from the workshop"));
    // Free again, but within bounds.
    bench.replace("max = inf, free = false } # from", "max = 0.05, free = true } # from");
    let bounded = bench.json("fit");
    assert_eq!(friction(&bounded), 0.05);
    bench.replace("max = 0.05", "max = inf");
    let free = bench.json("fit");
    assert!((friction(&free) - value).abs() < 1e-5, "{free}");
    // Every state it was in is in the journal, the edits too.
    let steps = bench.json("history")["steps"].as_array().expect("steps").len();
    assert_eq!(steps, 2 + 2 * 3);

    for (from, to, said) in [
        ("id = \"coulomb_friction\"", "id = \"coulomb_fricton\"", "did you mean coulomb_friction"),
        ("free = true } # from", "fre = true } # from", "unknown field `fre`"),
        ("unit = \"rad/s2\"", "unit = \"N m\"", "coulomb_friction.c is in rad/s2, not in N m"),
        ("r.csv", "q.csv", "q.csv is not there"),
    ] {
        let sound = bench.text("model.toml");
        let line = 1 + sound.lines().position(|l| l.contains(from)).expect(from);
        bench.replace(from, to);
        for verb in ["fit", "compare", "add free_play", "remove coulomb_friction"] {
            bench.refuses(verb, 3).says(&format!("model.toml:{line}")).says(said);
        }
        std::fs::write(bench.path("model.toml"), sound).expect("room for it");
    }
}

#[test]
fn what_makes_no_sense_is_refused_and_changes_nothing() {
    let bench = Bench::new();
    bench.simulate("other.csv", "--seed 3");
    bench.refuses("fit", 2).says("there is no model model.toml");
    bench.refuses("fit absent.csv", 3).says("cannot read absent.csv");
    bench.refuses("compare", 2);
    bench.refuses("add free_play", 3).says("cannot read model.toml");
    bench.refuses("history", 3).says("no journal");
    bench.refuses("history --return 1", 3).says("no journal");
    std::fs::write(bench.path("bad.csv"), "time_s,yaw_deg\n0,ten\n").expect("room for it");
    bench.refuses("fit bad.csv", 3).says("bad.csv, line 2");
    assert_eq!(bench.names(), ["bad.csv", "other.csv", "r.csv"]);

    bench.json("fit r.csv");
    bench.refuses("add coulomb_fricton", 2).says("did you mean coulomb_friction");
    bench.refuses("add buffeting", 2).says("random");
    bench.refuses("add absent.toml", 3).says("cannot read absent.toml");
    bench.refuses("remove free_play", 2).says("free_play is not in model.toml");
    bench.refuses("fit model.toml", 2).says("is the model, not a record");
    bench.refuses("fit other.csv", 2).says("about other records (r.csv)");
    bench.refuses("fit --hold-out absent.csv", 3).says("absent.csv");
    bench.refuses("fit --hold-out r.csv", 3).says("no record to fit");
    bench.refuses("history --return 2", 2).says("there is no step 2");
    bench.refuses("compare --effect free_pla", 2).says("did you mean free_play");
    bench.json("add coulomb_friction");
    bench.refuses("add coulomb_friction", 2).says("in the model already");
    bench.refuses("remove coulomb", 2).helps();

    // The file gone, the journal there.
    std::fs::remove_file(bench.path("model.toml")).expect("it is there");
    bench.refuses("fit", 3).says("`yawrig history --return 2`");
    bench.refuses("add free_play", 3).says("`yawrig history --return 2`");
    bench.of("history --return 2").run().exits(0);
    assert!(bench.text("model.toml").contains("coulomb_friction"));
}

#[test]
fn another_release_is_held_out() {
    let bench = Bench::new();
    bench.simulate("again.csv", &format!("--effect coulomb_friction:c={FRICTION} --seed 8"));
    bench.simulate("clean.csv", "--seed 9");
    bench.json("fit r.csv --hold-out again.csv");
    let added = bench.json("add coulomb_friction");
    assert!(number(&added, "held_out_over_noise") < 1.10, "{added}");
    assert!(number(&added["before"], "held_out_over_noise") > 3.0, "{added}");
    let held_out: Vec<&Value> = added["records"].as_array().expect("records").iter().collect();
    assert_eq!((&held_out[0]["held_out"], &held_out[1]["held_out"]), (&false.into(), &true.into()));
    // On a rig that does not rub the coefficient is wrong, whatever is fitted beside it.
    let elsewhere = bench.json("compare clean.csv");
    assert!(number(&elsewhere, "residual_over_noise") > 3.0, "{elsewhere}");
    let none = bench.json("compare clean.csv --no-model");
    assert!(number(&none, "residual_over_noise") < 1.05, "{none}");
    let tried = bench.json("compare r.csv --no-model --effect coulomb_friction");
    assert!(number(&tried, "residual_over_noise") < 1.05, "{tried}");
    assert_eq!(tried["step"], Value::Null);
}

#[test]
fn a_users_own_effect_goes_into_the_model_with_its_definition() {
    let bench = Bench::new();
    let own = "id = \"rubbing\"\ntitle = \"Rubbing\"\nmoment = \"-c * tanh(r / 0.001)\"\n\
               [parameters]\nc = { unit = \"rad/s2\", start = 0.05, min = 0.0 }\n";
    std::fs::write(bench.path("rubbing.toml"), own).expect("room for it");
    bench.json("fit r.csv");
    let added = bench.json("add rubbing.toml");
    assert!(number(&added, "residual_over_noise") < 1.2, "{added}");
    let c = number(&added["parameters"]["rubbing.c"], "value");
    assert!((c / FRICTION - 1.0).abs() < 0.05, "{added}");
    // The file is not needed any more.
    std::fs::remove_file(bench.path("rubbing.toml")).expect("it is there");
    let compared = bench.json("compare");
    assert!(number(&compared, "residual_over_noise") < 1.2, "{compared}");
    bench.json("fit");
    bench.json("remove rubbing");
    assert!(!bench.text("model.toml").contains("tanh"));
}

#[test]
fn ctrl_c_during_add_leaves_the_model_and_its_journal_as_they_were() {
    let bench = Bench::new();
    bench.json("fit r.csv");
    // An hour of an oscillation that hardly decays, read in a moment and fitted for seconds.
    bench
        .of("simulate --natural-frequency 7.5 --damping 0.00002 --seconds 3600 --rate-hz 100 --out long.csv")
        .run();
    bench.of("fit long.csv --model long.toml").run().exits(0);
    let read = || (bench.text("long.toml"), bench.text("long.journal.jsonl"), bench.names());
    let before = read();
    for wait_ms in [0, 300] {
        let mut running = bench.of("add harmonic_forcing --model long.toml").start();
        running.catches_interrupts();
        std::thread::sleep(std::time::Duration::from_millis(wait_ms));
        running.signal(Signal::SIGINT);
        running.ends().exits(130).says("interrupted");
        assert!(read() == before, "after {wait_ms} ms");
    }
}

#[test]
fn two_at_once_take_their_steps_one_after_the_other() {
    let bench = Bench::new();
    bench.json("fit r.csv");
    let both =
        ["coulomb_friction", "cubic_stiffness"].map(|e| bench.of(&format!("add {e}")).start());
    for running in both {
        running.ends().exits(0);
    }
    let model = bench.text("model.toml");
    assert!(model.contains("coulomb_friction") && model.contains("cubic_stiffness"), "{model}");
    assert_eq!(bench.json("history")["steps"].as_array().expect("steps").len(), 3);
}

#[test]
fn a_folder_that_may_not_be_written_to() {
    use std::os::unix::fs::PermissionsExt;
    let bench = Bench::new();
    bench.json("fit r.csv");
    let mode = |folder: &Path, mode| {
        std::fs::set_permissions(folder, std::fs::Permissions::from_mode(mode)).expect("ours");
    };
    mode(bench.folder.path(), 0o555);
    let before = bench.text("model.journal.jsonl");
    for command in ["add coulomb_friction", "fit", "history --return 1", "fit r.csv --model n.toml"]
    {
        let ended = yawrig_as_anybody(command).in_folder(bench.folder.path()).run();
        ended.exits(3).says("you may not write there").helps();
    }
    // To look is allowed.
    for command in ["compare", "history"] {
        yawrig_as_anybody(command).in_folder(bench.folder.path()).run().exits(0);
    }
    assert_eq!(bench.text("model.journal.jsonl"), before);
    mode(bench.folder.path(), 0o755);
}
