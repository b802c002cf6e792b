//! Training and testing as the studies do it: any inputs, f64, no device.

use super::report::percent;
use std::ops::ControlFlow;
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::interrupt;
use yawrig_shared::features::{FeatureKind, FEATURES};
use yawrig_train::draws::{self, Ranges};
use yawrig_train::errors::Errors;
use yawrig_train::pca::{Projection, Scale};
use yawrig_train::{forward, Epoch, Options, Precision, Progress, Samples, Trained};

/// Features and truth of draws; unscaled.
#[derive(Clone, Debug)]
pub struct Draws {
    /// Row-major.
    pub rows: Vec<f64>,
    /// Columns.
    pub d: usize,
    /// Natural frequency in rad/s and damping ratio.
    pub truth: Vec<[f64; 2]>,
}

impl Draws {
    pub fn each(&self) -> impl Iterator<Item = (&[f64], [f64; 2])> {
        self.rows.chunks_exact(self.d).zip(self.truth.iter().copied())
    }

    /// The device's windows over forty bins with the duration it estimates, `noise` as a share of the peak
    /// between these.
    ///
    /// # Errors
    /// Where noise leaves no windows.
    pub fn of_windows(noise: [f64; 2], count: usize, seed: u64) -> Result<Self> {
        let ranges = Ranges { noise, ..Ranges::default() };
        let drawn = draws::draw(&ranges, FeatureKind::BinMeans, None, count, seed)?;
        let truth = drawn.iter().map(|d| [d.natural_frequency_rad_s, d.damping_ratio]).collect();
        let rows = drawn.iter().flat_map(|d| d.features.values.map(f64::from)).collect();
        Ok(Self { d: FEATURES, rows, truth })
    }

    /// The first `count` of them.
    pub fn first(&self, count: usize) -> Self {
        let (rows, truth) = (self.rows[..count * self.d].to_vec(), self.truth[..count].to_vec());
        Self { rows, d: self.d, truth }
    }
}

/// What is trained.
#[derive(Clone, Debug)]
pub struct Spec {
    pub hidden: Vec<usize>,
    pub epochs: usize,
    pub seed: u64,
    pub restarts: usize,
    pub precision: Precision,
    pub components: Option<(usize, Scale)>,
    /// The last column is of another kind than the others: a duration.
    pub own_last: bool,
}

impl Spec {
    pub fn new(hidden: &[usize], epochs: usize) -> Self {
        Self {
            hidden: hidden.to_vec(),
            epochs,
            seed: 1,
            restarts: 1,
            precision: Precision::Shared,
            components: None,
            own_last: true,
        }
    }
}

/// `(x - offset) gain`.
#[derive(Clone, Copy, Debug)]
struct Map {
    offset: f64,
    gain: f64,
}

impl Map {
    /// Brings what lies between the least and the largest to -1 to 1.
    fn new(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = values.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
        Self { offset: 0.5 * (low + high), gain: 2.0 / (high - low) }
    }
}

/// A trained network with its scaling.
#[derive(Clone, Debug)]
pub struct Fit {
    pub trained: Trained,
    pub topology: Vec<usize>,
    pub projection: Option<Projection>,
    scaling: Scaling,
}

/// From rows to inputs and from targets to outputs, about -1 to 1.
#[derive(Clone, Debug)]
struct Scaling {
    d: usize,
    shape_gain: f64,
    last: Option<Map>,
    outputs: [Map; 2],
}

impl Scaling {
    fn new(draws: &Draws, own_last: bool) -> Self {
        let d = draws.d;
        let shape = if own_last { d - 1 } else { d };
        let largest =
            draws.each().flat_map(|(row, _)| &row[..shape]).fold(0.0, |m: f64, x| m.max(x.abs()));
        let last = own_last.then(|| Map::new(draws.each().map(|(row, _)| row[d - 1])));
        let outputs = [0, 1].map(|o| Map::new(draws.truth.iter().map(|t| t[o])));
        Self { d, shape_gain: 1.0 / largest, last, outputs }
    }

