//! A table for converter and sensor: written, kept, used, and not used where it is not to be trusted.

use crate::chip::{Chip, Watched};
use crate::desk::{Desk, Swing};
use ed25519_compact::{KeyPair, Seed};
use embedded_storage::nor_flash::NorFlash;
use yawrig_firmware::sensor::Sensor as _;
use yawrig_firmware::sensors::as5600::{As5600, Filter};
use yawrig_firmware::slots::Sector;
use yawrig_shared::linearity::{Head, KNOTS};
use yawrig_shared::wire::{
    Absent, Flags, Linearity, LinearityPart, Refusal, Reply, Request, PART_KNOTS,
};

/// A table whose corrections look like records of the lock wherever they can.
fn table(seed: i32) -> (Head, Vec<i8>) {
    let head = Head {
        first_counts: 32_768 - 4096,
        spacing_bits: 4,
        unit_bits: 0,
        knots: KNOTS as u16,
        learned_from: seed as u16,
        damping_u: 1e-4,
    };
    let corrections =
        (0..KNOTS).map(|knot| b"LOCKOPEN"[(knot + seed as usize) % 8] as i8).collect();
    (head, corrections)
}

fn parts(head: Head, corrections: &[i8]) -> Vec<LinearityPart> {
    let at = |index: usize| (index * PART_KNOTS) as u16;
    let part = |(index, some): (usize, &[i8])| LinearityPart {
        head,
        at: at(index),
        corrections: some.iter().copied().collect(),
    };
    corrections.chunks(PART_KNOTS).enumerate().map(part).collect()
}

fn write<F: NorFlash>(desk: &mut Desk<F>, seed: i32) -> Reply {
    let (head, corrections) = table(seed);
    let mut last = Reply::Done;
    for part in parts(head, &corrections) {
        last = desk.ask(&Request::SetLinearity(part));
    }
    last
}

/// The whole table that a device says it has.
fn held<F: NorFlash>(desk: &mut Desk<F>) -> Option<(Head, Vec<i8>)> {
    let known = desk.status().linearity;
    let mut corrections = Vec::new();
    let head = loop {
        let asked = desk.ask(&Request::Linearity { at: corrections.len() as u16 });
        let Reply::Linearity(part) = asked else { panic!("{asked:?}") };
        assert_eq!(usize::from(part.at), corrections.len());
        if part.corrections.is_empty() {
            break part.head;
        }
        corrections.extend(part.corrections);
    };
    let Linearity { knots, learned_from, .. } = known;
    assert_eq!((head.knots, head.learned_from), (knots, learned_from));
    (!corrections.is_empty()).then_some((head, corrections))
}

fn erase() -> Request {
    Request::SetLinearity(LinearityPart {
        head: Head::default(),
        at: 0,
        corrections: heapless::Vec::new(),
    })
}

fn chip() -> Chip<4, { 16 * 1024 }> {
    Chip::erased()
}

#[test]
fn it_is_used_kept_over_a_restart_and_erased() {
    let mut desk = Desk::new(chip());
    assert_eq!(desk.status().linearity, Linearity::default());
    assert_eq!(write(&mut desk, 8), Reply::Done);
    for _ in 0..2 {
        assert_eq!(held(&mut desk), Some(table(8)));
        assert_eq!(desk.status().linearity.largest_counts, 80);
        // What it makes of a reading is what the host is shown; an end of the converter stays one.
        assert_eq!(desk.ask(&Request::Stream { samples: 3 }), Reply::Done);
        desk.play([32_768, 0, 65_520]);
        let (_, corrections) = table(8);
        let expected = 32_768 + u16::from(corrections[256].unsigned_abs());
        assert_eq!(desk.streamed(), [expected, 0, 65_520]);
        desk = desk.power_cut();
    }
    assert_eq!(desk.ask(&erase()), Reply::Done);
    assert_eq!(desk.status().linearity, Linearity::default());
    assert_eq!(held(&mut desk.power_cut()), None);
}

#[test]
fn it_is_not_used_with_another_sensor_and_that_is_said() {
    let mut desk = Desk::new(chip());
    write(&mut desk, 8);
    desk.device.set_sensor(&As5600::new(1000, Filter::default()).about());
    let absent = Linearity { absent: Some(Absent::Sensor), ..Linearity::default() };
    assert_eq!(desk.status().linearity, absent);
    assert_eq!(held(&mut desk), None);
    // Nor on another board that has this flash.
    let mut desk = desk.power_cut();
    assert_eq!(held(&mut desk), Some(table(8)));
    let flash = desk.device.into_flash();
    let mut other = Desk::on("another", flash);
    assert_eq!(other.status().linearity, absent);
}

