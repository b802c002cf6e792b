//! A model with effects fitted to a free swing: natural frequency, damping, initial state and every coefficient.

use crate::effects::{Effect, Terms};
use crate::fit::problem::{solve_one, Release, EVALUATIONS};
use crate::fit::structure::PLAIN;
pub use crate::fit::structure::{Limit, Number, Structure};
use crate::fit::swing::Swing;
use crate::motion::simulate::{Grid, Motion};
use crate::quantity::Quantity;
use crate::solver::Fit;
use nalgebra::DMatrix;

/// Cycles of the first, shortest fit.
const FIRST_CYCLES: f64 = 5.0;
const LONGER: f64 = 1.8;
/// Evaluations after which a further start has to be this near, in the sum of squares, to the best one so far.
const SHORT: usize = 7;
const NEAR: f64 = 1.5;
/// Residual over noise below which no further start is tried.
const SURELY: f64 = 1.04;
/// For a user's own effect: from every start, and on from the best.
const OWN_FIRST: usize = 6;
const OWN_EVALUATIONS: usize = 50;

/// A fitted model.
#[derive(Clone, Debug)]
pub struct Fitted {
    pub structure: Structure,
    /// wn, zeta, yaw, rate, sensor's zero where unknown, then each effect's.
    pub parameters: Vec<f64>,
    pub sum_of_squares: f64,
    pub count: usize,
    pub converged: bool,
    pub covariance: Option<DMatrix<f64>>,
    /// Model less record, rad.
    pub residuals: Vec<f64>,
    /// Lag-one correlation of the residuals.
    pub correlation: f64,
    /// Variance inflation of the parameters by correlated residuals.
    pub(crate) inflation: f64,
    /// The same for natural frequency and damping ratio.
    pub(crate) modal_inflation: f64,
    starts: Vec<usize>,
    wind_speed_m_s: f64,
}

impl Fitted {
    /// `residuals` in rad.
    pub(crate) fn new(
        structure: Structure,
        parameters: Vec<f64>,
        residuals: Vec<f64>,
        converged: bool,
        covariance: Option<DMatrix<f64>>,
        wind_speed_m_s: f64,
    ) -> Self {
        let lag: f64 = residuals.windows(2).map(|w| w[0] * w[1]).sum();
        let power: f64 = residuals.iter().map(|r| r * r).sum();
        let mut fitted = Self {
            starts: structure.starts(),
            structure,
            parameters,
            sum_of_squares: power,
            count: residuals.len(),
            converged,
            covariance,
            correlation: if power > 0.0 { lag / power } else { 0.0 },
            residuals,
            inflation: 1.0,
            modal_inflation: 1.0,
            wind_speed_m_s,
        };
        fitted.inflation = fitted.count as f64 / fitted.effective_count();
        fitted.modal_inflation = fitted.inflation;
        fitted
    }
    pub fn rms_rad(&self) -> f64 {
        (self.sum_of_squares / self.degrees_of_freedom()).sqrt()
    }
    fn degrees_of_freedom(&self) -> f64 {
        self.count.saturating_sub(self.parameters.len()).max(1) as f64
    }
    pub fn over_noise(&self, swing: &Swing) -> f64 {
        self.rms_rad() / swing.noise_rad
    }
    /// Residuals that count as independent: (1 - c)/(1 + c) of them at lag-one correlation c.
    pub fn effective_count(&self) -> f64 {
        let c = self.correlation.clamp(0.0, 0.999);
        (self.count as f64 * (1.0 - c) / (1.0 + c)).max(2.0)
    }
    fn modal_quantity(&self, index: usize) -> Quantity {
        let u = self
            .covariance
            .as_ref()
            .map_or(f64::NAN, |c| (c[(index, index)] * self.modal_inflation).max(0.0).sqrt());
        Quantity::new(self.parameters[index], u)
    }
    pub fn natural_frequency_rad_s(&self) -> Quantity {
        self.modal_quantity(0)
    }
    pub fn damping_ratio(&self) -> Quantity {
        self.modal_quantity(1)
    }
    /// `effect.name` and value of everything the effects are made of.
    pub fn effect_parameters(&self) -> Vec<(String, Quantity)> {
        let mut out = Vec::new();
        for (effect, &at) in self.structure.effects.iter().zip(&self.starts) {
            let varied = self.of_effect(effect, at);
            let (values, rows) = effect.published(varied);
            for (i, parameter) in effect.parameters().iter().enumerate() {
                let variance = self.covariance.as_ref().map_or(f64::NAN, |c| {
                    let n = varied.len();
                    (0..n)
                        .flat_map(|a| (0..n).map(move |b| (a, b)))
                        .map(|(a, b)| rows[i][a] * rows[i][b] * c[(at + a, at + b)])
                        .sum::<f64>()
                });
                let u = (variance * self.inflation).max(0.0).sqrt();
                out.push((format!("{effect}.{}", parameter.name), Quantity::new(values[i], u)));
            }
        }
        out
    }
    fn of_effect(&self, effect: &Effect, at: usize) -> &[f64] {
        let n = effect.parameters().len();
        &self.parameters[at..at + n]
    }
    /// The numbers of `effect`, if it is in the model.
    pub fn varied(&self, effect: &Effect) -> Option<&[f64]> {
        let k = self.structure.effects.iter().position(|e| e == effect)?;
        Some(self.of_effect(effect, self.starts[k]))
    }
    /// The numbers as `structure` orders them, zero for an effect that is not in the model, each with its variance
    /// where it is known.
    pub(crate) fn in_order_of(&self, structure: &Structure) -> (Vec<f64>, Vec<Option<f64>>) {
        let mut from: Vec<Option<usize>> = (0..structure.own_numbers()).map(Some).collect();
        for effect in &structure.effects {
            let k = self.structure.effects.iter().position(|e| e == effect);
            from.extend((0..effect.parameters().len()).map(|i| k.map(|k| self.starts[k] + i)));
        }
        let value = |at: &Option<usize>| at.map_or(0.0, |at| self.parameters[at]);
        let variance = |at: &Option<usize>| Some(self.covariance.as_ref()?[((*at)?, (*at)?)]);
        (from.iter().map(value).collect(), from.iter().map(variance).collect())
    }
    /// Where the numbers of `effect`, which is in the model, begin.
    pub(crate) fn start_of(&self, effect: &Effect) -> usize {
        let k = self.structure.effects.iter().position(|e| e == effect);
        self.starts[k.expect("an effect of the model")]
    }
    pub fn motion(&self) -> Motion {
        motion(&self.structure, &self.starts, &self.parameters, self.wind_speed_m_s).0
    }
    /// Readings of the model on `grid`, which begins where the swing does.
    pub fn readings(&self, grid: &Grid) -> Vec<f64> {
        let (motion, zero) =
            motion(&self.structure, &self.starts, &self.parameters, self.wind_speed_m_s);
        let mut y = vec![0.0; grid.count];
        motion.readings(grid, &mut y);
        y.iter_mut().for_each(|y| *y += zero);
        y
    }
}

