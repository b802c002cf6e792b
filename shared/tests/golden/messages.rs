//! Messages between host and device.

use crate::{compare, hex};
use std::fmt::Write as _;
use yawrig_shared::blob;
use yawrig_shared::derivatives::{Model, Wind};
use yawrig_shared::linearity::Head;
use yawrig_shared::network::NetworkError;
use yawrig_shared::wire::{self, *};

fn head() -> Head {
    Head {
        first_counts: 28_672,
        spacing_bits: 4,
        unit_bits: 1,
        knots: 512,
        learned_from: 8,
        damping_u: 0.0078125,
    }
}

/// One of each.
fn requests() -> Vec<(&'static str, Request)> {
    let model = Model { length_m: 0.625, frontal_area_m2: 0.03125 };
    let wind = Wind { density_kg_m3: 1.25, speed_m_s: 10.0 };
    vec![
        ("status", Request::Status),
        (
            "configure",
            Request::Configure(Settings { full_scale_counts: 65535, ..Settings::default() }),
        ),
        ("condition", Request::Condition(Condition { rig: 7, wind, model, inertia_kg_m2: 0.125 })),
        ("flash_begin", Request::FlashBegin { length: 2032 }),
        (
            "flash_chunk",
            Request::FlashChunk {
                offset: 256,
                bytes: heapless::Vec::from_slice(&[0, 1, 0, 255]).unwrap(),
            },
        ),
        ("flash_signature", Request::FlashSignature { signature: (0..64).collect() }),
        ("flash_permit", Request::FlashPermit { length: 2032, signature: (0..64).collect() }),
        ("flash_trial", Request::FlashTrial),
        ("flash_commit", Request::FlashCommit),
        ("lock", Request::Lock { key: [0x5a; 32] }),
        ("challenge", Request::Challenge),
        ("unlock", Request::Unlock { signature: (64..128).collect() }),
        ("event", Request::Event { number: 7 }),
        ("end_release", Request::EndRelease { after_samples: 70_000 }),
        ("stream", Request::Stream { samples: 10_000 }),
        (
            "set_linearity",
            Request::SetLinearity(LinearityPart {
                head: head(),
                at: 128,
                corrections: heapless::Vec::from_slice(&[0, 1, -1, 127, -128]).unwrap(),
            }),
        ),
        ("linearity", Request::Linearity { at: 128 }),
        ("log", Request::Log { from: 70_000 }),
    ]
}

#[test]
fn wire_bytes() {
    let mut text = String::new();
    let mut line = |name: &str, frame: &Encoded| {
        let _ = writeln!(text, "{name} {}", hex(frame));
    };
    line("hello", &wire::encode_raw(HELLO_KEY, 1, &[]).unwrap());
    let hello = HelloReply {
        protocol: 1,
        messages_key: 0x0403_0201,
        firmware: HelloReply::text("yawrig 0.1.0"),
        board: HelloReply::text("emulated"),
    };
    line("hello_reply", &wire::encode_raw(HELLO_KEY, 1, &hello.write()).unwrap());
    for (name, request) in &requests() {
        line(name, &wire::encode(0x1234, request).unwrap());
    }
    let refused = Reply::Refused(Refusal::Blob(blob::BlobError::Network(NetworkError::NotFinite)));
    line("done", &wire::encode(0x1234, &Reply::Done).unwrap());
    let challenge = Reply::Challenge { number: 2, nonce: 70_000 };
    line("challenge_reply", &wire::encode(0x1234, &challenge).unwrap());
    line("refused", &wire::encode(0x1234, &refused).unwrap());
    let measured = |value, u| Measured { value, u };
    let release = ReleaseResult {
        release: 3,
        release_sample: 900,
        finished_sample: 40_000,
        windows: 12,
        natural_frequency_rad_s: measured(12.5, 0.015625),
        damping_ratio: measured(0.0078125, 0.00048828125),
        numbers: [measured(0.125, 0.0078125), measured(-2.0, 0.5)].into_iter().collect(),
        derivatives: None,
        flags: Flags::default(),
    };
    line("release", &wire::encode(10, &Event::Release(release)).unwrap());
    let window = WindowResult {
        release: 3,
        window: 1,
        start_sample: 1000,
        end_sample: 2500,
        sent_sample: 2500,
        amplitude_deg: 7.5,
        midline_deg: -0.25,
        natural_frequency_rad_s: 12.5,
        damping_ratio: 0.0078125,
        numbers: [0.125].into_iter().collect(),
        flags: Flags::default(),
    };
    line("window", &wire::encode(9, &Event::Window(window)).unwrap());
    let samples = Samples {
        first_sample: 70_000,
        degrees_per_count: 0.005,
        zero_counts: 32_768,
        counts: heapless::Vec::from_slice(&[32_768, 32_767, 0, 65_535]).unwrap(),
    };
    line("samples", &wire::encode_raw(SAMPLES_KEY, 9, &samples.write()).unwrap());
    assert_eq!(Samples::read(&samples.write()), Some(samples));
    compare("wire.txt", &text);
}

