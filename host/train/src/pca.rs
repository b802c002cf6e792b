//! Principal components of a training set's inputs (thesis 5.2, appendix D), found once, on the training
//! set alone, and scaled for the network.
//!
//! A component is a weighted sum of inputs, so projection and scaling are a layer that does not bend:
//! [`Projection::layer`] is that layer, which a frozen network carries before its own. Ten components of 41
//! inputs are 420 weights (1.7 kB of the device's 4 kB for weights). Those of a whole record, 32 of 160
//! points, would be 5152 (20.6 kB) beside the network's 777; the record itself the device holds anyway.

use nalgebra::{DMatrix, SymmetricEigen};

/// How components are brought to about -1 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// One factor for all: a component keeps the size its variance gives it.
    #[default]
    Common,
    /// Each from its own least and largest value (thesis D.3): those of little variance, noise among them,
    /// become as large as the others.
    Each,
}

/// From inputs to scaled components.
#[derive(Clone, Debug, PartialEq)]
pub struct Projection {
    /// Number of inputs.
    d: usize,
    /// Means of the inputs.
    mean: Vec<f64>,
    /// A row of `d` for each component: unit vectors, the entry of largest magnitude positive.
    components: Vec<f64>,
    offset: Vec<f64>,
    gain: Vec<f64>,
    /// Variance of every component, those left out too, largest first.
    pub variances: Vec<f64>,
}

impl Projection {
    /// The first `count` components of `inputs`, row-major with `d` columns.
    ///
    /// `None` where there are fewer than two rows, `count` is zero or more than `d`, or a component does
    /// not vary.
    pub fn new(inputs: &[f64], d: usize, count: usize, scale: Scale) -> Option<Self> {
        let n = inputs.len() / d;
        if n < 2 || count == 0 || count > d {
            return None;
        }
        let mut centred = DMatrix::from_row_slice(n, d, inputs);
        let mean: Vec<f64> = (0..d).map(|j| centred.column(j).mean()).collect();
        for (j, mean) in mean.iter().enumerate() {
            centred.column_mut(j).add_scalar_mut(-mean);
        }
        let eigen = SymmetricEigen::new(centred.tr_mul(&centred) / (n - 1) as f64);
        let mut order: Vec<usize> = (0..d).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let mut components = Vec::with_capacity(count * d);
        for &at in &order[..count] {
            let vector = eigen.eigenvectors.column(at);
            // Either sign is a component; the same one is wanted every time.
            let sign = vector[vector.icamax()].signum();
            components.extend(vector.iter().map(|v| sign * v));
        }
        let variances = order.iter().map(|&at| eigen.eigenvalues[at].max(0.0)).collect();
        let (offset, gain) = (vec![0.0; count], vec![1.0; count]);
        let mut projection = Self { d, mean, components, offset, gain, variances };
        let values = projection.apply(inputs);
        let column = |c: usize| values.iter().skip(c).step_by(count).copied();
        let largest = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        for c in 0..count {
            let (low, high) =
                column(c).fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
            (projection.offset[c], projection.gain[c]) = match scale {
                Scale::Common => (0.0, 1.0 / largest),
                Scale::Each => (0.5 * (low + high), 2.0 / (high - low)),
            };
        }
        projection.gain.iter().all(|g| g.is_finite()).then_some(projection)
    }

    /// Number of components kept.
    pub fn count(&self) -> usize {
        self.gain.len()
    }

    /// Share of the inputs' variance that the first `count` components hold.
    pub fn explained(&self, count: usize) -> f64 {
        self.variances[..count].iter().sum::<f64>() / self.variances.iter().sum::<f64>()
    }

    /// Scaled components of row-major inputs, row-major.
    pub fn apply(&self, inputs: &[f64]) -> Vec<f64> {
        let component = |row: &[f64], c: usize| {
            let axis = &self.components[c * self.d..][..self.d];
            let value: f64 =
                axis.iter().zip(row).zip(&self.mean).map(|((a, x), mean)| a * (x - mean)).sum();
            (value - self.offset[c]) * self.gain[c]
        };
        inputs
            .chunks_exact(self.d)
            .flat_map(|row| (0..self.count()).map(move |c| component(row, c)))
            .collect()
    }

