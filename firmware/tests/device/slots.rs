//! The network store: what runs after each kind of update, begun, broken or whole.

use crate::chip::Chip;
use crate::desk::Desk;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use yawrig_firmware::slots::{MemoryFlash, Sector, Slot, Store};
use yawrig_firmware::wear::AT_ONCE;
use yawrig_firmware::BUILT_IN;
use yawrig_shared::blob::{self, BlobError};
use yawrig_shared::network::Network;
use yawrig_shared::wire::{Refusal, Reply, Request, SlotState, SAMPLES_BETWEEN_ERASES};

fn blob(generation: u32) -> Vec<u8> {
    let mut bytes = BUILT_IN.to_vec();
    blob::set_generation(&mut bytes, generation).unwrap();
    bytes
}

fn update<F: NorFlash>(
    store: &mut Store<F>,
    bytes: &[u8],
    running: Option<Slot>,
    newest: u32,
) -> Result<Slot, Refusal> {
    store.begin(bytes.len() as u32, running)?;
    for (index, chunk) in bytes.chunks(256).enumerate() {
        store.chunk(256 * index as u32, chunk)?;
    }
    let (slot, ..) = store.verify(newest, &mut Network::empty(), None, None)?;
    store.commit()?;
    Ok(slot)
}

fn newest<F: NorFlash>(store: &mut Store<F>) -> Option<(Slot, u32)> {
    store.newest(&mut Network::empty()).map(|(slot, envelope, _)| (slot, envelope.generation))
}

#[test]
fn the_network_compiled_in_is_sound() {
    let (envelope, payload) = blob::decode(BUILT_IN).unwrap();
    assert_eq!(envelope.blob_length(), BUILT_IN.len());
    assert_eq!(payload.network.topology, [41, 6, 2]);
}

#[test]
fn updates_go_to_the_slot_that_does_not_run() {
    let mut store = Store::new(MemoryFlash::new());
    assert_eq!(newest(&mut store), None);
    assert_eq!(store.state(Slot::First), SlotState::Empty);
    assert_eq!(update(&mut store, &blob(1), None, 0), Ok(Slot::First));
    assert_eq!(update(&mut store, &blob(2), Some(Slot::First), 1), Ok(Slot::Second));
    assert_eq!(update(&mut store, &blob(3), Some(Slot::Second), 2), Ok(Slot::First));
    assert_eq!(newest(&mut store), Some((Slot::First, 3)));
    assert!(matches!(store.state(Slot::Second), SlotState::Valid { generation: 2, .. }));
}

#[test]
fn an_update_that_stops_anywhere_leaves_the_old_network() {
    let new = blob(2);
    for stop in 0..=new.len().div_ceil(256) {
        let mut store = Store::new(MemoryFlash::new());
        update(&mut store, &blob(1), None, 0).unwrap();
        store.begin(new.len() as u32, Some(Slot::First)).unwrap();
        for (index, chunk) in new.chunks(256).enumerate().take(stop) {
            store.chunk(256 * index as u32, chunk).unwrap();
        }
        // The power goes; what the flash holds is all there is.
        let mut store = Store::new(store.into_flash());
        assert_eq!(newest(&mut store), Some((Slot::First, 1)), "after {stop} chunks");
        if stop > 0 {
            assert_eq!(store.state(Slot::Second), SlotState::Invalid);
        }
    }
}

#[test]
fn a_broken_or_stale_blob_is_refused() {
    let mut store = Store::new(MemoryFlash::new());
    update(&mut store, &blob(5), None, 0).unwrap();
    let mut broken = blob(6);
    broken[100] ^= 1;
    let refused = update(&mut store, &broken, Some(Slot::First), 5);
    assert_eq!(refused, Err(Refusal::Blob(BlobError::PayloadCorrupt)));
    let stale = update(&mut store, &blob(5), Some(Slot::First), 5);
    assert_eq!(stale, Err(Refusal::Stale { newest: 5 }));
    let too_long = store.begin(blob::LONGEST as u32 + 1, Some(Slot::First));
    assert_eq!(too_long, Err(Refusal::Blob(BlobError::TooLong)));
    assert_eq!(newest(&mut store), Some((Slot::First, 5)));
}

#[test]
fn chunks_out_of_order_are_refused_and_the_right_one_is_named() {
    let mut store = Store::new(MemoryFlash::new());
    assert_eq!(store.chunk(0, &[0; 4]), Err(Refusal::FlashOrder { expected_offset: 0 }));
    store.begin(1000, None).unwrap();
    store.chunk(0, &[0; 256]).unwrap();
    let again = store.chunk(0, &[0; 256]);
    assert_eq!(again, Err(Refusal::FlashOrder { expected_offset: 256 }));
    let short = store.verify(0, &mut Network::empty(), None, None).map(|_| ());
    assert_eq!(short, Err(Refusal::FlashOrder { expected_offset: 256 }));
    let odd = store.chunk(256, &[0; 3]);
    assert_eq!(odd, Err(Refusal::FlashOrder { expected_offset: 256 }));
}

/// Flash with a bit that will not stay set.
struct Worn(MemoryFlash);

