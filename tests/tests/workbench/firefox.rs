//! The page that needs no server in Firefox: the loop from a record to its model, and what it prints.

use crate::bench::pictures;
use crate::page::MODEL;
use crate::still::{dropping, printing, steps_are, Served, IS_EMPTY, IS_FOUND, IS_IDLE};
use yawrig_tests::firefox::Firefox;

#[test]
#[ignore = "needs Firefox: tests/run runs it"]
fn the_page_without_a_server_in_firefox() {
    let served = Served::start();
    let mut firefox = Firefox::start();
    firefox.open(&format!("{}/", served.origin));
    firefox.wait(IS_EMPTY);
    let text = served.read("rubbing.csv");
    firefox.value(&dropping(&[("rubbing.csv", text)]));
    firefox.wait(&format!("{IS_FOUND} && {IS_IDLE}"));
    for verb in ["identify", "diagnose"] {
        let page = firefox.value(&printing(verb, 0));
        let program = served.printed(&format!("{verb} rubbing.csv"));
        assert_eq!(page["text"].as_str().map(str::trim_end), Some(program.trim_end()));
    }
    firefox.value("document.querySelector('[data-focus=add-coulomb_friction]').click() ?? 1");
    firefox.wait(&steps_are(2));
    firefox.wait(
        "document.querySelector('#verdict').textContent.includes('explains it to the noise')",
    );
    firefox.picture(&pictures().join("firefox.png"));

    // Opened again it goes on, with the model that was written.
    firefox.wait(IS_IDLE);
    firefox.open("about:blank");
    firefox.open(&format!("{}/", served.origin));
    firefox.wait(&steps_are(2));
    let name = MODEL[0];
    firefox.wait(&format!("import('./backend.js').then(b => b.file('{name}')).then(bytes => new TextDecoder().decode(bytes).includes('coulomb_friction'))"));

    // A board is offered where it has Web Serial, which not every version has; where not, that is said.
    firefox.value("document.querySelector('#live-button').click() ?? 1");
    firefox.wait("('serial' in navigator) !== document.body.innerText.includes('This browser has no Web Serial')");
    assert!(firefox.complaints.is_empty(), "{:#?}", firefox.complaints);
}
