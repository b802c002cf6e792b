//! Two shells and one emulated device: what one swings, the other follows, asks and writes to.

use nix::sys::signal::Signal;
use serde_json::Value;
use std::time::Duration;
use yawrig_link::bench::{Bench, Target};
use yawrig_rig::{Rig, Sensor, Start};
use yawrig_tests::networks;
use yawrig_tests::process::{yawrig, yawrig_as_anybody, Ended, Running, Yawrig};

/// A device that swings in the background, and its path.
pub fn swinging() -> (Running, String) {
    let mut monitor = yawrig("monitor --device emulated --speed 50").start();
    let path = monitor.shared_path();
    (monitor, path)
}

/// A device whose model is not let go: a network is on trial for so many samples, not for so long a time.
pub fn standing_still() -> Bench {
    Bench::open(&Target::Emulated).expect("a device")
}

pub fn device(path: &str) -> Value {
    yawrig("device --json --device").and(path).run().exits(0).json()
}

#[test]
fn another_shell_asks_for_the_device() {
    let (_monitor, path) = swinging();
    let object = device(&path);
    assert!(object["firmware"].as_str().is_some_and(|f| f.starts_with("yawrig ")), "{object}");
    assert_eq!(object["protocol"], 1);
    assert_eq!(object["network"]["id"], networks::id(&networks::sound()));
    assert_eq!(object["network"]["topology"], "41-6-2");
    assert!(object["network"]["generation"].is_u64());
    let slots = object["slots"].as_array().expect("slots");
    assert_eq!(slots.len(), 2);
    for slot in slots {
        assert_eq!(slot["state"], "empty");
        assert!(slot["generation"].is_null() && slot["id"].is_null());
    }
    let ended = yawrig("device --device").and(&path).run().exits(0);
    assert!(ended.stdout.contains("compiled in"), "{}", ended.report());
}

/// A device that is swung by the test, and not by the clock.
struct Swung {
    bench: Bench,
    rig: Rig,
    path: String,
    releases: u64,
}

impl Swung {
    fn new() -> Self {
        let bench = Bench::open(&Target::Emulated).expect("a device");
        let path = bench.shared_path().to_owned();
        Self { bench, rig: Rig::default(), path, releases: 0 }
    }

    /// Swings once; how many results there are by then.
    fn swing(&mut self) -> u16 {
        let condition = self.rig.conditions(10.0).nth(9).expect("a condition");
        let (start, sensor) = (Start::default(), Sensor::default());
        let release = self.rig.release(&condition, &start, &sensor, self.releases);
        self.releases += 1;
        let samples = release.expect("a release").samples.filter_map(|s| s.counts);
        for some in samples.collect::<Vec<_>>().chunks(1000) {
            self.bench.play(some).expect("it takes them");
        }
        self.bench.client.status().expect("its state").next_event
    }

    /// Starts a follower and swings until it has ended: again once it has printed `word`, as it does for each
    /// release.
    fn until_it_ends(&mut self, follower: Yawrig, word: &str) -> Ended {
        let mut follower = follower.and(&self.path).start();
        // From when it listens on.
        follower.says("on emulated");
        let mut times = 0;
        while follower.runs() {
            self.swing();
            times += 1;
            while follower.runs() && follower.printed_times(word) < times {
                std::thread::sleep(Duration::from_millis(5));
            }
        }
        follower.ends()
    }
}

#[test]
fn another_shell_follows_the_releases() {
    let mut swung = Swung::new();
    let follower = yawrig("monitor --jsonl --releases 2 --device");
    let ended = swung.until_it_ends(follower, "\"refined\"").exits(0);
    let events = ended.json_lines();
    let releases: Vec<&Value> = events.iter().filter(|e| e["event"] == "release").collect();
    assert_eq!(releases.len(), 2);
    // After the last release comes what belongs to it.
    let last = events.last().map(|event| &event["event"]);
    assert!(last.is_some_and(|name| ["release", "refined", "phase"].iter().any(|n| name == n)));
    for event in &events {
        assert_eq!(event["schema_version"], 1);
        match event["event"].as_str() {
            Some("phase") => assert!(event["phase"].is_string() && event["at_sample"].is_u64()),
            Some("window") => {
                assert!(event["natural_frequency_rad_s"].is_f64(), "{event}");
                assert!(event["damping_ratio"].is_f64() && event["amplitude_deg"].is_f64());
            }
            Some("release") => {
                assert!(event["usable"].is_boolean() && event["flags"].is_array(), "{event}");
                assert!(event["natural_frequency_rad_s"]["value"].is_f64(), "{event}");
                assert!(event["natural_frequency_rad_s"]["u"].is_f64(), "{event}");
            }
            Some("refined") => assert!(event["misfit"].is_boolean(), "{event}"),
            Some("device") => assert!(event["device"]["firmware"].is_string(), "{event}"),
            other => panic!("{other:?} in {event}"),
        }
    }
    let follower = yawrig("monitor --releases 1 --device");
    let ended = swung.until_it_ends(follower, "rad/s, zeta").exits(0);
    assert!(ended.stdout.contains("rad/s, zeta"), "{}", ended.report());
}

