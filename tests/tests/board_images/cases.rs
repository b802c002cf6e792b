//! What is tried on each board.

use crate::harness::{root, Board, Both, Kept};
use std::ops::Range;
use yawrig_firmware::BUILT_IN;
use yawrig_shared::blob;
use yawrig_shared::derivatives::{Model, Wind};
use yawrig_shared::wire::{
    encode_raw, is_safe, rig_id, Cause, Condition, Decoder, Event, HelloReply, Learnt, Phase,
    Reply, Request, Settings, SlotState, Start, CHUNK, HELLO_KEY,
};

/// Of which commit an image is that is built here, with a plus where files have been changed since; nothing where
/// there is no history.
fn commit() -> String {
    let git = std::process::Command::new("git")
        .args(["describe", "--always", "--exclude", "*", "--abbrev=8", "--dirty=+"])
        .current_dir(root())
        .output();
    let said = git.ok().filter(|git| root().join(".git").exists() && git.status.success());
    said.map_or(String::new(), |git| String::from_utf8_lossy(&git.stdout).trim().to_owned())
}

/// A release as a converter of 12 bits over 340 deg reads it: held for two seconds at 14 deg, let go.
fn release(wn: f64, zeta: f64, seconds: f64) -> Vec<u16> {
    let wd = wn * (1.0 - zeta * zeta).sqrt();
    // Noise of about a step, the same in every run.
    let mut state = 12_345_u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 23) - 1.0
    };
    let reading = |k: u32| {
        let t = f64::from(k.saturating_sub(2000)) * 1e-3;
        let yaw_deg = 14.0 * (-zeta * wn * t).exp() * (wd * t).cos();
        (2048.0 + yaw_deg / (340.0 / 4096.0) + noise()).round().clamp(0.0, 4095.0) as u16
    };
    (0..(seconds * 1e3) as u32).map(reading).collect()
}

fn condition(speed_m_s: f64) -> Request {
    Request::Condition(Condition {
        rig: rig_id("K3", "mid"),
        wind: Wind { density_kg_m3: 1.2, speed_m_s },
        model: Model { length_m: 0.625, frontal_area_m2: 0.036 },
        inertia_kg_m2: 0.101,
    })
}

/// A campaign's releases: what is sent is what the firmware in this process sends, bit for bit, and says what
/// was let go; its events.
pub fn a_campaign_s_releases<B: Board>() -> Vec<Event> {
    let mut both = Both::<B>::start();
    // The image says its commit, too.
    let asked = encode_raw(HELLO_KEY, 1, &[]).expect("a frame");
    both.machine.ask(&format!("line {}", data_encoding::HEXLOWER.encode(&asked)));
    let (hello, _) = both.machine.run("run");
    let mut decoder = Decoder::new();
    let body = hello.iter().find_map(|byte| {
        let frame = decoder.push(*byte)?.expect("a frame");
        (frame.key == HELLO_KEY).then(|| HelloReply::read(frame.body).expect("a hello"))
    });
    let hello = body.expect("a hello");
    assert_eq!(hello.board, HelloReply::text(B::NAME));
    let firmware = String::from_utf8_lossy(&hello.firmware).trim_end_matches('\0').to_owned();
    println!("{firmware}");
    let version = concat!("yawrig ", env!("CARGO_PKG_VERSION"));
    assert_eq!(firmware.strip_prefix(version).map(str::trim_start), Some(commit().as_str()));
    // The boards' own clocks are not equally good.
    let (degrees_per_count, clock_u_ppm) = (340.0 / 65_536.0, Some(5.0));
    let settings = Settings { degrees_per_count, clock_u_ppm, ..Settings::default() };
    assert_eq!(both.ask(&Request::Configure(settings)), Reply::Done);
    assert_eq!(both.status().settings, settings);

    for (speed_m_s, wn, zeta) in [(0.0, 12.0, 0.03), (10.0, 11.0, 0.04)] {
        assert_eq!(both.ask(&condition(speed_m_s)), Reply::Done);
        both.play(&release(wn, zeta, 12.0));
    }
    let refined: Vec<_> = both
        .events
        .iter()
        .filter_map(|event| match event {
            Event::Refined(refined) => Some(*refined),
            _ => None,
        })
        .collect();
    let windows = both.events.iter().filter(|event| matches!(event, Event::Window(_))).count();
    let held = |event: &Event| matches!(event, Event::Phase { phase: Phase::Held, .. });
    println!("{} events, {windows} windows, refined {refined:?}", both.events.len());
    assert!(windows >= 6 && both.events.iter().any(held), "{:?}", both.events);
    assert_eq!(refined.len(), 2, "{:?}", both.events);
    for (refined, wn) in refined.iter().zip([12.0, 11.0]) {
        assert!((refined.natural_frequency_rad_s.value / wn - 1.0).abs() < 2e-3, "{refined:?}");
    }
    assert!(refined[1].derivatives.is_some(), "{refined:?}");
    let status = both.status();
    assert_eq!((status.lost_samples, status.lost_events, status.lost_bytes), (0, 0, 0));
    // What it has learnt of its network on this rig outlives its power.
    assert_eq!(status.learnt, Learnt { releases: 2, kept: true, forgotten: None });
    both.power_cycle();
    assert_eq!(both.status().learnt, status.learnt);
    let there = both.flash_there();
    assert!(there == both.here.flash().bytes(), "the flashes differ");
    both.events
}

