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
use yawrig_records::Selection;

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
