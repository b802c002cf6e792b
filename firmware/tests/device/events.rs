//! The device in another program: results as values, and an interrupt that samples while the program writes
//! flash.

use crate::desk::Swing;
use yawrig_firmware::device::Device;
use yawrig_firmware::input::Input;
use yawrig_firmware::queue::Queue;
use yawrig_firmware::sensors::absolute::Absolute;
use yawrig_firmware::slots::MemoryFlash;
use yawrig_shared::wire::{Decoder, Event};

#[test]
fn results_are_given_as_values_in_order_and_once() {
    let mut device = Device::new(MemoryFlash::new(), "program");
    let (mut given, mut on_the_line, mut decoder) = (Vec::new(), Vec::new(), Decoder::new());
    for counts in Swing::new(12.0, 0.03).counts(1) {
        device.sample(counts);
        device.work();
        given.extend(device.events());
        while let Some(byte) = device.transmit() {
            if let Some(Ok(frame)) = decoder.push(byte) {
                on_the_line.extend(frame.message::<Event>().transpose().expect("an event"));
            }
        }
    }
    assert!(given.iter().any(|event| matches!(event, Event::Refined(_))));
    assert_eq!(given, on_the_line);
    assert_eq!(device.events().count(), 0);
}

#[test]
fn who_asks_late_is_given_the_last_ones() {
    let mut device = Device::new(MemoryFlash::new(), "program");
    for seed in 0..4 {
        for counts in Swing::new(12.0, 0.01).counts(seed) {
            device.sample(counts);
            device.work();
        }
    }
    let given: Vec<Event> = device.events().collect();
    assert_eq!(given.len(), yawrig_shared::wire::KEPT_EVENTS);
    let mut numbers = given.iter().rev().filter_map(|event| match event {
        Event::Release(release) => Some(release.release),
        _ => None,
    });
    assert_eq!(numbers.next(), Some(3));
}

#[test]
fn what_finds_no_room_is_lost_where_it_was_and_counted() {
    let mut queue = Queue::<u32, 64>::new();
    let (mut readings, mut waiting) = queue.split();
    let mut input = Input::new(Absolute::new(14, 1000, 0));
    let mut device = Device::new(MemoryFlash::new(), "program");
    device.set_sensor(&input.about());
    // The program is away for a hundred samples, of which sixty-three find room.
    (0..100).for_each(|_| readings.put(Some(8000)));
    assert!(waiting.give(&mut input, &mut device));
    assert_eq!(device.samples(), 63);
    readings.put(Some(8000));
    assert!(waiting.give(&mut input, &mut device));
    assert!(!waiting.give(&mut input, &mut device));
    assert_eq!(device.samples(), 101);
}