/// A network is written while it samples, verified, committed, kept; a spoilt one is refused; the lock's key
/// is kept.
pub fn a_network_is_written_and_kept<B: Board>() {
    let mut both = Both::<B>::start();
    let still = [2048_u16; 400];
    let mut bytes = BUILT_IN.to_vec();
    blob::set_generation(&mut bytes, 7).expect("a blob");
    // While it erases it does not answer: the readings of that time are taken up after it, and none is lost.
    let begin = Request::FlashBegin { length: bytes.len() as u32 };
    assert_eq!(both.ask_while(&begin, &still), Reply::Done);
    for (index, chunk) in bytes.chunks(CHUNK).enumerate() {
        let chunk = Request::FlashChunk {
            offset: (index * CHUNK) as u32,
            bytes: chunk.iter().copied().collect(),
        };
        assert_eq!(both.ask_while(&chunk, &still[..20]), Reply::Done);
    }
    assert_eq!(both.ask_while(&Request::FlashTrial, &still), Reply::Done);
    assert!(both.status().network.on_trial);
    assert_eq!(both.ask_while(&Request::FlashCommit, &still), Reply::Done);
    let status = both.status();
    assert_eq!((status.network.generation, status.network.on_trial), (7, false));
    assert_eq!((status.lost_samples, status.lost_bytes), (0, 0));
    both.power_cycle();
    let again = both.status();
    assert_eq!((again.network.generation, again.network.id), (7, status.network.id));
    assert!(again.slots.iter().any(|s| matches!(s, SlotState::Valid { generation: 7, .. })));
    // A spoilt one is refused, and the old one runs on.
    let spoilt_at = bytes.len() / 2;
    bytes[spoilt_at] ^= 1;
    assert_eq!(both.ask(&begin), Reply::Done);
    for (index, chunk) in bytes.chunks(CHUNK).enumerate() {
        let bytes = chunk.iter().copied().collect();
        both.ask(&Request::FlashChunk { offset: (index * CHUNK) as u32, bytes });
    }
    assert!(matches!(both.ask(&Request::FlashTrial), Reply::Refused(_)));
    assert_eq!(both.status().network.generation, 7);
    // The lock: its key in a sector of its own.
    let key = *ed25519_compact::KeyPair::from_seed([7; 32].into()).pk;
    assert_eq!(both.ask(&Request::Lock { key }), Reply::Done);
    assert!(matches!(both.ask(&Request::Challenge), Reply::Challenge { .. }));
    both.power_cycle();
    assert_eq!(both.status().lock, Some(key));
    both.flashes_agree();
}

/// Where the converter stands still the watchdog starts the board again.
pub fn the_watchdog_starts_it_again<B: Board>() {
    let mut both = Both::<B>::start();
    both.play(&[2048; 1000]);
    assert_eq!(both.status().samples, 1000);
    // It answers meanwhile, and is not well all the same: 4 s, as the watchdog's registers have it.
    let (_, reset) = both.machine.run("stall 3900");
    assert_eq!(reset, None);
    both.machine.ask(&format!("samples {}", "0800".repeat(16)));
    assert_eq!(both.machine.run("run").1, None, "it was fed by a sample");
    let (_, reset) = both.machine.run("stall 3900");
    assert_eq!(reset, None);
    let (_, reset) = both.machine.run("stall 300");
    assert_eq!(reset.as_deref(), Some("watchdog"));
    both.begins_again(Cause::Watchdog);
    let status = both.status();
    assert_eq!((status.samples, status.start.cause), (0, Cause::Watchdog));
}

