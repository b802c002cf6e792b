//! Record files that are none: the message names the file and the line.

use yawrig_tests::process::{yawrig, Ended};

fn refused(text: &[u8]) -> Ended {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("bad.csv");
    std::fs::write(&file, text).expect("room for it");
    let ended = yawrig("replay --json").and(&file).run().exits(3).says("bad.csv").helps();
    assert_eq!(ended.stdout, "");
    // Found before a device is started.
    assert!(!ended.stderr.contains("device:"), "{}", ended.report());
    ended
}

/// A sound record of 3 s but for line `line` (the first is 1).
fn with_line(line: usize, instead: &str) -> Vec<u8> {
    let mut lines = vec!["time_s,yaw_deg".to_owned()];
    lines.extend((0..3000).map(|k| {
        let t = f64::from(k) * 1e-3;
        format!("{t:.3},{:.4}", 10.0 * (-0.1 * t).exp() * (9.0 * t).cos())
    }));
    lines[line - 1] = instead.to_owned();
    lines.join("\n").into_bytes()
}

#[test]
fn the_line_that_is_wrong_is_named() {
    for (line, instead, said) in [
        (1, "time_s,yaw_grad", "line 1: the second column is \"yaw_grad\", not yaw_deg or yaw_rad"),
        (1, "time_s", "line 1: one column instead of two"),
        (1, "0.000,10.0", "its channels: column 1 (3001 numbers), column 2 (3001 numbers)"),
        (17, "0.015,ten", "line 17: yaw angle: \"ten\" is not a number"),
        (17, "zero,1.0", "line 17: time_s: \"zero\" is not a number"),
        (17, "0,015;1,0", "line 17: 3 fields instead of two"),
        (17, "0.015", "line 17: one field instead of two"),
        (23, "0.021,NaN", "line 23: yaw angle: \"NaN\" is not a finite number"),
        (23, "inf,1.0", "line 23: time_s: \"inf\" is not a finite number"),
        (42, "0.012,1.0", "line 42: time runs backwards"),
        (2999, "2.997,1.0,", "line 2999: 3 fields instead of two"),
    ] {
        refused(&with_line(line, instead)).says(said);
    }
}

#[test]
fn files_with_nothing_in_them() {
    refused(b"").says("line 1: the file is empty");
    refused(b"\n\n").says("empty");
    refused(b"time_s,yaw_deg\n").says("line 1").says("too short for three cycles");
    refused(b"time_s,yaw_deg\n0,1\n0.001,2\n").says("line 3").says("after 2 samples, too short");
    refused(&[0xFF; 300]).says("no columns of numbers");
    refused(&[0; 300]).says("neither text nor of a format that is read");
    refused(b"\xff\xfet\0i\0m\0e\0").says("no columns of numbers");
}

#[test]
fn a_record_too_slow_for_a_device() {
    let rows = (0..100).map(|k| format!("{k},{}\n", k % 7));
    let text = format!("time_s,yaw_deg\n{}", rows.collect::<String>());
    refused(text.as_bytes()).says("sampled at 1").says("too slow for a device, which needs 20 Hz");
}

#[test]
fn too_few_samples_a_cycle() {
    let record = |step_s: f64| {
        let rows = (0..100).map(|k| {
            let turn = f64::from(k) * std::f64::consts::TAU / 4.5;
            format!("{:.7},{:.4}\n", f64::from(k) * step_s, 8.0 * turn.cos())
        });
        format!("time_s,yaw_deg\n{}", rows.collect::<String>())
    };
    for step_s in [1.0, 1e-5] {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("coarse.csv");
        std::fs::write(&file, record(step_s)).expect("room for it");
        let ended = yawrig("identify").and(&file).run().exits(3).says("coarse.csv").helps();
        ended.says("4.5 samples a cycle, at least 4.7 are needed");
    }
}

#[test]
fn a_clock_that_leaps_is_no_record_of_a_thousand_years() {
    // From seconds since the start to seconds since 1970.
    let mut rows: Vec<String> =
        (0..200).map(|k| format!("{:.3},{}", f64::from(k) * 1e-3, k % 9)).collect();
    rows.extend((0..200).map(|k| format!("{:.3},{}", 1.7e9 + f64::from(k) * 1e-3, k % 9)));
    let text = format!("time_s,yaw_deg\n{}\n", rows.join("\n"));
    refused(text.as_bytes()).says("line 202");
}

