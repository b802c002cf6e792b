//! Raspberry Pi's Pico 2.

use crate::each_board;
use crate::harness::{Board, Both, Kept, Machine, Memory};
use yawrig_firmware::BUILT_IN;
use yawrig_shared::blob;
use yawrig_shared::wire::{Cause, Reply, Request, CHUNK};

const PAGE: usize = 256;
const SECTOR: usize = 4096;

pub struct Pico2;

impl Board for Pico2 {
    const NAME: &'static str = "pico2";
    const CLOCK_U_PPM: f32 = 17.0;
    type Flash = Memory<PAGE, SECTOR>;
}

each_board!(Pico2, 0x1000_0000..0x103f_0000);

/// A figure of an answer.
fn figure<'a>(said: &'a str, name: &str) -> &'a str {
    let found = said.split_whitespace().find_map(|pair| pair.strip_prefix(name)?.strip_prefix('='));
    found.unwrap_or_else(|| panic!("{name} in {said}"))
}

fn number(said: &str, name: &str) -> f64 {
    figure(said, name).parse().expect("a number")
}

#[test]
#[ignore = "needs unicorn: tests/run runs it"]
fn it_starts_samples_by_itself_answers_the_host_and_sees_that_the_model_is_held() {
    let mut machine = Machine::start(Pico2::NAME);
    // Longer than its watchdog waits.
    let said = machine.ask("free 4.5");
    println!("{said}");
    assert_eq!(figure(&said, "reset"), "no", "by its watchdog");
    let samples = number(&said, "samples");
    assert!((4490.0..=4500.0).contains(&samples), "{samples}");
    assert!(number(&said, "polls") > 10_000.0, "{said}");
    // On while the model is held.
    assert_eq!(figure(&said, "lit"), "1.00");
    let state = machine.ask("state");
    println!("{state}");
    assert_eq!(number(&state, "rate_hz"), 16_000.0);
    assert_eq!((number(&state, "timer_hz"), number(&state, "watchdog_hz")), (1e6, 1e6));
    assert_eq!(number(&state, "usb_hz"), 48e6);
    // What the host has been told.
    assert_eq!((figure(&state, "maker"), figure(&state, "product")), ("yawrig", "yawrig"));
    assert_eq!(figure(&state, "serial"), "A1C90B7A6F5E4D3C");
}

fn network(generation: u32) -> Vec<u8> {
    let mut bytes = BUILT_IN.to_vec();
    blob::set_generation(&mut bytes, generation).expect("a blob");
    bytes
}

/// What the host sends for an update.
fn update(bytes: &[u8]) -> Vec<Request> {
    let chunks = bytes.chunks(CHUNK).enumerate().map(|(index, chunk)| Request::FlashChunk {
        offset: (index * CHUNK) as u32,
        bytes: chunk.iter().copied().collect(),
    });
    let begin = Request::FlashBegin { length: bytes.len() as u32 };
    [begin].into_iter().chain(chunks).chain([Request::FlashTrial, Request::FlashCommit]).collect()
}

#[test]
#[ignore = "needs unicorn: tests/run runs it"]
fn wherever_power_is_cut_in_an_update_the_old_network_runs_or_the_new_one() {
    let mut both = Both::<Pico2>::start();
    for request in update(&network(1)) {
        assert_eq!(both.ask(&request), Reply::Done);
    }
    let (mut runs, mut cuts, mut new) = (1, 0, 0);
    // Four sectors are erased, pages written, then that of the length and the one that commits: its first
    // four bytes do.
    let operations = 16 * 1024 / SECTOR + BUILT_IN.len().div_ceil(PAGE) + 2;
    for operation in 0..operations {
        for part in [0.0, 2.0 / PAGE as f64, 0.5, 1.0] {
            assert_eq!(both.machine.ask(&format!("cut {operation} {part}")), "ok");
            let mut replies =
                update(&network(runs + 1)).into_iter().map(|request| both.ask_there(&request));
            let by = replies.find_map(|reply| match reply {
                Ok(reply) => {
                    assert_eq!(reply, Reply::Done);
                    None
                }
                Err(by) => Some(by),
            });
            drop(replies);
            assert_eq!(by.as_deref(), Some("power"), "operation {operation}");
            // Both start from what the flash holds now, and say the same of it.
            assert_eq!(both.machine.run("run"), (Vec::new(), None));
            let kept = Memory::of(both.flash_there());
            both.begin_here(kept, Cause::Power);
            let generation = both.status().network.generation;
            let may_be_new = operation + 1 == operations && part >= 0.5;
            assert_eq!(generation, runs + u32::from(may_be_new), "operation {operation}, {part}");
            cuts += 1;
            new += u32::from(generation > runs);
            runs = generation;
        }
    }
    println!("{cuts} cuts: the old network ran after {}, the new one after {new}", cuts - new);
    assert_eq!(new, 2, "of the one that commits, half and all");
    // It takes the next update, whole.
    for request in update(&network(runs + 1)) {
        assert_eq!(both.ask(&request), Reply::Done);
    }
    both.flashes_agree();
    assert_eq!(both.status().network.generation, runs + 1);
}
