//! Records that are no angle: a rate, an acceleration, a displacement, from the file to the model.

use crate::foreign::{archive, suggested, table, time_s, typed, ROWS};
use serde_json::Value;
use std::path::Path;
use tempfile::TempDir;
use yawrig_tests::process::{yawrig, Yawrig};

const WN_RAD_S: f64 = 7.5;
const ZETA: f64 = 0.012;

struct Bench(TempDir);

impl Bench {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn folder(&self) -> &Path {
        self.0.path()
    }

    fn of(&self, arguments: &str) -> Yawrig {
        yawrig(arguments).in_folder(self.folder())
    }

    fn json(&self, arguments: &str) -> Value {
        self.of(arguments).and("--json").run().exits(0).json()
    }

    /// A release of the virtual rig, seen by a sensor of this quantity.
    fn simulated(&self, quantity: &str, file: &str, more: &str) {
        self.of(&format!(
            "simulate --natural-frequency {WN_RAD_S} --damping {ZETA} --rate-hz 250 --quantity {quantity} --out {file} {more}"
        ))
        .run()
        .exits(0);
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn near(found: &Value, truth: f64) {
    let (value, u) = (number(&found["value"]), number(&found["u"]));
    assert!((value - truth).abs() < 3.0 * u, "{value} +- {u} and not {truth}");
}

/// Of the virtual rig's swing what a phone's gyroscope shows, in rad/s; its zero is off.
fn gyroscope(k: usize) -> f64 {
    let (t, s, w) = (time_s(k), 0.1f64, 7.5f64);
    let noise = 0.002 * ((k * 7919 % 1009) as f64 / 504.0 - 1.0);
    // The derivative of 0.2 e^(-s t) cos(w t).
    -0.2 * (-s * t).exp() * (s * (w * t).cos() + w * (w * t).sin()) + 0.05 + noise
}

#[test]
fn a_rate_is_identified_diagnosed_measured_and_fitted_as_a_rate() {
    let bench = Bench::new();
    bench.simulated(
        "rate",
        "gyro.csv",
        "--noise-deg 0.3 --adc-step-deg 0 --offset-deg 4 --effect coulomb_friction:c=0.08",
    );
    let head = std::fs::read_to_string(bench.folder().join("gyro.csv")).expect("the record");
    assert_eq!(head.lines().next(), Some("time_s,rate (deg/s)"));

    let found = &bench.json("identify gyro.csv")["records"][0];
    assert_eq!((&found["quantity"], &found["unit"]), (&"rate".into(), &"deg/s".into()));
    assert_eq!(found["amplitude_unit"], "deg");
    // Amplitudes are the motion's: the usual window; noise is the record's.
    assert!((9.0..10.5).contains(&number(&found["window"]["from_deg"])), "{found}");
    assert!((0.27..0.33).contains(&number(&found["noise_rms_deg"])), "{found}");
    let text = bench.of("identify gyro.csv").run().exits(0).stdout;
    assert!(text.contains("yaw rate in deg/s") && text.contains("residual (deg/s)"), "{text}");
    let rows = bench.of("identify gyro.csv --csv").run().exits(0).stdout;
    assert!(
        rows.lines().next().is_some_and(|l| l.ends_with(",quantity,unit,amplitude_unit")),
        "{rows}"
    );
    assert!(rows.lines().skip(1).all(|l| l.ends_with(",rate,deg/s,deg")), "{rows}");
    let rows = bench.of("diagnose gyro.csv --csv").run().exits(0).stdout;
    assert!(rows.lines().skip(1).all(|l| l.ends_with(",rate,deg/s")), "{rows}");

    let found = bench.json("diagnose gyro.csv");
    assert_eq!((&found["status"], &found["quantity"]), (&"explained".into(), &"rate".into()));
    assert_eq!(found["effects"], serde_json::json!(["coulomb_friction"]));
    let last = found["steps"].as_array().and_then(|s| s.last()).expect("a step");
    near(&last["parameters"]["coulomb_friction.c"], 0.08);
    near(&found["modal"]["natural_frequency_rad_s"], WN_RAD_S);
    near(&found["modal"]["damping_ratio"], ZETA);

    bench.of("fit gyro.csv").run().exits(0);
    bench.of("add coulomb_friction").run().exits(0);
    let model = std::fs::read_to_string(bench.folder().join("model.toml")).expect("the model");
    assert!(model.contains("quantity = \"rate\"") && model.contains("unit = \"deg/s\""), "{model}");
    let compared = bench.json("compare --model model.toml");
    near(&compared["parameters"]["coulomb_friction.c"], 0.08);
    assert!(number(&compared["residual_over_noise"]) < 1.1, "{}", compared["residual_over_noise"]);
    // What a rate cannot show is refused with the reason.
    let refused = bench.of("add static_offset").run().exits(2);
    assert!(refused.stderr.contains("static_offset"), "{}", refused.stderr);
}

#[test]
fn the_law_of_a_rate_is_that_of_its_angle() {
    let bench = Bench::new();
    bench.simulated(
        "rate",
        "gyro.csv",
        "--noise-deg 0.2 --adc-step-deg 0 --effect quadratic_damping:d=0.2",
    );
    let found = bench.json("law gyro.csv");
    assert_eq!((&found["quantity"], &found["amplitude_unit"]), (&"rate".into(), &"deg".into()));
    assert!(number(&found["residual_over_noise"]) < 1.1, "{}", found["residual_over_noise"]);
    assert!(number(&found["without"]["residual_over_noise"]) > 2.0, "{}", found["without"]);
    // Known over the angle that was swung, not over the reading.
    assert!((12.0..16.0).contains(&number(&found["known"]["yaw_deg"])), "{}", found["known"]);
}

#[test]
fn an_acceleration_is_the_derivative_of_the_rate() {
    let bench = Bench::new();
    bench.simulated("acceleration", "a.csv", "--noise-deg 3 --adc-step-deg 0 --offset-deg 20");
    let found = &bench.json("identify a.csv")["records"][0];
    assert_eq!((&found["quantity"], &found["unit"]), (&"acceleration".into(), &"deg/s2".into()));
    near(&found["estimates"][0]["natural_frequency_rad_s"], WN_RAD_S);
    near(&found["estimates"][0]["damping_ratio"], ZETA);
    assert_eq!(bench.json("diagnose a.csv")["status"], "adequate");
}

/// The gyroscope of a phone, as its app stores it: no command is needed where there is one channel, and with
/// several the one that is printed works.
#[test]
fn a_phones_gyroscope_needs_one_command_at_most() {
    let bench = Bench::new();
    let names =
        "\"Time (s)\",\"Gyroscope x (rad/s)\",\"Gyroscope y (rad/s)\",\"Gyroscope z (rad/s)\"\n";
    let still = |k: usize| 0.004 * ((k * 104_729 % 1013) as f64 / 506.0 - 1.0);
    let rows = table(names, |k| {
        format!("{:e},{:e},{:e},{:e}", time_s(k), still(k), 0.01 + still(k + 7), gyroscope(k))
    });
    std::fs::write(bench.folder().join("Raw Data.csv"), rows).expect("room for it");
    let ended = bench.of("identify").and("Raw Data.csv").run().exits(3).helps();
    let command = suggested(&ended.stderr);
    assert!(command.contains("--yaw 'Gyroscope z (rad/s)' --quantity rate"), "{command}");
    typed(bench.folder(), &command);
    let found = &bench.json("identify record.csv")["records"][0];
    assert_eq!(found["unit"], "deg/s");
    near(&found["estimates"][0]["natural_frequency_rad_s"], 7.5f64.hypot(0.1));
    // The same flags on the verb itself, kept for the folder.
    let at_once = bench
        .of("identify")
        .and("Raw Data.csv")
        .and("--quantity")
        .and("rate")
        .and("--yaw")
        .and("4");
    let text = at_once.run().exits(0).stdout;
    assert!(text.contains("yaw rate in deg/s"), "{text}");
    bench
        .of("convert")
        .and("Raw Data.csv")
        .and("again.csv")
        .and("--quantity")
        .and("rate")
        .and("--yaw")
        .and("4")
        .and("--motion")
        .and("roll")
        .and("--keep")
        .run()
        .exits(0);
    let text = bench.of("identify").and("Raw Data.csv").run().exits(0).stdout;
    assert!(text.contains("roll rate in deg/s"), "{text}");
}

#[test]
fn a_workbook_of_several_sheets_is_read() {
    let bench = Bench::new();
    let sheet = |rows: String| {
        format!("<?xml version=\"1.0\"?><worksheet xmlns=\"http://schemas.openxmlformats.org/spreadsheetml/2006/main\"><sheetData>{rows}</sheetData></worksheet>")
    };
    let text =
        |at: &str, text: &str| format!("<c r=\"{at}\" t=\"inlineStr\"><is><t>{text}</t></is></c>");
    let row = |number: usize, cells: String| format!("<row r=\"{number}\">{cells}</row>");
    let data = |name: &str, of: &dyn Fn(usize) -> f64| {
        let head = row(1, text("A1", "Time (s)") + &text("B1", name));
        let rows = (0..ROWS).map(|k| {
            let n = k + 2;
            row(
                n,
                format!("<c r=\"A{n}\"><v>{}</v></c><c r=\"B{n}\"><v>{}</v></c>", time_s(k), of(k)),
            )
        });
        sheet(head + &rows.collect::<String>())
    };
    let device = sheet(
        row(1, text("A1", "property") + &text("B1", "value"))
            + &row(2, text("A2", "version") + &text("B2", "1.1")),
    );
    let name =
        |k: usize, name: &str| format!("<sheet name=\"{name}\" sheetId=\"{k}\" r:id=\"rId{k}\"/>");
    let main = "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
    let book = format!(
        "<?xml version=\"1.0\"?><workbook xmlns=\"http://schemas.openxmlformats.org/spreadsheetml/2006/main\" xmlns:r=\"{main}\"><sheets>{}{}{}</sheets></workbook>",
        name(1, "Accelerometer"), name(2, "Gyroscope"), name(3, "Metadata Device")
    );
    let relation = |k: usize| {
        format!("<Relationship Id=\"rId{k}\" Type=\"{main}/worksheet\" Target=\"worksheets/sheet{k}.xml\"/>")
    };
    let package = "http://schemas.openxmlformats.org/package/2006";
    let relations = format!("<?xml version=\"1.0\"?><Relationships xmlns=\"{package}/relationships\">{}{}{}</Relationships>", relation(1), relation(2), relation(3));
    let root = format!("<?xml version=\"1.0\"?><Relationships xmlns=\"{package}/relationships\"><Relationship Id=\"rId1\" Type=\"{main}/officeDocument\" Target=\"xl/workbook.xml\"/></Relationships>");
    let types = format!("<?xml version=\"1.0\"?><Types xmlns=\"{package}/content-types\"><Default Extension=\"xml\" ContentType=\"application/xml\"/><Default Extension=\"rels\" ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/></Types>");
    let bytes = archive(&[
        ("[Content_Types].xml", types),
        ("_rels/.rels", root),
        ("xl/workbook.xml", book),
        ("xl/_rels/workbook.xml.rels", relations),
        (
            "xl/worksheets/sheet1.xml",
            data("Acceleration x (m/s^2)", &|k| 0.05 * ((k * 7919 % 1009) as f64 / 504.0 - 1.0)),
        ),
        ("xl/worksheets/sheet2.xml", data("Gyroscope z (rad/s)", &gyroscope)),
        ("xl/worksheets/sheet3.xml", device),
    ]);
    std::fs::write(bench.folder().join("phyphox.xlsx"), bytes).expect("room for it");
    let ended = bench.of("identify phyphox.xlsx").run().exits(3).helps();
    let command = suggested(&ended.stderr);
    assert!(command.contains("Gyroscope/"), "{command}");
    typed(bench.folder(), &command);
    let found = &bench.json("identify record.csv")["records"][0];
    near(&found["estimates"][0]["natural_frequency_rad_s"], 7.5f64.hypot(0.1));
    // The quantity says which sheet it is.
    let found = bench.of("identify phyphox.xlsx --quantity rate").run().exits(0).stdout;
    assert!(found.contains("yaw rate in deg/s"), "{found}");
}

#[test]
fn a_displacement_has_laws_per_its_unit_and_no_sine() {
    let bench = Bench::new();
    bench.simulated(
        "angle",
        "angle.csv",
        "--noise-deg 0.02 --adc-step-deg 0 --effect cubic_stiffness:k3=40",
    );
    // A beam's tip in mm, 200 of them to the radian, as a tracker writes it.
    let text = std::fs::read_to_string(bench.folder().join("angle.csv")).expect("the record");
    let mut tip = "t,x (mm)\n".to_owned();
    for line in text.lines().skip(1) {
        let (t, yaw) = line.split_once(',').expect("two columns");
        let yaw: f64 = yaw.parse().expect("a number");
        tip += &format!("{t},{:.6}\n", 200.0 * yaw.to_radians());
    }
    std::fs::write(bench.folder().join("tip.csv"), tip).expect("room for it");
    let ended = bench.of("identify tip.csv").run().exits(3).helps();
    let command = suggested(&ended.stderr);
    assert!(command.contains("--quantity displacement"), "{command}");
    let as_it_is = "--quantity displacement";
    let found = &bench.json(&format!("identify tip.csv {as_it_is}"))["records"][0];
    assert_eq!((&found["unit"], &found["amplitude_unit"]), (&"mm".into(), &"mm".into()));
    // All of the decay, since nothing says which amplitudes are usual.
    assert!((45.0..55.0).contains(&number(&found["window"]["from_deg"])), "{}", found["window"]);
    let found = bench.json(&format!("diagnose tip.csv {as_it_is}"));
    assert_eq!(found["effects"], serde_json::json!(["cubic_stiffness"]));
    let last = found["steps"].as_array().and_then(|s| s.last()).expect("a step");
    near(&last["parameters"]["cubic_stiffness.k3"], 40.0 / (200.0 * 200.0));
    let text = bench.of(&format!("diagnose tip.csv {as_it_is}")).run().exits(0).stdout;
    assert!(text.contains("1/(mm2 s2)") && text.contains("amplitude (mm)"), "{text}");
    let law = bench.json(&format!("law tip.csv {as_it_is}"));
    let names = law["names"].as_array().expect("names");
    assert!(names.iter().all(|n| n["form"] != "sine"), "{}", law["names"]);
    assert!((45.0..55.0).contains(&number(&law["known"]["yaw_deg"])), "{}", law["known"]);
    // The model keeps how its record is read, and what it is per.
    bench.of(&format!("fit tip.csv {as_it_is}")).run().exits(0);
    bench.of("add cubic_stiffness").run().exits(0);
    let model = std::fs::read_to_string(bench.folder().join("model.toml")).expect("the model");
    assert!(
        model.contains("1/(mm2 s2)") && model.contains("quantity = \"displacement\""),
        "{model}"
    );
    near(&bench.json("compare --model model.toml")["parameters"]["cubic_stiffness.k3"], 1e-3);
    let refused = bench.of("add pendulum_gravity").run().exits(2);
    assert!(refused.stderr.contains("law of an angle"), "{}", refused.stderr);
    let refused = bench.of("compare angle.csv --model model.toml").run().exits(3);
    assert!(refused.stderr.contains("deg") && refused.stderr.contains("mm"), "{}", refused.stderr);
}

#[test]
fn what_cannot_be_is_refused_with_the_reason() {
    let bench = Bench::new();
    bench.simulated("angle", "angle.csv", "");
    bench.simulated("rate", "gyro.csv", "");
    for (arguments, exit, words) in [
        ("identify gyro.csv --quantity angle --yaw 2", 3, "no angle"),
        ("identify angle.csv --quantity rate --yaw 2", 3, "no rate"),
        ("diagnose angle.csv gyro.csv", 3, "another quantity"),
        ("convert gyro.csv gyro.mat", 2, ".csv"),
        ("replay gyro.csv", 3, "a device reads angles"),
        ("identify angle.csv --quantity speed", 2, "displacement"),
    ] {
        let ended = bench.of(arguments).run().exits(exit);
        assert!(ended.stderr.contains(words), "{arguments}: {}", ended.stderr);
    }
}

#[test]
fn trials_stand_side_by_side() {
    let bench = Bench::new();
    for seed in 1..=3 {
        bench.simulated("angle", &format!("trial-{seed}.csv"), &format!("--seed {seed}"));
    }
    let text = bench
        .of("identify trial-1.csv trial-2.csv trial-3.csv --plot trials.svg")
        .run()
        .exits(0)
        .stdout;
    let rows = |text: &str, with: &str| {
        text.lines().filter(|line| line.trim_start().starts_with(with)).count()
    };
    assert!(rows(&text, "trial-") == 3 && rows(&text, "released at") == 0, "{text}");
    assert!(rows(&text, "one thing (3)") == 1 && text.contains("the trials agree"), "{text}");
    let all = bench.of("identify trial-1.csv trial-2.csv --all-windows").run().exits(0).stdout;
    assert!(rows(&all, "released at") == 2 && all.find("released") > all.find("residual"), "{all}");
    let svg = std::fs::read_to_string(bench.folder().join("trials.svg")).expect("the plot");
    assert!(svg.contains("trial-3.csv") && svg.contains("Damping ratio"), "{}", svg.len());
    bench
        .of("simulate --natural-frequency 7.6 --damping 0.012 --rate-hz 250 --out trial-4.csv")
        .run()
        .exits(0);
    let text = bench.of("identify .").run().exits(0).stdout;
    assert!(text.contains("the trials differ"), "{text}");
    // Another spring is another condition.
    bench
        .of("simulate --natural-frequency 12 --damping 0.012 --rate-hz 250 --out trial-5.csv")
        .run()
        .exits(0);
    let text = bench.of("identify .").run().exits(0).stdout;
    assert!(text.contains("not trials of one thing") && !text.contains("scatter"), "{text}");
    // A campaign says what belongs together.
    bench.of("simulate --campaign campaign --repeats 2").run().exits(0);
    let text = bench.of("identify campaign").run().exits(0).stdout;
    assert!(rows(&text, "K1, mid, 10 m/s (2)") == 1 && rows(&text, "K1-mid-on") == 2, "{text}");
    assert!(text.lines().count() <= 64 + 32 + 5, "{text}");
}

/// Each release of a ship in the coefficients of its field; what does not roll has none, which is said before
/// it is worked on.
#[test]
fn several_roll_decays_are_written_as_naval_architects_do() {
    let bench = Bench::new();
    for (file, amplitude_deg) in [("a.csv", 14), ("b.csv", 9)] {
        let rig = format!(
            "--natural-frequency 2 --damping 0.02 --amplitude-deg {amplitude_deg} --seconds 60"
        );
        bench.of(&format!("simulate {rig} --out {file}")).run().exits(0);
    }
    let ask = "diagnose a.csv b.csv --same-rig --inertia-kg-m2 50";
    let found = bench.json(&format!("{ask} --motion roll"));
    for record in found["records"].as_array().expect("records") {
        let b1 = &record["roll"]["coefficients"][0];
        assert_eq!(b1["name"], "B1", "{record}");
        // 2 zeta wn A44.
        near(&b1["of_ship"], 4.0);
    }
    let text = bench.of(&format!("{ask} --motion roll")).run().exits(0).stdout;
    assert_eq!(text.matches("A44 = 50 kg m2").count(), 2, "{text}");
    for ask in [ask, "law a.csv --inertia-kg-m2 50", "diagnose a.csv --inertia-kg-m2 50"] {
        let ended = bench.of(ask).run().exits(2);
        assert!(ended.stderr.contains("--motion roll"), "{}", ended.stderr);
        assert!(!ended.stderr.contains("judging"), "{}", ended.stderr);
    }
}
