//! Every command of the README and of the book, as it stands there: each page in a folder of its own.

use crate::pages::{pages, root, Page, Step};
use serde_json::Value;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Mutex;

fn needs_more_than_rust(command: &str) -> bool {
    command.contains("qemu") || command.starts_with("firmware/") || command.starts_with("tests/")
}

fn commands_of(page: &Page) -> Vec<String> {
    let steps = page.steps().into_iter();
    steps.filter_map(|step| if let Step::Run(line) = step { Some(line) } else { None }).collect()
}

/// A page being worked through in a folder, as a reader would with `yawrig` in the path.
struct Walk<'a> {
    folder: &'a Path,
    /// What the last command printed, and all of the last block.
    stdout: String,
    block: String,
    new_block: bool,
}

impl Walk<'_> {
    fn command(&self, program: &str, arguments: &[&str]) -> std::process::Output {
        let programs = yawrig_tests::process::binary().parent().expect("its folder");
        let path = format!("{}:{}", programs.display(), std::env::var("PATH").expect("a path"));
        let mut command = Command::new(program);
        let command = command.args(arguments).env("PATH", path).current_dir(self.folder);
        command.output().unwrap_or_else(|e| panic!("{program}: {e}"))
    }

    fn run(&mut self, command: &str) -> Result<(), String> {
        let line = command.replace("cargo run --release -- ", "yawrig ");
        let line = match line.starts_with("firmware/") || line.starts_with("tests/") {
            true => format!("{}/{line}", root().display()),
            false => line,
        };
        // A page is served until its reader has seen enough.
        let served = line.strip_prefix("yawrig workbench").filter(|a| !a.contains("--static"));
        if let Some(arguments) = served {
            let served = yawrig_tests::process::yawrig("workbench").in_folder(self.folder);
            let mut served = arguments.split_whitespace().fold(served, |y, a| y.and(a)).start();
            served.prints("http://");
            served.catches_interrupts();
            served.signal(nix::sys::signal::Signal::SIGINT);
            served.ends().exits(130);
            return Ok(());
        }
        let output = self.command("sh", &["-c", &line]);
        let [stdout, stderr] =
            [&output.stdout, &output.stderr].map(|b| String::from_utf8_lossy(b).into_owned());
        if !output.status.success() {
            return Err(format!("{command}: {}\n{stdout}\n{stderr}", output.status));
        }
        // There may be no ports to list; everything else has something to say.
        let may_be_silent = ["ports", "--out", " > ", " >> "];
        if stdout.is_empty() && !may_be_silent.iter().any(|part| command.contains(part)) {
            return Err(format!("{command} prints nothing"));
        }
        if std::mem::take(&mut self.new_block) {
            self.block.clear();
        }
        self.block.push_str(&stdout);
        self.block.push_str(&stderr);
        self.stdout = stdout;
        Ok(())
    }

    /// Whether the last block printed these lines in this order; numbers may be others.
    fn prints(&self, shown: &[String]) -> Result<(), String> {
        let mut printed = self.block.lines().map(without_numbers);
        for line in shown {
            let line = without_numbers(line);
            if !printed.any(|printed| printed == line) {
                return Err(format!("is not printed (any more) there: {line}\n{}", self.block));
            }
        }
        Ok(())
    }

    fn field(&self, field: &str) -> Result<(), String> {
        let shown: Value =
            serde_json::from_str(&self.stdout).map_err(|e| format!("{field}: {e}"))?;
        match holds(&shown, field) {
            true => Ok(()),
            false => Err(format!("no {field} in {}", self.stdout)),
        }
    }

    /// Runs it with pandas where that is installed, else with as much of it as it takes. Where a line prints
    /// something, what that is stands behind it.
    fn python(&self, script: &str) -> Result<(), String> {
        if !self.command("python3", &["-c", "import pandas"]).status.success() {
            let flat = "def json_normalize(data, record_path=None, meta=()):\n    \
                if record_path is None:\n        return list(data)\n    \
                return [{**row, **{name: of[name] for name in meta}} for of in data for row in of[record_path]]\n";
            std::fs::write(self.folder.join("pandas.py"), flat).expect("a file");
        }
        let prints = script.lines().filter(|line| line.starts_with("print("));
        let expected: Vec<&str> =
            prints.filter_map(|line| Some(line.rsplit_once("# ")?.1)).collect();
        let ran = self.command("python3", &["-c", script]);
        let printed = String::from_utf8_lossy(&ran.stdout);
        match ran.status.success() && !expected.is_empty() && printed.lines().eq(expected) {
            true => Ok(()),
            false => Err(format!("{printed}\n{}", String::from_utf8_lossy(&ran.stderr))),
        }
    }
}

/// A line by its words: each number a `#`, and no matter how many blanks.
fn without_numbers(line: &str) -> String {
    let word = |word: &str| {
        let bare = word.trim_matches(|c| "()%,;:".contains(c));
        let mask = |c: char| if c.is_ascii_digit() { '#' } else { c };
        match bare.parse::<f64>() {
            Ok(_) => word.replacen(bare, "#", 1),
            Err(_) => word.chars().map(mask).collect(),
        }
    };
    line.split_whitespace().map(word).collect::<Vec<_>>().join(" ")
}

