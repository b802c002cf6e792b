//! States of a user's own effects whose equations are linear in yaw angle, yaw rate and states: with the plain
//! model one linear system, whose course is known in closed form. What other effects do beside it is left out here.

use super::oscillator::Motion;
use super::own_effects::States;
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

/// Rounds in which the slow motion is looked for: each is nearer by the share that the states have in it.
const ROUNDS: usize = 60;
/// Change of a round, of the whole, after which there is no further one: far below the steps of a fit.
const SETTLED: f64 = 1e-12;

/// The plain model with the states: x' = slopes x + constant, x being yaw angle, yaw rate and states.
pub(super) struct Linear {
    slopes: DMatrix<f64>,
    constant: DVector<f64>,
}

impl Linear {
    /// `None` where no own effect has states, or one that has them is not linear; or their numbers are none.
    pub(super) fn new(motion: &Motion) -> Option<Self> {
        let terms = motion.terms.with_states_alone();
        if terms.own().is_empty() || !terms.own().iter().all(|own| own.effect.is_linear()) {
            return None;
        }
        let n = 2 + terms.own().iter().map(|own| own.effect.states.len()).sum::<usize>();
        let alone = Motion { terms, ..motion.clone() };
        let at = |x: DVector<f64>| DVector::from_vec(alone.slope(0.0, x.as_slice()));
        let constant = at(DVector::zeros(n));
        let by = |j: usize| at(DVector::from_fn(n, |i, _| f64::from(u8::from(i == j)))) - &constant;
        let slopes = DMatrix::from_columns(&(0..n).map(by).collect::<Vec<_>>());
        let is_finite = slopes.iter().chain(&constant).all(|x| x.is_finite());
        is_finite.then_some(Self { slopes, constant })
    }

    fn count(&self) -> usize {
        self.slopes.nrows() - 2
    }

    /// What states `s` x add to the slopes of x, angle and rate.
    fn by_states(&self, s: &DMatrix<f64>) -> Matrix2<f64> {
        let by_states = self.slopes.view((0, 2), (2, self.count()));
        (by_states * s).fixed_view::<2, 2>(0, 0).into_owned()
    }

    /// The states z = s x where x' = motion x: they obey states s + driven = s motion.
    fn states_in(&self, motion: &Matrix2<f64>) -> Option<DMatrix<f64>> {
        let k = self.count();
        let block = |at, size| self.slopes.view(at, size).into_owned();
        let (driven, states) = (block((2, 0), (k, 2)), block((2, 2), (k, k)));
        let known = DMatrix::identity(2, 2).kronecker(&states)
            - motion.transpose().kronecker(&DMatrix::identity(k, k));
        let s = known.lu().solve(&DVector::from_column_slice((-&driven).as_slice()))?;
        Some(DMatrix::from_column_slice(k, 2, s.as_slice()))
    }

    /// The motion of a model that has swung for long. `None` where there is none.
    pub(super) fn slow(&self) -> Option<Slow> {
        let k = self.count();
        let rest = self.slopes.clone().lu().solve(&-&self.constant)?;
        let own = self.slopes.fixed_view::<2, 2>(0, 0).into_owned();
        let mut s = DMatrix::zeros(k, 2);
        for _ in 0..ROUNDS {
            let motion = own + self.by_states(&s);
            let next = self.states_in(&motion)?;
            let moved = (&next - &s).amax();
            s = next;
            if moved <= SETTLED * s.amax() {
                return Some(Slow { rest, states: s, motion });
            }
        }
        None
    }

    /// Angle and rate `back_s` before those of `motion`, where its states were `held` for the angle.
    pub(super) fn begun(
        &self,
        motion: &Motion,
        back_s: f64,
        held: &dyn Fn(f64) -> States,
    ) -> Option<Began> {
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
        began(back * off, back, motion)
    }
}

impl Motion {
    /// By angle and by rate, the acceleration of a model that has swung for long: spring and damper with what linear
    /// states of own effects add to them, 1/s2 and 1/s. `None` without any.
    pub(crate) fn slow_slopes(&self) -> Option<[f64; 2]> {
        let Slow { motion, .. } = Linear::new(self)?.slow()?;
        Some([motion[(1, 0)], motion[(1, 1)]])
    }

