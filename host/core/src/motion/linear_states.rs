//! States of a user's own effects whose equations are linear in yaw angle, yaw rate and states: with the plain
//! model one linear system, whose course is known in closed form. What other effects do beside it is left out here.

use super::oscillator::Motion;
use super::own_effects::{Own, States};
use super::piece::Piece;
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

/// Rounds in which the slow motion is looked for: each is nearer by the share that the states have in it.
const ROUNDS: usize = 60;

/// The plain model with the states: x' = slopes x + constant, x being yaw angle, yaw rate and states.
pub(super) struct Linear {
    slopes: DMatrix<f64>,
    constant: DVector<f64>,
    /// Of them, what the effects do: moment over Izz by each of x, and where they are zero, rad/s2.
    moment: (DVector<f64>, f64),
}

impl Linear {
    /// `None` where no own effect has states, or one that has them is not linear; or their numbers are none.
    pub(super) fn new(motion: &Motion) -> Option<Self> {
        let with_states = || motion.terms.own().iter().filter(|own| !own.effect.states.is_empty());
        if with_states().next().is_none() || !with_states().all(|own| own.effect.is_linear()) {
            return None;
        }
        let own = Own::of_those(motion, |own| !own.effect.states.is_empty());
        let (wn, n) = (motion.natural_frequency_rad_s, 2 + own.count);
        // Signs of rate and angle are not in it.
        let piece = Piece::at([0.0; 2], 0.0);
        let own_at = |x: &DVector<f64>| {
            let mut z = States::default();
            z[..n - 2].copy_from_slice(&x.as_slice()[2..]);
            let at = [x[0], x[1], 0.0];
            (own.moment(at, piece, &z), own.rates(at, piece, &z))
        };
        let (at_zero, rates) = own_at(&DVector::zeros(n));
        let mut constant = DVector::zeros(n);
        constant[1] = motion.terms.constant_moment_rad_s2 + at_zero;
        constant.rows_mut(2, n - 2).copy_from_slice(&rates[..n - 2]);
        let mut slopes = DMatrix::zeros(n, n);
        slopes[(0, 1)] = 1.0;
        slopes[(1, 0)] = -wn * wn;
        slopes[(1, 1)] = -2.0 * motion.damping_ratio * wn;
        let mut by = DVector::zeros(n);
        for j in 0..n {
            let mut x = DVector::zeros(n);
            x[j] = 1.0;
            let (moment, rates) = own_at(&x);
            by[j] = moment - at_zero;
            (2..n).for_each(|i| slopes[(i, j)] = rates[i - 2] - constant[i]);
        }
        let with_moment = slopes.row(1) + by.transpose();
        slopes.row_mut(1).copy_from(&with_moment);
        let is_finite = slopes.iter().chain(&constant).chain(&by).all(|x| x.is_finite());
        is_finite.then_some(Self { slopes, constant, moment: (by, at_zero) })
    }

    fn count(&self) -> usize {
        self.slopes.nrows() - 2
    }

    /// The states of a model that has swung for long, at this angle and rate: those of the slow motion, in which
    /// they are in proportion to what angle and rate are from rest. `None` where there is none.
    pub(super) fn swinging(&self, [yaw_rad, rate_rad_s]: [f64; 2]) -> Option<States> {
        let k = self.count();
        let rest = self.slopes.clone().lu().solve(&-&self.constant)?;
        let block = |at, size| self.slopes.view(at, size).into_owned();
        let (own, by_states) = (block((0, 0), (2, 2)), block((0, 2), (2, k)));
        let (driven, states) = (block((2, 0), (k, 2)), block((2, 2), (k, k)));
        // States z = s x obey states s + driven = s (own + by_states s).
        let mut s = DMatrix::zeros(k, 2);
        for _ in 0..ROUNDS {
            let motion = &own + &by_states * &s;
            let known = DMatrix::identity(2, 2).kronecker(&states)
                - motion.transpose().kronecker(&DMatrix::identity(k, k));
            let next = known.lu().solve(&DVector::from_column_slice((-&driven).as_slice()))?;
            let next = DMatrix::from_column_slice(k, 2, next.as_slice());
            let moved = (&next - &s).amax();
            s = next;
            if moved <= 1e-14 * s.amax() {
                let off = DVector::from_vec(vec![yaw_rad - rest[0], rate_rad_s - rest[1]]);
                let mut out = States::default();
                out[..k].copy_from_slice((rest.rows(2, k) + &s * off).as_slice());
                return Some(out);
            }
        }
        None
    }

