use super::*;

fn quick(name: &str) -> Report {
    let setting = Setting { size: Size::Quick, progress: &|_| {} };
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
    let svg = plot::svg(&report.plots).unwrap();
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
    assert_eq!(error.exit, crate::error::Exit::Usage);
    assert!(STUDIES.iter().all(|study| error.help.contains(study.name)));
}
