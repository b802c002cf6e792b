//! Forward pass of a small multilayer perceptron, the same bits on host and device.

use crate::features::{FeatureKind, Features, InputScaling, FEATURES, MOST_INPUTS};
use crate::numbers::{Numbers, MOST_NUMBERS};
use crate::source::Bytes;
use heapless::{String, Vec};
use postcard::Deserializer;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Widest layer, the inputs' included.
pub const WIDEST: usize = 48;
/// Most layers, inputs and outputs included.
pub const MOST_LAYERS: usize = 5;
/// Most weights and biases: 41-20-2 has 882.
pub const MOST_WEIGHTS: usize = 1024;
/// Natural frequency and damping ratio, which every network says first.
pub const OUTPUTS: usize = 2;
/// Most outputs: those two, then numbers of effects.
pub const MOST_OUTPUTS: usize = OUTPUTS + MOST_NUMBERS;
/// Largest [`Number::amplitude_power`].
pub const MOST_POWER: u8 = 8;
/// Columns of a layer that are summed side by side, each in a register of its own.
const COLUMNS: usize = 6;
/// Rows of a layer between two looks at whether there are more.
const ROWS: usize = 8;

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
    pub topology: Vec<u8, MOST_LAYERS>,
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
    pub numbers: Vec<Number, MOST_NUMBERS>,
    #[serde(skip)]
    pub number_names: NumberNames,
    /// Layer by layer a row of biases, then a row for each input, each as long as the layer is
    /// wide: the weights a node's neighbours use at once stand side by side.
    pub weights: Vec<f32, MOST_WEIGHTS>,
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
            && *amplitude_power <= MOST_POWER
    }
}

/// Scaled outputs for scaled inputs; zero beyond those that there are. The network they are of has passed
/// [`Network::check`], and the inputs are as many as its topology has.
pub fn forward(
    topology: &[u8],
    linear_layers: u8,
    weights: &[f32],
    inputs: &[f32],
) -> [f32; MOST_OUTPUTS] {
    // With all lengths known to the compiler the same sums take 40 % fewer instructions.
    if let ([_, 6, 2], 0) = (topology, linear_layers) {
        if let Ok(inputs) = <&[f32; FEATURES]>::try_from(inputs) {
            return one_hidden_layer::<FEATURES, 6>(weights, inputs);
        }
        if let Ok(inputs) = <&[f32; MOST_INPUTS]>::try_from(inputs) {
            return one_hidden_layer::<MOST_INPUTS, 6>(weights, inputs);
        }
    }
    any_layers(topology, linear_layers, weights, inputs)
}

/// `M` inputs, `N` hidden nodes, two outputs.
#[inline(never)]
fn one_hidden_layer<const M: usize, const N: usize>(
    weights: &[f32],
    inputs: &[f32; M],
) -> [f32; MOST_OUTPUTS] {
    // One look at the length, here: one before the second layer makes all after it conditional.
    let count = (M + 1) * N + (N + 1) * OUTPUTS;
    let (first, second) = weights[..count].split_at((M + 1) * N);
    let mut hidden = net_inputs::<N, M>(first, inputs);
    for value in &mut hidden {
        *value = tanh(*value);
    }
    let [frequency, damping] = net_inputs::<OUTPUTS, N>(second, &hidden);
    [frequency, damping, 0.0, 0.0]
}

/// Net inputs of a layer of `N` nodes, in `N` accumulators.
#[inline(always)]
fn net_inputs<const N: usize, const M: usize>(weights: &[f32], inputs: &[f32; M]) -> [f32; N] {
    let (biases, rows) = weights[..(M + 1) * N].split_at(N);
    let mut totals = [0.0_f32; N];
    totals.copy_from_slice(biases);
    // Eight rows at a time, written out by the compiler: a loop over single ones spends a third of
    // its instructions on itself.
    let (rows, last_rows) = rows.split_at(M / ROWS * ROWS * N);
    let (inputs, last_inputs) = inputs.split_at(M / ROWS * ROWS);
    for (rows, inputs) in rows.chunks_exact(ROWS * N).zip(inputs.chunks_exact(ROWS)) {
        for i in 0..ROWS {
            add_row(&mut totals, &rows[i * N..(i + 1) * N], inputs[i]);
        }
    }
    for (row, &input) in last_rows.chunks_exact(N).zip(last_inputs) {
        add_row(&mut totals, row, input);
    }
    totals
}

#[inline(always)]
fn add_row<const N: usize>(totals: &mut [f32; N], row: &[f32], input: f32) {
    for j in 0..N {
        totals[j] += row[j] * input;
    }
}

// Apart: the registers it saves are many, and the usual network need not pay for them.
#[inline(never)]
fn any_layers(
    topology: &[u8],
    linear_layers: u8,
    weights: &[f32],
    inputs: &[f32],
) -> [f32; MOST_OUTPUTS] {
    let mut values = [0.0_f32; WIDEST];
    let mut next = [0.0_f32; WIDEST];
    let mut weights = weights;
    let mut given = inputs;
    let last = topology.len() - 1;
    for (layer, &width) in topology.iter().enumerate().skip(1) {
        let width = width as usize;
        let (own, rest) = weights.split_at((given.len() + 1) * width);
        weights = rest;
        let mut column = 0;
        while column < width {
            let output = &mut next[column..width];
            column += match width - column {
                1 => sums::<1>(own, width, column, given, output),
                2 => sums::<2>(own, width, column, given, output),
                3 => sums::<3>(own, width, column, given, output),
                4 => sums::<4>(own, width, column, given, output),
                5 => sums::<5>(own, width, column, given, output),
                _ => sums::<COLUMNS>(own, width, column, given, output),
            };
        }
        if layer != last && layer > usize::from(linear_layers) {
            for value in &mut next[..width] {
                *value = tanh(*value);
            }
        }
        values[..width].copy_from_slice(&next[..width]);
        given = &values[..width];
    }
    core::array::from_fn(|output| given.get(output).copied().unwrap_or_default())
}

