//! Records in the formats a rig's users have, written by other programs: `tests/data/formats/make.py`.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Exit};
use yawrig_core::record::Record;
use yawrig_records::Selection;

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/formats").join(name)
}

fn selection(time: &str, yaw: &str, unit: Option<&str>) -> Selection {
    let named = |name: &str| (!name.is_empty()).then(|| name.to_owned());
    let unit = unit.map(str::to_owned);
    Selection { time: named(time), yaw: named(yaw), unit, ..Selection::default() }
}

/// The free decay that `make.py` writes, by its formula.
fn is_the_swing(record: &Record, sign: f64, offset_s: f64, error_deg: f64) {
    assert_eq!(record.len(), 300);
    for (index, (time_s, yaw_deg)) in record.time_s.iter().zip(&record.yaw_deg).enumerate() {
        let t = index as f64 / 100.0;
        assert!((time_s - t - offset_s).abs() < 1e-12, "{time_s} at {index}");
        let expected = sign * (8.0 * (-0.1 * t).exp() * (2.5 * PI * t).cos() + 0.5);
        assert!((yaw_deg - expected).abs() < error_deg, "{yaw_deg} {expected} at {index}");
    }
}

/// Whole numbers of the last digit that a double of this size has, and a single.
const DOUBLE: f64 = 1e-13;
const SINGLE: f64 = 1e-6;

