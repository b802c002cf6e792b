//! Releases under laws that no effect of the library is, by a Runge-Kutta integration with steps of a tenth
//! of a millisecond, seen by a sensor with noise and steps.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use yawrig_core::record::Record;
use yawrig_rig::runge_kutta;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Damping in proportion to |r|^0.5.
    RootDamping,
    /// Damping in proportion to |r|^1.5.
    PowerDamping,
    Stribeck,
    EndStop,
    OneSidedSpring,
    Quintic,
    /// sin b at 60 deg.
    Sine,
    /// More drag on one side than on the other.
    AsymmetricDamping,
    /// Dry friction that grows with the angle.
    GrowingFriction,
    /// Restoring moment in proportion to |b|^1.4.
    PowerStiffness,
    BoucWen,
    LuGre,
}

impl Kind {
    pub const ALL: [Self; 12] = [
        Self::RootDamping,
        Self::PowerDamping,
        Self::Stribeck,
        Self::EndStop,
        Self::OneSidedSpring,
        Self::Quintic,
        Self::Sine,
        Self::AsymmetricDamping,
        Self::GrowingFriction,
        Self::PowerStiffness,
        Self::BoucWen,
        Self::LuGre,
    ];

    pub fn has_memory(self) -> bool {
        matches!(self, Self::BoucWen | Self::LuGre)
    }
}

pub struct Planted {
    pub kind: Kind,
    pub wn: f64,
    pub zeta: f64,
    pub released_deg: f64,
    pub seconds: f64,
    pub noise_deg: f64,
    /// Amplitude in rad, to which sizes refer, and a draw from 0.5 to 1.5.
    amplitude: f64,
    size: f64,
    /// Stiffness of the spring over that of the first release's, and the reading at rest, deg.
    pub spring: f64,
    pub rest_deg: f64,
    pub record: Record,
}

/// What the model remembers: deflection of a bristle or of the plastic part.
type Memory = f64;

impl Planted {
    /// K(b) with the linear part, where it depends on nothing else, rad/s2.
    pub fn stiffness(&self, b: f64) -> f64 {
        let (w2, a, s) = (self.wn * self.wn, self.amplitude, self.size);
        let over = |g: f64| (b.abs() - g).max(0.0).copysign(b);
        let more = match self.kind {
            Kind::EndStop => 0.6 * s * over(0.6 * a),
            Kind::OneSidedSpring => 0.08 * s * b.max(0.0),
            Kind::Quintic => 0.06 * s * b.powi(5) / a.powi(4),
            Kind::Sine => b.sin() - b,
            Kind::PowerStiffness => 0.08 * s * a * (b.abs() / a).powf(1.4).copysign(b),
            _ => 0.0,
        };
        w2 * (self.spring * b + more)
    }

    /// Name and value of the number that a formula of the law has: exponent, or scale.
    pub fn number(&self) -> Option<(&'static str, f64)> {
        let (w2, a, s) = (self.wn * self.wn, self.amplitude, self.size);
        Some(match self.kind {
            Kind::RootDamping => ("n", 0.5),
            Kind::PowerDamping => ("n", 1.5),
            Kind::Stribeck => ("u", 0.1 * self.wn * a),
            Kind::EndStop => ("ge", 0.6 * a),
            Kind::OneSidedSpring => ("ko", 0.08 * s * w2),
            Kind::Quintic => ("k5", 0.06 * s * w2 / a.powi(4)),
            Kind::Sine => ("g", w2),
            Kind::AsymmetricDamping => ("y", 0.6),
            Kind::PowerStiffness => ("o", 1.4),
            Kind::GrowingFriction | Kind::BoucWen | Kind::LuGre => return None,
        })
    }

    /// D(r) with the linear part, rad/s2.
    pub fn damping(&self, r: f64) -> f64 {
        let (wn, a, s) = (self.wn, self.amplitude, self.size);
        let x = r.abs() / (wn * a);
        let scale = wn * wn * a;
        2.0 * self.zeta * wn * r
            + scale
                * match self.kind {
                    Kind::RootDamping => 0.01 * s * x.sqrt(),
                    Kind::PowerDamping => 0.03 * s * x.powf(1.5),
                    Kind::Stribeck => {
                        0.005 * s * (1.0 + (-x / 0.1).exp()) * f64::from(u8::from(x > 0.0))
                    }
                    Kind::AsymmetricDamping => 0.03 * s * x * x * (1.0 + 0.6 * r.signum()),
                    _ => 0.0,
                }
                .copysign(r)
    }