#[test]
fn files_that_cannot_be_read() {
    let folder = tempfile::tempdir().expect("a folder");
    for file in [folder.path().join("absent.csv"), folder.path().to_owned()] {
        let ended = yawrig("replay").and(&file).run().exits(3).says("cannot read").helps();
        ended.says(&file.display().to_string());
    }
    // The second of two is found before the first is played.
    let sound = folder.path().join("sound.csv");
    std::fs::write(&sound, with_line(2, "0.000,10.0")).expect("room for it");
    let ended = yawrig("replay").and(&sound).and(folder.path().join("absent.csv")).run();
    let ended = ended.exits(3).says("absent.csv");
    assert_eq!(ended.stdout, "");
}

#[test]
fn what_other_programs_write_is_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("r.csv");
    let sound = String::from_utf8(with_line(2, "0.000,10.0")).expect("text");
    // Windows' line ends and its mark, blanks, an empty line at the end.
    for text in [
        sound.replace('\n', "\r\n"),
        format!("\u{feff}{sound}\n"),
        sound.replace(',', " , "),
        format!("{sound}\n\n"),
    ] {
        std::fs::write(&file, text).expect("room for it");
        yawrig("replay --json").and(&file).run().exits(0);
    }
}

/// Where the comma is the decimal sign, programs part columns with semicolons or tabulators.
#[test]
fn semicolons_and_decimal_commas_are_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("r.csv");
    let sound = String::from_utf8(with_line(2, "0.000,10.0")).expect("text");
    let read = |text: &str| {
        std::fs::write(&file, text).expect("room for it");
        let mut object = yawrig("identify --json").and(&file).run().exits(0).json();
        object["records"][0].take()
    };
    let as_written = read(&sound);
    for separator in [";", "\t", " ; "] {
        let parted = sound.replace(',', separator);
        assert_eq!(read(&parted), as_written, "{separator:?}");
        assert_eq!(read(&parted.replace('.', ",")), as_written, "{separator:?} and a comma");
    }
    // By name, too.
    let german = sound.replace("time_s,yaw_deg", "t,angle").replace(',', ";").replace('.', ",");
    std::fs::write(&file, german).expect("room for it");
    let columns = "--time t --yaw angle --unit deg";
    let other = folder.path().join("other.csv");
    let ended = yawrig(&format!("convert {columns}")).and(&file).and(&other).run().exits(0);
    assert!(ended.stdout.contains("3000 samples at 1000.0000 Hz"), "{}", ended.report());
    // What could be meant in two ways is refused.
    let thousands = sound.replace(',', ";").replace("0.016;", "1,016.0;");
    std::fs::write(&file, thousands).expect("room for it");
    let ended = yawrig("identify").and(&file).run().exits(3);
    ended.says("\"1,016.0\" is not a number");
}

#[test]
fn a_file_of_another_kind_is_said_to_be() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    std::fs::write(folder.join("r.csv"), with_line(2, "0.000,10.0")).expect("room for it");
    std::fs::write(folder.join("file"), "").expect("room for it");
    std::fs::create_dir(folder.join("campaign")).expect("room for it");
    std::fs::write(folder.join("campaign/campaign.toml"), "").expect("room for it");
    for (command, says) in [
        ("compare --model r.csv", "r.csv is a record, not a model"),
        ("train --model r.csv --out n.yrn", "r.csv is a record, not a model"),
        ("derivatives r.csv --method all", "r.csv is a record, not a campaign"),
        ("fit campaign", "help: give the campaign in it: campaign/campaign.toml"),
        ("simulate --campaign file", "a file where the folder should be"),
        ("demo --out file", "file: it is a file, and a folder is wanted"),
        ("study response --quick --out file", "a file where the folder should be"),
        ("identify r.csv --out file/results.jsonl", "file/results.jsonl"),
        // It can be read without end.
        ("identify r.csv --out /dev/zero", "cannot write /dev/zero: it is not a file"),
    ] {
        let ended = yawrig(command).in_folder(folder).run().exits(3).says(says).helps();
        assert!(!ended.stderr.contains("trained"), "{}", ended.report());
    }
    let ended = yawrig("device --device emulatd").run().exits(4);
    ended.says("did you mean emulated?");
}
