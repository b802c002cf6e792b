//! The speed from which on a rig swings by itself, in every form that derivatives are given in.

use std::fmt::Write as _;
use std::path::Path;
use yawrig_rig::runge_kutta;
use yawrig_tests::process::yawrig;

const CRITICAL_M_S: f64 = 11.3;
const HEAD: &str = "schema_version = 1\n[model]\nname = \"Swinging model\"\nlength_m = 0.625\nfrontal_area_m2 = 0.036\n\
    [air]\ndensity_kg_m3 = 1.2\n[rig]\nspring_arm_m = 0.1\naxis_offset_m = 0.05\n[inertia]\nmid_kg_m2 = 0.12\n";

/// b'' = -7.1^2 b - (0.3 (1 - V / 11.3) + 9.2 b^2) b', held for a second at 15 deg; in place of noise what is
/// left of a reading to 0.02 deg.
fn record(wind_m_s: f64) -> String {
    let mut text = "time_s,yaw_deg\n".to_owned();
    let mut x = [15f64.to_radians(), 0.0];
    let h = 1e-3;
    for k in 0..8200 {
        let read = (x[0].to_degrees() / 0.02).round() * 0.02;
        let _ = writeln!(text, "{:.3},{read:.2}", f64::from(k) * 5e-3);
        for _ in 0..if k < 200 { 0 } else { 5 } {
            x = runge_kutta(x, h, |_, [b, r]: [f64; 2]| {
                let damping = 0.3 * (1.0 - wind_m_s / CRITICAL_M_S) + 9.2 * b * b;
                [r, -7.1 * 7.1 * b - damping * r]
            });
        }
    }
    text
}

fn campaign(folder: &Path) {
    let mut text = HEAD.to_owned();
    for wind_m_s in [0.0, 5.0, 8.0, 10.0] {
        let file = format!("K3-{wind_m_s}.csv");
        std::fs::write(folder.join(&file), record(wind_m_s)).expect("room for it");
        let _ = writeln!(
            text,
            "[[release]]\nfile = \"{file}\"\nspring = \"K3\"\nspring_stiffness_n_per_m = 306.0\naxis = \"mid\"\n\
             wind_speed_m_s = {wind_m_s:?}"
        );
    }
    std::fs::write(folder.join("campaign.toml"), text).expect("room for it");
}

/// What stands between commas that are in no quotation.
fn cells(line: &str) -> Vec<String> {
    let mut quoted = false;
    let outside = |c: char| {
        quoted ^= c == '"';
        c == ',' && !quoted
    };
    line.split(outside).map(str::to_owned).collect()
}

#[test]
fn the_critical_speed_is_in_every_form() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    campaign(folder);
    let run = |command: &str| yawrig(command).in_folder(folder).run().exits(0);
    let json = run("derivatives campaign.toml --json").json();
    let critical = &json["critical_speed"][0];
    let speed = &critical["wind_speed_m_s"];
    let (value, u) = (speed["value"].as_f64().expect("one"), speed["u"].as_f64().expect("one"));
    assert!((value - CRITICAL_M_S).abs() < 3.0 * u && u < 0.1, "{critical}");

    let csv = run("derivatives campaign.toml --csv").stdout;
    let mut rows = csv.lines().map(cells);
    let header = rows.next().expect("a header");
    let rows: Vec<Vec<String>> = rows.collect();
    let cell = |row: usize, name: &str| {
        let column = header.iter().position(|column| column == name).expect(name);
        rows[row][column].parse::<f64>().ok()
    };
    assert_eq!(rows.len(), 3, "{csv}");
    for row in 0..3 {
        assert_eq!(cell(row, "critical_speed_m_s"), Some(value));
        assert_eq!(cell(row, "critical_speed_u_m_s"), Some(u));
        let zeta = &critical["damping"][row + 1]["damping_ratio"];
        assert_eq!(cell(row, "damping_ratio_at_rest"), zeta["value"].as_f64());
        assert_eq!(cell(row, "limit_cycle_deg"), None, "below it there is none");
    }

    let sentence = run("derivatives campaign.toml").stdout;
    let sentence = sentence.lines().find(|line| line.starts_with("Swings by itself from"));
    let sentence = sentence.expect("a sentence").to_owned();
    let markdown = run("derivatives campaign.toml --table markdown").stdout;
    assert!(markdown.contains(&sentence) && markdown.contains(" m/s it goes to "), "{markdown}");
    let latex = run("derivatives campaign.toml --table latex").stdout;
    assert!(latex.contains(&sentence.replace('±', "$\\pm$")), "{latex}");
    assert!(!latex.contains('±'), "{latex}");

    run("report campaign.toml --pictures drawn");
    let page = std::fs::read_to_string(folder.join("report.html")).expect("a page");
    assert!(page.contains(&sentence) && page.contains("zeta at rest"), "{sentence}");
    let data = run("report --data report.html").json();
    assert_eq!(&data["critical_speed"][0], critical);
    let drawn = std::fs::read_to_string(folder.join("drawn/critical_speed.svg")).expect("drawn");
    assert!(drawn.contains("critical speed 11."), "{drawn}");
}
