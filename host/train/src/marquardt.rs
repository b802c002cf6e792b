//! One training: Levenberg-Marquardt steps under precisions that are re-estimated on the way.
//!
//! The step solves `[beta J'J + (alpha + mu) I] s = beta J'e - alpha w`, J the derivative of the outputs
//! and e target minus output (thesis 4.4.1 with its regularisation restored). Damping follows Nielsen
//! (1999), and each step is bent along the valley by the second derivative in its own direction
//! (Transtrum & Sethna 2012): one more solve with the same factor, for several times fewer epochs.

use super::curvature::Curvature;
use super::matrix::{col, Matrix};
use super::network::{Pass, Shape};
use super::precision::{log_evidence, update, Guards, Measured};
use super::solve::Factor;
use super::{Checkpoint, Epoch, Options, Precision, Samples, Stop, Trained};
use std::ops::ControlFlow;
use yawrig_core::solver::descent::{relaxation, step_down, Attempt, Damping, Descent, Ended};

/// First damping, as a share of the largest curvature.
const FIRST_DAMPING: f64 = 1e-3;
/// Damping beyond this share of the largest curvature is a step of no length.
const MAX_DAMPING: f64 = 1e10;
/// A predicted decrease below this share of the objective is not worth a factor: rounding eats it.
const ROUNDING: f64 = 1e-10;
/// Precisions are re-estimated, which costs as much as a step, at every epoch of the first, then at
/// every tenth, from the second on at every 25th; and wherever no step was found.
const SETTLING_EPOCHS: [usize; 2] = [10, 100];
/// Until here all outputs share one precision, since an output fitted first would starve the others.
const SHARED_EPOCHS: usize = 30;
/// Precisions that change by less than this share have settled: the evidence is stationary in them.
const SETTLED: f64 = 1e-4;
/// How far along a step to look for a lower objective before damping more, which needs a new factor.
const SHARES: [f64; 3] = [1.0, 0.5, 0.25];
/// Longest bend of a step, as a share of its length (Transtrum & Sethna's alpha of 0.75, twice).
const LONGEST_BEND: f64 = 1.5;

pub(super) struct Training<'a> {
    samples: &'a Samples,
    options: &'a Options,
    shape: Shape,
    now: Checkpoint,
    guards: Guards,
    /// Sum of squared errors per output at the present weights.
    errors: Vec<f64>,
    pass: Pass,
    trial: Pass,
    trial_weights: Vec<f64>,
    trial_errors: Vec<f64>,
    curvature: Curvature,
    /// The lower triangle of beta J'J.
    h: Matrix,
    h_output: Matrix,
    /// Half the negative gradient of the objective.
    descent: Vec<f64>,
    factor: Factor,
}

/// `w + t step + t^2 bend`, t from 0 to 1.
struct Curve {
    /// Decrease of the objective that the linearised network predicts at the end of the step.
    predicted: f64,
    step: Vec<f64>,
    bend: Vec<f64>,
}

enum Step {
    Taken,
    /// The objective cannot be made smaller by more than rounding.
    Minimum,
    /// The linearised network predicts a decrease, but no damping gave one.
    Stuck,
}

/// A training that looks for its next step.
struct OneEpoch<'t, 'a> {
    training: &'t mut Training<'a>,
    objective: f64,
    /// The first damping.
    first: f64,
    path: Option<Curve>,
    /// How far along the path it goes.
    share: f64,
}

impl Descent for OneEpoch<'_, '_> {
    fn arrived(&mut self) -> Option<Ended> {
        None
    }

    fn step(&mut self, damping: f64) -> Attempt {
        self.path = self.training.curve(damping);
        match &self.path {
            None => Attempt::Impossible,
            // Damped to nothing after failures is another matter than nothing to gain.
            Some(path) if path.predicted <= ROUNDING * self.objective => {
                let at_once = damping == self.first;
                Attempt::Ended(if at_once { Ended::Converged } else { Ended::NoDescent })
            }
            Some(path) => Attempt::Promises(path.predicted),
        }
    }

    fn gain(&mut self) -> Option<f64> {
        let path = self.path.as_ref()?;
        SHARES.into_iter().find_map(|share| {
            self.share = share;
            let decrease = self.objective - self.training.walk(path, share);
            (decrease > 0.0).then_some(decrease)
        })
    }

    fn is_last(&self, _promised: f64, _gained: Option<f64>) -> bool {
        false
    }

    fn take(&mut self) {
        let training = &mut *self.training;
        std::mem::swap(&mut training.now.weights, &mut training.trial_weights);
        std::mem::swap(&mut training.errors, &mut training.trial_errors);
        std::mem::swap(&mut training.pass, &mut training.trial);
    }

