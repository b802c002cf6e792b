//! The same kinds in other formats than text: packed numbers, tables, stamps, compressed files, pauses.

use crate::as_written::{deg, identified, printed, read, table, RATE_HZ, ROWS, WN_RAD_S};
use hdf5_pure::mat::{MatBuilder, Options};
use hdf5_pure::{AttrValue, FileBuilder};
use parquet::basic::{Compression, GzipLevel};
use parquet::data_type::{DoubleType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use std::io::Write as _;
use std::sync::Arc;
use yawrig_core::record::Record;
use yawrig_records::{Quantity, Selection};

fn times_s() -> Vec<f64> {
    (0..ROWS).map(|k| k as f64 / RATE_HZ).collect()
}

fn is_the_swing(record: &Record, error_deg: f64) {
    assert_eq!(record.len(), ROWS);
    for (k, (t, y)) in record.time_s.iter().zip(&record.yaw_deg).enumerate() {
        let expected = k as f64 / RATE_HZ;
        assert!((t - record.time_s[0] - expected).abs() < 1e-4, "{t} at {k}");
        assert!((y - deg(expected)).abs() <= error_deg, "{y} at {k}");
    }
}

#[test]
fn packed_numbers_and_tables_of_hdf5_are_what_they_stand_for() {
    let mut builder = FileBuilder::new();
    let packed: Vec<i16> =
        times_s().iter().map(|t| ((deg(*t) - 1.0) / 0.01).round() as i16).collect();
    builder
        .create_dataset("angle")
        .with_i16_data(&packed)
        .with_shape(&[ROWS as u64])
        .set_attr("scale_factor", AttrValue::F64(0.01))
        .set_attr("add_offset", AttrValue::F64(1.0))
        .set_attr("units", AttrValue::AsciiString("degrees".into()));
    builder
        .create_dataset("time")
        .with_f64_data(&times_s())
        .with_shape(&[ROWS as u64])
        .set_attr("units", AttrValue::AsciiString("seconds since 2024-01-01".into()));
    let bytes = builder.finish().expect("a file");
    is_the_swing(&read("packed.h5", &bytes, &Selection::default()).expect("a record"), 0.006);

    let rows: Vec<(f64, f64)> = times_s().into_iter().map(|t| (t, deg(t))).collect();
    let mut builder = FileBuilder::new();
    builder.create_dataset("data").with_compound_values(&rows).expect("a table");
    let bytes = builder.finish().expect("a file");
    let named = |name: &str| Some(name.to_owned());
    let chosen = Selection {
        time: named("data/0"),
        yaw: named("data/1"),
        unit: named("deg"),
        ..Selection::default()
    };
    is_the_swing(&read("table.h5", &bytes, &chosen).expect("a record"), 1e-9);
}

#[test]
fn stamps_are_read_in_their_unit_and_days_are_proposed() {
    let schema = "message record { REQUIRED INT64 time (TIMESTAMP(NANOS,false)); REQUIRED DOUBLE angle_deg; }";
    let schema = Arc::new(parse_message_type(schema).expect("a schema"));
    for compression in [Compression::GZIP(GzipLevel::default()), Compression::LZ4_RAW] {
        let properties = Arc::new(WriterProperties::builder().set_compression(compression).build());
        let mut writer =
            SerializedFileWriter::new(Vec::new(), schema.clone(), properties).expect("a writer");
        let mut group = writer.next_row_group().expect("a group");
        let stamps: Vec<i64> =
            (0..ROWS as i64).map(|k| 1_728_640_800_000_000_000 + 40_000_000 * k).collect();
        let mut column = group.next_column().expect("a column").expect("the first");
        column.typed::<Int64Type>().write_batch(&stamps, None, None).expect("room");
        column.close().expect("it ends");
        let angles: Vec<f64> = times_s().into_iter().map(deg).collect();
        let mut column = group.next_column().expect("a column").expect("the second");
        column.typed::<DoubleType>().write_batch(&angles, None, None).expect("room");
        column.close().expect("it ends");
        group.close().expect("it ends");
        let bytes = writer.into_inner().expect("a file");
        let record = read("stamps.parquet", &bytes, &Selection::default()).expect("a record");
        is_the_swing(&record, 1e-9);
    }
    let days: Vec<f64> = times_s().into_iter().map(|t| 739_536.4 + t / 86_400.0).collect();
    let angles: Vec<f64> = times_s().into_iter().map(deg).collect();
    let mut builder = MatBuilder::new(Options::default());
    for (name, values) in [("time", &days), ("angle_deg", &angles)] {
        builder.write_f64(name, &[ROWS, 1], values).expect("a variable");
    }
    let bytes = builder.finish().expect("a file");
    let error = read("days.mat", &bytes, &Selection::default()).expect_err("the unit of the time");
    assert!(error.help.contains("time_unit = d"), "{error}");
    is_the_swing(&read("days.mat", &bytes, &printed(&error)).expect("a record"), 1e-9);
}

#[test]
fn what_is_compressed_by_itself_is_read_as_what_it_holds() {
    let text = table("Time (s),Angle (deg)\n", |t, _| format!("{t:.3},{:.4}", deg(t)));
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gzip.write_all(text.as_bytes()).expect("room");
    let bytes = gzip.finish().expect("a file");
    is_the_swing(&read("r.csv.gz", &bytes, &Selection::default()).expect("a record"), 1e-4);
    let cut = read("r.csv.gz", &bytes[..bytes.len() / 2], &Selection::default());
    assert!(cut.is_err_and(|e| e.message.contains("cannot read")));
}

/// A phone's clock stands still while its experiment is paused, and the pendulum does not.
#[test]
fn a_pause_that_a_phone_notes_is_put_into_its_times() {
    let (at_s, length_s) = (6.0, 3.32);
    let text = table("\"Time (s)\",\"Angle (deg)\"\n", |t, _| {
        format!("{t:.3},{:.4}", deg(if t < at_s { t } else { t + length_s }))
    });
    let end_s = ROWS as f64 / RATE_HZ;
    let events = format!(
        "\"event\",\"experiment time\",\"system time\"\n\"START\",0.0,1.7E9\n\"PAUSE\",{at_s},1.700000006E9\n\
         \"START\",{at_s},1.70000000932E9\n\"PAUSE\",{end_s},1.700000024E9\n"
    );
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, text) in [("Raw Data.csv", text), ("meta/time.csv", events)] {
        archive.start_file(name, zip::write::SimpleFileOptions::default()).expect("an entry");
        archive.write_all(text.as_bytes()).expect("room");
    }
    let bytes = archive.finish().expect("an archive").into_inner();
    let record = read("phone.zip", &bytes, &Selection::default()).expect("a record");
    let longest = record.time_s.windows(2).map(|t| t[1] - t[0]).fold(0.0, f64::max);
    assert!((longest - length_s - 1.0 / RATE_HZ).abs() < 1e-6, "{longest}");
    let wn = identified(&record).estimates[0].natural_frequency_rad_s;
    assert!((wn.value - WN_RAD_S).abs() < 4.0 * wn.u.max(1e-3), "{wn:?}");
}

