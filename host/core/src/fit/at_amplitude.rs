//! Natural frequency and damping ratio of a model against amplitude: what an engineer takes away where a law
//! is not linear.

use crate::discrepancy::{add_shape, Discrepancy, ABOVE_NOISE, SHAPES};
use crate::fit::fitted::Fitted;
use crate::fit::free_decay::FreeDecay;
use crate::fit::problem::DIFFERENCE;
use crate::fit::structure::motion;
pub use crate::identify::AtAmplitude;
use crate::identify::WindowEstimate;
use crate::motion::simulate::{Grid, Motion};
use crate::quantity::Quantity;
use nalgebra::DMatrix;
use std::f64::consts::TAU;

/// Instants of a cycle, and natural periods within which one has to end.
const INSTANTS: f64 = 400.0;
const PERIODS: f64 = 4.0;

/// wn and zeta of `model` at amplitudes from the largest to the smallest that it was fitted to in `decay`,
/// geometric. Periodic forcing is left out, what drifts is taken as it is when the decay passes the
/// amplitude; uncertainties hold what the model lacks where [`crate::fit::joint::JointFit::with_discrepancy`]
/// has asked for it. Amplitudes from which no cycle ends are left out.
pub fn at_amplitudes(decay: &FreeDecay, model: &Fitted) -> Vec<AtAmplitude> {
    let own = model.motion();
    let wn = own.natural_frequency_rad_s;
    let grid = Grid { count: model.count, ..decay.grid };
    let unread = Motion { terms: own.terms.free(), ..own };
    let rest = unread.rest_rad();
    let (yaw, rate) = unread.readings_and_rates(&grid);
    let envelope: Vec<f64> = yaw.iter().zip(&rate).map(|(b, r)| (b - rest).hypot(r / wn)).collect();
    let (Some(&first), Some(&last)) = (envelope.first(), envelope.last()) else { return vec![] };
    let at = |amplitude_rad: f64| {
        let passed = envelope.iter().position(|a| *a <= amplitude_rad * (1.0 + 1e-9));
        of_cycle(model, amplitude_rad, decay.grid.time_s(passed?), decay)
    };
    AtAmplitude::amplitudes(first, last).filter_map(at).collect()
}

/// `model` with uncertainties that hold what it lacks, too: as far as what it leaves of `decay` shows how
/// much that is, and, where a linear step from the model does not get there, as far as the record's own
/// windows are off it.
pub(crate) fn with_discrepancy(model: Fitted, decay: &FreeDecay) -> Fitted {
    with_windows(model.with_discrepancy(decay), decay)
}

/// The same of a `model` that has its discrepancy already.
pub(crate) fn with_windows(mut model: Fitted, decay: &FreeDecay) -> Fitted {
    let of_model = |m: &AtAmplitude| decay.measurand.of_model(m.amplitude_deg);
    let smallest = decay.measured.last().map(of_model);
    model.missed = smallest.map_or([0.0; 2], |amplitude_rad| missed(decay, &model, amplitude_rad));
    model
}

/// By how much the model's natural frequency and damping ratio are off the record's own, as its windows show
/// them at the nearest amplitude, beyond what noise leaves uncertain of these: squares.
fn missed(decay: &FreeDecay, model: &Fitted, amplitude_rad: f64) -> [f64; 2] {
    let of_model = |m: &AtAmplitude| decay.measurand.of_model(m.amplitude_deg);
    let apart = |m: &&AtAmplitude| (of_model(m) / amplitude_rad).ln().abs();
    let nearest = decay.measured.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
    // Where the phase is lost a linear step sees no law.
    let has_law = model.discrepancy.as_ref().is_some_and(Discrepancy::has_law);
    let lacks = has_law || model.over_noise(decay) > ABOVE_NOISE;
    // Windows are of the strongest mode.
    let lacks = lacks && !model.has_strongest_second(decay);
    let Some(seen) = nearest.filter(|_| lacks) else { return [0.0; 2] };
    let window = |w: &&WindowEstimate| (w.amplitude_deg - seen.amplitude_deg).abs();
    let passed = decay.windows.iter().min_by(|a, b| window(a).total_cmp(&window(b)));
    let start_s = passed.map_or(0.0, |w| w.time_s - decay.release_time_s);
    let Some(there) = cycle(&model.motion(), of_model(seen), start_s) else {
        return [0.0; 2];
    };
    let zeta = seen.damping_ratio;
    let damped = seen.natural_frequency_rad_s.value * (1.0 - zeta.value.powi(2)).max(0.0).sqrt();
    let off =
        [(damped - there[0], seen.natural_frequency_rad_s.u), (zeta.value - there[1], zeta.u)];
    off.map(|(off, u)| (off * off - u * u).max(0.0))
}

