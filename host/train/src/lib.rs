//! Training of small networks: Levenberg-Marquardt with Bayesian regularisation (Foresee & Hagan 1997;
//! thesis 4.4, appendices B and C) from Nguyen-Widrow starts. Pure numbers, f64; knows nothing of yaw.
//!
//! Same samples, options and seed: the same network to the last bit, on any number of threads of the
//! same processor type. Processors with other vector units may sum in another order.

#![forbid(unsafe_code)]

pub mod augmented;
pub mod continued;
mod curvature;
pub mod draws;
mod error;
pub mod errors;
pub mod freeze;
mod held_out;
mod marquardt;
mod matrix;
pub mod measured;
mod network;
pub mod network_training;
pub mod pca;
mod precision;
mod restarts;
mod solve;
mod start;

pub use error::TrainError;
pub use held_out::HeldOutEpoch;
pub use network::{forward, Shape};
pub use precision::Guards;
pub use restarts::{resume, train};

use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

/// A training set, scaled.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples {
    /// Row-major, `n` x `d`, scaled to about [-1, 1].
    pub inputs: Vec<f64>,
    /// Row-major, `n` x `k`, scaled to [-1, 1].
    pub targets: Vec<f64>,
    pub n: usize,
    pub d: usize,
    pub k: usize,
}

/// Whether outputs share one error precision beta.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Precision {
    /// One for all, as in the thesis. Better without noise, where one output may be harder to
    /// represent than another: with one precision each, the easy one would take all the nodes.
    Shared,
    /// One each, after a shared beginning. Better with noise: one output's does not loosen the others.
    #[default]
    PerOutput,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Options {
    /// Nodes of each hidden layer; none is a linear fit.
    pub hidden: Vec<usize>,
    /// Most epochs of each restart: accepted steps, or attempts to find one.
    pub epochs: usize,
    pub seed: u64,
    /// Starts to train from; the one of the highest evidence is kept.
    pub restarts: usize,
    pub precision: Precision,
    /// Largest beta. It is held lower where rounding asks for that.
    pub beta_cap: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            hidden: vec![6],
            epochs: 1000,
            seed: 1,
            restarts: 1,
            precision: Precision::default(),
            beta_cap: 1e10,
        }
    }
}

impl Options {
    /// Inputs, hidden layers, outputs.
    pub fn topology(&self, samples: &Samples) -> Vec<usize> {
        let mut topology = vec![samples.d];
        topology.extend(&self.hidden);
        topology.push(samples.k);
        topology
    }
}

/// Why a training ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stop {
    /// All epochs done.
    Epochs,
    /// Neither weights nor precisions change beyond rounding.
    Converged,
    /// No damping made the step go down, though the gradient says it should.
    Stuck,
    /// The caller asked for it.
    Interrupted,
}

impl Stop {
    /// As a sentence has it.
    pub fn words(self) -> &'static str {
        match self {
            Stop::Epochs => "all that were asked for",
            Stop::Converged => "converged",
            Stop::Stuck => "stuck: no step made it better",
            Stop::Interrupted => "interrupted",
        }
    }
}

/// Where a training stands after an epoch. Errors are in scaled units, summed over samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Epoch {
    pub restart: usize,
    /// From 1.
    pub epoch: usize,
    /// Sum of squared errors of each output.
    pub errors: Vec<f64>,
    pub weights_sq: f64,
    /// Effective number of parameters, when last worked out.
    pub gamma: f64,
    /// Precisions of weights and of each output's errors, for the next epoch.
    pub alpha: f64,
    pub beta: Vec<f64>,
    /// Marquardt's damping for the next epoch.
    pub mu: f64,
}

/// All that a training needs to go on exactly where it was.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    pub weights: Vec<f64>,
    pub alpha: f64,
    pub beta: Vec<f64>,
    /// None before the first epoch.
    pub mu: Option<f64>,
    /// Effective number of parameters when last worked out; the number of weights before.
    pub gamma: f64,
    /// The last epoch found no step to take.
    pub resting: bool,
    /// Epochs done.
    pub epoch: usize,
}

impl Checkpoint {
    /// A beginning from weights of which nothing else is known, with `outputs` outputs.
    pub fn from_weights(weights: Vec<f64>, outputs: usize) -> Self {
        let gamma = weights.len() as f64;
        let beta = vec![1.0; outputs];
        Self { weights, alpha: 0.1, beta, mu: None, gamma, resting: false, epoch: 0 }
    }
}

/// A trained network and how it came about.
#[derive(Clone, Debug, PartialEq)]
pub struct Trained {
    /// Layer after layer, (inputs + 1) rows of nodes; row 0 the biases.
    pub weights: Vec<f64>,
    /// Sum of squared errors of each output over the training set, scaled units.
    pub errors: Vec<f64>,
    /// Effective number of parameters, between 0 and the number of weights.
    pub gamma: f64,
    pub alpha: f64,
    /// One per output, all the same where they are shared. An error's variance is 1/(2 beta).
    pub beta: Vec<f64>,
    pub epochs: usize,
    /// Which restart this is.
    pub restart: usize,
    pub stopped: Stop,
    /// Every epoch of this restart.
    pub history: Vec<Epoch>,
    /// Natural logarithm, with which restarts and topologies are compared on the same training set.
    pub log_evidence: f64,
    pub guards: Guards,
    pub checkpoint: Checkpoint,
}

/// Follows a training, and may end it.
pub trait Progress: Send {
    /// Called after each epoch of each restart (which may run side by side) with its weights.
    /// `Break` ends all restarts; the best network so far is returned with [`Stop::Interrupted`].
    fn epoch(&mut self, _epoch: &Epoch, _weights: &[f64]) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Says nothing and never ends a training.
pub struct Silent;

impl Progress for Silent {}