/// Messages that have changed have another number, or the older side could not be recognised.
#[test]
fn changed_messages_have_another_revision() {
    let path = format!("{}/tests/golden/messages.txt", env!("CARGO_MANIFEST_DIR"));
    let before = std::fs::read_to_string(&path).unwrap_or_default();
    let now = format!("{REVISION} {MESSAGES_KEY:08x}\n");
    let same = |of: &str| of.split(' ').next().map(str::to_owned);
    // One revision may change until it is given to others: then this file is in their hands.
    if std::env::var_os("YAWRIG_BLESS").is_some() {
        std::fs::write(&path, &now).unwrap();
    } else {
        assert!(
            now == before || same(&now) != same(&before),
            "raise wire::REVISION: {now}{before}"
        );
        assert_eq!(now, before, "{path} differs");
    }
}

/// A reply or an event that differs is another set of messages, too.
#[test]
fn the_key_is_of_all_messages() {
    #[derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)]
    struct Other(u8);
    impl Message for Other {
        const NAME: &'static str = Event::NAME;
    }
    let keys = [Request::KEY, Reply::KEY, Event::KEY, SAMPLES_KEY];
    assert_eq!(joined(keys), MESSAGES_KEY);
    for changed in 0..keys.len() {
        let mut keys = keys;
        keys[changed] = Other::KEY;
        assert_ne!(joined(keys), MESSAGES_KEY);
    }
}

#[test]
fn every_frame_comes_back_and_the_longest_fits() {
    let chunk = heapless::Vec::from_slice(&[0xAB; CHUNK]).unwrap();
    let longest = Request::FlashChunk { offset: u32::MAX, bytes: chunk };
    let frame = wire::encode(65535, &longest).unwrap();
    let mut decoder = Decoder::new();
    let mut found = 0;
    for &byte in b"boot: garbage \xff\x01".iter().chain(&frame) {
        if let Some(Ok(frame)) = decoder.push(byte) {
            assert_eq!(frame.sequence, 65535);
            assert_eq!(frame.message::<Request>(), Some(Ok(longest.clone())));
            assert_eq!(frame.message::<Event>(), None, "another type's key");
            found += 1;
        }
    }
    assert_eq!(found, 1, "garbage before the first zero costs nothing");
}

fn full<const N: usize>() -> heapless::String<N> {
    heapless::String::try_from("x".repeat(N).as_str()).unwrap()
}

