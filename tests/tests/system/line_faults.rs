//! Bad lines: bits turned over, bytes lost, doubled, delayed and out of order, and the plug pulled. Every
//! update is whole or leaves the old network, and every result comes or is known to be lost. What came of it
//! is printed: `cargo test --release -p yawrig-tests --test system line_faults -- --nocapture`.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::VecDeque;
use std::time::{Duration, Instant};
use yawrig_base::error::{Error, Exit};
use yawrig_link::client::Client;
use yawrig_link::flash::{self, Silent};
use yawrig_rig::{Rig, Sensor, Start};
use yawrig_shared::wire::{Event, TRIAL_SAMPLES};
use yawrig_tests::line::{Board, Way};
use yawrig_tests::networks::{another, id, sound};
use yawrig_tests::PATIENCE;

/// What a line does to bytes, each with this probability; bits for `turned`.
#[derive(Clone, Copy, Debug, Default)]
struct Faults {
    turned: f64,
    lost: f64,
    doubled: f64,
    swapped: f64,
    /// Of a burst: held back until the next one.
    delayed: f64,
    /// Bytes until the plug is pulled.
    cut_after: Option<usize>,
}

impl Faults {
    /// A line of this kind, the same for the same seed as far as the bursts are the same.
    fn tamper(self, seed: u64) -> impl FnMut(Way, &mut Vec<u8>) -> bool + Send + 'static {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut held: [Vec<u8>; 2] = Default::default();
        let mut passed = 0;
        move |way, bytes| {
            let held = &mut held[usize::from(way == Way::ToDevice)];
            let mut out = std::mem::take(held);
            for byte in bytes.drain(..) {
                if random.random_bool(self.lost) {
                    continue;
                }
                let turned = (0..8).filter(|_| random.random_bool(self.turned));
                out.push(turned.fold(byte, |byte, bit| byte ^ (1 << bit)));
                if random.random_bool(self.doubled) {
                    out.push(byte);
                }
                if out.len() > 1 && random.random_bool(self.swapped) {
                    let last = out.len() - 1;
                    out.swap(last, last - 1);
                }
            }
            if !out.is_empty() && random.random_bool(self.delayed) {
                *held = std::mem::take(&mut out);
            }
            passed += out.len();
            *bytes = out;
            self.cut_after.is_none_or(|most| passed < most)
        }
    }
}

fn kinds() -> Vec<(&'static str, Faults)> {
    let none = Faults::default();
    let mut kinds = vec![
        ("no fault", none),
        ("bits turned, 1e-5", Faults { turned: 1e-5, ..none }),
        ("bits turned, 1e-4", Faults { turned: 1e-4, ..none }),
        ("bits turned, 3e-4", Faults { turned: 3e-4, ..none }),
        ("bits turned, 1e-3", Faults { turned: 1e-3, ..none }),
        ("bytes lost, 1e-3", Faults { lost: 1e-3, ..none }),
        ("bytes doubled, 1e-3", Faults { doubled: 1e-3, ..none }),
        ("bytes swapped, 1e-3", Faults { swapped: 1e-3, ..none }),
        ("bursts delayed, 1 in 3", Faults { delayed: 0.3, ..none }),
    ];
    // In the hello, the chunks, the trial and the commit: an update takes some 2700 bytes.
    for cut_after in [40, 500, 1500, 2400, 2600, 2650, 2700, 2720, 2740] {
        kinds.push(("plug pulled", Faults { cut_after: Some(cut_after), ..none }));
    }
    kinds
}

/// Writes over such a line; whether the update was done.
fn update(faults: Faults, seed: u64) -> bool {
    let board = Board::default();
    let write = |board: &Board, faults: Faults, seed, blob: &[u8]| {
        let line = board.plug_with(faults.tamper(seed));
        let path = line.path().display().to_string();
        let done = Client::open(&path).and_then(|mut c| flash::write(&mut c, blob, &mut Silent));
        drop(line);
        done
    };
    write(&board, Faults::default(), 0, &another()).expect("a good line");
    let done = write(&board, faults, seed, &sound());
    // A network on trial that nobody confirmed is given up.
    board.samples(&vec![0; TRIAL_SAMPLES as usize + 1]);
    let runs = |board: &Board| {
        let network = board.status().network;
        assert!(!network.on_trial);
        format!("{:08x}", network.id)
    };
    let before = runs(&board);
    board.restart();
    assert_eq!(runs(&board), before, "what runs is what the flash holds: {faults:?} {seed}");
    match &done {
        Ok(_) => assert_eq!(before, id(&sound()), "{faults:?} {seed}"),
        Err(Error { exit, help, .. }) => {
            assert!(matches!(exit, Exit::Flash | Exit::Timeout | Exit::Device), "{done:?}");
            assert!(!help.is_empty());
            // Only where the answer to the trial or the commit is missing may it be the new one.
            let either = help.contains("is not known") || help.contains("or in 10 s the old one");
            let allowed = either && before == id(&sound());
            assert!(allowed || before == id(&another()), "{faults:?} {seed}: {done:?}");
        }
    }
    done.is_ok()
}

