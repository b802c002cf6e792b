//! Training from several starts and keeping the network with the highest evidence.

use super::marquardt::Training;
use super::network::Shape;
use super::start::nguyen_widrow;
use super::{Checkpoint, Options, Progress, Samples, Stop, TrainError, Trained};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Mutex;

/// Parameters for each target value beyond which not even the prior makes sense of a network.
const MAX_PARAMETERS_PER_TARGET: usize = 10;
/// Inputs and targets beyond this were never scaled.
const LARGEST: f64 = 1e3;

/// Trains a network of `options.hidden` on `samples`.
///
/// # Errors
/// [`TrainError`]: a training set or options that cannot lead to a network, or no start that does.
pub fn train(
    samples: &Samples,
    options: &Options,
    progress: &mut dyn Progress,
) -> Result<Trained, TrainError> {
    check(samples, options)?;
    let shape = Shape::new(&options.topology(samples));
    let progress = Mutex::new(progress);
    let ended = AtomicBool::new(false);
    let one = |restart: usize| {
        if ended.load(Ordering::Relaxed) {
            return None;
        }
        // A stream of its own for each restart: the same starts whatever their number and order.
        let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
        rng.set_stream(restart as u64);
        let start = Checkpoint::from_weights(nguyen_widrow(&shape, &mut rng), samples.k);
        run(samples, options, start, restart, &progress, &ended)
    };
    let trained: Vec<Option<Trained>> = (0..options.restarts).into_par_iter().map(one).collect();
    let mut best = best(trained).ok_or(TrainError::Diverged { restarts: options.restarts })?;
    if ended.into_inner() {
        // Also where this one had come to its end: others had not.
        best.stopped = Stop::Interrupted;
    }
    Ok(best)
}

/// Goes on from `from` until `options.epochs` in all: the same network to the bit as if it had never
/// been interrupted. Seed and restarts of `options` play no part; the history holds the new epochs.
///
/// # Errors
/// As [`train`]; also where `from` is not of this topology.
pub fn resume(
    samples: &Samples,
    options: &Options,
    from: &Checkpoint,
    progress: &mut dyn Progress,
) -> Result<Trained, TrainError> {
    check(samples, options)?;
    let shape = Shape::new(&options.topology(samples));
    length("weights", shape.parameters(), from.weights.len())?;
    length("betas", samples.k, from.beta.len())?;
    for (what, values) in [("weight", &from.weights), ("beta", &from.beta)] {
        if let Some(column) = values.iter().position(|v| !v.is_finite()) {
            return Err(TrainError::NotFinite { what, sample: 0, column });
        }
    }
    if !(from.alpha.is_finite() && from.alpha > 0.0) {
        return Err(TrainError::Option { what: "alpha", value: from.alpha });
    }
    let progress = Mutex::new(progress);
    let ended = AtomicBool::new(false);
    run(samples, options, from.clone(), 0, &progress, &ended)
        .ok_or(TrainError::Diverged { restarts: 1 })
}

fn run(
    samples: &Samples,
    options: &Options,
    from: Checkpoint,
    restart: usize,
    progress: &Mutex<&mut dyn Progress>,
    ended: &AtomicBool,
) -> Option<Trained> {
    let mut trained = Training::new(samples, options, from)?.run(|epoch, weights| {
        let mut epoch = epoch.clone();
        epoch.restart = restart;
        let mut progress = progress.lock().unwrap_or_else(|broken| broken.into_inner());
        if progress.epoch(&epoch, weights).is_break() {
            ended.store(true, Ordering::Relaxed);
        }
        match ended.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    })?;
    trained.restart = restart;
    trained.history.iter_mut().for_each(|e| e.restart = restart);
    Some(trained)
}

/// The one with the highest evidence; of equals the first.
fn best(trained: Vec<Option<Trained>>) -> Option<Trained> {
    trained.into_iter().flatten().reduce(|best, next| {
        if next.log_evidence > best.log_evidence {
            next
        } else {
            best
        }
    })
}

fn length(what: &'static str, expected: usize, found: usize) -> Result<(), TrainError> {
    if expected == found {
        Ok(())
    } else {
        Err(TrainError::Shape { what, expected, found })
    }
}

fn check(samples: &Samples, options: &Options) -> Result<(), TrainError> {
    let Samples { inputs, targets, n, d, k } = samples;
    let counts = [("samples", n), ("inputs", d), ("outputs", k), ("epochs", &options.epochs)];
    let nodes = options.hidden.iter().map(|nodes| ("nodes in a hidden layer", nodes));
    for (what, count) in counts.into_iter().chain([("restarts", &options.restarts)]).chain(nodes) {
        if *count == 0 {
            return Err(TrainError::Empty { what });
        }
    }
    if !(options.beta_cap.is_finite() && options.beta_cap > 0.0) {
        return Err(TrainError::Option { what: "beta_cap", value: options.beta_cap });
    }
    length("inputs", n * d, inputs.len())?;
    length("targets", n * k, targets.len())?;
    for (what, values, width) in [("input", inputs, *d), ("target", targets, *k)] {
        for (at, &value) in values.iter().enumerate() {
            let (sample, column) = (at / width, at % width);
            if !value.is_finite() {
                return Err(TrainError::NotFinite { what, sample, column });
            }
            if value.abs() > LARGEST {
                return Err(TrainError::NotScaled { what, sample, column, value });
            }
        }
    }
    let constant = |o: &usize| targets[*o..].iter().step_by(*k).all(|t| *t == targets[*o]);
    if let Some(column) = (0..*k).find(constant) {
        return Err(TrainError::ConstantTarget { column });
    }
    let parameters = Shape::new(&options.topology(samples)).parameters();
    if parameters > MAX_PARAMETERS_PER_TARGET * n * k {
        return Err(TrainError::TooManyParameters { parameters, target_values: n * k });
    }
    Ok(())
}
