//! Who is let in: this machine, this page, with this token.

use crate::bench::{Bench, RUBBING};
use serde_json::json;
use std::net::TcpStream;
use yawrig_tests::process::yawrig;

#[test]
fn strangers_are_refused_on_every_path() {
    let bench = Bench::start(&[RUBBING], "rubbing.csv");
    let host = format!("Host: {}", bench.host());
    let bearer = format!("Authorization: Bearer {}", bench.token);
    let port = bench.host().rsplit_once(':').expect("a port").1.to_owned();
    let cookie = format!("Cookie: yawrig-{port}={}", bench.token);
    let paths = [
        "GET /",
        "GET /workbench.js",
        "GET /api/state",
        "GET /api/news",
        "POST /api/do",
        "GET /nothing",
    ];
    for first in paths {
        let wrong = [
            ("no token", vec![host.clone()]),
            (
                "another token",
                vec![host.clone(), format!("Authorization: Bearer {}", "0".repeat(32))],
            ),
            (
                "part of the token",
                vec![host.clone(), format!("Authorization: Bearer {}", &bench.token[..31])],
            ),
            ("another's cookie", vec![host.clone(), format!("Cookie: yawrig-1={}", bench.token)]),
            (
                "a name that points here",
                vec![format!("Host: evil.example:{port}"), bearer.clone(), cookie.clone()],
            ),
            ("another port", vec!["Host: 127.0.0.1:1".to_owned(), bearer.clone()]),
            ("no host", vec![bearer.clone()]),
            (
                "a foreign page",
                vec![host.clone(), bearer.clone(), "Origin: http://evil.example".to_owned()],
            ),
            (
                "a page without origin",
                vec![host.clone(), cookie.clone(), "Origin: null".to_owned()],
            ),
            (
                "a foreign form",
                vec![host.clone(), cookie.clone(), "Sec-Fetch-Site: cross-site".to_owned()],
            ),
        ];
        for (what, lines) in wrong {
            let reply = bench.ask(first, &lines, "");
            assert!(
                reply.status == 403 || (what == "no host" && reply.status == 400),
                "{first}, {what}: {} {}",
                reply.status,
                reply.body
            );
            assert!(!reply.body.contains("rubbing"), "{first}, {what}: {}", reply.body);
        }
    }
    for lines in [vec![host.clone(), bearer], vec![host.clone(), cookie]] {
        assert_eq!(bench.ask("GET /api/state", &lines, "").status, 200);
    }
}

#[test]
fn the_token_leaves_the_address_and_the_page_is_kept_narrow() {
    let bench = Bench::start(&[RUBBING], "rubbing.csv");
    let host = vec![format!("Host: {}", bench.host())];
    let reply = bench.ask(&format!("GET /?token={}", bench.token), &host, "");
    assert_eq!(reply.status, 303, "{}", reply.head);
    assert!(reply.head.contains("location: /\r\n"), "{}", reply.head);
    assert!(reply.head.contains("httponly; samesite=strict"), "{}", reply.head);
    let page = bench.ask("GET /", &bench.ours(), "");
    assert_eq!(page.status, 200);
    for policy in
        ["default-src 'none'", "script-src 'self'", "connect-src 'self'", "frame-ancestors 'none'"]
    {
        assert!(page.head.contains(policy), "{}", page.head);
    }
    assert!(!page.head.contains("unsafe"), "{}", page.head);
    assert!(!page.body.contains("http://") && !page.body.contains("https://"), "{}", page.body);
    assert_ne!(bench.token, Bench::start(&[], "").token);
}

#[test]
fn other_addresses_of_this_machine_are_not_listened_on() {
    let bench = Bench::start(&[], "");
    let port = bench.host().rsplit_once(':').expect("a port").1.to_owned();
    assert_eq!(bench.host(), format!("127.0.0.1:{port}"));
    // Another address of the loopback network: a listener on all addresses would answer there too.
    assert!(TcpStream::connect(format!("127.0.0.2:{port}")).is_err());
    let mut open =
        yawrig("workbench --allow-remote 0.0.0.0").in_folder(bench.folder.path()).start();
    open.says("warning: everyone who can reach 0.0.0.0");
    let url = open.prints("http://127.0.0.1:");
    let port = url.split(':').nth(2).and_then(|rest| rest.split('/').next()).expect("a port");
    assert!(TcpStream::connect(format!("127.0.0.2:{port}")).is_ok());
}

