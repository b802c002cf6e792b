//! A table in whatever dialect, with its columns in any order and number and in any unit, is read as the
//! plain file is, or refused.

use rand::seq::{IndexedRandom, SliceRandom};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use yawrig_core::record::Record;
use yawrig_records::Selection;

const TABLES: usize = 2000;
/// The least share of them that is read and not refused: what nothing can be said of is rare.
const READ: f64 = 0.95;

/// How a table is written.
struct Dialect {
    separator: &'static str,
    decimal: char,
    thousands: Option<char>,
    minus: char,
    end: &'static str,
}

impl Dialect {
    fn any(rng: &mut ChaCha8Rng) -> Self {
        let separator = *[",", ";", "\t", " "].choose(rng).expect("some");
        let decimal = if separator != "," && rng.random_bool(0.4) { ',' } else { '.' };
        let other = if decimal == ',' { '.' } else { ',' };
        Self {
            separator,
            decimal,
            thousands: rng.random_bool(0.3).then_some(other),
            minus: if rng.random_bool(0.2) { '\u{2212}' } else { '-' },
            end: if rng.random_bool(0.3) { "\r\n" } else { "\n" },
        }
    }

    fn number(&self, value: f64, decimals: usize) -> String {
        let text = format!("{:.decimals$}", value.abs());
        let (whole, rest) = text.split_once('.').unwrap_or((&text, ""));
        let mut out = String::new();
        if value < 0.0 {
            out.push(self.minus);
        }
        for (k, digit) in whole.chars().enumerate() {
            if let Some(sign) = self.thousands.filter(|_| k > 0 && (whole.len() - k) % 3 == 0) {
                out.push(sign);
            }
            out.push(digit);
        }
        if decimals > 0 {
            out.push(self.decimal);
            out.push_str(rest);
        }
        self.field(out)
    }

    /// In quotes where it would be parted.
    fn field(&self, text: String) -> String {
        match text.contains(self.separator) {
            true => format!("\"{text}\""),
            false => text,
        }
    }
}

/// A table and what it holds, or nothing where the plain file would be refused, too.
struct Written {
    text: String,
    time_s: Vec<f64>,
    yaw_deg: Vec<f64>,
    /// What its last digits leave open.
    off_s: f64,
    off_deg: f64,
}

