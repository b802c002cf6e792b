//! The potentiometer and its converter.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Counts at zero degrees: the middle of a 16-bit converter.
const ZERO_COUNTS: f64 = 32768.0;

/// What a sensor sees of the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sees {
    /// The yaw angle: a potentiometer.
    #[default]
    Angle,
    /// The yaw rate: a gyroscope.
    Rate,
    /// The yaw acceleration.
    Acceleration,
}

/// How the yaw angle is read. Where another derivative of it is seen, `deg` is deg/s or deg/s2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    pub sees: Sees,
    pub rate_hz: f64,
    /// Rms of the noise, deg.
    pub noise_deg: f64,
    /// Correlation of the noise from one sample to the next (first-order autoregressive); 0: white.
    pub noise_correlation: f64,
    /// Reading with the model at rest, deg.
    pub offset_deg: f64,
    /// One count of the 16-bit converter, deg; 0: read without a converter.
    pub adc_step_deg: f64,
}

impl Default for Sensor {
    /// 1 kHz, 0.05 deg white noise, 0.005 deg a count.
    fn default() -> Self {
        Self {
            sees: Sees::Angle,
            rate_hz: 1000.0,
            noise_deg: 0.05,
            noise_correlation: 0.0,
            offset_deg: 0.0,
            adc_step_deg: 0.005,
        }
    }
}

/// A sensor reading sample after sample.
#[derive(Clone, Debug)]
pub(super) struct Reader {
    sensor: Sensor,
    random: ChaCha8Rng,
    /// The last noise over its rms.
    noise: f64,
}

impl Reader {
    pub(super) fn new(sensor: &Sensor, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let noise = StandardNormal.sample(&mut random);
        Self { sensor: *sensor, random, noise }
    }

    /// What is read at `yaw_deg`: degrees, and counts where there is a converter. It stays at its ends beyond
    /// them.
    pub(super) fn read(&mut self, yaw_deg: f64) -> (f64, Option<u16>) {
        let Sensor { noise_deg, noise_correlation, offset_deg, adc_step_deg, .. } = self.sensor;
        let fresh: f64 = StandardNormal.sample(&mut self.random);
        let share = (1.0 - noise_correlation * noise_correlation).sqrt();
        self.noise = noise_correlation * self.noise + share * fresh;
        let reading_deg = yaw_deg + offset_deg + noise_deg * self.noise;
        if adc_step_deg == 0.0 {
            return (reading_deg, None);
        }
        let counts =
            ((reading_deg / adc_step_deg).round() + ZERO_COUNTS).clamp(0.0, f64::from(u16::MAX));
        ((counts - ZERO_COUNTS) * adc_step_deg, Some(counts as u16))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn readings(sensor: &Sensor, seed: u64, count: usize) -> Vec<f64> {
        let mut reader = Reader::new(sensor, seed);
        (0..count).map(|_| reader.read(0.0).0).collect()
    }

    fn rms_and_correlation(noise: &[f64]) -> (f64, f64) {
        let power: f64 = noise.iter().map(|x| x * x).sum();
        let lag: f64 = noise.windows(2).map(|x| x[0] * x[1]).sum();
        ((power / noise.len() as f64).sqrt(), lag / power)
    }

    #[test]
    fn noise_has_the_asked_rms_and_correlation() {
        for correlation in [0.0, 0.9, 0.99] {
            let sensor = Sensor {
                noise_deg: 0.1,
                noise_correlation: correlation,
                adc_step_deg: 0.0,
                ..Sensor::default()
            };
            let (rms, found) = rms_and_correlation(&readings(&sensor, 7, 1_000_000));
            // 4 standard errors of the rms and of the correlation of a million autoregressive samples.
            let spread =
                ((1.0 + correlation * correlation) / (1.0 - correlation * correlation)).sqrt();
            assert!((rms / 0.1 - 1.0).abs() < 4.0 * spread / 2e6f64.sqrt(), "{correlation}: {rms}");
            let error = ((1.0f64 - correlation * correlation) / 1e6).sqrt();
            assert!((found - correlation).abs() < 4.0 * error, "{correlation}: {found}");
        }
    }

    #[test]
    fn the_seed_alone_decides_the_noise() {
        let sensor = Sensor::default();
        assert_eq!(readings(&sensor, 3, 100), readings(&sensor, 3, 100));
        assert_ne!(readings(&sensor, 3, 100), readings(&sensor, 4, 100));
    }

    #[test]
    fn the_converter_rounds_and_saturates() {
        let sensor = Sensor { noise_deg: 0.0, offset_deg: 1.0, ..Sensor::default() };
        let mut reader = Reader::new(&sensor, 1);
        assert_eq!(reader.read(-1.0), (0.0, Some(32768)));
        let (yaw_deg, counts) = reader.read(0.0062);
        assert_eq!(counts, Some(32768 + 201));
        assert!((yaw_deg - 1.005).abs() < 1e-12);
        assert_eq!(reader.read(500.0).1, Some(65535));
        assert_eq!(reader.read(-500.0).1, Some(0));
    }
}
