//! The ARM image on QEMU's Cortex-M4F. `tests/run` runs these; plain `cargo test` needs no QEMU.

use nix::sys::signal::{kill, Signal};
use nix::unistd::Pid;
use rand::SeedableRng;
use rand_distr::Distribution;
use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use yawrig_base::error::Exit;
use yawrig_core::record::Record;
use yawrig_link::bench::{Bench, Potentiometer, Target};
use yawrig_link::client::Client;
use yawrig_link::flash;
use yawrig_link::hub::Hub;
use yawrig_link::qemu;
use yawrig_link::replay::{replay, Range, Replayed};
use yawrig_model::training;
use yawrig_shared::features::FeatureKind;
use yawrig_shared::potentiometer::Encoder;
use yawrig_shared::wire::{Event, Phase, Request, Status};
use yawrig_tests::PATIENCE;
use yawrig_train::draws::Ranges;
use yawrig_train::network_training::{self, Settings};
use yawrig_train::{Options, Silent};

/// A release from 12 deg, 7.5 rad/s, damping ratio 0.012, noise of 0.05 deg.
fn record() -> Record {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(7);
    let noise_deg = rand_distr::Normal::new(0.0, 0.05).expect("a positive deviation");
    let (wn, zeta) = (7.5_f64, 0.012_f64);
    let time_s: Vec<f64> = (0..40_000).map(|k| f64::from(k) * 1e-3).collect();
    let yaw_deg = time_s
        .iter()
        .map(|t| {
            let t = (t - 2.0).max(0.0);
            12.0 * (-zeta * wn * t).exp() * (wn * t).cos() + noise_deg.sample(&mut random)
        })
        .collect();
    Record::new("made.csv", time_s, yaw_deg)
}

fn played(target: &Target) -> (Replayed, Status) {
    let mut bench = Bench::open(target).expect("a device");
    let range = Range { from_deg: 10.0, to_deg: 1.0 };
    let replayed = replay(&mut bench, &record(), range, &mut |_| Ok(())).expect("a replay");
    let status = bench.client.status().expect("its state");
    (replayed, status)
}

#[test]
#[ignore = "needs QEMU: tests/run runs it"]
fn the_arm_image_gives_the_same_bits_as_the_emulated_device() {
    let (here, _) = played(&Target::Emulated);
    let (there, status) = played(&Target::Qemu);
    assert_eq!(status.lost_samples, 0);
    assert_eq!(status.lost_events, 0);
    let release = here.main_release().expect("a release");
    assert!(release.windows.len() >= 8, "{} windows", release.windows.len());
    // Debug prints the shortest decimal that means an f32, so equal text is equal bits.
    assert_eq!(format!("{:?}", here.releases), format!("{:?}", there.releases));
}

#[test]
#[ignore = "needs QEMU: tests/run runs it"]
fn a_network_with_the_amplitude_gives_the_same_bits_on_both() {
    let model = tempfile::NamedTempFile::new().expect("a temporary file");
    let text = "schema_version = 1\n[[effect]]\nid = \"coulomb_friction\"\n\
                parameters.c = { value = 0.02 }\n";
    std::fs::write(&model, text).expect("room for it");
    let source = training::read(model.path()).expect("the model");
    let augmented = training::augmented(&source, &[]).expect("its effects");
    let settings = Settings {
        features: FeatureKind::BinMeans,
        ranges: Ranges { noise: [0.005, 0.005], ..Ranges::default() },
        model: Some(source),
        numbers: Vec::new(),
        amplitude: true,
        components: None,
        samples: 300,
        training: Options { epochs: 20, ..Options::default() },
    };
    let trained =
        network_training::run(&settings, augmented.as_ref(), &mut Silent).expect("a network");
    let played = |target: &Target| {
        let mut bench = Bench::open(target).expect("a device");
        flash::write(&mut bench.client, &trained.blob, &mut flash::Silent).expect("it is written");
        let status = bench.client.status().expect("its state");
        assert_eq!(status.network.topology, [42, 6, 2]);
        assert_eq!(status.network.effects, "coulomb_friction");
        let range = Range { from_deg: 10.0, to_deg: 1.0 };
        let replayed = replay(&mut bench, &record(), range, &mut |_| Ok(())).expect("a replay");
        format!("{:?}", replayed.releases)
    };
    assert_eq!(played(&Target::Emulated), played(&Target::Qemu));
}

