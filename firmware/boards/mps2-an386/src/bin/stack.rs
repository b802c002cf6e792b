//! Measures the deepest stack of all the device does; `tests/budgets` runs it.
#![no_std]
#![no_main]

use core::mem::MaybeUninit;
use core::ptr::addr_of_mut;
use cortex_m_rt::entry;
use cortex_m_semihosting::debug;
use yawrig_firmware::device::Device;
use yawrig_firmware::lock::{self, Challenge};
use yawrig_firmware::slots::{MemoryFlash, Sector};
use yawrig_firmware::BUILT_IN;
use yawrig_mps2_an386::{digits, flash, say, stack, swing};
use yawrig_shared::blob;
use yawrig_shared::frame::Encoded;
use yawrig_shared::wire::{self, Decoder, Refusal, Reply, Request, Signature, CHUNK};

type Board = Device<&'static mut MemoryFlash, false>;

#[entry]
fn main() -> ! {
    stack::paint();
    // SAFETY: main runs once.
    let slots = unsafe { flash::erased() };
    let mut device = Device::without_lock(slots, "mps2-an386");
    device.start();
    let device = &mut device;
    report("start");
    for index in 0..swing::SAMPLES {
        device.sample(swing::counts(index));
        device.work();
        drain(device);
    }
    report("release");
    write(device);
    report("flash");
    stack::paint();
    check_signature();
    let deepest = stack::deepest().expect("paint is left") - stack::depth();
    say(&["signature ", digits(deepest as u32, 10, &mut [0; 10])]);
    debug::exit(debug::EXIT_SUCCESS);
    unreachable!("QEMU was asked to exit")
}

/// Says the deepest stack so far, this much done.
fn report(done: &str) {
    let deepest = stack::deepest().expect("paint is left");
    say(&["stack_", done, " ", digits(deepest as u32, 10, &mut [0; 10])]);
}

fn drain(device: &mut Board) {
    while device.transmit().is_some() {}
}

/// Writes a network to either slot, as a host does.
fn write(device: &mut Board) {
    let bytes =
        cortex_m::singleton!(: [u8; blob::LONGEST] = [0; blob::LONGEST]).expect("called once");
    let bytes = &mut bytes[..BUILT_IN.len()];
    bytes.copy_from_slice(BUILT_IN);
    let mut sequence = 0;
    let mut ask = |request| {
        sequence += 1;
        answer(device, sequence, &request)
    };
    for generation in 1..=2 {
        blob::set_generation(bytes, generation).expect("a blob is compiled in");
        ask(Request::FlashBegin { length: bytes.len() as u32 });
        for (i, chunk) in bytes.chunks(CHUNK).enumerate() {
            let bytes = chunk.iter().copied().collect();
            ask(Request::FlashChunk { offset: (i * CHUNK) as u32, bytes });
        }
        ask(Request::FlashTrial);
        ask(Request::FlashCommit);
    }
    let Some(Reply::Status(status)) = ask(Request::Status) else { panic!("no status") };
    assert!(status.network.generation == 2 && !status.network.on_trial, "the second one runs");
}

/// Checks a signature to its end, which is that it is a wrong one, as a board with a lock does.
#[inline(never)]
fn check_signature() {
    /// A point of the curve (RFC 8032, 7.1, test 1), and so a public key and a signature's first half.
    const POINT: [u8; 32] = [
        0xd7, 0x5a, 0x98, 0x01, 0x82, 0xb1, 0x0a, 0xb7, 0xd5, 0x4b, 0xfe, 0xd3, 0xc9, 0x64, 0x07,
        0x3a, 0x0e, 0xe1, 0x72, 0xf3, 0xda, 0xa6, 0x23, 0x25, 0xaf, 0x02, 0x1a, 0x68, 0xf7, 0x07,
        0x51, 0x1a,
    ];
    // None of the RAM that the stack has on a board.
    #[link_section = ".flash_stand_in"]
    static mut LOCKABLE: MaybeUninit<MemoryFlash> = MaybeUninit::uninit();
    // SAFETY: called once.
    let flash = unsafe { flash::erase(addr_of_mut!(LOCKABLE)) };
    lock::lock(flash, &POINT).expect("a key");
    let mut signature = Signature::from_slice(&POINT).expect("half of it");
    signature.resize(64, 1).expect("64 bytes");
    let challenge = Challenge { number: 1, nonce: 1 };
    let checked = lock::check_network(
        flash,
        Sector::First,
        0..BUILT_IN.len(),
        Some(challenge),
        Some(&signature),
    );
    assert!(checked == Err(Refusal::WrongSignature));
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
