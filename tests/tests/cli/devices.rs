//! What may be at the other end of a line: nothing, anything, another firmware, a bad cable.

use yawrig_shared::wire::{self, HelloReply, Status, HELLO_KEY};
use yawrig_tests::line::{Board, Line, Way};
use yawrig_tests::networks;
use yawrig_tests::process::{yawrig, Ended};

fn device(line: &Line) -> Ended {
    yawrig("device --json --device").and(line.path()).run()
}

fn flash(line: &Line, blob: &[u8]) -> Ended {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("n.yrn");
    std::fs::write(&file, blob).expect("room for it");
    yawrig("flash --json --device").and(line.path()).and(&file).run()
}

#[test]
fn silence_is_a_timeout() {
    let line = Line::new(|_| Some(Vec::new()));
    let path = line.path().display().to_string();
    let says = format!("the device on {path} does not answer");
    device(&line).exits(7).says(&says).helps();
    flash(&line, &networks::sound()).exits(7).says(&says).helps();
    yawrig("monitor --device").and(&path).run().exits(7).says(&says).helps();
}

#[test]
fn garbage_is_no_device_of_ours() {
    // A GPS receiver, say, with and without zeros in what it sends.
    for text in [&b"$GPGGA,123519,4807.038,N,01131.000,E\r\n"[..], &[0, 7, 0, 0, 255, 3, 0, 1]] {
        let mut calls = 0_u32;
        let line = Line::new(move |asked| {
            calls += 1;
            let sends = calls.is_multiple_of(20) || !asked.is_empty();
            Some(if sends { text.to_vec() } else { Vec::new() })
        });
        device(&line)
            .exits(4)
            .says("is not a yawrig device")
            .says("no frame that yawrig knows")
            .helps();
    }
}

#[test]
fn a_line_that_sends_back_what_it_gets_is_no_device() {
    let line = Line::new(|bytes| Some(bytes.to_vec()));
    device(&line).exits(4).says("sends back what it is sent").helps();
}

#[test]
fn garbage_before_the_first_frame_is_passed_over() {
    let garbages = [
        b"boot: 115200 8N1\r\n".to_vec(),
        // A frame that was on its way when the program came.
        vec![9, 1, 2, 3, 0],
        // Longer than any frame, without a zero.
        vec![0x55; 3000],
        // A whole frame but for a bit.
        {
            let mut frame = wire::encode_raw(HELLO_KEY, 1, &[7; 54]).expect("a frame").to_vec();
            frame[20] ^= 1;
            frame
        },
    ];
    for garbage in garbages {
        let board = Board::default();
        let mut garbage = Some(garbage);
        let line = board.plug_with(move |way, bytes| {
            // As the program's first bytes come, so that its opening of the port drops none of it.
            if way == Way::ToProgram
                && !bytes.is_empty()
                && let Some(garbage) = garbage.take()
            {
                bytes.splice(0..0, garbage);
            }
            true
        });
        let object = device(&line).exits(0).json();
        assert_eq!(
            object["firmware"],
            format!("yawrig {} on on the bench", env!("CARGO_PKG_VERSION"))
        );
    }
}

/// A device that answers hello, and nothing else, with this.
fn says_hello(hello: HelloReply, version: u8) -> Line {
    let mut decoder = wire::Decoder::new();
    Line::new(move |bytes| {
        let mut said = Vec::new();
        for &byte in bytes {
            if let Some(Ok(frame)) = decoder.push(byte)
                && frame.key == HELLO_KEY
            {
                let reply = wire::encode_raw(HELLO_KEY, frame.sequence, &hello.write());
                said.extend(of_version(&reply.expect("a frame"), version));
            }
        }
        Some(said)
    })
}

/// The frame as a program of another version of the protocol would send it.
fn of_version(frame: &[u8], version: u8) -> Vec<u8> {
    let mut content = frame[1..frame.len() - 1].to_vec();
    let length = cobs::decode_in_place(&mut content).expect("a frame of ours");
    content.truncate(length - 4);
    content[0] = version;
    let crc = yawrig_shared::checksum::crc32(&content);
    content.extend(crc.to_le_bytes());
    let mut coded = [0; 128];
    let length = cobs::try_encode(&content, &mut coded).expect("a short frame");
    [&[0], &coded[..length], &[0]].concat()
}