pub(crate) fn motion(
    structure: &Structure,
    starts: &[usize],
    p: &[f64],
    wind_speed_m_s: f64,
) -> (Motion, f64) {
    let mut terms = Terms::in_wind(wind_speed_m_s);
    for (effect, &at) in structure.effects.iter().zip(starts) {
        effect.write(&p[at..], &mut terms);
    }
    let motion = Motion {
        natural_frequency_rad_s: p[0],
        damping_ratio: p[1],
        yaw_rad: p[2],
        rate_rad_s: p[3],
        terms,
    };
    (motion, if structure.zero_unknown { p[PLAIN] } else { 0.0 })
}

fn solve(swing: &Swing, structure: &Structure, start: &[f64], count: usize) -> Fit {
    solve_in(swing, structure, start, count, EVALUATIONS)
}

fn solve_in(
    swing: &Swing,
    structure: &Structure,
    start: &[f64],
    count: usize,
    max_evaluations: usize,
) -> Fit {
    solve_one(Release { swing, count }, structure, start, max_evaluations)
}

/// Fits from `start` over ever longer parts of the first `count` means.
fn lengthened(swing: &Swing, structure: &Structure, start: &[f64], count: usize) -> Fit {
    let mut p = start.to_vec();
    let mut cycles = FIRST_CYCLES;
    loop {
        let part = (cycles * swing.per_cycle()) as usize;
        let fit = solve(swing, structure, &p, part.min(count));
        if part >= count {
            return fit;
        }
        if fit.sum_of_squares.is_finite() {
            p = fit.parameters;
        }
        cycles *= LONGER;
    }
}

pub(crate) fn finished(swing: &Swing, structure: &Structure, fit: Fit, count: usize) -> Fitted {
    let (motion, zero) =
        motion(structure, &structure.starts(), &fit.parameters, swing.wind_speed_m_s);
    let mut residuals = vec![0.0; count];
    motion.readings(&Grid { count, ..swing.grid }, &mut residuals);
    for (r, y) in residuals.iter_mut().zip(&swing.yaw_rad) {
        *r += zero - y;
    }
    let converged = fit.stop.is_minimum();
    let wind_speed_m_s = swing.wind_speed_m_s;
    let covariance = fit.covariance.ok();
    Fitted::new(structure.clone(), fit.parameters, residuals, converged, covariance, wind_speed_m_s)
}

