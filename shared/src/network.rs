//! A small multilayer perceptron as it is kept: its shape, weights and scalings, and what it was trained on.

use crate::features::{FeatureKind, Features, InputScaling};
pub use crate::forward::{forward, tanh, MAX_OUTPUTS, OUTPUTS, WIDEST};
use crate::numbers::{Numbers, MAX_NUMBERS};
use crate::source::Bytes;
use heapless::{String, Vec};
use postcard::Deserializer;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Most layers, inputs and outputs included.
pub const MAX_LAYERS: usize = 5;
/// Most weights and biases: 41-20-2 has 882.
pub const MAX_WEIGHTS: usize = 1024;
/// Largest [`Number::amplitude_power`].
pub const MAX_POWER: u8 = 8;

/// What the hidden nodes do. Outputs are linear.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Activation {
    Tanh,
}

/// `physical = offset + gain * output`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct OutputScaling {
    pub offset: f32,
    pub gain: f32,
}

/// The stretch of natural frequency and damping ratio a network was trained on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct TrainedRange {
    pub natural_frequency_rad_s: [f32; 2],
    pub damping_ratio: [f32; 2],
}

/// A line for each number of an effect: the effect's place among the identifiers in its provenance, from 0, a
/// dot, the number's name, a space and its unit.
pub type NumberNames = String<40>;

/// One output more: a number of an effect, as its coefficient.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Number {
    /// What it was drawn from for the training becomes -1 to 1.
    pub scaling: OutputScaling,
    /// As [`Network::test_rms`] and [`Network::bias_rms`].
    pub test_rms: f32,
    pub bias_rms: f32,
    /// A window counts with this power of its amplitude in a release's mean.
    pub amplitude_power: u8,
}

/// Natural frequency and damping ratio of one window, and the numbers of effects that the network says.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Estimate {
    pub natural_frequency_rad_s: f32,
    pub damping_ratio: f32,
    pub numbers: Numbers<f32>,
}

/// A frozen network with everything that belongs to it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Network {
    /// Nodes in each layer, inputs first: 41, 6, 2; or 42, 6, 2 with the amplitude.
    pub topology: Vec<u8, MAX_LAYERS>,
    /// Layers after the inputs whose nodes are linear: 1 for a projection on principal
    /// components, else none. Their weights stand with the others.
    pub linear_layers: u8,
    pub activation: Activation,
    pub features: FeatureKind,
    pub inputs: InputScaling,
    /// Natural frequency in rad/s, then damping ratio.
    pub outputs: [OutputScaling; OUTPUTS],
    pub range: TrainedRange,
    /// Rms error of one window on the test set at the noise trained for, rad/s and 1.
    pub test_rms: [f32; OUTPUTS],
    /// Rms error on test windows without noise: what averaging over windows does not take away.
    pub bias_rms: [f32; OUTPUTS],
    /// What it says beside; mostly nothing. A blob has them before the rest.
    #[serde(skip)]
    pub numbers: Vec<Number, MAX_NUMBERS>,
    #[serde(skip)]
    pub number_names: NumberNames,
    /// Layer by layer a row of biases, then a row for each input, each as long as the layer is
    /// wide: the weights a node's neighbours use at once stand side by side.
    pub weights: Vec<f32, MAX_WEIGHTS>,
}

/// What is wrong with a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum NetworkError {
    /// Not as many inputs as are made of a window, not as many outputs as are said, a layer too wide or
    /// empty, too many layers, or none that bends.
    Topology,
    /// The number of weights is not what the topology needs.
    WeightCount,
    /// A weight or scale is not a finite number, or a scale is zero, or a power out of its range.
    NotFinite,
}

/// Weights and biases a topology needs.
pub fn weight_count(topology: &[u8]) -> usize {
    topology.windows(2).map(|pair| (pair[0] as usize + 1) * pair[1] as usize).sum()
}

impl Network {
    /// One that passes no check, to read another into.
    pub const fn empty() -> Self {
        const NONE: OutputScaling = OutputScaling { offset: 0.0, gain: 0.0 };
        Self {
            topology: Vec::new(),
            linear_layers: 0,
            activation: Activation::Tanh,
            features: FeatureKind::BinMeans,
            inputs: InputScaling {
                shape_gain: 0.0,
                reciprocal_offset_hz: 0.0,
                reciprocal_gain_s: 0.0,
                amplitude: None,
            },
            outputs: [NONE; OUTPUTS],
            range: TrainedRange { natural_frequency_rad_s: [0.0; 2], damping_ratio: [0.0; 2] },
            test_rms: [0.0; OUTPUTS],
            bias_rms: [0.0; OUTPUTS],
            numbers: Vec::new(),
            number_names: NumberNames::new(),
            weights: Vec::new(),
        }
    }