#[test]
fn what_cannot_be_served_is_said_with_its_exit_code() {
    let bench = Bench::start(&[RUBBING], "rubbing.csv");
    let folder = bench.folder.path();
    let port = bench.host().rsplit_once(':').expect("a port").1;
    let run = |arguments: &str| yawrig(arguments).in_folder(folder).run();
    run(&format!("workbench rubbing.csv --port {port}"))
        .exits(4)
        .says("another program holds this port")
        .helps();
    run("workbench nothing.csv").exits(3).says("cannot read nothing.csv").helps();
    run("workbench rubbing.csv rubbing.csv").exits(2).says("given twice").helps();
    run("workbench rubbing.csv --allow-remote 192.0.2.1")
        .exits(4)
        .says("not an address of this machine");
    std::fs::write(folder.join("model.toml"), "schema_version = 1\n[[record]]\nfile = 3\n")
        .expect("room");
    run("workbench rubbing.csv").exits(3).says("model.toml:3").helps();
}

#[test]
fn a_bad_file_gets_a_badge_and_the_others_go_on() {
    let bench = {
        let folder = tempfile::tempdir().expect("a folder");
        yawrig(RUBBING).in_folder(folder.path()).run().exits(0);
        std::fs::write(folder.path().join("torn.csv"), "time_s,yaw_deg\n0,1\n0.1,two\n")
            .expect("room");
        let still: String =
            (0..4000).map(|k| format!("{:.3},0.5\n", f64::from(k) * 1e-3)).collect();
        std::fs::write(folder.path().join("still.csv"), format!("time_s,yaw_deg\n{still}"))
            .expect("room");
        Bench::start_in(folder, "rubbing.csv torn.csv still.csv")
    };
    let badge = |state: &serde_json::Value, k: usize| state["releases"][k]["badge"].clone();
    let state = bench.wait("badges", |state| (0..3).all(|k| badge(state, k) != "pending"));
    assert_eq!(
        [badge(&state, 0), badge(&state, 1), badge(&state, 2)],
        ["structured", "bad", "bad"]
    );
    let said = state["releases"][1]["fault"]["message"].as_str().expect("why");
    assert!(said.contains("torn.csv, line 3"), "{said}");
    assert!(state["releases"][2]["fault"]["message"].as_str().expect("why").contains("still.csv"));
    // Its ticks taken away, the rest can be fitted.
    let (status, _) = bench.act(&json!({"do": "tick", "releases": [1, 2], "used": "out"}));
    assert_eq!(status, 200);
    assert_eq!(bench.act(&json!({"do": "fit"})).0, 200);
    bench.wait("a step", |state| state["steps"].as_array().is_some_and(|s| s.len() == 1));
}

/// Eight releases on two springs; one of those with the wind off is not there.
pub fn campaign_with_a_gap() -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let command =
        "simulate --campaign rig --seconds 20 --rate-hz 200 --effect coulomb_friction:c=0.05";
    yawrig(command).in_folder(folder.path()).run().exits(0);
    let file = folder.path().join("rig/campaign.toml");
    let text = std::fs::read_to_string(&file).expect("a campaign");
    let (head, releases) = text.split_once("[[release]]").expect("releases");
    let kept: Vec<&str> = (releases.split("[[release]]"))
        .filter(|entry| ["K1", "K4"].iter().any(|k| entry.contains(&format!("\"{k}\""))))
        .collect();
    let text = format!("{head}[[release]]{}", kept.join("[[release]]"));
    std::fs::write(&file, &text).expect("room");
    let named = |line: &&str| line.starts_with("file") && line.contains("K1-mid-off");
    let line = text.lines().position(|line| named(&line)).expect("the release") + 1;
    std::fs::remove_file(folder.path().join("rig/K1-mid-off.csv")).expect("the record");
    (folder, format!("campaign.toml, line {}", line - 1))
}

