//! What is tried on the boards with Raspberry Pi's processors.

use crate::harness::{Board, Both, Kept, Machine};
use yawrig_firmware::BUILT_IN;
use yawrig_shared::blob;
use yawrig_shared::wire::{Cause, Reply, Request, CHUNK};

pub const PAGE: usize = 256;
pub const SECTOR: usize = 4096;
pub const KEPT_BYTES: usize = (64 + 256) * 1024;

/// What is tried on each of them alike, beside what is on every board; its code, and its number as USB tells
/// it.
macro_rules! each_rp_board {
    ($board:ty, $code:expr, $serial:expr) => {
        crate::each_board!($board, $code);

        #[test]
        #[ignore = "needs unicorn: tests/run runs it"]
        fn it_starts_samples_by_itself_answers_the_host_and_sees_that_the_model_is_held() {
            crate::rp::it_starts::<$board>($serial);
        }

        #[test]
        #[ignore = "needs unicorn: tests/run runs it"]
        fn no_sample_is_lost_while_a_network_s_place_is_erased_as_slowly_as_may_be() {
            crate::rp::nothing_is_lost_while_it_erases::<$board>();
        }

        #[test]
        #[ignore = "needs unicorn: tests/run runs it"]
        fn wherever_power_is_cut_in_an_update_the_old_network_runs_or_the_new_one() {
            crate::rp::power_is_cut::<$board>();
        }
    };
}
pub(crate) use each_rp_board;

/// A figure of an answer.
fn figure<'a>(said: &'a str, name: &str) -> &'a str {
    let found = said.split_whitespace().find_map(|pair| pair.strip_prefix(name)?.strip_prefix('='));
    found.unwrap_or_else(|| panic!("{name} in {said}"))
}

fn number(said: &str, name: &str) -> f64 {
    figure(said, name).parse().expect("a number")
}

/// It starts, samples by itself, answers the host, tells its number, and sees that the model is held.
pub fn it_starts<B: Board>(serial: &str) {
    let mut machine = Machine::start(B::NAME);
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
    assert_eq!(figure(&state, "serial"), serial);
    // DMA has come to the end of its ring, and goes on; the interrupt comes.
    assert!(number(&state, "rounds") >= 4.0 && number(&state, "interrupts") > 40.0, "{state}");
}

/// A network's place is erased in four sectors, each as slowly as one may be: what is sampled meanwhile is
/// all there.
pub fn nothing_is_lost_while_it_erases<B: Board>() {
    let mut both = Both::<B>::start();
    let begin = Request::FlashBegin { length: BUILT_IN.len() as u32 };
    assert_eq!(both.ask_while(&begin, &[2048; 1700]), Reply::Done);
    let status = both.status();
    assert_eq!((status.samples, status.lost_samples), (1700, 0));
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

/// Wherever power is cut in an update the old network runs or the new one.
pub fn power_is_cut<B: Board>() {
    let mut both = Both::<B>::start();
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
            let kept = B::Flash::of(both.flash_there());
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
