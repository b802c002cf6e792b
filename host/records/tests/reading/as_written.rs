//! Files as people's programs write them: read right at once, or by the one command that is printed, or the
//! right thing is asked.

use std::fmt::Write as _;
use std::path::Path;
use yawrig_base::error::Error;
use yawrig_core::identify::flag::Flag;
use yawrig_core::identify::{identify, Identification, Method, Settings};
use yawrig_core::record::Record;
use yawrig_records::{Quantity, Selection, TimeUnit};

pub const WN_RAD_S: f64 = 7.5;
pub const RATE_HZ: f64 = 25.0;
pub const ROWS: usize = 500;

/// The angle at `t`: held until 1 s, then a free decay, with noise of 0.02 deg.
pub fn deg(t: f64) -> f64 {
    let noise = 0.02 * (997.0 * t * t + 3.0 * t).sin();
    let free = (t - 1.0).max(0.0);
    12.0 * (-0.09 * free).exp() * (WN_RAD_S * free).cos() + noise
}

/// `head`, then a row of each sample.
pub fn table(head: &str, row: impl Fn(f64, usize) -> String) -> String {
    let mut text = head.to_owned();
    for k in 0..ROWS {
        let _ = writeln!(text, "{}", row(k as f64 / RATE_HZ, k));
    }
    text
}

/// With commas between thousands.
fn grouped(number: f64, decimals: usize) -> String {
    let text = format!("{:.decimals$}", number.abs());
    let (whole, rest) = text.split_at(text.find('.').unwrap_or(text.len()));
    let mut out = String::new();
    for (k, digit) in whole.chars().enumerate() {
        if k > 0 && (whole.len() - k) % 3 == 0 {
            out.push(',');
        }
        out.push(digit);
    }
    let sign = if number < 0.0 { "-" } else { "" };
    format!("{sign}{out}{rest}")
}

/// What is printed where a file does not say what it holds, as a selection.
pub fn printed(error: &Error) -> Selection {
    let help = &error.help;
    let settings =
        help.split_once(" with ").expect("settings").1.split("   (").next().expect("them");
    let mut chosen = Selection::default();
    for setting in settings.split(", ") {
        let (name, value) =
            setting.split_once(" = ").unwrap_or_else(|| panic!("{setting} in {help}"));
        let text = Some(value.to_owned());
        match name {
            "time" => chosen.time = text,
            "yaw" => chosen.yaw = text,
            "unit" => chosen.unit = text,
            "time_unit" => {
                chosen.time_unit = Some(TimeUnit::try_from(value.to_owned()).expect("a unit"))
            }
            "quantity" => {
                chosen.quantity = Some(match value {
                    "displacement" => Quantity::Displacement,
                    "rate" => Quantity::Rate,
                    "acceleration" => Quantity::Acceleration,
                    _ => Quantity::Angle,
                });
            }
            // A placeholder never runs: its user puts the rate there.
            "rate_hz" if value == "HZ" => chosen.rate_hz = Some(RATE_HZ),
            "rate_hz" => chosen.rate_hz = Some(value.parse().expect("a rate")),
            other => panic!("{other} in {help}"),
        }
    }
    chosen
}

pub fn identified(record: &Record) -> Identification {
    identify(record, &[Method::LeastSquares], &Settings::default()).expect("a decay")
}

pub fn read(name: &str, bytes: &[u8], selection: &Selection) -> Result<Record, Error> {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join(name);
    std::fs::write(&file, bytes).expect("room for it");
    yawrig_records::read_selected(Path::new(&file), selection)
}

fn is_right(name: &str, record: &Record, wn: f64) {
    let found = identified(record);
    let q = found.estimates[0].natural_frequency_rad_s;
    println!("{name}: {:.4} ± {:.4}", q.value, q.u);
    assert!((q.value - wn).abs() < 4.0 * q.u.max(1e-3), "{name}: {} ± {}", q.value, q.u);
}

