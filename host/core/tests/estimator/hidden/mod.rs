//! Records with a hidden effect, from another integrator and sensor chain than the fits': Euler steps of 20
//! us with stiction by impulse or Runge-Kutta steps, noise white or coloured, a converter's step, a hand that
//! holds.

pub mod laws;

pub use laws::Outside;

use laws::{draw, most, Law};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::path::PathBuf;
use yawrig_core::effects::Effect;
use yawrig_core::fit::fitting::fit_plain;
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::record::Record;
use yawrig_rig::runge_kutta;

/// Those that are hidden: below 20 deg a pendulum is a cube, and |b| b is as near to both.
pub fn hidden() -> Vec<Effect> {
    let alike = [Effect::PendulumGravity, Effect::OddQuadraticStiffness];
    Effect::ALL.into_iter().filter(|e| !alike.contains(e) && !e.is_flexible()).collect()
}

/// The number in an environment variable, or `default`.
pub fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|n| n.parse().ok()).unwrap_or(default)
}

/// What was planted.
pub struct Planted {
    pub record: Record,
    pub natural_frequency_rad_s: f64,
    pub damping_ratio: f64,
    /// Users' numbers of each effect.
    pub effects: Vec<(Effect, Vec<f64>)>,
    /// True noise of a block mean, rad.
    pub noise_rad: f64,
    /// Rig and sensor in words, for what is printed.
    pub described: String,
}

/// What to hide; everything else is drawn from the seed.
#[derive(Clone, Default)]
pub struct Plan {
    pub effects: Vec<Effect>,
    pub outside: Option<Outside>,
    pub seed: u64,
    /// The same release and effects, sampled at this rate instead of the drawn one.
    pub rate_hz: Option<f64>,
    /// Effects of a quarter to half of the size, under a coarse sensor with coloured noise.
    pub faint: bool,
    /// Effects of such a size that the plain model fails by twenty to two hundred times the noise.
    pub far: bool,
}

/// Of a size that is plainly visible, how much a faint effect has.
const FAINT: (f64, f64) = (0.25, 0.5);
/// A turn in 4096 steps, and how the noise of neighbouring samples is correlated.
const COARSE_STEP_DEG: f64 = 0.088;
const CORRELATION: f64 = 0.6;

/// The rig and the sensor of one record.
#[derive(Clone, Debug)]
pub struct Setup {
    pub wn: f64,
    pub zeta: f64,
    /// Signed, rad.
    pub amplitude: f64,
    rate: f64,
    rate_hz: f64,
    pub duration: f64,
    hold_s: f64,
    hold_movement: f64,
    noise_deg: f64,
    pub lag_one: f64,
    step_deg: f64,
    runge_kutta: bool,
}

fn log_uniform(rng: &mut ChaCha8Rng, from: f64, to: f64) -> f64 {
    rng.random_range(from.ln()..to.ln()).exp()
}

impl Setup {
    pub fn draw(rng: &mut ChaCha8Rng) -> Self {
        loop {
            let wn = log_uniform(rng, 2.5, 26.0);
            let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
            let amplitude = sign * rng.random_range(5f64..20.0).to_radians();
            let held = rng.random_bool(0.5);
            let rate_hz = [200.0, 250.0, 500.0, 1000.0][rng.random_range(0..4)];
            let coarsest = if rng.random_bool(0.3) { 0.1 } else { 0.02 };
            let setup = Self {
                wn,
                zeta: log_uniform(rng, 0.001, 0.05),
                amplitude,
                rate: if rng.random_bool(0.3) {
                    rng.random_range(-0.05..0.05) * wn * amplitude
                } else {
                    0.0
                },
                rate_hz,
                duration: rng.random_range(10.0..60.0),
                hold_s: if held { rng.random_range(0.5..3.0) } else { 0.0 },
                hold_movement: if rng.random_bool(0.5) { 0.0 } else { 0.01 * amplitude.abs() },
                noise_deg: log_uniform(rng, 0.02, 0.1),
                lag_one: if rng.random_bool(0.3) { rng.random_range(0.5..0.95) } else { 0.0 },
                step_deg: log_uniform(rng, 0.005, coarsest),
                runge_kutta: rng.random_bool(0.5),
            };
            // Ten cycles at least.
            if setup.duration * wn > 60.0 {
                return setup;
            }
        }
    }
}

