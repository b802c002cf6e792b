//! Records whose release is known: driven, held, pushed, let go several times, disturbed. By a Runge-Kutta
//! integration of their own with steps of a hundredth of a radian, at rates and sampling of any size.

use std::f64::consts::{PI, TAU};
use yawrig_core::record::Record;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Kept at its amplitude by something that gives back what is lost.
    KeptUp,
    /// Driven by a sine near resonance, in its steady state.
    DrivenSine,
    /// Rocked up, cycle by cycle.
    RockedUp,
    Held,
    /// At rest, then pushed for part of a cycle.
    Pushed,
    /// Let go, caught, turned back, held and let go again.
    Restarted,
    /// Let go, and pushed anew while it swings.
    Disturbed,
    /// The record begins in the middle of it.
    MidSwing,
}

impl Kind {
    pub const ALL: [Self; 8] = [
        Self::KeptUp,
        Self::DrivenSine,
        Self::RockedUp,
        Self::Held,
        Self::Pushed,
        Self::Restarted,
        Self::Disturbed,
        Self::MidSwing,
    ];

    pub fn is_driven(self) -> bool {
        matches!(self, Self::KeptUp | Self::DrivenSine | Self::RockedUp)
    }
}

pub struct Planted {
    pub record: Record,
    pub period_s: f64,
    /// On the record's clock.
    pub releases_s: Vec<f64>,
}

/// A number of a sequence between 0 and 1 (G. Marsaglia, J. Stat. Softw. 8, 2003).
struct Draw(u64);

impl Draw {
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
    fn between(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.unit()
    }
    fn geometric(&mut self, a: f64, b: f64) -> f64 {
        a * (b / a).powf(self.unit())
    }
    fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.unit()).ln()).sqrt() * (TAU * self.unit()).cos()
    }
}

/// What acts on the model for a while; times in radians of its own oscillation, amplitudes in its own unit.
#[derive(Clone, Copy)]
enum Act {
    Free,
    /// The energy is led back to that of this amplitude, so strongly.
    Kept(f64, f64),
    Sine(f64, f64),
    /// A half sine of so much, over the time that it lasts.
    Push(f64),
    /// Moved to this angle and held there from this share of the time on.
    Hold(f64, f64),
}

#[derive(Clone, Copy)]
struct Law {
    zeta: f64,
    dry: f64,
    drag: f64,
}

impl Law {
    fn acceleration(&self, act: Act, since: f64, share: f64, b: f64, r: f64) -> f64 {
        let force = match act {
            Act::Kept(amplitude, gain) => gain * (1.0 - (b * b + r * r) / amplitude.powi(2)) * r,
            Act::Sine(force, frequency) => force * (frequency * since).cos(),
            Act::Push(force) => force * (PI * share).sin(),
            Act::Free | Act::Hold(..) => 0.0,
        };
        force - b - 2.0 * self.zeta * r - self.dry * (r / 1e-3).tanh() - self.drag * r.abs() * r
    }
}

const STEP: f64 = 0.01;

/// The motion through `acts`, each with how long it lasts, a value every hundredth; and where each begins.
fn motion(law: Law, start: (f64, f64), acts: &[(Act, f64)]) -> (Vec<f64>, Vec<f64>) {
    let (mut b, mut r) = start;
    let (mut out, mut begins) = (Vec::new(), Vec::new());
    for &(act, lasts) in acts {
        begins.push(out.len() as f64 * STEP);
        let from = b;
        let steps = (lasts / STEP) as usize;
        for k in 0..steps {
            out.push(b);
            let at = |half: f64| (k as f64 + half) * STEP;
            if let Act::Hold(angle, arrives) = act {
                let share = (at(1.0) / lasts / arrives).min(1.0);
                (b, r) = (angle + (from - angle) * 0.5 * (1.0 + (PI * share).cos()), 0.0);
                continue;
            }
            let a =
                |half: f64, b: f64, r: f64| law.acceleration(act, at(half), at(half) / lasts, b, r);
            let (r1, a1) = (r, a(0.0, b, r));
            let (r2, a2) = (r + 0.5 * STEP * a1, a(0.5, b + 0.5 * STEP * r1, r + 0.5 * STEP * a1));
            let (r3, a3) = (r + 0.5 * STEP * a2, a(0.5, b + 0.5 * STEP * r2, r + 0.5 * STEP * a2));
            let (r4, a4) = (r + STEP * a3, a(1.0, b + STEP * r3, r + STEP * a3));
            b += STEP / 6.0 * (r1 + 2.0 * r2 + 2.0 * r3 + r4);
            r += STEP / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
        }
    }
    (out, begins)
}

