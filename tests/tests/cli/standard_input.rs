//! A record that can be read only once: `-`, which comes by standard input, and a pipe with a name.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};
use yawrig_tests::process::{binary, yawrig};

/// Exit code, stdout and stderr of `yawrig ARGUMENTS < FILE`.
fn fed(folder: &Path, arguments: &str, file: &str) -> (Option<i32>, String, String) {
    let input = std::fs::File::open(folder.join(file)).expect("a file");
    let ran = Command::new(binary())
        .args(arguments.split_whitespace())
        .stdin(Stdio::from(input))
        .current_dir(folder)
        .output()
        .expect("yawrig");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    (ran.status.code(), text(ran.stdout), text(ran.stderr))
}

/// As for the file, but for its name and how long it took.
fn without_name(mut value: Value) -> Value {
    fn forget(value: &mut Value) {
        match value {
            Value::Object(fields) => {
                let names = [
                    "file",
                    "where_file",
                    "where_release",
                    "record",
                    "seconds",
                    "condition",
                    "commands",
                ];
                fields.retain(|name, _| !names.contains(&name.as_str()));
                fields.values_mut().for_each(forget);
            }
            Value::Array(all) => all.iter_mut().for_each(forget),
            _ => {}
        }
    }
    forget(&mut value);
    value
}

#[test]
fn every_verb_that_reads_a_record_takes_it_from_standard_input() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let of = |arguments: &str| yawrig(arguments).in_folder(at);
    let planted = "--natural-frequency 7 --damping 0.006 --seconds 16 --rate-hz 100 --effect coulomb_friction:c=0.15";
    of(&format!("simulate {planted} --out r.csv")).run().exits(0);
    // Formats are told by what is in them.
    of("convert r.csv r.parquet").run().exits(0);
    for (verb, file) in [
        ("identify - --json", "r.csv"),
        ("identify - --json", "r.parquet"),
        ("diagnose - --json", "r.csv"),
        ("compare - --effect coulomb_friction --json", "r.csv"),
        ("law - --json", "r.csv"),
    ] {
        let (code, stdout, stderr) = fed(at, verb, file);
        assert_eq!(code, Some(0), "{verb}: {stderr}");
        let by_input: Value = serde_json::from_str(&stdout).expect("JSON");
        // What came by a pipe is not there for a command after it.
        assert!(by_input["commands"].as_array().is_none_or(Vec::is_empty), "{by_input}");
        let by_name = of(&verb.replacen('-', "r.csv", 1)).run().exits(0).json();
        assert_eq!(without_name(by_input), without_name(by_name), "{verb} < {file}");
    }
    let (_, stdout, _) = fed(at, "identify - --json", "r.csv");
    let named: Value = serde_json::from_str(&stdout).expect("JSON");
    assert_eq!(named["records"][0]["file"], "-");
    let (code, stdout, stderr) = fed(at, "identify - --release 1", "r.csv");
    assert_eq!((code, stdout.lines().next()), (Some(0), Some("-#1")), "{stderr}");
    assert_eq!(fed(at, "convert - copy.csv", "r.csv").0, Some(0));
    let bytes = |name: &str| std::fs::read(at.join(name)).expect("a file");
    assert_eq!(bytes("copy.csv"), bytes("r.csv"));
}

#[test]
fn what_comes_by_standard_input_is_refused_by_that_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("empty.csv"), "").expect("a file");
    std::fs::write(at.join("bad.csv"), "time_s,yaw_deg\n0.0,1.0\n0.1,x\n").expect("a file");
    let (code, _, stderr) = fed(at, "identify -", "empty.csv");
    assert_eq!(code, Some(3));
    assert!(stderr.contains("standard input"), "{stderr}");
    let (code, _, stderr) = fed(at, "diagnose -", "bad.csv");
    assert_eq!(code, Some(3));
    assert!(stderr.contains("standard input") && stderr.contains('3'), "{stderr}");
    let (code, _, stderr) = fed(at, "fit -", "bad.csv");
    assert_eq!(code, Some(2));
    assert!(stderr.contains("a model keeps the names of its records"), "{stderr}");
}

#[test]
fn every_command_reads_a_record_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let planted = "--natural-frequency 7 --damping 0.006 --seconds 16 --rate-hz 100 --effect coulomb_friction:c=0.15";
    yawrig(&format!("simulate {planted} --out r.csv")).in_folder(at).run().exits(0);
    let bytes = std::fs::read(at.join("r.csv")).expect("a record");
    for (number, verb) in [
        "identify PIPE",
        "identify PIPE --release all",
        "identify PIPE --out log.jsonl",
        "convert PIPE copy.csv",
        "diagnose PIPE",
        "diagnose PIPE r.csv",
        "law PIPE",
        "compare PIPE --effect coulomb_friction",
        "report PIPE --out page.html",
        "fit PIPE --model model.toml",
        "diagnose PIPE --model model.toml",
        "train --records PIPE --samples 200 --epochs 1 --out network.yrn",
    ]
    .into_iter()
    .enumerate()
    {
        let pipe = format!("{number}.csv");
        nix::unistd::mkfifo(&at.join(&pipe), nix::sys::stat::Mode::S_IRWXU).expect("a pipe");
        let (fed, bytes) = (at.join(&pipe), bytes.clone());
        // Opened again, it waits for somebody who writes until the test is out of patience.
        let feeder = std::thread::spawn(move || std::fs::write(fed, bytes));
        yawrig(&verb.replace("PIPE", &pipe)).in_folder(at).run().exits(0);
        feeder.join().expect("a thread").expect("a reader");
    }
}
