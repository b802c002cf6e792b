//! Measures the deepest stack of all the device does; `tests/budgets` runs it.
#![no_std]
#![no_main]

use core::ptr::addr_of_mut;
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m::asm::{dsb, isb};
use cortex_m::peripheral::SCB;
use cortex_m::register::msp;
use cortex_m_rt::{entry, exception};
use cortex_m_semihosting::debug;
use ed25519_compact::{KeyPair, Noise, Seed};
use yawrig_firmware::device::Device;
use yawrig_firmware::sums::Sums;
use yawrig_firmware::BUILT_IN;
use yawrig_mps2_an386::{digits, flash, say, stack, swing};
use yawrig_shared::blob;
use yawrig_shared::frame::Encoded;
use yawrig_shared::wire::{
    self, network_message, update_message, Decoder, Reply, Request, Signature, CHUNK,
};

/// With a lock, as the boards that have a flash.
type Board = Device<&'static mut flash::Flash>;

/// Lowest stack pointer of an interrupt that sums samples up.
static LOWEST: AtomicU32 = AtomicU32::new(0);

/// Whose key locks it.
const SEED: [u8; 32] = [7; 32];

#[entry]
fn main() -> ! {
    stack::paint();
    // SAFETY: main runs once.
    let slots = unsafe { flash::erased() };
    let mut device = Device::stopped(slots, "mps2-an386");
    device.start();
    let device = &mut device;
    report("start");
    for index in 0..swing::SAMPLES {
        device.sample(swing::counts(index));
        device.work();
        drain(device);
    }
    report("release");
    let written = write(device);
    let signed = write_signed(device);
    say_deepest("flash", written);
    say_deepest("signed", signed);
    say(&["interrupt ", digits(interrupt(), 10, &mut [0; 10])]);
    debug::exit(debug::EXIT_SUCCESS);
    unreachable!("QEMU was asked to exit")
}

/// Says the deepest stack so far, this much done.
fn report(done: &str) {
    say_deepest(done, deepest());
}

fn say_deepest(done: &str, bytes: usize) {
    say(&["stack_", done, " ", digits(bytes as u32, 10, &mut [0; 10])]);
}

fn deepest() -> usize {
    stack::deepest().expect("paint is left")
}

fn drain(device: &mut Board) {
    while device.transmit().is_some() {}
}

/// Bytes that an interrupt which sums samples up takes of the stack; the FPU's registers are among them,
/// since the device computes with it.
#[inline(never)]
fn interrupt() -> u32 {
    let before = msp::read();
    SCB::set_pendst();
    dsb();
    isb();
    before - LOWEST.load(Ordering::Relaxed)
}

#[exception]
fn SysTick() {
    sum_up();
}

#[inline(never)]
fn sum_up() {
    static SUMS: Sums<256, 1024> = Sums::new();
    SUMS.collect(16, 16, |at| {
        LOWEST.store(msp::read(), Ordering::Relaxed);
        at as u16
    });
}

/// Writes a network to either slot, as a host does; the deepest stack by then.
fn write(device: &mut Board) -> usize {
    for generation in 1..=2 {
        let bytes = network(generation);
        ask(device, &Request::FlashBegin { length: bytes.len() as u32 });
        write_chunks(device, bytes);
        ask(device, &Request::FlashTrial);
        ask(device, &Request::FlashCommit);
    }
    runs(device, 2);
    deepest()
}

/// The same on a locked device, which checks both of an update's signatures; the deepest stack of it. What
/// signs is none of the device's: its stack is painted over.
fn write_signed(device: &mut Board) -> usize {
    ask(device, &Request::Lock { key: *KeyPair::from_seed(Seed::new(SEED)).pk });
    let Some(Reply::Challenge { number, nonce }) = ask(device, &Request::Challenge) else {
        panic!("it is locked")
    };
    let bytes = network(3);
    let length = bytes.len() as u32;
    let signature = signed(&update_message(number, nonce, length), &[]);
    stack::paint();
    ask(device, &Request::FlashPermit { length, signature });
    ask(device, &Request::FlashBegin { length });
    write_chunks(device, bytes);
    let before = deepest();
    let signature = signed(&network_message(number, nonce), bytes);
    stack::paint();
    ask(device, &Request::FlashSignature { signature });
    ask(device, &Request::FlashTrial);
    ask(device, &Request::FlashCommit);
    runs(device, 3);
    before.max(deepest())
}

fn network(generation: u32) -> &'static [u8] {
    static mut BYTES: [u8; BUILT_IN.len()] = [0; BUILT_IN.len()];
    // SAFETY: the last one has been written.
    let bytes = unsafe { &mut *addr_of_mut!(BYTES) };
    bytes.copy_from_slice(BUILT_IN);
    blob::set_generation(bytes, generation).expect("a blob is compiled in");
    bytes
}

fn write_chunks(device: &mut Board, bytes: &[u8]) {
    for (i, chunk) in bytes.chunks(CHUNK).enumerate() {
        let bytes = chunk.iter().copied().collect();
        ask(device, &Request::FlashChunk { offset: (i * CHUNK) as u32, bytes });
    }
}

fn runs(device: &mut Board, generation: u32) {
    let Some(Reply::Status(status)) = ask(device, &Request::Status) else { panic!("no status") };
    assert!(status.network.generation == generation && !status.network.on_trial, "it runs");
}

#[inline(never)]
fn signed(message: &[u8], rest: &[u8]) -> Signature {
    let key = KeyPair::from_seed(Seed::new(SEED)).sk;
    let mut state = key.sign_incremental(Noise::new([0; Noise::BYTES]));
    state.absorb(message);
    state.absorb(rest);
    Signature::from_slice(&*state.sign()).expect("64 bytes")
}

fn ask(device: &mut Board, request: &Request) -> Option<Reply> {
    static mut SEQUENCE: u16 = 0;
    // SAFETY: the only place that has it.
    let sequence = unsafe { &mut *addr_of_mut!(SEQUENCE) };
    *sequence += 1;
    let reply = answer(device, *sequence, request);
    assert!(!matches!(reply, None | Some(Reply::Refused(_))), "it is done");
    reply
}

/// The device's answer. What the host would need for it is none of the device's stack: it is done with before
/// the device is called, or after.
fn answer(device: &mut Board, sequence: u16, request: &Request) -> Option<Reply> {
    for byte in encoded(sequence, request) {
        device.receive(*byte);
    }
    decoded(device)
}

#[inline(never)]
fn encoded(sequence: u16, request: &Request) -> &'static [u8] {
    static mut FRAME: Encoded = Encoded::new();
    // SAFETY: the last one has been handed over.
    let frame = unsafe { &mut *addr_of_mut!(FRAME) };
    *frame = wire::encode(sequence, request).expect("a request fits");
    frame
}

#[inline(never)]
fn decoded(device: &mut Board) -> Option<Reply> {
    static mut DECODER: Decoder = Decoder::new();
    // SAFETY: the only reference, dropped at the end.
    let decoder = unsafe { &mut *addr_of_mut!(DECODER) };
    while let Some(byte) = device.transmit() {
        if let Some(Ok(frame)) = decoder.push(byte) {
            if let Some(Ok(reply)) = frame.message::<Reply>() {
                drain(device);
                return Some(reply);
            }
        }
    }
    None
}
