//! The tracker against decays whose truth is known.

use yawrig_shared::features::{features, FeatureKind};
use yawrig_shared::window::{Finding, Limits, Tracker, Window};

struct Noise(u64);

impl Noise {
    /// Roughly Gaussian: the sum of twelve uniform numbers, less six.
    fn next(&mut self) -> f64 {
        (0..12)
            .map(|_| {
                self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (self.0 >> 11) as f64 / (1u64 << 53) as f64
            })
            .sum::<f64>()
            - 6.0
    }
}

struct Decay {
    wn: f64,
    zeta: f64,
    amplitude_deg: f64,
    phase: f64,
    offset_deg: f64,
    noise_deg: f64,
    seconds: f64,
}

impl Decay {
    fn yaw_deg(&self, t: f64) -> f64 {
        let wd = self.wn * (1.0 - self.zeta * self.zeta).sqrt();
        self.amplitude_deg * (-self.zeta * self.wn * t).exp() * (wd * t + self.phase).cos()
            + self.offset_deg
    }

    fn windows(&self, seed: u64) -> (Tracker<f32>, Vec<(Window, f32)>) {
        let mut noise = Noise(seed);
        let mut tracker = Tracker::<f32>::new(0.0, 1.0, Limits::default());
        let mut found = Vec::new();
        for i in 0..(self.seconds * 1000.0) as usize {
            let y = self.yaw_deg(i as f64 * 1e-3) + self.noise_deg * noise.next();
            if let (_, Some(Finding::Window(window))) = tracker.push(y as f32) {
                let f = features(FeatureKind::BinMeans, tracker.history(), &window);
                assert_eq!(window.end, i as u32, "closed by the sample that completes it");
                found.push((window, f.amplitude_deg));
            }
        }
        (tracker, found)
    }
}

#[test]
fn windows_are_three_cycles_long_over_the_whole_range() {
    println!("   wn   zeta  noise windows   first error   mean error   midline error");
    for wn in [2.5, 7.5, 15.5, 26.5_f64] {
        for zeta in [0.001, 0.01, 0.1_f64] {
            for noise_deg in [0.0, 0.05, 0.2] {
                let truth = 3000.0 * std::f64::consts::TAU / (wn * (1.0 - zeta * zeta).sqrt());
                let decay_s = 10.0_f64.ln() / (zeta * wn);
                let (mut first, mut mean, mut midline) = (0.0_f64, 0.0_f64, 0.0_f64);
                let seeds = 10;
                for seed in 0..seeds {
                    let decay = Decay {
                        wn,
                        zeta,
                        amplitude_deg: 11.0,
                        phase: 0.7 * seed as f64,
                        offset_deg: 3.3,
                        noise_deg,
                        seconds: (decay_s * 0.9).min(120.0).max(4.5 * truth * 1e-3 / 3.0),
                    };
                    let (_, windows) = decay.windows(seed);
                    assert!(!windows.is_empty(), "wn {wn} zeta {zeta} noise {noise_deg} {seed}");
                    let relative = |w: &Window| f64::from(w.length) / truth - 1.0;
                    first += relative(&windows[0].0).powi(2);
                    let all: f64 = windows.iter().map(|(w, _)| relative(w)).sum();
                    mean += (all / windows.len() as f64).powi(2);
                    midline += (f64::from(windows[0].0.midline_deg) - 3.3).powi(2);
                    if seed == 0 {
                        print!("{wn:5} {zeta:6} {noise_deg:6} {:7}", windows.len());
                    }
                }
                let rms = |x: f64| (x / seeds as f64).sqrt();
                println!("   {:.2e}      {:.2e}     {:.2e}", rms(first), rms(mean), rms(midline));
            }
        }
    }
}