    /// Reads what its `Serialize` has written, in place, and leaves the numbers as they are: derived code
    /// would hold the weights on the stack, several times.
    pub(crate) fn read<'a>(
        &mut self,
        from: &mut Deserializer<'a, Bytes<'a>>,
    ) -> Result<(), postcard::Error> {
        (self.topology, self.linear_layers, self.activation, self.features, self.inputs) =
            Deserialize::deserialize(&mut *from)?;
        (self.outputs, self.range, self.test_rms, self.bias_rms) =
            Deserialize::deserialize(&mut *from)?;
        self.weights.clear();
        for _ in 0..u32::deserialize(&mut *from)? {
            let weight = f32::deserialize(&mut *from)?;
            self.weights.push(weight).map_err(|_| postcard::Error::SerdeDeCustom)?;
        }
        Ok(())
    }

    /// Whether this is a network that [`Network::estimate`] can run.
    pub fn check(&self) -> Result<(), NetworkError> {
        let ends = (self.topology.first(), self.topology.last());
        if self.topology.len() < 2
            || ends != (Some(&(self.inputs.count() as u8)), Some(&(self.outputs() as u8)))
            || usize::from(self.linear_layers) + 2 > self.topology.len()
            || self.topology.iter().any(|&width| width == 0 || width as usize > WIDEST)
        {
            return Err(NetworkError::Topology);
        }
        if weight_count(&self.topology) != self.weights.len() {
            return Err(NetworkError::WeightCount);
        }
        let amplitude = self.inputs.amplitude;
        let gains = [
            self.inputs.shape_gain,
            self.inputs.reciprocal_gain_s,
            amplitude.map_or(1.0, |a| a.log_gain),
            self.outputs[0].gain,
            self.outputs[1].gain,
        ];
        let offsets = [
            self.inputs.reciprocal_offset_hz,
            amplitude.map_or(0.0, |a| a.log_offset),
            self.outputs[0].offset,
            self.outputs[1].offset,
        ];
        let ranges = [
            self.range.natural_frequency_rad_s,
            self.range.damping_ratio,
            self.test_rms,
            self.bias_rms,
        ];
        let finite = self.weights.iter().chain(&offsets).chain(ranges.iter().flatten());
        if !finite.clone().all(|x| x.is_finite())
            || !gains.iter().all(|x| x.is_normal())
            || !self.numbers.iter().all(Number::is_sound)
        {
            return Err(NetworkError::NotFinite);
        }
        Ok(())
    }

    /// How many outputs it has.
    pub fn outputs(&self) -> usize {
        OUTPUTS + self.numbers.len()
    }

    /// Whether an estimate lies within what it was trained on.
    pub fn holds(&self, estimate: &Estimate) -> bool {
        let within = |[low, high]: [f32; 2], x: f32| x >= low && x <= high;
        within(self.range.natural_frequency_rad_s, estimate.natural_frequency_rad_s)
            && within(self.range.damping_ratio, estimate.damping_ratio)
            && self.numbers.iter().zip(estimate.numbers.iter()).all(|(n, x)| within(n.range(), *x))
    }

    /// Natural frequency and damping ratio of a window. The network has been checked.
    pub fn estimate(&self, features: &Features) -> Estimate {
        self.estimate_inputs(&self.inputs.apply(features))
    }

    /// The same from inputs scaled already, as golden vectors hold them; as many as the topology has.
    pub fn estimate_inputs(&self, inputs: &[f32]) -> Estimate {
        let [frequency, damping, others @ ..] =
            forward(&self.topology, self.linear_layers, &self.weights, inputs);
        let [f, d] = &self.outputs;
        let numbers = self.numbers.iter().zip(others);
        Estimate {
            natural_frequency_rad_s: f.offset + f.gain * frequency,
            damping_ratio: d.offset + d.gain * damping,
            numbers: numbers.map(|(n, x)| n.scaling.offset + n.scaling.gain * x).collect(),
        }
    }
}

impl Number {
    /// What it was drawn from for the training.
    pub fn range(&self) -> [f32; 2] {
        let OutputScaling { offset, gain } = self.scaling;
        [offset - gain.abs(), offset + gain.abs()]
    }

    fn is_sound(&self) -> bool {
        let Self { scaling, test_rms, bias_rms, amplitude_power } = self;
        let finite = [scaling.offset, *test_rms, *bias_rms];
        finite.iter().all(|x| x.is_finite())
            && scaling.gain.is_normal()
            && *amplitude_power <= MAX_POWER
    }
}
