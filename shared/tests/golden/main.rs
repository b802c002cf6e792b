//! Bytes that must not change without a change of version: a device in the field and a program
//! on the host may be of different ages.
//!
//! The expected bytes beside this file are written anew, after a deliberate change, by
//! `YAWRIG_BLESS=1 cargo test -p yawrig-shared --test golden`; look at the difference before you
//! commit it.

use std::fmt::Write as _;
use yawrig_shared::blob::{self, Payload, Provenance};
use yawrig_shared::derivatives::{Model, Wind};
use yawrig_shared::features::{AmplitudeScaling, FeatureKind, InputScaling};
use yawrig_shared::network::{
    weight_count, Activation, Estimate, Network, NetworkError, Number, OutputScaling, TrainedRange,
};
use yawrig_shared::wire::{self, *};

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

fn compare(name: &str, actual: &str) {
    let path = format!("{}/tests/golden/{name}", env!("CARGO_MANIFEST_DIR"));
    if std::env::var_os("YAWRIG_BLESS").is_some() {
        std::fs::write(&path, actual).unwrap();
    }
    let expected = std::fs::read_to_string(&path).unwrap_or_default();
    assert_eq!(actual, expected, "{path} differs");
}

/// A network of exact binary fractions.
fn network() -> Network {
    let topology = heapless::Vec::from_slice(&[42, 3, 2]).unwrap();
    let count = weight_count(&topology);
    Network {
        topology,
        linear_layers: 0,
        activation: Activation::Tanh,
        features: FeatureKind::BinMeans,
        inputs: InputScaling {
            shape_gain: 0.5,
            reciprocal_offset_hz: 0.75,
            reciprocal_gain_s: 1.5,
            amplitude: Some(AmplitudeScaling { log_offset: 1.25, log_gain: 0.875 }),
        },
        outputs: [
            OutputScaling { offset: 15.0, gain: 12.5 },
            OutputScaling { offset: 0.0625, gain: 0.03125 },
        ],
        range: TrainedRange {
            natural_frequency_rad_s: [2.5, 26.5],
            damping_ratio: [0.0078125, 0.09375],
        },
        test_rms: [0.0078125, 0.001953125],
        bias_rms: [0.00390625, 0.0009765625],
        numbers: heapless::Vec::new(),
        number_names: heapless::String::new(),
        weights: (0..count).map(|i| (i % 17) as f32 / 64.0 - 0.125).collect(),
    }
}

fn payload() -> Payload {
    let network = network();
    let vector =
        |k: usize| -> [f32; 42] { core::array::from_fn(|i| ((i * k) % 9) as f32 / 16.0 - 0.25) };
    let golden = [1, 2].iter().map(|&k| blob::golden(&network, &vector(k))).collect();
    let provenance = Provenance {
        trainer: heapless::String::try_from("0.1.0").unwrap(),
        seed: 7,
        samples: 250,
        epochs: 1000,
        noise: [0.0, 0.03125],
        effects: heapless::String::try_from("coulomb_friction static_offset").unwrap(),
    };
    let from_counts = Some(blob::from_counts(&network));
    Payload { network, provenance, golden, from_counts }
}

fn encoded(payload: &Payload, generation: u32) -> Vec<u8> {
    let mut bytes = vec![0; blob::LONGEST];
    let length = blob::encode(payload, generation, &mut bytes).unwrap();
    bytes.truncate(length);
    bytes
}

#[test]
fn blob_bytes() {
    let bytes = encoded(&payload(), 5);
    compare("blob.hex", &format!("{}\n", hex(&bytes)));
    let (envelope, back) = blob::decode(&bytes).unwrap();
    assert_eq!((envelope.generation, back), (5, payload()));
}

/// A network that says a number of an effect, too.
fn payload_with_number() -> Payload {
    let mut payload = payload();
    let number = Number {
        scaling: OutputScaling { offset: 0.25, gain: 0.125 },
        test_rms: 0.0078125,
        bias_rms: 0.00390625,
        amplitude_power: 2,
    };
    let Payload { network, golden, from_counts, .. } = &mut payload;
    network.numbers.push(number).unwrap();
    network.topology[2] = 3;
    let count = weight_count(&network.topology);
    network.weights = (0..count).map(|i| (i % 17) as f32 / 64.0 - 0.125).collect();
    network.number_names = heapless::String::try_from("0.c rad/s2").unwrap();
    for golden in golden {
        let inputs: Vec<f32> = golden.inputs.iter().map(|bits| f32::from_bits(*bits)).collect();
        *golden = blob::golden(network, &inputs);
    }
    *from_counts = Some(blob::from_counts(network));
    payload
}

