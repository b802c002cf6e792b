use super::*;

fn quick(name: &str) -> Report {
    let setting = StudySetting { size: Size::Quick, progress: &|_| {} };
    let report = Study::named(name).unwrap().run(&setting).unwrap();
    assert_eq!(report.study, name);
    assert!(!report.tables.is_empty() && !report.findings.is_empty() && !report.plots.is_empty());
    for table in &report.tables {
        assert!(!table.rows.is_empty(), "{name}: {}", table.caption);
        for row in &table.rows {
            assert_eq!(row.len(), table.header.len(), "{name}: {row:?}");
            assert!(row.iter().all(|c| !c.is_empty() && !c.contains("NaN")), "{name}: {row:?}");
        }
    }
    let svg = yawrig_report::plot::svg(&report.plots).unwrap();
    assert!(svg.contains("<svg") && !svg.contains("NaN"), "{name}");
    for curve in report.plots.iter().flat_map(|p| &p.curves) {
        assert!(!curve.points.is_empty(), "{name}: {}", curve.name);
    }
    report
}

/// Small, to see that each runs and has everything to show; their numbers come from the full size.
#[test]
fn every_study_runs() {
    for study in &STUDIES {
        quick(study.name);
    }
}

#[test]
fn the_same_tables_on_any_number_of_threads() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| ["starts", "pca-estimates"].map(|name| quick(name).tables))
    };
    let one = serde_json::to_string(&on(1)).unwrap();
    assert_eq!(one, serde_json::to_string(&on(3)).unwrap());
}

#[test]
fn an_unknown_study_is_refused_with_all_names() {
    let Err(error) = Study::named("start") else { panic!("there is no such study") };
    assert_eq!(error.exit, yawrig_base::error::Exit::Usage);
    assert!(STUDIES.iter().all(|study| error.help.contains(study.name)));
}

/// Against bounds with room for another processor's rounding, from what the studies print.
#[test]
#[ignore = "takes minutes: tests/run --long runs it"]
fn figures_at_full_size() {
    let setting = StudySetting { size: Size::Full, progress: &|_| {} };
    let report = |name: &str| Study::named(name).unwrap().run(&setting).unwrap();
    let cell = |table: &report::Table, row: &str, column: &str| -> f64 {
        let at = table.header.iter().position(|h| h == column).unwrap();
        let row = table.rows.iter().find(|r| r[0] == row).unwrap();
        row[at].parse().unwrap()
    };
    let noise = report("noise");
    let own = noise.tables.last().unwrap();
    let thesis_features = report("samples").tables.swap_remove(0);
    let whole = report("pca-samples").tables.pop().unwrap();
    for (what, found, most) in [
        ("41-6-2, 2 %, wn", cell(own, "41-6-2, set 1", "wn rms %"), 0.035),
        ("41-6-2, 2 %, zeta", cell(own, "41-6-2, set 1", "zeta rms %"), 2.0),
        ("mean of four, 2 %, zeta", cell(own, "mean of these 4", "zeta rms %"), 1.6),
        ("thesis's features, wn", cell(&thesis_features, "250", "test wn"), 1e-5),
        ("thesis's features, zeta", cell(&thesis_features, "250", "test zeta"), 1e-12),
        ("whole record, no noise, zeta", cell(&whole, "0", "zeta rms %"), 1.5),
        ("whole record, 1 %, zeta", cell(&whole, "1.0", "zeta rms %"), 8.0),
    ] {
        println!("{what}: {found:e}, at most {most:e}");
        assert!(found <= most, "{what}: {found:e}");
    }
}
