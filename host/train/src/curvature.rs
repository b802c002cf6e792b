//! Gradient and Gauss-Newton curvature of the weighted error, without ever forming the Jacobian.
//!
//! The derivative of output o with respect to weight (i, j) of a layer is `d[o][j] z[i]`: the layer's
//! input i times the sensitivity of o to node j. A block of J'J between layers a and b is therefore
//! the sum over samples of `(sum_o beta_o d_a[o][j] d_b[o][l]) (z_a[i] z_b[m])`: one matrix product
//! of two tables of column products, in which both halves of a symmetric block are computed once and the
//! outputs are summed before the product.

use super::matrix::{col, col_mut, row_major_transposed, Matrix};
use super::network::{Pass, Shape};

/// Samples at a time: a few hundred columns of products fit the cache.
const CHUNK: usize = 256;

/// Tables and scratch of one training set and topology.
pub(super) struct Curvature {
    /// Sensitivities per hidden layer and output, samples x nodes.
    delta: Vec<Vec<Matrix>>,
    left: Matrix,
    right: Matrix,
    block: Matrix,
}

fn pairs(n: usize) -> usize {
    n * (n + 1) / 2
}

/// All pairs (a, b), a <= b, of 0..n, b outermost.
fn each_pair(n: usize) -> impl Iterator<Item = (usize, usize)> + Clone {
    (0..n).flat_map(|b| (0..=b).map(move |a| (a, b)))
}

