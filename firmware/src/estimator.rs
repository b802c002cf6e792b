//! From windows to a release's result.

use yawrig_shared::network::{Estimate, Network, Number};
use yawrig_shared::numbers::{Numbers, MAX_NUMBERS};
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

/// Variance that noise gives a mean over windows, by their scatter and the variance of a single one: the
/// scatter of few windows says little of itself (Student); that of the fewest nothing.
pub fn by_noise(scatter: f32, windows: u16, single: f32) -> f32 {
    let count = f32::from(windows);
    if windows > 4 {
        scatter * (count - 1.0) / (count - 3.0)
    } else {
        scatter.max(single / count)
    }
}

/// Collects a release's windows.
#[derive(Clone, Copy, Debug, Default)]
pub struct Collector {
    count: u16,
    natural_frequency: Mean,
    damping: Mean,
    numbers: [Mean; MAX_NUMBERS],
}

impl Collector {
    /// Adds a window. Its variance goes with the noise over the amplitude, squared, so late
    /// windows count for little.
    /// What a number's goes with, its network says.
    pub fn add(&mut self, estimate: &Estimate, amplitude_deg: f32, numbers: &[Number]) {
        self.count = self.count.saturating_add(1);
        let weight = amplitude_deg * amplitude_deg;
        self.natural_frequency.add(estimate.natural_frequency_rad_s, weight);
        self.damping.add(estimate.damping_ratio, weight);
        let means = self.numbers.iter_mut().zip(numbers);
        for ((mean, number), value) in means.zip(estimate.numbers.iter()) {
            let power = (0..number.amplitude_power).fold(1.0, |power, _| power * amplitude_deg);
            mean.add(*value, power);
        }
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

    /// The same of the numbers of effects; none before a window.
    pub fn numbers(&self, network: &Network) -> Numbers<Measured> {
        let of = |(mean, number): (&Mean, &Number)| {
            let Number { test_rms, bias_rms, .. } = number;
            let mut measured = mean.result(self.count, *test_rms, 0.0);
            if self.count > 1 {
                let noise = by_noise(measured.u * measured.u, self.count, test_rms * test_rms);
                measured.u = libm::sqrtf(noise + bias_rms * bias_rms);
            }
            measured
        };
        let numbers = network.numbers.iter().filter(|_| self.count > 0);
        self.numbers.iter().zip(numbers).map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use yawrig_shared::network::OutputScaling;

    #[test]
    fn mean_and_scatter_are_the_textbook_s() {
        let values = [(12.72_f32, 0.0055_f32, 9.0_f32), (12.80, 0.0064, 5.0), (12.92, 0.0068, 2.0)];
        let mut collector = Collector::default();
        for (f, d, a) in values {
            let estimate =
                Estimate { natural_frequency_rad_s: f, damping_ratio: d, ..Estimate::default() };
            collector.add(&estimate, a, &[]);
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
        let estimate = Estimate {
            natural_frequency_rad_s: 5.0,
            damping_ratio: 0.1,
            numbers: [0.25].into_iter().collect(),
        };
        let mut network = Network::empty();
        let scaling = OutputScaling { offset: 0.0, gain: 1.0 };
        let number = Number { scaling, test_rms: 0.0625, bias_rms: 0.5, amplitude_power: 0 };
        network.numbers.push(number).unwrap();
        assert!(collector.numbers(&network).is_empty());
        collector.add(&estimate, 5.0, &network.numbers);
        assert_eq!(*collector.numbers(&network), [Measured { value: 0.25, u: 0.0625 }]);
        assert_eq!(collector.result([0.01, 0.002], [0.0; 2])[1], Measured { value: 0.1, u: 0.002 });
    }

    #[test]
    fn a_number_s_windows_count_by_the_power_of_the_amplitude_its_network_says() {
        let mut network = Network::empty();
        for amplitude_power in [0, 3] {
            let scaling = OutputScaling { offset: 0.0, gain: 1.0 };
            let bias_rms = 0.125;
            let number = Number { scaling, test_rms: 0.0, bias_rms, amplitude_power };
            network.numbers.push(number).unwrap();
        }
        let mut collector = Collector::default();
        for (value, amplitude) in [(0.5_f32, 2.0), (0.25, 1.0)] {
            let numbers = [value, value].into_iter().collect();
            let estimate = Estimate { numbers, ..Estimate::default() };
            collector.add(&estimate, amplitude, &network.numbers);
        }
        let [even, steep] = *collector.numbers(&network) else { panic!("two") };
        // Half the difference of two that count alike; and 8 : 1.
        assert_eq!((even.value, even.u), (0.375, libm::sqrtf(0.125 * 0.125 * 2.0)));
        assert!((steep.value - (8.0 * 0.5 + 0.25) / 9.0).abs() < 1e-6);
    }
}
