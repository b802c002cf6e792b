//! Where training starts: Nguyen and Widrow (1990).

use super::network::Shape;
use rand::Rng;

/// Start weights for inputs in [-1, 1].
///
/// Each hidden node gets a random direction of length `0.7 nodes^(1/inputs)` and a bias that spreads
/// the nodes' active regions evenly over the input range; the output layer starts uniform in [-0.5, 0.5].
pub(super) fn nguyen_widrow(shape: &Shape, rng: &mut impl Rng) -> Vec<f64> {
    let mut w = vec![0.0; shape.parameters()];
    let last = shape.layers() - 1;
    for layer in 0..last {
        let (rows, nodes) = (shape.rows(layer), shape.nodes(layer));
        let block = &mut w[shape.block(layer)];
        let length = 0.7 * (nodes as f64).powf(1.0 / (rows - 1) as f64);
        for j in 0..nodes {
            let direction: Vec<f64> = (1..rows).map(|_| rng.random_range(-1.0..=1.0)).collect();
            let norm = direction.iter().map(|v| v * v).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
            for (i, v) in direction.iter().enumerate() {
                block[(1 + i) * nodes + j] = v / norm * length;
            }
            let place = if nodes > 1 { 2.0 * j as f64 / (nodes - 1) as f64 - 1.0 } else { 0.0 };
            block[j] = length * place;
        }
    }
    w[shape.block(last)].iter_mut().for_each(|w| *w = rng.random_range(-0.5..=0.5));
    w
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn nodes_have_one_length_and_spread_biases() {
        let shape = Shape::new(&[3, 5, 2]);
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let w = nguyen_widrow(&shape, &mut rng);
        let length = 0.7 * 5f64.powf(1.0 / 3.0);
        for j in 0..5 {
            let norm = (1..4).map(|i| w[i * 5 + j].powi(2)).sum::<f64>().sqrt();
            assert!((norm - length).abs() < 1e-14);
            assert!((w[j] - length * (j as f64 - 2.0) / 2.0).abs() < 1e-14);
        }
        assert!(w[shape.block(1)].iter().all(|w| w.abs() <= 0.5));
    }
}