    fn relaxation(&self, kept: f64) -> f64 {
        match self.share {
            1.0 => relaxation(kept),
            share => 1.0 / share,
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn finite(values: &[f64]) -> bool {
    values.iter().all(|v| v.is_finite())
}

impl<'a> Training<'a> {
    /// `None` where the start gives no finite output.
    pub fn new(samples: &'a Samples, options: &'a Options, from: Checkpoint) -> Option<Self> {
        let shape = Shape::new(&options.topology(samples));
        let mut pass = Pass::new(&shape, &samples.inputs, samples.n);
        let errors = pass.run(&shape, &from.weights, &samples.targets);
        if !finite(&errors) {
            return None;
        }
        let n = shape.parameters();
        Some(Self {
            samples,
            options,
            trial_weights: from.weights.clone(),
            now: from,
            guards: Guards::default(),
            trial_errors: errors.clone(),
            errors,
            trial: pass.clone(),
            curvature: Curvature::new(&shape, &pass),
            h: Matrix::zeros(n, n),
            h_output: Matrix::zeros(n, n),
            descent: vec![0.0; n],
            factor: Factor::new(n),
            pass,
            shape,
        })
    }

    /// Runs to the end of `options.epochs`, or until it stops by itself or is interrupted. `report` gets
    /// each epoch and the weights after it.
    pub fn run(
        mut self,
        mut report: impl FnMut(&Epoch, &[f64]) -> ControlFlow<()>,
    ) -> Option<Trained> {
        let mut history = Vec::new();
        let mut stopped = Stop::Epochs;
        while self.now.epoch < self.options.epochs {
            let epoch = self.now.epoch;
            self.linearise();
            let every = match epoch {
                early if early < SETTLING_EPOCHS[0] => 1,
                later if later < SETTLING_EPOCHS[1] => 10,
                _ => 25,
            };
            let due = self.now.resting || epoch.is_multiple_of(every);
            let next = if due { self.next_precisions() } else { None };
            let step = self.step();
            let settled = due && next.as_ref().is_none_or(|next| self.settled(next));
            if let Some((alpha, beta)) = next {
                (self.now.alpha, self.now.beta) = (alpha, beta);
            }
            self.now.epoch += 1;
            self.now.resting = !matches!(step, Step::Taken);
            history.push(self.epoch());
            if report(&history[history.len() - 1], &self.now.weights).is_break() {
                stopped = Stop::Interrupted;
                break;
            }
            if settled && epoch >= SHARED_EPOCHS {
                match step {
                    Step::Taken => {}
                    Step::Minimum => stopped = Stop::Converged,
                    Step::Stuck => stopped = Stop::Stuck,
                }
                if self.now.resting {
                    break;
                }
            }
        }
        self.finish(stopped, history)
    }

    fn objective(&self, errors: &[f64], weights: &[f64]) -> f64 {
        dot(&self.now.beta, errors) + self.now.alpha * dot(weights, weights)
    }

    /// Curvature and gradient at the present weights.
    fn linearise(&mut self) {
        let (shape, pass, now) = (&self.shape, &self.pass, &self.now);
        self.curvature.sensitivities(shape, pass, &now.weights);
        self.curvature.assemble(shape, pass, &now.beta, &mut self.h);
        self.curvature.gradient(shape, pass, &pass.error, &now.beta, &mut self.descent);
        for (g, w) in self.descent.iter_mut().zip(&now.weights) {
            *g -= now.alpha * w;
        }
    }

    fn shared(&self) -> bool {
        self.options.precision == Precision::Shared || self.now.epoch < SHARED_EPOCHS
    }

    /// The precisions the present curvature and errors ask for; sets gamma.
    fn next_precisions(&mut self) -> Option<(f64, Vec<f64>)> {
        if self.factor.factor(&self.h, self.now.alpha).is_err() {
            self.guards.cholesky_failed += 1;
            return None;
        }
        let k = self.samples.k;
        let parameters = self.shape.parameters();
        let shared = self.shared();
        let gamma = if shared {
            vec![parameters as f64 - self.now.alpha * self.factor.inverse_trace()]
        } else {
            self.gamma_shares()
        };
        let total = gamma.iter().sum();
        let curvature = (0..k).map(|o| self.curvature.trace(&self.shape, &self.pass, o));
        let measured = Measured {
            gamma,
            errors: if shared { vec![self.errors.iter().sum()] } else { self.errors.clone() },
            curvature: if shared { vec![curvature.sum()] } else { curvature.collect() },
            terms: (if shared { self.samples.n * k } else { self.samples.n }) as f64,
            weights_sq: dot(&self.now.weights, &self.now.weights),
            parameters,
        };
        let next = update(self.now.alpha, &measured, self.options.beta_cap, &mut self.guards);
        let (alpha, beta) = next?;
        self.now.gamma = total;
        Some((alpha, if shared { vec![beta[0]; k] } else { beta }))
    }

    /// Each output's share of gamma, from the factor at hand; the last is what is left.
    fn gamma_shares(&mut self) -> Vec<f64> {
        let k = self.samples.k;
        let inverse = self.factor.inverse();
        let n = inverse.ncols();
        let gamma = n as f64 - self.now.alpha * (0..n).map(|j| inverse[(j, j)]).sum::<f64>();
        let mut shares = vec![0.0; k];
        let mut alone = vec![0.0; k];
        for o in 0..k - 1 {
            alone.fill(0.0);
            alone[o] = self.now.beta[o];
            self.curvature.assemble(&self.shape, &self.pass, &alone, &mut self.h_output);
            shares[o] = (0..n)
                .map(|j| {
                    let (a, b) = (col(&self.h_output, j), col(inverse, j));
                    a[j] * b[j] + 2.0 * dot(&a[j + 1..], &b[j + 1..])
                })
                .sum();
        }
        shares[k - 1] = gamma - shares.iter().sum::<f64>();
        shares
    }

    fn settled(&self, (alpha, beta): &(f64, Vec<f64>)) -> bool {
        let same = |a: f64, b: f64| (a - b).abs() <= SETTLED * b;
        same(*alpha, self.now.alpha) && beta.iter().zip(&self.now.beta).all(|(a, b)| same(*a, *b))
    }

    /// One accepted step, if any damping gives one.
    fn step(&mut self) -> Step {
        let n = self.shape.parameters();
        let largest = (0..n).map(|j| self.h[(j, j)]).fold(0.0, f64::max);
        let first = *self.now.mu.get_or_insert(FIRST_DAMPING * largest);
        // Never so low that it would take many failures to come back.
        let range = [f64::EPSILON * largest, MAX_DAMPING * largest];
        let mut damping = Damping::new(first, range);
        let objective = self.objective(&self.errors, &self.now.weights);
        let mut epoch = OneEpoch { training: self, objective, first, path: None, share: 1.0 };
        match step_down(&mut epoch, &mut damping) {
            None => {
                self.now.mu = Some(damping.value());
                Step::Taken
            }
            Some(Ended::Converged) => Step::Minimum,
            Some(_) => Step::Stuck,
        }
    }

    /// The curved path that starts with the step for one damping.
    fn curve(&mut self, mu: f64) -> Option<Curve> {
        if self.factor.factor(&self.h, self.now.alpha + mu).is_err() {
            self.guards.cholesky_failed += 1;
            return None;
        }
        let mut step = self.descent.clone();
        self.factor.solve(&mut step);
        let length_sq = dot(&step, &step);
        let predicted = dot(&self.descent, &step) + mu * length_sq;
        let (shape, pass) = (&self.shape, &self.pass);
        let second = pass.second_derivative(shape, &self.now.weights, &step);
        let mut bend = vec![0.0; step.len()];
        self.curvature.gradient(shape, pass, &second, &self.now.beta, &mut bend);
        self.factor.solve(&mut bend);
        let longest = LONGEST_BEND * length_sq.sqrt() / dot(&bend, &bend).sqrt();
        let bent = if longest.is_nan() { 0.0 } else { longest.min(1.0) };
        bend.iter_mut().for_each(|b| *b *= -0.5 * bent);
        Some(Curve { predicted, step, bend })
    }

    /// Goes a share of the way along the curve, on trial; the objective there.
    fn walk(&mut self, curve: &Curve, share: f64) -> f64 {
        let path = curve.step.iter().zip(&curve.bend).map(|(s, b)| share * (s + share * b));
        let weights = self.trial_weights.iter_mut().zip(&self.now.weights);
        weights.zip(path).for_each(|((to, from), s)| *to = from + s);
        self.trial_errors = self.trial.run(&self.shape, &self.trial_weights, &self.samples.targets);
        self.objective(&self.trial_errors, &self.trial_weights)
    }

    fn epoch(&self) -> Epoch {
        Epoch {
            restart: 0,
            epoch: self.now.epoch,
            errors: self.errors.clone(),
            weights_sq: dot(&self.now.weights, &self.now.weights),
            gamma: self.now.gamma,
            alpha: self.now.alpha,
            beta: self.now.beta.clone(),
            mu: self.now.mu.unwrap_or(0.0),
        }
    }

    /// Gamma and evidence of where it ended. `None` where that is not finite.
    fn finish(mut self, stopped: Stop, history: Vec<Epoch>) -> Option<Trained> {
        self.linearise();
        let (mut evidence, mut gamma) = (f64::NEG_INFINITY, self.now.gamma);
        let n = self.shape.parameters();
        if self.factor.factor(&self.h, self.now.alpha).is_ok() {
            let objective = self.objective(&self.errors, &self.now.weights);
            evidence = log_evidence(
                objective,
                self.factor.log_det(),
                (self.now.alpha, &self.now.beta),
                self.samples.n,
                n,
                &self.options.hidden,
            );
            let found = n as f64 - self.now.alpha * self.factor.inverse_trace();
            if (0.0..=n as f64).contains(&found) {
                gamma = found;
            }
        }
        finite(&self.now.weights).then(|| Trained {
            weights: self.now.weights.clone(),
            errors: self.errors,
            gamma,
            alpha: self.now.alpha,
            beta: self.now.beta.clone(),
            epochs: self.now.epoch,
            restart: 0,
            stopped,
            history,
            log_evidence: evidence,
            guards: self.guards,
            checkpoint: self.now,
        })
    }
}
