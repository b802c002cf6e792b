//! Gradient and Gauss-Newton curvature of the weighted error, without ever forming the Jacobian.
//!
//! The derivative of output o with respect to weight (i, j) of a layer is `d[o][j] z[i]`: the layer's
//! input i times the sensitivity of o to node j. A block of J'J between layers a and b is therefore
//! the sum over samples of `(sum_o beta_o d_a[o][j] d_b[o][l]) (z_a[i] z_b[m])`: one matrix product
//! of two tables of column products, in which both halves of a symmetric block are computed once, the
//! outputs are summed before the product, and the first layer's input products never change.

use super::network::{Pass, Shape};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

/// Largest table of first-layer input products that is kept between epochs.
const KEPT_PRODUCTS_BYTES: usize = 64 << 20;
/// Samples at a time where products are formed on the fly: a few hundred columns of them fit the cache.
const CHUNK: usize = 256;

/// Tables and scratch of one training set and topology.
pub(super) struct Curvature {
    /// Sensitivities per hidden layer and output, samples x nodes.
    delta: Vec<Vec<Mat<f64>>>,
    /// The products x_i x_i' of the first layer's inputs, i <= i', samples x pairs.
    input_products: Option<Mat<f64>>,
    left: Mat<f64>,
    right: Mat<f64>,
    block: Mat<f64>,
}

fn pairs(n: usize) -> usize {
    n * (n + 1) / 2
}

/// All pairs (a, b), a <= b, of 0..n, b outermost.
fn each_pair(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n).flat_map(|b| (0..=b).map(move |a| (a, b)))
}

/// Makes `table` at least `rows` x `columns`; scratch, so what it held is lost.
fn room(table: &mut Mat<f64>, rows: usize, columns: usize) {
    if table.nrows() < rows || table.ncols() < columns {
        *table = Mat::zeros(table.nrows().max(rows), table.ncols().max(columns));
    }
}

fn multiply(into: &mut [f64], a: &[f64], b: &[f64]) {
    for ((c, a), b) in into.iter_mut().zip(a).zip(b) {
        *c = a * b;
    }
}

impl Curvature {
    /// `pass` must hold the training inputs already.
    pub fn new(shape: &Shape, pass: &Pass) -> Self {
        let n = pass.z[0].nrows();
        let hidden = shape.layers() - 1;
        let columns = pairs(shape.rows(0));
        let keep = hidden > 0 && n * columns * size_of::<f64>() <= KEPT_PRODUCTS_BYTES;
        let input_products = keep.then(|| {
            let mut table = Mat::zeros(n, columns);
            for (column, (a, b)) in each_pair(shape.rows(0)).enumerate() {
                let (x, y) = (pass.z[0].col_as_slice(a), pass.z[0].col_as_slice(b));
                multiply(table.col_as_slice_mut(column), x, y);
            }
            table
        });
        Self {
            delta: (0..hidden)
                .map(|layer| vec![Mat::zeros(n, shape.nodes(layer)); shape.outputs()])
                .collect(),
            input_products,
            left: Mat::new(),
            right: Mat::new(),
            block: Mat::new(),
        }
    }

    /// Sets the sensitivities of all outputs to all hidden nodes from the pass last run with `w`.
    pub fn sensitivities(&mut self, shape: &Shape, pass: &Pass, w: &[f64]) {
        for layer in (0..self.delta.len()).rev() {
            let (here, above) = self.delta.split_at_mut(layer + 1);
            let weights = shape.weights(w, layer + 1);
            for (o, delta) in here[layer].iter_mut().enumerate() {
                if let Some(above) = above.first() {
                    let weights = weights.subrows(1, shape.nodes(layer)).transpose();
                    matmul(&mut *delta, Accum::Replace, &above[o], weights, 1.0, Par::Seq);
                }
                for j in 0..shape.nodes(layer) {
                    let z = pass.z[layer + 1].col_as_slice(1 + j);
                    let column = delta.col_as_slice_mut(j).iter_mut().zip(z);
                    if above.is_empty() {
                        let v = weights[(1 + j, o)];
                        column.for_each(|(d, z)| *d = v * (1.0 - z * z));
                    } else {
                        column.for_each(|(d, z)| *d *= 1.0 - z * z);
                    }
                }
            }
        }
    }