impl ErrorType for Worn {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Worn {
    const READ_SIZE: usize = <MemoryFlash>::READ_SIZE;
    fn read(&mut self, offset: u32, room: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        self.0.read(offset, room)
    }
    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl NorFlash for Worn {
    const WRITE_SIZE: usize = <MemoryFlash>::WRITE_SIZE;
    const ERASE_SIZE: usize = <MemoryFlash>::ERASE_SIZE;
    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        self.0.erase(from, to)
    }
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        let mut bytes = bytes.to_vec();
        if offset == 512 {
            bytes[1] &= 0b1011_1111;
        }
        self.0.write(offset, &bytes)
    }
}

#[test]
fn flash_that_does_not_take_a_bit_is_noticed() {
    let mut store = Store::new(Worn(MemoryFlash::new()));
    store.begin(1024, None).unwrap();
    let written: Result<(), Refusal> =
        (0..4_u32).try_for_each(|i| store.chunk(256 * i, &[0xFF; 256]));
    assert_eq!(written, Err(Refusal::FlashWrite));
}

#[test]
fn the_older_network_runs_where_the_newer_one_is_damaged() {
    let mut store = Store::new(Chip::<4, 4096>::erased());
    update(&mut store, &blob(1), None, 0).unwrap();
    update(&mut store, &blob(2), Some(Slot::First), 1).unwrap();
    let mut flash = store.into_flash();
    flash.damage(Sector::Second.start::<Chip<4, 4096>>() + 600);
    let mut store = Store::new(flash);
    assert_eq!(store.state(Slot::Second), SlotState::Invalid);
    assert_eq!(newest(&mut store), Some((Slot::First, 1)));
}

/// There is one after the last: updates never end.
#[test]
fn generations_go_round() {
    let mut store = Store::new(MemoryFlash::new());
    let mut running = None;
    let mut last = 0;
    for generation in [0x7fff_ffff, 0xffff_fffe, u32::MAX, 0, 1] {
        let slot = update(&mut store, &blob(generation), running, last);
        running = Some(slot.expect("a newer one"));
        last = generation;
        assert_eq!(newest(&mut store), Some((running.expect("just written"), generation)));
    }
    let older = update(&mut store, &blob(u32::MAX), running, last);
    assert_eq!(older, Err(Refusal::Stale { newest: 1 }));
}

/// As a slot is that was written by a machine with another arithmetic, or another firmware.
#[test]
fn a_slot_whose_golden_vectors_fail_is_not_called_valid() {
    let (_, sound) = blob::decode(BUILT_IN).expect("a blob");
    let mut weights = sound.clone();
    weights.network.weights[0] += 0.5;
    let mut features = sound;
    features.from_counts.as_mut().expect("bits").0[1] ^= 1;
    for (payload, vector) in [(weights, 0), (features, 4)] {
        let mut bytes = vec![0; blob::LONGEST];
        let length = blob::encode(&payload, 7, &mut bytes).expect("a blob");
        let differs = BlobError::GoldenDiffers { vector };
        let mut store = Store::new(MemoryFlash::new());
        let refused = update(&mut store, &bytes[..length], None, 0);
        assert_eq!(refused, Err(Refusal::Blob(differs)));
        let mut flash = MemoryFlash::new();
        let mut put = |at: usize, bytes: &[u8]| {
            for (index, four) in bytes.chunks(4).enumerate() {
                let mut word = [0xff; 4];
                word[..four.len()].copy_from_slice(four);
                flash.write((at + 4 * index) as u32, &word).expect("written");
            }
        };
        put(8, &bytes[..length]);
        put(4, &(length as u32).to_le_bytes());
        put(0, b"LIVE");
        let mut store = Store::new(flash);
        assert_eq!(newest(&mut store), None);
        assert_eq!(store.state(Slot::First), SlotState::Invalid);
    }
}

/// A program that writes networks in a loop: a hundred at once, then one each ten minutes; what is erased
/// already is not erased again.
#[test]
fn erases_without_end_are_refused() {
    let mut desk = Desk::new(MemoryFlash::new());
    let begin = Request::FlashBegin { length: 1000 };
    let erase = |desk: &mut Desk| {
        let reply = desk.ask(&begin);
        if reply == Reply::Done {
            let bytes = [0; 8].into_iter().collect();
            assert_eq!(desk.ask(&Request::FlashChunk { offset: 0, bytes }), Reply::Done);
        }
        reply
    };
    for number in 0..AT_ONCE {
        assert_eq!(erase(&mut desk), Reply::Done, "{number}");
    }
    let wait = |samples| Reply::Refused(Refusal::TooOften { samples });
    assert_eq!(erase(&mut desk), wait(SAMPLES_BETWEEN_ERASES));
    desk.device.lost(SAMPLES_BETWEEN_ERASES - 5);
    assert_eq!(erase(&mut desk), wait(5));
    desk.device.lost(5);
    assert_eq!(erase(&mut desk), Reply::Done);
    assert_eq!(erase(&mut desk), wait(SAMPLES_BETWEEN_ERASES));
    // However long nothing is written, a hundred is all that comes together.
    desk.device.lost(1000 * SAMPLES_BETWEEN_ERASES);
    let taken = (0..).take_while(|_| erase(&mut desk) == Reply::Done).count();
    assert_eq!(taken, AT_ONCE as usize);
    // What was erased and not written to since is taken as it is.
    let mut fresh = Desk::new(MemoryFlash::new());
    for _ in 0..2 * AT_ONCE {
        assert_eq!(fresh.ask(&Request::FlashBegin { length: 1000 }), Reply::Done);
    }
}
