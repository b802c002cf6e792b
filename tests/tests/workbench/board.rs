//! A board at the plug of a browser whose page has no server: followed, told its condition, given a network, pulled out.

use crate::bench::pictures;
use crate::looks::nothing_is_cut_off;
use crate::plug::{plugged, Far, Plug};
use crate::still::{printed, Served};
use serde_json::Value;
use std::sync::Arc;
use std::time::Duration;
use yawrig_rig::{Condition, End, Rig, Sensor, Spring, Start};
use yawrig_shared::axis::Axis;
use yawrig_shared::wire::{self, Decoder, HelloReply, HELLO_KEY};
use yawrig_tests::browser::{Browser, Window};
use yawrig_tests::line::Board;
use yawrig_tests::networks;

const SAYS: &str = "document.querySelector('#board-told').textContent";

/// A page beside this plug, its board's part shown.
fn opened(plug: Arc<Plug>) -> (Served, Browser) {
    let served = Served::beside(Some(plug));
    let mut browser = Browser::start(Window { width: 1280, height: 800, is_dark: false });
    plugged(&mut browser);
    browser.open(&format!("{}/", served.origin));
    browser.wait("document.querySelector('#verdict').textContent.startsWith('Drop the record')");
    browser.key("l");
    browser.wait("document.activeElement.id === 'live-connect'");
    (served, browser)
}

/// By a key, as a hand presses it: a port is chosen upon nothing less.
fn connect(browser: &mut Browser) {
    browser.value("document.querySelector('#live-connect').focus()");
    browser.key("Enter");
}

/// The converter's counts of a release, and of the rest after it.
fn counts(rig: &Rig, condition: &Condition, seed: u64) -> Vec<u16> {
    let release = rig.release(condition, &Start::default(), &Sensor::default(), seed);
    let rest = Start { amplitude_deg: 0.0, hold_s: 6.0, end: End::After(6.0) };
    let rest = rig.release(condition, &rest, &Sensor::default(), seed + 1);
    let both = [release, rest].map(|of| of.expect("a release").samples.filter_map(|s| s.counts));
    both.into_iter().flatten().collect()
}

/// Plays them twenty times as fast as a rig swings.
fn play(board: &Board, plug: &Plug, counts: &[u16]) {
    for some in counts.chunks(50) {
        board.samples(some);
        plug.take();
        std::thread::sleep(Duration::from_micros(2500));
    }
}

/// The same, no further ahead of the page than half of what it asks for at a time: a stall of a busy machine is as
/// many times longer for a rig that swings faster.
fn play_to(browser: &mut Browser, (board, plug): (&Board, &Plug), counts: &[u16]) {
    const TOLD: &str = "+(document.querySelector('#live-count').dataset.samples ?? 0) + +(document.querySelector('#live-count').dataset.missing ?? 0)";
    let before = browser.value(TOLD).as_u64().expect("a number");
    for (k, some) in counts.chunks(10_000).enumerate() {
        play(board, plug, some);
        browser.wait(&format!("{TOLD} >= {}", before + 10_000 * k as u64));
    }
}

/// What the browser keeps of the board: each of its files' text, by how its name ends.
fn kept(browser: &mut Browser, end: &str) -> Vec<String> {
    let asked = format!(
        "import('./kept.js').then(k => k.files()).then(f => Promise.all([...f].filter(([n]) => n.endsWith('{end}')).map(([, text]) => text())))"
    );
    let texts = browser.value(&asked);
    texts.as_array().expect("texts").iter().map(|t| t.as_str().expect("text").to_owned()).collect()
}

/// The lines of one event.
fn lines(browser: &mut Browser, event: &str) -> Vec<Value> {
    let all = kept(browser, ".jsonl").concat();
    let all = all.lines().map(|line| serde_json::from_str::<Value>(line).expect("a line of JSON"));
    all.filter(|line| line["event"] == event).collect()
}

fn number(of: &Value) -> [f64; 2] {
    ["value", "u"].map(|part| of[part].as_f64().unwrap_or_else(|| panic!("{part} of {of}")))
}

