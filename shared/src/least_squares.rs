//! Weighted least squares for a handful of unknowns: normal equations, solved by their Cholesky factor.
//! (By hand: to compile nalgebra's costs each processor more than all of this crate.)

pub(crate) struct Equations<const N: usize> {
    /// Lower triangle.
    left: [[f32; N]; N],
    right: [f32; N],
}

impl<const N: usize> Equations<N> {
    pub fn new() -> Self {
        Self { left: [[0.0; N]; N], right: [0.0; N] }
    }

    /// One more observation: `value` is the product of `row` and the unknowns.
    #[inline(always)]
    pub fn add(&mut self, row: [f32; N], value: f32, weight: f32) {
        for i in 0..N {
            let weighted = row[i] * weight;
            for (sum, x) in self.left[i].iter_mut().zip(&row).take(i + 1) {
                *sum += weighted * x;
            }
            self.right[i] += weighted * value;
        }
    }

    /// The unknowns; none where they are not all determined.
    pub fn solve(self) -> Option<[f32; N]> {
        let Self { left: mut l, right: mut x } = self;
        for j in 0..N {
            for k in 0..j {
                let factor = l[j][k];
                for row in &mut l[j..] {
                    row[j] -= factor * row[k];
                }
            }
            // Not a number, too, is no pivot.
            if l[j][j].partial_cmp(&0.0) != Some(core::cmp::Ordering::Greater) {
                return None;
            }
            let pivot = libm::sqrtf(l[j][j]);
            l[j][j] = pivot;
            for row in &mut l[j + 1..] {
                row[j] /= pivot;
            }
        }
        for i in 0..N {
            for k in 0..i {
                x[i] -= l[i][k] * x[k];
            }
            x[i] /= l[i][i];
        }
        for i in (0..N).rev() {
            let known: f32 = (i + 1..N).map(|k| l[k][i] * x[k]).sum();
            x[i] = (x[i] - known) / l[i][i];
        }
        Some(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A parabola through points that are on it but for one, whose weight is nothing.
    #[test]
    fn what_lies_on_a_parabola_gives_its_coefficients() {
        let mut equations = Equations::new();
        for t in [-1.0_f32, -0.5, 0.0, 0.75, 1.0] {
            equations.add([1.0, t, t * t], 3.0 - 2.0 * t + 0.5 * t * t, 1.0 + t * t);
        }
        equations.add([1.0, 2.0, 4.0], 100.0, 0.0);
        let solved = equations.solve().expect("three unknowns, five points");
        for (solved, is) in solved.into_iter().zip([3.0, -2.0, 0.5]) {
            assert!((solved - is).abs() < 1e-5, "{solved} for {is}");
        }
    }

    #[test]
    fn one_point_determines_no_parabola() {
        let mut equations = Equations::new();
        equations.add([1.0; 3], 1.0, 1.0);
        assert_eq!(equations.solve(), None);
        let mut equations = Equations::new();
        equations.add([f32::NAN], 1.0, 1.0);
        assert_eq!(equations.solve(), None);
    }
}