    /// The natural frequency, rad/s, and damping ratio with which those are the [`Self::slow_slopes`].
    pub(crate) fn of_slow_slopes(&self, [by_angle, by_rate]: [f64; 2]) -> Option<[f64; 2]> {
        let linear = Linear::new(self)?;
        let motion = Matrix2::new(0.0, 1.0, by_angle, by_rate);
        let added = linear.by_states(&linear.states_in(&motion)?);
        let (wn, zeta) = (self.natural_frequency_rad_s, self.damping_ratio);
        let of_moment = [linear.slopes[(1, 0)] + wn * wn, linear.slopes[(1, 1)] + 2.0 * zeta * wn];
        let square = of_moment[0] + added[(1, 0)] - by_angle;
        let twice = of_moment[1] + added[(1, 1)] - by_rate;
        let wn = square.sqrt();
        let found = [wn, twice / (2.0 * wn)];
        found.iter().all(|number| number.is_finite()).then_some(found)
    }
}

/// A beginning, and how it depends on the end: rates over the natural frequency. `None` where it is no number.
pub(super) type Began = ([f64; 2], Matrix2<f64>);

fn began(state: Vector2<f64>, back: Matrix2<f64>, motion: &Motion) -> Option<Began> {
    let wn = motion.natural_frequency_rad_s;
    let scaled = Matrix2::new(back[(0, 0)], back[(0, 1)] * wn, back[(1, 0)] / wn, back[(1, 1)]);
    let is_finite = state.iter().chain(&scaled).all(|x| x.is_finite());
    is_finite.then(|| ([state[0], state[1]], scaled))
}

/// The motion in which the states are in proportion to what angle and rate are from rest.
pub(super) struct Slow {
    /// Of angle, rate and states.
    rest: DVector<f64>,
    /// By angle and rate.
    states: DMatrix<f64>,
    /// Slopes of angle and rate.
    motion: Matrix2<f64>,
}

impl Slow {
    fn beside_rest(&self, motion: &Motion) -> Vector2<f64> {
        Vector2::new(motion.yaw_rad - self.rest[0], motion.rate_rad_s - self.rest[1])
    }

    /// The states at angle and rate of `motion`.
    pub(super) fn states(&self, motion: &Motion) -> States {
        let k = self.states.nrows();
        let mut out = States::default();
        let states = self.rest.rows(2, k) + &self.states * self.beside_rest(motion);
        out[..k].copy_from_slice(states.as_slice());
        out
    }

    /// Angle and rate `back_s` before those of `motion`.
    pub(super) fn begun(&self, motion: &Motion, back_s: f64) -> Option<Began> {
        let back = (self.motion * -back_s).exp();
        let rest = Vector2::new(self.rest[0], self.rest[1]);
        began(rest + back * self.beside_rest(motion), back, motion)
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
    /// Of a `motion` that begins at `start_s`, in steps of twice `half_s`. `None` where it has other states.
    pub(super) fn new(motion: &Motion, start_s: f64, half_s: f64) -> Option<Self> {
        let Linear { slopes, constant } = Linear::new(motion)?;
        let (k, wn) = (slopes.nrows() - 2, motion.natural_frequency_rad_s);
        let plain = [-wn * wn, -2.0 * motion.damping_ratio * wn];
        // Deflection, rate, states, middle, one.
        let mut all = DMatrix::zeros(k + 4, k + 4);
        all.view_mut((0, 0), (k + 2, k + 2)).copy_from(&slopes);
        all.row_mut(1).fill(0.0);
        (all[(1, 0)], all[(1, 1)]) = (plain[0], plain[1]);
        all.view_mut((2, k + 2), (k, 1)).copy_from(&slopes.view((2, 0), (k, 1)));
        all.view_mut((2, k + 3), (k, 1)).copy_from(&constant.rows(2, k));
        let course = (all * half_s).exp();
        let by_states = |matrix: &DMatrix<f64>, row: usize| {
            let mut out = States::default();
            (0..k).for_each(|j| out[j] = matrix[(row, j + 2)]);
            out
        };
        let row = |i: usize| (by_states(&course, i), [0, 1, k + 2, k + 3].map(|j| course[(i, j)]));
        Some(Self {
            z: motion.own_states_at(start_s),
            count: k,
            moment: (
                [slopes[(1, 0)] - plain[0], slopes[(1, 1)] - plain[1]],
                by_states(&slopes, 1),
                constant[1] - motion.terms.constant_moment_rad_s2,
            ),
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
    pub(super) fn half_step(&mut self, deflection: f64, r: f64, middle: f64) {
        let before = self.z;
        for ((by_states, [by_b, by_r, by_middle, rest]), z) in self.half.iter().zip(&mut self.z) {
            let states: f64 = (0..self.count).map(|k| by_states[k] * before[k]).sum();
            *z = states + by_b * deflection + by_r * r + by_middle * middle + rest;
        }
    }
}