    /// J' of the weighted vector `beta_o v_o`, J the derivative of the outputs, into `gradient`.
    pub fn gradient(
        &mut self,
        shape: &Shape,
        pass: &Pass,
        v: MatRef<f64>,
        beta: &[f64],
        gradient: &mut [f64],
    ) {
        let n = v.nrows();
        let last = shape.layers() - 1;
        for layer in 0..=last {
            let nodes = shape.nodes(layer);
            room(&mut self.right, n, nodes);
            for j in 0..nodes {
                let sum = &mut self.right.col_as_slice_mut(j)[..n];
                sum.fill(0.0);
                for (o, &beta) in beta.iter().enumerate() {
                    let v = v.col(o).iter();
                    if layer < last {
                        let delta = self.delta[layer][o].col_as_slice(j);
                        sum.iter_mut().zip(v).zip(delta).for_each(|((s, v), d)| *s += beta * v * d);
                    } else if o == j {
                        sum.iter_mut().zip(v).for_each(|(s, v)| *s = beta * v);
                    }
                }
            }
            let rows = shape.rows(layer);
            let into = faer::MatMut::from_row_major_slice_mut(
                &mut gradient[shape.block(layer)],
                rows,
                nodes,
            );
            let right = self.right.submatrix(0, 0, n, nodes);
            matmul(into, Accum::Replace, pass.z[layer].transpose(), right, 1.0, Par::Seq);
        }
    }

    /// The lower triangle of `sum_o beta_o J_o'J_o` into `h`.
    pub fn assemble(&mut self, shape: &Shape, pass: &Pass, beta: &[f64], h: &mut Mat<f64>) {
        let last = shape.layers() - 1;
        for b in 0..=last {
            for a in 0..b {
                self.across(shape, pass, beta, (a, b), h);
            }
            if b < last {
                self.within(shape, pass, beta, b, h);
            } else {
                self.output_layer(shape, pass, beta, h);
            }
        }
    }

    /// Trace of J_o'J_o of one output.
    pub fn trace(&self, shape: &Shape, pass: &Pass, o: usize) -> f64 {
        let norms = |table: &Mat<f64>, columns: usize, s: usize| -> f64 {
            (0..columns).map(|c| table[(s, c)] * table[(s, c)]).sum()
        };
        let sample = |s: usize| -> f64 {
            let last = shape.layers() - 1;
            let hidden = self.delta.iter().enumerate().map(|(layer, delta)| {
                norms(&delta[o], shape.nodes(layer), s)
                    * norms(&pass.z[layer], shape.rows(layer), s)
            });
            hidden.sum::<f64>() + norms(&pass.z[last], shape.rows(last), s)
        };
        (0..pass.error.nrows()).map(sample).sum()
    }