/// Where a record of this kind begins, and what acts on it one after the other.
fn course(kind: Kind, law: Law, draw: &mut Draw) -> ((f64, f64), Vec<(Act, f64)>) {
    let zeta = law.zeta;
    let cycles = |n: f64| TAU * n;
    // Down to a tenth or so.
    let decay = draw.between(1.5, 2.5) / zeta;
    let hold = cycles(draw.between(0.7, 6.0));
    let before = cycles(draw.between(8.0, 60.0));
    match kind {
        Kind::KeptUp => {
            let phase = draw.between(0.0, TAU);
            let kept = Act::Kept(1.0, 4.0 * zeta + 0.05);
            // What it loses and what is given are level at another amplitude: it has settled before.
            let settle = cycles(10.0 + 0.5 / zeta);
            let (b, _) = motion(law, (phase.cos(), -phase.sin()), &[(kept, settle)]);
            let [.., b1, b0] = b[..] else { unreachable!("it settles") };
            ((b0, (b0 - b1) / STEP), vec![(kept, before), (Act::Free, decay)])
        }
        Kind::DrivenSine => {
            let w = 1.0 + zeta * draw.between(-2.0, 2.0);
            let (real, imaginary) = (1.0 - w * w, 2.0 * zeta * w);
            let force = real.hypot(imaginary);
            let (cosine, sine) = (real / force, imaginary / force);
            ((cosine, w * sine), vec![(Act::Sine(force, w), before), (Act::Free, decay)])
        }
        Kind::RockedUp => {
            let rock = Act::Kept(1.0, 2.0 * zeta + draw.between(0.02, 0.1));
            ((0.1, 0.0), vec![(rock, before), (Act::Free, decay)])
        }
        Kind::Held => ((1.0, 0.0), vec![(Act::Hold(1.0, 1.0), hold), (Act::Free, decay)]),
        Kind::Pushed => {
            let lasts = cycles(draw.between(0.15, 0.45));
            let push = Act::Push(draw.between(0.6, 1.5));
            ((0.0, 0.0), vec![(Act::Hold(0.0, 1.0), hold), (push, lasts), (Act::Free, decay)])
        }
        Kind::Restarted => {
            let turned = draw.between(0.7, 1.0);
            let back = Act::Hold(turned, cycles(0.6) / (hold + cycles(0.8)));
            let first = (Act::Hold(1.0, 1.0), hold);
            let again = (back, hold + cycles(0.8));
            let short = draw.between(0.8, 1.0) * decay;
            ((1.0, 0.0), vec![first, (Act::Free, short), again, (Act::Free, decay)])
        }
        Kind::Disturbed => {
            let first = draw.between(0.4, 0.8) * decay;
            let left = decay - first;
            let push = (Act::Push(draw.between(0.5, 1.0)), cycles(0.4));
            (
                (1.0, 0.0),
                vec![(Act::Hold(1.0, 1.0), hold), (Act::Free, first), push, (Act::Free, left)],
            )
        }
        Kind::MidSwing => {
            let phase = draw.between(0.0, TAU);
            ((phase.cos(), phase.sin()), vec![(Act::Free, decay)])
        }
    }
}

/// Record `seed` of this kind.
pub fn planted(kind: Kind, seed: u64) -> Planted {
    let mut draw = Draw(0x9e37_79b9_7f4a_7c15 ^ (seed + 1).wrapping_mul(0xd134_2543_de82_ef95));
    for _ in 0..20 {
        draw.unit();
    }
    let wn = draw.geometric(1e-3, 1e4);
    let zeta = draw.geometric(0.003, 0.05);
    let linear = kind == Kind::DrivenSine || draw.unit() < 0.4;
    let law = match linear {
        true => Law { zeta, dry: 0.0, drag: 0.0 },
        false => Law { zeta, dry: 0.02 * zeta * draw.unit(), drag: zeta * draw.unit() },
    };
    let (start, acts) = course(kind, law, &mut draw);
    let (motion, begins) = motion(law, start, &acts);
    let per_cycle = draw.geometric(8.0, 120.0);
    let every = TAU / per_cycle / STEP;
    let (size_deg, zero_deg) = (draw.geometric(0.5, 60.0), draw.between(-5.0, 5.0));
    let noise = draw.geometric(5e-4, 0.02);
    let count = (motion.len() as f64 / every) as usize;
    let begin_s = draw.between(-5.0, 50.0) / wn;
    let time_s = (0..count).map(|k| begin_s + k as f64 * every * STEP / wn).collect();
    let mut reading = |k: usize| {
        let at = k as f64 * every;
        let (first, share) = (at as usize, at.fract());
        let next = motion[(first + 1).min(motion.len() - 1)];
        let b = motion[first] + share * (next - motion[first]);
        zero_deg + size_deg * (b + noise * draw.normal())
    };
    let yaw_deg = (0..count).map(&mut reading).collect();
    let on_clock = |at: f64| begin_s + at / wn;
    let frees = acts.iter().zip(&begins).filter(|((act, _), _)| matches!(act, Act::Free));
    let releases_s: Vec<f64> = frees.map(|(_, at)| on_clock(*at)).collect();
    let record = Record::new(format!("{kind:?} {seed}"), time_s, yaw_deg);
    Planted { record, period_s: TAU / wn, releases_s }
}
