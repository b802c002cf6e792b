//! `convert`, and records that are no CSV where a record is wanted.

use std::path::{Path, PathBuf};
use yawrig_tests::process::yawrig;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/formats").join(name)
}

#[test]
fn a_record_goes_through_every_format_and_is_the_same() {
    let folder = tempfile::tempdir().expect("a folder");
    let convert = |from: &Path, to: &str| {
        let object = yawrig("convert --json")
            .and(from)
            .and(to)
            .in_folder(folder.path())
            .run()
            .exits(0)
            .json();
        assert_eq!(object["samples"], 300, "{to}");
        folder.path().join(to)
    };
    let mut file = data("v5.mat");
    for to in ["a.parquet", "a.h5", "a.mat", "a.csv", "b.parquet"] {
        file = convert(&file, to);
    }
    let lines = std::fs::read_to_string(folder.path().join("a.csv")).expect("the CSV");
    assert_eq!(lines.lines().next(), Some("time_s,yaw_deg"));
    assert_eq!(lines.lines().nth(1), Some("0.000000,8.500000"));
    assert_eq!(lines.lines().count(), 301);
}

#[test]
fn every_verb_takes_every_format() {
    let folder = tempfile::tempdir().expect("a folder");
    let make = yawrig("simulate --natural-frequency 7 --damping 0.02 --out r.csv");
    make.in_folder(folder.path()).run().exits(0);
    let estimate = |file: &str| {
        let identify = yawrig("identify --json").and(file).in_folder(folder.path());
        identify.run().exits(0).json()["records"][0]["estimates"].clone()
    };
    let expected = estimate("r.csv");
    for to in ["r.parquet", "r.h5", "r.mat"] {
        yawrig("convert r.csv").and(to).in_folder(folder.path()).run().exits(0);
        assert_eq!(estimate(to), expected, "{to}");
    }
    yawrig("replay --json r.parquet").in_folder(folder.path()).run().exits(0);
    yawrig("compare --json r.mat").in_folder(folder.path()).run().exits(0);
}

#[test]
fn what_is_unclear_is_refused_with_the_command_that_works() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = data("v5-compressed.mat");
    let ended = yawrig("identify").and(&file).in_folder(folder.path()).run().exits(3).helps();
    ended.says("theta (300 numbers)").says("yawrig convert").says("--yaw theta --unit rad");
    let named = "convert --time t --yaw theta --unit rad";
    let convert = yawrig(named).and(&file).and("r.csv").in_folder(folder.path());
    convert.run().exits(0);
    let again = yawrig(named).and(&file).and("r.csv").in_folder(folder.path());
    again.run().exits(2).helps().says("is there already");
    let tdms = yawrig(named).and(&file).and("r.tdms").in_folder(folder.path());
    tdms.run().exits(2).helps().says("TDMS is read and not written");
    let over = yawrig("convert --force r.csv ./r.csv").in_folder(folder.path());
    over.run().exits(2).helps().says("over itself");
    let scaled = yawrig("identify").and(data("scaled.tdms")).run().exits(3).helps();
    scaled.says("NI_Scale");
    // Any CSV, with its columns named.
    std::fs::write(
        folder.path().join("raw.csv"),
        (0..200).fold("t,volts,theta\n".to_owned(), |text, i| {
            let t = f64::from(i) * 0.01;
            format!("{text}{t},oops,{}\n", (9.0 * t).cos())
        }),
    )
    .expect("room for it");
    let convert = "convert raw.csv named.csv --time t --yaw theta --unit rad";
    yawrig(convert).in_folder(folder.path()).run().exits(0);
    let convert = "convert raw.csv other.csv --time t --yaw volts --unit rad";
    yawrig(convert).in_folder(folder.path()).run().exits(3).says("line 2").helps();
}
