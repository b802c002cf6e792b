//! A model with effects fitted to a free decay: natural frequency, damping, initial state and every
//! coefficient.

pub use crate::discrepancy::enough;
use crate::effects::Effect;
pub use crate::fit::fitted::{Covariance, Fitted, Modal};
use crate::fit::free_decay::FreeDecay;
use crate::fit::part::{lengthened, Release};
use crate::fit::problem::{problem_of_one, EVALUATIONS};
use crate::fit::segments::{FINE, FIRST_STEPS};
pub use crate::fit::structure::{Limit, Number, Structure};
use crate::fit::structure::{WN, ZETA};
use crate::par_map::ParMap;
use crate::solver::Fit;

fn solve(decay: &FreeDecay, structure: &Structure, start: &[f64], count: usize) -> Fit {
    solve_in(decay, structure, start, count, EVALUATIONS)
}

fn solve_in(
    decay: &FreeDecay,
    structure: &Structure,
    start: &[f64],
    count: usize,
    max_evaluations: usize,
) -> Fit {
    problem_of_one(Release { decay, count }, structure, start).minimise(start, max_evaluations)
}

/// Fits from `start` over ever longer parts of the first `count` means.
fn solve_lengthened(decay: &FreeDecay, structure: &Structure, start: &[f64], count: usize) -> Fit {
    let mut p = start.to_vec();
    lengthened(&[Release { decay, count }], |part| {
        let fit = solve(decay, structure, &p, part[0].count);
        if fit.sum_of_squares.is_finite() {
            p.clone_from(&fit.parameters);
        }
        fit
    })
}

/// The one with the smaller sum of squares.
fn nearer(first: Fit, second: Fit) -> Fit {
    if second.sum_of_squares < first.sum_of_squares {
        second
    } else {
        first
    }
}

/// The model that `fit` found.
pub(crate) fn finished(decay: &FreeDecay, structure: &Structure, fit: Fit, count: usize) -> Fitted {
    let problem = problem_of_one(Release { decay, count }, structure, &fit.parameters);
    let converged = fit.stop.is_minimum();
    problem.parts[0].fitted(&fit.parameters, converged, fit.covariance.as_ref())
}

/// `structure` fitted to the first `count` means from numbers near its own.
pub(crate) fn fit_near(
    decay: &FreeDecay,
    structure: &Structure,
    start: &[f64],
    count: usize,
) -> Fitted {
    finished(decay, structure, solve(decay, structure, start, count), count)
}

/// The second-order model fitted to the first `count` means, with a free zero of the sensor if
/// `zero_unknown`.
pub fn fit_plain(decay: &FreeDecay, zero_unknown: bool, count: usize) -> Fitted {
    fit_plain_within(decay, &Structure { zero_unknown, ..Structure::default() }, count)
}

/// The same within the limits of `structure`, whose effects are left out.
pub fn fit_plain_within(decay: &FreeDecay, structure: &Structure, count: usize) -> Fitted {
    let structure = Structure { effects: Vec::new(), ..structure.clone() };
    let wn = decay.windows.first().map_or(decay.frequency_rad_s, |w| w.natural_frequency_rad_s);
    let zeta = decay.windows.first().map_or(0.01, |w| w.damping_ratio);
    let middle = match structure.zero_unknown {
        true => decay.yaw_rad.iter().sum::<f64>() / decay.yaw_rad.len() as f64,
        false => 0.0,
    };
    let (y, slope) = first_reading(decay);
    let [b, r] = decay.measurand.derivative().state([y - middle, slope], wn, zeta);
    let mut start = vec![wn, zeta, b, r];
    start.extend(structure.zero_unknown.then_some(middle));
    let fit = solve_lengthened(decay, &structure, &start, count);
    // The whole record's mean frequency, where the first cycles' leads to another count of cycles.
    start[WN] = decay.mean_of_windows(|w| w.natural_frequency_rad_s);
    start[ZETA] = decay.mean_of_windows(|w| w.damping_ratio);
    let other = solve(decay, &structure, &start, count);
    finished(decay, &structure, nearer(fit, other), count)
}

/// The first mean and its slope, from the first eighth of a cycle.
fn first_reading(decay: &FreeDecay) -> (f64, f64) {
    let n = ((decay.per_cycle() / 8.0) as usize).clamp(2, decay.yaw_rad.len());
    let y = &decay.yaw_rad[..n];
    (y[0], (y[n - 1] - y[0]) / ((n - 1) as f64 * decay.grid.step_s) * 0.5)
}

