//! Whether natural frequency or damping ratio of a device's windows changes with amplitude: the first sign,
//! on the rig itself, that its model lacks something.

use serde_json::{json, Value};
use yawrig_shared::wire::WindowResult;

/// Two-sided 99.5 % points of Student's t for 1 to 10 degrees of freedom; for more the last is on the safe
/// side. A table: a crate of distributions would be compiled for these ten numbers.
const STUDENT: [f64; 10] = [127.3, 14.09, 7.453, 5.598, 4.773, 4.317, 4.029, 3.833, 3.690, 3.581];
/// Smallest changes reported, as a share: twice and more what a network's own errors make between windows.
const MIN_DAMPING: f64 = 0.1;
const MIN_FREQUENCY: f64 = 0.002;

/// What changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Changing {
    NaturalFrequency,
    DampingRatio,
}

/// A change with amplitude beyond the windows' own scatter: the straight line through them over the
/// amplitude, as drag makes it, or over its reciprocal, as friction does, at their largest and smallest
/// amplitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trend {
    pub changing: Changing,
    /// Largest and smallest amplitude, deg.
    pub amplitude_deg: [f64; 2],
    /// The value there: rad/s, or 1.
    pub value: [f64; 2],
}

/// What of these windows of one release changes with amplitude.
pub fn trends(windows: &[WindowResult]) -> Vec<Trend> {
    let of = |changing, least: f64, value: fn(&WindowResult) -> f32| {
        let points: Vec<[f64; 2]> = windows
            .iter()
            .map(|w| [f64::from(w.amplitude_deg), f64::from(value(w))])
            .filter(|[a, v]| *a > 0.0 && v.is_finite())
            .collect();
        trend(changing, &points).filter(|t| {
            let [first, last] = t.value.map(f64::abs);
            (t.value[1] - t.value[0]).abs() > least * first.max(last)
        })
    };
    let frequency = of(Changing::NaturalFrequency, MIN_FREQUENCY, |w| w.natural_frequency_rad_s);
    let damping = of(Changing::DampingRatio, MIN_DAMPING, |w| w.damping_ratio);
    frequency.into_iter().chain(damping).collect()
}

/// The likelier of the two laws, where it is beyond chance.
fn trend(changing: Changing, points: &[[f64; 2]]) -> Option<Trend> {
    let freedom = points.len().checked_sub(2).filter(|n| *n > 0)?;
    let lines = [line(points, |amplitude| amplitude), line(points, f64::recip)];
    let (size, value) = lines.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let [large, small] = ends(points);
    (size > STUDENT[freedom.min(STUDENT.len()) - 1] / (freedom as f64).sqrt()).then_some(Trend {
        changing,
        amplitude_deg: [large, small],
        value,
    })
}

fn ends(points: &[[f64; 2]]) -> [f64; 2] {
    points.iter().fold([0.0, f64::INFINITY], |[high, low], [a, _]| [a.max(high), a.min(low)])
}

/// Weighted regression of (amplitude, value) on `law` of the amplitude; a window's scatter is noise over
/// amplitude. The slope over its standard uncertainty and the root of the degrees of freedom, and the line at
/// both ends.
fn line(points: &[[f64; 2]], law: fn(f64) -> f64) -> (f64, [f64; 2]) {
    let weight: f64 = points.iter().map(|[a, _]| a * a).sum();
    let mean = |f: &dyn Fn(f64, f64) -> f64| {
        points.iter().map(|[a, v]| a * a * f(law(*a), *v)).sum::<f64>() / weight
    };
    let (x0, y0) = (mean(&|x, _| x), mean(&|_, y| y));
    let xx = mean(&|x, _| (x - x0).powi(2));
    let slope = mean(&|x, y| (x - x0) * (y - y0)) / xx;
    let left = mean(&|x, y| (y - y0 - slope * (x - x0)).powi(2));
    (slope.abs() * (xx / left).sqrt(), ends(points).map(|a| y0 + slope * (law(a) - x0)))
}

