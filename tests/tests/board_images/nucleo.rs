//! ST's NUCLEO-F446RE.

use crate::each_board;
use crate::harness::{Board, Both, Memory, CONVERSIONS};
use ed25519_compact::KeyPair;
use yawrig_firmware::BUILT_IN;
use yawrig_shared::blob;
use yawrig_shared::wire::{
    encode, network_message, update_message, Reply, Request, Signature, CHUNK,
};

pub struct Nucleo;

impl Board for Nucleo {
    const NAME: &'static str = "nucleo-f446re";
    const CLOCK_U_PPM: f32 = 29.0;
    type Flash = Memory<4, 16_384>;
}

// What looks at the potentiometer, and waits where nothing else is to be done, is in RAM.
each_board!(Nucleo, 0x2001_e040..0x2001_e200);

/// Half of its RAM.
const RAM_BYTES: usize = 64 * 1024;
/// The firmware's ring of samples, less what is left alone before the writer.
const KEPT: usize = 1024 - 8;

fn network(generation: u32) -> Vec<u8> {
    let mut bytes = BUILT_IN.to_vec();
    blob::set_generation(&mut bytes, generation).expect("a blob");
    bytes
}

/// Writes it; the place is erased while these readings come.
fn write(both: &mut Both<Nucleo>, bytes: &[u8], readings: &[u16]) {
    let begin = Request::FlashBegin { length: bytes.len() as u32 };
    assert_eq!(both.ask_while(&begin, readings), Reply::Done);
    for (index, chunk) in bytes.chunks(CHUNK).enumerate() {
        let (offset, bytes) = ((index * CHUNK) as u32, chunk.iter().copied().collect());
        assert_eq!(both.ask(&Request::FlashChunk { offset, bytes }), Reply::Done);
    }
}

fn commit(both: &mut Both<Nucleo>) {
    assert_eq!(both.ask(&Request::FlashTrial), Reply::Done);
    assert_eq!(both.ask(&Request::FlashCommit), Reply::Done);
}

fn figure(said: &str, name: &str) -> usize {
    let found = said.split_whitespace().find_map(|pair| pair.strip_prefix(name)?.strip_prefix('='));
    found.expect("a figure").parse().expect("a number")
}

/// An erase takes as long as it may: 0.5 s of the one place, 1.1 s of the other, of which the last 1016 ms
/// are kept.
#[test]
#[ignore = "needs unicorn: tests/run runs it"]
fn sampling_goes_on_while_a_place_is_erased_and_what_is_not_kept_is_counted() {
    let mut both = Both::<Nucleo>::start();
    let still = [2048; 1100];
    for (generation, while_erased) in [(1, &still[..]), (2, &still[..KEPT])] {
        write(&mut both, &network(generation), while_erased);
        commit(&mut both);
    }
    write(&mut both, &network(3), &still);
    commit(&mut both);
    let status = both.status();
    assert_eq!((status.network.generation, status.lost_samples), (3, 0));
    let samples = "0800".repeat(CONVERSIONS * still.len());
    assert_eq!(both.machine.ask(&format!("samples {samples}")), "ok");
    let length = BUILT_IN.len() as u32;
    assert_eq!(both.ask_there(&Request::FlashBegin { length }), Ok(Reply::Done));
    let Ok(Reply::Status(after)) = both.ask_there(&Request::Status) else { panic!("no status") };
    assert_eq!(after.samples, status.samples + still.len() as u32);
    assert_eq!(after.lost_samples as usize, still.len() - KEPT);
}

