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
        (1, "t,yaw_deg", "line 1: the first column is \"t\", not time_s"),
        (1, "time_s", "line 1: 1 columns instead of two"),
        (1, "time_s,yaw_deg,note", "line 1: 3 columns instead of two"),
        (1, "0.000,10.0", "line 1: "),
        (17, "0.015,ten", "line 17: yaw angle: \"ten\" is not a number"),
        (17, "0.015,", "line 17: yaw angle: \"\" is not a number"),
        (17, "zero,1.0", "line 17: time_s: \"zero\" is not a number"),
        (17, "0,015;1,0", "line 17: 3 fields instead of two"),
        (17, "0.015", "line 17: 1 fields instead of two"),
        (23, "0.021,NaN", "line 23: yaw angle: \"NaN\" is not a finite number"),
        (23, "inf,1.0", "line 23: time_s: \"inf\" is not a finite number"),
        (42, "0.012,1.0", "line 42: time runs backwards"),
        (42, "0.039,1.0", "line 42: time stands still, from 0.039 s to 0.039 s"),
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
    refused(&[0xFF; 300]).says("line 1");
    refused(&[0; 300]).says("line 1");
}

#[test]
fn rates_no_potentiometer_is_read_at() {
    let record = |step_s: f64| {
        let rows = (0..100).map(|k| format!("{:.7},{}\n", f64::from(k) * step_s, k % 7));
        format!("time_s,yaw_deg\n{}", rows.collect::<String>())
    };
    refused(record(1.0).as_bytes()).says("sampled at 1").says("outside 20 Hz to 10 kHz");
    refused(record(1e-5).as_bytes()).says("outside 20 Hz to 10 kHz");
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
