//! Seconds per epoch of the trainer, beside the plain dense way and the product no way can do without.
//!
//! `cargo bench -p yawrig --bench train`; one core. Processor time, not the wall's, and the best of
//! several repeats: a machine is seldom alone.

#[path = "../tests/steps/damped_sinusoid/mod.rs"]
mod damped_sinusoid;

use damped_sinusoid::{draw, scaled_mse, Draws, Scaling, BINS};
use nalgebra::{DMatrix, DVector};
use nix::sys::resource::{getrusage, UsageWho};
use nix::sys::time::{TimeVal, TimeValLike};
use std::hint::black_box;
use yawrig_train::{forward, train, Options, Precision, Samples, Shape, Silent};

/// Seconds this process has spent on processors, all threads.
fn processor_seconds() -> f64 {
    let usage = getrusage(UsageWho::RUSAGE_SELF).expect("a process knows its own usage");
    let seconds = |t: TimeVal| t.num_microseconds() as f64 * 1e-6;
    seconds(usage.user_time()) + seconds(usage.system_time())
}

fn best_of(repeats: usize, mut work: impl FnMut()) -> f64 {
    let time = |_| {
        let start = processor_seconds();
        work();
        processor_seconds() - start
    };
    (0..repeats).map(time).fold(f64::INFINITY, f64::min)
}

/// The last `d` features of these draws.
fn set(draws: &Draws, scaling: &Scaling, d: usize) -> Samples {
    let (all, n) = (scaling.inputs(draws), draws.truth.len());
    let inputs = all.chunks_exact(BINS + 1).flat_map(|row| &row[BINS + 1 - d..]).copied().collect();
    Samples { inputs, targets: scaling.targets(draws), n, d, k: 2 }
}

/// One epoch without any of the structure: the whole Jacobian, J'J, two factors, one inverse.
struct Dense {
    shape: Shape,
    topology: Vec<usize>,
    jacobian: DMatrix<f64>,
    h: DMatrix<f64>,
}

impl Dense {
    fn epoch(&mut self, set: &Samples, w: &[f64]) {
        let layers = self.shape.layers();
        for s in 0..set.n {
            // Activations of this sample, the bias's one first.
            let mut z = vec![vec![1.0; 1]];
            z[0].extend_from_slice(&set.inputs[s * set.d..][..set.d]);
            for layer in 0..layers - 1 {
                let part = &self.topology[..layer + 2];
                let a = forward(
                    part,
                    &w[..self.shape.block(layer).end],
                    &set.inputs[s * set.d..][..set.d],
                );
                let mut next = vec![1.0];
                next.extend(a.iter().map(|a| a.tanh()));
                z.push(next);
            }
            for o in 0..set.k {
                let row = s * set.k + o;
                let mut delta = vec![0.0; set.k];
                delta[o] = 1.0;
                for layer in (0..layers).rev() {
                    let (block, nodes) = (self.shape.block(layer), self.shape.nodes(layer));
                    for (i, z) in z[layer].iter().enumerate() {
                        for (j, delta) in delta.iter().enumerate() {
                            // Parameters down the columns: a sample's row is contiguous.
                            self.jacobian[(block.start + i * nodes + j, row)] = z * delta;
                        }
                    }
                    let through = |i: usize| -> f64 {
                        let weights = &w[block.start + i * nodes..][..nodes];
                        let sum: f64 = weights.iter().zip(&delta).map(|(w, d)| w * d).sum();
                        sum * (1.0 - z[layer][i] * z[layer][i])
                    };
                    delta = (1..z[layer].len()).map(through).collect();
                }
            }
        }
        let j = &self.jacobian;
        self.h.gemm(1.0, j, &j.transpose(), 0.0);
        for i in 0..self.h.nrows() {
            self.h[(i, i)] += 1.0;
        }
        let step = self.h.clone().cholesky().expect("positive");
        let prior = self.h.clone().cholesky().expect("positive");
        black_box((step.solve(&DVector::zeros(self.h.nrows())), prior.inverse()));
    }
}

fn row(what: &str, milliseconds: f64) {
    println!("  {what:<58} {milliseconds:>9.3} ms an epoch");
}

fn compare(hidden: &[usize], set: &Samples, epochs: usize, repeats: usize) {
    let mut options = Options { hidden: hidden.to_vec(), epochs, ..Options::default() };
    let topology = options.topology(set);
    let shape = Shape::new(&topology);
    println!("{topology:?}, {} samples, {} parameters, {epochs} epochs", set.n, shape.parameters());
    let mut weights = Vec::new();
    for precision in [Precision::Shared, Precision::PerOutput] {
        options.precision = precision;
        let mut done = 0;
        let seconds = best_of(repeats, || {
            let trained = train(set, &options, &mut Silent).expect("trains");
            (done, weights) = (trained.epochs, trained.weights);
        });
        row(
            &format!("ours, {precision:?} ({done} epochs in {seconds:.3} s)"),
            seconds / done as f64 * 1e3,
        );
    }
    let p = shape.parameters();
    let mut dense = Dense {
        shape: shape.clone(),
        topology,
        jacobian: DMatrix::zeros(p, set.n * set.k),
        h: DMatrix::zeros(p, p),
    };
    let seconds = best_of(10, || dense.epoch(set, &weights));
    row("dense: whole Jacobian, J'J, two factors, an inverse", seconds * 1e3);
    let pairs = |n: usize| n * (n + 1) / 2;
    let inputs = DMatrix::from_fn(set.n, pairs(set.d + 1), |s, i| ((s * 7 + i) as f64).sin());
    let nodes = DMatrix::from_fn(set.n, pairs(hidden[0]), |s, i| ((s * 5 + i) as f64).cos());
    let mut product = DMatrix::zeros(nodes.ncols(), inputs.ncols());
    let seconds = best_of(20, || {
        for _ in 0..20 {
            product.gemm(1.0, &nodes.transpose(), &inputs, 0.0);
            black_box(&product);
        }
    });
    row("floor: the first layer's product alone", seconds / 20.0 * 1e3);
}

fn main() {
    let draws = draw(250, 0.0, 1);
    let scaling = Scaling::new(&draws);
    let noise_free = set(&draws, &scaling, 41);
    compare(&[6], &noise_free, 1000, 15);
    let noisy = draw(1000, 0.02, 1);
    compare(&[20, 5], &set(&noisy, &Scaling::new(&noisy), 32), 200, 3);

    println!("[41, 6, 2] on 250 noise-free samples, 2000 others for the test");
    let test = set(&draw(2000, 0.0, 2), &scaling, 41);
    for epochs in [30, 60, 100, 200, 1000] {
        let options = Options { epochs, ..Options::default() };
        let trained = train(&noise_free, &options, &mut Silent).expect("trains");
        let topology = options.topology(&test);
        let [wn, zeta] = scaled_mse(&test.targets, |s| {
            forward(&topology, &trained.weights, &test.inputs[s * test.d..][..test.d])
        });
        println!("  {epochs:>4} epochs: test MSE wn {wn:.1e} rad2/s2, zeta {zeta:.1e}");
    }
}
