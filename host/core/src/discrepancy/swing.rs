//! An oscillation seen cycle by cycle: its phase, and means turned back by it.

use std::f64::consts::TAU;

/// The oscillation that a moment would shake.
#[derive(Clone, Debug)]
pub(crate) struct Swing {
    pub(crate) step_s: f64,
    /// Of the motion at each reading, rising.
    pub(crate) phase_rad: Vec<f64>,
    /// Amplitudes at the ends of the readings, in any unit.
    pub(crate) amplitudes: [f64; 2],
}

impl Swing {
    /// From angles, from rest, and rates, of a motion of about this natural frequency.
    pub(crate) fn of(step_s: f64, yaw_rad: &[f64], rate_rad_s: &[f64], wn: f64) -> Option<Self> {
        let mut phase_rad = Vec::with_capacity(yaw_rad.len());
        for (b, r) in yaw_rad.iter().zip(rate_rad_s) {
            let there = (-r / wn).atan2(*b);
            let before = phase_rad.last().copied().unwrap_or(there);
            phase_rad.push(there + ((before - there) / TAU).round() * TAU);
        }
        let last = yaw_rad.len().checked_sub(1)?;
        let amplitudes = [0, last].map(|k| yaw_rad[k].hypot(rate_rad_s[k] / wn));
        Some(Self { step_s, phase_rad, amplitudes })
    }

    pub(super) fn cycles(&self) -> f64 {
        let ends = self.phase_rad.first().zip(self.phase_rad.last());
        ends.map_or(0.0, |(first, last)| (last - first) / TAU)
    }

    fn seconds(&self) -> f64 {
        self.phase_rad.len() as f64 * self.step_s
    }

    /// 1/s.
    pub(super) fn decay(&self) -> f64 {
        (self.amplitudes[0] / self.amplitudes[1]).ln() / self.seconds()
    }

    pub(super) fn period_s(&self) -> f64 {
        self.seconds() / self.cycles()
    }

    pub(super) fn frequency_rad_s(&self) -> f64 {
        TAU * self.cycles() / self.seconds()
    }

    /// Means of `series`, turned back by `ratio` times the phase, over as many whole `cycles` each: cosines,
    /// then sines, scaled so that white noise has the same variance in all means.
    pub(super) fn means(&self, series: &[f64], ratio: f64, cycles: f64) -> [Vec<f64>; 2] {
        let count = (self.cycles() / cycles) as usize;
        let mut sums = [vec![0.0; count], vec![0.0; count]];
        let mut seen = vec![0.0_f64; count];
        for (y, phase) in series.iter().zip(&self.phase_rad) {
            let turned = phase - self.phase_rad[0];
            let which = (turned / (TAU * cycles)) as usize;
            if which < count {
                let (sin, cos) = (ratio * turned).sin_cos();
                sums[0][which] += y * cos;
                sums[1][which] += y * sin;
                seen[which] += 1.0;
            }
        }
        let scale = 2.0 * cycles.sqrt();
        let mean = |(sum, seen): (f64, &f64)| sum * scale / seen.max(1.0);
        sums.map(|sums| sums.into_iter().zip(&seen).map(mean).collect())
    }
}
