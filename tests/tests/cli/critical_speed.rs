//! The speed from which on a rig swings by itself, in every form that derivatives are given in.

use yawrig_tests::process::yawrig;
use yawrig_tests::swinging::{campaign, CRITICAL_M_S};

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