/// Whether there is a value at `path`, `[]` being any item of a list.
fn holds(value: &Value, path: &str) -> bool {
    let (name, rest) = path.split_once('.').unwrap_or((path, ""));
    let (name, in_list) = name.strip_suffix("[]").map_or((name, false), |name| (name, true));
    let Some(inner) = value.get(name) else { return false };
    let goes_on = |inner: &Value| rest.is_empty() || holds(inner, rest);
    match inner.as_array() {
        Some(items) if in_list => items.iter().any(goes_on),
        _ => !in_list && goes_on(inner),
    }
}

/// Works through a page in an empty folder, leaving out the commands that are not `chosen`.
fn walk(page: &Page, chosen: &dyn Fn(&str) -> bool) -> Result<(), String> {
    let folder = tempfile::tempdir().expect("a folder");
    let steps = page.steps();
    for step in &steps {
        if let Step::File(name, text) = step {
            std::fs::write(folder.path().join(name), text).expect("a file");
        }
    }
    let (stdout, block) = (String::new(), String::new());
    let mut walk = Walk { folder: folder.path(), stdout, block, new_block: true };
    for step in &steps {
        let done = match step {
            Step::Run(line) if chosen(line) => walk.run(line),
            Step::Ran => {
                walk.new_block = true;
                Ok(())
            }
            Step::Prints(lines) => walk.prints(lines),
            Step::Python(script) => walk.python(script),
            Step::Field(field) => walk.field(field),
            Step::Run(_) | Step::Hardware(_) | Step::File(..) => Ok(()),
        };
        done.map_err(|why| format!("{}: {why}", page.path.display()))?;
    }
    Ok(())
}

/// Works through pages, as many at once as there are cores.
fn walk_all(pages: &[Page], chosen: &(dyn Fn(&str) -> bool + Sync)) {
    let next = AtomicUsize::new(0);
    let failed = Mutex::new(Vec::new());
    let work = || {
        while let Some(page) = pages.get(next.fetch_add(1, Ordering::Relaxed)) {
            if let Err(why) = walk(page, chosen) {
                failed.lock().expect("the list").push(why);
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(2, usize::from) {
            scope.spawn(work);
        }
    });
    let failed = failed.into_inner().expect("the list");
    assert!(failed.is_empty(), "{}", failed.join("\n\n"));
}

/// All of them, or those with `YAWRIG_PAGE` in their path.
#[test]
fn commands_of_every_page() {
    let mut pages = pages();
    let named = |name: &str| {
        pages.iter().filter(|p| !commands_of(p).is_empty()).any(|p| p.path.ends_with(name))
    };
    assert!(["README.md", "tutorial/rig.md", "how-to/law.md", "reference/json.md"]
        .into_iter()
        .all(named));
    if let Ok(part) = std::env::var("YAWRIG_PAGE") {
        pages.retain(|page| page.path.to_string_lossy().contains(&part));
        assert!(!pages.is_empty(), "no page has {part} in its path");
    }
    walk_all(&pages, &|command| !needs_more_than_rust(command));
}

/// Where a board is needed, each verb and flag must at least be there, and the board whose image is written.
#[test]
fn commands_that_need_hardware_parse() {
    let steps = pages().iter().flat_map(Page::steps).collect::<Vec<_>>();
    let lines =
        steps.iter().filter_map(|s| if let Step::Hardware(line) = s { Some(line) } else { None });
    let (mut ours, mut boards) = (String::new(), Vec::new());
    for line in lines {
        if line.starts_with("yawrig ") {
            ours.push_str(&format!("{line} --help\n"));
        }
        if let Some(board) = line.strip_prefix("yawrig device install ") {
            assert!(root().join("firmware/boards").join(board).join("Cargo.toml").is_file());
            boards.push(board);
        }
    }
    assert!(ours.lines().count() >= 5 && boards.len() == 3, "{ours}");
    let page = Page { path: "boards".into(), text: format!("```sh\n{ours}```\n") };
    walk(&page, &|_| true).unwrap_or_else(|why| panic!("{why}"));
}

#[test]
#[ignore = "needs QEMU: tests/run runs it"]
fn commands_that_need_qemu() {
    // tests/run runs this test, and is the one command that a test cannot run.
    let chosen = |command: &str| command != "tests/run";
    let mut pages = pages();
    pages.retain(|page| commands_of(page).iter().any(|c| needs_more_than_rust(c) && chosen(c)));
    assert!(pages.iter().flat_map(commands_of).count() >= 4);
    walk_all(&pages, &chosen);
}

#[test]
fn what_is_wrong_on_a_page_is_said() {
    let try_out = |text: &str| walk(&Page { path: "p".into(), text: text.to_owned() }, &|_| true);
    let command = "```sh\necho 'wn 12.3 rad/s'\n```\n";
    assert_eq!(try_out(&format!("{command}```text output\n wn  4.5 rad/s\n```\n")), Ok(()));
    for wrong in [
        "```sh\nfalse\n```\n",
        "```sh\ntrue\n```\n",
        &format!("{command}```text output\nwn 12.3 deg/s\n```\n"),
        &format!("{command}```text output\nwn 12.3 rad/s\nwn 12.3 rad/s\n```\n"),
        "```sh\necho '{\"a\": [{\"b\": 1}]}'\n```\n| field |\n|---|\n| `a[].c` | |\n",
        "```python\nprint(1)  # 2\n```\n",
    ] {
        assert!(try_out(wrong).is_err(), "{wrong}");
    }
    assert_eq!(
        try_out("```sh\necho '{\"a\": [{\"b\": 1}]}'\n```\n| field |\n|---|\n| `a[].b` | |\n"),
        Ok(())
    );
}