impl Trend {
    /// In a sentence; `effects` are those the network was trained with, apart by spaces.
    pub fn text(&self, effects: &str) -> String {
        let ([large, small], [from, to]) = (self.amplitude_deg, self.value);
        let rises = to > from;
        let (what, from, to) = match self.changing {
            Changing::NaturalFrequency => {
                ("natural frequency", format!("{from:.4}"), format!("{to:.4} rad/s"))
            }
            Changing::DampingRatio => ("damping ratio", format!("{from:.5}"), format!("{to:.5}")),
        };
        let guess = match (self.changing, rises) {
            (Changing::DampingRatio, true) => "friction?",
            (Changing::DampingRatio, false) => "drag that grows with the rate?",
            (Changing::NaturalFrequency, true) => "a spring that softens?",
            (Changing::NaturalFrequency, false) => "a spring that hardens, or play?",
        };
        let lacking = match effects {
            "" => "something other than a second-order model".to_owned(),
            effects => format!("something other than {}", effects.replace(' ', ", ")),
        };
        let verb = if rises { "rises" } else { "falls" };
        format!(
            "{what} {verb} from {from} at {large:.1} deg to {to} at {small:.1} deg as the amplitude falls: \
             {lacking} ({guess}); `yawrig diagnose` says which"
        )
    }

    pub fn to_json(&self) -> Value {
        let of = match self.changing {
            Changing::NaturalFrequency => "natural_frequency_rad_s",
            Changing::DampingRatio => "damping_ratio",
        };
        let ([large, small], [from, to]) = (self.amplitude_deg, self.value);
        json!({"of": of, "from_deg": large, "to_deg": small, "from": from, "to": to})
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use yawrig_shared::wire::Flags;

    /// Windows from 9 deg down, their damping ratio with noise over amplitude.
    fn windows(
        count: u16,
        seed: u64,
        scatter: f64,
        damping: impl Fn(f64) -> f64,
    ) -> Vec<WindowResult> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        (0..count)
            .map(|window| {
                let amplitude = 9.0 * (-2.0 * f64::from(window) / f64::from(count)).exp();
                let noise = random.sample::<f64, _>(rand_distr::StandardNormal);
                WindowResult {
                    release: 0,
                    window,
                    start_sample: 0,
                    end_sample: 0,
                    sent_sample: 0,
                    amplitude_deg: amplitude as f32,
                    midline_deg: 0.0,
                    natural_frequency_rad_s: 7.5,
                    damping_ratio: (damping(amplitude) + scatter * noise / amplitude) as f32,
                    numbers: Default::default(),
                    flags: Flags::default(),
                }
            })
            .collect()
    }

    #[test]
    fn friction_is_seen_and_told() {
        let found = trends(&windows(8, 1, 0.0005, |a| 0.012 + 0.02 / a));
        let [trend] = found[..] else { panic!("{found:?}") };
        assert_eq!(trend.changing, Changing::DampingRatio);
        assert!(trend.text("").starts_with("damping ratio rises from 0.01"), "{}", trend.text(""));
        assert!(trend
            .text("")
            .contains("as the amplitude falls: something other than a second-order"));
        assert!(trend.text("coulomb_friction free_play").contains("coulomb_friction, free_play"));
        let drag = trends(&windows(8, 1, 0.0005, |a| 0.012 + 0.001 * a));
        assert!(drag[0].text("").contains("falls"), "{drag:?}");
    }

    /// At 99.5 % of either law at most ten sets in a thousand are reported, give or take three.
    #[test]
    fn what_scatters_only_is_not_told_of() {
        let told = |seed| !trends(&windows(6, seed, 0.005, |_| 0.012)).is_empty();
        let count = (0..1000).filter(|seed| told(*seed)).count();
        println!("{count} of 1000");
        assert!((1..=20).contains(&count), "{count} of 1000");
        assert_eq!(trends(&windows(2, 1, 0.0, |a| 0.1 / a)), []);
        assert_eq!(trends(&windows(6, 1, 0.0, |_| 0.012)), []);
        assert_eq!(trends(&[]), []);
    }
}