/// Where the converter is overrun for a millisecond one sample is lost, which is said, and the next ones are
/// right.
pub fn an_overrun_is_said<B: Board>() {
    let mut both = Both::<B>::start();
    let settings = Settings { degrees_per_count: 340.0 / 65_536.0, ..Settings::default() };
    assert_eq!(both.ask(&Request::Configure(settings)), Reply::Done);
    let release = release(12.0, 0.03, 12.0);
    let (held, swing) = release.split_at(1500);
    both.play(held);
    assert_eq!(both.machine.ask("overrun"), "ok");
    both.machine.ask(&format!("samples {}", "0800".repeat(16)));
    assert_eq!(both.machine.run("run"), (Vec::new(), None));
    both.here.lost(1);
    both.play(swing);
    let windows = both.events.iter().filter(|event| matches!(event, Event::Window(_))).count();
    assert!(windows >= 3, "{:?}", both.events);
    let status = both.status();
    assert_eq!((status.samples, status.lost_samples), (1 + release.len() as u32, 1));
}

/// A status of the machine alone, which stands as it is after this.
fn start_of<B: Board>(both: &mut Both<B>) -> Start {
    assert_eq!(both.machine.run("run"), (Vec::new(), None));
    let Ok(Reply::Status(status)) = both.ask_there(&Request::Status) else { panic!("no status") };
    status.start
}

/// After a fault, in this code, or a panic the board starts again and says where it was.
pub fn a_crash_is_said<B: Board>(code: Range<u32>) {
    let mut both = Both::<B>::start();
    let (_, reset) = both.machine.run("fault");
    assert_eq!(reset.as_deref(), Some("software"));
    let Start { cause, crash: Some(crash) } = start_of(&mut both) else { panic!("no crash") };
    assert_eq!((cause, crash.file.as_str()), (Cause::Software, ""));
    assert!(code.contains(&crash.line), "{:#x}", crash.line);
    // Said once: power comes, and nothing is known of before.
    both.power_cycle();
    assert_eq!(both.status().start, Start { cause: Cause::Power, crash: None });
    // A panic of the program's own: what there is only one of has been taken already.
    let (_, reset) = both.machine.run("panic");
    assert_eq!(reset.as_deref(), Some("software"));
    let source = root().join("firmware/boards").join(B::NAME).join("src/main.rs");
    let source = std::fs::read_to_string(source).expect("the program");
    let line =
        1 + source.lines().position(|line| line.contains("Peripherals::take()")).expect("it");
    let Start { cause, crash: Some(crash) } = start_of(&mut both) else { panic!("no crash") };
    assert_eq!((cause, crash.file.as_str()), (Cause::Software, "src/main.rs"));
    assert_eq!(crash.line as usize, line);
}

/// After three starts in a row that nobody asked for it answers without a converter, and takes up nothing that it
/// keeps; with power it is as before.
pub fn a_loop_of_restarts_ends<B: Board>() {
    let mut both = Both::<B>::start();
    for restarts in 1..=3 {
        let (_, reset) = both.machine.run(["stall 4200", "fault", "stall 4200"][restarts - 1]);
        assert!(reset.is_some());
        assert_eq!(both.machine.run("run"), (Vec::new(), None));
        let Ok(Reply::Status(status)) = both.ask_there(&Request::Status) else {
            panic!("no status")
        };
        assert_eq!(
            (usize::from(status.restarts), is_safe(status.restarts)),
            (restarts, restarts == 3)
        );
    }
    // Nothing is converted, and the watchdog is content.
    let (_, reset) = both.machine.run("stall 9000");
    assert_eq!(reset, None);
    let Ok(Reply::Status(status)) = both.ask_there(&Request::Status) else { panic!("no status") };
    assert_eq!((status.samples, status.restarts), (0, 3));
    both.power_cycle();
    assert_eq!(both.status().restarts, 0);
}