    /// A hidden layer with itself.
    fn within(&mut self, shape: &Shape, pass: &Pass, beta: &[f64], layer: usize, h: &mut Mat<f64>) {
        let (rows, nodes) = (shape.rows(layer), shape.nodes(layer));
        let n = pass.z[layer].nrows();
        let (np, nq) = (pairs(rows), pairs(nodes));
        room(&mut self.left, n, nq);
        for (column, (j, l)) in each_pair(nodes).enumerate() {
            let (delta, into) = (&self.delta[layer], self.left.col_as_slice_mut(column));
            weighted_products(delta, delta, beta, (j, l), into);
        }
        room(&mut self.block, nq, np);
        let left = self.left.submatrix(0, 0, n, nq);
        let mut block = self.block.submatrix_mut(0, 0, nq, np);
        match &self.input_products {
            Some(table) if layer == 0 => {
                matmul(block.as_mut(), Accum::Replace, left.transpose(), table, 1.0, Par::Seq);
            }
            _ => {
                block.fill(0.0);
                let z = &pass.z[layer];
                for start in (0..n).step_by(CHUNK) {
                    let len = CHUNK.min(n - start);
                    room(&mut self.right, len, np);
                    for (column, (i, m)) in each_pair(rows).enumerate() {
                        let (x, y) = (&z.col_as_slice(i)[start..], &z.col_as_slice(m)[start..]);
                        multiply(self.right.col_as_slice_mut(column), x, y);
                    }
                    let left = left.subrows(start, len).transpose();
                    let right = self.right.submatrix(0, 0, len, np);
                    matmul(block.as_mut(), Accum::Add, left, right, 1.0, Par::Seq);
                }
            }
        }
        let start = shape.block(layer).start;
        for (column, (m, i)) in each_pair(rows).enumerate() {
            // i >= m: below or on the block diagonal. A block is itself symmetric; its upper half is spread too.
            let values = self.block.col_as_slice(column);
            for l in 0..nodes {
                let into = h.col_as_slice_mut(start + m * nodes + l);
                let into = &mut into[start + i * nodes..][..nodes];
                into[..=l].copy_from_slice(&values[pairs(l)..][..=l]);
                for (j, into) in into.iter_mut().enumerate().skip(l + 1) {
                    *into = values[pairs(j) + l];
                }
            }
        }
    }

    /// Layer `a` with a later one, `b`: one product for each node of `a`.
    fn across(
        &mut self,
        shape: &Shape,
        pass: &Pass,
        beta: &[f64],
        (a, b): (usize, usize),
        h: &mut Mat<f64>,
    ) {
        let n = pass.error.nrows();
        let (rows, nodes) = (shape.rows(b), shape.nodes(b));
        let (start_a, start_b) = (shape.block(a).start, shape.block(b).start);
        room(&mut self.left, n, nodes);
        room(&mut self.right, n, rows * nodes);
        room(&mut self.block, rows * nodes, shape.rows(a));
        for j in 0..shape.nodes(a) {
            for l in 0..nodes {
                let into = self.left.col_as_slice_mut(l);
                match self.delta.get(b) {
                    Some(above) => weighted_products(&self.delta[a], above, beta, (j, l), into),
                    None => {
                        let delta = self.delta[a][l].col_as_slice(j).iter();
                        into.iter_mut().zip(delta).for_each(|(c, d)| *c = beta[l] * d);
                    }
                }
            }
            for m in 0..rows {
                for l in 0..nodes {
                    let into = self.right.col_as_slice_mut(m * nodes + l);
                    multiply(into, self.left.col_as_slice(l), pass.z[b].col_as_slice(m));
                }
            }
            let right = self.right.submatrix(0, 0, n, rows * nodes);
            let mut block = self.block.submatrix_mut(0, 0, rows * nodes, shape.rows(a));
            matmul(block.as_mut(), Accum::Replace, right.transpose(), &pass.z[a], 1.0, Par::Seq);
            for i in 0..shape.rows(a) {
                let into = h.col_as_slice_mut(start_a + i * shape.nodes(a) + j);
                into[start_b..][..rows * nodes]
                    .copy_from_slice(&self.block.col_as_slice(i)[..rows * nodes]);
            }
        }
    }

    /// The output layer with itself: each output sees only its own weights.
    fn output_layer(&mut self, shape: &Shape, pass: &Pass, beta: &[f64], h: &mut Mat<f64>) {
        let last = shape.layers() - 1;
        let (rows, nodes, start) = (shape.rows(last), shape.nodes(last), shape.block(last).start);
        let z = &pass.z[last];
        let gram = z.transpose() * z;
        for m in 0..rows {
            for o in 0..nodes {
                let into = &mut h.col_as_slice_mut(start + m * nodes + o)[start..];
                into.fill(0.0);
                (0..rows).for_each(|i| into[i * nodes + o] = beta[o] * gram[(i, m)]);
            }
        }
    }
}