#[test]
fn a_campaign_with_a_record_missing_opens_with_the_others() {
    let (folder, place) = campaign_with_a_gap();
    // The command line refuses it as it always does.
    let refused = yawrig("diagnose rig/campaign.toml").in_folder(folder.path()).run().exits(3);
    let refused = refused.says(&place).helps();
    let bench = Bench::start_in(folder, "rig/campaign.toml");
    let state = bench.wait("all looked at", |state| {
        state["releases"].as_array().is_some_and(|all| all.iter().all(|r| r["badge"] != "pending"))
    });
    let all = state["releases"].as_array().expect("releases");
    assert_eq!(all.len(), 8);
    let bad: Vec<usize> = (0..8).filter(|k| all[*k]["badge"] == "bad").collect();
    assert_eq!(bad.len(), 1, "{state:#}");
    let id = bad[0];
    assert_eq!([&all[id]["used"], &all[id]["is_left_out"]], [&json!("out"), &json!(true)]);
    let said = all[id]["fault"]["message"].as_str().expect("why");
    assert!(said.contains(&place) && said.contains("K1-mid-off.csv is not there"), "{said}");
    assert!(refused.stderr.contains(said), "as the command says: {}", refused.report());
    assert!(!all[id]["fault"]["help"].as_str().expect("help").is_empty());
    let left_out = "K1 mid wind off is bad data and left out.";
    assert_eq!(state["overall"]["left_out"], left_out);
    let (status, refused) = bench.act(&json!({"do": "tick", "releases": [id], "used": "fit"}));
    assert_eq!((status, refused["error"]["message"].as_str()), (409, Some(said)));

    // Fitted, with derivatives of the spring that has all its releases, and judged, without it.
    assert_eq!(bench.act(&json!({"do": "fit"})).0, 200);
    let state =
        bench.wait("a step", |state| state["steps"].as_array().is_some_and(|s| s.len() == 1));
    assert_eq!(state["overall"]["left_out"], left_out);
    let model = bench.text("model.toml");
    assert_eq!(model.matches("[[record]]").count(), 7);
    assert!(!model.contains("K1-mid-off"));
    let found = bench.get("/api/derivatives");
    let points = found["before"].as_array().expect("points");
    assert_eq!(points.iter().map(|p| p["spring"].clone()).collect::<Vec<_>>(), ["K4"]);
    bench.wait("it rests", |state| state["job"].is_null());
    assert_eq!(bench.act(&json!({"do": "judge"})).0, 200);
    let state = bench.wait("a verdict", |state| state["ended"]["job"]["do"] == "judge");
    assert_eq!(state["ended"]["is_error"], false, "{}", state["ended"]);
    assert!(!bench.get("/api/derivatives")["judged"].is_null());
}

#[test]
fn a_list_opens_with_what_there_is_and_not_with_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    yawrig(RUBBING).in_folder(folder.path()).run().exits(0);
    std::fs::write(folder.path().join("torn.csv"), "time_s,yaw_deg\n0,1\n0.1,two\n").expect("room");
    let run = |arguments: &str| yawrig(arguments).in_folder(folder.path()).run();
    run("workbench nothing.csv gone/nothing.csv").exits(3).says("cannot read nothing.csv").helps();
    run("workbench torn.csv nothing.csv").exits(3).says("torn.csv, line 3").helps();
    let bench = Bench::start_in(folder, "nothing.csv torn.csv rubbing.csv");
    let state =
        bench.wait("badges", |state| (0..3).all(|k| state["releases"][k]["badge"] != "pending"));
    let badges = [0, 1, 2].map(|k: usize| state["releases"][k]["badge"].clone());
    assert_eq!(badges, [json!("bad"), json!("bad"), json!("structured")]);
    let said = "2 releases are bad data and left out, nothing.csv first.";
    assert_eq!(state["overall"]["left_out"], said);
    assert_eq!(bench.act(&json!({"do": "fit"})).0, 200);
    bench.wait("a step", |state| state["steps"].as_array().is_some_and(|s| s.len() == 1));
    // Corrected, it is opened again.
    std::fs::copy(bench.path("rubbing.csv"), bench.path("nothing.csv")).expect("room");
    assert_eq!(bench.act(&json!({"do": "open", "file": "nothing.csv"})).1["release"], 0);
    bench.wait("it is good", |state| state["releases"][0]["badge"] == "structured");
}