#[test]
fn what_is_no_table_is_refused_and_the_one_before_stays() {
    let refused = Reply::Refused(Refusal::Linearity);
    let mut desk = Desk::new(chip());
    write(&mut desk, 8);
    let (head, corrections) = table(9);
    let all = parts(head, &corrections);
    let with = |change: &dyn Fn(&mut LinearityPart)| {
        let mut part = all[1].clone();
        change(&mut part);
        part
    };
    for wrong in [
        all[2].clone(),
        with(&|part| part.head.learned_from += 1),
        with(&|part| part.corrections.clear()),
        with(&|part| part.at = 500),
    ] {
        assert_eq!(desk.ask(&Request::SetLinearity(all[0].clone())), Reply::Done);
        let absent = Linearity { absent: Some(Absent::Unfinished), ..Linearity::default() };
        assert_eq!(desk.status().linearity, absent, "half of one is none");
        assert_eq!(desk.ask(&Request::SetLinearity(wrong)), refused);
        assert_eq!(held(&mut desk), Some(table(8)));
    }
    // One that falls.
    let mut falls = corrections.clone();
    falls[300] = 100;
    falls[301] = 0;
    let replies: Vec<_> = parts(head, &falls)
        .into_iter()
        .map(|part| desk.ask(&Request::SetLinearity(part)))
        .collect();
    assert_eq!(replies[3], refused);
    assert_eq!(held(&mut desk), Some(table(8)));
}

#[test]
fn no_release_is_of_two_tables_and_a_locked_device_takes_none() {
    let mut desk = Desk::new(chip());
    desk.play(Swing::new(9.0, 0.02).counts(1).into_iter().take(4000));
    assert_eq!(write(&mut desk, 8), Reply::Refused(Refusal::Releasing));
    assert_eq!(desk.ask(&erase()), Reply::Refused(Refusal::Releasing));
    desk.end();
    assert_eq!(write(&mut desk, 8), Reply::Done);
    let pair = KeyPair::from_seed(Seed::new([3; 32]));
    assert_eq!(desk.ask(&Request::Lock { key: *pair.pk }), Reply::Done);
    assert_eq!(write(&mut desk, 9), Reply::Refused(Refusal::Unsigned));
    assert_eq!(desk.ask(&erase()), Reply::Refused(Refusal::Unsigned));
    let mut desk = desk.power_cut();
    assert_eq!(held(&mut desk), Some(table(8)));
    assert_eq!(desk.status().lock, Some(*pair.pk));
}

/// The uncertainty of a refined damping ratio holds the table's, and nothing else changes.
#[test]
fn its_uncertainty_is_in_that_of_damping_ratios() {
    let refined = |damping_u: Option<f32>| {
        let mut desk = Desk::new(chip());
        if let Some(damping_u) = damping_u {
            let head = Head { damping_u, ..table(8).0 };
            for part in parts(head, &[0; KNOTS]) {
                assert_eq!(desk.ask(&Request::SetLinearity(part)), Reply::Done);
            }
        }
        desk.play(Swing::new(9.0, 0.02).counts(1));
        desk.end();
        desk.refined[0]
    };
    let (without, with) = (refined(None), refined(Some(0.01)));
    let (zeta, more) = (without.damping_ratio, with.damping_ratio);
    assert_eq!(more.value, zeta.value);
    let expected = zeta.u.hypot(0.01 * zeta.value);
    assert!((more.u / expected - 1.0).abs() < 1e-5, "{more:?} {expected}");
    assert_eq!(with.natural_frequency_rad_s, without.natural_frequency_rad_s);
    assert!(!with.flags.has(Flags::MISFIT));
}

