//! `yawrig study`: tables, JSON, plots.

use yawrig_tests::process::yawrig;

#[test]
fn a_study_prints_its_table_beside_the_thesis_and_leaves_a_plot() {
    let folder = tempfile::tempdir().expect("a folder");
    let ended = yawrig("study response --out plots").in_folder(folder.path()).run().exits(0);
    for said in ["Fig 4.20", "planted", "Thesis", "study-response.svg"] {
        assert!(ended.stdout.contains(said), "{said}: {}", ended.report());
    }
    let plot = std::fs::read_to_string(folder.path().join("plots/study-response.svg"));
    assert!(plot.expect("a plot").starts_with("<svg"));
}

#[test]
fn json_is_one_object_with_every_table() {
    let folder = tempfile::tempdir().expect("a folder");
    let ended = yawrig("study starts --quick --json").in_folder(folder.path()).run().exits(0);
    let object = ended.says("networks trained").json();
    assert_eq!(object["schema_version"], 1);
    let study = &object["studies"][0];
    assert_eq!(study["study"], "starts");
    assert_eq!(study["tables"][0]["rows"].as_array().expect("rows").len(), 5);
    assert!(study["findings"][0].as_str().expect("words").contains("Thesis"));
}

#[test]
fn an_unknown_study_lists_them_all() {
    let ended = yawrig("study start").run().exits(2).says("no study `start`");
    ended.says("starts").says("pca-rig").says("all").helps();
}

#[test]
fn plots_that_cannot_be_written_are_found_before_the_training() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "in the way").expect("room for it");
    let ended = yawrig("study all --out").and(&file).run().exits(3).says("cannot write");
    ended.says(&file.display().to_string()).helps();
}
