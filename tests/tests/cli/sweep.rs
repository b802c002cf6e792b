//! A campaign at several settings: derivatives grouped by them, each as if it had been measured alone.

use calamine::{DataType, Reader};
use serde_json::Value;
use std::path::Path;
use yawrig_tests::process::{yawrig, Ended};

const SPRINGS: [&str; 3] = ["K3", "K5", "K7"];

fn run(folder: &Path, command: &str) -> Ended {
    yawrig(command).in_folder(folder).run()
}

const HEAD: &str =
    "schema_version = 1\n[model]\nname = \"A_1 & co\"\nlength_m = 0.625\nfrontal_area_m2 = 0.036\n\
    [air]\ndensity_kg_m3 = 1.2\n[rig]\nspring_arm_m = 0.1\naxis_offset_m = 0.05\n\
    [stiffness_n_per_m]\nK3 = 306.0\nK5 = 1051.0\nK7 = 2242.0\n";

fn release(file: &str, spring: &str, wind: f64, more: &str) -> String {
    format!(
        "[[release]]\nfile = \"{file}\"\nspring = \"{spring}\"\naxis = \"mid\"\nwind_speed_m_s = {wind:.1}\n{more}\n"
    )
}

fn points(folder: &Path, campaign: &str) -> Vec<Value> {
    let table = run(folder, &format!("derivatives {campaign} --json")).exits(0).json();
    assert_eq!(table["doubts"].as_array().map(Vec::len), Some(0), "{table}");
    table["points"].as_array().expect("points").clone()
}

fn cn_beta(point: &Value) -> f64 {
    point["cn_beta"]["value"].as_f64().expect("a value")
}

#[test]
fn settings_group_the_derivatives() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    // The high wing is a wind of 11.5 m/s that is called 10 m/s: 1.32 times the moment.
    let (mut low, mut high, mut dense) = (HEAD.to_owned(), HEAD.to_owned(), HEAD.to_owned());
    let mut both = HEAD.to_owned();
    for (k, spring) in SPRINGS.into_iter().enumerate() {
        for (name, wind) in [("off", 0.0), ("low", 10.0), ("high", 11.5)] {
            run(
                folder,
                &format!(
                    "simulate --spring {spring} --wind {wind} --seconds 30 --rate-hz 200 --seed {} --out {spring}-{name}.csv",
                    10 * k + wind as usize
                ),
            )
            .exits(0);
        }
        let off = release(&format!("{spring}-off.csv"), spring, 0.0, "");
        let on =
            |name: &str, more: &str| release(&format!("{spring}-{name}.csv"), spring, 10.0, more);
        low += &(off.clone() + &on("low", ""));
        high += &(off.clone() + &on("high", ""));
        dense += &(off.clone() + &on("low", "density_kg_m3 = 1.32"));
        both += &(off
            + &on("low", "at = { wing = \"low\", ride_height_mm = 40 }")
            + &on("high", "at = { wing = \"high\", ride_height_mm = 40 }"));
    }
    for (name, text) in [("low", low), ("high", high), ("dense", dense), ("both", both)] {
        std::fs::write(folder.join(format!("{name}.toml")), text).expect("room");
    }
    let [low, high, dense, both] =
        ["low.toml", "high.toml", "dense.toml", "both.toml"].map(|name| points(folder, name));
    assert_eq!(both.len(), 2 * SPRINGS.len());
    for point in &both {
        let alone = if point["at"]["wing"] == "low" { &low } else { &high };
        assert_eq!(point["at"]["ride_height_mm"], 40.0);
        let alone = alone.iter().find(|p| p["spring"] == point["spring"]).expect("its spring");
        assert!((cn_beta(point) / cn_beta(alone) - 1.0).abs() < 1e-9, "{point} for {alone}");
    }
    for (spring, (low, high)) in low.iter().zip(&high).enumerate() {
        let ratio = cn_beta(high) / cn_beta(low);
        assert!((ratio / 1.15f64.powi(2) - 1.0).abs() < 0.02, "{ratio} on spring {spring}");
    }
    // A release in denser air has less of a coefficient in the same moment.
    for (dense, low) in dense.iter().zip(&low) {
        let ratio = cn_beta(dense) / cn_beta(low);
        assert!((ratio * 1.1 - 1.0).abs() < 1e-9, "{ratio}");
    }

    air_and_wind_are_known_by_gauges(folder, &low);
    tables_are_grouped(folder);

    // A wind-off release at one setting is no reference at another.
    let text = std::fs::read_to_string(folder.join("both.toml")).expect("it");
    let off = "file = \"K5-off.csv\"\nspring = \"K5\"\naxis = \"mid\"\nwind_speed_m_s = 0.0\n";
    let spoilt = text.replace(off, &format!("{off}at = {{ wing = \"low\" }}\n"));
    assert_ne!(text, spoilt);
    std::fs::write(folder.join("both.toml"), spoilt).expect("room");
    run(folder, "derivatives both.toml").exits(3).says("K5-high.csv").says("wing high");

    one_report_stands_beside_another(folder, &low);
    run(folder, "report both.toml --out b.html --xlsx b.xlsx").exits(3);
    std::fs::write(folder.join("both.toml"), &text).expect("room");
    run(folder, "report both.toml --out b.html --xlsx b.xlsx").exits(0);
    run(folder, "report both.toml --out c.html --xlsx b.xlsx").exits(2).says("b.xlsx");
    the_workbook_holds(folder, &both);
    run(folder, "report K3-off.csv --beside low.toml --out r.html").exits(2).says("--beside");
}