/// Tracker's own file of the points that somebody or its search marked in a film of a pendulum of 0.4 m; the pixels
/// by axes of any place, turn and scale.
fn tracker(names: &[&str], axes: usize) -> String {
    let (origin, turn, scale) = ([311.5, 42.25], 7.0f64, 512.0);
    let property = |name: &str, value: &str| {
        format!("<property name=\"{name}\" type=\"double\">{value}</property>\n")
    };
    let object = |class: &str, inside: &str| {
        format!("<object class=\"org.opensourcephysics.{class}\">\n{inside}</object>\n")
    };
    let within = |name: &str, inside: &str| {
        format!("<property name=\"{name}\" type=\"object\">\n{inside}</property>\n")
    };
    let mass = |name: &str| {
        let (sin, cos) = turn.to_radians().sin_cos();
        let marks: String = (0..ROWS)
            .filter(|k| ![100, 101].contains(k))
            .map(|k| {
                // Hanging down.
                let swing = deg(k as f64 / RATE_HZ).to_radians();
                let (x, y) = (0.4 * scale * swing.sin(), -0.4 * scale * swing.cos());
                let pixel = [origin[0] + x * cos - y * sin, origin[1] - x * sin - y * cos];
                let at =
                    property("x", &pixel[0].to_string()) + &property("y", &pixel[1].to_string());
                within(&format!("[{k}]"), &object("cabrillo.tracker.PointMass$FrameData", &at))
            })
            .collect();
        let name = format!("<property name=\"name\" type=\"string\">{name}</property>");
        within(
            "item",
            &object("cabrillo.tracker.PointMass", &(name + &within("framedata", &marks))),
        )
    };
    let of_axes: String = [
        ("xorigin", origin[0]),
        ("yorigin", origin[1]),
        ("angle", turn),
        ("xscale", scale),
        ("yscale", scale),
    ]
    .iter()
    .map(|(name, value)| property(name, &value.to_string()))
    .collect();
    let of_axes: String = (0..axes)
        .map(|k| {
            within(&format!("[{k}]"), &object("media.core.ImageCoordSystem$FrameData", &of_axes))
        })
        .collect();
    let tracks: String = names.iter().map(|name| mass(name)).collect();
    let frame = property("rate", "1.0") + &property("delta_t", "40.0");
    let inside = within("clipcontrol", &object("media.core.StepperClipControl", &frame))
        + &within("coords", &object("media.core.ImageCoordSystem", &within("framedata", &of_axes)))
        + "<property name=\"length_unit\" type=\"string\">m</property>\n"
        + &within("tracks", &tracks);
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".to_owned()
        + &object("cabrillo.tracker.TrackerPanel", &inside)
}