fn of_cycle(
    model: &Fitted,
    amplitude_rad: f64,
    start_s: f64,
    decay: &FreeDecay,
) -> Option<AtAmplitude> {
    let starts = model.structure.starts();
    let of = |p: &[f64], lacking: Option<(usize, f64)>| {
        let (mut motion, _) = motion(&model.structure, &starts, p, decay.around());
        if let Some((which, strength)) = lacking {
            add_shape(&mut motion, which, strength, decay.amplitude_rad);
        }
        cycle(&motion, amplitude_rad, start_s)
    };
    let values = of(&model.parameters, None)?;
    let missed = missed(decay, model, amplitude_rad);
    let mut variances = [f64::NAN; 2];
    if let Some(covariance) = model.covariance_but_for_law() {
        let sizes = model.structure.sizes(decay);
        let mut p = model.parameters.clone();
        // By each number but the state and the sensor's zero, which a cycle from rest has not.
        let mut rows = [vec![0.0; p.len()], vec![0.0; p.len()]];
        let free = |j: &usize| {
            !(2..model.structure.own_numbers()).contains(j) && covariance[(*j, *j)] > 0.0
        };
        for j in (0..p.len()).filter(free) {
            let step = DIFFERENCE * sizes[j];
            p[j] = model.parameters[j] + step;
            let there = of(&p, None)?;
            p[j] = model.parameters[j];
            for q in 0..2 {
                rows[q][j] = (there[q] - values[q]) / step;
            }
        }
        for q in 0..2 {
            let row = nalgebra::DVector::from_column_slice(&rows[q]);
            variances[q] = (row.transpose() * &covariance * &row)[(0, 0)];
        }
        if let Some(lacking) = &model.discrepancy {
            let mut off = DMatrix::zeros(2, SHAPES);
            for which in 0..SHAPES {
                let there = of(&model.parameters, Some((which, DIFFERENCE)))?;
                let shift = lacking.shift.column(which);
                for (q, row) in rows.iter().enumerate() {
                    let shifted: f64 = row.iter().zip(&shift).map(|(row, by)| row * by).sum();
                    off[(q, which)] = shifted - (there[q] - values[q]) / DIFFERENCE;
                }
            }
            let off = off * &lacking.strengths;
            for (variance, off) in variances.iter_mut().zip(off.row_iter()) {
                *variance += off.norm_squared();
            }
        }
    }
    // By `max` what is not known would be zero.
    let known = |variance: f64| if variance < 0.0 { 0.0 } else { variance };
    let quantity = |q: usize| Quantity::new(values[q], (known(variances[q]) + missed[q]).sqrt());
    Some(AtAmplitude {
        amplitude_deg: decay.measurand.shown(amplitude_rad),
        natural_frequency_rad_s: quantity(0),
        damping_ratio: quantity(1),
    })
}

