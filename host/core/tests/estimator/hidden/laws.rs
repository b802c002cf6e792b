//! The effects as this generator writes them, and some that the library does not hold.

use super::Setup;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use yawrig_core::effects::Effect;

/// Effects that the library does not hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outside {
    /// Restoring moment that ripples along the angle.
    Ripple,
    /// A magnet that holds near one angle.
    Magnet,
    /// Stiffness that jumps in mid-record.
    Jump,
    /// Bouc-Wen hysteresis.
    Hysteresis,
    /// A moment that follows the angle late.
    Delay,
    /// Stiffness that goes up and down with time.
    Parametric,
    /// Friction that depends on the position.
    UnevenFriction,
    /// A pointer that slips on its shaft.
    Slip,
    /// Forcing of rising frequency.
    Chirp,
    /// Damping negative at small angles and with their cube at large ones.
    SelfExcited,
    /// A soft stop on one side that takes energy out.
    Stop,
    /// A blow in mid-record.
    Blow,
}

impl Outside {
    pub const ALL: [Self; 12] = [
        Self::Ripple,
        Self::Magnet,
        Self::Jump,
        Self::Hysteresis,
        Self::Delay,
        Self::Parametric,
        Self::UnevenFriction,
        Self::Slip,
        Self::Chirp,
        Self::SelfExcited,
        Self::Stop,
        Self::Blow,
    ];
}

#[derive(Clone)]
pub enum Law {
    Known(Effect, Vec<f64>),
    /// Kind, size, and a draw from 0..1 for its shape.
    Outside(Outside, f64, f64),
}

/// An effect of a plainly visible size, signs drawn where both are physical.
pub fn draw(effect: Effect, setup: &Setup, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let (wn, a) = (setup.wn, setup.amplitude.abs());
    let either = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    let phase = rng.random_range(-3.0..3.0);
    match effect {
        Effect::CoulombFriction => vec![0.006 * wn * wn * a],
        Effect::QuadraticDamping => vec![0.02 / a],
        Effect::CubicDamping => vec![0.06 * either * wn / (a * a)],
        Effect::CubicStiffness => vec![0.05 * either * wn * wn / (a * a)],
        Effect::QuadraticStiffness => vec![0.06 * either * wn * wn / a],
        Effect::StaticOffset => vec![0.05 * either * wn * wn * a],
        Effect::FreePlay => vec![0.01 * a],
        Effect::HarmonicForcing => {
            let below = rng.random_bool(0.5);
            let w = if below { rng.random_range(0.3..0.85) } else { rng.random_range(1.15..4.0) };
            vec![0.05 * wn * wn * a, w * wn, phase]
        }
        Effect::StiffnessDrift => vec![0.02 * either / setup.duration],
        Effect::Buffeting => vec![1e-4 * wn.powi(3) * a * a],
        Effect::SecondMode => {
            let ratio = rng.random_range(1.4..5.0);
            vec![0.08 * a, phase, ratio * wn, rng.random_range(0.002..0.03)]
        }
        Effect::SensorNonlinearity => vec![0.05 * either / a],
        Effect::BaselineDrift => vec![0.08 * either * a / setup.duration],
        Effect::QuinticStiffness => vec![0.05 * either * wn * wn / a.powi(4)],
        Effect::PowerDamping => {
            let n = [0.5, 1.5, 2.6][rng.random_range(0..3)];
            vec![0.01 * wn * wn * a / (wn * a).powf(n), n]
        }
        Effect::EndStop => vec![0.3 * wn * wn, rng.random_range(0.3..0.7) * a],
        Effect::OneSidedStop => vec![0.3 * wn * wn, either * rng.random_range(0.3..0.7) * a],
        Effect::TwoStops | Effect::DampedStops => {
            let [up, low] = [0, 1].map(|_| rng.random_range(0.3..0.7) * a);
            let unlike = vec![0.3 * wn * wn, up, 0.5 * wn * wn, low];
            match effect {
                Effect::TwoStops => unlike,
                _ => [unlike, vec![0.3 / (wn * a)]].concat(),
            }
        }
        Effect::DampedStop => {
            vec![0.3 * wn * wn, either * rng.random_range(0.3..0.7) * a, 0.3 / (wn * a)]
        }
        Effect::Hysteresis => vec![0.02 * wn * wn, rng.random_range(0.15..0.6) * a],
        Effect::PendulumGravity
        | Effect::OddQuadraticStiffness
        | Effect::Own(_)
        | Effect::Measured(_)
        | Effect::Sourced(_) => {
            unreachable!("not hidden")
        }
    }
}

