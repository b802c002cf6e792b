//! The book's pictures of results: the command that draws them runs, and gives those that lie there.
//!
//! What is compared is their lettering: training and fits may differ in the last bits from processor to
//! processor.

use std::path::Path;
use std::process::Command;

#[test]
fn are_drawn_anew_as_they_lie_there() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests lie in the project");
    let folder = tempfile::tempdir().expect("a folder");
    let output = Command::new(root.join("tests/pictures"))
        .arg(folder.path())
        .env("YAWRIG", yawrig_tests::process::binary())
        .output()
        .expect("bash");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let book = root.join("docs/src");
    let folders = ["tutorial", "how-to"].map(|folder| book.join(folder).read_dir().expect("pages"));
    let pages = folders.into_iter().flatten().flatten();
    let pages: String =
        pages.map(|page| std::fs::read_to_string(page.path()).expect("a page")).collect();
    let names = |folder: &Path| {
        let entries = folder.read_dir().expect("a folder").flatten();
        let mut names: Vec<String> =
            entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    };
    let kept = book.join("pictures");
    assert_eq!(names(folder.path()), names(&kept));
    for name in names(&kept) {
        assert!(pages.contains(&format!("(../pictures/{name})")), "{name} is on no page");
        let [drawn, kept] = [folder.path(), kept.as_path()]
            .map(|folder| words(&std::fs::read_to_string(folder.join(&name)).expect("a picture")));
        assert!(drawn.len() >= 3, "{name} has little lettering: {drawn:?}");
        assert_eq!(drawn, kept, "{name} is not as drawn: run tests/pictures");
    }
}

/// Titles, axes and legends of a drawing: its texts but for the numbers.
fn words(svg: &str) -> Vec<String> {
    let texts = svg.split("<text").skip(1).filter_map(|rest| {
        let text = rest.split_once('>')?.1.split_once("</text>")?.0.trim();
        text.parse::<f64>().is_err().then(|| text.to_owned())
    });
    texts.collect()
}