#[test]
fn what_says_what_it_is_is_read_at_once() {
    let day = |k: usize| (k / 25, 40 * (k % 25));
    let files: Vec<(&str, String)> = vec![
        (
            "minutes.csv",
            table("Time (min),Angle (deg)\n", |t, _| format!("{:.9},{:.3}", t / 60.0, deg(t))),
        ),
        (
            "thousands of ms.csv",
            table("Time (ms),Angle (deg)\n", |t, _| {
                format!("\"{}\",{:.3}", grouped(1000.0 * t, 1), deg(t))
            }),
        ),
        (
            "trailing.csv",
            table("Index;Time (s);Angle (deg)\n", |t, k| format!("{k};{t:.3};{:.3};", deg(t))),
        ),
        (
            "own clocks.csv",
            table("Time (s),Load (N),Time (s),Angle (deg)\n", |t, _| {
                format!("{:.3},3.0,{t:.3},{:.3}", t / 2.0, deg(t))
            }),
        ),
        (
            "epoch.csv",
            table("timestamp_ns,angle_deg\n", |t, k| {
                format!("{},{:.3}", 1_486_500_000_000_000_000u64 + 40_000_000 * k as u64, deg(t))
            }),
        ),
        (
            "comment.txt",
            table("# run : 7\n# Time (s)  sum (V)  angle (deg)\n", |t, _| {
                format!("{t:.2}  5.0  {:.4}", deg(t))
            }),
        ),
        (
            "US dates.csv",
            table("time,angle_deg\n", |t, k| {
                let (s, ms) = day(k);
                format!("5/7/2021  12:32:{:02}.{ms:03}000,{:.4}", s, deg(t))
            }),
        ),
        (
            "colons.csv",
            table("RX Date/Time,Angle (deg)\n", |t, k| {
                let (s, ms) = day(k);
                format!("2024/10/11 10:00:{s:02}::{ms:03},{:.3}", deg(t))
            }),
        ),
        (
            "durations.csv",
            table("time,angle_deg\n", |t, k| {
                let (s, ms) = day(k);
                format!("0 days 00:00:{s:02}.{ms:03}000,{:.3}", deg(t))
            }),
        ),
        (
            "midnight.csv",
            table("time,angle_deg\n", |t, k| {
                let (s, ms) = day(k);
                match s {
                    0..10 => format!("11:59:{:02}.{ms:03} PM,{:.3}", 50 + s, deg(t)),
                    _ => format!("12:00:{:02}.{ms:03} AM,{:.3}", s - 10, deg(t)),
                }
            }),
        ),
        ("degree signs.csv", table("t (s),Winkel\n", |t, _| format!("{t:.3},{:.3}°", deg(t)))),
        (
            "true minus.csv",
            table("Time (s),Angle (deg)\n", |t, _| {
                format!("{t:.3},{:.3}", deg(t)).replace('-', "\u{2212}")
            }),
        ),
        (
            "units in a row.csv",
            table("Time;Angle\ns;deg\n", |t, _| format!("{t:.3};{:.3}", deg(t)).replace('.', ",")),
        ),
    ];
    for (name, text) in files {
        let record = read(name, text.as_bytes(), &Selection::default());
        let record = record.unwrap_or_else(|e| panic!("{name}: {e}"));
        is_right(name, &record, WN_RAD_S);
    }
}