    /// Angle and rate `back_s` before those of `motion`, where its states were `held` for the angle; and how these
    /// two depend on angle and rate now, rates over the natural frequency.
    pub(super) fn begun(
        &self,
        motion: &Motion,
        back_s: f64,
        held: &dyn Fn(f64) -> States,
    ) -> Option<([f64; 2], Matrix2<f64>)> {
        let (n, k) = (self.slopes.nrows(), self.count());
        let mut all = DMatrix::zeros(n + 1, n + 1);
        all.view_mut((0, 0), (n, n)).copy_from(&self.slopes);
        all.view_mut((0, n), (n, 1)).copy_from(&self.constant);
        let course = (all * back_s).exp();
        let at = |yaw_rad: f64| DVector::from_column_slice(&held(yaw_rad)[..k]);
        let states = at(0.0);
        let reach_rad = motion.amplitude_rad();
        let by_angle = at(reach_rad) - &states;
        let by_states = course.view((0, 2), (2, k));
        let own = course.fixed_view::<2, 2>(0, 0).into_owned();
        let of_angle = by_states * by_angle / reach_rad;
        let all = own + Matrix2::new(of_angle[0], 0.0, of_angle[1], 0.0);
        let given = by_states * states;
        let off = Vector2::new(
            motion.yaw_rad - given[0] - course[(0, n)],
            motion.rate_rad_s - given[1] - course[(1, n)],
        );
        let back = all.try_inverse()?;
        let began = back * off;
        let wn = motion.natural_frequency_rad_s;
        let scaled = Matrix2::new(back[(0, 0)], back[(0, 1)] * wn, back[(1, 0)] / wn, back[(1, 1)]);
        let is_finite = began.iter().chain(&scaled).all(|x| x.is_finite());
        is_finite.then(|| ([began[0], began[1]], scaled))
    }
}

/// States on the way, by half steps along which the plain model moves: the moment that they make is a kick between
/// two.
pub(super) struct Late {
    z: States,
    count: usize,
    /// Of the moment: by angle, by rate, by each state, and where all are zero.
    moment: ([f64; 2], States, f64),
    /// After a half step each state: by each state, then by deflection, rate and middle, and from nothing.
    half: Vec<(States, [f64; 4])>,
}

impl Late {
    /// Of a motion whose `own` states are these at first; steps of twice `half_s`.
    pub(super) fn new(motion: &Motion, z: States, half_s: f64) -> Option<Self> {
        let linear = Linear::new(motion)?;
        let (k, wn) = (linear.count(), motion.natural_frequency_rad_s);
        // Deflection, rate, states, middle, one.
        let mut all = DMatrix::zeros(k + 4, k + 4);
        all[(0, 1)] = 1.0;
        all[(1, 0)] = -wn * wn;
        all[(1, 1)] = -2.0 * motion.damping_ratio * wn;
        for i in 2..k + 2 {
            (0..k + 2).for_each(|j| all[(i, j)] = linear.slopes[(i, j)]);
            all[(i, k + 2)] = linear.slopes[(i, 0)];
            all[(i, k + 3)] = linear.constant[i];
        }
        let course = (all * half_s).exp();
        let row = |i: usize| {
            let mut by_states = States::default();
            (0..k).for_each(|j| by_states[j] = course[(i, j + 2)]);
            (by_states, [0, 1, k + 2, k + 3].map(|j| course[(i, j)]))
        };
        let (by, at_zero) = linear.moment;
        let mut by_states = States::default();
        by_states[..k].copy_from_slice(&by.as_slice()[2..]);
        Some(Self {
            z,
            count: k,
            moment: ([by[0], by[1]], by_states, at_zero),
            half: (2..k + 2).map(row).collect(),
        })
    }

    /// Over Izz, rad/s2.
    #[inline]
    pub(super) fn moment(&self, b: f64, r: f64) -> f64 {
        let ([by_b, by_r], by_states, at_zero) = &self.moment;
        let states: f64 = (0..self.count).map(|k| by_states[k] * self.z[k]).sum();
        at_zero + by_b * b + by_r * r + states
    }

    /// Half a step on from this deflection and rate about a middle.
    #[inline]
    pub(super) fn go(&mut self, deflection: f64, r: f64, middle: f64) {
        let before = self.z;
        for ((by_states, [by_b, by_r, by_middle, rest]), z) in self.half.iter().zip(&mut self.z) {
            let states: f64 = (0..self.count).map(|k| by_states[k] * before[k]).sum();
            *z = states + by_b * deflection + by_r * r + by_middle * middle + rest;
        }
    }
}