#[test]
#[ignore = "needs QEMU: tests/run runs it"]
fn samples_missing_from_the_stream_are_counted_as_lost() {
    let (board, mut potentiometer) = qemu::start().expect("a board");
    let hub = Hub::start(board).expect("a hub");
    let mut client = Client::open(hub.own_path()).expect("a device");
    let mut bytes = Vec::new();
    let mut encoder = Encoder::default();
    for index in (0..1000).chain(1015..2000) {
        encoder.encode(index, 30_000 + (index % 700) as u16, &mut bytes);
    }
    potentiometer.write_samples(&bytes).expect("a board that takes samples");
    let status = settled(&mut client, 2000);
    assert_eq!((status.samples, status.lost_samples), (2000, 15));
}

/// Its state once it has taken so many samples.
fn settled(client: &mut Client, samples: u32) -> Status {
    let patience = Instant::now() + PATIENCE;
    loop {
        let status = client.status().expect("its state");
        if status.samples >= samples || Instant::now() > patience {
            return status;
        }
    }
}

#[test]
#[ignore = "needs QEMU: tests/run runs it"]
fn an_image_that_does_not_run_is_refused_in_its_own_words() {
    let mut image = tempfile::NamedTempFile::new().expect("a temporary file");
    image.write_all(&[0xff; 4096]).expect("room for it");
    let Err(error) = qemu::boot(image.path()) else { panic!("that was no image") };
    assert_eq!(error.exit, Exit::Device);
    assert!(error.message.contains("has stopped"), "{error}");

    let Err(error) = qemu::boot("no/such/image".as_ref()) else { panic!("there is none") };
    assert_eq!(error.exit, Exit::Device);
    assert!(error.help.contains("boards/build mps2-an386"), "{error}");
}

#[test]
#[ignore = "needs QEMU: tests/run runs it"]
fn a_board_that_dies_says_so_at_the_next_samples() {
    let (board, mut potentiometer) = qemu::start().expect("a board");
    let killed = Command::new("kill").arg("-KILL").arg(board.pid().to_string()).status();
    assert!(killed.expect("kill(1)").success());
    assert!(gone(board.pid()));
    let error = potentiometer.send(&[1, 2, 3]).expect_err("it is dead");
    assert_eq!(error.exit, Exit::Device);
    assert!(error.message.contains("signal: 9"), "{error}");
}

#[test]
#[ignore = "needs QEMU: tests/run runs it"]
fn qemu_ends_with_its_owner() {
    let (board, potentiometer) = qemu::start().expect("a board");
    let pid = board.pid();
    assert!(!finished(pid));
    drop(board);
    drop(potentiometer);
    assert!(finished(pid));
}

#[test]
#[ignore = "needs QEMU: tests/run runs it"]
fn qemu_ends_even_where_its_owner_is_killed() {
    // This very test again, in a process of its own that only starts QEMU and waits to be killed.
    const OWNER: &str = "YAWRIG_TEST_OWNS_QEMU";
    if std::env::var_os(OWNER).is_some() {
        let (board, _potentiometer) = qemu::start().expect("a board");
        println!("\npid {}", board.pid());
        std::thread::sleep(PATIENCE);
        return;
    }
    let mut owner = Command::new(std::env::current_exe().expect("this program"))
        .args([
            "--exact",
            "qemu::qemu_ends_even_where_its_owner_is_killed",
            "--ignored",
            "--nocapture",
        ])
        .env(OWNER, "1")
        .stdout(Stdio::piped())
        .spawn()
        .expect("this program again");
    let lines = BufReader::new(owner.stdout.take().expect("its output")).lines();
    let pid = lines
        .map_while(Result::ok)
        .find_map(|line| line.strip_prefix("pid ")?.parse::<u32>().ok())
        .expect("the number of a running QEMU");
    assert!(!finished(pid));
    owner.kill().expect("a process of ours");
    owner.wait().expect("its end");
    assert!(gone(pid), "QEMU {pid} outlived its owner");
}