/// By temperature, pressure and a Pitot tube: dry air at 15 deg C and 101 325 Pa has 1.22499 kg/m3.
fn air_and_wind_are_known_by_gauges(folder: &Path, low: &[Value]) {
    let by_gauges = std::fs::read_to_string(folder.join("low.toml"))
        .expect("it")
        .replace("density_kg_m3 = 1.2\n", "temperature_deg_c = 15.0\npressure_pa = 101325\n")
        .replace("wind_speed_m_s = 10.0", "dynamic_pressure_pa = 61.2495");
    std::fs::write(folder.join("gauges.toml"), &by_gauges).expect("room");
    for (gauge, low) in points(folder, "gauges.toml").iter().zip(low) {
        let speed = gauge["wind_speed_m_s"].as_f64().expect("a speed");
        assert!((speed - 10.0).abs() < 1e-4, "{speed}");
        let ratio = cn_beta(gauge) / cn_beta(low) * 1.22499 / 1.2;
        assert!((ratio - 1.0).abs() < 1e-4, "{ratio}");
    }
    for (more, says) in [
        ("wind_speed_m_s = 10.0", "wind_speed_m_s is stated and dynamic_pressure_pa, too"),
        ("density_kg_m3 = 1.2\ntemperature_deg_c = 20", "density_kg_m3 is stated and temperature"),
        ("at = { \"a,b\" = 1 }", "at.\"a,b\" cannot be a setting's name"),
        ("at = { spring = \"soft\" }", "at.\"spring\" cannot be"),
    ] {
        let twice = by_gauges.replacen("dynamic", &format!("{more}\ndynamic"), 1);
        std::fs::write(folder.join("twice.toml"), twice).expect("room");
        run(folder, "derivatives twice.toml").exits(3).says(says).says("line 22");
    }
}

fn tables_are_grouped(folder: &Path) {
    let text = run(folder, "derivatives both.toml").exits(0).stdout;
    assert!(text.contains("At ride_height_mm 40, wing high:"), "{text}");
    let csv = run(folder, "derivatives both.toml --csv").exits(0).stdout;
    assert!(csv.lines().next().is_some_and(|l| l.ends_with(",notes,ride_height_mm,wing")), "{csv}");
    assert!(csv.lines().nth(1).is_some_and(|l| l.ends_with(",40,low")), "{csv}");
    let latex = run(folder, "derivatives both.toml --table latex").exits(0).stdout;
    assert!(latex.starts_with("\\begin{tabular}{lllrrrrrr}\n"), "{latex}");
    assert!(latex.contains("ride\\_height\\_mm & wing & spring & $V$ (m/s)"), "{latex}");
    assert!(latex.contains("A\\_1 \\& co") && latex.contains("\\pm"), "{latex}");
    assert!(latex.contains("Uncertainties assumed zero"), "{latex}");
    let markdown = run(folder, "derivatives both.toml --table markdown").exits(0).stdout;
    assert_eq!(markdown.lines().nth(1), Some("|---|---|---|---:|---:|---:|---:|---:|---:|"));
    assert!(markdown.lines().nth(2).is_some_and(|l| l.starts_with("| 40 | low | K3 | 10.00 |")));
    run(folder, "derivatives both.toml --table latex --csv").exits(2);
}

/// From the file and from a report that was made of it.
fn one_report_stands_beside_another(folder: &Path, low: &[Value]) {
    run(folder, "report low.toml --out low.html").exits(0);
    for other in ["low.toml", "low.html"] {
        run(folder, &format!("report high.toml --beside {other} --out high.html --force")).exits(0);
        let data = run(folder, "report --data high.html").exits(0).json();
        let beside = data["beside"]["points"].as_array().expect("points");
        assert!((cn_beta(&beside[0]) / cn_beta(&low[0]) - 1.0).abs() < 1e-9, "{other}");
        let page = std::fs::read_to_string(folder.join("high.html")).expect("a page");
        assert!(page.contains(&format!("<h3>Beside A_1 &amp; co ({other})</h3>")), "{other}");
    }
}

fn the_workbook_holds(folder: &Path, both: &[Value]) {
    let mut book: calamine::Xlsx<_> =
        calamine::open_workbook(folder.join("b.xlsx")).expect("a workbook");
    assert_eq!(book.sheet_names(), ["about", "derivatives", "budget", "releases"]);
    let sheet = book.worksheet_range("derivatives").expect("its sheet");
    let rows: Vec<_> = sheet.rows().collect();
    assert_eq!(rows.len(), 1 + both.len());
    assert_eq!((&rows[0][3], &rows[0][4]), (&"ride_height_mm".into(), &"wing".into()));
    let of = |row: &[calamine::Data]| (row[0].to_string(), row[4].to_string(), row[5].get_float());
    for (row, point) in rows[1..].iter().zip(both) {
        let (spring, wing, value) = of(row);
        assert_eq!(
            (point["spring"].as_str(), point["at"]["wing"].as_str()),
            (Some(&*spring), Some(&*wing))
        );
        assert_eq!(value, Some(cn_beta(point)), "{point}");
    }
    let about = book.worksheet_range("about").expect("its sheet");
    assert!(about.rows().any(|row| row[1] == *"A_1 & co"));
    assert!(about.rows().any(|row| row[1] == *"rig.spring_arm_u_m"));
}
