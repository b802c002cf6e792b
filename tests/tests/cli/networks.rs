//! Network files that must not be written, and devices that do not take them either.

use crate::shells::{device, standing_still};
use yawrig_link::client::{Client, LinkError};
use yawrig_shared::wire::{Refusal, Request, CHUNK};
use yawrig_tests::networks::{another, id, sound, spoilt};
use yawrig_tests::process::yawrig;

#[test]
fn a_spoilt_file_is_refused_by_name_before_a_device_is_opened() {
    let folder = tempfile::tempdir().expect("a folder");
    for spoilt in spoilt() {
        let file = folder.path().join("spoilt.yrn");
        std::fs::write(&file, &spoilt.bytes).expect("room for it");
        // There is no such port: what is said of the file is said first.
        let ended = yawrig("flash --device /dev/none").and(&file).run().exits(5).helps();
        assert!(ended.stderr.contains(spoilt.said), "{}: {}", spoilt.what, ended.report());
        ended.says("spoilt.yrn is not a network to write");
    }
}

#[test]
fn a_file_with_something_after_the_network_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("long.yrn");
    std::fs::write(&file, [sound(), vec![0; 5]].concat()).expect("room for it");
    yawrig("flash").and(&file).run().exits(5).says("long.yrn").says("5 bytes follow").helps();
}

#[test]
fn a_file_that_cannot_be_read_is_unusable_data() {
    let folder = tempfile::tempdir().expect("a folder");
    let missing = folder.path().join("missing.yrn");
    yawrig("flash").and(&missing).run().exits(3).says("cannot read").says("missing.yrn").helps();
    yawrig("flash").and(folder.path()).run().exits(3).says("cannot read").helps();
}

/// Writes a blob chunk by chunk as it is, without the host's checks; the device's refusal.
fn write(client: &mut Client, blob: &[u8]) -> Option<Refusal> {
    let mut tell = |request: Request| match client.request(&request) {
        Ok(_) => None,
        Err(LinkError::Refused(refusal)) => Some(refusal),
        Err(other) => panic!("the link fails: {other:?}"),
    };
    if let Some(refusal) = tell(Request::FlashBegin { length: blob.len() as u32 }) {
        return Some(refusal);
    }
    for (index, chunk) in blob.chunks(CHUNK).enumerate() {
        let bytes = chunk.iter().copied().collect();
        let refusal = tell(Request::FlashChunk { offset: (index * CHUNK) as u32, bytes });
        if refusal.is_some() {
            return refusal;
        }
    }
    tell(Request::FlashTrial)
}

#[test]
fn a_device_refuses_what_the_host_would_have_held_back() {
    let bench = standing_still();
    let path = bench.shared_path().to_owned();
    // A device with a network of its own in slot 0, whose other slot is idle.
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("first.yrn");
    std::fs::write(&file, another()).expect("room for it");
    yawrig("flash --device").and(&path).and(&file).run().exits(0);
    {
        let mut client = Client::open(&path).expect("the device");
        for spoilt in spoilt() {
            let refusal = write(&mut client, &spoilt.bytes);
            assert!(matches!(refusal, Some(Refusal::Blob(_))), "{}: {refusal:?}", spoilt.what);
            let status = client.status().expect("its state");
            assert_eq!(status.network.generation, 1, "{}", spoilt.what);
            assert_eq!(format!("{:08x}", status.network.id), id(&another()), "{}", spoilt.what);
        }
        // Sound, but not newer than what runs: generation 0.
        assert_eq!(write(&mut client, &sound()), Some(Refusal::Stale { newest: 1 }));
        // Chunks out of order, beyond the announced end, and without a beginning.
        let chunk = |offset| Request::FlashChunk { offset, bytes: [7; 8].into_iter().collect() };
        let refused = |client: &mut Client, request: &Request| match client.request(request) {
            Err(LinkError::Refused(refusal)) => refusal,
            other => panic!("not refused: {other:?}"),
        };
        let order = |expected_offset| Refusal::FlashOrder { expected_offset };
        assert_eq!(refused(&mut client, &Request::FlashTrial), order(0));
        assert_eq!(refused(&mut client, &Request::FlashCommit), Refusal::NoTrial);
        assert_eq!(refused(&mut client, &chunk(0)), order(0));
        client.request(&Request::FlashBegin { length: 24 }).expect("a beginning");
        assert_eq!(refused(&mut client, &chunk(8)), order(0));
        client.request(&chunk(0)).expect("in order");
        assert_eq!(refused(&mut client, &Request::FlashTrial), order(8));
        client.request(&chunk(8)).expect("in order");
        client.request(&chunk(16)).expect("in order");
        assert_eq!(refused(&mut client, &chunk(24)), order(24));
        let long = Request::FlashBegin { length: 1 << 20 };
        assert!(matches!(refused(&mut client, &long), Refusal::Blob(_)));
    }
    let object = device(&path);
    assert_eq!(object["network"]["id"], id(&another()));
    assert_eq!(object["slots"][0]["state"], "valid");
    assert_ne!(object["slots"][1]["state"], "valid");

    // And it still takes a sound one.
    std::fs::write(&file, sound()).expect("room for it");
    yawrig("flash --device").and(&path).and(&file).run().exits(0);
    assert_eq!(device(&path)["network"]["id"], id(&sound()));
}