#[test]
fn the_longest_status_fits() {
    let model = Model { length_m: 0.625, frontal_area_m2: 0.03125 };
    let wind = Wind { density_kg_m3: 1.25, speed_m_s: 10.0 };
    let status = Status {
        network: NetworkStatus {
            id: u32::MAX,
            generation: u32::MAX,
            topology: heapless::Vec::from_slice(&[48; 5]).unwrap(),
            slot: Some(1),
            on_trial: true,
            effects: full(),
            numbers: full(),
        },
        slots: [SlotState::Valid { generation: u32::MAX, id: u32::MAX }; 2],
        lock: Some([0xFF; 32]),
        settings: Settings { clock_u_ppm: Some(30.0), ..Settings::default() },
        clock_u_ppm: 30.0,
        phase: Phase::Finished,
        samples: u32::MAX,
        lost_samples: u32::MAX,
        lost_events: u32::MAX,
        lost_bytes: u32::MAX,
        session: u32::MAX,
        refining: true,
        next_event: u16::MAX,
        condition: Some(Condition { rig: u32::MAX, wind, model, inertia_kg_m2: 0.125 }),
        reference: Some(u32::MAX),
        refined_reference: Some(u32::MAX),
        learnt: Learnt { releases: u16::MAX, kept: true, forgotten: Some(Forgotten::Contradicted) },
        linearity: Linearity {
            knots: 512,
            learned_from: u16::MAX,
            largest_counts: u16::MAX,
            absent: Some(Absent::Damaged),
        },
        start: Start {
            cause: Cause::Watchdog,
            crash: Some(Crash { file: full(), line: u32::MAX }),
        },
        restarts: u8::MAX,
        sensor: Sensor { kind: SensorKind::Absolute, rate_hz: u16::MAX, delay_us: u16::MAX },
    };
    wire::encode(u16::MAX, &Reply::Status(status)).expect("a frame");
}

#[test]
fn the_longest_part_of_a_table_fits() {
    let corrections = heapless::Vec::from_slice(&[-1; PART_KNOTS]).unwrap();
    let part = LinearityPart { head: head(), at: u16::MAX, corrections };
    wire::encode(u16::MAX, &Request::SetLinearity(part.clone())).expect("a frame");
    wire::encode(u16::MAX, &Reply::Linearity(part)).expect("a frame");
}

/// In a frame and in the room that the flash has for one.
#[test]
fn the_longest_entry_of_a_log_fits() {
    let most = Measured { value: -1.0, u: -1.0 };
    let derivatives = Some(Derivatives {
        cn_beta: most,
        cn_r: most,
        reduced_frequency: -1.0,
        reference_release: u32::MAX,
    });
    let release = ReleaseResult {
        release: u32::MAX,
        release_sample: u32::MAX,
        finished_sample: u32::MAX,
        windows: u16::MAX,
        natural_frequency_rad_s: most,
        damping_ratio: most,
        numbers: [most; 2].into_iter().collect(),
        derivatives,
        flags: Flags(u32::MAX),
    };
    let refined = Refined {
        release: u32::MAX,
        from_sample: u32::MAX,
        samples: u32::MAX,
        natural_frequency_rad_s: Precise { value: -1.0, u: -1.0 },
        damping_ratio: most,
        derivatives,
        flags: Flags(u32::MAX),
        ..Refined::default()
    };
    let crash = Some(Crash { file: full(), line: u32::MAX });
    for what in [
        Logged::Start(Start { cause: Cause::Software, crash }),
        Logged::Release(release),
        Logged::Refined(refined),
    ] {
        let max = u32::MAX;
        let (run, at_sample, lost_samples, network) = (max, max, max, max);
        let entry = LogEntry { number: max, run, at_sample, lost_samples, network, what };
        let mut room = [0; LOG_ENTRY];
        postcard::to_slice(&entry, &mut room).expect("room for it");
        wire::encode(u16::MAX, &Reply::Log(Some(entry))).expect("a frame");
    }
}

#[test]
fn any_single_wrong_bit_is_noticed() {
    let frame = wire::encode(7, &Request::EndRelease { after_samples: 99 }).unwrap();
    for position in 1..frame.len() - 1 {
        for bit in 0..8 {
            let mut damaged = frame.clone();
            damaged[position] ^= 1 << bit;
            let mut decoder = Decoder::new();
            let read =
                damaged.iter().filter_map(|&b| decoder.push(b).map(|f| f.is_ok())).any(|ok| ok);
            assert!(!read, "byte {position} bit {bit}");
        }
    }
}
