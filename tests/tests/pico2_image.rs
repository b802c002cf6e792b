//! The image that goes on Raspberry Pi's Pico 2, unmodified, executed for its first seconds: `tests/pico2/machine.py` is the
//! microcontroller.

use std::path::Path;
use std::process::Command;

#[test]
#[ignore = "needs unicorn: tests/run runs it"]
fn it_starts_samples_answers_the_host_and_sees_that_the_model_is_held() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a folder above");
    let image = Command::new(root.join("firmware/boards/build")).arg("pico2").output();
    let image = image.expect("the build script");
    assert!(image.status.success(), "{}", String::from_utf8_lossy(&image.stderr));
    let image = String::from_utf8(image.stdout).expect("a path");
    let python = root.join("target/nucleo/bin/python");
    assert!(python.exists(), "{} is not there: run tests/nucleo/install", python.display());
    // Longer than its watchdog waits.
    let ran = Command::new(python)
        .arg(root.join("tests/pico2/machine.py"))
        .args([image.trim(), "4.5"])
        .output()
        .expect("python");
    let said = String::from_utf8_lossy(&ran.stdout);
    println!("{said}");
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let figure = |name: &str| {
        let found = said.split_whitespace().find_map(|pair| pair.strip_prefix(name));
        found.unwrap_or_else(|| panic!("{name} in {said}")).to_owned()
    };
    assert_eq!(figure("reset="), "no", "by its watchdog");
    assert_eq!(figure("serial="), "A1C90B7A6F5E4D3C");
    let samples: u32 = figure("samples=").parse().expect("a number");
    assert!((4490..=4500).contains(&samples), "{samples}");
    let polls: u32 = figure("polls=").parse().expect("a number");
    assert!(polls > 10_000, "{polls}");
    // On while the model is held.
    assert_eq!(figure("lit="), "1.00");
}
