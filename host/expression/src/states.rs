//! States of a user's own effect: what a moment that follows another late remembers.
//!
//! Each has an equation of motion, an expression of what the moment may hold and of all states of the effect.
//! At a release it is in balance with the angle at which the model is held, or begins where its file says.

use super::number::Dual;
use super::program::{Program, State, MAX_PARAMETERS};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Most states of one effect.
pub const MAX_STATES: usize = 2;
/// Numbers that a program of an effect takes: its parameters, then its states.
const NUMBERS: usize = MAX_PARAMETERS + MAX_STATES;
/// Most halvings of a stretch over which states are followed.
const MAX_HALVINGS: u32 = 14;
/// Difference of a step and its halves, of the state, above which it is halved.
const COARSE: f64 = 1e-9;
/// Cycles of a swing along which states are followed from a release.
const CYCLES: usize = 4;
/// Points of one of them.
const POINTS: usize = 40;

/// One state of an effect, compiled.
#[derive(Clone, Debug)]
pub struct OwnState {
    pub name: String,
    pub unit: String,
    /// How fast it changes, as written, in one line.
    pub rate: String,
    pub(super) rate_program: Program,
    /// Where it begins; `None`: in balance.
    pub(super) start_program: Option<Program>,
}

/// Numbers of an effect and its states, as its programs take them.
#[inline]
pub(super) fn numbers(parameters: &[f64], z: &[f64]) -> [f64; NUMBERS] {
    let mut out = [0.0; NUMBERS];
    out[..parameters.len()].copy_from_slice(parameters);
    out[parameters.len()..parameters.len() + z.len()].copy_from_slice(z);
    out
}

/// How fast the states `z` change, per s.
pub(super) fn rates<const N: usize>(
    states: &[OwnState],
    parameters: &[f64],
    at: &State<f64>,
    z: &[f64],
) -> [f64; N] {
    let numbers = numbers(parameters, z);
    let mut out = [0.0; N];
    for (out, state) in out.iter_mut().zip(states) {
        *out = state.rate_program.evaluate(at, &numbers);
    }
    out
}

/// The states of a model held at the angle of `held`, at rest; not numbers where they have no balance.
pub(super) fn begun(
    states: &[OwnState],
    parameters: &[f64],
    held: &State<f64>,
) -> [f64; MAX_STATES] {
    let begin = |state: &OwnState| {
        Some(state.start_program.as_ref()?.evaluate(held, &numbers(parameters, &[])))
    };
    let given: Vec<Option<f64>> = states.iter().map(begin).collect();
    let free: Vec<usize> = (0..states.len()).filter(|k| given[*k].is_none()).collect();
    // Where the search for a balance begins: at nothing, at the angle, at its rate.
    let tries = [0.0, held.yaw_rad, held.natural_frequency_rad_s * held.yaw_rad].into_iter();
    let found = tries.filter_map(|from| {
        let mut z = [0.0; MAX_STATES];
        for (z, given) in z.iter_mut().zip(&given) {
            *z = given.unwrap_or(from);
        }
        balance(states, parameters, held, &free, z)
    });
    found.into_iter().next().unwrap_or([f64::NAN; MAX_STATES])
}

/// Newton's method for the states `free` from `z`, its steps halved until the rates fall.
fn balance(
    states: &[OwnState],
    parameters: &[f64],
    held: &State<f64>,
    free: &[usize],
    mut z: [f64; MAX_STATES],
) -> Option<[f64; MAX_STATES]> {
    let count = states.len();
    let rates_at = |z: &[f64]| {
        let all: [f64; MAX_STATES] = rates(states, parameters, held, &z[..count]);
        DVector::from_iterator(free.len(), free.iter().map(|k| all[*k]))
    };
    let constant = |value: f64| Dual { value, slope: 0.0 };
    let dual = State {
        yaw_rad: constant(held.yaw_rad),
        rate_rad_s: constant(held.rate_rad_s),
        time_s: constant(held.time_s),
        natural_frequency_rad_s: constant(held.natural_frequency_rad_s),
        wind_speed_m_s: constant(held.wind_speed_m_s),
        rate_sign: held.rate_sign,
        yaw_sign: held.yaw_sign,
    };
    for _ in 0..60 {
        if free.is_empty() {
            return Some(z);
        }
        let here = rates_at(&z);
        let slope = DMatrix::from_fn(free.len(), free.len(), |i, j| {
            let mut duals = numbers(parameters, &z[..count]).map(constant);
            duals[parameters.len() + free[j]].slope = 1.0;
            states[free[i]].rate_program.evaluate(&dual, &duals).slope
        });
        // A rate that no state changes has no balance, or is one everywhere.
        let step = slope.lu().solve(&(-&here))?;
        if !step.iter().all(|x| x.is_finite()) {
            return None;
        }
        let moved = |share: f64| {
            let mut z = z;
            free.iter().zip(step.iter()).for_each(|(k, step)| z[*k] += share * step);
            z
        };
        let better = |share: &f64| rates_at(&moved(*share)).norm() < here.norm();
        let share = (0..30).map(|n| 0.5f64.powi(n)).find(better);
        let size = free.iter().map(|k| z[*k].abs()).fold(f64::MIN_POSITIVE, f64::max);
        // No step is an improvement on what is zero to the last bit.
        let Some(share) = share else {
            return (step.amax() <= 1e-9 * size || here.norm() == 0.0).then_some(z);
        };
        z = moved(share);
    }
    None
}