/// Largest factor on a drawn law that leaves a free decay.
pub fn most(law: &Law, setup: &Setup) -> f64 {
    let (wn, a) = (setup.wn, setup.amplitude.abs());
    let Law::Known(effect, p) = law else { return 30.0 };
    let largest = match effect {
        Effect::CoulombFriction => 0.03 * wn * wn * a,
        Effect::QuadraticDamping => 0.5 / a,
        // Negative: the total damping stays positive.
        Effect::CubicDamping if p[0] < 0.0 => 4.0 * setup.zeta * wn / (a * a),
        Effect::CubicDamping => wn / (a * a),
        Effect::CubicStiffness => 0.4 * wn * wn / (a * a),
        Effect::QuadraticStiffness => 0.3 * wn * wn / a,
        Effect::StaticOffset => 0.5 * wn * wn * a,
        Effect::FreePlay => 0.1 * a,
        Effect::HarmonicForcing => 0.5 * wn * wn * a,
        Effect::StiffnessDrift => 0.3 / setup.duration,
        Effect::Buffeting => 0.01 * wn.powi(3) * a * a,
        Effect::SecondMode => 0.5 * a,
        Effect::SensorNonlinearity => 0.3 / a,
        Effect::BaselineDrift => a / setup.duration,
        Effect::QuinticStiffness => 0.3 * wn * wn / a.powi(4),
        Effect::PowerDamping => 0.3 * wn * wn * a / (wn * a).powf(p[1]),
        Effect::EndStop | Effect::OneSidedStop => 20.0 * wn * wn,
        Effect::TwoStops | Effect::DampedStop | Effect::DampedStops => 20.0 * wn * wn,
        Effect::Hysteresis => 0.5 * wn * wn,
        Effect::PendulumGravity
        | Effect::OddQuadraticStiffness
        | Effect::Own(_)
        | Effect::Measured(_)
        | Effect::Sourced(_) => {
            unreachable!("not hidden")
        }
    };
    largest / p[0].abs()
}

impl Law {
    pub fn scale(&mut self, factor: f64) {
        match self {
            Self::Known(_, p) => p[0] *= factor,
            Self::Outside(_, size, _) => *size *= factor,
        }
    }

    /// To `share` of what it moves: random forcing grows with the root of its intensity.
    pub fn weaken(&mut self, share: f64) {
        self.scale(if self.is_intensity() { share * share } else { share });
    }

    pub fn known(&self) -> Option<(Effect, Vec<f64>)> {
        match self {
            Self::Known(effect, p) => Some((effect.clone(), p.clone())),
            Self::Outside(..) => None,
        }
    }

    pub fn described(&self) -> String {
        match self {
            Self::Known(effect, p) => format!("{effect} {p:.4?}"),
            Self::Outside(outside, size, shape) => format!("{outside:?} {size:.3} {shape:.2}"),
        }
    }

    fn of(&self, wanted: Effect, index: usize) -> f64 {
        match self {
            Self::Known(effect, p) if *effect == wanted => p[index],
            _ => 0.0,
        }
    }

    pub fn is_intensity(&self) -> bool {
        self.intensity() > 0.0
    }

    pub fn intensity(&self) -> f64 {
        self.of(Effect::Buffeting, 0)
    }

    /// Needs steps that resolve a corner, a noise or a sharp feature.
    pub fn is_rough(&self) -> bool {
        self.intensity() > 0.0
            || self.of(Effect::CoulombFriction, 0) > 0.0
            || matches!(self, Self::Outside(Outside::UnevenFriction | Outside::Stop, ..))
    }

    pub fn friction(&self, setup: &Setup, b: f64) -> f64 {
        let a = setup.amplitude;
        match self {
            Self::Outside(Outside::UnevenFriction, size, _) => {
                size * 0.006 * setup.wn.powi(2) * a.abs() * (1.0 + (3.0 * b / a).sin())
            }
            _ => self.of(Effect::CoulombFriction, 0),
        }
    }

    pub fn spring(&self, b: f64) -> Option<f64> {
        let g = self.of(Effect::FreePlay, 0);
        (g > 0.0).then(|| b - b.clamp(-g, g))
    }

    pub fn stiffness(&self, setup: &Setup, t: f64) -> f64 {
        1.0 + match self {
            Self::Outside(Outside::Jump, size, shape) => {
                f64::from(u8::from(t > (0.2 + 0.4 * shape) * setup.duration)) * 0.01 * size
            }
            Self::Outside(Outside::Parametric, size, shape) => {
                0.02 * size * ((0.2 + 0.6 * shape) * setup.wn * t).sin()
            }
            _ => self.of(Effect::StiffnessDrift, 0) * t,
        }
    }

    /// Rate of the hysteretic state.
    pub fn memory(&self, setup: &Setup, r: f64, z: f64) -> f64 {
        match self {
            Self::Outside(Outside::Hysteresis, ..) => {
                let yield_rad = 0.2 * setup.amplitude.abs();
                (r - 0.5 * (r.abs() * z.abs() * z + r * z * z) / (yield_rad * yield_rad))
                    / yield_rad
            }
            Self::Known(Effect::Hysteresis, p) => r - r.abs() * z / p[1],
            _ => 0.0,
        }
    }