/// Makes `table` at least `rows` x `columns`; scratch, so what it held is lost.
fn room(table: &mut Matrix, rows: usize, columns: usize) {
    if table.nrows() < rows || table.ncols() < columns {
        *table = Matrix::zeros(table.nrows().max(rows), table.ncols().max(columns));
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
        Self {
            delta: (0..hidden)
                .map(|layer| vec![Matrix::zeros(n, shape.nodes(layer)); shape.outputs()])
                .collect(),
            left: Matrix::zeros(0, 0),
            right: Matrix::zeros(0, 0),
            block: Matrix::zeros(0, 0),
        }
    }

    /// Sets the sensitivities of all outputs to all hidden nodes from the pass last run with `w`.
    pub fn sensitivities(&mut self, shape: &Shape, pass: &Pass, w: &[f64]) {
        for layer in (0..self.delta.len()).rev() {
            let (here, above) = self.delta.split_at_mut(layer + 1);
            let weights = shape.weights(w, layer + 1);
            for (o, delta) in here[layer].iter_mut().enumerate() {
                if let Some(above) = above.first() {
                    let back = shape.weights_back(w, layer + 1);
                    delta.gemm(1.0, &above[o], &back, 0.0);
                }
                for j in 0..shape.nodes(layer) {
                    let z = col(&pass.z[layer + 1], 1 + j);
                    let column = col_mut(delta, j).iter_mut().zip(z);
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
        v: &Matrix,
        beta: &[f64],
        gradient: &mut [f64],
    ) {
        let n = v.nrows();
        let last = shape.layers() - 1;
        for layer in 0..=last {
            let nodes = shape.nodes(layer);
            room(&mut self.right, n, nodes);
            for j in 0..nodes {
                let sum = &mut col_mut(&mut self.right, j)[..n];
                sum.fill(0.0);
                for (o, &beta) in beta.iter().enumerate() {
                    let v = col(v, o).iter();
                    if layer < last {
                        let delta = col(&self.delta[layer][o], j);
                        sum.iter_mut().zip(v).zip(delta).for_each(|((s, v), d)| *s += beta * v * d);
                    } else if o == j {
                        sum.iter_mut().zip(v).for_each(|(s, v)| *s = beta * v);
                    }
                }
            }
            let mut into = row_major_transposed(&mut gradient[shape.block(layer)], nodes);
            let right = self.right.view((0, 0), (n, nodes)).transpose();
            into.gemm(1.0, &right, &pass.z[layer], 0.0);
        }
    }

    /// The lower triangle of `sum_o beta_o J_o'J_o` into `h`.
    pub fn assemble(&mut self, shape: &Shape, pass: &Pass, beta: &[f64], h: &mut Matrix) {
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
        let norms = |table: &Matrix, columns: usize, s: usize| -> f64 {
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
    fn within(&mut self, shape: &Shape, pass: &Pass, beta: &[f64], layer: usize, h: &mut Matrix) {
        let (rows, nodes) = (shape.rows(layer), shape.nodes(layer));
        let n = pass.z[layer].nrows();
        let (np, nq) = (pairs(rows), pairs(nodes));
        room(&mut self.left, n, nq);
        for (column, (j, l)) in each_pair(nodes).enumerate() {
            let (delta, into) = (&self.delta[layer], col_mut(&mut self.left, column));
            weighted_products(delta, delta, beta, (j, l), into);
        }
        let z = &pass.z[layer];
        self.product(z, z, each_pair(rows), (nq, np));
        // Where a pair of nodes lies among the pairs, either way round.
        let place = |j: usize, l: usize| pairs(j.max(l)) + j.min(l);
        let places: Vec<usize> =
            (0..nodes).flat_map(|l| (0..nodes).map(move |j| place(j, l))).collect();
        let start = shape.block(layer).start;
        for m in 0..rows {
            for (l, places) in places.chunks_exact(nodes).enumerate() {
                // From the block diagonal down.
                let into = &mut col_mut(h, start + m * nodes + l)[start + m * nodes..];
                for (i, into) in (m..rows).zip(into.chunks_exact_mut(nodes)) {
                    let values = &col(&self.block, pairs(i) + m)[..nq];
                    into.iter_mut().zip(places).for_each(|(into, at)| *into = values[*at]);
                }
            }
        }
    }

    /// Layer `a` with a later one, `b`.
    fn across(
        &mut self,
        shape: &Shape,
        pass: &Pass,
        beta: &[f64],
        (a, b): (usize, usize),
        h: &mut Matrix,
    ) {
        let n = pass.error.nrows();
        let (nodes_a, nodes_b) = (shape.nodes(a), shape.nodes(b));
        let nq = nodes_a * nodes_b;
        room(&mut self.left, n, nq);
        for j in 0..nodes_a {
            for l in 0..nodes_b {
                let into = col_mut(&mut self.left, j * nodes_b + l);
                match self.delta.get(b) {
                    Some(above) => weighted_products(&self.delta[a], above, beta, (j, l), into),
                    None => {
                        let delta = col(&self.delta[a][l], j).iter();
                        into.iter_mut().zip(delta).for_each(|(c, d)| *c = beta[l] * d);
                    }
                }
            }
        }
        let (rows_a, rows_b) = (shape.rows(a), shape.rows(b));
        let (start_a, start_b) = (shape.block(a).start, shape.block(b).start);
        if nq < rows_a {
            // Few sensitivities: take the products with the inputs of `b` into that table.
            room(&mut self.right, n, nq * rows_b);
            for j in 0..nodes_a {
                for (m, l) in (0..rows_b).flat_map(|m| (0..nodes_b).map(move |l| (m, l))) {
                    let q = col(&self.left, j * nodes_b + l);
                    let into = col_mut(&mut self.right, (j * rows_b + m) * nodes_b + l);
                    multiply(&mut into[..n], q, col(&pass.z[b], m));
                }
            }
            room(&mut self.block, nq * rows_b, rows_a);
            let right = self.right.view((0, 0), (n, nq * rows_b)).transpose();
            let mut block = self.block.view_mut((0, 0), (nq * rows_b, rows_a));
            block.gemm(1.0, &right, &pass.z[a], 0.0);
            for i in 0..rows_a {
                let run = rows_b * nodes_b;
                for (j, values) in
                    col(&self.block, i)[..nodes_a * run].chunks_exact(run).enumerate()
                {
                    let into = col_mut(h, start_a + i * nodes_a + j);
                    into[start_b..][..run].copy_from_slice(values);
                }
            }
            return;
        }
        let columns = (0..rows_a).flat_map(|i| (0..rows_b).map(move |m| (i, m)));
        self.product(&pass.z[a], &pass.z[b], columns.clone(), (nq, rows_a * rows_b));
        for (column, (i, m)) in columns.enumerate() {
            let values = col(&self.block, column)[..nq].chunks_exact(nodes_b);
            for (j, values) in values.enumerate() {
                let into = col_mut(h, start_a + i * nodes_a + j);
                into[start_b + m * nodes_b..][..nodes_b].copy_from_slice(values);
            }
        }
    }

    /// `block` = the `left` table's `nq` columns, transposed, times the `np` products of the columns
    /// (i, m) of `x` and `y`, formed a chunk of samples at a time.
    fn product(
        &mut self,
        x: &Matrix,
        y: &Matrix,
        columns: impl Iterator<Item = (usize, usize)> + Clone,
        (nq, np): (usize, usize),
    ) {
        room(&mut self.block, nq, np);
        room(&mut self.right, CHUNK.min(x.nrows()), np);
        let mut block = self.block.view_mut((0, 0), (nq, np));
        for start in (0..x.nrows()).step_by(CHUNK) {
            let len = CHUNK.min(x.nrows() - start);
            for (column, (i, m)) in columns.clone().enumerate() {
                let (x, y) = (&col(x, i)[start..], &col(y, m)[start..]);
                multiply(&mut col_mut(&mut self.right, column)[..len], x, y);
            }
            let left = self.left.view((start, 0), (len, nq)).transpose();
            let right = self.right.view((0, 0), (len, np));
            block.gemm(1.0, &left, &right, if start == 0 { 0.0 } else { 1.0 });
        }
    }

    /// The output layer with itself: each output sees only its own weights.
    fn output_layer(&mut self, shape: &Shape, pass: &Pass, beta: &[f64], h: &mut Matrix) {
        let last = shape.layers() - 1;
        let (rows, nodes, start) = (shape.rows(last), shape.nodes(last), shape.block(last).start);
        let z = &pass.z[last];
        let gram = z.tr_mul(z);
        for m in 0..rows {
            for o in 0..nodes {
                let into = &mut col_mut(h, start + m * nodes + o)[start..];
                into.fill(0.0);
                (0..rows).for_each(|i| into[i * nodes + o] = beta[o] * gram[(i, m)]);
            }
        }
    }
}

/// `sum_o beta_o a[o][j] b[o][l]` for every sample.
fn weighted_products(
    a: &[Matrix],
    b: &[Matrix],
    beta: &[f64],
    (j, l): (usize, usize),
    into: &mut [f64],
) {
    for (o, ((a, b), beta)) in a.iter().zip(b).zip(beta).enumerate() {
        let products = col(a, j).iter().zip(col(b, l)).map(|(a, b)| beta * (a * b));
        if o == 0 {
            into.iter_mut().zip(products).for_each(|(c, p)| *c = p);
        } else {
            into.iter_mut().zip(products).for_each(|(c, p)| *c += p);
        }
    }
}

#[cfg(test)]
mod tests;
