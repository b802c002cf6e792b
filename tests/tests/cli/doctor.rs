//! What `doctor` names, and the command it gives.

use serde_json::Value;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use yawrig_shared::wire::{self, HelloReply, HELLO_KEY};
use yawrig_tests::line::{Board, Line};
use yawrig_tests::process::{yawrig, yawrig_as_anybody};

/// The one check of a port: its state, what was found and the command.
fn of(object: &Value) -> (String, String, String) {
    let checks = object["checks"].as_array().expect("a list");
    assert_eq!(checks.len(), 1, "{object}");
    let text = |key: &str| checks[0][key].as_str().unwrap_or_default().to_owned();
    (text("state"), text("found"), text("command"))
}

fn port(path: &Path, code: i32) -> (String, String, String) {
    let ended = yawrig("doctor --json --device").and(path).run().exits(code);
    let found = of(&ended.json());
    let text = yawrig("doctor --device").and(path).run().exits(code);
    assert!(text.stdout.contains(&found.2), "{}", text.report());
    found
}

#[test]
fn a_device_that_is_well() {
    let line = Board::default().plug();
    let (state, found, command) = port(line.path(), 0);
    assert_eq!((state.as_str(), command.as_str()), ("well", ""));
    assert!(found.contains("on the bench answers"), "{found}");
}

#[test]
fn a_port_that_is_not_there_or_none() {
    assert_eq!(port("/dev/ttyNONE9".as_ref(), 4).2, "yawrig ports");
    let (_, found, _) = port("/etc/hostname".as_ref(), 4);
    assert!(found.contains("not a serial port"), "{found}");
}

#[test]
fn who_holds_the_port_is_named() {
    let line = Board::default().plug();
    let mut holder = yawrig("monitor --device").and(line.path()).start();
    holder.says("yawrig ");
    let (state, found, command) = port(line.path(), 4);
    assert_eq!(state, "wrong");
    let named =
        format!("yawrig monitor --device {} (process {})", line.path().display(), holder.pid());
    assert!(found.contains(&named) && found.contains("Ctrl-C where it runs"), "{found}");
    assert_eq!(command, format!("kill -INT {}", holder.pid()));
    // Who opens it is told the same.
    let ended = yawrig("device --device").and(line.path()).run().exits(4).helps();
    ended.says("another program has it open").says(&named).says(&command);
    assert!(holder.runs(), "doctor only names it");
}

/// It takes bytes from the device's answers, and the port opens all the same.
#[test]
fn who_reads_a_port_that_opens_is_named() {
    for (mode, is_named) in [("<", true), ("<>", true), (">", false)] {
        let line = Board::default().plug();
        let script = format!("exec sleep 600 {mode} {}", line.path().display());
        let mut other =
            std::process::Command::new("sh").args(["-c", &script]).spawn().expect("a shell");
        let until = std::time::Instant::now() + yawrig_tests::PATIENCE;
        let is_named = if is_named { 4 } else { 0 };
        // The shell has still to open it.
        while std::fs::read_to_string(format!("/proc/{}/comm", other.id())).expect("it runs")
            != "sleep\n"
        {
            assert!(std::time::Instant::now() < until, "it does not begin");
        }
        let (state, found, command) = port(line.path(), is_named);
        if is_named == 4 {
            assert!(found.contains("answers, but sleep 600 (process"), "{found}");
            assert_eq!((state.as_str(), command), ("wrong", format!("kill {}", other.id())));
        } else {
            assert_eq!(state, "well", "{found}");
        }
        other.kill().and_then(|()| other.wait()).expect("it runs");
    }
}

#[test]
fn a_port_for_a_group_says_which_to_join() {
    let line = Line::new(|_| Some(Vec::new()));
    let set = |mode| {
        let permissions = std::fs::Permissions::from_mode(mode);
        std::fs::set_permissions(line.path(), permissions).expect("a terminal of ours");
    };
    set(0o000);
    let ended = yawrig_as_anybody("doctor --json --device").and(line.path()).run().exits(4);
    let (_, found, command) = of(&ended.json());
    assert!(found.contains("may not open it"), "{found}");
    assert!(command.contains("sudo chmod"), "{command}");
    // As a serial port is: readable and writable for its group, and this user not in it.
    if std::os::unix::fs::chown(line.path(), Some(1), Some(20)).is_ok() {
        set(0o660);
        let ended = yawrig_as_anybody("doctor --json --device").and(line.path()).run().exits(4);
        let (_, found, command) = of(&ended.json());
        assert!(found.contains("for the group dialout"), "{found}");
        assert_eq!(command, "sudo usermod -aG dialout $USER");
    }
}