#[test]
fn who_comes_late_sees_what_happens_and_not_what_was_waiting_on_the_line() {
    let mut swung = Swung::new();
    // By then much more has been said than a line holds that nobody reads.
    let said = (0..40).map(|_| swung.swing()).last().expect("releases");
    assert!(said > 400, "{said} results");
    let late = yawrig("monitor --jsonl --releases 1 --device");
    let ended = swung.until_it_ends(late, "\"refined\"").exits(0);
    assert!(!ended.stderr.contains("lost"), "{}", ended.report());
    for event in ended.json_lines().into_iter().filter(|event| event["event"] != "device") {
        assert!(event["release"].as_u64().is_some_and(|number| number >= 40), "{event}");
    }
}

#[test]
fn another_shell_writes_networks_to_both_slots() {
    let bench = standing_still();
    let path = bench.shared_path().to_owned();
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("trained.yrn");
    yawrig("train --samples 200 --epochs 20 --out").and(&file).run().exits(0);
    let id = networks::id(&std::fs::read(&file).expect("the network"));

    let flash = || yawrig("flash --json --device").and(&path).and(&file).run().exits(0).json();
    let first = flash();
    assert_eq!(first["verified"], true);
    assert_eq!(first["network"]["id"], id.as_str());
    assert_eq!(first["network"]["generation"], 1);
    let object = device(&path);
    assert_eq!(object["network"]["id"], id.as_str());
    assert_eq!(object["slots"][0]["state"], "valid");
    assert_eq!(object["slots"][0]["generation"], 1);
    assert_eq!(object["slots"][0]["id"], id.as_str());
    assert_eq!(object["slots"][1]["state"], "empty");

    assert_eq!(flash()["network"]["generation"], 2);
    let object = device(&path);
    assert_eq!(object["network"]["generation"], 2);
    assert_eq!(object["running_slot"], 1);
    assert_eq!(object["slots"][0]["generation"], 1);
    assert_eq!(object["slots"][1]["state"], "valid");
    assert_eq!(object["slots"][1]["generation"], 2);

    // The third takes the place of the oldest.
    assert_eq!(flash()["network"]["generation"], 3);
    let object = device(&path);
    assert_eq!(object["slots"][0]["generation"], 3);
    assert_eq!(object["slots"][1]["generation"], 2);
}

#[test]
fn a_port_in_use_is_refused_and_the_user_of_it_is_not_disturbed() {
    let (_monitor, path) = swinging();
    let mut first = yawrig("monitor --device").and(&path).start();
    first.prints("window");
    for again in [yawrig("monitor --device"), yawrig_as_anybody("device --device")] {
        let ended = again.and(&path).run().exits(4).helps();
        let ended = ended.says(&format!("cannot open port {path}: another program has it open"));
        assert!(!ended.stderr.contains("PORT"), "{}", ended.report());
    }
    first.prints("release");
    assert!(first.runs());
}

#[test]
fn a_follower_that_was_killed_leaves_the_port_free() {
    let (_monitor, path) = swinging();
    for _ in 0..2 {
        let mut follower = yawrig_as_anybody("monitor --device").and(&path).start();
        follower.prints("window");
        follower.signal(Signal::SIGKILL);
        assert_eq!(follower.ends().code, -9);
    }
    yawrig_as_anybody("device --device").and(&path).run().exits(0);
}

#[test]
fn the_device_ends_with_its_shell() {
    let (swinging, path) = swinging();
    let mut follower = yawrig("monitor --device").and(&path).start();
    follower.prints("window");
    drop(swinging);
    follower.ends().exits(4).says("is gone").says(&path).helps();
}

#[test]
fn monitor_gives_up_after_the_given_seconds() {
    let (_monitor, path) = swinging();
    let ended = yawrig("monitor --seconds 0.5 --releases 100000 --device").and(&path).run();
    ended.exits(7).says("releases of 100000");
    yawrig("monitor --seconds 0.1 --device").and(&path).run().exits(0);
}