/// Every bit of its record, alone.
fn no_bit_is_half_applied<const WRITE: usize, const ERASE: usize>() {
    let mut desk = Desk::new(Chip::<WRITE, ERASE>::erased());
    write(&mut desk, 7);
    write(&mut desk, 8);
    let whole = desk.device.into_flash();
    let start = Sector::Lock.start::<Chip<WRITE, ERASE>>();
    let pitch = 48_usize.next_multiple_of(WRITE);
    let long = 14_usize.min(768 / pitch) * pitch;
    let (mut damaged, mut the_same) = (0, 0);
    for byte in 0..long {
        for bit in [byte % 8, (byte + 3) % 8] {
            let mut chip = whole.clone();
            chip.flip(start + long + byte, bit as u8);
            let mut desk = Desk::new(chip);
            let status = desk.status();
            assert_eq!(status.lock, None, "byte {byte}");
            match held(&mut desk) {
                None => {
                    damaged += 1;
                    assert_eq!(status.linearity.absent, Some(Absent::Damaged), "byte {byte}");
                }
                // A byte that says nothing.
                found => {
                    the_same += 1;
                    assert_eq!(found, Some(table(8)), "byte {byte}");
                }
            }
            // It takes another.
            assert_eq!(write(&mut desk, 9), Reply::Done);
            assert_eq!(held(&mut desk.power_cut()), Some(table(9)));
        }
    }
    println!(
        "write size {WRITE}: {damaged} bits leave no table, and it is said; {the_same} say nothing"
    );
    // Head, what it says and the checksum, in full.
    assert_eq!(damaged, 2 * (8 + 528 + 4));
}

#[test]
fn no_bit_is_half_applied_with_flash_as_the_nucleo_has_it() {
    no_bit_is_half_applied::<4, { 16 * 1024 }>();
}

#[test]
fn no_bit_is_half_applied_with_flash_as_the_pico_has_it() {
    no_bit_is_half_applied::<256, 4096>();
}

/// Cuts at every operation of writing a table over another, and of erasing it: one or the other holds whole,
/// or none does, and that is said. Its neighbours in the flash are not concerned.
fn no_cut_leaves_half_a_table<const WRITE: usize, const ERASE: usize>() {
    let mut chip = Chip::<WRITE, ERASE>::erased();
    let (mut cuts, mut none) = (0, 0);
    // More than the sector holds: the other one is begun on the way.
    for seed in 1..40 {
        let before = held(&mut Desk::new(chip.clone()));
        let mut torn = Vec::new();
        let mut seen = |chip: &Chip<WRITE, ERASE>, _| torn.push(chip.clone());
        let mut desk = Desk::new(Watched { chip: chip.clone(), seen: &mut seen });
        let erased = seed % 7 == 0;
        let reply = if erased { desk.ask(&erase()) } else { write(&mut desk, seed) };
        assert_eq!(reply, Reply::Done);
        chip = desk.device.into_flash().chip;
        let after = (!erased).then(|| table(seed));
        assert_eq!(held(&mut Desk::new(chip.clone())), after);
        cuts += torn.len();
        let some = if WRITE > 4 { 1 } else { 11 };
        for torn in torn.into_iter().step_by(some) {
            let mut desk = Desk::new(torn);
            let status = desk.status();
            assert_eq!(status.lock, None);
            let found = held(&mut desk);
            if found != before && found != after {
                none += 1;
                assert_eq!((found, status.linearity.absent), (None, Some(Absent::Damaged)));
            }
            assert_eq!(write(&mut desk, 50), Reply::Done);
            assert_eq!(held(&mut desk), Some(table(50)));
        }
    }
    println!("write size {WRITE}: {cuts} cuts, {none} of those looked at leave no table");
}

#[test]
fn no_cut_leaves_half_a_table_with_flash_as_the_nucleo_has_it() {
    no_cut_leaves_half_a_table::<4, { 16 * 1024 }>();
}

#[test]
fn no_cut_leaves_half_a_table_with_flash_as_the_pico_has_it() {
    no_cut_leaves_half_a_table::<256, 4096>();
}

/// A lock that is renewed fills sector after sector: the table comes along.
#[test]
fn it_outlives_what_is_written_beside_it() {
    let mut desk = Desk::new(Chip::<256, 4096>::erased());
    write(&mut desk, 8);
    let pair = KeyPair::from_seed(Seed::new([3; 32]));
    assert_eq!(desk.ask(&Request::Lock { key: *pair.pk }), Reply::Done);
    for _ in 0..200 {
        desk = desk.power_cut();
        let asked = desk.ask(&Request::Challenge);
        assert!(matches!(asked, Reply::Challenge { .. }), "{asked:?}");
    }
    assert_eq!(held(&mut desk), Some(table(8)));
}