#[test]
fn an_update_over_a_bad_line_is_done_or_leaves_the_old_network() {
    let each: u64 = std::env::var("YAWRIG_LINES").ok().and_then(|n| n.parse().ok()).unwrap_or(6);
    for (what, faults) in kinds() {
        // They mostly wait.
        let done = std::thread::scope(|scope| {
            let lines: Vec<_> = (0..each).map(|n| scope.spawn(move || update(faults, n))).collect();
            lines.into_iter().map(|l| l.join().expect("no panic")).filter(|d| *d).count()
        });
        println!(
            "{what:24} {:4} done {done} of {each}",
            faults.cut_after.map_or(String::new(), |c| c.to_string())
        );
        if faults.turned <= 1e-5
            && faults.cut_after.is_none()
            && faults.lost == 0.0
            && faults.doubled == 0.0
            && faults.swapped == 0.0
        {
            assert_eq!(done as u64, each, "{what}");
        }
    }
}

/// Plays a release and collects what is said of it until the device is idle; what was lost for good.
fn results(faults: Faults, seed: u64) -> (Vec<(u16, Event)>, u64) {
    let rig = Rig::default();
    let condition = rig.conditions(10.0).nth(9).expect("a condition");
    let release =
        rig.release(&condition, &Start::default(), &Sensor::default(), 1).expect("a release");
    let mut counts: VecDeque<u16> = release.samples.filter_map(|s| s.counts).collect();
    let board = Board::default();
    let line = board.plug_with(faults.tamper(seed));
    let path = line.path().display().to_string();
    let opened = (0..20).find_map(|_| Client::open(&path).ok());
    let mut client = opened.expect("one hello of twenty gets through");
    let mut events = Vec::new();
    let until = Instant::now() + PATIENCE;
    loop {
        assert!(Instant::now() < until, "{faults:?} {seed}: {events:?} {:?}", board.status());
        let some = counts.len().min(2000);
        board.samples(&counts.drain(..some).collect::<Vec<_>>());
        match client.next_event(Duration::from_millis(if some == 0 { 1200 } else { 5 })) {
            Ok(Some(numbered)) => events.push((numbered.number, numbered.event)),
            // Nothing came for a while; and nothing is left to come.
            Ok(None) if some == 0 => {
                let status = board.status();
                let known = events.len() as u64 + client.missed_events();
                if known >= u64::from(status.next_event) {
                    return (events, client.missed_events());
                }
            }
            Ok(None) => {}
            Err(error) => panic!("{error:?}"),
        }
    }
}

#[test]
fn results_lost_on_the_line_are_fetched_again() {
    let (whole, lost) = results(Faults::default(), 0);
    assert!(whole.len() > 10 && lost == 0);
    assert!(matches!(whole[whole.len() - 3].1, Event::Release(_)), "{whole:?}");
    assert!(matches!(whole[whole.len() - 1].1, Event::Refined(_)), "{whole:?}");
    for (what, faults) in kinds().into_iter().filter(|(_, faults)| faults.cut_after.is_none()) {
        std::thread::scope(|scope| {
            for seed in 0..3 {
                let whole = &whole;
                scope.spawn(move || {
                    let (got, lost) = results(faults, seed);
                    println!("{what:24} {} results, {lost} lost", got.len());
                    // Nothing that was not sent is ever shown, and nothing comes twice or out of order.
                    let mut sent = whole.iter();
                    assert!(got.iter().all(|g| sent.any(|w| w == g)), "{what} {seed}");
                    // On the worst line an event may be given up; before, all come.
                    if faults.turned < 1e-3 {
                        assert_eq!((got.len(), lost), (whole.len(), 0), "{what} {seed}");
                    }
                });
            }
        });
    }
}
