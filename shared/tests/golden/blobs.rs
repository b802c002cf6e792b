//! Networks as they are kept in flash.

use crate::{compare, hex};
use yawrig_shared::blob::{self, Payload, Provenance};
use yawrig_shared::features::{AmplitudeScaling, FeatureKind, InputScaling};
use yawrig_shared::network::{
    weight_count, Activation, Estimate, Network, NetworkError, Number, OutputScaling, TrainedRange,
};

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