#[test]
fn another_protocol_is_named_beside_ours() {
    let ours = HelloReply {
        protocol: wire::REVISION,
        messages_key: wire::MESSAGES_KEY,
        firmware: HelloReply::text("yawrig 9.9"),
        board: HelloReply::text("tomorrow's"),
    };
    let (key, program) =
        (format!("{:08x}", wire::MESSAGES_KEY), format!("this program {}", wire::REVISION));

    let line = says_hello(HelloReply { protocol: 99, ..ours }, wire::VERSION);
    let ended = device(&line).exits(4).helps();
    ended.says("yawrig 9.9").says("protocol 99").says(&program).says("this program is the older");

    let line = says_hello(HelloReply { protocol: 0, ..ours }, wire::VERSION);
    device(&line).exits(4).says("protocol 0").says("the device is the older one").helps();

    // The same numbers, other messages, replies and events among them: a firmware from between two releases.
    let line = says_hello(HelloReply { messages_key: 0xABCD_0123, ..ours }, wire::VERSION);
    device(&line).exits(4).says("abcd0123").says(&key).says("of the same number").helps();

    // Hello is understood whatever the version of the frame around it.
    let line = says_hello(HelloReply { protocol: 7, ..ours }, 7);
    device(&line).exits(4).says("protocol 7").says(&program).helps();

    // Nothing is written to such a device.
    flash(&line, &networks::sound()).exits(4).says("protocol 7").helps();
}

/// The network that runs and what the slots hold.
fn networks_of(status: &Status) -> String {
    format!("{:?} {:?}", status.network, status.slots)
}

#[test]
fn unplugged_in_mid_flash_the_device_keeps_its_network() {
    let old = networks::another();
    // In the first chunk, between two, in the last, with the commit on its way.
    let new = networks::sound();
    let whole = new.len() + new.len() / 8;
    for bytes in [150, 700, 1000, whole / 2, whole - 300] {
        let board = Board::default();
        flash(&board.plug(), &old).exits(0);
        let before = board.status();
        assert_eq!(before.network.generation, 1);

        let mut left = bytes;
        let line = board.plug_with(move |way, bytes| {
            if way == Way::ToProgram {
                return true;
            }
            let whole = bytes.len() <= left;
            bytes.truncate(left);
            left -= bytes.len();
            whole
        });
        let path = line.path().display().to_string();
        let ended = flash(&line, &new).exits(5).helps();
        ended.says(&path).says("is gone").says("keeps its old network");
        drop(line);

        let after = board.status();
        assert_eq!(after.network, before.network, "unplugged after {bytes} bytes");
        assert_eq!(after.slots[0], before.slots[0]);
        board.restart();
        assert_eq!(board.status().network, before.network, "unplugged after {bytes} bytes");

        // Plugged in again, it takes the network.
        flash(&board.plug(), &new).exits(0);
        let again = device(&board.plug()).exits(0).json();
        assert_eq!(again["network"]["id"], networks::id(&new));
    }
}

/// Its answer is lost with the plug, and it may not be said that the old network runs.
#[test]
fn unplugged_once_it_runs_the_new_network_both_are_named() {
    for (committed, says) in
        [(false, "on trial and in 10 s the old one"), (true, "it runs the new")]
    {
        let board = Board::default();
        flash(&board.plug(), &networks::another()).exits(0);
        let asked = board.clone();
        let line = board.plug_with(move |way, bytes| {
            let network = asked.status().network;
            let is_there = network.generation == 2 && network.on_trial != committed;
            way == Way::ToDevice || bytes.is_empty() || !is_there
        });
        let ended = flash(&line, &networks::sound()).exits(5).helps();
        let ended = ended.says("is gone").says(says).says("in 10 s the old one again");
        assert!(!ended.stderr.contains("keeps its old"), "{}", ended.report());
        let network = board.status().network;
        assert_eq!((network.generation, network.on_trial), (2, !committed));
    }
}

