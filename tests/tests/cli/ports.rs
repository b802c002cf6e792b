//! Ports that do not open, each with its own message.

use std::os::unix::fs::PermissionsExt;
use yawrig_link::client::Client;
use yawrig_link::emulated;
use yawrig_link::hub::Hub;
use yawrig_link::terminal::Terminal;
use yawrig_tests::line::{Board, Line};
use yawrig_tests::networks;
use yawrig_tests::process::{yawrig, yawrig_as_anybody};

#[test]
fn a_port_that_is_not_there() {
    for verb in ["device", "monitor"] {
        let ended = yawrig(verb).and("--device").and("/dev/ttyNONE9").run().exits(4).helps();
        ended.says("cannot open port /dev/ttyNONE9: there is no such port").says("yawrig ports");
    }
}

#[test]
fn a_file_a_folder_and_a_device_that_is_no_port() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("record.csv");
    std::fs::write(&file, "time_s,yaw_deg\n").expect("room for it");
    for path in [file.as_path(), folder.path(), "/dev/null".as_ref(), "/dev/zero".as_ref()] {
        let ended = yawrig("device --device").and(path).run().exits(4).helps();
        ended.says(&path.display().to_string()).says("it is not a serial port");
    }
    // Looking at it has not changed it.
    assert_eq!(std::fs::read(&file).expect("the file"), b"time_s,yaw_deg\n");
}

#[test]
fn a_port_one_may_not_open() {
    let line = Line::new(|_| Some(Vec::new()));
    let forbid = std::fs::Permissions::from_mode(0o000);
    std::fs::set_permissions(line.path(), forbid).expect("a terminal of ours");
    let ended = yawrig_as_anybody("device --device").and(line.path()).run().exits(4).helps();
    ended.says(&line.path().display().to_string()).says("you may not open it").says("dialout");
}

#[test]
fn a_port_that_opens_again_after_each_use() {
    let line = Board::default().plug();
    for _ in 0..5 {
        yawrig_as_anybody("device --device").and(line.path()).run().exits(0);
    }
}

/// As where there are no pseudo-terminals.
#[test]
fn a_device_behind_a_socket() {
    let folder = tempfile::tempdir().expect("a folder");
    let network = folder.path().join("network.yrn");
    std::fs::write(&network, networks::sound()).expect("room for it");
    let (device, _potentiometer) = emulated::start();
    let socket = || Terminal::socket().expect("a socket");
    let hub = Hub::between(device, socket(), socket()).expect("a thread");
    let path = hub.shared_path();
    let flashed = yawrig("flash --device").and(path).and(&network).run().exits(0);
    assert!(flashed.stdout.contains("written and verified"), "{}", flashed.report());
    let object = yawrig("device --json --device").and(path).run().exits(0).json();
    assert_eq!(object["network"]["id"], networks::id(&networks::sound()), "{object}");
    let seen = yawrig("doctor --device").and(path).run().exits(0);
    assert!(seen.stdout.contains("answers"), "{}", seen.report());
    let client = Client::open(path).expect("nobody has it");
    for verb in ["device", "doctor"] {
        let ended = yawrig(verb).and("--device").and(path).run().exits(4).helps();
        ended.says("another program has it open");
    }
    drop(client);
    let path = path.to_owned();
    drop(hub);
    let ended = yawrig("device --device").and(&path).run().exits(4).helps();
    ended.says("no program has a device there");
}

#[test]
fn ports_lists_what_there_is() {
    let object = yawrig("ports --json").run().exits(0).json();
    for port in object["ports"].as_array().expect("a list") {
        assert!(port["path"].is_string() && port["description"].is_string(), "{port}");
    }
    yawrig("ports").run().exits(0);
}
