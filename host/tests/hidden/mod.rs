//! Records with a hidden effect, from another integrator and sensor chain than the fits': semi-implicit Euler steps of
//! 20 us with stiction by impulse, a low-order noise sum, a converter's step.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::path::PathBuf;
use yawrig::criticism::effects::Effect;
use yawrig::record::Record;

const STEP_S: f64 = 20e-6;

/// What was planted.
pub struct Planted {
    pub record: Record,
    pub natural_frequency_rad_s: f64,
    pub damping_ratio: f64,
    /// Users' numbers of each effect.
    pub effects: Vec<(Effect, Vec<f64>)>,
}

/// Effects that the library does not hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outside {
    /// Restoring moment with the fifth power of the angle and a ripple along it.
    Ripple,
    /// A magnet that holds within a degree of one angle.
    Detent,
    /// Stiffness that jumps in mid-record.
    Jump,
}

pub struct Plan {
    pub effects: Vec<Effect>,
    pub outside: Option<Outside>,
    /// Size of the effects, 1: of the order of a hundredth of the spring's moment.
    pub size: f64,
    pub rate_hz: f64,
    pub seed: u64,
}

impl Default for Plan {
    fn default() -> Self {
        Self { effects: vec![], outside: None, size: 1.0, rate_hz: 1000.0, seed: 0 }
    }
}

pub fn plant(plan: &Plan) -> Planted {
    let mut rng = ChaCha8Rng::seed_from_u64(plan.seed);
    let wn: f64 = rng.random_range(4.0..16.0);
    let zeta = rng.random_range(0.003..0.02);
    let amplitude: f64 = rng.random_range(8f64..15.0).to_radians();
    let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    let hold_s = if rng.random_bool(0.5) { rng.random_range(0.5..2.0) } else { 0.0 };
    let duration = 25.0;
    let noise = rng.random_range(0.02..0.1);
    let adc = 0.005;
    let mut effects = Vec::new();
    let mut of = [const { Vec::<f64>::new() }; 13];
    for &effect in &plan.effects {
        let s = plan.size * rng.random_range(0.7..1.4);
        let either = if rng.random_bool(0.5) { s } else { -s };
        let a = amplitude;
        let phase = rng.random_range(-3.0..3.0);
        let p = match effect {
            Effect::CoulombFriction => vec![0.006 * s * wn * wn * a],
            Effect::QuadraticDamping => vec![0.02 * s / a],
            Effect::CubicDamping => vec![0.06 * s * wn / (a * a)],
            Effect::CubicStiffness => vec![0.05 * either * wn * wn / (a * a)],
            Effect::QuadraticStiffness => vec![0.06 * either * wn * wn / a],
            Effect::StaticOffset => vec![0.05 * either * wn * wn * a],
            Effect::FreePlay => vec![0.01 * s * a],
            Effect::HarmonicForcing => {
                let w = if rng.random_bool(0.5) {
                    rng.random_range(0.3..0.8)
                } else {
                    rng.random_range(1.25..3.0)
                };
                vec![0.05 * s * wn * wn * a, w * wn, phase]
            }
            Effect::StiffnessDrift => vec![0.02 * either / duration],
            Effect::Buffeting => vec![1e-4 * s * wn.powi(3) * a * a],
            Effect::SecondMode => {
                vec![
                    0.08 * s * a,
                    phase,
                    rng.random_range(1.6..5.0) * wn,
                    rng.random_range(0.005..0.03),
                ]
            }
            Effect::SensorNonlinearity => vec![0.05 * either / a],
            Effect::BaselineDrift => vec![0.08 * either * a / duration],
            Effect::Own(_) => unreachable!("planted by other means"),
        };
        let k = Effect::ALL.iter().position(|e| *e == effect).unwrap();
        of[k] = p.clone();
        effects.push((effect, p));
    }
    let get = |e: Effect, i: usize| {
        of[Effect::ALL.iter().position(|x| *x == e).unwrap()].get(i).copied().unwrap_or(0.0)
    };
    let (c, d, c2) = (
        get(Effect::CoulombFriction, 0),
        get(Effect::QuadraticDamping, 0),
        get(Effect::CubicDamping, 0),
    );
    let (k3, k2, m) = (
        get(Effect::CubicStiffness, 0),
        get(Effect::QuadraticStiffness, 0),
        get(Effect::StaticOffset, 0),
    );
    let (g, e, q) =
        (get(Effect::FreePlay, 0), get(Effect::StiffnessDrift, 0), get(Effect::Buffeting, 0));
    let force = [0, 1, 2].map(|i| get(Effect::HarmonicForcing, i));
    let mode = [0, 1, 2, 3].map(|i| get(Effect::SecondMode, i));
    let (s, drift) = (get(Effect::SensorNonlinearity, 0), get(Effect::BaselineDrift, 0));

    let (mut b, mut r) = (sign * amplitude, 0.0_f64);
    let per_sample = (1.0 / (plan.rate_hz * STEP_S)).round() as usize;
    let held = (hold_s * plan.rate_hz) as usize;
    let count = held + (duration * plan.rate_hz) as usize;
    let (mut time_s, mut yaw_deg) = (Vec::new(), Vec::new());
    for k in 0..count {
        let t = k.saturating_sub(held) as f64 / plan.rate_hz;
        let swing2 = if mode[2] > 0.0 && k >= held {
            let wd = mode[2] * (1.0 - mode[3] * mode[3]).sqrt();
            mode[0] * (-mode[3] * mode[2] * t).exp() * (wd * t + mode[1]).cos()
        } else {
            0.0
        };
        let reading = b + s * b * b + drift * t + swing2;
        let z: f64 = StandardNormal.sample(&mut rng);
        time_s.push(k as f64 / plan.rate_hz);
        yaw_deg.push(((reading.to_degrees() + noise * z) / adc).round() * adc);
        if k < held {
            continue;
        }
        for i in 0..per_sample {
            let t = t + i as f64 * STEP_S;
            let spring = if g > 0.0 { b - b.clamp(-g, g) } else { b };
            let mut stiffness = wn * wn * (1.0 + e * t);
            let mut extra = 0.0;
            match plan.outside {
                Some(Outside::Ripple) => {
                    extra = 0.03 * plan.size * wn * wn * amplitude * (b / amplitude * 9.0).sin();
                }
                Some(Outside::Detent) => {
                    let x = (b - 0.4 * amplitude) / 0.02;
                    extra = -0.06 * plan.size * wn * wn * amplitude * x * (-x * x).exp();
                }
                Some(Outside::Jump) if t > 0.5 * duration => stiffness *= 1.0 + 0.02 * plan.size,
                _ => {}
            }
            let mut moment = -stiffness * spring + m
                - 2.0 * zeta * wn * r
                - d * r.abs() * r
                - c2 * b * b * r
                - k3 * b * b * b
                - k2 * b * b
                + force[0] * (force[1] * t + force[2]).cos()
                + extra;
            if q > 0.0 {
                let z: f64 = StandardNormal.sample(&mut rng);
                moment += (q / STEP_S).sqrt() * z;
            }
            // Friction as an impulse that cannot turn the motion round.
            let free = r + STEP_S * moment;
            r = if free.abs() <= STEP_S * c { 0.0 } else { free - STEP_S * c * free.signum() };
            b += STEP_S * r;
        }
    }
    Planted {
        record: Record { file: PathBuf::from("planted.csv"), time_s, yaw_deg },
        natural_frequency_rad_s: wn,
        damping_ratio: zeta,
        effects,
    }
}
