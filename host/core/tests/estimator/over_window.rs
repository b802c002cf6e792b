//! Means over a window over which wn and zeta change, against those of the motion itself, which another
//! integrator made, before there is any noise. Friction and drag move passages through the middle and turning
//! points against each other by as much as the means are uncertain: amplitude and phase are those of its
//! first harmonic.

use crate::hidden::number;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::TAU;
use yawrig_core::identify::{identify, AmplitudeWindow, Method, Settings};
use yawrig_core::record::Record;
use yawrig_rig::runge_kutta;

const STEP_S: f64 = 0.5e-3;
const SAMPLE_STEPS: usize = 10;

/// What makes wn or zeta change with amplitude.
#[derive(Clone, Copy, Debug)]
enum Law {
    Friction,
    Drag,
    CubicDamping,
    Pendulum,
    Hardening,
}

const LAWS: [Law; 5] = [Law::Friction, Law::Drag, Law::CubicDamping, Law::Pendulum, Law::Hardening];

const RECORDED_S: f64 = 60.0;

struct Planted {
    record: Record,
    /// Every step.
    motion: Vec<f64>,
    /// From which it is there.
    from_s: f64,
    /// Of its maxima, on the record's clock.
    maxima_s: Vec<f64>,
    described: String,
}

/// Least and most of what is planted.
struct Kind {
    zeta: [f64; 2],
    noise_deg: [f64; 2],
    strength: [f64; 2],
    /// How long the motion goes on before the record and after it, by wn.
    beside_s: fn(f64) -> f64,
}

const MANY_CYCLES: Kind =
    Kind { zeta: [0.001, 0.015], noise_deg: [0.02, 0.1], strength: [0.3, 1.5], beside_s: |_| 3.0 };
/// In three seconds friction may have ended them.
const FEW_CYCLES: Kind = Kind {
    zeta: [0.015, 0.05],
    noise_deg: [0.02, 0.3],
    strength: [1.5, 7.0],
    beside_s: |wn_rad_s| 1.5 * TAU / wn_rad_s,
};

fn planted(laws: &[Law], seed: u64, kind: &Kind) -> Planted {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut between = |from: f64, to: f64| rng.random_range(from.ln()..to.ln()).exp();
    let mut of = |[from, to]: [f64; 2]| between(from, to);
    let (wn, zeta, largest) = (of([3.0, 20.0]), of(kind.zeta), of([0.14, 0.3]));
    let (noise_deg, strength) = (of(kind.noise_deg), of(kind.strength));
    let slope = |_: f64, [b, r]: [f64; 2]| {
        let of = |law: &Law| match law {
            // Each takes of a cycle at some amplitude what so many times 0.01 would.
            Law::Friction => strength * 0.01 * 0.03 * wn * wn * (r / (1e-3 * wn * largest)).tanh(),
            Law::Drag => strength * 0.08 * r * r.abs(),
            Law::CubicDamping => strength * 0.6 / wn * r.powi(3),
            Law::Pendulum => wn * wn * (b.sin() - b),
            Law::Hardening => strength * wn * wn * b.powi(3),
        };
        [r, -wn * wn * b - 2.0 * zeta * wn * r - laws.iter().map(of).sum::<f64>()]
    };
    let mut state = [largest, 0.0];
    let (mut time_s, mut yaw_deg) = (Vec::new(), Vec::new());
    let (mut motion, mut maxima_s) = (Vec::new(), Vec::new());
    let beside = ((kind.beside_s)(wn) / STEP_S) as usize;
    let from_s = -(beside as f64) * STEP_S;
    for k in 0..(RECORDED_S / STEP_S) as usize + 2 * beside {
        let t = from_s + k as f64 * STEP_S;
        motion.push(state[0]);
        if k % SAMPLE_STEPS == 0 && (0.0..RECORDED_S).contains(&t) {
            time_s.push(t);
            yaw_deg.push(state[0].to_degrees() + noise_deg * rng.sample::<f64, _>(StandardNormal));
        }
        let next = runge_kutta(state, STEP_S, slope);
        if state[1] > 0.0 && next[1] <= 0.0 {
            maxima_s.push(t);
        }
        state = next;
    }
    let described =
        format!("{laws:?} x {strength:.2} wn {wn:.2} zeta {zeta:.4} noise {noise_deg:.3} deg");
    Planted { record: Record::new("planted", time_s, yaw_deg), motion, from_s, maxima_s, described }
}