/// Net inputs of `N` neighbouring nodes, in `N` accumulators; returns `N`.
#[inline(always)]
fn sums<const N: usize>(
    weights: &[f32],
    width: usize,
    column: usize,
    inputs: &[f32],
    output: &mut [f32],
) -> usize {
    let (biases, rows) = weights.split_at(width);
    let mut totals = [0.0_f32; N];
    totals.copy_from_slice(&biases[column..column + N]);
    if width == N {
        for (row, &input) in rows.chunks_exact(N).zip(inputs) {
            for j in 0..N {
                totals[j] += row[j] * input;
            }
        }
    } else {
        for (row, &input) in rows.chunks_exact(width).zip(inputs) {
            let row = &row[column..column + N];
            for j in 0..N {
                totals[j] += row[j] * input;
            }
        }
    }
    output[..N].copy_from_slice(&totals);
    N
}

/// Hyperbolic tangent as a rational function of degree 9 over 8, minimax on -8 to 8 (coefficients
/// by linear programming); absolute error at most 4e-7 in `f32`. A third of `libm::tanhf`'s
/// instructions.
#[inline(always)]
pub fn tanh(x: f32) -> f32 {
    // One comparison of the bits without the sign, where two of floats take twice the instructions.
    let x = if x.to_bits() << 1 > 8.0_f32.to_bits() << 1 { beyond(x) } else { x };
    let z = x * x;
    let p = 1.505_243_7e-8;
    let p = 2.176_673_4e-5 + z * p;
    let p = 3.563_766_6e-3 + z * p;
    let p = 1.343_786_4e-1 + z * p;
    let p = 9.999_999_7e-1 + z * p;
    let q = 8.449_909_7e-7;
    let q = 3.398_538_8e-4 + z * q;
    let q = 2.613_453_7e-2 + z * q;
    let q = 4.677_118_5e-1 + z * q;
    let q = 1.0 + z * q;
    x * p / q
}

/// Where the function is flat.
#[cold]
#[inline(never)]
fn beyond(x: f32) -> f32 {
    x.clamp(-8.0, 8.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tanh_is_within_4e_7_everywhere() {
        let mut worst = 0.0_f64;
        for i in -120_000..=120_000 {
            let x = i as f32 * 1e-4;
            worst = worst.max((f64::from(tanh(x)) - libm::tanh(f64::from(x))).abs());
        }
        assert!(worst < 4e-7, "{worst}");
        assert_eq!(tanh(f32::INFINITY), tanh(8.0));
    }

    #[test]
    fn forward_is_the_plain_double_sum() {
        // A layer of each width class: six, more than six, fewer; as many inputs as there may be.
        double_sum([41, 6, 14, 3, 2], 0);
        double_sum([41, 6, 14, 3, 4], 0);
        double_sum([42, 6, 14, 3, 2], 0);
        // A projection first.
        double_sum([41, 10, 6, 3, 2], 1);
    }

    fn double_sum(topology: [u8; 5], linear_layers: u8) {
        let count = weight_count(&topology);
        let mut state = 12345_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        let weights: Vec<f32, 1024> = (0..count).map(|_| random() * 0.5).collect();
        let inputs: Vec<f32, 48> = (0..topology[0]).map(|_| random()).collect();
        let mut given: Vec<f64, 48> = inputs.iter().map(|&x| f64::from(x)).collect();
        let mut at = 0;
        for (layer, &width) in topology.iter().enumerate().skip(1) {
            let width = width as usize;
            let mut out = Vec::<f64, 48>::new();
            for j in 0..width {
                let mut total = f64::from(weights[at + j]);
                for (i, x) in given.iter().enumerate() {
                    total += f64::from(weights[at + (i + 1) * width + j]) * x;
                }
                let bends = layer < 4 && layer > usize::from(linear_layers);
                out.push(if bends { libm::tanh(total) } else { total }).unwrap();
            }
            at += (given.len() + 1) * width;
            given = out;
        }
        let outputs = forward(&topology, linear_layers, &weights, &inputs);
        assert!(outputs[given.len()..].iter().all(|beyond| *beyond == 0.0));
        for (ours, plain) in outputs.iter().zip(&given) {
            assert!((f64::from(*ours) - plain).abs() < 2e-6, "{ours} {plain}");
        }
    }

    #[test]
    fn the_way_for_one_hidden_layer_gives_the_same_bits_as_that_for_any() {
        let mut state = 99_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        for round in 0..200 {
            let topology = [41 + round % 2, 6, 2];
            let weights: Vec<f32, 512> =
                (0..weight_count(&topology)).map(|_| random() * 0.5).collect();
            let inputs: Vec<f32, 42> = (0..topology[0]).map(|_| random()).collect();
            let short = forward(&topology, 0, &weights, &inputs);
            let any = any_layers(&topology, 0, &weights, &inputs);
            assert_eq!(short.map(f32::to_bits), any.map(f32::to_bits));
        }
    }
}
