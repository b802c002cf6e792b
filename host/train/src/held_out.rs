//! How a network under training does on windows that it is not trained on.

use super::network::{Pass, Shape};
use super::{Epoch, Progress, Samples, Trained};
use std::ops::ControlFlow;

/// Epochs that are looked at lie so far apart, as a ratio; the first ones all are.
const RATIO: f64 = 1.15;

/// Errors on the held-out windows after an epoch.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOutEpoch {
    /// From 1.
    pub epoch: usize,
    /// Rms of each output, scaled units.
    pub rms: Vec<f64>,
}

/// A training's progress, passed on, and what each restart makes of the held-out windows.
pub(super) struct HeldOut<'a> {
    inner: &'a mut dyn Progress,
    samples: &'a Samples,
    shape: Shape,
    pass: Pass,
    seen: Vec<(usize, HeldOutEpoch)>,
}

impl<'a> HeldOut<'a> {
    pub fn new(samples: &'a Samples, topology: &[usize], inner: &'a mut dyn Progress) -> Self {
        let shape = Shape::new(topology);
        let pass = Pass::new(&shape, &samples.inputs, samples.n);
        Self { inner, samples, shape, pass, seen: Vec::new() }
    }

    /// Of the restart that was chosen, in order, its last epoch included.
    pub fn history(mut self, trained: &Trained) -> Vec<HeldOutEpoch> {
        let own =
            std::mem::take(&mut self.seen).into_iter().filter(|(of, _)| *of == trained.restart);
        let mut history: Vec<_> =
            own.map(|(_, e)| e).filter(|e| e.epoch < trained.epochs).collect();
        history.push(self.after(trained.epochs, &trained.weights));
        history
    }

    fn after(&mut self, epoch: usize, weights: &[f64]) -> HeldOutEpoch {
        let sums = self.pass.run(&self.shape, weights, &self.samples.targets);
        let rms = sums.iter().map(|sum| (sum / self.samples.n as f64).sqrt()).collect();
        HeldOutEpoch { epoch, rms }
    }
}

impl Progress for HeldOut<'_> {
    fn epoch(&mut self, epoch: &Epoch, weights: &[f64]) -> ControlFlow<()> {
        let step = |epoch: usize| ((epoch as f64).ln() / RATIO.ln()).floor();
        if epoch.epoch < 2 || step(epoch.epoch) > step(epoch.epoch - 1) {
            let seen = self.after(epoch.epoch, weights);
            self.seen.push((epoch.restart, seen));
        }
        self.inner.epoch(epoch, weights)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{forward, train, Options, Silent};
    use super::*;

    /// Two functions of two inputs, on a grid that begins at `from`.
    fn samples(n: usize, from: f64) -> Samples {
        let at = |k: usize| (from + 1.8 * k as f64 / n as f64, (k as f64 * 0.7).sin());
        Samples {
            inputs: (0..n).flat_map(|k| [at(k).0, at(k).1]).collect(),
            targets: (0..n).flat_map(|k| [at(k).0 * at(k).1, at(k).0.sin()]).collect(),
            n,
            d: 2,
            k: 2,
        }
    }

    #[test]
    fn the_curve_is_the_chosen_restarts_and_ends_with_its_network() {
        let (taught, held_out) = (samples(40, -0.9), samples(25, -0.87));
        let options = Options { hidden: vec![3], epochs: 60, restarts: 4, ..Options::default() };
        let topology = options.topology(&taught);
        let mut silent = Silent;
        let mut progress = HeldOut::new(&held_out, &topology, &mut silent);
        let trained = train(&taught, &options, &mut progress).unwrap();
        let restarts = progress.seen.iter().map(|(of, _)| *of).max();
        assert_eq!(restarts, Some(3), "every restart was looked at");
        let history = progress.history(&trained);
        let rising = history.windows(2).all(|pair| pair[0].epoch < pair[1].epoch);
        assert!(rising && history.len() > 10, "{history:?}");
        let last = history.last().unwrap();
        assert_eq!(last.epoch, trained.epochs);
        for output in 0..2 {
            let error = |k: usize| {
                let inputs = &held_out.inputs[2 * k..][..2];
                let out = forward(&topology, &trained.weights, inputs)[output];
                (held_out.targets[2 * k + output] - out).powi(2)
            };
            let rms = ((0..held_out.n).map(error).sum::<f64>() / held_out.n as f64).sqrt();
            assert!((last.rms[output] / rms - 1.0).abs() < 1e-9, "{rms} {last:?}");
            assert!(last.rms[output] < 0.2 * history[0].rms[output], "{history:?}");
        }
    }
}