    fn inputs(&self, rows: &[f64]) -> Vec<f64> {
        let mut scaled: Vec<f64> = rows.iter().map(|x| x * self.shape_gain).collect();
        if let Some(map) = self.last {
            for (to, from) in scaled.chunks_exact_mut(self.d).zip(rows.chunks_exact(self.d)) {
                to[self.d - 1] = (from[self.d - 1] - map.offset) * map.gain;
            }
        }
        scaled
    }
}

/// Ends a training when the user asks for it.
struct UntilInterrupted;

impl Progress for UntilInterrupted {
    fn epoch(&mut self, _: &Epoch, _: &[f64]) -> ControlFlow<()> {
        match interrupt::requested() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

/// Trains on `draws`.
///
/// # Errors
/// 130 where the user stops it, 6 where the training comes to nothing.
pub fn fit(draws: &Draws, spec: &Spec) -> Result<Fit> {
    let failed = |why: &str| Error::new(Exit::Quality, format!("training failed: {why}"));
    let scaling = Scaling::new(draws, spec.own_last);
    let mut inputs = scaling.inputs(&draws.rows);
    let mut projection = None;
    if let Some((count, scale)) = spec.components {
        let found = Projection::new(&inputs, draws.d, count, scale)
            .ok_or_else(|| failed(&format!("the inputs have no {count} principal components")))?;
        inputs = found.apply(&inputs);
        projection = Some(found);
    }
    let outputs = scaling.outputs;
    let scaled = |t: &[f64; 2]| [0, 1].map(|o| (t[o] - outputs[o].offset) * outputs[o].gain);
    let samples = Samples {
        d: inputs.len() / draws.truth.len(),
        inputs,
        targets: draws.truth.iter().flat_map(scaled).collect(),
        n: draws.truth.len(),
        k: 2,
    };
    let options = Options {
        hidden: spec.hidden.clone(),
        epochs: spec.epochs,
        seed: spec.seed,
        restarts: spec.restarts,
        precision: spec.precision,
        ..Options::default()
    };
    let topology = options.topology(&samples);
    let trained = yawrig_train::train(&samples, &options, &mut UntilInterrupted)
        .map_err(|e| failed(&e.to_string()))?;
    interrupt::check()?;
    Ok(Fit { trained, topology, projection, scaling })
}

impl Fit {
    /// Cells of a table by noise: the network, rms errors of wn and of zeta at each level, median and 95th
    /// percentile of zeta's at the last, effective parameters.
    pub fn row_by_noise(&self, errors: &[Errors]) -> Vec<String> {
        let mut row = vec![yawrig_train::freeze::name(&self.topology)];
        row.extend(errors.iter().map(|e| percent(e.natural_frequency_rms_percent)));
        row.extend(errors.iter().map(|e| percent(e.damping_ratio_rms_percent)));
        if let Some(last) = errors.last() {
            row.push(percent(last.damping_ratio_median_percent));
            row.push(percent(last.damping_ratio_p95_percent));
        }
        row.push(format!("{:.0} of {}", self.trained.gamma, self.trained.weights.len()));
        row
    }

    /// Natural frequency in rad/s and damping ratio of one row.
    pub fn estimate(&self, row: &[f64]) -> [f64; 2] {
        let mut inputs = self.scaling.inputs(row);
        if let Some(projection) = &self.projection {
            inputs = projection.apply(&inputs);
        }
        let out = forward(&self.topology, &self.trained.weights, &inputs);
        [0, 1].map(|o| self.scaling.outputs[o].offset + out[o] / self.scaling.outputs[o].gain)
    }

    /// Estimates and truths of draws.
    pub fn pairs(&self, draws: &Draws) -> Vec<([f64; 2], [f64; 2])> {
        draws.each().map(|(row, truth)| (self.estimate(row), truth)).collect()
    }

    pub fn errors(&self, draws: &Draws) -> Errors {
        Errors::new(&self.pairs(draws))
    }

    /// Sum of squared errors over the training set in scaled units: the thesis's SSE.
    pub fn sse(&self) -> f64 {
        self.trained.errors.iter().sum()
    }
}
