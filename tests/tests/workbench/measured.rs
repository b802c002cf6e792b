//! Measured records through the page without a server: what it prints of them is what the program prints.

use crate::still::{dropped, printed, Served};
use std::path::PathBuf;
use yawrig_tests::process::yawrig;

/// Two effects that fit alike may change places, and a fit with several minima end in another one: sines and powers
/// are another library's in a browser. Of so many answers, all but a tenth are the same to the last printed digit.
#[test]
#[ignore = "needs Chromium: tests/run --long runs it"]
fn measured_records_are_answered_as_the_program_answers_them_at_full_size() {
    let Some(folders) = std::env::var_os("YAWRIG_RECORDS") else {
        println!("YAWRIG_RECORDS names no folder of measured records: none is tried");
        return;
    };
    let served = Served::start();
    let (mut answers, mut other) = (0, Vec::new());
    let files = std::env::split_paths(&folders)
        .flat_map(|folder| std::fs::read_dir(folder).expect("a folder of records"));
    let mut files: Vec<PathBuf> = files.map(|entry| entry.expect("an entry").path()).collect();
    files.retain(|file| file.extension().is_some_and(|e| e == "csv"));
    files.sort();
    for file in files {
        let name = file.file_name().and_then(|name| name.to_str()).expect("a name in UTF-8");
        let text = std::fs::read_to_string(&file).expect(name);
        let mut browser = served.opened();
        dropped(&mut browser, name, &text);
        browser.wait("document.querySelector('.release')");
        browser.wait("document.body.dataset.busy === undefined && document.querySelector('#diagnosis').textContent.length > 40");
        for verb in ["identify", "diagnose"] {
            let page = printed(&mut browser, verb, 0);
            let folder = file.parent().expect("its folder");
            let program = yawrig(&format!("{verb} {name}")).in_folder(folder).run().exits(0);
            answers += 1;
            if page["text"].as_str().map(str::trim_end) != Some(program.stdout.trim_end()) {
                other.push(format!("{verb} {name}"));
            }
        }
    }
    println!("{} of {answers} answers are the same; others: {other:?}", answers - other.len());
    assert!(answers > 0 && 10 * other.len() <= answers, "{other:?}");
}
