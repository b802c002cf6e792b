//! Forward pass of a small multilayer perceptron, the same bits on host and device.

use crate::features::{FEATURES, MAX_INPUTS};
use crate::numbers::MAX_NUMBERS;

/// Widest layer, the inputs' included.
pub const WIDEST: usize = 48;
/// Natural frequency and damping ratio, which every network says first.
pub const OUTPUTS: usize = 2;
/// Most outputs: those two, then numbers of effects.
pub const MAX_OUTPUTS: usize = OUTPUTS + MAX_NUMBERS;
/// Columns of a layer that are summed side by side, each in a register of its own.
const COLUMNS: usize = 6;
/// Rows of a layer between two looks at whether there are more.
const ROWS: usize = 8;

/// Scaled outputs for scaled inputs; zero beyond those that there are. The network they are of has passed
/// [`Network::check`](crate::network::Network::check), and the inputs are as many as its topology has.
pub fn forward(
    topology: &[u8],
    linear_layers: u8,
    weights: &[f32],
    inputs: &[f32],
) -> [f32; MAX_OUTPUTS] {
    // With all lengths known to the compiler the same sums take 40 % fewer instructions.
    if let ([_, 6, 2], 0) = (topology, linear_layers) {
        if let Ok(inputs) = <&[f32; FEATURES]>::try_from(inputs) {
            return one_hidden_layer::<FEATURES, 6>(weights, inputs);
        }
        if let Ok(inputs) = <&[f32; MAX_INPUTS]>::try_from(inputs) {
            return one_hidden_layer::<MAX_INPUTS, 6>(weights, inputs);
        }
    }
    any_layers(topology, linear_layers, weights, inputs)
}

/// `M` inputs, `N` hidden nodes, two outputs.
#[inline(never)]
fn one_hidden_layer<const M: usize, const N: usize>(
    weights: &[f32],
    inputs: &[f32; M],
) -> [f32; MAX_OUTPUTS] {
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
) -> [f32; MAX_OUTPUTS] {
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
    use crate::network::weight_count;
    use heapless::Vec;

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