/// Plants each effect at a size at which the plain model alone fails by two to twenty times the noise, or by
/// what the plan says.
pub fn plant(plan: &Plan) -> Planted {
    let mut rng = ChaCha8Rng::seed_from_u64(plan.seed);
    for _ in 0..200 {
        let mut setup = Setup::draw(&mut rng);
        if plan.faint {
            (setup.step_deg, setup.lag_one) = (COARSE_STEP_DEG, CORRELATION);
        }
        let mut laws: Vec<Law> = plan
            .effects
            .iter()
            .map(|e| Law::Known(e.clone(), draw(e.clone(), &setup, &mut rng)))
            .collect();
        let shape = rng.random_range(0.0..1.0);
        laws.extend(plan.outside.map(|o| Law::Outside(o, 1.0, shape)));
        let noise_seed = rng.random_range(0..u64::MAX);
        let sized: Option<Vec<Law>> = laws
            .into_iter()
            .map(|law| {
                let (least, most) = if plan.far { (20.0, 200.0) } else { (2.5, 20.0) };
                let target = log_uniform(&mut rng, least, most);
                scaled(&setup, law, target, noise_seed)
            })
            .collect();
        let Some(mut laws) = sized else { continue };
        if plan.faint {
            laws.iter_mut().for_each(|law| law.weaken(log_uniform(&mut rng, FAINT.0, FAINT.1)));
        }
        let sampled = Setup { rate_hz: plan.rate_hz.unwrap_or(setup.rate_hz), ..setup };
        let planted = simulate(&sampled, &laws, noise_seed);
        // The sum of two may still give no oscillation.
        if is_swing(&planted.record) && FreeDecay::from_record(&planted.record).is_ok() {
            return planted;
        }
    }
    panic!("no rig shows {:?} {:?}", plan.effects, plan.outside);
}

/// `law` at the size at which the plain fit leaves `target` times the noise; none where it cannot.
pub fn scaled(setup: &Setup, mut law: Law, target: f64, noise_seed: u64) -> Option<Law> {
    let most = most(&law, setup);
    law.scale(most.min(1.0));
    let mut left = most / most.min(1.0);
    for _ in 0..6 {
        let planted = simulate(setup, std::slice::from_ref(&law), noise_seed);
        if !is_swing(&planted.record) {
            return None;
        }
        let decay = FreeDecay::from_record(&planted.record).ok()?;
        if (decay.yaw_rad.len() as f64) < 5.0 * decay.per_cycle() {
            law.scale(0.3);
            left /= 0.3;
            continue;
        }
        let plain = fit_plain(&decay, false, decay.yaw_rad.len());
        let ratio = plain.rms_rad() / planted.noise_rad;
        if ratio > 0.7 * target && ratio < 1.4 * target {
            return Some(law);
        }
        let misfit = (ratio * ratio - 1.0).max(0.04).sqrt();
        let step = ((target * target - 1.0).sqrt() / misfit).clamp(0.02, 30.0);
        // Random forcing grows with the root of its intensity.
        let step = if law.is_intensity() { step * step } else { step }.min(left);
        if (step - 1.0).abs() < 1e-6 {
            return None;
        }
        law.scale(step);
        left /= step;
    }
    None
}

struct State {
    b: f64,
    r: f64,
    /// State of a law with hysteresis.
    z: f64,
}

