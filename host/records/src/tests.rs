use std::path::PathBuf;
use yawrig_base::error::Exit;
use yawrig_core::record::Record;

fn file_with(bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("release.csv");
    std::fs::write(&file, bytes).unwrap();
    (folder, file)
}

/// A good record of `rows` rows at 100 Hz with `line` (counted from 1) replaced.
fn with_line(rows: usize, line: usize, text: &str) -> String {
    let mut lines = vec!["time_s,yaw_deg".to_owned()];
    lines.extend((0..rows).map(|i| format!("{:.2},{}", i as f64 * 0.01, i % 7)));
    lines[line - 1] = text.to_owned();
    lines.join("\n") + "\n"
}

fn refused(content: impl AsRef<[u8]>, line: Option<usize>, words: &str) {
    let (_folder, file) = file_with(content.as_ref());
    let error = crate::read(&file).unwrap_err();
    assert_eq!(error.exit, Exit::Data);
    assert!(error.message.contains("release.csv"), "{error}");
    if let Some(line) = line {
        assert!(error.message.contains(&format!("line {line}:")), "{error}");
    }
    assert!(error.message.contains(words), "{error} does not say {words:?}");
    assert!(!error.help.is_empty());
}

#[test]
fn bad_files_are_refused_by_file_and_line() {
    refused("", Some(1), "empty");
    refused("\n\n", Some(1), "empty");
    refused("time_s,yaw_deg\n", Some(1), "too short");
    refused(with_line(5, 1, "time_s,yaw_deg"), Some(6), "too short");
    refused(with_line(50, 1, "time_s,yaw_mrad"), Some(1), "yaw_mrad");
    refused(with_line(50, 1, "0.00,1.0"), None, "column 2 (51 numbers)");
    refused(with_line(50, 7, "0.05,abc"), Some(7), "\"abc\" is not a number");
    refused(with_line(50, 7, "0.05,NaN"), Some(7), "finite");
    refused(with_line(50, 7, "0.05,-inf"), Some(7), "finite");
    refused(with_line(50, 7, "0.05,1e999"), Some(7), "finite");
    refused(with_line(50, 7, "0,05,1,2"), Some(7), "4 fields");
    refused(with_line(50, 7, "0.03,1.0"), Some(7), "backwards");
    refused(
        [b"time_s,yaw_deg\n0.0,1\n0.01,\xff\xfe\n".as_slice(), b"0.02,1\n"].concat(),
        Some(3),
        "number",
    );
    refused(vec![0u8, 159, 146, 150, 10, 7, 0, 0], None, "neither text nor of a format");
    refused(vec![1u8, 159, 146, 150, 10, 7], None, "no columns of numbers");
}

#[test]
fn an_empty_cell_is_a_gap_and_the_second_of_two_with_one_time_stamp_is_left_out() {
    for line in ["0.05,", "0.04,6.0"] {
        let (_folder, file) = file_with(with_line(50, 7, line).as_bytes());
        let record = crate::read(&file).unwrap();
        assert_eq!(record.len(), 49, "{line}");
        assert!((record.time_s[5] - 0.06).abs() < 1e-12, "{line}");
    }
}

#[test]
fn a_missing_file_and_a_folder_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for file in [folder.path().to_owned(), folder.path().join("absent.csv")] {
        let error = crate::read(&file).unwrap_err();
        assert_eq!(error.exit, Exit::Data);
        assert!(error.message.contains(&file.display().to_string()));
    }
}

#[test]
fn radians_byte_order_mark_spaces_and_crlf_are_understood() {
    let mut text = "\u{feff}time_s, yaw_rad\r\n".to_owned();
    for i in 0..20 {
        text += &format!(" {:.3} , 0.1\r\n", f64::from(i) * 0.001);
    }
    let (_folder, file) = file_with(text.as_bytes());
    let record = crate::read(&file).unwrap();
    assert_eq!(record.len(), 20);
    assert!((record.yaw_deg[3] - 5.729_577_951).abs() < 1e-8);
}

#[test]
fn irregular_time_stamps_are_accepted() {
    let (_folder, file) = file_with(with_line(50, 7, "0.0567,1.0").as_bytes());
    let record = crate::read(&file).unwrap();
    assert!((record.time_s[5] - 0.0567).abs() < 1e-12);
    assert!(!record.timing().is_regular());
}

#[test]
fn what_is_written_is_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("release.csv");
    let record = Record::new(
        &file,
        (0..100).map(|i| f64::from(i) * 1e-3).collect(),
        (0..100).map(|i| (f64::from(i) * 0.1).sin() - 3.25).collect(),
    );
    crate::write(&record, &file).unwrap();
    let again = crate::read(&file).unwrap();
    for (a, b) in record.yaw_deg.iter().zip(&again.yaw_deg) {
        assert!((a - b).abs() <= 0.5e-6);
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file stays");
    assert!(crate::write(&record, &folder.path().join("absent/release.csv")).is_err());
}

#[test]
fn one_column_under_a_line_of_settings_is_read_with_its_rate() {
    let rows: String = (0..50).map(|k| format!("{}.5\n", k % 7)).collect();
    let (_folder, file) = file_with(format!("45, 1000, 5\n{rows}").as_bytes());
    let selection = crate::Selection {
        yaw: Some("1".to_owned()),
        rate_hz: Some(1000.0),
        unit: Some("deg".to_owned()),
        ..crate::Selection::default()
    };
    let record = crate::read_selected(&file, &selection).unwrap();
    assert_eq!(record.len(), 50);
    assert!((record.time_s[49] - 0.049).abs() < 1e-12 && record.yaw_deg[8] == 1.5);
}

#[test]
fn dates_of_both_orders_keep_the_milliseconds_of_their_times() {
    for date in ["2026-11-24T", "24.11.2026 "] {
        let row = |k: usize| format!("{date}10:00:{:06.3};{}\n", k as f64 * 1e-3, k % 7);
        let rows: String = (0..2000).map(row).collect();
        let (_folder, file) = file_with(format!("time;yaw_deg\n{rows}").as_bytes());
        let record = crate::read(&file).unwrap();
        let rate_hz = record.timing().rate_hz;
        assert!((rate_hz - 1000.0).abs() < 0.01, "{date}: {rate_hz}");
    }
}

#[test]
fn a_part_is_named_by_its_times() {
    let (_folder, file) = file_with(with_line(50, 1, "time_s,yaw_deg").as_bytes());
    let between = |from_s, to_s| {
        let times = crate::place::Times { from_s, to_s };
        crate::read(&crate::place::with_part(&file, crate::place::Part::Between(times)))
    };
    let part = between(Some(0.1), Some(0.3)).unwrap();
    assert_eq!((part.time_s[0], part.len()), (0.1, 21));
    assert!(part.file.to_string_lossy().ends_with("release.csv#0.1s..0.3s"));
    for (from_s, to_s) in [(Some(0.6), None), (None, Some(-1.0)), (Some(0.2), Some(0.22))] {
        let error = between(from_s, to_s).unwrap_err();
        assert_eq!(error.exit, Exit::Data);
        assert!(error.help.contains("between 0.000 and 0.490"), "{error}");
    }
}