#[test]
fn what_is_asked_is_answered_by_the_command_that_is_printed() {
    let frames: Vec<usize> = (0..ROWS).filter(|k| k % 25 > 1).collect();
    let frames = frames.iter().fold("frame,angle (deg)\n".to_owned(), |text, k| {
        format!("{text}{k},{:.3}\n", deg(*k as f64 / RATE_HZ))
    });
    let two = |t: f64, of: f64| {
        format!("{t:.3}\t{:.4}\t{:.3}\t{:.4}", 0.1 * (of * 9.0).sin(), t + 0.5, deg(t))
    };
    let files: Vec<(&str, String, &str)> = vec![
        ("frames.csv", frames, "yaw = angle (deg)"),
        (
            "two clocks.txt",
            table("Time A\tPos A\tTime B\tPos B\n", |t, k| two(t, (k * k) as f64)),
            "time = Time B",
        ),
        (
            "axes.txt",
            table("\"Time (s)\"\t\"Gyroscope x (rad/s)\"\t\"Gyroscope y (rad/s)\"\n", |t, _| {
                format!("{t:.3}\t{:.5}\t{:.5}", 0.1 * deg(t), deg(t))
            }),
            "yaw = Gyroscope y (rad/s)",
        ),
        (
            "unit in the middle.csv",
            table("Time (s),Position (mm) Run #1\n", |t, _| format!("{t:.3},{:.4}", deg(t))),
            "quantity = displacement",
        ),
        (
            "V_S.csv",
            table("time,V_S,V_C\n", |t, _| format!("{t:.3},0.001,{:.4}", deg(t))),
            "yaw = V_C",
        ),
        (
            "micrometres.txt",
            table("Time (s)\tDisplacement (um)\n", |t, _| {
                format!("{t:.3}\t{}", grouped(200.0 * deg(t), 0))
            }),
            "quantity = displacement",
        ),
        (
            "tuples.csv",
            table("position,time,speed\n", |t, k| {
                format!("\"({}, 685)\",{t:.3},{:.3}", 1500 - (k * 7919) % 5, deg(t))
            }),
            "yaw = speed",
        ),
        ("labels.txt", table("", |t, _| format!("t:{t:.3} swing:{:.3}", deg(t))), "yaw = swing"),
        (
            "counts.csv",
            table("Time (s),Angle (counts)\n", |t, _| {
                let counts = (deg(t) * 4096.0 / 360.0).round() as i64 + 60;
                format!("{t:.3},{}", counts.rem_euclid(4096))
            }),
            "yaw = \"Angle (counts)\" * 360 / 4096",
        ),
        (
            "decimal commas.csv",
            table("\u{feff}\"Position (mm) Run #1\"\n", |t, _| {
                format!("{:.4}", deg(t) + 30.0).replace('.', ",")
            }),
            "rate_hz = HZ",
        ),
    ];
    for (name, text, says) in files {
        let error = read(name, text.as_bytes(), &Selection::default()).expect_err(name);
        assert!(error.help.contains(says), "{name}: {error}");
        let record = read(name, text.as_bytes(), &printed(&error));
        is_right(name, &record.unwrap_or_else(|e| panic!("{name}: {e}")), WN_RAD_S);
    }
}