/// Unit, seconds or degrees in one, and decimals that keep the table's digits.
type Unit = (&'static str, f64, usize);
const TIMES: [Unit; 6] = [
    ("s", 1.0, 4),
    ("ms", 1e-3, 1),
    ("us", 1e-6, 0),
    ("ns", 1e-9, 0),
    ("min", 60.0, 8),
    ("h", 3600.0, 9),
];
const ANGLES: [Unit; 6] = [
    ("deg", 1.0, 3),
    ("rad", 180.0 / std::f64::consts::PI, 5),
    ("mrad", 0.18 / std::f64::consts::PI, 2),
    ("arcmin", 1.0 / 60.0, 1),
    ("gon", 0.9, 3),
    ("turns", 360.0, 6),
];

fn written(rng: &mut ChaCha8Rng) -> Written {
    let dialect = Dialect::any(rng);
    let rate_hz = *[10.0, 25.0, 50.0, 100.0, 200.0].choose(rng).expect("some");
    let rows = rng.random_range(40..160);
    let (from_s, zero_deg) = (f64::from(rng.random_range(0..3)), rng.random_range(-20.0..20.0));
    let time_s: Vec<f64> = (0..rows).map(|k| from_s + k as f64 / rate_hz).collect();
    let yaw_deg: Vec<f64> = (0..rows)
        .map(|k| zero_deg + 12.0 * (-0.01 * k as f64).exp() * (0.4 * k as f64).cos())
        .collect();
    let of_time = *TIMES.choose(rng).expect("some");
    let of_yaw = *ANGLES.choose(rng).expect("some");
    let named = |rng: &mut ChaCha8Rng, words: &[&str], (unit, ..): Unit, is_alone: bool| {
        let word = *words.choose(rng).expect("some");
        match rng.random_range(0..4) {
            0 => format!("{word} ({unit})"),
            1 => format!("{word} [{unit}]"),
            2 if is_alone => format!("{word}/{unit}"),
            _ => format!("{word}_{unit}"),
        }
    };
    let dates = of_time.0 == "s" && rng.random_bool(0.2);
    let time_name = match dates {
        true => "timestamp".to_owned(),
        false => named(rng, &["Time", "t", "Zeit", "elapsed"], of_time, true),
    };
    let yaw_name = named(rng, &["Yaw", "yaw", "Gierwinkel", "psi"], of_yaw, true);
    let mut columns: Vec<(String, Vec<String>)> = Vec::new();
    let sign = if rng.random_bool(0.15) && of_yaw.0 == "deg" { "\u{b0}" } else { "" };
    let angle = |y: &f64| format!("{}{sign}", dialect.number(y / of_yaw.1, of_yaw.2));
    let mut yaw: Vec<String> = yaw_deg.iter().map(angle).collect();
    let clock = |t: &f64| match dates {
        // Begun shortly before midnight.
        true => {
            let s = 23.0 * 3600.0 + 59.0 * 60.0 + 59.0 + t;
            let (day, s) = (1 + (s / 86_400.0) as u32, s % 86_400.0);
            let (h, m) = ((s / 3600.0) as u32, (s % 3600.0 / 60.0) as u32);
            let dated = format!("2026-03-{day:02} {h:02}:{m:02}:{:06.3}", s % 60.0 + 1e-9);
            dialect.field(dated)
        }
        false => dialect.number(t / of_time.1, of_time.2),
    };
    let time: Vec<String> = time_s.iter().map(clock).collect();
    // A gap is left out with its row.
    let mut kept: Vec<bool> = vec![true; rows];
    if dialect.separator != " " && rng.random_bool(0.3) {
        let gap = rng.random_range(5..rows - 5);
        (yaw[gap], kept[gap]) =
            ((*["", "NaN", "n/a"].choose(rng).expect("some")).to_owned(), false);
    }
    columns.push((time_name, time));
    columns.push((yaw_name, yaw));
    for k in 0..rng.random_range(0..4) {
        let name = ["Load (N)", "Run 2 Force (N)", "V_S", "Sensor 3"][k];
        let values =
            (0..rows).map(|row| dialect.number((row * 7 % 1300) as f64 - 20.0, k)).collect();
        columns.push((name.to_owned(), values));
    }
    columns.shuffle(rng);
    let mut text = String::new();
    if rng.random_bool(0.2) {
        text.push('\u{feff}');
    }
    for line in ["Rig 2, spring K3", "Operator: N. N.", "# exported 2026-03-01"] {
        if rng.random_bool(0.2) {
            text += &format!("{line}{}", dialect.end);
        }
    }
    // A name with a blank is in quotes where blanks part the columns.
    let names: Vec<String> =
        columns.iter().map(|(name, _)| dialect.field(name.clone()).replace("\" ", " ")).collect();
    let separator = if dialect.separator == " " { "  " } else { dialect.separator };
    let names = names.iter().map(|name| name.trim_matches('"').to_owned()).collect::<Vec<_>>();
    if rng.random_bool(0.15) {
        text += "# ";
    }
    text += &(names.join(separator) + dialect.end);
    let tail =
        if dialect.separator != " " && rng.random_bool(0.2) { dialect.separator } else { "" };
    for row in 0..rows {
        let fields: Vec<&str> = columns.iter().map(|(_, values)| values[row].as_str()).collect();
        text += &(fields.join(separator) + tail + dialect.end);
    }
    let of =
        |values: &[f64]| values.iter().zip(&kept).filter(|(_, k)| **k).map(|(v, _)| *v).collect();
    let last = |(_, size, decimals): Unit| 0.6 * size * 10f64.powi(-(decimals as i32));
    Written {
        text,
        time_s: of(&time_s),
        yaw_deg: of(&yaw_deg),
        // Of rounded stamps the even clock behind them is read.
        off_s: if dates { 0.7e-3 } else { 2.0 * last(of_time) + 1e-6 },
        off_deg: last(of_yaw) + 1e-9,
    }
}

/// What is wrong with `record`; nothing where it is what was written.
fn difference(record: &Record, of: &Written) -> Option<String> {
    if record.len() != of.time_s.len() {
        return Some(format!("{} samples of {}", record.len(), of.time_s.len()));
    }
    let since = |times: &[f64], k: usize| times[k] - times[0];
    // Whole turns are no angle of their own.
    let turns = ((record.yaw_deg[0] - of.yaw_deg[0]) / 360.0).round() * 360.0;
    (0..record.len()).find_map(|k| {
        let (t, y) = (since(&record.time_s, k), record.yaw_deg[k] - turns);
        let (t0, y0) = (since(&of.time_s, k), of.yaw_deg[k]);
        let is_off = (t - t0).abs() > 2.0 * of.off_s || (y - y0).abs() > of.off_deg;
        is_off.then(|| format!("sample {k}: {t} s, {y} deg, not {t0} s, {y0} deg"))
    })
}

#[test]
fn a_table_in_any_dialect_is_read_as_the_plain_file_or_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut refused = Vec::new();
    for seed in 0..TABLES {
        let table = written(&mut ChaCha8Rng::seed_from_u64(seed as u64));
        let file = folder.path().join(format!("{seed}.txt"));
        std::fs::write(&file, &table.text).expect("room for it");
        match yawrig_records::read_selected(&file, &Selection::default()) {
            Ok(record) => {
                if let Some(what) = difference(&record, &table) {
                    let head: Vec<&str> = table.text.lines().take(7).collect();
                    if let Ok(to) = std::env::var("YAWRIG_KEEP") {
                        std::fs::write(to, &table.text).expect("room for it");
                    }
                    panic!("table {seed}: {what}\n{}", head.join("\n"));
                }
            }
            Err(error) => refused.push((seed, error)),
        }
        std::fs::remove_file(&file).expect("it was there");
    }
    for (seed, error) in refused.iter().take(5) {
        println!("{seed}: {error}");
    }
    println!("{} of {TABLES} refused", refused.len());
    assert!((refused.len() as f64) < (1.0 - READ) * TABLES as f64, "{} refused", refused.len());
}