#[test]
fn blob_bytes_with_a_number_of_an_effect() {
    let bytes = encoded(&payload_with_number(), 5);
    compare("blob_with_number.hex", &format!("{}\n", hex(&bytes)));
    let (envelope, back) = blob::decode(&bytes).unwrap();
    assert_eq!((envelope.format, back), (blob::FORMAT_WITH_NUMBERS, payload_with_number()));
    let mut again = bytes;
    blob::set_generation(&mut again, 6).unwrap();
    assert_eq!(blob::decode(&again).unwrap().1, payload_with_number());
    let refused = |change: &dyn Fn(&mut Payload)| {
        let mut payload = payload_with_number();
        change(&mut payload);
        blob::decode(&encoded(&payload, 1)).unwrap_err()
    };
    use blob::BlobError::*;
    assert_eq!(refused(&|p| p.golden[1].outputs.0[2] ^= 1), GoldenDiffers { vector: 1 });
    assert_eq!(refused(&|p| p.network.topology[2] = 2), Network(NetworkError::Topology));
    assert_eq!(refused(&|p| p.network.numbers.clear()), Network(NetworkError::Topology));
    let not_finite = Network(NetworkError::NotFinite);
    assert_eq!(refused(&|p| p.network.numbers[0].amplitude_power = 9), not_finite);
    assert_eq!(refused(&|p| p.network.numbers[0].bias_rms = f32::NAN), not_finite);
    assert_eq!(payload_with_number().network.numbers[0].range(), [0.125, 0.375]);
    assert_eq!(refused(&|p| p.network.numbers[0].scaling.gain = 0.0), not_finite);
}

#[test]
fn an_estimate_is_within_what_was_trained_on_with_its_numbers() {
    let network = payload_with_number().network;
    let estimate = |c: f32| Estimate {
        natural_frequency_rad_s: 12.0,
        damping_ratio: 0.03,
        numbers: [c].into_iter().collect(),
    };
    assert!(network.holds(&estimate(0.2)));
    assert!(!network.holds(&estimate(0.4)) && !network.holds(&estimate(0.1)));
    assert!(!network.holds(&Estimate { damping_ratio: 0.1, ..estimate(0.2) }));
}

/// As they were before networks were held against counts.
#[test]
fn a_blob_that_ends_before_the_counts_is_read() {
    let none = Payload { from_counts: None, ..payload() };
    let mut bytes = encoded(&none, 5);
    // Its last byte says that there are none.
    let payload_length = bytes.len() - blob::ENVELOPE - 1;
    bytes.pop();
    bytes[8..12].copy_from_slice(&(payload_length as u32).to_le_bytes());
    let crc = yawrig_shared::checksum::crc32(&bytes[blob::ENVELOPE..]);
    bytes[16..20].copy_from_slice(&crc.to_le_bytes());
    let crc = yawrig_shared::checksum::crc32(&bytes[..20]);
    bytes[20..24].copy_from_slice(&crc.to_le_bytes());
    assert_eq!(blob::decode(&bytes).unwrap().1, none);
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
    let model = Model { length_m: 0.625, frontal_area_m2: 0.03125 };
    let wind = Wind { density_kg_m3: 1.25, speed_m_s: 10.0 };
    let requests = [
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
    ];
    for (name, request) in &requests {
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
        start: Start {
            cause: Cause::Watchdog,
            crash: Some(Crash { file: full(), line: u32::MAX }),
        },
        sensor: Sensor { kind: SensorKind::Absolute, rate_hz: u16::MAX, delay_us: u16::MAX },
    };
    wire::encode(u16::MAX, &Reply::Status(status)).expect("a frame");
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

#[test]
fn any_single_wrong_byte_of_a_blob_is_noticed() {
    let bytes = encoded(&payload(), 1);
    for position in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[position] ^= 0x10;
        assert!(blob::decode(&damaged).is_err(), "byte {position}");
    }
    for length in 0..bytes.len() {
        assert!(blob::decode(&bytes[..length]).is_err(), "cut to {length}");
    }
}

#[test]
fn wrong_networks_are_refused_for_what_is_wrong() {
    let refused = |change: &dyn Fn(&mut Payload)| {
        let mut payload = payload();
        change(&mut payload);
        blob::decode(&encoded(&payload, 1)).unwrap_err()
    };
    use blob::BlobError::*;
    assert_eq!(refused(&|p| p.network.weights[5] = f32::NAN), Network(NetworkError::NotFinite));
    assert_eq!(refused(&|p| p.network.topology[1] = 4), Network(NetworkError::WeightCount));
    assert_eq!(refused(&|p| p.network.topology[0] = 40), Network(NetworkError::Topology));
    assert_eq!(refused(&|p| p.network.inputs.amplitude = None), Network(NetworkError::Topology));
    assert_eq!(refused(&|p| p.network.linear_layers = 2), Network(NetworkError::Topology));
    let endless = |p: &mut Payload| {
        p.network.inputs.amplitude = Some(AmplitudeScaling { log_offset: 1.0, log_gain: 0.0 });
    };
    assert_eq!(refused(&endless), Network(NetworkError::NotFinite));
    let short = |p: &mut Payload| p.golden[0].inputs.truncate(41);
    assert_eq!(refused(&short), GoldenMissing);
    assert_eq!(refused(&|p| p.network.outputs[1].gain = 0.0), Network(NetworkError::NotFinite));
    assert_eq!(refused(&|p| p.golden.truncate(1)), GoldenMissing);
    assert_eq!(refused(&|p| p.golden[1].outputs.0[0] ^= 1), GoldenDiffers { vector: 1 });
    // Right from its inputs on, and not from the counts on: features or logarithm of another kind.
    let features = |p: &mut Payload| p.from_counts.as_mut().unwrap().0[1] ^= 1;
    assert_eq!(refused(&features), GoldenDiffers { vector: 2 });
    for theirs in [1, 4] {
        let mut other = encoded(&payload(), 1);
        other[4] = theirs;
        let crc = yawrig_shared::checksum::crc32(&other[..20]);
        other[20..24].copy_from_slice(&crc.to_le_bytes());
        assert_eq!(blob::decode(&other).unwrap_err(), Format { theirs: theirs.into() });
    }
}