/// What the test above rests on: an interrupt that is not in RAM is not had through.
#[test]
#[ignore = "needs unicorn: tests/run runs it"]
fn an_image_that_touches_the_flash_while_a_place_is_erased_does_not_pass() {
    let mut both = Both::<Nucleo>::start();
    assert_eq!(both.machine.ask("misplace"), "ok");
    let samples = "0800".repeat(CONVERSIONS * 4);
    let begin = Request::FlashBegin { length: BUILT_IN.len() as u32 };
    // Before the interrupt comes it passes.
    both.machine.ask(&format!("samples {samples}"));
    assert_eq!(both.ask_there(&begin), Ok(Reply::Done));
    // What is still erased is not erased again.
    let bytes = BUILT_IN[..CHUNK].iter().copied().collect();
    assert_eq!(both.ask_there(&Request::FlashChunk { offset: 0, bytes }), Ok(Reply::Done));
    both.machine.ask(&format!("samples {}", samples.repeat(4)));
    let frame = encode(99, &begin).expect("a frame");
    both.machine.ask(&format!("line {}", data_encoding::HEXLOWER.encode(&frame)));
    let said = both.machine.ask("run");
    assert!(said.starts_with("wrong: the flash is touched at 0x80"), "{said}");
    assert!(said.ends_with(" while a sector is erased"), "{said}");
}

/// A signed update, which goes deepest into the stack, and a release: with its variables the image takes less
/// than half.
#[test]
#[ignore = "needs unicorn: tests/run runs it"]
fn half_of_the_ram_is_enough_for_the_deepest_stack() {
    let mut both = Both::<Nucleo>::start();
    let pair = KeyPair::from_seed([7; 32].into());
    let sign = |message: &[u8]| Signature::from_slice(&*pair.sk.sign(message, None)).expect("64");
    assert_eq!(both.ask(&Request::Lock { key: *pair.pk }), Reply::Done);
    let Reply::Challenge { number, nonce } = both.ask(&Request::Challenge) else {
        panic!("it is locked")
    };
    let bytes = network(1);
    let length = bytes.len() as u32;
    let signature = sign(&update_message(number, nonce, length));
    assert_eq!(both.ask(&Request::FlashPermit { length, signature }), Reply::Done);
    write(&mut both, &bytes, &[2048; 600]);
    let signature = sign(&[&network_message(number, nonce)[..], &bytes].concat());
    assert_eq!(both.ask(&Request::FlashSignature { signature }), Reply::Done);
    commit(&mut both);
    assert_eq!(both.status().network.generation, 1);
    let used = figure(&both.machine.ask("state"), "ram");
    println!("{used} bytes of RAM used");
    assert!(used <= RAM_BYTES && used > RAM_BYTES / 2, "{used}");
}

#[test]
#[ignore = "needs unicorn: tests/run runs it"]
fn its_registers_give_the_rates() {
    let mut both = Both::<Nucleo>::start();
    let state = both.machine.ask("state");
    // TIM2's registers give sixteen conversions a millisecond of the clock that RCC's give; the line's rate
    // is off by less than UART's 2 %.
    assert!(state.contains(" rate_hz=16000.0 ") && state.contains(" latency=2"), "{state}");
    let baud = state.split("baud=").nth(1).and_then(|text| text.split(' ').next());
    let baud: f64 = baud.expect("a rate").parse().expect("a number");
    assert!((baud / 115_200.0 - 1.0).abs() < 0.005, "{state}");
}

#[test]
#[ignore = "needs unicorn: tests/run runs it"]
fn below_the_supply_at_which_flash_is_written_well_the_chip_holds_itself_in_reset() {
    let mut both = Both::<Nucleo>::start();
    assert_eq!(both.status().samples, 0);
    // As the option bytes come, but for the level of the brown-out reset: 2.7 V.
    let options = |both: &mut Both<Nucleo>| {
        let state = both.machine.ask("state");
        state.split_whitespace().find_map(|pair| pair.strip_prefix("options=")).map(str::to_owned)
    };
    assert_eq!(options(&mut both).as_deref(), Some("0xfffaae1"));
    both.power_cycle();
    assert_eq!(both.status().samples, 0);
    assert_eq!(options(&mut both).as_deref(), Some("0xfffaae1"));
}