/// `inner` with `effect` added, never worse than `inner`: started from it with the effect at zero, over
/// lengthening horizons where that finds no minimum, and from small sizes of either sign.
///
/// ```
/// use yawrig_core::effects::Effect;
/// use yawrig_core::fit::fitting::{fit_added, fit_plain};
/// use yawrig_core::fit::free_decay::FreeDecay;
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
/// let decay = FreeDecay::from_record(&Record::new("mine", time_s, yaw_deg))?;
/// let plain = fit_plain(&decay, false, decay.yaw_rad.len());
/// let with = fit_added(&decay, &plain, &Effect::BaselineDrift);
/// assert!(5.0 * with.rms_rad() < plain.rms_rad());
/// let (name, drift_rad_s) = &with.effect_parameters()[0];
/// assert_eq!(name, "baseline_drift.d");
/// assert!((drift_rad_s.value.to_degrees() / 0.1 - 1.0).abs() < 0.05);
/// # Ok::<(), yawrig_core::error::Error>(())
/// ```
pub fn fit_added(decay: &FreeDecay, inner: &Fitted, effect: &Effect) -> Fitted {
    let structure = inner.structure.with(effect);
    let extended = |start: &Vec<f64>| [&inner.parameters[..], start].concat();
    let starts = crate::fit::starts::of(decay, inner, effect);
    let starts: Vec<Vec<f64>> = starts.iter().map(extended).collect();
    let fit = match structure.effects.iter().any(Effect::is_own) {
        true => from_any_with_own(decay, &structure, &starts, inner.count),
        false => from_any(decay, &structure, &starts, inner.count),
    };
    let mut fitted = finished(decay, &structure, fit, inner.count);
    // An effect kept within limits need not be able to vanish.
    fitted.converged &= structure.limits_effect(effect)
        || fitted.sum_of_squares <= inner.sum_of_squares * (1.0 + 1e-9);
    fitted
}

/// The nearest fit from any of `starts`, the first of which is the smaller model.
fn from_any(decay: &FreeDecay, structure: &Structure, starts: &[Vec<f64>], count: usize) -> Fit {
    let from = |(k, start): (usize, &Vec<f64>)| {
        if k > 0 {
            return solve_in(decay, structure, start, count, FIRST_STEPS);
        }
        let fit = solve(decay, structure, start, count);
        match fit.stop.is_minimum() {
            true => fit,
            false => nearer(fit, solve_lengthened(decay, structure, start, count)),
        }
    };
    let mut fits = starts.iter().enumerate().par_map(from);
    let mut best = fits.next().expect("a start for every effect");
    for short in fits {
        // A start that is not ahead by now is not going to win.
        if short.sum_of_squares < best.sum_of_squares && short.evaluations >= FIRST_STEPS {
            best = nearer(best, solve(decay, structure, &short.parameters, count));
        }
        best = nearer(best, short);
    }
    best
}

/// The same where there is a user's own effect, whose simulations take long and whose parameters may be many:
/// a few steps from every start, and on from the best.
fn from_any_with_own(
    decay: &FreeDecay,
    structure: &Structure,
    starts: &[Vec<f64>],
    count: usize,
) -> Fit {
    let mut best: Option<Fit> = None;
    for start in starts {
        let fit = solve_in(decay, structure, start, count, FIRST_STEPS);
        if best.as_ref().is_none_or(|b| fit.sum_of_squares.total_cmp(&b.sum_of_squares).is_lt()) {
            best = Some(fit);
        }
        if best.as_ref().is_some_and(|b| b.sum_of_squares <= enough(count)) {
            break;
        }
    }
    let best = best.expect("a start for every effect");
    match best.stop.is_minimum() {
        true => best,
        // On from the best with more evaluations than any other fit takes.
        false => solve_in(decay, structure, &best.parameters, count, 50),
    }
}

/// `structure` fitted to the first `count` means from given numbers (in the order of [`Fitted::parameters`]),
/// directly, and where that is not down to the noise over lengthening horizons.
pub fn fit_from(decay: &FreeDecay, structure: &Structure, start: &[f64], count: usize) -> Fitted {
    let direct = solve(decay, structure, start, count);
    if direct.stop.is_minimum() && direct.sum_of_squares <= enough(count) {
        return finished(decay, structure, direct, count);
    }
    let longer = solve_lengthened(decay, structure, start, count);
    finished(decay, structure, nearer(direct, longer), count)
}

/// `structure` fitted to the whole free decay from numbers near its own.
pub(crate) fn refitted(decay: &FreeDecay, structure: &Structure, start: &[f64]) -> Fitted {
    let count = decay.yaw_rad.len();
    let mut fit = solve(decay, structure, start, count);
    // The numbers of a law or of a large swing share what they explain.
    for _ in 0..4 {
        if fit.stop.is_minimum() || decay.stop.is_requested() {
            break;
        }
        let before = fit.sum_of_squares;
        fit = solve(decay, structure, &fit.parameters, count);
        if before - fit.sum_of_squares < FINE.settled * before {
            break;
        }
    }
    finished(decay, structure, fit, count)
}

