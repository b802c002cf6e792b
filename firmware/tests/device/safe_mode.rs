//! Starts that nobody asked for: what ended the run before, and a device that only answers after three of them.

use crate::desk::Desk;
use yawrig_firmware::crash::{Note, BYTES};
use yawrig_firmware::device::Device;
use yawrig_firmware::slots::MemoryFlash;
use yawrig_firmware::BUILT_IN;
use yawrig_shared::blob;
use yawrig_shared::wire::{Cause, Crash, Reply, Request, SlotState, CRASH_FILE};

fn crash_of(note: Note) -> Option<Crash> {
    note.begin(Cause::Software).0.crash
}

#[test]
fn what_ended_the_run_before_is_read_back_and_nothing_else_is() {
    let note = Note::NONE.crashed("firmware/src/device.rs", 123);
    let crash = crash_of(note).expect("a crash");
    assert_eq!((crash.file.as_str(), crash.line), ("firmware/src/device.rs", 123));
    // Of a long path the end; a letter that was cut in two is left out.
    let long = format!("{}é{}", "x".repeat(10), "y".repeat(CRASH_FILE - 1));
    let crash = crash_of(Note::NONE.crashed(&long, 1)).expect("a crash");
    assert_eq!(crash.file.as_str(), "y".repeat(CRASH_FILE - 1));
    let fault = crash_of(Note::NONE.crashed("", 0x0801_2345)).expect("a fault");
    assert_eq!(fault.line, 0x0801_2345);
    // What RAM holds when power comes, and a note of which a bit is another.
    for fill in [0x00_u8, 0xff, 0x5a] {
        assert_eq!(crash_of(Note([fill; BYTES])), None);
    }
    for bit in 0..8 * BYTES {
        let mut other = note;
        other.0[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(crash_of(other), None, "bit {bit}");
    }
}

#[test]
fn starts_that_nobody_asked_for_are_counted_until_one_is_asked_for() {
    let mut note = Note([0x5a; BYTES]);
    let mut starts = |causes: &[Cause]| {
        let begin = |cause: &Cause| {
            let (start, restarts, running) = note.begin(*cause);
            assert_eq!((start.cause, start.crash), (*cause, None));
            note = running;
            restarts
        };
        causes.iter().map(begin).collect::<Vec<_>>()
    };
    assert_eq!(starts(&[Cause::Power, Cause::Watchdog, Cause::Software]), [0, 1, 2]);
    assert_eq!(starts(&[Cause::Watchdog, Cause::Pin, Cause::Watchdog]), [3, 0, 1]);
    assert_eq!(starts(&[Cause::Watchdog; 300]).last(), Some(&u8::MAX));
    // A crash leaves the count as it is, and is said once.
    let running = Note::NONE.begin(Cause::Watchdog).2.crashed("src/main.rs", 7);
    let (start, restarts, running) = running.begin(Cause::Software);
    assert_eq!((start.crash.map(|crash| crash.line), restarts), (Some(7), 2));
    let (start, restarts, _) = running.begin(Cause::Watchdog);
    assert_eq!((start.crash, restarts), (None, 3));
}

/// A device on this flash after so many starts that nobody asked for.
fn started(flash: MemoryFlash, restarts: u8) -> Desk {
    let mut desk = Desk::new(MemoryFlash::new());
    let start = Note::NONE.begin(Cause::Watchdog).0;
    desk.device = Device::stopped(flash, "desk");
    desk.device.set_start(start, restarts);
    desk.device.start();
    desk
}

fn of_generation(generation: u32) -> Vec<u8> {
    let mut bytes = BUILT_IN.to_vec();
    blob::set_generation(&mut bytes, generation).expect("a blob");
    bytes
}

fn writes(desk: &mut Desk, generation: u32) {
    desk.write(&of_generation(generation));
    assert_eq!(desk.ask(&Request::FlashTrial), Reply::Done);
    assert_eq!(desk.ask(&Request::FlashCommit), Reply::Done);
}

#[test]
fn after_three_it_takes_up_nothing_and_a_network_that_is_written_is_the_only_one() {
    let mut desk = Desk::new(MemoryFlash::new());
    [5, 6].iter().for_each(|generation| writes(&mut desk, *generation));
    let kept = desk.device.into_flash();
    let network = |desk: &mut Desk| desk.status().network;
    for (restarts, slot, generation) in
        [(0, Some(1), 6), (2, Some(1), 6), (3, None, 0), (200, None, 0)]
    {
        let mut desk = started(kept.clone(), restarts);
        let found = network(&mut desk);
        assert_eq!((found.slot, found.generation), (slot, generation), "after {restarts}");
        assert_eq!(desk.device.is_safe(), restarts >= 3);
        assert_eq!(desk.status().restarts, restarts);
    }
    // Of a lower generation than those before; they are gone with the next start, too.
    let mut desk = started(kept, 3);
    writes(&mut desk, 1);
    assert_eq!(network(&mut desk).generation, 1);
    let mut desk = started(desk.device.into_flash(), 0);
    let status = desk.status();
    assert_eq!((status.network.slot, status.network.generation), (Some(0), 1));
    assert_eq!(status.slots[1], SlotState::Empty);
    // As often as one likes.
    let mut desk = started(desk.device.into_flash(), 3);
    (1..=3).for_each(|generation| writes(&mut desk, generation));
    let status = started(desk.device.into_flash(), 0).status();
    assert_eq!(status.network.generation, 3);
    assert_eq!(status.slots.iter().filter(|slot| **slot == SlotState::Empty).count(), 1);
}

#[test]
fn a_minute_without_a_fault_and_the_next_one_is_the_first() {
    let mut desk = started(MemoryFlash::new(), 2);
    (0..59_999).for_each(|_| desk.device.sample(32_768));
    assert!(!desk.device.has_recovered());
    assert_eq!(desk.status().restarts, 2);
    desk.device.sample(32_768);
    assert!(desk.device.has_recovered() && !desk.device.has_recovered());
    assert_eq!(desk.status().restarts, 0);
}
