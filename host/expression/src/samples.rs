//! Where a moment is asked before it is believed, and what it says there.

use super::expression::Node;
use super::number::Dual;
use super::program::{Program, State};
use super::states::{last_cycle, numbers, swing, OwnState, MAX_STATES};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// States asked, at random but the same every time.
const STATES: usize = 200;
/// Largest yaw angle, rad, yaw rate, rad/s, and time, s, asked.
const LARGEST: (f64, f64, f64) = (0.4, 10.0, 60.0);
/// Wind-on speed asked, m/s.
pub const WIND_M_S: f64 = 10.0;

/// A compiled moment and where its parameters start.
pub struct Subject<'a> {
    pub node: &'a Node,
    pub program: &'a Program,
    /// Of its parameters, then of its states.
    pub names: &'a [String],
    pub states: &'a [OwnState],
    pub starts: &'a [f64],
    pub bounds: Vec<(f64, f64)>,
}

/// Where a moment is asked for, and the states of the effect there.
pub type Sample = (State<f64>, [f64; MAX_STATES]);

/// Swings that states are followed along: amplitude, rad, natural frequency, rad/s, and wind, m/s.
const SWINGS: [(f64, f64, f64); 6] = [
    (0.25, 10.0, 0.0),
    (0.25, 4.0, WIND_M_S),
    (0.1, 3.0, 0.0),
    (0.1, 25.0, WIND_M_S),
    (0.02, 10.0, WIND_M_S),
    (0.004, 6.0, 0.0),
];

impl Subject<'_> {
    /// States of every size a swing goes through; those of an effect with states of its own are the ones it has
    /// there, with these parameters.
    pub fn samples(&self, parameters: &[f64]) -> Vec<Sample> {
        if self.states.is_empty() {
            return states().into_iter().map(|state| (state, [0.0; MAX_STATES])).collect();
        }
        let along = |(amplitude, wn, wind): (f64, f64, f64)| {
            swing(self.states, parameters, amplitude, wn, wind)
        };
        SWINGS.into_iter().flat_map(along).collect()
    }

    pub fn evaluate(&self, program: &Program, (state, z): &Sample, parameters: &[f64]) -> f64 {
        program.evaluate(state, &numbers(parameters, &z[..self.states.len()]))
    }

    /// How the moments at all samples change with a parameter.
    pub fn column(&self, k: usize, parameters: &[f64], samples: &[Sample]) -> Vec<f64> {
        if self.states.is_empty() {
            let of = |s: &Sample| derivative(self, s, parameters, By::Parameter(k)).slope;
            return samples.iter().map(of).collect();
        }
        // The states change with it, too.
        let by = 1e-4 * parameters[k];
        let moments = |by: f64| -> Vec<f64> {
            let mut moved = parameters.to_vec();
            moved[k] += by;
            self.samples(&moved).iter().map(|s| self.evaluate(self.program, s, &moved)).collect()
        };
        moments(by).iter().zip(moments(-by)).map(|(up, down)| (up - down) / (2.0 * by)).collect()
    }

    pub fn uses_time(&self) -> bool {
        self.program.uses_time() || self.states.iter().any(|s| s.rate_program.uses_time())
    }

    /// A cycle at the starts, of states one that has forgotten the release.
    pub fn cycle(&self, amplitude: f64, wn: f64, wind: f64) -> Vec<Sample> {
        if !self.states.is_empty() {
            return last_cycle(&swing(self.states, self.starts, amplitude, wn, wind)).to_vec();
        }
        let point = |k: u32| {
            let (s, c) = (TAU * (f64::from(k) + 0.5) / 2000.0).sin_cos();
            (at(amplitude * c, -amplitude * wn * s, 0.0, wn, wind), [0.0; MAX_STATES])
        };
        (0..2000).map(point).collect()
    }
}

/// Numbers of a state by which a derivative is taken.
#[derive(Clone, Copy, PartialEq)]
pub enum By {
    Yaw,
    Rate,
    Parameter(usize),
}

fn at(b: f64, r: f64, t: f64, wn: f64, wind: f64) -> State<f64> {
    State {
        yaw_rad: b,
        rate_rad_s: r,
        time_s: t,
        natural_frequency_rad_s: wn,
        wind_speed_m_s: wind,
        rate_sign: if r < 0.0 { -1.0 } else { 1.0 },
        yaw_sign: if b < 0.0 { -1.0 } else { 1.0 },
    }
}

/// Rest with either sign of the rate and wind off, then states of every size a swing goes through.
fn states() -> Vec<State<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let rest = at(0.0, 0.0, 0.0, 10.0, 0.0);
    let mut out = vec![rest, State { rate_sign: -1.0, yaw_sign: -1.0, ..rest }];
    let mut size = |most: f64| {
        let size = most * 10f64.powf(random.random_range(-4.0..0.0));
        if random.random_bool(0.5) {
            size
        } else {
            -size
        }
    };
    for k in 0..STATES {
        let (b, r, t) = (size(LARGEST.0), size(LARGEST.1), size(LARGEST.2).abs());
        let wn = 2.5 * 10f64.powf((k % 11) as f64 / 10.0);
        out.push(at(b, r, t, wn, [0.0, WIND_M_S, 2.0 * WIND_M_S][k % 3]));
    }
    out
}

pub fn described(state: &State<f64>) -> String {
    format!(
        "b = {:.4} rad, r = {:.4} rad/s, t = {:.3} s, wn = {:.2} rad/s, wind = {} m/s",
        state.yaw_rad,
        state.rate_rad_s,
        state.time_s,
        state.natural_frequency_rad_s,
        state.wind_speed_m_s
    )
}

/// Value and derivative by one number, by forward differentiation.
pub fn derivative(subject: &Subject, (state, z): &Sample, parameters: &[f64], by: By) -> Dual {
    let dual = |value: f64, here: bool| Dual { value, slope: f64::from(u8::from(here)) };
    let state = State {
        yaw_rad: dual(state.yaw_rad, by == By::Yaw),
        rate_rad_s: dual(state.rate_rad_s, by == By::Rate),
        time_s: dual(state.time_s, false),
        natural_frequency_rad_s: dual(state.natural_frequency_rad_s, false),
        wind_speed_m_s: dual(state.wind_speed_m_s, false),
        rate_sign: state.rate_sign,
        yaw_sign: state.yaw_sign,
    };
    let numbers = numbers(parameters, &z[..subject.states.len()]);
    let numbers: Vec<Dual> =
        numbers.iter().enumerate().map(|(k, p)| dual(*p, by == By::Parameter(k))).collect();
    subject.program.evaluate(&state, &numbers)
}