/// `sum_o beta_o a[o][j] b[o][l]` for every sample.
fn weighted_products(
    a: &[Mat<f64>],
    b: &[Mat<f64>],
    beta: &[f64],
    (j, l): (usize, usize),
    into: &mut [f64],
) {
    for (o, ((a, b), beta)) in a.iter().zip(b).zip(beta).enumerate() {
        let products = a.col_as_slice(j).iter().zip(b.col_as_slice(l)).map(|(a, b)| beta * (a * b));
        if o == 0 {
            into.iter_mut().zip(products).for_each(|(c, p)| *c = p);
        } else {
            into.iter_mut().zip(products).for_each(|(c, p)| *c += p);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::network::tests::problem;
    use super::*;

    /// The derivative of every output of every sample, one row each, by central differences.
    fn jacobian(shape: &Shape, inputs: &[f64], n: usize, w: &[f64], o: usize) -> Mat<f64> {
        let step = 1e-5;
        let targets = vec![0.0; n * shape.outputs()];
        let mut pass = Pass::new(shape, inputs, n);
        let mut jacobian = Mat::zeros(n, w.len());
        for p in 0..w.len() {
            let mut column = |sign: f64| {
                let mut w = w.to_vec();
                w[p] += sign * step;
                pass.run(shape, &w, &targets);
                (0..n).map(|s| -pass.error[(s, o)]).collect::<Vec<_>>()
            };
            let (up, down) = (column(1.0), column(-1.0));
            for s in 0..n {
                jacobian[(s, p)] = (up[s] - down[s]) / (2.0 * step);
            }
        }
        jacobian
    }

    /// `n` beyond a chunk, and `keep` false, take the products formed on the way.
    fn agrees(topology: &[usize], n: usize, keep: bool) {
        let (shape, inputs, targets, w) = problem(topology, n, 5);
        let beta: Vec<f64> = (0..shape.outputs()).map(|o| 0.7 + 1.9 * o as f64).collect();
        let mut pass = Pass::new(&shape, &inputs, n);
        pass.run(&shape, &w, &targets);
        let mut curvature = Curvature::new(&shape, &pass);
        if !keep {
            curvature.input_products = None;
        }
        let p = shape.parameters();
        let (mut h, mut gradient) = (Mat::zeros(p, p), vec![0.0; p]);
        curvature.sensitivities(&shape, &pass, &w);
        // Twice: scratch left from a first use must not show.
        for _ in 0..2 {
            curvature.assemble(&shape, &pass, &beta, &mut h);
            curvature.gradient(&shape, &pass, pass.error.as_ref(), &beta, &mut gradient);
        }
        let (mut dense, mut slope) = (Mat::<f64>::zeros(p, p), vec![0.0; p]);
        for (o, &beta) in beta.iter().enumerate() {
            let j = jacobian(&shape, &inputs, n, &w, o);
            let own = j.transpose() * &j;
            let trace: f64 = (0..p).map(|i| own[(i, i)]).sum();
            assert!((curvature.trace(&shape, &pass, o) - trace).abs() < 1e-8 * trace);
            dense += faer::Scale(beta) * &own;
            for (i, slope) in slope.iter_mut().enumerate() {
                *slope += (0..n).map(|s| beta * j[(s, i)] * pass.error[(s, o)]).sum::<f64>();
            }
        }
        let scale = (0..p).map(|i| dense[(i, i)]).fold(0.0, f64::max);
        for a in 0..p {
            assert!((gradient[a] - slope[a]).abs() < 1e-8 * scale, "{topology:?} gradient {a}");
            for b in 0..=a {
                assert!((h[(a, b)] - dense[(a, b)]).abs() < 1e-8 * scale, "{topology:?} {a} {b}");
            }
        }
    }

    #[test]
    fn agrees_with_the_jacobian_by_differences() {
        for topology in [&[3, 2][..], &[7, 4, 2], &[4, 1, 1], &[4, 5, 3, 2], &[3, 4, 2, 3, 3]] {
            agrees(topology, 11, true);
            agrees(topology, 11, false);
        }
    }

    #[test]
    fn agrees_beyond_one_chunk() {
        for n in [CHUNK, 2 * CHUNK + 3] {
            agrees(&[3, 3, 3, 2], n, true);
            agrees(&[3, 3, 3, 2], n, false);
        }
    }
}
