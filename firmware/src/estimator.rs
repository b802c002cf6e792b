//! From windows to a release's result.

use yawrig_shared::network::Estimate;
use yawrig_shared::wire::Measured;

/// Weighted mean and scatter of a quantity, a value at a time (West 1979).
#[derive(Clone, Copy, Debug, Default)]
struct Mean {
    weights: f32,
    mean: f32,
    squares: f32,
}

impl Mean {
    fn add(&mut self, value: f32, weight: f32) {
        self.weights += weight;
        let from_old = value - self.mean;
        self.mean += from_old * (weight / self.weights);
        self.squares += weight * from_old * (value - self.mean);
    }

    /// The mean and its standard uncertainty from the scatter of `count` values whose variance
    /// goes with the reciprocal weight; `single` is the uncertainty of one alone, `bias` what all
    /// have in common.
    fn result(&self, count: u16, single: f32, bias: f32) -> Measured {
        let u = match count {
            0 | 1 => single,
            _ => {
                let scatter = self.squares / ((count - 1) as f32 * self.weights);
                libm::sqrtf(scatter + bias * bias)
            }
        };
        Measured { value: self.mean, u }
    }
}

/// Collects a release's windows.
#[derive(Clone, Copy, Debug, Default)]
pub struct Collector {
    count: u16,
    natural_frequency: Mean,
    damping: Mean,
}

impl Collector {
    /// Adds a window. Its variance goes with the noise over the amplitude, squared, so late
    /// windows count for little.
    pub fn add(&mut self, estimate: &Estimate, amplitude_deg: f32) {
        self.count = self.count.saturating_add(1);
        let weight = amplitude_deg * amplitude_deg;
        self.natural_frequency.add(estimate.natural_frequency_rad_s, weight);
        self.damping.add(estimate.damping_ratio, weight);
    }

    pub fn count(&self) -> u16 {
        self.count
    }

    /// Natural frequency (rad/s) and damping ratio. `test_rms` is the network's error on one
    /// window, for a release that has only one; `bias_rms` its error without noise.
    pub fn result(&self, test_rms: [f32; 2], bias_rms: [f32; 2]) -> [Measured; 2] {
        [
            self.natural_frequency.result(self.count, test_rms[0], bias_rms[0]),
            self.damping.result(self.count, test_rms[1], bias_rms[1]),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_scatter_are_the_textbook_s() {
        let values = [(12.72_f32, 0.0055_f32, 9.0_f32), (12.80, 0.0064, 5.0), (12.92, 0.0068, 2.0)];
        let mut collector = Collector::default();
        for (f, d, a) in values {
            let estimate = Estimate { natural_frequency_rad_s: f, damping_ratio: d };
            collector.add(&estimate, a);
        }
        let w = values.map(|(_, _, a)| f64::from(a * a));
        let total: f64 = w.iter().sum();
        let mean = w.iter().zip(values).map(|(w, v)| w * f64::from(v.0)).sum::<f64>() / total;
        let square: f64 =
            w.iter().zip(values).map(|(w, v)| w * (f64::from(v.0) - mean).powi(2)).sum();
        let [f, d] = collector.result([0.0; 2], [0.0; 2]);
        assert!((f64::from(f.value) - mean).abs() < 1e-5);
        assert!((f64::from(f.u) - (square / (2.0 * total)).sqrt()).abs() < 1e-5);
        assert!(d.value > 0.0055 && d.value < 0.0064);
    }

    #[test]
    fn a_single_window_has_the_network_s_own_error() {
        let mut collector = Collector::default();
        collector.add(&Estimate { natural_frequency_rad_s: 5.0, damping_ratio: 0.1 }, 5.0);
        assert_eq!(collector.result([0.01, 0.002], [0.0; 2])[1], Measured { value: 0.1, u: 0.002 });
    }
}