/// The plain model (with a free zero of the sensor if `zero_unknown`).
pub fn fit_plain(swing: &Swing, zero_unknown: bool, count: usize) -> Fitted {
    fit_plain_within(swing, &Structure { zero_unknown, ..Structure::default() }, count)
}

/// The plain model of `structure`, whose effects are left out, within its limits.
pub fn fit_plain_within(swing: &Swing, structure: &Structure, count: usize) -> Fitted {
    let structure = Structure { effects: Vec::new(), ..structure.clone() };
    let wn = swing.windows.first().map_or(swing.frequency_rad_s, |w| w.natural_frequency_rad_s);
    let zeta = swing.windows.first().map_or(0.01, |w| w.damping_ratio);
    let (b, r) = first_state(swing);
    let mut start = vec![wn, zeta, b, r];
    if structure.zero_unknown {
        let middle = swing.yaw_rad.iter().sum::<f64>() / swing.yaw_rad.len() as f64;
        start[2] -= middle;
        start.push(middle);
    }
    let fit = lengthened(swing, &structure, &start, count);
    // The whole record's mean frequency, where the first cycles' leads to another count of cycles.
    let mut mean = start.clone();
    mean[0] = swing.windows.iter().map(|w| w.natural_frequency_rad_s).sum::<f64>()
        / swing.windows.len().max(1) as f64;
    mean[1] = swing.windows.iter().map(|w| w.damping_ratio).sum::<f64>()
        / swing.windows.len().max(1) as f64;
    let other = solve(swing, &structure, &mean, count);
    let fit = if other.sum_of_squares < fit.sum_of_squares { other } else { fit };
    finished(swing, &structure, fit, count)
}

/// Angle and rate at the first mean, from the first eighth of a cycle.
fn first_state(swing: &Swing) -> (f64, f64) {
    let n = ((swing.per_cycle() / 8.0) as usize).clamp(2, swing.yaw_rad.len());
    let y = &swing.yaw_rad[..n];
    (y[0], (y[n - 1] - y[0]) / ((n - 1) as f64 * swing.grid.step_s) * 0.5)
}

/// `inner` with `effect` added, never worse than `inner`: started from it with the effect at zero, over lengthening
/// horizons, and from small sizes of either sign, until a start explains the swing.
///
/// ```
/// use yawrig_core::effects::Effect;
/// use yawrig_core::fit::fitting::{fit_added, fit_plain};
/// use yawrig_core::fit::swing::Swing;
/// use yawrig_core::record::Record;
///
/// // A zero that drifts by 0.1 deg/s, and a trace of noise.
/// let noise = |k: u64| ((k.wrapping_mul(2_654_435_761) >> 7) % 1000) as f64 * 1e-4 - 0.05;
/// let (time_s, yaw_deg) = (0..6000u64)
///     .map(|k| {
///         let t = k as f64 / 300.0;
///         (t, 12.0 * (-0.06 * t).exp() * (6.0 * t).cos() + 0.1 * t + noise(k))
///     })
///     .unzip();
/// let decay = Swing::of(&Record { file: "mine".into(), time_s, yaw_deg })?;
/// let plain = fit_plain(&decay, false, decay.yaw_rad.len());
/// let with = fit_added(&decay, &plain, &Effect::BaselineDrift);
/// assert!(5.0 * with.rms_rad() < plain.rms_rad());
/// let (name, drift_rad_s) = &with.effect_parameters()[0];
/// assert_eq!(name, "baseline_drift.d");
/// assert!((drift_rad_s.value.to_degrees() / 0.1 - 1.0).abs() < 0.05);
/// # Ok::<(), yawrig_core::error::Error>(())
/// ```
pub fn fit_added(swing: &Swing, inner: &Fitted, effect: &Effect) -> Fitted {
    let structure = inner.structure.with(effect);
    let count = inner.count;
    // Of a fit, whose residuals count over the noise.
    let enough = SURELY * SURELY * count as f64;
    let mut best: Option<Fit> = None;
    let starts = crate::fit::starts::of(swing, inner, effect);
    if structure.effects.iter().any(|e| matches!(e, Effect::Own(_))) {
        return fit_own(swing, inner, &structure, &starts);
    }
    for (k, start) in starts.iter().enumerate() {
        let mut p = inner.parameters.clone();
        p.extend(start);
        let mut fits = vec![];
        if k == 0 {
            fits.push(solve(swing, &structure, &p, count));
            if fits[0].sum_of_squares > enough {
                fits.push(lengthened(swing, &structure, &p, count));
            }
        } else {
            // A start that has not come near the best by now is not going to win.
            let short = solve_in(swing, &structure, &p, count, SHORT);
            let reached = best.as_ref().map_or(f64::INFINITY, |b| b.sum_of_squares);
            if short.sum_of_squares < NEAR * reached && short.evaluations >= SHORT {
                fits.push(solve(swing, &structure, &short.parameters, count));
            }
            fits.push(short);
        }
        for fit in fits {
            if best.as_ref().is_none_or(|b| fit.sum_of_squares < b.sum_of_squares) {
                best = Some(fit);
            }
        }
        if best.as_ref().is_some_and(|b| b.sum_of_squares <= enough && b.stop.is_minimum()) {
            break;
        }
    }
    nested(swing, inner, &structure, best.expect("a start for every effect"), effect)
}

