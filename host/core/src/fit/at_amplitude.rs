//! Natural frequency and damping ratio of a model against amplitude: what an engineer takes away where a law
//! is not linear.

use crate::fit::fitted::{not_below_zero, Fitted};
use crate::fit::free_decay::FreeDecay;
use crate::fit::part::DIFFERENCE;
use crate::identify::samples::Samples;
use crate::identify::windows::{windows, Window};
pub use crate::identify::AtAmplitude;
use crate::motion::simulate::{Grid, Motion};
use crate::quantity::Quantity;
use std::f64::consts::TAU;

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
        // Whoever asked for an end finds out why there is none.
        if decay.stop.is_requested() {
            return None;
        }
        let passed = envelope.iter().position(|a| *a <= amplitude_rad * (1.0 + 1e-9));
        of_cycle(model, amplitude_rad, decay.grid.time_s(passed?), decay)
    };
    AtAmplitude::amplitudes(first, last).filter_map(at).collect()
}

/// Windows of three cycles of what reads `yaw_rad`, sampled and cut as the record is: whatever they do to one
/// they do to the other. None where a simulation has run away.
pub(crate) fn windows_of(decay: &FreeDecay, yaw_rad: &[f64]) -> Vec<Window> {
    if yaw_rad.len() < 2 || yaw_rad.iter().any(|y| !y.is_finite()) {
        return Vec::new();
    }
    let time_s: Vec<f64> = (0..yaw_rad.len()).map(|k| decay.grid.time_s(k)).collect();
    let yaw_deg: Vec<f64> = yaw_rad.iter().map(|y| decay.measurand.shown(*y)).collect();
    let mut samples = Samples::new(&time_s, &yaw_deg);
    windows(&mut samples, time_s[0], decay.grid.time_s(yaw_rad.len()), decay.frequency_rad_s).0
}

fn of_cycle(
    model: &Fitted,
    amplitude_rad: f64,
    start_s: f64,
    decay: &FreeDecay,
) -> Option<AtAmplitude> {
    let of =
        |p: &[f64]| cycle(&model.structure.motion(p, decay.around()).0, amplitude_rad, start_s);
    let values = of(&model.parameters)?;
    let mut variances = [f64::NAN; 2];
    if let Some(covariance) = &model.covariance {
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
            let there = of(&p)?;
            p[j] = model.parameters[j];
            for q in 0..2 {
                rows[q][j] = (there[q] - values[q]) / step;
            }
        }
        variances = match &model.discrepancy {
            Some(lacking) => {
                let [wn, zeta] = &mut rows;
                wn.iter_mut().for_each(|v| *v /= values[0]);
                let [share, damping] = lacking.at(amplitude_rad, [wn, zeta]);
                [share * values[0].powi(2), damping]
            }
            None => [0, 1].map(|q| {
                let row = nalgebra::DVector::from_column_slice(&rows[q]);
                row.dot(&(covariance * &row)) * model.inflation
            }),
        };
    }
    let quantity = |q: usize| Quantity::new(values[q], not_below_zero(variances[q]).sqrt());
    Some(AtAmplitude {
        amplitude_deg: decay.measurand.shown(amplitude_rad),
        natural_frequency_rad_s: model.on_clock(quantity(0), -1.0),
        damping_ratio: quantity(1),
    })
}

