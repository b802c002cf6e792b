//! The network as the trainer sees it: tanh hidden layers, linear outputs, f64, a whole batch at once.
//!
//! Weights, here and on the device: layer after layer a row-major block of (inputs + 1) rows and one
//! column per node. Row 0 holds the biases, row 1 + i the weights of input i.

use super::matrix::{col, col_mut, row_major, Matrix, Strided};
use nalgebra::DMatrixView;
use std::ops::Range;

/// Node counts of a network, and where each layer's weights lie.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shape {
    widths: Vec<usize>,
    starts: Vec<usize>,
}

impl Shape {
    /// `topology`: inputs, hidden layers, outputs, as in `[41, 6, 2]`.
    pub fn new(topology: &[usize]) -> Self {
        assert!(topology.len() >= 2, "a topology names at least inputs and outputs");
        let mut starts = vec![0];
        for pair in topology.windows(2) {
            starts.push(starts[starts.len() - 1] + (pair[0] + 1) * pair[1]);
        }
        Self { widths: topology.to_vec(), starts }
    }
    /// Layers with weights: one more than hidden layers.
    pub fn layers(&self) -> usize {
        self.widths.len() - 1
    }
    /// Rows of a layer's weight block: its inputs and the bias.
    pub fn rows(&self, layer: usize) -> usize {
        self.widths[layer] + 1
    }
    /// Nodes of a layer.
    pub fn nodes(&self, layer: usize) -> usize {
        self.widths[layer + 1]
    }
    pub fn outputs(&self) -> usize {
        self.widths[self.widths.len() - 1]
    }
    /// Where a layer's block lies in the weight vector.
    pub fn block(&self, layer: usize) -> Range<usize> {
        self.starts[layer]..self.starts[layer + 1]
    }
    /// Weights and biases: N of the thesis.
    pub fn parameters(&self) -> usize {
        self.starts[self.starts.len() - 1]
    }
    /// A layer's weights as a (inputs + 1) x nodes matrix.
    pub(super) fn weights<'a>(&self, w: &'a [f64], layer: usize) -> Strided<'a> {
        row_major(&w[self.block(layer)], self.rows(layer), self.nodes(layer))
    }
    /// The same without the biases, transposed: nodes x inputs.
    pub(super) fn weights_back<'a>(&self, w: &'a [f64], layer: usize) -> DMatrixView<'a, f64> {
        let nodes = self.nodes(layer);
        DMatrixView::from_slice(&w[self.block(layer)][nodes..], nodes, self.rows(layer) - 1)
    }
}

/// Outputs of a network of `topology` for one input vector (thesis 4.4, 4.5).
///
/// The plain reference. What the device computes is its own f32 code.
pub fn forward(topology: &[usize], weights: &[f64], input: &[f64]) -> Vec<f64> {
    let shape = Shape::new(topology);
    assert_eq!(weights.len(), shape.parameters(), "weights do not belong to this topology");
    assert_eq!(input.len(), topology[0], "input does not belong to this topology");
    let mut z = input.to_vec();
    for layer in 0..shape.layers() {
        let block = &weights[shape.block(layer)];
        let (bias, rows) = block.split_at(shape.nodes(layer));
        let mut a = bias.to_vec();
        for (x, row) in z.iter().zip(rows.chunks_exact(shape.nodes(layer))) {
            for (a, w) in a.iter_mut().zip(row) {
                *a += x * w;
            }
        }
        if layer + 1 < shape.layers() {
            a.iter_mut().for_each(|a| *a = a.tanh());
        }
        z = a;
    }
    z
}

/// tanh to within three epsilon, absolute (two roundings of a number up to 2, one of the exponential),
/// in a third of the library function's time. Relative error near zero does not matter to a sum of squares.
fn tanh(a: f64) -> f64 {
    1.0 - 2.0 / (1.0 + (2.0 * a).exp())
}

/// A batch on its way through the network: what each layer sees and the errors at the end.
#[derive(Clone)]
pub(super) struct Pass {
    /// Per layer its inputs, samples x (inputs + 1); column 0 is the ones the biases multiply.
    pub z: Vec<Matrix>,
    /// Target minus output, samples x outputs.
    pub error: Matrix,
}

impl Pass {
    /// `inputs` row-major, `n` rows.
    pub fn new(shape: &Shape, inputs: &[f64], n: usize) -> Self {
        let d = shape.rows(0) - 1;
        let z = (0..shape.layers())
            .map(|layer| {
                Matrix::from_fn(n, shape.rows(layer), |s, i| match (layer, i) {
                    (_, 0) => 1.0,
                    (0, i) => inputs[s * d + i - 1],
                    _ => 0.0,
                })
            })
            .collect();
        Self { z, error: Matrix::zeros(n, shape.outputs()) }
    }

    /// Runs the batch with weights `w`; `targets` row-major. Returns the sum of squared errors per output.
    pub fn run(&mut self, shape: &Shape, w: &[f64], targets: &[f64]) -> Vec<f64> {
        for layer in 0..shape.layers() {
            let (before, after) = self.z.split_at_mut(layer + 1);
            let weights = shape.weights(w, layer);
            let Some(next) = after.first_mut() else {
                self.error.gemm(1.0, &before[layer], &weights, 0.0);
                break;
            };
            next.columns_mut(1, shape.nodes(layer)).gemm(1.0, &before[layer], &weights, 0.0);
            for j in 1..=shape.nodes(layer) {
                col_mut(next, j).iter_mut().for_each(|a| *a = tanh(*a));
            }
        }
        let k = shape.outputs();
        (0..k)
            .map(|o| {
                let errors = col_mut(&mut self.error, o).iter_mut();
                errors.zip(targets[o..].iter().step_by(k)).fold(0.0, |sum, (e, t)| {
                    *e = t - *e;
                    sum + *e * *e
                })
            })
            .collect()
    }