fn nested(
    swing: &Swing,
    inner: &Fitted,
    structure: &Structure,
    fit: Fit,
    effect: &Effect,
) -> Fitted {
    let mut fitted = finished(swing, structure, fit, inner.count);
    // An effect kept within limits need not be able to vanish.
    fitted.converged &= structure.limits_effect(effect)
        || fitted.sum_of_squares <= inner.sum_of_squares * (1.0 + 1e-9);
    fitted
}

/// The same where there is a user's own effect, whose simulations take long and whose parameters may be many: a few
/// steps from every start, and on from the best.
fn fit_own(swing: &Swing, inner: &Fitted, structure: &Structure, starts: &[Vec<f64>]) -> Fitted {
    let begun = |start: &Vec<f64>| {
        let mut p = inner.parameters.clone();
        p.extend(start);
        solve_in(swing, structure, &p, inner.count, OWN_FIRST)
    };
    let better = |a: &Fit, b: &Fit| a.sum_of_squares.total_cmp(&b.sum_of_squares);
    let best = starts.iter().map(begun).min_by(better).expect("a start for every effect");
    let fit = match best.stop.is_minimum() {
        true => best,
        false => solve_in(swing, structure, &best.parameters, inner.count, OWN_EVALUATIONS),
    };
    let added = structure.effects.last().expect("an effect").clone();
    nested(swing, inner, structure, fit, &added)
}

/// `structure` fitted from given numbers (in the order of [`Fitted::parameters`]), directly and over lengthening
/// horizons.
pub fn fit_from(swing: &Swing, structure: &Structure, start: &[f64], count: usize) -> Fitted {
    let direct = solve(swing, structure, start, count);
    let longer = lengthened(swing, structure, start, count);
    let fit = if longer.sum_of_squares < direct.sum_of_squares { longer } else { direct };
    finished(swing, structure, fit, count)
}

/// `structure` fitted to the whole swing from numbers near its own.
pub(crate) fn refitted(swing: &Swing, structure: &Structure, start: &[f64]) -> Fitted {
    let count = swing.yaw_rad.len();
    finished(swing, structure, solve(swing, structure, start, count), count)
}

/// `model` fitted again to the first `count` means, from its own values.
pub fn refit(swing: &Swing, model: &Fitted, count: usize) -> Fitted {
    let direct = solve(swing, &model.structure, &model.parameters, count);
    finished(swing, &model.structure, direct, count)
}

/// `model` with its effects in another order, its values kept and fitted once more.
pub fn reordered(swing: &Swing, model: &Fitted, effects: &[Effect]) -> Fitted {
    let structure = Structure { effects: effects.to_vec(), ..model.structure.clone() };
    let mut p = model.parameters[..PLAIN + usize::from(structure.zero_unknown)].to_vec();
    for effect in effects {
        p.extend(model.varied(effect).expect("an effect of the model"));
    }
    finished(swing, &structure, solve(swing, &structure, &p, model.count), model.count)
}

/// `model` less `effect`, fitted from what is left of its values.
pub fn fit_removed(swing: &Swing, model: &Fitted, effect: &Effect) -> Fitted {
    let structure = model.structure.without(effect);
    let mut p = model.parameters[..PLAIN + usize::from(structure.zero_unknown)].to_vec();
    for other in &structure.effects {
        p.extend(model.varied(other).expect("an effect of the model"));
    }
    fit_from(swing, &structure, &p, model.count)
}

/// Residual over noise on the means after the first `count`, the model having been fitted to those only.
pub fn held_out_over_noise(swing: &Swing, model: &Fitted) -> f64 {
    let y = model.readings(&swing.grid);
    let later = model.count..swing.yaw_rad.len();
    let n = later.len().max(1) as f64;
    let sum: f64 = later.map(|k| (y[k] - swing.yaw_rad[k]).powi(2)).sum();
    (sum / n).sqrt() / swing.noise_rad
}