    fn moment(&self, b: f64, r: f64, z: Memory) -> f64 {
        let (wn, a, s) = (self.wn, self.amplitude, self.size);
        let scale = wn * wn * a;
        let more = match self.kind {
            Kind::GrowingFriction => 0.004 * s * (1.0 + 2.0 * b.abs() / a) * r.signum(),
            Kind::BoucWen => 0.1 * s * z / a,
            Kind::LuGre => 0.006 * s * z,
            _ => 0.0,
        };
        -self.stiffness(b) - self.damping(r) - scale * more
    }

    fn memory_rate(&self, r: f64, z: Memory) -> f64 {
        let (wn, a) = (self.wn, self.amplitude);
        match self.kind {
            // Elasto-plastic: z follows b and yields at 0.3 of the amplitude.
            Kind::BoucWen => r - r.abs() * z / (0.3 * a),
            // A bristle, as a share of its largest deflection, which it reaches within 0.05 of the amplitude.
            Kind::LuGre => {
                let g = 1.0 + 0.5 * (-(r / (0.1 * wn * a)).powi(2)).exp();
                (r - r.abs() * z / g) / (0.05 * a)
            }
            _ => 0.0,
        }
    }
}

const STEP_S: f64 = 1e-4;

pub fn planted(kind: Kind, seed: u64) -> Planted {
    let (mut rng, rig) = rig(kind, seed);
    released(rig, &mut rng)
}

/// Of one rig with two springs: releases from all of the first one's angle and from half of it, each with a
/// rest of its own.
pub fn family(kind: Kind, seed: u64, releases: usize) -> Vec<Planted> {
    let (mut rng, rig) = rig(kind, seed);
    let release = |k: usize| {
        let mut one = Planted { record: rig.record.clone(), ..rig };
        one.released_deg *= [1.0, 0.5][k % 2];
        one.spring = [1.0, 1.6][k / 2 % 2];
        one.rest_deg = rng.random_range(-0.3..0.3);
        released(one, &mut rng)
    };
    (0..releases).map(release).collect()
}

fn rig(kind: Kind, seed: u64) -> (ChaCha8Rng, Planted) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed * 100 + kind as u64);
    let wn = rng.random_range(5.0..14.0f64);
    let zeta = rng.random_range(0.002..0.008);
    let released_deg = if kind == Kind::Sine { 60.0 } else { rng.random_range(10.0..20.0) };
    let noise_deg = rng.random_range(0.02..0.06);
    let seconds = rng.random_range(20.0..40.0);
    let record = Record::new(format!("{kind:?}-{seed}"), vec![], vec![]);
    let rig = Planted {
        kind,
        wn,
        zeta,
        released_deg,
        seconds,
        noise_deg,
        amplitude: f64::to_radians(released_deg),
        size: rng.random_range(0.5..1.5),
        spring: 1.0,
        rest_deg: 0.0,
        record,
    };
    (rng, rig)
}

fn released(mut out: Planted, rng: &mut ChaCha8Rng) -> Planted {
    let rate_hz = [500.0, 1000.0][rng.random_range(0..2)];
    let every = (1.0 / rate_hz / STEP_S).round() as usize;
    let noise = Normal::new(0.0, out.noise_deg).expect("a noise");
    let hold_s = 1.0;
    let (mut b, mut r, mut z) = (out.released_deg.to_radians(), 0.0, 0.0);
    let total = ((out.seconds + hold_s) / STEP_S) as usize;
    for k in 0..total {
        let t = k as f64 * STEP_S;
        if k % every == 0 {
            out.record.time_s.push(t);
            out.record.yaw_deg.push(out.rest_deg + b.to_degrees() + noise.sample(rng));
        }
        if t >= hold_s {
            (b, r, z) = stepped(&out, b, r, z);
        }
    }
    out
}

fn stepped(p: &Planted, b: f64, r: f64, z: Memory) -> (f64, f64, Memory) {
    let slope = |_, [b, r, z]: [f64; 3]| [r, p.moment(b, r, z), p.memory_rate(r, z)];
    runge_kutta([b, r, z], STEP_S, slope).into()
}
