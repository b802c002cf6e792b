//! Ctrl-C and Cancel.

use crate::bench::{Bench, RUBBING};
use nix::sys::signal::Signal;
use serde_json::{json, Value};
use std::io::{Read, Write};
use std::net::TcpStream;

/// A stream of news that is open, as that of a tab.
fn tab(bench: &Bench) -> TcpStream {
    let mut stream = TcpStream::connect(bench.host()).expect("a connection");
    let head = format!("GET /api/news HTTP/1.1\r\n{}\r\n\r\n", bench.ours().join("\r\n"));
    stream.write_all(head.as_bytes()).expect("room");
    let mut first = [0; 15];
    stream.read_exact(&mut first).expect("an answer");
    assert_eq!(&first, b"HTTP/1.1 200 OK");
    stream
}

#[test]
fn ctrl_c_ends_it_with_tabs_open() {
    for signal in [Signal::SIGINT, Signal::SIGTERM] {
        let bench = Bench::start(&[RUBBING], "rubbing.csv");
        let _tabs = [tab(&bench), tab(&bench)];
        let mut running = bench.running;
        running.catches_interrupts();
        running.signal(signal);
        running.ends().exits(130).says("interrupted");
    }
}

#[test]
fn ctrl_c_ends_it_in_the_middle_of_a_fit() {
    let campaign =
        "simulate --campaign rig --seconds 20 --rate-hz 200 --effect coulomb_friction:c=0.05";
    let bench = Bench::start(&[campaign], "rig/campaign.toml");
    assert_eq!(bench.act(&json!({"do": "judge"})).0, 200);
    bench.wait("work", |state| !state["job"].is_null() || !state["ended"].is_null());
    let _tab = tab(&bench);
    bench.running.signal(Signal::SIGINT);
    let folder = bench.folder;
    bench.running.ends().exits(130);
    assert!(!folder.path().join("model.toml").exists());
}

/// Begins `job` and cancels it; whether it was under way for all of that. It may have ended before: then it
/// is taken back.
fn is_cancelled(bench: &Bench, job: &Value) -> bool {
    assert_eq!(bench.act(job).0, 200);
    let looked = |state: &Value| state["job"]["looks"].as_u64().is_some_and(|looks| looks > 0);
    bench.wait("work", |state| looked(state) || !state["ended"].is_null());
    // One thing at a time, and said so.
    let (status, refused) = bench.act(&json!({"do": "fit"}));
    if status == 409 {
        let why = refused["error"]["message"].as_str().expect("why");
        assert!(why.contains("under way"), "{refused}");
        assert_eq!(bench.act(&json!({"do": "cancel"})).0, 200);
    }
    let state = bench.wait("an end", |state| state["job"].is_null() && !state["ended"].is_null());
    let is_cancelled =
        state["ended"]["message"].as_str().is_some_and(|why| why.contains("cancelled"));
    if !is_cancelled {
        println!("{job} had ended: {}", state["ended"]);
        bench.act(&json!({"do": "remove", "effect": "coulomb_friction"}));
        bench.wait("taken back", |state| state["job"].is_null() && !state["ended"].is_null());
    }
    is_cancelled
}

#[test]
fn a_fit_is_cancelled_and_nothing_is_changed() {
    let campaign =
        "simulate --campaign rig --seconds 20 --rate-hz 200 --effect coulomb_friction:c=0.05";
    let bench = Bench::start(&[campaign], "rig/campaign.toml");
    for job in [json!({"do": "judge"}), json!({"do": "add", "effect": "coulomb_friction"})] {
        while !is_cancelled(&bench, &job) {}
    }
    // Made ready in the background all the same, and fit to go on.
    bench.wait("badges", |state| {
        state["releases"]
            .as_array()
            .is_some_and(|all| all.iter().all(|r| r["badge"] == "structured"))
    });
}