/// `model` once more by precise simulations, as
/// [`JointFit::polished`](crate::fit::joint::JointFit::polished).
pub(crate) fn polished(mut model: Fitted, decay: &FreeDecay) -> Fitted {
    let Some(moved) = are_moved_by_steps(&[(&model, decay)]) else { return model };
    if !moved {
        model.structure = model.structure.precisely();
        return model;
    }
    let polished = refitted(decay, &model.structure.precisely(), &model.parameters);
    if polished.converged {
        polished
    } else {
        model
    }
}

/// Whether the error of a quick simulation's steps may move a number that these `models` share by a share of
/// its standard uncertainty that counts: all of that error, were it of the number's own shape, over what the
/// models leave. `None` where one has not converged or a precise simulation of it runs away, of a user's own
/// effect, which is followed precisely anyway, and once the user stops it.
pub(crate) fn are_moved_by_steps(models: &[(&Fitted, &FreeDecay)]) -> Option<bool> {
    let square = |(model, decay): &(&Fitted, &FreeDecay)| {
        let is_own = model.structure.effects.iter().any(Effect::is_own);
        if !model.converged || is_own || decay.stop.is_requested() {
            return None;
        }
        let mut precise = Fitted::clone(model);
        precise.structure = model.structure.precisely();
        let readings = precise.readings(&decay.grid);
        let quick = model.residuals.iter().zip(&decay.yaw_rad).map(|(off, yaw)| off + yaw);
        let error: f64 =
            quick.zip(&readings).map(|(quick, precise)| (quick - precise).powi(2)).sum();
        let square = error * model.effective_count() / model.sum_of_squares;
        square.is_finite().then_some(square)
    };
    let squares: Vec<f64> = models.iter().par_map(square).collect::<Option<_>>()?;
    // By a tenth of that: in quadrature half a per cent of it.
    Some(squares.iter().sum::<f64>() > 0.1 * 0.1)
}

/// `model` fitted again to the first `count` means, from its own values.
pub fn refit(decay: &FreeDecay, model: &Fitted, count: usize) -> Fitted {
    fit_near(decay, &model.structure, &model.parameters, count)
}

/// `model` with its effects in another order, its values kept and fitted once more.
pub(crate) fn reordered(decay: &FreeDecay, model: &Fitted, effects: &[Effect]) -> Fitted {
    let structure = Structure { effects: effects.to_vec(), ..model.structure.clone() };
    let p = model.numbers_for(&structure).expect("effects of the model");
    fit_near(decay, &structure, &p, model.count)
}

/// `model` less `effect`, fitted from what is left of its values.
pub(crate) fn fit_removed(decay: &FreeDecay, model: &Fitted, effect: &Effect) -> Fitted {
    let structure = model.structure.without(effect);
    let p = model.numbers_for(&structure).expect("effects of the model");
    fit_from(decay, &structure, &p, model.count)
}

/// `model` with each of its lines looked for anew, beside all others: a line that was found first stands
/// where it made up for what another effect has explained since. What is no better is left as it is.
pub fn lines_anew(decay: &FreeDecay, model: Fitted) -> Fitted {
    let effects = model.structure.effects.clone();
    let is_free = |e: &&Effect| e.line().is_some() && !model.structure.limits_effect(e);
    let lines: Vec<&Effect> = effects.iter().filter(is_free).collect();
    let again = |model: Fitted, line: &Effect| {
        let found = fit_added(decay, &fit_removed(decay, &model, line), line);
        let better = found.converged && found.sum_of_squares < model.sum_of_squares;
        if better {
            reordered(decay, &found, &effects)
        } else {
            model
        }
    };
    lines.into_iter().fold(model.clone(), again)
}

/// Residual over noise on the means after the first `count`, the model having been fitted to those only.
pub fn held_out_over_noise(decay: &FreeDecay, model: &Fitted) -> f64 {
    let y = model.readings(&decay.grid);
    let later = model.count..decay.yaw_rad.len();
    let n = later.len().max(1) as f64;
    let (off, all) = later.fold((0.0, 0.0), |(off, all), k| {
        (off + (y[k] - decay.yaw_rad[k]).powi(2), all + decay.yaw_rad[k].powi(2))
    });
    // An error as large as the motion is no prediction, however large it is, nor is what runs away.
    (f64::min(off, all) / n).sqrt() / decay.noise_rad
}
