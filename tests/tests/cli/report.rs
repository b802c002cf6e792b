//! `report` as a script meets it: what is refused, what is left alone, what comes out again.

use std::path::Path;
use yawrig_tests::process::yawrig;

fn simulated(folder: &Path) {
    let record = "simulate --natural-frequency 12 --damping 0.02 --seconds 20 --out r.csv";
    yawrig(record).in_folder(folder).run().exits(0);
}

#[test]
fn a_page_is_not_written_over_and_holds_its_data() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    simulated(folder);
    let run = |command: &str| yawrig(command).in_folder(folder).run();
    run("report r.csv").exits(0);
    let page = std::fs::read(folder.join("report.html")).expect("a page");
    run("report r.csv").exits(2).says("report.html is there already").helps();
    assert!(std::fs::read(folder.join("report.html")).expect("a page") == page);
    let printed = run("report r.csv --force --json --pictures drawn").exits(0).json();
    assert_eq!(run("report --data report.html").exits(0).json(), printed);
    assert_eq!(printed["criticism"]["status"], "adequate");
    assert_eq!(printed["sources"][0]["file"], "r.csv");
    assert_eq!(printed["made"]["command"], "yawrig report r.csv --force --json --pictures drawn");
    for name in ["staircase", "amplitude", "laws"] {
        let text = std::fs::read_to_string(folder.join(format!("drawn/{name}.svg"))).expect(name);
        assert!(text.starts_with("<svg") && text.contains("<text"), "{name}");
    }
    run("report r.csv --out other.html --pictures drawn").exits(2).says("is there already");
    assert!(!folder.join("other.html").exists());
}

#[test]
fn what_cannot_be_reported_on_is_said_and_nothing_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    simulated(folder);
    std::fs::write(folder.join("bad.csv"), "time_s,yaw_deg\n0,1\nx,2\n").expect("room for it");
    std::fs::write(folder.join("page.html"), "<html></html>").expect("room for it");
    std::fs::create_dir(folder.join("empty")).expect("room for it");
    for (command, code, says) in [
        ("report", 2, "required"),
        ("report absent.csv", 3, "absent.csv"),
        ("report r.csv bad.csv", 3, "bad.csv, line 3"),
        ("report absent.toml", 3, "absent.toml"),
        ("report r.csv empty", 2, "empty beside other files"),
        ("report empty", 3, "neither demo.json nor model.toml nor campaign.toml nor a record"),
        ("report r.csv --out no/such/r.html", 3, "no such folder"),
        ("report --data page.html", 3, "no report's data"),
        ("report --data absent.html", 3, "absent.html"),
    ] {
        yawrig(command).in_folder(folder).run().exits(code).says(says);
    }
    let mut names: Vec<_> =
        std::fs::read_dir(folder).expect("ours").flatten().map(|e| e.file_name()).collect();
    names.sort();
    assert_eq!(names, ["bad.csv", "empty", "page.html", "r.csv"]);
}

#[test]
fn what_a_diagnosis_says_of_a_record_stands_in_its_report() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let stribeck = "id = \"sticky\"\ntitle = \"Sticky\"\n\
        moment = \"-c * sign(r) * (1 + s * exp(-abs(r) / v))\"\n[parameters]\n\
        c = { unit = \"rad/s2\", start = 0.05, min = 0.0 }\n\
        s = { unit = \"1\", start = 0.5, min = 0.0 }\nv = { unit = \"rad/s\", start = 0.1, min = 0.0 }\n";
    std::fs::write(folder.join("sticky.toml"), stribeck).expect("room");
    let run = |command: &str| yawrig(command).in_folder(folder).run().exits(0);
    run("simulate --natural-frequency 7 --damping 0.004 --effect sticky.toml:c=0.06,s=2,v=0.3 --seconds 30 --out r.csv");
    let told = run("diagnose r.csv --json").json();
    assert_eq!(told["status"], "mostly_explained");
    let sentence = told["sentence"].as_str().expect("a sentence");
    let printed = run("report r.csv --json").json();
    let said = printed["criticism"]["sentences"][0].as_str().expect("a sentence");
    assert_eq!(said[1..], sentence[1..]);
    let page = std::fs::read_to_string(folder.join("report.html")).expect("a page");
    assert!(page.contains(&format!("<p>{said}.</p>")));
}

/// The number behind `term` in a page's first list of terms.
fn in_head(page: &str, term: &str) -> Option<f64> {
    let head = page.split("<main>").next()?;
    let (_, rest) = head.split_once(&format!("<dt>{term}</dt><dd>"))?;
    rest.split(' ').next()?.parse().ok()
}

#[test]
fn the_answer_to_a_record_is_the_head_of_its_report_and_what_is_refused_is_marked() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let run = |command: &str| yawrig(command).in_folder(folder).run().exits(0);
    run("simulate --natural-frequency 7.5 --damping 0.008 --effect coulomb_friction:c=0.12 --out r.csv");
    run("simulate --natural-frequency 7.5 --damping 0.008 --seed 2 --out plain.csv");
    let told = run("diagnose r.csv --json").json();
    run("report r.csv --xlsx r.xlsx");
    let page = std::fs::read_to_string(folder.join("report.html")).expect("a page");
    for (term, planted, told) in [
        ("natural frequency wn", 7.5, &told["modal"]["natural_frequency_rad_s"]),
        ("damping ratio zeta", 0.008, &told["modal"]["damping_ratio"]),
        ("coulomb_friction.c", 0.12, &told["steps"][1]["parameters"]["coulomb_friction.c"]),
    ] {
        let shown = in_head(&page, term).unwrap_or_else(|| panic!("{term}: {page}"));
        let [value, u] = ["value", "u"].map(|name| told[name].as_f64().expect("a number"));
        assert!((shown - value).abs() <= 0.51 * u, "{term}: {shown} for {value} +- {u}");
        assert!((shown - planted).abs() < 4.0 * u, "{term}: {shown}, planted {planted}, u {u}");
    }
    for method in ["least-squares", "conventional", "network"] {
        let marked = format!("{method} <b class=\"refused\">not valid</b>");
        assert!(page.contains(&marked), "{method} is not marked");
    }
    // What a second-order model does explain is not refused.
    let plain = run("report plain.csv --out plain.html --json").json();
    let page = std::fs::read_to_string(folder.join("plain.html")).expect("a page");
    assert!(!page.contains("not valid"));
    assert!((in_head(&page, "damping ratio zeta").expect("zeta") - 0.008).abs() < 1e-4);
    assert_eq!(plain["releases"][0]["answer"]["model"], "second order");
    // Of several records each has its own.
    run("report r.csv plain.csv --out both.html");
    let page = std::fs::read_to_string(folder.join("both.html")).expect("a page");
    assert_eq!(page.matches("<dt>natural frequency wn</dt>").count(), 2);
    assert_eq!(page.matches("<b class=\"refused\">").count(), 3);
    // The model of the answer says the same of itself.
    run("fit r.csv");
    run("add coulomb_friction");
    run("report model.toml --out model.html");
    let page = std::fs::read_to_string(folder.join("model.html")).expect("a page");
    assert!((in_head(&page, "coulomb_friction.c").expect("c") - 0.12).abs() < 1e-3);
}
