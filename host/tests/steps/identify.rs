//! `yawrig identify` as a user runs it.

use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn yawrig(verb: &str, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_yawrig")).arg(verb).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn parsed(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// A record of the virtual rig at 200 Hz, wn 8 rad/s, zeta 0.02.
fn record(folder: &Path, name: &str) -> PathBuf {
    let file = folder.join(name);
    let arguments = ["--natural-frequency", "8", "--damping", "0.02", "--rate-hz", "200", "--out"];
    let out = yawrig("simulate", &[&arguments[..], &[file.to_str().unwrap()]].concat());
    assert!(out.status.success(), "{}", text(&out.stderr));
    file
}

fn as_text(files: &[PathBuf]) -> Vec<&str> {
    files.iter().map(|f| f.to_str().unwrap()).collect()
}

#[test]
fn json_has_what_scripts_rely_on() {
    let folder = tempfile::tempdir().unwrap();
    let file = record(folder.path(), "k.csv");
    let out = yawrig("identify", &[file.to_str().unwrap(), "--json"]);
    assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
    let said = parsed(&text(&out.stdout));
    assert_eq!(said["schema_version"], 1);
    let record = &said["records"][0];
    assert_eq!(record["file"], file.to_str().unwrap());
    assert!((record["release_time_s"].as_f64().unwrap() - 2.0).abs() < 0.01);
    assert!((record["rate_hz"].as_f64().unwrap() - 200.0).abs() < 1e-6);
    assert!((record["window"]["from_deg"].as_f64().unwrap() - 10.0).abs() < 0.5);
    assert!((record["window"]["to_deg"].as_f64().unwrap() - 1.0).abs() < 0.2);
    assert!(record["window"]["cycles"].as_f64().unwrap() > 15.0);
    assert!((record["noise_rms_deg"].as_f64().unwrap() - 0.05).abs() < 0.005);
    let estimate = &record["estimates"][0];
    assert_eq!(estimate["method"], "least-squares");
    for (name, truth) in [("natural_frequency_rad_s", 8.0), ("damping_ratio", 0.02)] {
        let (value, u) = (&estimate[name]["value"], &estimate[name]["u"]);
        let error = (value.as_f64().unwrap() - truth).abs();
        assert!(error < 4.0 * u.as_f64().unwrap(), "{name}: {estimate}");
    }
    assert!((estimate["residual_rms_deg"].as_f64().unwrap() - 0.05).abs() < 0.005);
    let window = &estimate["windows"][0];
    for name in ["amplitude_deg", "natural_frequency_rad_s", "damping_ratio"] {
        assert!(window[name].is_f64(), "{window}");
    }
    assert!(estimate["flags"].as_array().unwrap().is_empty());
}

#[test]
fn methods_and_the_readable_table() {
    let folder = tempfile::tempdir().unwrap();
    let file = record(folder.path(), "k.csv");
    let name = file.to_str().unwrap();
    let out = yawrig("identify", &[name, "--method", "conventional", "--json"]);
    assert_eq!(parsed(&text(&out.stdout))["records"][0]["estimates"][0]["method"], "conventional");
    let options = ["--spectral-peak", "interpolated", "--decay", "regression"];
    let out = yawrig("identify", &[&[name, "--method", "all"], &options[..]].concat());
    assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
    let table = text(&out.stdout);
    for word in ["least-squares", "conventional", "8.0", "amplitude (deg)"] {
        assert!(table.contains(word), "{word} is not in\n{table}");
    }
}

#[test]
fn a_bad_file_is_named_and_the_good_ones_are_still_done() {
    let folder = tempfile::tempdir().unwrap();
    let good = record(folder.path(), "good.csv");
    let bad = folder.path().join("bad.csv");
    std::fs::write(&bad, "time_s,yaw_deg\n0.0,1.0\n0.1,x\n").unwrap();
    let still = folder.path().join("still.csv");
    let rows: String = (0..400).map(|k| format!("{:.2},4.0\n", f64::from(k) * 0.01)).collect();
    std::fs::write(&still, format!("time_s,yaw_deg\n{rows}")).unwrap();

    let out = yawrig("identify", &as_text(&[bad.clone(), good.clone(), still.clone()]));
    assert_eq!(out.status.code(), Some(3));
    assert!(text(&out.stdout).contains("good.csv"));
    let complaint = text(&out.stderr);
    assert!(complaint.contains("bad.csv, line 3"), "{complaint}");
    assert!(complaint.contains("still.csv: no oscillation found"), "{complaint}");

    let out = yawrig("identify", &[&as_text(&[bad, good, still])[..], &["--json"]].concat());
    assert_eq!(out.status.code(), Some(3));
    let said = parsed(&text(&out.stdout));
    assert_eq!(said["records"].as_array().unwrap().len(), 1);
    assert_eq!(said["refused"].as_array().unwrap().len(), 2);

    assert_eq!(yawrig("identify", &["absent.csv"]).status.code(), Some(3));
    assert_eq!(
        yawrig("identify", &["a.csv", "--from-deg", "1", "--to-deg", "2"]).status.code(),
        Some(2)
    );
    assert_eq!(yawrig("identify", &[]).status.code(), Some(2));
}

fn names(log: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(log).unwrap();
    assert!(text.is_empty() || text.ends_with('\n'), "whole lines only");
    text.lines().map(|line| parsed(line)["file"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn a_log_goes_on_where_it_stopped_and_does_not_depend_on_the_order() {
    let folder = tempfile::tempdir().unwrap();
    let mut files: Vec<PathBuf> =
        (0..6).map(|k| record(folder.path(), &format!("{k}.csv"))).collect();
    let log = folder.path().join("results.jsonl");
    let run = |files: &[PathBuf], log: &Path| {
        let out =
            yawrig("identify", &[&as_text(files)[..], &["--out", log.to_str().unwrap()]].concat());
        assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
        text(&out.stderr)
    };
    run(&files[..3], &log);
    assert_eq!(names(&log).len(), 3);
    // A power cut in mid-line.
    let half = std::fs::read_to_string(&log).unwrap();
    std::fs::write(&log, &half[..half.len() - 20]).unwrap();
    let said = run(&files, &log);
    assert!(said.contains("4 identified, 0 refused, 2 already there"), "{said}");
    let all: BTreeSet<String> = names(&log).into_iter().collect();
    assert_eq!((all.len(), names(&log).len()), (6, 6));

    // Another record under the same name is done again, and so is all of it with other options.
    let content = std::fs::read_to_string(&files[0]).unwrap();
    std::fs::write(&files[0], content.trim_end().rsplit_once('\n').unwrap().0).unwrap();
    let said = run(&files, &log);
    assert!(said.contains("1 identified, 0 refused, 5 already there; 1 of them again"), "{said}");
    assert_eq!((all.len(), names(&log).len()), (6, 6));
    let narrower = [&as_text(&files)[..], &["--from-deg", "8", "--out", log.to_str().unwrap()]];
    let out = yawrig("identify", &narrower.concat());
    assert!(text(&out.stderr).contains("6 identified, 0 refused, 0 already there"), "{out:?}");
    run(&files, &log);
    // Two at once would write every line twice.
    let held = std::fs::File::open(&log).unwrap();
    held.lock().unwrap();
    let out =
        yawrig("identify", &[&as_text(&files)[..], &["--out", log.to_str().unwrap()]].concat());
    assert_eq!(out.status.code(), Some(3), "{out:?}");
    assert!(text(&out.stderr).contains("another yawrig"), "{out:?}");
    held.unlock().unwrap();

    files.reverse();
    let other = folder.path().join("other.jsonl");
    run(&files, &other);
    let lines = |log: &Path| -> BTreeSet<String> {
        std::fs::read_to_string(log).unwrap().lines().map(str::to_owned).collect()
    };
    assert_eq!(lines(&log), lines(&other));

    let foreign = folder.path().join("foreign.txt");
    for content in ["something else\n", "something else"] {
        std::fs::write(&foreign, content).unwrap();
        let arguments = [files[0].to_str().unwrap(), "--out", foreign.to_str().unwrap()];
        assert_eq!(yawrig("identify", &arguments).status.code(), Some(3));
        assert_eq!(std::fs::read_to_string(&foreign).unwrap(), content);
    }
}

#[test]
fn ctrl_c_leaves_whole_lines_and_the_rest_can_follow() {
    let folder = tempfile::tempdir().unwrap();
    let first = record(folder.path(), "0.csv");
    let records = folder.path().join("records");
    std::fs::create_dir(&records).unwrap();
    let count = 20;
    for k in 0..count {
        std::fs::hard_link(&first, records.join(format!("{k}.csv"))).unwrap();
    }
    // One that is read for as long as nobody writes to it: the signal comes before the last is done.
    let waits = records.join("waits.csv");
    nix::unistd::mkfifo(&waits, nix::sys::stat::Mode::S_IRWXU).unwrap();
    let log = folder.path().join("results.jsonl");
    let mut child = Command::new(env!("CARGO_BIN_EXE_yawrig"))
        .args(["identify", "--out", log.to_str().unwrap()])
        .args((0..count).map(|k| records.join(format!("{k}.csv"))).chain([waits.clone()]))
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    while std::fs::metadata(&log).map_or(0, |m| m.len()) == 0 {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    let pid = nix::unistd::Pid::from_raw(child.id() as i32);
    nix::sys::signal::kill(pid, nix::sys::signal::Signal::SIGINT).unwrap();
    // Nobody reads it any more where the signal came before that.
    let open = || {
        let flags = nix::fcntl::OFlag::O_WRONLY | nix::fcntl::OFlag::O_NONBLOCK;
        nix::fcntl::open(&waits, flags, nix::sys::stat::Mode::empty())
    };
    while child.try_wait().unwrap().is_none() && open().is_err() {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let before = names(&log).len();
    assert!(before > 0 && before <= count, "{before}");
    std::fs::remove_file(&waits).unwrap();
    std::fs::hard_link(&first, &waits).unwrap();
    let out = yawrig("identify", &[records.to_str().unwrap(), "--out", log.to_str().unwrap()]);
    assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
    let all = names(&log);
    assert_eq!(all.len(), count + 1);
    assert_eq!(all.into_iter().collect::<BTreeSet<_>>().len(), count + 1);
}

#[test]
fn lines_come_in_the_order_of_the_files() {
    let folder = tempfile::tempdir().unwrap();
    let files: Vec<PathBuf> =
        (0..4).map(|k| record(folder.path(), &format!("{}.csv", 9 - k))).collect();
    let out = yawrig("identify", &[&as_text(&files)[..], &["--jsonl"]].concat());
    let said: Vec<String> = text(&out.stdout)
        .lines()
        .map(|line| parsed(line)["file"].as_str().unwrap().to_owned())
        .collect();
    assert_eq!(said, as_text(&files));
}