#[test]
fn names_that_say_what_they_are_need_no_flag() {
    for (name, error_deg) in [
        ("v5.mat", DOUBLE),
        ("v73.mat", DOUBLE),
        ("octave-struct.mat", DOUBLE),
        ("new.h5", 30.0 * SINGLE),
        ("chunks.tdms", SINGLE),
        ("interleaved.tdms", DOUBLE),
        ("snappy.parquet", DOUBLE),
        ("until-2003.xls", DOUBLE),
        ("sheet.ods", DOUBLE),
    ] {
        println!("{name}");
        let record = yawrig_records::read(&file(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        is_the_swing(&record, 1.0, 0.0, error_deg);
    }
}

/// A matrix by its columns, structures by the path of a field.
#[test]
fn matrices_and_structures_of_octave_are_read() {
    let columns = selection("data(:,1)", "data(:,2)", Some("rad"));
    is_the_swing(
        &yawrig_records::read_selected(&file("octave-matrix.mat"), &columns).unwrap(),
        1.0,
        0.0,
        DOUBLE,
    );
    let field = selection("run/sensor/time_s", "run/sensor/yaw_deg", None);
    is_the_swing(
        &yawrig_records::read_selected(&file("octave-struct.mat"), &field).unwrap(),
        1.0,
        0.0,
        DOUBLE,
    );
    for (run, sign) in [(1, 1.0), (2, -1.0)] {
        let field =
            selection(&format!("runs({run})/time_s"), &format!("runs({run})/yaw_deg"), None);
        is_the_swing(
            &yawrig_records::read_selected(&file("octave-structs.mat"), &field).unwrap(),
            sign,
            0.0,
            DOUBLE,
        );
    }
    let error = refused("octave-structs.mat", &Selection::default());
    for words in ["runs(1)/yaw_deg", "runs(2)/yaw_deg"] {
        assert!(error.to_string().contains(words), "{error}");
    }
    let error = refused("octave-matrix.mat", &Selection::default());
    assert!(error.to_string().contains("data(:,2) (300 numbers)"), "{error}");
}

/// Cells by their number, a matrix on its side by its rows.
#[test]
fn cells_and_matrices_on_their_side_are_read() {
    for (time, yaw, unit, sign) in [
        ("runs{1}(:,1)", "runs{1}(:,2)", "deg", 1.0),
        ("runs{2}(1,:)", "runs{2}(2,:)", "deg", -1.0),
        ("wide(1,:)", "wide(2,:)", "rad", 1.0),
        ("5", "6", "rad", 1.0),
    ] {
        let chosen = selection(time, yaw, Some(unit));
        let record = yawrig_records::read_selected(&file("cells.mat"), &chosen);
        is_the_swing(&record.unwrap_or_else(|e| panic!("{yaw}: {e}")), sign, 0.0, DOUBLE);
    }
    let error = refused("cells.mat", &Selection::default()).to_string();
    // Whichever it is, with its own time, as settings: the program spells them as flags.
    let pairs = [
        "time = runs{1}(:,1), yaw = runs{1}(:,2), unit = deg",
        "time = runs{2}(1,:), yaw = runs{2}(2,:), unit = deg",
        "time = wide(1,:), yaw = wide(2,:), unit = rad",
    ];
    assert!(pairs.iter().any(|pair| error.contains(pair)), "{error}");
}

#[test]
fn the_format_is_what_the_file_holds_and_not_what_it_is_called() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["v5.mat", "v73.mat", "chunks.tdms", "snappy.parquet", "new.h5"] {
        let other = folder.path().join("record.csv");
        std::fs::copy(file(name), &other).unwrap();
        is_the_swing(&yawrig_records::read(&other).unwrap(), 1.0, 0.0, 30.0 * SINGLE);
    }
}

#[test]
fn flags_choose_channels_and_units() {
    let read = |name, selection: &Selection| yawrig_records::read_selected(&file(name), selection);
    let compressed = selection("t", "theta", Some("rad"));
    let record = read("v5-compressed.mat", &compressed).unwrap();
    is_the_swing(&record, 1.0, 0.0, 30.0 * SINGLE);

    // The unit stands in the file; the group tells two of a name apart, and takes its own time.
    let record = read("groups.h5", &selection("run2/time_s", "run2/theta", None)).unwrap();
    is_the_swing(&record, -1.0, 0.0, DOUBLE);
    let record = read("groups.h5", &selection("", "run1/theta", None)).unwrap();
    is_the_swing(&record, 1.0, 0.0, DOUBLE);

    // The channel says its own step and unit, and what it is.
    for chosen in [selection("", "Yaw", None), Selection::default()] {
        is_the_swing(&read("waveform.tdms", &chosen).unwrap(), 1.0, 0.0, DOUBLE);
    }
    // A row without a number is a gap.
    let holes = read("zstd.parquet", &selection("t", "holes", Some("deg"))).unwrap();
    assert_eq!(holes.len(), 299);

    let record = read("zstd.parquet", &selection("t", "angle", Some("rad"))).unwrap();
    is_the_swing(&record, 1.0, 0.0, 30.0 * SINGLE);
    let by_rate =
        Selection { time: None, rate_hz: Some(100.0), ..selection("", "angle", Some("rad")) };
    is_the_swing(&read("zstd.parquet", &by_rate).unwrap(), 1.0, 0.0, 30.0 * SINGLE);
}

fn refused(name: &str, selection: &Selection) -> Error {
    let error = yawrig_records::read_selected(&file(name), selection).unwrap_err();
    assert_eq!(error.exit, Exit::Data, "{error}");
    assert!(error.message.contains(name) && !error.help.is_empty(), "{error}");
    error
}

#[test]
fn what_is_unclear_is_asked_and_never_guessed() {
    let none = Selection::default();
    let says = |error: Error, words: &[&str]| {
        let all = error.to_string();
        words.iter().for_each(|words| assert!(all.contains(words), "{words:?} not in {all}"));
    };
    // Which channel: those there are, and what to type.
    says(
        refused("v5-compressed.mat", &none),
        &[
            "t (300 numbers)",
            "theta (300 numbers)",
            "both(:,2) (300 numbers)",
            "yaw = theta, unit = rad",
        ],
    );
    // Which unit.
    let error = refused("v5-compressed.mat", &selection("t", "theta", None));
    says(error, &["theta", "unknown unit", "yaw = theta, unit = rad"]);
    // Which unit, of a time that is found by its name.
    let error = refused("zstd.parquet", &selection("", "angle", None));
    says(error, &["unknown unit", "time = t,", "yaw = angle"]);
    // Two of one name.
    let error = refused("groups.h5", &selection("", "theta", None));
    says(error, &["several channels", "run1/theta", "run2/theta", "yaw = run1/theta"]);
    // A name that is not there, a text.
    says(refused("v5.mat", &selection("", "yaw", None)), &["no channel \"yaw\"", "yaw_deg"]);
    says(refused("snappy.parquet", &selection("", "spring", Some("deg"))), &["spring"]);
    // What the file says stands against the flag.
    says(refused("groups.h5", &selection("", "run1/theta", Some("deg"))), &["rad", "deg"]);
    says(refused("v5.mat", &selection("", "", Some("rad"))), &["yaw_deg", "rad"]);
    // Milliseconds without a unit: 0.1 Hz is hardly the rate of a record.
    let error = refused("zstd.parquet", &selection("ms", "angle", Some("rad")));
    says(error, &["the unit of the time in ms is not known"]);
}

#[test]
fn raw_numbers_of_a_scaled_channel_are_refused() {
    let error = refused("scaled.tdms", &Selection::default());
    assert!(error.message.contains("NI_Scale") && error.message.contains("yaw_deg"), "{error}");
}

#[test]
fn a_file_cut_short_is_refused_or_read_as_far_as_it_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    for name in [
        "v5.mat",
        "v73.mat",
        "octave-struct.mat",
        "new.h5",
        "chunks.tdms",
        "snappy.parquet",
        "waveform.tdms",
    ] {
        let whole = std::fs::read(file(name)).unwrap();
        for share in 1..20 {
            let cut = folder.path().join(name);
            std::fs::write(&cut, &whole[..whole.len() * share / 20]).unwrap();
            let selection = selection("", if name == "waveform.tdms" { "Yaw" } else { "" }, None);
            match yawrig_records::read_selected(&cut, &selection) {
                Err(error) => assert_eq!(error.exit, Exit::Data, "{name} {share}: {error}"),
                // What was cut off was no part of the record.
                Ok(record) => is_the_swing(&record, 1.0, 0.0, 30.0 * SINGLE),
            }
        }
    }
}

#[test]
fn what_is_written_is_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let record = yawrig_records::read(&file("snappy.parquet")).unwrap();
    for (name, error) in
        [("r.csv", 1e-6), ("r.parquet", 0.0), ("r.h5", 0.0), ("r.mat", 0.0), ("r.HDF5", 0.0)]
    {
        let file = folder.path().join(name);
        yawrig_records::write_as(&record, &file).unwrap();
        let back = yawrig_records::read(&file).unwrap();
        assert_eq!(back.len(), record.len());
        for (a, b) in back.yaw_deg.iter().zip(&record.yaw_deg) {
            assert!((a - b).abs() <= error, "{name}");
        }
        for (a, b) in back.time_s.iter().zip(&record.time_s) {
            assert!((a - b).abs() <= error, "{name}");
        }
    }
    for name in ["r.tdms", "r.xls", "r"] {
        let error = yawrig_records::write_as(&record, &folder.path().join(name)).unwrap_err();
        assert_eq!(error.exit, Exit::Usage);
        assert!(!folder.path().join(name).exists());
    }
}