/// Whether a process is no more, or a zombie that its parent has yet to collect.
fn finished(pid: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    let dead = |rest: &str| rest.trim_start().starts_with('Z') || stat.is_empty();
    // Its first thread may be dead while others still go; the process has ended with the last of them.
    let threads = std::fs::read_dir(format!("/proc/{pid}/task")).map_or(0, Iterator::count);
    stat.rsplit(')').next().is_none_or(dead) && threads <= 1
}

/// Waits for the end of a process.
fn gone(pid: u32) -> bool {
    let patience = Instant::now() + PATIENCE;
    while !finished(pid) && Instant::now() < patience {
        std::thread::sleep(Duration::from_millis(10));
    }
    finished(pid)
}

/// As by a host too busy to let it run, for longer than a board's watchdog waits.
#[test]
#[ignore = "needs QEMU: tests/run runs it"]
fn a_board_that_is_stopped_for_a_while_has_not_restarted() {
    let (board, mut potentiometer) = qemu::start().expect("a board");
    let pid = Pid::from_raw(board.pid() as i32);
    let hub = Hub::start(board).expect("a hub");
    let mut client = Client::open(hub.own_path()).expect("a device");
    potentiometer.send(&vec![32_768 + 2000; 2500]).expect("a board that takes samples");
    client.next_event(PATIENCE).expect("a line").expect("it is held");
    kill(pid, Signal::SIGSTOP).expect("a process of ours");
    std::thread::sleep(Duration::from_secs(10));
    kill(pid, Signal::SIGCONT).expect("a process of ours");
    potentiometer.send(&[32_768 + 2000; 10]).expect("a board that takes samples");
    while client.status().expect("its state").samples < 2510 && client.resets() == 0 {}
    assert_eq!(client.resets(), 0);
}

#[test]
#[ignore = "needs QEMU: tests/run runs it"]
fn a_board_whose_main_loop_hangs_is_reset_and_the_host_says_so() {
    let build = concat!(env!("CARGO_MANIFEST_DIR"), "/../firmware/boards/build");
    let built = Command::new(build).args(["mps2-an386", "--bin", "hang"]).output();
    let built = built.expect("the script that builds images");
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let image = String::from_utf8(built.stdout).expect("a path");
    let (board, mut potentiometer) = qemu::boot(image.trim().as_ref()).expect("a board");
    let hub = Hub::start(board).expect("a hub");
    let mut client = Client::open(hub.own_path()).expect("a device");
    // Held: an event before the fault, which stays the host's.
    let mut counts = vec![32_768 + 2000; 2500];
    potentiometer.send(&counts).expect("a board that takes samples");
    let first = client.next_event(PATIENCE).expect("a line").expect("an event");
    assert!(matches!(first.event, Event::Phase { phase: Phase::Held, .. }), "{first:?}");
    assert_eq!((first.number, client.resets()), (0, 0));
    // It hangs after 3000 samples.
    counts.truncate(600);
    potentiometer.send(&counts).expect("a board that takes samples");
    let patience = Instant::now() + PATIENCE;
    while client.resets() == 0 {
        assert!(Instant::now() < patience, "the watchdog does not bite");
        // It answers nothing for two seconds.
        let _ = client.request(&Request::Status);
    }
    let status = client.status().expect("its state");
    assert!(status.samples < 3000, "it has begun anew");
    // What it says now is known from what it said before, though the numbers are the same.
    potentiometer.send(&vec![32_768 + 2000; 2500]).expect("a board that takes samples");
    let again = client.next_event(PATIENCE).expect("a line").expect("an event");
    assert!(matches!(again.event, Event::Phase { phase: Phase::Held, .. }), "{again:?}");
    assert_eq!((again.number, client.resets(), client.missed_events()), (0, 1, 0));
}