    /// The hysteretic state of a model held at the release.
    pub fn held(&self, setup: &Setup) -> f64 {
        match self {
            Self::Known(Effect::Hysteresis, p) => {
                p[1] * (1.0 - (-setup.amplitude.abs() / p[1]).exp()) * setup.amplitude.signum()
            }
            _ => 0.0,
        }
    }

    #[allow(clippy::too_many_arguments)]
    pub fn moment(
        &self,
        setup: &Setup,
        b: f64,
        r: f64,
        z: f64,
        t: f64,
        past: &[f64],
        step_s: f64,
    ) -> f64 {
        let (wn, a) = (setup.wn, setup.amplitude.abs());
        let unit = wn * wn * a;
        match self {
            Self::Known(effect, p) => match effect {
                Effect::QuadraticDamping => -p[0] * r.abs() * r,
                Effect::CubicDamping => -p[0] * b * b * r,
                Effect::CubicStiffness => -p[0] * b * b * b,
                Effect::QuinticStiffness => -p[0] * b * b * b * b * b,
                Effect::QuadraticStiffness => -p[0] * b * b,
                Effect::StaticOffset => p[0],
                Effect::PowerDamping => -p[0] * r.abs().powf(p[1]) * r.signum(),
                Effect::EndStop => -p[0] * (b.abs() - p[1]).max(0.0) * b.signum(),
                Effect::OneSidedStop if p[1] > 0.0 => -p[0] * (b - p[1]).max(0.0),
                Effect::OneSidedStop => -p[0] * (b - p[1]).min(0.0),
                Effect::TwoStops => -p[0] * (b - p[1]).max(0.0) - p[2] * (b + p[3]).min(0.0),
                Effect::DampedStop if p[1] > 0.0 => -p[0] * (b - p[1]).max(0.0) * (1.0 + p[2] * r),
                Effect::DampedStop => -p[0] * (b - p[1]).min(0.0) * (1.0 - p[2] * r),
                Effect::DampedStops => {
                    let (above, below) = ((b - p[1]).max(0.0), (b + p[3]).min(0.0));
                    -p[0] * above * (1.0 + p[4] * r) - p[2] * below * (1.0 - p[4] * r)
                }
                Effect::Hysteresis => -p[0] * z,
                Effect::HarmonicForcing => p[0] * (p[1] * t + p[2]).cos(),
                _ => 0.0,
            },
            Self::Outside(outside, size, shape) => match outside {
                Outside::Ripple => 0.02 * size * unit * ((7.0 + 6.0 * shape) * b / a).sin(),
                Outside::Magnet => {
                    let x = (b / a - 0.6 * shape) / 0.12;
                    -0.05 * size * unit * x * (-x * x).exp()
                }
                Outside::Hysteresis => -0.02 * size * unit * z,
                Outside::Delay => {
                    let late = ((1.0 + 2.0 * shape) / wn / step_s) as usize;
                    let before =
                        past.len().checked_sub(late + 1).map_or(setup.amplitude, |k| past[k]);
                    -0.01 * size * wn * wn * before.abs() * before / a
                }
                Outside::Chirp => {
                    let w = wn * (0.3 + 2.0 * t / setup.duration);
                    0.02 * size * unit * (w * t).cos()
                }
                Outside::SelfExcited => {
                    let x = (b / a).abs();
                    -wn * size * (0.02 * x * x * x - 0.004) * r
                }
                Outside::Stop => {
                    let beyond = (b - (0.3 + 0.4 * shape) * a).max(0.0);
                    -size * 0.3 * wn * wn * beyond
                        - size * 0.05 * wn * r * f64::from(u8::from(beyond > 0.0))
                }
                Outside::Blow => {
                    let x = (t - (0.2 + 0.4 * shape) * setup.duration) * wn / 0.3;
                    0.2 * size * unit * (-x * x).exp()
                }
                _ => 0.0,
            },
        }
    }

    pub fn reading(&self, setup: &Setup, b: f64, t: f64) -> f64 {
        match self {
            Self::Known(Effect::SensorNonlinearity, p) => p[0] * b * b,
            Self::Known(Effect::BaselineDrift, p) => p[0] * t,
            Self::Known(Effect::SecondMode, p) => {
                let wd = p[2] * (1.0 - p[3] * p[3]).sqrt();
                p[0] * (-p[3] * p[2] * t).exp() * (wd * t + p[1]).cos()
            }
            Self::Outside(Outside::Slip, size, shape) => {
                let slipped = t > (0.2 + 0.4 * shape) * setup.duration;
                f64::from(u8::from(slipped)) * 0.01 * size * setup.amplitude
            }
            _ => 0.0,
        }
    }
}