/// wn and zeta of the cycle that begins at `start_s` at rest, `amplitude_rad` from the rest angle. `None`
/// where none ends.
fn cycle(motion: &Motion, amplitude_rad: f64, start_s: f64) -> Option<[f64; 2]> {
    let free = Motion { terms: motion.terms.free(), ..motion.clone() };
    let rest = free.rest_rad();
    let begun = Motion { yaw_rad: rest + amplitude_rad, rate_rad_s: 0.0, ..free };
    let step_s = TAU / begun.natural_frequency_rad_s / INSTANTS;
    let count = (PERIODS * INSTANTS) as usize;
    let grid = Grid { start_s, step_s, count, mean_width_s: 0.0 };
    let (yaw, rate) = begun.readings_and_rates(&grid);
    // Through zero rate on the far side, then on this one.
    let far = (1..count - 1).find(|&k| rate[k] > 0.0)?;
    let near = (far..count - 1).find(|&k| rate[k] > 0.0 && rate[k + 1] <= 0.0)?;
    let share = rate[near] / (rate[near] - rate[near + 1]);
    let period_s = (near as f64 + share) * step_s;
    let end = yaw[near] + 0.5 * rate[near] * share * step_s - rest;
    (end > 0.0).then(|| [TAU / period_s, (amplitude_rad / end).ln() / TAU])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{Effect, Terms};
    use crate::fit::fitting::{fit_added, fit_plain};
    use crate::record::Record;
    use std::f64::consts::PI;

    /// Periods and decrements that have a closed form.
    #[test]
    fn a_cycle_has_the_period_and_the_decrement_of_the_closed_forms() {
        let (wn, a) = (7.0, 1.2f64);
        let of = |zeta: f64, effect: Option<(Effect, &[f64])>| {
            let terms = Terms::of(effect);
            let motion = Motion {
                natural_frequency_rad_s: wn,
                damping_ratio: zeta,
                yaw_rad: 0.1,
                rate_rad_s: 0.0,
                terms,
            };
            cycle(&motion, a, 0.0).expect("a cycle")
        };
        let damped = wn * (1.0 - 0.02f64 * 0.02).sqrt();
        let [frequency, zeta] = of(0.02, None);
        assert!((frequency / damped - 1.0).abs() < 1e-6, "{frequency}");
        assert!((zeta / (0.02 * wn / damped) - 1.0).abs() < 1e-4, "{zeta}");
        // A pendulum's period is an elliptic integral: pi / (2 agm(1, cos(a/2))) of the small one's quarter.
        let (mut x, mut y) = (1.0, (a / 2.0).cos());
        for _ in 0..8 {
            (x, y) = (0.5 * (x + y), f64::sqrt(x * y));
        }
        let [frequency, zeta] = of(0.0, Some((Effect::PendulumGravity, &[wn * wn])));
        // A kick in the middle of a step errs by (wn h)^2 / 24, 5e-5 of the moment at four hundred steps a
        // cycle.
        assert!((frequency / (wn * x) - 1.0).abs() < 2e-5, "{frequency} {}", wn * x);
        assert!(zeta.abs() < 2e-6, "{zeta}");
        // Dry friction takes 4 c / wn^2 off the amplitude in a cycle and leaves its period.
        let c = 0.5;
        let [frequency, zeta] = of(0.0, Some((Effect::CoulombFriction, &[c])));
        let end = a - 4.0 * c / (wn * wn);
        assert!((frequency / wn - 1.0).abs() < 1e-6, "{frequency}");
        assert!((zeta / ((a / end).ln() / (2.0 * PI)) - 1.0).abs() < 1e-4, "{zeta}");
        // One that is held before the cycle ends has none.
        let held = Terms::of([(Effect::CoulombFriction, &[30.0][..])]);
        let motion = Motion {
            natural_frequency_rad_s: wn,
            damping_ratio: 0.0,
            yaw_rad: 0.1,
            rate_rad_s: 0.0,
            terms: held,
        };
        assert_eq!(cycle(&motion, a, 0.0), None);
    }

    /// A spring that is softer within ten degrees, as where a magnet stands behind the model; no effect is,
    /// and no small step from a model leads there. What the record's windows show holds the truth.
    #[test]
    fn a_model_that_is_far_off_at_small_amplitudes_knows_its_natural_frequency_as_badly() {
        let (wn, zeta, share, width_rad) = (10.0, 0.012, 0.25, 10f64.to_radians());
        let truth = wn * f64::sqrt(1.0 - share);
        let rate_of = |b: f64, r: f64| {
            -wn * wn * b * (1.0 - share * (-(b / width_rad).powi(4)).exp()) - 2.0 * zeta * wn * r
        };
        // Runge and Kutta's steps of half a millisecond.
        let (h, mut b, mut r) = (0.0005, 60f64.to_radians(), 0.0);
        let (mut time_s, mut yaw_deg) = (Vec::new(), Vec::new());
        for k in 0..60_000 {
            if k % 20 == 0 {
                time_s.push(h * f64::from(k));
                yaw_deg.push(b.to_degrees() + 0.02 * f64::from(k % 3));
            }
            let [mut db, mut dr] = [0.0, 0.0];
            let (mut kb, mut kr) = (0.0, 0.0);
            for (part, weight) in [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
                let (bb, rr) = (b + part * h * kb, r + part * h * kr);
                (kb, kr) = (rr, rate_of(bb, rr));
                db += weight * kb / 6.0;
                dr += weight * kr / 6.0;
            }
            (b, r) = (b + h * db, r + h * dr);
        }
        let decay = FreeDecay::of(&Record::new("soft", time_s, yaw_deg)).expect("a free decay");
        let plain = fit_plain(&decay, false, decay.yaw_rad.len());
        let fit = fit_added(&decay, &plain, &Effect::OddQuadraticStiffness);
        let miss = |q: Quantity| (q.value - truth).abs() / q.u;
        let linear = fit.clone().with_discrepancy(&decay).natural_frequency_rad_s();
        let held = with_discrepancy(fit, &decay).natural_frequency_rad_s();
        println!("planted {truth:.3}: {linear} by a linear step, {held} with the windows");
        assert!(miss(held) < 2.0, "{held}, planted {truth}");
        assert!(miss(linear) > miss(held), "{linear}, {held}");
    }
}
