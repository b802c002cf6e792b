//! Releases by an integrator that has nothing in common with the program's: Runge-Kutta of fourth order, a turn of the
//! model found by halving, dry friction holding it there.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::array::from_fn;
use std::fmt::Write as _;
use std::path::Path;

/// The sizes of the car, Izz and the air.
pub const LENGTH_M: f64 = 0.625;
pub const AREA_M2: f64 = 0.036;
pub const DENSITY_KG_M3: f64 = 1.2;
pub const INERTIA_KG_M2: f64 = 0.101;

/// 1/2 rho V^p A l^(3 - p) over Izz: of a derivative of this power of the speed.
pub fn per_izz(wind_speed_m_s: f64, power: i32) -> f64 {
    0.5 * DENSITY_KG_M3 * wind_speed_m_s.powi(power) * AREA_M2 * LENGTH_M.powi(3 - power)
        / INERTIA_KG_M2
}

/// What is planted beside springs and viscous damping.
pub struct Planted<'a> {
    /// Over Izz, of angle, rate, a state and wind speed.
    pub moment: &'a dyn Fn(f64, f64, f64, f64) -> f64,
    /// How fast the state changes, which is zero at the release.
    pub state: &'a dyn Fn(f64, f64, f64, f64) -> f64,
    pub friction_rad_s2: f64,
    pub damping_ratio: f64,
}

impl Planted<'_> {
    /// Angles in rad from `amplitude_rad` on, every `step_s`.
    fn angles(
        &self,
        stiffness: f64,
        wind_m_s: f64,
        amplitude_rad: f64,
        step_s: f64,
        count: usize,
    ) -> Vec<f64> {
        let c = 2.0 * self.damping_ratio * stiffness.sqrt();
        let free =
            |b: f64, r: f64, x: f64| -stiffness * b - c * r + (self.moment)(b, r, x, wind_m_s);
        let mut state = [amplitude_rad, 0.0, 0.0];
        // 0: at rest.
        let mut direction = 0.0f64;
        let rub = self.friction_rad_s2;
        let step = |y: [f64; 3], h: f64, direction: f64| {
            let f = |[b, r, x]: [f64; 3]| {
                [r, free(b, r, x) - rub * direction, (self.state)(b, r, x, wind_m_s)]
            };
            let after = |k: [f64; 3], h: f64| from_fn(|i| y[i] + h * k[i]);
            let k1 = f(y);
            let k2 = f(after(k1, h / 2.0));
            let k3 = f(after(k2, h / 2.0));
            let k4 = f(after(k3, h));
            after(from_fn(|i| (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]) / 6.0), h)
        };
        let mut out = Vec::with_capacity(count);
        for _ in 0..count {
            out.push(state[0]);
            let mut left = step_s;
            while left > 0.0 {
                if direction == 0.0 {
                    // Held, or let go.
                    let pull = free(state[0], 0.0, state[2]);
                    if pull.abs() <= rub {
                        break;
                    }
                    direction = pull.signum();
                }
                let next = step(state, left, direction);
                if rub == 0.0 || next[1] * direction >= 0.0 {
                    state = next;
                    break;
                }
                let (mut before, mut after) = (0.0, left);
                for _ in 0..60 {
                    let middle = 0.5 * (before + after);
                    match step(state, middle, direction)[1] * direction >= 0.0 {
                        true => before = middle,
                        false => after = middle,
                    }
                }
                let [b, _, x] = step(state, after, direction);
                state = [b, 0.0, x];
                left -= after;
                direction = 0.0;
            }
        }
        out
    }
}

/// How the releases are made.
pub struct Made<'a> {
    pub springs: &'a [(&'a str, f64)],
    pub speeds_m_s: &'a [f64],
    pub amplitude_deg: f64,
    pub seconds: f64,
    pub rate_hz: f64,
    pub noise_deg: f64,
    pub seed: u64,
}

/// Writes the releases about the middle axis and their `campaign.toml` to `folder`.
pub fn campaign(folder: &Path, made: &Made, planted: &Planted) {
    let mut file = format!(
        "schema_version = 1\n[model]\nname = \"by hand\"\nlength_m = {LENGTH_M}\nfrontal_area_m2 = {AREA_M2}\n\
         [air]\ndensity_kg_m3 = {DENSITY_KG_M3}\n[rig]\nspring_arm_m = 0.1\naxis_offset_m = 0.05\n"
    );
    let mut rng = ChaCha8Rng::seed_from_u64(made.seed);
    for &(spring, stiffness_n_m) in made.springs {
        for &wind in made.speeds_m_s {
            let name = format!("{spring}-{wind}.csv");
            let stiffness = 2.0 * stiffness_n_m * 0.01 / INERTIA_KG_M2;
            let (step_s, amplitude) = (made.rate_hz.recip(), made.amplitude_deg.to_radians());
            let count = (made.seconds * made.rate_hz) as usize;
            // Steps of an eighth of a sample at most.
            let fine = planted.angles(stiffness, wind, amplitude, step_s / 8.0, 8 * count);
            let mut text = "time_s,yaw_deg\n".to_owned();
            for (k, yaw) in fine.iter().step_by(8).enumerate() {
                let noise: f64 = StandardNormal.sample(&mut rng);
                let yaw_deg = yaw.to_degrees() + made.noise_deg * noise;
                let _ = writeln!(text, "{:.4},{yaw_deg:.5}", k as f64 * step_s);
            }
            std::fs::write(folder.join(&name), text).expect("room for it");
            let _ = write!(
                file,
                "[[release]]\nfile = \"{name}\"\nspring = \"{spring}\"\nspring_stiffness_n_per_m = {stiffness_n_m:?}\n\
                 axis = \"mid\"\nwind_speed_m_s = {wind:?}\n"
            );
        }
    }
    std::fs::write(folder.join("campaign.toml"), file).expect("room for it");
}