#[test]
fn what_cannot_be_known_is_asked_and_names_are_kept() {
    let of = |of: f64, rate_hz: f64, wn: f64, k: usize| {
        let t = k as f64 / rate_hz;
        format!("{t:.3}\t{:.3}", of + deg(t * wn / WN_RAD_S))
    };
    let runs =
        table("Run 1 Time (s)\tRun 1 Angle (deg)\tRun 2 Time (s)\tRun 2 Angle (deg)\n", |_, k| {
            format!("{}\t{}", of(0.0, 25.0, 7.5, k), of(2.0, 50.0, 6.0, k))
        });
    let error = read("runs.txt", runs.as_bytes(), &Selection::default()).expect_err("which run");
    assert!(error.message.contains("Run 1 Angle (deg) (500 numbers, deg)"), "{error}");
    for (yaw, wn) in [("Run 1 Angle (deg)", 7.5), ("Run 2 Angle (deg)", 6.0)] {
        let chosen = Selection { yaw: Some(yaw.to_owned()), ..Selection::default() };
        is_right(yaw, &read("runs.txt", runs.as_bytes(), &chosen).expect(yaw), wn);
    }
    let sensors = table("Time\tSensor 1\tSensor 2\n", |t, _| format!("{t:.3}\t{:.3}\t3.0", deg(t)));
    let error = read("sensors.txt", sensors.as_bytes(), &Selection::default()).expect_err("which");
    assert!(error.message.contains("Sensor 1 (500 numbers)"), "{error}");
    assert!(error.message.contains('█') && error.help.contains("yaw = Sensor 1"), "{error}");
    // A header in the middle begins a second recording.
    let first = table("Time (s),Angle (deg)\n", |t, _| format!("{t:.3},{:.3}", deg(t)));
    let second = first.lines().take(400).collect::<Vec<_>>().join("\n");
    let both = format!("{first}{second}\n");
    let error = read("both.csv", both.as_bytes(), &Selection::default()).expect_err("which of two");
    assert!(error.message.contains("recording 2/Angle (deg) (399 numbers, deg)"), "{error}");
    for (yaw, rows) in [("2", 500), ("4", 399)] {
        let chosen = Selection { yaw: Some(yaw.to_owned()), ..Selection::default() };
        let record = read("both.csv", both.as_bytes(), &chosen).expect(yaw);
        assert_eq!(record.len(), rows);
        is_right(yaw, &record, WN_RAD_S);
    }
    // What a comma is, where nothing says it.
    let open = table("Zeit;Weg\n", |t, _| {
        format!("{};{}", grouped(2000.0 + t * 100.0, 0), grouped(2400.0 + deg(t), 0))
    });
    let error =
        read("open.csv", open.as_bytes(), &Selection::default()).expect_err("what commas are");
    assert!(error.message.contains("line 2: \"2,000\" may be 2000 or 2.000"), "{error}");
}

#[test]
fn expressions_name_any_channel() {
    let volts =
        table("Time (s),Potential (V)\n", |t, _| format!("{t:.3},{:.6}", deg(t) / 3.38 + 0.217));
    let error = read("volts.csv", volts.as_bytes(), &Selection::default()).expect_err("no angle");
    assert!(error.help.contains("(\"Potential (V)\" - ZERO) * SCALE"), "{error}");
    let unit = Some("deg".to_owned());
    for yaw in ["(\"Potential (V)\" - 0.217) * 3.38", "(#2 - 0.217) * 3.38"] {
        let chosen =
            Selection { yaw: Some(yaw.to_owned()), unit: unit.clone(), ..Selection::default() };
        let record = read("volts.csv", volts.as_bytes(), &chosen).expect(yaw);
        assert!((record.yaw_deg[100] - deg(4.0)).abs() < 1e-4);
        is_right(yaw, &record, WN_RAD_S);
    }
}

#[test]
fn a_coarse_clock_is_in_the_uncertainty_and_said() {
    let seconds = table("time,angle_deg\n", |t, k| {
        format!("2024-10-11 10:00:{:02},{:.3}", (k + 7) / 25, deg(t))
    });
    let record = read("seconds.csv", seconds.as_bytes(), &Selection::default()).expect("a record");
    let found = identified(&record);
    let estimate = &found.estimates[0];
    let wn = estimate.natural_frequency_rad_s;
    assert!((wn.value - WN_RAD_S).abs() < 2.0 * wn.u && wn.u > 1e-3, "{wn:?}");
    assert!(estimate.flags.contains(&Flag::RateUncertain), "{:?}", estimate.flags);
    let stairs = table("Time (s),Angle (deg)\n", |t, k| {
        format!("{t:.3},{:.3}", deg((k / 4) as f64 * 4.0 / RATE_HZ))
    });
    let record = read("stairs.csv", stairs.as_bytes(), &Selection::default()).expect("a record");
    assert_eq!(record.repeats(), Some(4));
    let hum = table("time_s,yaw_deg\n", |t, k| {
        format!("{t:.3},{:.4}", 5.0 * (WN_RAD_S * t).cos() + 0.02 * (7.0 * (k * k) as f64).sin())
    });
    let record = read("hum.csv", hum.as_bytes(), &Selection::default()).expect("a record");
    let flags = &identified(&record).estimates[0].flags;
    assert!(flags.contains(&Flag::DoesNotDieAway), "{flags:?}");
}