impl Planted {
    /// ln of the first harmonic's amplitude at a time, and its phase: over a cycle on either side, weighted
    /// so that neither its decay nor other harmonics come in.
    fn harmonic(&self, time_s: f64) -> [f64; 2] {
        let after =
            self.maxima_s.partition_point(|t| *t < time_s).clamp(1, self.maxima_s.len() - 1);
        let period_s = self.maxima_s[after] - self.maxima_s[after - 1];
        let place = |t: f64| ((t - self.from_s) / STEP_S).round() as usize;
        let (mut cosine, mut sine, mut weight) = (0.0, 0.0, 0.0);
        for k in place(time_s - period_s)..=place(time_s + period_s) {
            let off = self.from_s + k as f64 * STEP_S - time_s;
            let share = (0.25 * TAU * off / period_s).cos().powi(2);
            let (s, c) = (TAU * off / period_s).sin_cos();
            cosine += share * self.motion[k] * c;
            sine -= share * self.motion[k] * s;
            weight += share;
        }
        [(2.0 * cosine.hypot(sine) / weight).ln(), sine.atan2(cosine)]
    }

    /// Maxima until a time, to a small part of a cycle.
    fn cycles(&self, time_s: f64) -> f64 {
        let after =
            self.maxima_s.partition_point(|t| *t < time_s).clamp(1, self.maxima_s.len() - 1);
        let [from_s, to_s] = [self.maxima_s[after - 1], self.maxima_s[after]];
        after as f64 - 1.0 + (time_s - from_s) / (to_s - from_s)
    }

    /// wn and zeta of the mean cycle of the window.
    fn truth(&self, window: &AmplitudeWindow) -> [f64; 2] {
        let length_s = window.to_s - window.from_s;
        let [[ln_0, phase_0], [ln_1, phase_1]] =
            [window.from_s, window.to_s].map(|t| self.harmonic(t));
        let cycles = self.cycles(window.to_s) - self.cycles(window.from_s);
        let turns = (cycles - (phase_1 - phase_0) / TAU).round();
        let (w, s) = ((turns * TAU + phase_1 - phase_0) / length_s, (ln_0 - ln_1) / length_s);
        [w.hypot(s), s / w.hypot(s)]
    }
}

/// In units of u, smallest first: how far wn and zeta are off in eighty records.
fn off(kind: &Kind) -> [Vec<f64>; 2] {
    let mut z = [Vec::new(), Vec::new()];
    for k in 0..80u64 {
        let first = LAWS[k as usize % 5];
        let second = LAWS[(k as usize / 5) % 5];
        let laws = if k < 40 { vec![first] } else { vec![first, second] };
        let planted = planted(&laws, 1000 * number("YAWRIG_SEED", 0) + k, kind);
        let found = identify(&planted.record, &[Method::LeastSquares], &Settings::default());
        let found = found.expect("an oscillation");
        let truth = planted.truth(&found.window);
        let found = &found.estimates[0];
        let each = [found.natural_frequency_rad_s, found.damping_ratio];
        let off = [0, 1].map(|k| (each[k].value - truth[k]) / each[k].u);
        println!(
            "{} {} windows: wn {} of {:.5} {:+.1} {:.4?}, zeta {} of {:.6} {:+.1} {:.5?}, one mode {:?}",
            planted.described,
            found.windows.len(),
            each[0],
            truth[0],
            off[0],
            found.natural_frequency_range_rad_s,
            each[1],
            truth[1],
            off[1],
            found.damping_ratio_range,
            found.one_mode.map(|m| m.damping_ratio.to_string()),
        );
        (0..2).for_each(|k| z[k].push(off[k].abs()));
    }
    for (z, name) in z.iter_mut().zip(["wn", "zeta"]) {
        z.sort_by(f64::total_cmp);
        println!(
            "{name}: {} of {} within 2 u, median {:.2}, largest {:.1}",
            inside(z),
            z.len(),
            z[40],
            z[79]
        );
    }
    z
}

fn inside(z: &[f64]) -> usize {
    z.iter().filter(|z| **z < 2.0).count()
}

/// Of 80 numbers 76 are within 2 u if these are true, give or take 2, and their median is 0.67 u.
#[test]
fn means_over_a_window_hold_those_of_the_motion() {
    for z in off(&MANY_CYCLES) {
        assert!(inside(&z) >= 72, "{} of 80", inside(&z));
        assert!((0.5..0.8).contains(&z[40]), "median {}", z[40]);
    }
}

/// Of 3 to 15 cycles, most of whose damping is friction's or drag's, 74 to 80 of 80 with four seeds. Outside are
/// those of both, whose damping is much the same at all amplitudes: one mode follows them to the noise.
#[test]
fn so_do_those_of_a_few_cycles() {
    for z in off(&FEW_CYCLES) {
        assert!(inside(&z) >= 74, "{} of 80", inside(&z));
    }
}