/// wn and zeta of the cycle that begins at `start_s` at rest, `amplitude_rad` from the rest angle. `None`
/// where none ends within four natural periods.
fn cycle(motion: &Motion, amplitude_rad: f64, start_s: f64) -> Option<[f64; 2]> {
    let free = Motion { terms: motion.terms.free(), ..motion.clone() };
    let rest = free.rest_rad();
    let begun = Motion { yaw_rad: rest + amplitude_rad, rate_rad_s: 0.0, ..free };
    let step_s = TAU / begun.natural_frequency_rad_s / 400.0;
    let count = 4 * 400;
    // Of how a release begins, which no later cycle has, wn and zeta know nothing.
    let start_s = begun.swinging_from(start_s);
    let grid = Grid { start_s, step_s, count, mean_width_s: 0.0 };
    let (yaw, rate) = begun.readings_and_rates(&grid);
    // Through zero rate on the far side, then on this one.
    let far = (1..count - 1).find(|&k| rate[k] > 0.0).filter(|&k| yaw[k] < rest)?;
    let near = (far..count - 1).find(|&k| rate[k] > 0.0 && rate[k + 1] <= 0.0)?;
    let share = rate[near] / (rate[near] - rate[near + 1]);
    let period_s = (near as f64 + share) * step_s;
    let end = yaw[near] + 0.5 * rate[near] * share * step_s - rest;
    (end > 0.0).then(|| [TAU / period_s, (amplitude_rad / end).ln() / TAU])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discrepancy::ABOVE_NOISE;
    use crate::effects::{Effect, Terms};
    use crate::fit::fitting::{fit_added, fit_plain};
    use crate::record::Record;
    use std::f64::consts::PI;

    fn motion(wn: f64, damping_ratio: f64, effect: Option<(Effect, &[f64])>) -> Motion {
        Motion {
            natural_frequency_rad_s: wn,
            damping_ratio,
            yaw_rad: 0.1,
            rate_rad_s: 0.0,
            terms: Terms::new(effect),
        }
    }

    /// What dissipation nearly as steep as dry friction holds where it begins has no cycle; the integration's
    /// own chatter about zero rate is none.
    #[test]
    fn no_cycle_begins_where_the_model_is_held() {
        let motion = motion(20.0, 0.016, Some((Effect::PowerDamping, &[0.56, 0.065])));
        assert!(cycle(&motion, 0.1, 0.0).is_some());
        assert_eq!(cycle(&motion, 4e-4, 0.0), None);
    }

    /// Periods and decrements that have a closed form.
    #[test]
    fn a_cycle_has_the_period_and_the_decrement_of_the_closed_forms() {
        let (wn, a) = (7.0, 1.2f64);
        let of = |zeta: f64, effect: Option<(Effect, &[f64])>| {
            cycle(&motion(wn, zeta, effect), a, 0.0).expect("a cycle")
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
        let held = motion(wn, 0.0, Some((Effect::CoulombFriction, &[30.0])));
        assert_eq!(cycle(&held, a, 0.0), None);
    }

    /// Runge and Kutta's steps of half a millisecond for 30 s from `b` at rest, read every ten milliseconds.
    fn read(mut b: f64, moment: impl Fn(f64, f64, f64) -> f64) -> Record {
        let (h, mut r) = (0.0005, 0.0);
        let (mut time_s, mut yaw_deg) = (Vec::new(), Vec::new());
        for k in 0..60_000u32 {
            let t = h * f64::from(k);
            if k % 20 == 0 {
                time_s.push(t);
                let n = k / 20;
                yaw_deg.push(b.to_degrees() + 0.02 * (3.88 * f64::from(n * n % 997)).sin());
            }
            let [mut db, mut dr] = [0.0, 0.0];
            let (mut kb, mut kr) = (0.0, 0.0);
            for (part, weight) in [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
                let (bb, rr) = (b + part * h * kb, r + part * h * kr);
                (kb, kr) = (rr, moment(t + part * h, bb, rr));
                db += weight * kb / 6.0;
                dr += weight * kr / 6.0;
            }
            (b, r) = (b + h * db, r + h * dr);
        }
        Record::new("read", time_s, yaw_deg)
    }

    /// A spring that is softer within ten degrees, as where a magnet stands behind the model; no effect is,
    /// and no small step from a model leads there. What the record's windows show holds the truth.
    #[test]
    fn a_model_that_is_far_off_at_small_amplitudes_knows_its_natural_frequency_as_badly() {
        let (wn, zeta, share, width_rad) = (10.0, 0.012, 0.25, 10f64.to_radians());
        let truth = wn * f64::sqrt(1.0 - share);
        let record = read(60f64.to_radians(), |_, b, r| {
            -wn * wn * b * (1.0 - share * (-(b / width_rad).powi(4)).exp()) - 2.0 * zeta * wn * r
        });
        let decay = FreeDecay::from_record(&record).expect("a free decay");
        let plain = fit_plain(&decay, false, decay.yaw_rad.len());
        let fit = fit_added(&decay, &plain, &Effect::OddQuadraticStiffness);
        let miss = |q: Quantity| (q.value - truth).abs() / q.u;
        let by_noise = fit.natural_frequency_rad_s();
        let held = fit.with_discrepancy(&decay).natural_frequency_rad_s();
        println!("planted {truth:.3}: {by_noise} by noise, {held} with what it lacks");
        assert!(miss(held) < 2.0, "{held}, planted {truth}");
        assert!(miss(by_noise) > miss(held), "{by_noise}, {held}");
    }

    /// A periodic moment beats with the oscillation: windows of three cycles swing by a per cent and more. In
    /// the readings of a model that has it they swing alike; where it lacks a little friction its natural
    /// frequency is as uncertain as that makes it, not as the windows swing.
    #[test]
    fn windows_that_beat_do_not_make_a_model_uncertain_that_beats_alike() {
        let (wn, zeta) = (10.0, 0.004);
        let damped = wn * f64::sqrt(1.0 - zeta * zeta);
        let record = read(10f64.to_radians(), |t, b, r: f64| {
            let periodic = 0.5 * (8.2 * t).cos();
            -wn * wn * b - 2.0 * zeta * wn * r - 0.02 * (r / 0.001).tanh() + periodic
        });
        let decay = FreeDecay::from_record(&record).expect("a free decay");
        let plain = fit_plain(&decay, false, decay.yaw_rad.len());
        let fit = fit_added(&decay, &plain, &Effect::HarmonicForcing).with_discrepancy(&decay);
        let largest = decay.windows.iter().map(|w| (w.natural_frequency_rad_s / wn - 1.0).abs());
        let largest = largest.fold(0.0, f64::max);
        println!("{} over noise, windows off by up to {largest:.4}", fit.over_noise(&decay));
        assert!(largest > 0.01 && fit.over_noise(&decay) > ABOVE_NOISE);
        for at in at_amplitudes(&decay, &fit) {
            let AtAmplitude { natural_frequency_rad_s: q, amplitude_deg, .. } = at;
            println!("{amplitude_deg:.2} deg: {q}");
            assert!((q.value - damped).abs() < 2.0 * q.u && q.u < 0.001, "{q}, planted {damped}");
        }
    }
}