pub fn simulate(setup: &Setup, laws: &[Law], noise_seed: u64) -> Planted {
    let mut rng = ChaCha8Rng::seed_from_u64(noise_seed);
    let rough = laws.iter().any(Law::is_rough);
    let step_s = if setup.runge_kutta && !rough { 0.25e-3 } else { 20e-6 };
    let per_sample = (1.0 / (setup.rate_hz * step_s)).round() as usize;
    let held = (setup.hold_s * setup.rate_hz) as usize;
    let count = held + (setup.duration * setup.rate_hz) as usize;
    let held_z = laws.iter().map(|l| l.held(setup)).sum();
    let mut x = State { b: setup.amplitude, r: setup.rate, z: held_z };
    let mut past: Vec<f64> = Vec::new();
    let (mut time_s, mut yaw_deg, mut errors) = (Vec::new(), Vec::new(), Vec::new());
    let mut colour: f64 = StandardNormal.sample(&mut rng);
    for k in 0..count {
        let t = k.saturating_sub(held) as f64 / setup.rate_hz;
        let free = k >= held;
        let mut reading = x.b;
        if free {
            reading += laws.iter().map(|l| l.reading(setup, x.b, t)).sum::<f64>();
        } else {
            reading += setup.hold_movement * (2.3 * (k as f64 - held as f64) / setup.rate_hz).sin();
        }
        let z: f64 = StandardNormal.sample(&mut rng);
        colour = setup.lag_one * colour + (1.0 - setup.lag_one.powi(2)).sqrt() * z;
        let truth = reading.to_degrees();
        let read = ((truth + setup.noise_deg * colour) / setup.step_deg).round() * setup.step_deg;
        time_s.push(k as f64 / setup.rate_hz);
        yaw_deg.push(read);
        if !free {
            continue;
        }
        errors.push((read - truth).to_radians());
        for i in 0..per_sample {
            let t = t + i as f64 * step_s;
            past.push(x.b);
            if rough || !setup.runge_kutta {
                euler(setup, laws, &mut x, t, step_s, &past, &mut rng);
            } else {
                x = stepped(setup, laws, &x, t, step_s, &past);
            }
        }
    }
    let record = Record::new(PathBuf::from("planted.csv"), time_s, yaw_deg);
    Planted {
        noise_rad: mean_noise(&errors, &record),
        record,
        natural_frequency_rad_s: setup.wn,
        damping_ratio: setup.zeta,
        effects: laws.iter().filter_map(Law::known).collect(),
        described: format!(
            "wn {:.2} zeta {:.4} A {:.1} {:.0} Hz {:.0} s held {:.1} noise {:.3} lag {:.2} step {:.3} {}",
            setup.wn,
            setup.zeta,
            setup.amplitude.to_degrees(),
            setup.rate_hz,
            setup.duration,
            setup.hold_s,
            setup.noise_deg,
            setup.lag_one,
            setup.step_deg,
            laws.iter().map(Law::described).collect::<Vec<_>>().join(" ")
        ),
    }
}

/// Whether the model has not been driven round.
fn is_swing(record: &Record) -> bool {
    record.yaw_deg.iter().all(|y| y.abs() < 180.0)
}

/// Rms of the sensor's errors on the blocks that the diagnosis takes means of.
fn mean_noise(errors: &[f64], record: &Record) -> f64 {
    if !is_swing(record) {
        return f64::NAN;
    }
    let Ok(decay) = FreeDecay::from_record(record) else { return f64::NAN };
    let blocks = errors.chunks_exact(decay.block);
    let n = blocks.len() as f64;
    let sum: f64 = blocks.map(|b| (b.iter().sum::<f64>() / decay.block as f64).powi(2)).sum();
    (sum / n).sqrt()
}

fn moment(setup: &Setup, laws: &[Law], x: &State, t: f64, past: &[f64], step_s: f64) -> f64 {
    let spring = laws.iter().find_map(|l| l.spring(x.b)).unwrap_or(x.b);
    let stiffness = laws.iter().map(|l| l.stiffness(setup, t)).product::<f64>();
    -setup.wn.powi(2) * stiffness * spring - 2.0 * setup.zeta * setup.wn * x.r
        + laws.iter().map(|l| l.moment(setup, x.b, x.r, x.z, t, past, step_s)).sum::<f64>()
}

/// Semi-implicit, friction as an impulse that cannot turn the motion round.
fn euler(
    setup: &Setup,
    laws: &[Law],
    x: &mut State,
    t: f64,
    h: f64,
    past: &[f64],
    rng: &mut ChaCha8Rng,
) {
    let mut m = moment(setup, laws, x, t, past, h);
    let q: f64 = laws.iter().map(Law::intensity).sum();
    if q > 0.0 {
        let z: f64 = StandardNormal.sample(rng);
        m += (q / h).sqrt() * z;
    }
    let c: f64 = laws.iter().map(|l| l.friction(setup, x.b)).sum();
    let free = x.r + h * m;
    x.z += h * laws.iter().map(|l| l.memory(setup, x.r, x.z)).sum::<f64>();
    x.r = if free.abs() <= h * c { 0.0 } else { free - h * c * free.signum() };
    x.b += h * x.r;
}

fn stepped(setup: &Setup, laws: &[Law], x: &State, t: f64, h: f64, past: &[f64]) -> State {
    let [b, r, z] = runge_kutta([x.b, x.r, x.z], h, |dt, [b, r, z]| {
        let memory = laws.iter().map(|l| l.memory(setup, r, z)).sum();
        [r, moment(setup, laws, &State { b, r, z }, t + dt, past, h), memory]
    });
    State { b, r, z }
}