/// The answer to the commit does not come, however often it is asked for; what the device runs can be asked.
#[test]
fn a_device_that_can_be_asked_again_is_asked_what_it_runs() {
    let board = Board::default();
    flash(&board.plug(), &networks::another()).exits(0);
    let asked = board.clone();
    let mut commits = None;
    let mut decoder = wire::Decoder::new();
    let line = board.plug_with(move |way, bytes| {
        if way == Way::ToDevice {
            for &byte in bytes.iter() {
                let Some(Ok(frame)) = decoder.push(byte) else { continue };
                let commit = matches!(frame.message(), Some(Ok(wire::Request::FlashCommit)));
                commits = commit.then_some(frame.sequence);
            }
        } else if commits.is_some() && !asked.status().network.on_trial {
            bytes.clear();
        }
        true
    });
    // Not under the name of a pseudo-terminal, behind which a program may be busy: for those it waits longer.
    let folder = tempfile::tempdir().expect("a folder");
    let (port, file) = (folder.path().join("ttyBOARD"), folder.path().join("n.yrn"));
    std::os::unix::fs::symlink(line.path(), &port).expect("a link");
    std::fs::write(&file, networks::sound()).expect("room for it");
    let written = yawrig("flash --json --device").and(&port).and(&file).run().exits(0).json();
    assert_eq!(written["network"]["generation"], 2);
}

#[test]
fn unplugged_before_its_first_network_it_keeps_the_compiled_in_one() {
    let board = Board::default();
    let before = networks_of(&board.status());
    let mut seen = 0;
    let line = board.plug_with(move |_, bytes| {
        seen += bytes.len();
        seen < 900
    });
    flash(&line, &networks::another()).exits(5).helps();
    drop(line);
    board.restart();
    let after = board.status();
    assert_eq!(after.network.slot, None);
    assert!(before.contains(&format!("{:?}", after.network)), "{before}");
}

/// Turns a bit over in every so many bytes that go one way.
fn noisy(board: &Board, noisy: Way, every: usize) -> Line {
    let mut seen = 0;
    board.plug_with(move |way, bytes| {
        if way == noisy {
            for byte in bytes {
                seen += 1;
                if seen % every == 0 {
                    *byte ^= 0x10;
                }
            }
        }
        true
    })
}

#[test]
fn bytes_turned_over_on_the_way_are_sent_again() {
    // Requests are some 280 bytes long and replies some 20: more than one in ten is hit.
    for (way, every) in [(Way::ToDevice, 1100), (Way::ToProgram, 190)] {
        let board = Board::default();
        let line = noisy(&board, way, every);
        let written = flash(&line, &networks::another()).exits(0).json();
        assert_eq!(written["network"]["generation"], 1);
        drop(line);
        board.restart();
        let status = board.status();
        assert_eq!(format!("{:08x}", status.network.id), networks::id(&networks::another()));
    }
}

#[test]
fn a_line_too_bad_to_write_over_leaves_the_old_network() {
    let board = Board::default();
    flash(&board.plug(), &networks::another()).exits(0);
    let before = networks_of(&board.status());
    // Short frames pass, no chunk ever does.
    let line = noisy(&board, Way::ToDevice, 150);
    let ended = flash(&line, &networks::sound());
    // Already the first questions may have met a turned bit too often.
    assert!([5, 7].contains(&ended.code), "{}", ended.report());
    let ended = ended.helps();
    assert!(
        ended.code != 5 || ended.stderr.contains("keeps its old network"),
        "{}",
        ended.report()
    );
    drop(line);
    assert_eq!(networks_of(&board.status()).split(" [").next(), before.split(" [").next());
    board.restart();
    let after = board.status();
    assert_eq!(format!("{:08x}", after.network.id), networks::id(&networks::another()));
}

#[test]
fn a_device_that_falls_silent_in_mid_flash_is_no_success() {
    let board = Board::default();
    let mut sent = 0;
    let line = board.plug_with(move |way, bytes| {
        if way == Way::ToDevice {
            sent += bytes.len();
            if sent > 900 {
                bytes.clear();
            }
        }
        true
    });
    let ended = flash(&line, &networks::another()).exits(5).helps();
    ended.says("does not answer any more").says("keeps its old network");
    drop(line);
    board.restart();
    assert_eq!(board.status().network.slot, None);
}