fn set(browser: &mut Browser, condition: &Condition, rig: &Rig) {
    for (id, text) in [
        ("spring", condition.spring.name.to_owned()),
        ("wind", condition.wind_speed_m_s.to_string()),
        ("density", rig.air_density_kg_m3.to_string()),
        ("length", rig.model.length_m.to_string()),
        ("area", rig.model.frontal_area_m2.to_string()),
        ("inertia", rig.inertia_kg_m2(condition.axis).to_string()),
    ] {
        browser.fill(&format!("#board-{id}"), &text);
    }
    browser.click("#board-set");
    let said = format!("next: {} mid, wind", condition.spring.name);
    let wind = match condition.wind_speed_m_s {
        0.0 => "off".to_owned(),
        speed => format!("{speed} m/s"),
    };
    browser.wait(&format!(
        "document.querySelector('#measure-next').textContent.startsWith('{said} {wind}')"
    ));
}

/// A board that has never seen yawrig gets its image from the page: blocks of UF2 for its chip.
#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn the_first_image_of_a_board_is_in_the_page() {
    let (_served, mut browser) = opened(Plug::board(&Board::named("pico")));
    browser.click("#board-first summary");
    browser.wait("document.querySelector('#board-first').open");
    nothing_is_cut_off(&mut browser, "#live");
    browser.picture(&pictures().join("static-board-first.png"));
    for (k, family) in [0xe48b_ff56_u32, 0xe48b_ff59].into_iter().enumerate() {
        let words = browser.value(&format!(
            "fetch(document.querySelectorAll('#board-first a')[{k}].href).then(r => r.arrayBuffer()).then(b => [...new Uint32Array(b, 0, 8), b.byteLength])"
        ));
        let words: Vec<u64> = serde_json::from_value(words).expect("numbers");
        assert_eq!(words[..3], [0x0a32_4655, 0x9e5d_5157, 0x2000]);
        assert_eq!((words[7], words[8]), (family.into(), 512 * words[6]));
    }
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_board_is_followed_at_the_plug() {
    let board = Board::named("pico");
    let plug = Plug::board(&board);
    let (served, mut browser) = opened(plug.clone());
    browser.wait("document.querySelector('#plot-live').textContent.includes('choose the board')");
    connect(&mut browser);
    browser.wait("document.querySelector('#board-text').textContent.includes('network')");
    let about = browser.text("#board-text");
    let id = networks::id(&networks::sound());
    assert!(about.contains(" on pico") && about.contains(&id), "{about}");
    assert!(browser.text("#board-warning").contains("unlike widths"));
    assert_eq!(lines(&mut browser, "device").len(), 1);

    let rig = Rig::default();
    let spring = Spring::named("K3").expect("a spring");
    let off = Condition { spring, axis: Axis::Mid, wind_speed_m_s: 0.0 };
    let on = Condition { wind_speed_m_s: 10.0, ..off };
    for (k, condition) in [off, on].iter().enumerate() {
        set(&mut browser, condition, &rig);
        play_to(&mut browser, (&board, &plug), &counts(&rig, condition, 66 + 2 * k as u64));
        let refined = "document.querySelectorAll('#live-log [data-event=refined]').length";
        browser.wait(&format!("{refined} === {}", k + 1));
        // As planted, by what it says itself of how far it may be off.
        let said = lines(&mut browser, "refined").pop().expect("a result");
        let truth = rig.modal(condition).expect("a condition");
        for (name, planted) in [
            ("natural_frequency_rad_s", truth.natural_frequency_rad_s),
            ("damping_ratio", truth.damping_ratio),
        ] {
            let [value, u] = number(&said[name]);
            println!("{name} {value} +- {u}, planted {planted}");
            assert!((value - planted).abs() < 4.0 * u && u < 0.02 * planted, "{said}");
        }
    }
    assert_eq!(browser.value("+document.querySelector('#live-count').dataset.missing"), 0);
    assert!(lines(&mut browser, "gap").is_empty());
    let points = browser.text("#measure-points");
    assert!(points.contains("K3 mid, 10 m/s") && points.contains('±'), "{points}");
    let verdict = browser.text("#verdict");
    assert!(
        verdict.starts_with("Board: release ") && verdict.contains(" refined: wn"),
        "{verdict}"
    );
    for (width, height) in [(390, 844), (1280, 800)] {
        browser.resize(Window { width, height, is_dark: false });
        browser.picture(&pictures().join(format!("static-board-{width}.png")));
        assert_eq!(browser.value("document.documentElement.scrollWidth <= innerWidth"), true);
    }

    nothing_is_cut_off(&mut browser, "the page");

    // Each release has become a record that is judged as any other, and says what the board said.
    browser.wait("document.querySelectorAll('#release-list [data-release]').length === 2");
    let record = printed(&mut browser, "identify", 1)["json"]["records"][0].clone();
    let estimates = record["estimates"].as_array().expect("estimates");
    let fitted = estimates.iter().find(|e| e["method"] == "least-squares").expect("a fit");
    let truth = rig.modal(&on).expect("a condition").natural_frequency_rad_s;
    let [value, u] = number(&fitted["natural_frequency_rad_s"]);
    assert!((value - truth).abs() < 5.0 * u, "{value} +- {u}, planted {truth}");
    assert_eq!(kept(&mut browser, ".csv").len(), 2);
    // Let go while what it says waits for a busy page: it stays let go, and what it said is still there.
    let (more, inside) = (counts(&rig, &off, 71), board.clone());
    let playing = std::thread::spawn(move || play(&inside, &plug, &more[..more.len() / 4]));
    browser.value("(() => { const from = performance.now(); while (performance.now() - from < 500); document.querySelector('#live-connect').click(); })()");
    browser.wait("document.querySelector('#live-connect').textContent === 'Connect'");
    playing.join().expect("it plays");
    std::thread::sleep(Duration::from_millis(300));
    browser.wait("document.querySelector('#live-connect').textContent === 'Connect'");
    assert!(lines(&mut browser, "window").len() > 4);
    browser.is_clean(&served.origin);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_network_is_written_and_verified() {
    let board = Board::default();
    let (served, mut browser) = opened(Plug::board(&board));
    connect(&mut browser);
    browser.wait("!document.querySelector('#board-write').disabled");
    let folder = tempfile::tempdir().expect("a folder");
    let [file, torn] = ["another.yrn", "torn.yrn"].map(|name| folder.path().join(name));
    let another = networks::another();
    std::fs::write(&file, &another).expect("room");
    std::fs::write(&torn, &another[..another.len() / 2]).expect("room");

    browser.choose("#board-file", &torn);
    browser
        .wait(&format!("{SAYS}.includes('torn.yrn is not a network to write: it is cut short')"));
    browser.choose("#board-file", &file);
    browser.wait(&format!("{SAYS}.includes('another.yrn is written, verified and runs')"));
    let status = board.status();
    assert_eq!(
        (format!("{:08x}", status.network.id), status.network.on_trial),
        (networks::id(&another), false)
    );
    let id = networks::id(&another);
    browser.wait(&format!("document.querySelector('#board-text').textContent.includes('{id}')"));
    assert_eq!(lines(&mut browser, "written").len(), 1);
    browser.is_clean(&served.origin);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_network_is_not_half_written_where_the_plug_is_pulled() {
    let board = Board::default();
    let before = board.status().network.id;
    let (mut count, inside) = (0, board.clone());
    let far: Far = Box::new(move |bytes| {
        count += bytes.len();
        // In the middle of it; hello, state and stream are some hundred bytes.
        if count > 2000 {
            Vec::new()
        } else {
            inside.exchange(bytes)
        }
    });
    let plug = Plug::new(far);
    let (_served, mut browser) = opened(plug.clone());
    connect(&mut browser);
    browser.wait("!document.querySelector('#board-write').disabled");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("another.yrn");
    std::fs::write(&file, networks::another()).expect("room");
    browser.choose("#board-file", &file);
    browser.wait(&format!("{SAYS}.startsWith('writing another.yrn: ')"));
    plug.pull();
    browser.wait(&format!(
        "{SAYS}.includes('writing to the device on USB 2e8a:000a failed: it is gone')"
    ));
    assert!(browser.text("#board-told").contains("keeps its old network"));
    assert_eq!(board.status().network.id, before);
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn no_result_is_lost_while_the_plug_is_out() {
    let board = Board::default();
    let plug = Plug::board(&board);
    let (served, mut browser) = opened(plug.clone());
    connect(&mut browser);
    let rig = Rig::default();
    let condition = rig.conditions(10.0).nth(8).expect("a condition");
    let counts = counts(&rig, &condition, 67);
    let half = counts.len() / 3;
    browser.wait("!document.querySelector('#live-mark').disabled");
    play(&board, &plug, &counts[..half]);
    browser.wait("document.querySelectorAll('#live-log [data-event=window]').length > 0");
    plug.pull();
    browser.wait("document.querySelector('#live-log [data-event=disconnected]')");
    let said = browser.text("#live-log [data-event=disconnected]");
    assert!(said.contains("has been lost") && said.contains("waiting for it"), "{said}");
    let before = lines(&mut browser, "window").len();
    assert!(before > 0, "kept at once");
    // It has a power supply of its own and goes on.
    play(&board, &plug, &counts[half..]);
    plug.put_back();
    browser.value("pluggedInAgain()");
    browser.wait("document.querySelector('#live-log [data-event=release]')");
    let release = lines(&mut browser, "release").pop().expect("a result");
    assert!(lines(&mut browser, "window").len() > before);
    let truth = rig.modal(&condition).expect("a condition").natural_frequency_rad_s;
    let [value, u] = number(&release["natural_frequency_rad_s"]);
    assert!((value - truth).abs() < 5.0 * u, "{release}");
    // The page is closed and opened again.
    browser.value("document.querySelector('#live-connect').click()");
    browser.wait("document.querySelector('#live-connect').textContent === 'Connect'");
    browser.open(&format!("{}/", served.origin));
    browser.wait("document.querySelector('#verdict').textContent.startsWith('Drop the record')");
    assert_eq!(lines(&mut browser, "release").len(), 1);
    browser.click("#save-button");
    browser.wait("[...document.querySelectorAll('[data-save]')].some(b => b.dataset.save.endsWith('.jsonl'))");
    browser.is_clean(&served.origin);
}

/// A far end that answers the hello so.
fn says_hello(hello: HelloReply) -> Far {
    let mut decoder = Decoder::new();
    Box::new(move |bytes| {
        let asked = bytes.iter().filter_map(|byte| match decoder.push(*byte)? {
            Ok(frame) if frame.key == HELLO_KEY => Some(frame.sequence),
            _ => None,
        });
        let answered = asked.flat_map(|n| {
            wire::encode_raw(HELLO_KEY, n, &hello.write()).expect("a frame").to_vec()
        });
        answered.collect()
    })
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn what_is_no_board_of_ours_is_named() {
    let older = HelloReply {
        protocol: 0,
        messages_key: wire::MESSAGES_KEY,
        firmware: HelloReply::text("yawrig 0.0"),
        board: HelloReply::text("yesterday's"),
    };
    let chatters: Far = Box::new(|_| b"NMEA $GPGGA\r\n\0".to_vec());
    let echoes: Far = Box::new(<[u8]>::to_vec);
    let mute: Far = Box::new(|_| Vec::new());
    for (far, said) in [
        (says_hello(older), "speaks protocol 0"),
        (chatters, "is not a yawrig device: it sent"),
        (echoes, "sends back what it is sent"),
        (mute, "does not answer (its name)"),
    ] {
        let (served, mut browser) = opened(Plug::new(far));
        connect(&mut browser);
        browser.wait(&format!("{SAYS}.includes('{said}')"));
        browser.wait("document.querySelector('#live-connect').textContent === 'Connect'");
        browser.is_clean(&served.origin);
    }
}

#[test]
#[ignore = "needs Chromium: tests/run runs it"]
fn a_port_that_another_has_and_a_browser_without_any_are_told() {
    let plug = Plug::board(&Board::default());
    plug.hold();
    let (served, mut browser) = opened(plug);
    connect(&mut browser);
    let message = "document.querySelector('#message').textContent";
    browser.wait(&format!(
        "{message}.includes('another program has it open') && {message}.includes('USB 2e8a:000a')"
    ));
    let source =
        "Object.defineProperty(navigator, 'serial', { value: undefined, configurable: true })";
    let mut browser = Browser::start(Window { width: 1280, height: 800, is_dark: false });
    browser.call("Page.addScriptToEvaluateOnNewDocument", serde_json::json!({ "source": source }));
    browser.open(&format!("{}/", served.origin));
    browser.wait("document.querySelector('#verdict').textContent.startsWith('Drop the record')");
    browser.key("l");
    browser.wait("document.querySelector('#plot-live').textContent.includes('has no Web Serial')");
    assert_eq!(browser.value("document.querySelector('#live-connect').disabled"), true);
    browser.picture(&pictures().join("static-board-none.png"));
    browser.is_clean(&served.origin);
}