    /// The same as weights: (inputs + 1) rows of a column for each component, row 0 the biases.
    pub fn layer(&self) -> Vec<f64> {
        let count = self.count();
        let mut layer = vec![0.0; (self.d + 1) * count];
        for c in 0..count {
            let axis = &self.components[c * self.d..][..self.d];
            let centre: f64 = axis.iter().zip(&self.mean).map(|(a, mean)| a * mean).sum();
            layer[c] = -self.gain[c] * (centre + self.offset[c]);
            for (i, a) in axis.iter().enumerate() {
                layer[(i + 1) * count + c] = self.gain[c] * a;
            }
        }
        layer
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::forward;

    /// Three columns of a plane, its long axis along (2, -2, 1)/3, plus a mean.
    fn plane() -> Vec<f64> {
        (0..200)
            .flat_map(|i| {
                let (a, b) = ((i as f64 * 0.7).sin() * 3.0, (i as f64 * 1.3).cos());
                [
                    5.0 + a * 2.0 / 3.0 + b / 3.0,
                    1.0 - a * 2.0 / 3.0 + b * 2.0 / 3.0,
                    a / 3.0 + b * 2.0 / 3.0,
                ]
            })
            .collect()
    }

    #[test]
    fn finds_the_axes_of_a_plane_with_the_larger_entry_positive() {
        let projection = Projection::new(&plane(), 3, 2, Scale::Common).unwrap();
        let expected = [[2.0, -2.0, 1.0], [1.0, 2.0, 2.0]];
        for (c, axis) in expected.iter().enumerate() {
            // The two directions are only nearly uncorrelated in these 200 rows.
            let cosine: f64 =
                (0..3).map(|i| projection.components[c * 3 + i] * axis[i] / 3.0).sum();
            assert!(cosine.abs() > 0.999, "{c}: {cosine}");
            let largest = projection.components[c * 3..][..3]
                .iter()
                .copied()
                .max_by(|a, b| a.abs().total_cmp(&b.abs()))
                .unwrap();
            assert!(largest > 0.0);
        }
        assert!((projection.explained(2) - 1.0).abs() < 1e-12);
        assert!((projection.variances[0] / projection.variances[1] - 9.0).abs() < 0.5);
    }

    #[test]
    fn components_are_uncorrelated_and_scaled() {
        for scale in [Scale::Common, Scale::Each] {
            let projection = Projection::new(&plane(), 3, 2, scale).unwrap();
            let values = projection.apply(&plane());
            assert!(values.iter().all(|v| v.abs() <= 1.0 + 1e-12));
            let mean = |c: usize| values.iter().skip(c).step_by(2).sum::<f64>() / 200.0;
            let product: f64 =
                values.chunks_exact(2).map(|v| (v[0] - mean(0)) * (v[1] - mean(1))).sum();
            assert!(product.abs() < 1e-10, "{scale:?}: {product}");
        }
    }

    #[test]
    fn its_layer_gives_the_same_components() {
        for scale in [Scale::Common, Scale::Each] {
            let inputs = plane();
            let projection = Projection::new(&inputs, 3, 2, scale).unwrap();
            let layer = projection.layer();
            for row in inputs.chunks_exact(3) {
                let projected = projection.apply(row);
                for (a, b) in forward(&[3, 2], &layer, row).iter().zip(&projected) {
                    assert!((a - b).abs() < 1e-12, "{a} {b}");
                }
            }
        }
    }

    #[test]
    fn refuses_what_has_no_such_components() {
        assert_eq!(Projection::new(&plane(), 3, 4, Scale::Common), None);
        assert_eq!(Projection::new(&plane(), 3, 0, Scale::Common), None);
        assert_eq!(Projection::new(&[1.0, 2.0, 3.0], 3, 1, Scale::Common), None);
        assert_eq!(Projection::new(&[1.0; 30], 3, 1, Scale::Each), None);
    }
}
