//! Every command of the README, as it stands there.

use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests lie in the project").to_owned()
}

/// Lines of the README's `sh` blocks, in order.
fn commands() -> Vec<String> {
    let found = lines_of("```sh");
    assert!(found.len() > 10, "{found:?}");
    found
}

/// Lines of the blocks that begin with `fence`.
fn lines_of(fence: &str) -> Vec<String> {
    let text = std::fs::read_to_string(root().join("README.md")).unwrap();
    let mut inside = false;
    let mut found = Vec::new();
    for line in text.lines() {
        match line {
            "```" => inside = false,
            line if line == fence => inside = true,
            line if inside => found.push(line.to_owned()),
            _ => {}
        }
    }
    found
}

/// Files of the README: name and text of each block marked as TOML of that name.
fn files() -> Vec<(String, String)> {
    let text = std::fs::read_to_string(root().join("README.md")).unwrap();
    let blocks = text.split("```toml ").skip(1);
    blocks
        .map(|block| {
            let (name, rest) = block.split_once('\n').expect("a name");
            let (body, _) = rest.split_once("```").expect("an end");
            (name.to_owned(), body.to_owned())
        })
        .collect()
}

fn needs_more_than_rust(command: &str) -> bool {
    command.contains("qemu") || command.starts_with("firmware/") || command.starts_with("tests/")
}

/// Runs them one after the other in one folder, as a reader would with `yawrig` in the path.
fn run(commands: &[String]) {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files() {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let programs = yawrig_tests::process::binary().parent().unwrap().to_owned();
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap());
    for command in commands {
        let line = command.replace("cargo run --release -- ", "yawrig ");
        let line = match line.starts_with("firmware/") || line.starts_with("tests/") {
            true => format!("{}/{line}", root().display()),
            false => line,
        };
        // A page is served until its reader has seen enough.
        if let Some(arguments) = line.strip_prefix("yawrig workbench") {
            let served = yawrig_tests::process::yawrig("workbench").in_folder(folder.path());
            let mut served = arguments.split_whitespace().fold(served, |y, a| y.and(a)).start();
            served.prints("http://");
            served.catches_interrupts();
            served.signal(nix::sys::signal::Signal::SIGINT);
            served.ends().exits(130);
            continue;
        }
        let output = Command::new("sh")
            .args(["-c", &line])
            .env("PATH", &path)
            .current_dir(folder.path())
            .output()
            .unwrap();
        assert!(
            output.status.success(),
            "{command}: {}\n{}\n{}",
            output.status,
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr)
        );
        // There may be no ports to list; everything else has something to say.
        assert!(
            !output.stdout.is_empty() || command.contains("ports") || command.contains("--out"),
            "{command} prints nothing"
        );
    }
}

#[test]
fn commands_of_the_readme() {
    let commands: Vec<String> =
        commands().into_iter().filter(|c| !needs_more_than_rust(c)).collect();
    run(&commands);
}

/// The page of Python, with pandas where it is installed, else with as much of it as it takes.
#[test]
fn python_of_the_readme() {
    let script = lines_of("```python").join("\n");
    assert!(script.contains("json_normalize"), "{script}");
    let folder = tempfile::tempdir().unwrap();
    let program = yawrig_tests::process::binary();
    let python = |text: &str| {
        let path =
            format!("{}:{}", program.parent().unwrap().display(), std::env::var("PATH").unwrap());
        let run = Command::new("python3")
            .args(["-c", text])
            .env("PATH", path)
            .current_dir(folder.path())
            .output();
        run.expect("python3")
    };
    let rubbing = "simulate --natural-frequency 7.5 --damping 0.008 --effect coulomb_friction:c=0.05 --seconds 30 --out rubbing.csv";
    for command in [
        "simulate --spring K4 --wind 10 --out release.csv",
        "simulate --campaign campaign",
        rubbing,
        "fit rubbing.csv",
    ] {
        yawrig_tests::process::yawrig(command).in_folder(folder.path()).run().exits(0);
    }
    if !python("import pandas").status.success() {
        let flat = "def json_normalize(data, record_path=None, meta=()):\n    \
            if record_path is None:\n        return list(data)\n    \
            return [{**row, **{name: of[name] for name in meta}} for of in data for row in of[record_path]]\n";
        std::fs::write(folder.path().join("pandas.py"), flat).unwrap();
    }
    let shown = format!("{script}\nprint(len(estimates), len(points), len(steps), len(history))");
    let ran = python(&shown);
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    assert_eq!(String::from_utf8_lossy(&ran.stdout).trim(), "3 8 2 1");
}

/// Where a board is needed, each verb and flag must at least be there.
#[test]
fn commands_of_the_readme_that_need_hardware_parse() {
    let commands = lines_of("```sh hardware");
    let ours: Vec<&String> = commands.iter().filter(|c| c.starts_with("yawrig ")).collect();
    assert!(ours.len() >= 3, "{commands:?}");
    run(&ours.iter().map(|command| format!("{command} --help")).collect::<Vec<_>>());
    // The image that is written to it lies where it is built.
    let image = commands.iter().find_map(|c| c.strip_prefix("probe-rs run --chip STM32F446RETx "));
    let image = Path::new(image.expect("it is written to the board"));
    assert!(root().join(image).ancestors().nth(4).unwrap().join("Cargo.toml").is_file());
}

#[test]
#[ignore = "needs QEMU: tests/run runs it"]
fn commands_of_the_readme_that_need_qemu() {
    let mut chosen: Vec<String> = commands()
        .into_iter()
        // tests/run runs this test, and is the one command that a test cannot run.
        .filter(|c| {
            (needs_more_than_rust(c) && c != "tests/run") || c.contains("simulate --spring")
        })
        .collect();
    chosen.dedup();
    assert!(chosen.len() >= 4, "{chosen:?}");
    run(&chosen);
}