#[test]
fn tracker_s_points_are_read_in_its_axes_by_its_frames() {
    let named = |name: &str| Some(name.to_owned());
    let direction = Selection { yaw: named("direction"), ..Selection::default() };
    let of =
        |names: &[&str], chosen: &Selection| read("film.trk", tracker(names, 1).as_bytes(), chosen);
    let record = of(&["mass A"], &direction).expect("a record");
    assert_eq!(record.len(), ROWS - 2);
    for (t, y) in record.time_s.iter().zip(&record.yaw_deg) {
        assert!((y + 90.0 - deg(*t)).abs() < 1e-9, "{y} at {t}");
    }
    let quantity = Some(Quantity::Displacement);
    let place = Selection { yaw: named("mass B/x"), quantity, ..Selection::default() };
    let record = of(&["mass A", "mass B"], &place).expect("a record");
    for (t, x) in record.time_s.iter().zip(&record.yaw_deg) {
        assert!((x - 0.4 * deg(*t).to_radians().sin()).abs() < 1e-9, "{x} at {t}");
    }
    // What is proposed runs, and is of the swing.
    let error = of(&["mass A"], &Selection::default()).expect_err("a question");
    let found = identified(&of(&["mass A"], &printed(&error)).expect("what is printed"));
    let wn = found.estimates[0].natural_frequency_rad_s;
    assert!((wn.value - WN_RAD_S).abs() < 5e-3, "{wn}");

    let refused = |text: &str| {
        let error = read("film.trk", text.as_bytes(), &direction).expect_err("refused");
        error.to_string()
    };
    assert!(refused(&tracker(&["mass A"], 2)).contains("axes move"));
    assert!(refused(&tracker(&[], 1)).contains("no point mass"));
    let whole = tracker(&["mass A"], 1);
    assert!(refused(&whole[..whole.len() / 2]).contains("cut"));
    assert!(refused(&whole.replace("40.0", "0.0")).contains("how long a frame lasts"));
    assert!(refused(&whole.replacen("\"y\" type=\"double\">", "\"y\" type=\"double\">?", 1))
        .contains("no number"));
}