    /// Second derivative of the outputs along `step`, samples x outputs, at the pass last run with `w`.
    pub fn second_derivative(&self, shape: &Shape, w: &[f64], step: &[f64]) -> Matrix {
        let n = self.error.nrows();
        // First and second derivative of what the layer sees; the training inputs have none.
        let mut below: Option<(Matrix, Matrix)> = None;
        let mut layer = 0;
        loop {
            let nodes = shape.nodes(layer);
            let (weights, change) = (shape.weights(w, layer), shape.weights(step, layer));
            let mut first = Matrix::zeros(n, nodes);
            let mut second = Matrix::zeros(n, nodes);
            first.gemm(1.0, &self.z[layer], &change, 0.0);
            if let Some((z1, z2)) = &below {
                // The biases' row multiplies a constant.
                let inputs = shape.rows(layer) - 1;
                let (weights, change) = (weights.rows(1, inputs), change.rows(1, inputs));
                first.gemm(1.0, z1, &weights, 1.0);
                second.gemm(1.0, z2, &weights, 0.0);
                second.gemm(2.0, z1, &change, 1.0);
            }
            if layer + 1 == shape.layers() {
                return second;
            }
            for j in 0..nodes {
                let z = col(&self.z[layer + 1], 1 + j);
                let columns = col_mut(&mut first, j).iter_mut().zip(col_mut(&mut second, j));
                for ((a1, a2), z) in columns.zip(z) {
                    let slope = 1.0 - z * z;
                    *a2 = slope * (*a2 - 2.0 * z * *a1 * *a1);
                    *a1 *= slope;
                }
            }
            below = Some((first, second));
            layer += 1;
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Inputs, targets and weights of a made-up problem.
    pub fn problem(
        topology: &[usize],
        n: usize,
        seed: u64,
    ) -> (Shape, Vec<f64>, Vec<f64>, Vec<f64>) {
        let shape = Shape::new(topology);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut draw = |count: usize| (0..count).map(|_| rng.random_range(-1.0..1.0)).collect();
        let (inputs, targets) = (draw(n * topology[0]), draw(n * shape.outputs()));
        let weights = draw(shape.parameters());
        (shape, inputs, targets, weights)
    }

    #[test]
    fn weights_lie_layer_after_layer_with_biases_first() {
        let shape = Shape::new(&[41, 6, 2]);
        assert_eq!((shape.parameters(), shape.block(1)), (266, 252..266));
        assert_eq!(Shape::new(&[32, 20, 5, 2]).parameters(), 777);
        // Biases 1 and 2, then the weights of the two inputs.
        let y = forward(&[2, 2], &[1.0, 2.0, 10.0, 20.0, 100.0, 200.0], &[1.0, 2.0]);
        assert_eq!(y, vec![211.0, 422.0]);
        let y = forward(&[1, 1, 1], &[0.5, 2.0, 3.0, 4.0], &[0.25]);
        assert_eq!(y, vec![3.0 + 4.0 * 1f64.tanh()]);
    }

    #[test]
    fn a_batch_gives_what_single_samples_give() {
        for topology in [&[5, 2][..], &[5, 4, 2], &[5, 4, 3, 2]] {
            let (shape, inputs, targets, w) = problem(topology, 7, 1);
            let mut pass = Pass::new(&shape, &inputs, 7);
            let sums = pass.run(&shape, &w, &targets);
            let mut expected = [0.0; 2];
            for s in 0..7 {
                let y = forward(topology, &w, &inputs[s * 5..][..5]);
                for o in 0..2 {
                    let error = targets[s * 2 + o] - y[o];
                    assert!((pass.error[(s, o)] - error).abs() < 1e-14);
                    expected[o] += error * error;
                }
            }
            assert!(sums.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-13));
        }
    }

    #[test]
    fn own_tanh_is_tanh() {
        for i in -4000..=4000 {
            let a = i as f64 * 0.01;
            assert!((tanh(a) - a.tanh()).abs() <= 3.0 * f64::EPSILON, "{a}");
        }
        assert_eq!((tanh(1e4), tanh(-1e4), tanh(0.0)), (1.0, -1.0, 0.0));
    }

    #[test]
    fn second_derivative_agrees_with_differences() {
        for topology in [&[5, 2][..], &[5, 4, 2], &[5, 4, 3, 2], &[5, 3, 3, 3, 1]] {
            let (shape, inputs, targets, w) = problem(topology, 6, 2);
            let (_, _, _, step) = problem(topology, 1, 3);
            let h = 1e-4;
            let outputs = |t: f64| {
                let w: Vec<f64> = w.iter().zip(&step).map(|(w, s)| w + t * s).collect();
                let mut pass = Pass::new(&shape, &inputs, 6);
                pass.run(&shape, &w, &targets);
                (pass.clone(), pass.error)
            };
            let (pass, middle) = outputs(0.0);
            let (up, down) = (outputs(h).1, outputs(-h).1);
            let second = pass.second_derivative(&shape, &w, &step);
            for s in 0..6 {
                for o in 0..shape.outputs() {
                    // The error falls where the output rises.
                    let numeric = -(up[(s, o)] - 2.0 * middle[(s, o)] + down[(s, o)]) / (h * h);
                    let size = 1.0 + numeric.abs();
                    assert!((second[(s, o)] - numeric).abs() < 1e-6 * size, "{topology:?}");
                }
            }
        }
    }
}
