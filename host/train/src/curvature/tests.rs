use super::*;
use crate::network::tests::problem;

/// The derivative of every output of every sample, one row each, by central differences.
fn jacobian(shape: &Shape, inputs: &[f64], n: usize, w: &[f64], o: usize) -> Matrix {
    let step = 1e-5;
    let targets = vec![0.0; n * shape.outputs()];
    let mut pass = Pass::new(shape, inputs, n);
    let mut jacobian = Matrix::zeros(n, w.len());
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

fn agrees(topology: &[usize], n: usize) {
    let (shape, inputs, targets, w) = problem(topology, n, 5);
    let beta: Vec<f64> = (0..shape.outputs()).map(|o| 0.7 + 1.9 * o as f64).collect();
    let mut pass = Pass::new(&shape, &inputs, n);
    pass.run(&shape, &w, &targets);
    let mut curvature = Curvature::new(&shape, &pass);
    let p = shape.parameters();
    let (mut h, mut gradient) = (Matrix::zeros(p, p), vec![0.0; p]);
    curvature.sensitivities(&shape, &pass, &w);
    // Twice: scratch left from a first use must not show.
    for _ in 0..2 {
        curvature.assemble(&shape, &pass, &beta, &mut h);
        curvature.gradient(&shape, &pass, &pass.error, &beta, &mut gradient);
    }
    let (mut dense, mut slope) = (Matrix::zeros(p, p), vec![0.0; p]);
    for (o, &beta) in beta.iter().enumerate() {
        let j = jacobian(&shape, &inputs, n, &w, o);
        let own = j.tr_mul(&j);
        let trace: f64 = (0..p).map(|i| own[(i, i)]).sum();
        assert!((curvature.trace(&shape, &pass, o) - trace).abs() < 1e-8 * trace);
        dense += beta * &own;
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
        agrees(topology, 11);
    }
}

#[test]
fn agrees_beyond_one_chunk() {
    for n in [CHUNK, 2 * CHUNK + 3] {
        agrees(&[3, 3, 3, 2], n);
    }
}
