//! From trained weights to a frozen network, and how good it is on windows it has not seen.

use super::augmented::Asked;
use super::draws::{Draw, Ranges};
use super::errors::{Errors, NumberErrors};
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_shared::blob::{self, Payload, Provenance};
use yawrig_shared::features::{AmplitudeScaling, FeatureKind, InputScaling, SHAPE};
use yawrig_shared::network::{Activation, Network, Number, OutputScaling, TrainedRange};
use yawrig_shared::numbers::Numbers;

/// How features become inputs and outputs become physical, fixed before training.
#[derive(Clone, Debug, PartialEq)]
pub struct Scaling {
    pub inputs: InputScaling,
    pub outputs: [OutputScaling; 2],
    /// Of the numbers of effects that the network is to say.
    pub numbers: Vec<OutputScaling>,
}

impl Scaling {
    /// Brings the draws' features and the ranges' targets to -1 to 1; with the `amplitude` as one
    /// more input, or without.
    pub fn new<'a>(
        draws: &[Draw],
        ranges: &Ranges,
        asked: impl Iterator<Item = &'a Asked>,
        amplitude: bool,
    ) -> Self {
        let largest = draws
            .iter()
            .flat_map(|draw| &draw.features.values[..SHAPE])
            .fold(f32::MIN_POSITIVE, |largest, x| largest.max(x.abs()));
        let extent = |of: fn(&Draw) -> f32| {
            let values = draws.iter().map(of);
            values.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
        };
        let (low, high) = extent(|draw| draw.features.values[SHAPE]);
        let (least_deg, most_deg) = extent(|draw| draw.features.amplitude_deg);
        let output = |[low, high]: [f64; 2]| OutputScaling {
            offset: (0.5 * (low + high)) as f32,
            gain: (0.5 * (high - low)) as f32,
        };
        Self {
            inputs: InputScaling {
                shape_gain: 1.0 / largest,
                reciprocal_offset_hz: 0.5 * (low + high),
                reciprocal_gain_s: 2.0 / (high - low).max(f32::MIN_POSITIVE),
                amplitude: amplitude.then(|| AmplitudeScaling::between(least_deg, most_deg)),
            },
            outputs: [output(ranges.natural_frequency_rad_s), output(ranges.damping_ratio)],
            numbers: asked.map(|asked| output(asked.range)).collect(),
        }
    }

    /// Row-major inputs (n x 41, or n x 42 with the amplitude) as the trainer takes them.
    pub fn inputs(&self, draws: &[Draw]) -> Vec<f64> {
        draws.iter().flat_map(|draw| self.inputs.apply(&draw.features)).map(f64::from).collect()
    }

    /// Row-major targets (n x 2, and one more for each number) as the trainer takes them.
    pub fn targets(&self, draws: &[Draw]) -> Vec<f64> {
        let scaled = |x: f64, s: &OutputScaling| (x - f64::from(s.offset)) / f64::from(s.gain);
        draws
            .iter()
            .flat_map(|draw| {
                let numbers = draw.numbers.iter().zip(&self.numbers);
                let modal = [
                    scaled(draw.natural_frequency_rad_s, &self.outputs[0]),
                    scaled(draw.damping_ratio, &self.outputs[1]),
                ];
                modal.into_iter().chain(numbers.map(|(x, s)| scaled(*x, s)))
            })
            .collect()
    }
}

/// A network frozen from trained weights. The first `linear_layers` after the inputs are linear.
///
/// # Errors
/// Where the device could not run it: too wide, too many weights, not finite.
pub fn network(
    topology: &[usize],
    linear_layers: usize,
    weights: &[f64],
    kind: FeatureKind,
    scaling: &Scaling,
    ranges: &Ranges,
) -> Result<Network> {
    let too_large = || {
        Error::usage(format!("the device cannot hold a {} network", name(topology)))
            .help("choose at most 1024 weights, 48 nodes in a layer and 5 layers")
    };
    let mut layers = heapless::Vec::new();
    for &width in topology {
        let width = u8::try_from(width).map_err(|_| too_large())?;
        layers.push(width).map_err(|_| too_large())?;
    }
    let mut frozen = heapless::Vec::new();
    for &weight in weights {
        frozen.push(weight as f32).map_err(|_| too_large())?;
    }
    let f32s = |range: [f64; 2]| range.map(|x| x as f32);
    let network = Network {
        topology: layers,
        // As many as there are layers at most, which are few.
        linear_layers: linear_layers as u8,
        activation: Activation::Tanh,
        features: kind,
        inputs: scaling.inputs,
        outputs: scaling.outputs,
        range: TrainedRange {
            natural_frequency_rad_s: f32s(ranges.natural_frequency_rad_s),
            damping_ratio: f32s(ranges.damping_ratio),
        },
        test_rms: [0.0; 2],
        bias_rms: [0.0; 2],
        numbers: scaling
            .numbers
            .iter()
            .map(|scaling| Number {
                scaling: *scaling,
                test_rms: 0.0,
                bias_rms: 0.0,
                amplitude_power: 0,
            })
            .collect(),
        number_names: heapless::String::new(),
        weights: frozen,
    };
    match network.check() {
        Ok(()) => Ok(network),
        Err(yawrig_shared::network::NetworkError::NotFinite) => {
            Err(Error::internal("training ended with weights that are not finite numbers")
                .help(format!("train again with another {}", settings::name("seed"))))
        }
        Err(_) => Err(too_large()),
    }
}

/// `41-6-2`.
pub fn name(topology: &[usize]) -> String {
    topology.iter().map(usize::to_string).collect::<Vec<_>>().join("-")
}

/// The blob of a network: generation 0 until a device is written to.
pub fn blob(network: Network, provenance: Provenance, golden_from: &[Draw]) -> Result<Vec<u8>> {
    let golden = golden_from
        .iter()
        .take(*blob::GOLDEN.end())
        .map(|draw| blob::golden(&network, &network.inputs.apply(&draw.features)))
        .collect();
    let mut bytes = vec![0; blob::LONGEST];
    let from_counts = Some(blob::from_counts(&network));
    let payload = Payload { network, provenance, golden, from_counts };
    let length = blob::encode(&payload, 0, &mut bytes)
        .map_err(|e| Error::internal(format!("the network does not fit a blob: {e:?}")))?;
    bytes.truncate(length);
    Ok(bytes)
}

/// Runs the frozen network, in the device's own arithmetic, over draws.
pub fn errors(network: &Network, draws: &[Draw]) -> Errors {
    let pair = |draw: &Draw| {
        let found = network.estimate_inputs(&network.inputs.apply(&draw.features));
        let found = [found.natural_frequency_rad_s, found.damping_ratio].map(f64::from);
        (found, [draw.natural_frequency_rad_s, draw.damping_ratio])
    };
    Errors::new(&draws.iter().map(pair).collect::<Vec<_>>())
}

/// The same for the numbers of effects, one after the other.
pub fn number_errors(network: &Network, draws: &[Draw]) -> Vec<NumberErrors> {
    let found: Vec<_> = draws
        .iter()
        .map(|draw| network.estimate_inputs(&network.inputs.apply(&draw.features)).numbers)
        .collect();
    let of = |number: usize| {
        let error = |(draw, found): (&Draw, &Numbers<f32>)| {
            let off = f64::from(found[number]) - draw.numbers[number];
            (f64::from(draw.features.amplitude_deg), off)
        };
        NumberErrors::new(&draws.iter().zip(&found).map(error).collect::<Vec<_>>())
    };
    (0..network.numbers.len()).map(of).collect()
}
