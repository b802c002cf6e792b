//! What is written to a terminal and what to a pipe: colours and bars.

use yawrig_tests::process::yawrig;

/// Help, errors of the arguments and of a file, and a bar.
const COMMANDS: [(&str, i32); 5] = [
    ("--help", 0),
    ("dance", 2),
    ("identify --metod all r.csv", 2),
    ("identify absent.csv", 3),
    ("train --samples 300 --epochs 20 --out network.yrn", 0),
];

/// Whether `ESC [ ... m`, a colour or another attribute of letters, is in it.
fn is_coloured(text: &str) -> bool {
    text.split("\x1b[").skip(1).any(|rest| {
        rest.find(|c: char| c.is_ascii_alphabetic()).is_some_and(|at| rest[at..].starts_with('m'))
    })
}

#[test]
fn no_colour_where_none_is_wanted() {
    let folder = tempfile::tempdir().expect("a folder");
    let on = |command: &str, no_color, term| {
        let command = yawrig(command).in_folder(folder.path()).with_env("CLICOLOR_FORCE", None);
        // A build server's terminal is taken for one with colours, whatever TERM says.
        let command = command.with_env("CI", None);
        command.with_env("NO_COLOR", no_color).with_env("TERM", Some(term)).run_on_terminal()
    };
    // Where nothing is said, there are colours, so that this can fail.
    assert!(is_coloured(&on("--help", None, "xterm").exits(0).stdout));
    for (no_color, term) in [(Some("1"), "xterm-256color"), (None, "dumb")] {
        for (command, code) in COMMANDS {
            let ended = on(command, no_color, term).exits(code);
            assert!(!ended.stdout.is_empty());
            assert!(!is_coloured(&ended.stdout), "{:?}", ended.stdout);
        }
    }
    let (bar, _) = COMMANDS[4];
    let drawn = on(bar, Some("1"), "xterm").exits(0);
    assert!(drawn.stdout.contains('\r') && drawn.stdout.contains("/20 "), "{:?}", drawn.stdout);
}

#[test]
fn no_escapes_in_a_pipe() {
    let folder = tempfile::tempdir().expect("a folder");
    for (command, code) in COMMANDS {
        let ended = yawrig(command).in_folder(folder.path()).with_env("CLICOLOR_FORCE", None);
        let ended = ended.with_env("TERM", Some("xterm")).run().exits(code);
        for text in [&ended.stdout, &ended.stderr] {
            assert!(!text.contains('\x1b') && !text.contains('\r'), "{text:?}");
        }
    }
}