#[test]
fn what_answers_wrongly_or_not_at_all() {
    let line = Line::new(|_| Some(Vec::new()));
    let (_, found, _) = port(line.path(), 7);
    assert!(found.contains("does not answer"), "{found}");

    let mut calls = 0_u32;
    let line = Line::new(move |asked| {
        calls += 1;
        Some(if calls.is_multiple_of(20) || !asked.is_empty() {
            b"$GPGGA,123519,4807.038,N\r\n".to_vec()
        } else {
            Vec::new()
        })
    });
    let (_, found, command) = port(line.path(), 4);
    assert!(found.contains("is not a yawrig device"), "{found}");
    assert_eq!(command, "yawrig ports");

    let hello = HelloReply {
        protocol: wire::REVISION,
        messages_key: 0xABCD_0123,
        firmware: HelloReply::text("yawrig 9.9"),
        board: HelloReply::text("tomorrow's"),
    };
    let mut decoder = wire::Decoder::new();
    let line = Line::new(move |bytes| {
        let mut said = Vec::new();
        for &byte in bytes {
            if let Some(Ok(frame)) = decoder.push(byte)
                && frame.key == HELLO_KEY
            {
                let reply = wire::encode_raw(HELLO_KEY, frame.sequence, &hello.write());
                said.extend(reply.expect("a frame"));
            }
        }
        Some(said)
    });
    let (_, found, _) = port(line.path(), 4);
    assert!(found.contains("yawrig 9.9") && found.contains("speaks protocol"), "{found}");
}

/// What would make its damping ratios better, where that is known of its converter.
#[test]
fn a_board_without_a_table_for_its_converter_is_told_what_helps() {
    let line = Board::named("pico").plug();
    let object = yawrig("doctor --json --device").and(line.path()).run().exits(0).json();
    let sensor = &object["checks"][1];
    assert_eq!((&sensor["check"], &sensor["state"]), (&"sensor".into(), &"missing".into()));
    let found = sensor["found"].as_str().expect("a text");
    for choice in ["in the middle 1.4 %", "four times the travel", "an AS5600", "an ADS1115"] {
        assert!(found.contains(choice), "{choice}: {found}");
    }
    let command = sensor["command"].as_str().expect("a command");
    assert!(command.starts_with("yawrig device linearity "), "{command}");
    let line = Board::named("nucleo-f446re").plug();
    let object = yawrig("doctor --json --device").and(line.path()).run().exits(0).json();
    assert_eq!(object["checks"].as_array().map(Vec::len), Some(1), "{object}");
}

#[test]
fn the_machine_is_looked_at_without_opening_a_port() {
    let object = yawrig("doctor --json").run().exits(0).json();
    let checks = object["checks"].as_array().expect("a list");
    for name in ["qemu-system-arm", "ARM toolchain", "chromium"] {
        let check = checks.iter().find(|check| check["check"] == name).expect(name);
        assert!(
            ["well", "missing"].contains(&check["state"].as_str().expect("a state")),
            "{check}"
        );
        assert_eq!(check["state"] == "missing", check["command"].is_string(), "{check}");
    }
}

#[test]
fn completions_for_each_shell() {
    for (shell, word) in [
        ("bash", "complete"),
        ("zsh", "#compdef"),
        ("fish", "complete -c"),
        ("powershell", "Register"),
    ] {
        let ended = yawrig("completions").and(shell).run().exits(0);
        assert!(ended.stdout.contains(word) && ended.stdout.contains("monitor"), "{shell}");
    }
}

#[test]
fn what_is_missing_comes_with_a_command_to_get_it() {
    // Nothing in the path but a program that is not one of those.
    let folder = tempfile::tempdir().expect("a folder");
    let ended = yawrig("doctor --json").with_env("PATH", folder.path().to_str()).run().exits(0);
    let object = ended.json();
    let checks = object["checks"].as_array().expect("a list");
    for name in ["qemu-system-arm", "ARM toolchain", "chromium"] {
        let check = checks.iter().find(|check| check["check"] == name).expect(name);
        if name != "ARM toolchain" {
            assert_eq!(check["state"], "missing", "{check}");
        }
        if let Some(command) = check["command"].as_str() {
            let begins = ["sudo apt-get install ", "curl ", "rustup target add "];
            assert!(begins.iter().any(|b| command.starts_with(b)), "{check}");
        }
    }
}