/// The states `z` after `h` s, `rates` being how fast they change at a time from now and there: steps of a
/// Runge-Kutta method of order 4, halved until a step and its halves agree. Not numbers where they change too
/// quickly to be followed.
pub fn follow<const N: usize>(
    mut z: [f64; N],
    h: f64,
    rates: &mut dyn FnMut(f64, &[f64; N]) -> [f64; N],
) -> [f64; N] {
    let mut step = |z: &[f64; N], t: f64, h: f64| {
        let at = |w: f64, k: &[f64; N]| std::array::from_fn(|i| z[i] + w * k[i]);
        let k1 = rates(t, z);
        let k2 = rates(t + 0.5 * h, &at(0.5 * h, &k1));
        let k3 = rates(t + 0.5 * h, &at(0.5 * h, &k2));
        let k4 = rates(t + h, &at(h, &k3));
        let end: [f64; N] =
            std::array::from_fn(|i| z[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        (end, k1)
    };
    let mut largest = z.map(f64::abs);
    // In units of the shortest step, so that they add up to the whole.
    let whole = 1u32 << MAX_HALVINGS;
    let (mut done, mut now) = (0, whole);
    let unit = h / f64::from(whole);
    while done < whole {
        let (t, h) = (f64::from(done) * unit, f64::from(now) * unit);
        let (once, slope) = step(&z, t, h);
        let (half, _) = step(&z, t, 0.5 * h);
        let (twice, _) = step(&half, t + 0.5 * h, 0.5 * h);
        let size = |i: usize| largest[i].max(twice[i].abs()).max((h * slope[i]).abs());
        let mut error = (0..N).map(|i| match (once[i] - twice[i]).abs() {
            0.0 => 0.0,
            apart => apart / size(i),
        });
        let good = error.all(|e| e <= COARSE);
        if !good && now > 1 {
            now /= 2;
            continue;
        }
        if !good {
            return [f64::NAN; N];
        }
        z = twice;
        largest = std::array::from_fn(|i| largest[i].max(z[i].abs()));
        done += now;
        // A longer one from where it ends on a multiple of itself.
        if now < whole && done % (2 * now) == 0 {
            now *= 2;
        }
    }
    z
}

/// Where a swing of one amplitude passes from a release on, and the states there: `CYCLES` cycles, the last of
/// them [`last_cycle`].
pub(super) fn swing(
    states: &[OwnState],
    parameters: &[f64],
    amplitude_rad: f64,
    wn_rad_s: f64,
    wind_speed_m_s: f64,
) -> Vec<(State<f64>, [f64; MAX_STATES])> {
    let at = |t: f64| {
        let (s, c) = (wn_rad_s * t).sin_cos();
        State {
            yaw_rad: amplitude_rad * c,
            rate_rad_s: -amplitude_rad * wn_rad_s * s,
            time_s: t,
            natural_frequency_rad_s: wn_rad_s,
            wind_speed_m_s,
            rate_sign: if s > 0.0 { -1.0 } else { 1.0 },
            yaw_sign: if c < 0.0 { -1.0 } else { 1.0 },
        }
    };
    let held = State { rate_rad_s: 0.0, ..at(0.0) };
    let mut z = begun(states, parameters, &held);
    let step_s = TAU / wn_rad_s / POINTS as f64;
    let mut out = Vec::with_capacity(CYCLES * POINTS);
    for k in 0..CYCLES * POINTS {
        // Half a step off the turning points, where signs are definite.
        let from = (k as f64 - 0.5) * step_s;
        let (from, to) = (from.max(0.0), from + step_s);
        z = follow(z, to - from, &mut |t, z| {
            rates(states, parameters, &at(from + t), &z[..states.len()])
        });
        out.push((at(to), z));
    }
    out
}

/// The last cycle of a [`swing`].
pub(super) fn last_cycle<T>(swing: &[T]) -> &[T] {
    &swing[swing.len() - POINTS..]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lag follows a swing by 1 / (1 + i w T) once it has forgotten the release.
    #[test]
    fn what_is_followed_is_the_solution() {
        let (w, lag_s) = (7.0_f64, 0.05);
        let mut z = [1.0];
        let h = 0.8;
        z = follow(z, h, &mut |t, z| [((w * t).cos() - z[0]) / lag_s]);
        let x = w * lag_s;
        let exact = ((w * h).cos() + x * (w * h).sin()) / (1.0 + x * x)
            + (1.0 - 1.0 / (1.0 + x * x)) * (-h / lag_s).exp();
        assert!((z[0] - exact).abs() < 1e-8, "{z:?} {exact}");
        // Too quick to be followed, and without end.
        assert!(follow([1.0], 1.0, &mut |_, z| [-1e9 * (z[0] - 0.5)])[0].is_nan());
        assert!(!follow([1.0], 2.0, &mut |_, z| [z[0] * z[0]])[0].is_finite());
    }
}
