//! A second decaying mode in the reading: + amplitude exp(-zeta2 w2 t) cos(w2 t + phase), of a support that
//! gives way.

use super::lines;
use super::law::{any, not_negative, numbers, within, Card, Equation, Law, LineParameters, Parameter, Scale, Seen};
use crate::record::Called;
use super::terms::{Reading, Rotation, Terms};

pub(super) struct SecondMode;

/// Nearer than this share to the yaw mode, or to standing still, it imitates whatever varies slowly,
const NEAREST_MODE: f64 = 0.3;
/// unless one mode alone leaves this share of the amplitude, as beats do, and the record parts the two: by so
/// many turns.
const BEATS: f64 = 0.08;
const RESOLVED_TURNS: f64 = 1.5;
/// Cycles after the release in which it shows best.
const EARLY_CYCLES: f64 = 6.0;
/// Damping ratio at which the fit begins.
const START_DAMPING: f64 = 0.02;
/// Of the users' numbers: the fit varies cosine and sine part.
const EQUATION: &str =
    "amplitude * exp(-zeta2 * w2 * t) * cos(w2 * sqrt(1 - zeta2 * zeta2) * t + phase)";

impl Law for SecondMode {
    fn id(&self) -> &'static str {
        "second_mode"
    }

    fn parameters(&self) -> &[Parameter] {
        static PARAMETERS: [Parameter; 4] = [
            not_negative("amplitude", "rad"),
            any("phase", "rad"),
            not_negative("w2", "rad/s"),
            within("zeta2", "1", 0.001, 0.3),
        ];
        &PARAMETERS
    }

    fn line(&self) -> Option<LineParameters> {
        Some(LineParameters {
            size: 0,
            phase: 1,
            frequency: 2,
            damping: Some(3),
            nearest: NEAREST_MODE,
            slowest: NEAREST_MODE,
        })
    }

    fn sizes(&self, scale: &Scale) -> Vec<f64> {
        vec![scale.reading_rad, scale.reading_rad, 1.0 / scale.duration_s, 0.1]
    }

    fn starts(&self, seen: &Seen) -> Vec<Vec<f64>> {
        let count = (EARLY_CYCLES * seen.per_cycle) as usize;
        let early = &seen.residuals_rad[..count.min(seen.residuals_rad.len())];
        let mut lines = seen.lines(&[early, seen.residuals_rad], NEAREST_MODE, NEAREST_MODE);
        lines.extend(beating(seen));
        lines.into_iter().map(|w| vec![0.0, 0.0, w, START_DAMPING]).collect()
    }

    fn write(&self, p: &[f64], terms: &mut Terms) {
        terms.add_reading::<Self>(p);
    }

    fn equation(&self) -> Option<Equation<'_>> {
        Some(Equation::Reading(EQUATION))
    }

    fn card(&self) -> Card<'_> {
        Card {
            title: "A second mode in the reading",
            formula: "reading + a exp(-zeta2 w2 t) cos(w2 t + phase)",
            cause: "flexible support or shaft, sensor mount shaking",
            fingerprint: "a line in the residual's spectrum away from the natural frequency, dying out after the release",
            confirm: "tap the support with the model clamped",
            remove: "stiffen the support or the sensor's mount",
            release: "a longer record, in which it dies out and forcing does not",
        }
    }

    fn card_in(&self, motion: Called) -> Card<'_> {
        let card = self.card();
        match motion {
            Called::Pendulum => Card {
                cause: "a rod that bends, a bob that turns on its string, a swing across, a stand that shakes",
                confirm: "tap the stand with the pendulum held; look along the axis",
                remove: "stiffen rod, joint and stand; let go without a push aside",
                ..card
            },
            Called::Roll => Card {
                cause: "heave, pitch or sway that the sensor sees, its mount shaking",
                confirm: "record heave and pitch beside roll",
                remove: "put the sensor on the roll axis, heel without pressing it down",
                ..card
            },
            _ => card,
        }
    }
}

/// Frequencies near the yaw mode, rad/s, of which one may beat with it.
fn beating(seen: &Seen) -> Vec<f64> {
    let n = seen.residuals_rad.len().max(1) as f64;
    let square = seen.residuals_rad.iter().map(|r| r * r).sum::<f64>() / n;
    if !seen.beats || square.sqrt() < BEATS * seen.scale.reading_rad {
        return Vec::new();
    }
    let wn = seen.natural_frequency_rad_s;
    let apart = RESOLVED_TURNS * std::f64::consts::TAU / (n * seen.step_s);
    let sides = [(wn + apart, (1.0 + NEAREST_MODE) * wn), ((1.0 - NEAREST_MODE) * wn, wn - apart)];
    let strongest = lines::strongest(seen.residuals_rad, seen.step_s, sides);
    let found = sides.into_iter().zip(strongest);
    found.filter(|((from, to), _)| from < to).map(|(_, strongest)| strongest).collect()
}

impl Reading for SecondMode {
    #[inline]
    fn change(p: &[f64], _yaw_rad: f64, time_s: f64) -> f64 {
        let [cosine, sine, w2, zeta2] = numbers(p);
        let damped = w2 * (1.0 - zeta2 * zeta2).sqrt();
        let (s, c) = (damped * time_s).sin_cos();
        (-zeta2 * w2 * time_s).exp() * (cosine * c + sine * s)
    }

    fn add_changes(p: &[f64], _seen: &[f64], start_s: f64, step_s: f64, sums: &mut [f64]) {
        let [cosine, sine, w2, zeta2] = numbers(p);
        let damped = w2 * (1.0 - zeta2 * zeta2).sqrt();
        let mut mode = Rotation::new([cosine, sine], damped, zeta2 * w2, [start_s, step_s]);
        for sum in sums {
            *sum += mode.step();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_decays_from_its_amplitude() {
        let period_s = std::f64::consts::TAU / (20.0 * (1.0 - 0.02f64 * 0.02).sqrt());
        let p = [0.01, 0.0, 20.0, 0.02];
        assert!((SecondMode::change(&p, 0.1, 0.0) - 0.01).abs() < 1e-15);
        let later = 0.01 * (-0.02 * 20.0 * period_s).exp();
        assert!((SecondMode::change(&p, 0.1, period_s) - later).abs() < 1e-15);
    }

    #[test]
    fn followed_step_by_step_it_is_what_it_is_at_each_instant() {
        let p = [0.01, -0.004, 20.0, 0.002];
        let (seen, mut sums) = (vec![0.1; 30_000], vec![0.0; 30_000]);
        SecondMode::add_changes(&p, &seen, 0.3, 0.002, &mut sums);
        for (k, sum) in sums.iter().enumerate() {
            let alone = SecondMode::change(&p, 0.1, 0.3 + k as f64 * 0.002);
            assert!((sum - alone).abs() < 1e-12, "{k}: {sum} {alone}");
        }
    }
}
