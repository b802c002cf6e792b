//! A fitted model: its numbers, their covariance, and what it leaves of the record.

use crate::bic;
use crate::discrepancy::Discrepancy;
use crate::effects::Effect;
use crate::fit::free_decay::{Around, FreeDecay};
use crate::fit::part::{Part, Release};
use crate::fit::problem::problem_of_one;
use crate::fit::structure::{Structure, PLAIN, WN, YAW, ZERO, ZETA};
use crate::motion::oscillator::{Grid, Motion};
use crate::quantity::Quantity;
use crate::statistics::{correlation, independent_share};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// Covariance of numbers by their names, rad/s for the natural frequency, the effects' own units for theirs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Covariance {
    /// Of the rows and columns: `natural_frequency_rad_s`, `damping_ratio`, then `effect.name`.
    pub names: Vec<String>,
    /// Symmetric, row by row; its diagonal is u squared.
    pub matrix: Vec<Vec<f64>>,
}

impl Covariance {
    /// Whether every number of it is known.
    pub fn is_finite(&self) -> bool {
        self.matrix.iter().flatten().all(|c| c.is_finite())
    }
}

/// The linear part of a model at rest: what small oscillations would show.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Modal {
    /// Undamped.
    pub natural_frequency_rad_s: Quantity,
    /// Negative where small oscillations grow.
    pub damping_ratio: Quantity,
}

/// What two combinations of numbers have in common, given the numbers' covariance.
fn between(covariance: &DMatrix<f64>, a: &[f64], b: &[f64]) -> f64 {
    let used = |row: &[f64]| -> Vec<usize> { (0..row.len()).filter(|k| row[*k] != 0.0).collect() };
    let pairs = used(a).into_iter().flat_map(|i| used(b).into_iter().map(move |j| (i, j)));
    pairs.map(|(i, j)| a[i] * b[j] * covariance[(i, j)]).sum()
}

/// A variance, which rounding may have left a little below zero; what is not known (no number) stays so.
pub(super) fn not_below_zero(variance: f64) -> f64 {
    if variance < 0.0 {
        0.0
    } else {
        variance
    }
}

/// A fitted model.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// What the model holds.
    pub structure: Structure,
    /// wn, zeta, yaw, rate, sensor's zero where unknown, then each effect's.
    pub parameters: Vec<f64>,
    /// Of the residuals, rad2.
    pub sum_of_squares: f64,
    /// Block means that were fitted.
    pub count: usize,
    /// Whether the fit reached a minimum.
    pub converged: bool,
    pub(crate) covariance: Option<DMatrix<f64>>,
    /// Model less record, rad.
    pub residuals: Vec<f64>,
    /// Lag-one correlation of the residuals.
    pub(crate) correlation: f64,
    /// Variance inflation of the parameters by correlated residuals.
    pub(crate) inflation: f64,
    /// The same for natural frequency and damping ratio.
    pub(crate) modal_inflation: f64,
    /// What the model lacks, once it has been asked for and there is something.
    pub(crate) discrepancy: Option<Discrepancy>,
    /// Effects whose sizes what the model lacks might make zero and the prediction does not.
    pub needed: Vec<Effect>,
    pub(super) around: Around,
}

/// One of the users' numbers.
pub(super) struct Published {
    pub(super) name: String,
    pub(super) value: f64,
    /// Its derivatives by the fitted numbers.
    pub(super) row: Vec<f64>,
    /// The power of a second in its unit.
    pub(super) seconds: f64,
}

impl Fitted {
    /// `residuals` in rad; of a rate in rad/s.
    pub(crate) fn new(
        structure: Structure,
        parameters: Vec<f64>,
        residuals: Vec<f64>,
        converged: bool,
        covariance: Option<DMatrix<f64>>,
        around: Around,
    ) -> Self {
        let mut fitted = Self {
            structure,
            parameters,
            sum_of_squares: residuals.iter().map(|r| r * r).sum(),
            count: residuals.len(),
            converged,
            covariance,
            correlation: correlation(std::slice::from_ref(&residuals)),
            residuals,
            inflation: 1.0,
            modal_inflation: 1.0,
            discrepancy: None,
            needed: Vec::new(),
            around,
        };
        fitted.inflation = fitted.count as f64 / fitted.effective_count();
        fitted.modal_inflation = fitted.inflation;
        fitted
    }
    /// With uncertainties that hold what the model lacks, too, as far as what it leaves of `decay` shows how
    /// much that is.
    pub(crate) fn with_discrepancy(mut self, decay: &FreeDecay) -> Self {
        let Some(covariance) = self.covariance.take() else { return self };
        let release = Release { decay, count: self.count };
        let problem = problem_of_one(release, &self.structure, &self.parameters);
        let covariance = problem.off_bounds(&self.parameters, &covariance);
        let fixed: Vec<bool> = covariance.diagonal().iter().map(|v| *v == 0.0).collect();
        let held = self.over_noise(decay).powi(2) * self.inflation;
        let Some(found) = problem.discrepancy(&self.parameters, &fixed, held) else {
            self.covariance = Some(covariance);
            return self;
        };
        let places: Vec<usize> = (0..self.parameters.len()).collect();
        let found = found.of_release(0, &places, self.parameters[WN]);
        self.covariance = Some(found.covariance().clone());
        (self.inflation, self.modal_inflation) = (1.0, 1.0);
        self.discrepancy = Some(found);
        self
    }

    /// The first of the numbers of `effect`; none where the model has it not.
    pub(crate) fn coefficient(&self, effect: &Effect) -> Option<Quantity> {
        let name = effect.first_name();
        self.effect_parameters().into_iter().find(|(n, _)| *n == name).map(|(_, q)| q)
    }

    /// Root mean square of the residuals, less the numbers fitted.
    pub fn rms_rad(&self) -> f64 {
        (self.sum_of_squares / self.degrees_of_freedom()).sqrt()
    }
    fn degrees_of_freedom(&self) -> f64 {
        self.count.saturating_sub(self.parameters.len()).max(1) as f64
    }
    /// Rms of the residuals over the noise of a block mean: about 1 where nothing is missing.
    pub fn over_noise(&self, decay: &FreeDecay) -> f64 {
        self.rms_rad() / decay.noise_rad
    }
    /// Residuals that count as independent.
    pub fn effective_count(&self) -> f64 {
        (self.count as f64 * independent_share(self.correlation)).max(2.0)
    }
    /// What it puts into a difference of BIC ([`bic::Score::gain_over`]).
    pub fn bic(&self) -> bic::Score {
        bic::Score {
            sum_of_squares: self.sum_of_squares,
            independent: self.effective_count(),
            numbers: self.parameters.len(),
        }
    }
    fn modal_quantity(&self, index: usize) -> Quantity {
        let u = self
            .covariance
            .as_ref()
            .map_or(f64::NAN, |c| (c[(index, index)] * self.modal_inflation).max(0.0).sqrt());
        Quantity::new(self.parameters[index], u)
    }
    /// At rest.
    pub fn modal(&self) -> Modal {
        Modal {
            natural_frequency_rad_s: self.natural_frequency_rad_s(),
            damping_ratio: self.damping_ratio(),
        }
    }
    /// At rest; its u holds the residual's own correlation, what the model lacks and the clock's rate.
    pub fn natural_frequency_rad_s(&self) -> Quantity {
        self.on_clock(self.modal_quantity(WN), -1.0)
    }
    /// At rest, negative where small oscillations grow; its u as that of the natural frequency.
    pub fn damping_ratio(&self) -> Quantity {
        self.modal_quantity(ZETA)
    }
    /// The sensor's reading at no yaw, rad, where the fit varies it.
    pub fn sensor_zero_rad(&self) -> Option<Quantity> {
        self.structure.zero_unknown.then(|| {
            let mut row = vec![0.0; self.parameters.len()];
            row[ZERO] = 1.0;
            self.quantity(self.parameters[ZERO], &row)
        })
    }

    /// The angle of rest on the sensor's scale, rad, about which the effects act, where the fit varies it.
    pub(crate) fn rest_rad(&self) -> Option<Quantity> {
        let moment = self.structure.places().find(|(effect, _)| effect.moves_rest());
        match moment.filter(|_| self.structure.about_rest) {
            Some((_, at)) => {
                let (wn, moment) = (self.parameters[WN], self.parameters[at]);
                let rest = moment / wn.powi(2);
                let mut row = vec![0.0; self.parameters.len()];
                (row[WN], row[at]) = (-2.0 * rest / wn, wn.powi(-2));
                Some(self.quantity(rest, &row))
            }
            None => self.sensor_zero_rad(),
        }
    }

    /// `value` with the uncertainty that its derivatives by the fitted numbers, a `row`, give it.
    fn quantity(&self, value: f64, row: &[f64]) -> Quantity {
        let variance = self.covariance.as_ref().map_or(f64::NAN, |c| between(c, row, row));
        Quantity::new(value, not_below_zero(variance * self.inflation).sqrt())
    }
    /// `quantity`, in whose unit a second has the power `seconds`, with what the clock's rate makes of it.
    pub(crate) fn on_clock(&self, quantity: Quantity, seconds: f64) -> Quantity {
        quantity.on_clock(self.around.rate_u, seconds)
    }
    /// `effect.name` and value with u of every number of the effects, in the units that
    /// [`Effect::parameters`] states.
    pub fn effect_parameters(&self) -> Vec<(String, Quantity)> {
        let told =
            |p: Published| (p.name, self.on_clock(self.quantity(p.value, &p.row), p.seconds));
        self.published().map(told).collect()
    }

    /// Covariance of natural frequency, damping ratio and everything the effects are made of. `None` where
    /// the fit has none, or did not fit them.
    pub fn named_covariance(&self) -> Option<Covariance> {
        let covariance = self.covariance.as_ref().filter(|c| c[(WN, WN)] > 0.0)?;
        let unit =
            |at: usize| (0..self.parameters.len()).map(|k| f64::from(u8::from(k == at))).collect();
        let modal = ["natural_frequency_rad_s", "damping_ratio"];
        let modal = modal.iter().zip([-1.0, 0.0]).enumerate().map(|(at, (name, seconds))| {
            let (name, value) = ((*name).to_owned(), self.parameters[at]);
            let modal = Published { name, value, row: unit(at), seconds };
            (modal, self.modal_inflation.sqrt())
        });
        let effects = self.published().map(|effect| (effect, self.inflation.sqrt()));
        let all: Vec<(Published, f64)> = modal.chain(effects).collect();
        let by_clock = |p: &Published| p.value * p.seconds * self.around.rate_u;
        let of = |a: &(Published, f64), b: &(Published, f64)| {
            between(covariance, &a.0.row, &b.0.row) * a.1 * b.1 + by_clock(&a.0) * by_clock(&b.0)
        };
        let matrix = all.iter().map(|a| all.iter().map(|b| of(a, b)).collect()).collect();
        Some(Covariance { names: all.into_iter().map(|a| a.0.name).collect(), matrix })
    }

    /// Each of the users' numbers of the effects.
    pub(super) fn published(&self) -> impl Iterator<Item = Published> + '_ {
        self.structure.places().flat_map(move |(effect, at)| {
            let (values, rows) = effect.published(self.of_effect(effect, at));
            let seconds: Vec<f64> =
                (0..values.len()).map(|number| effect.seconds(number, &values)).collect();
            let names = effect.parameters().iter().map(move |p| format!("{effect}.{}", p.name));
            let row = move |own: Vec<f64>| {
                let mut row = vec![0.0; self.parameters.len()];
                row[at..at + own.len()].copy_from_slice(&own);
                row
            };
            let numbers = names.zip(values).zip(rows).zip(seconds);
            numbers.map(move |(((name, value), own), seconds)| Published {
                name,
                value,
                row: row(own),
                seconds,
            })
        })
    }
    fn of_effect(&self, effect: &Effect, at: usize) -> &[f64] {
        &self.parameters[at..at + effect.parameters().len()]
    }
    /// The numbers of `effect` as the fit varies them ([`Effect::varied`]); `None` where it is not in the
    /// model.
    pub fn varied(&self, effect: &Effect) -> Option<&[f64]> {
        Some(self.of_effect(effect, self.structure.place(effect)?))
    }
    /// The numbers as `structure` orders them, zero for an effect that is not in the model.
    pub(crate) fn in_order_of(&self, structure: &Structure) -> Vec<f64> {
        let mut p = self.parameters[..structure.own_numbers()].to_vec();
        for effect in &structure.effects {
            let none = vec![0.0; effect.parameters().len()];
            p.extend(self.varied(effect).unwrap_or(&none));
        }
        p
    }
    /// The numbers for a fit of `structure`; none where it has an effect more, but for a constant moment in
    /// place of the sensor's zero.
    pub(crate) fn numbers_for(&self, structure: &Structure) -> Option<Vec<f64>> {
        let mut p = self.parameters[..PLAIN].to_vec();
        let zero = |of: &Structure| {
            of.zero_unknown || of.about_rest && of.effects.iter().any(Effect::moves_rest)
        };
        let moment = self.structure.effects.iter().find(|e| e.moves_rest());
        let moment = moment.and_then(|e| self.varied(e)).map_or(0.0, |m| m[0]);
        let rest = self.rest_rad().map_or(moment / p[WN].powi(2), |rest| rest.value);
        // The angle counts from where the effects act.
        p[YAW] += rest * (f64::from(zero(&self.structure)) - f64::from(zero(structure)));
        p.extend(structure.zero_unknown.then_some(rest));
        for effect in &structure.effects {
            match self.varied(effect) {
                Some(varied) => p.extend(varied),
                // A constant moment under which it would rest there.
                None if effect.moves_rest() && self.structure.zero_unknown => {
                    p.push(rest * p[WN].powi(2));
                }
                None => return None,
            }
        }
        Some(p)
    }
    /// Where the numbers of `effect`, which is in the model, begin.
    pub(crate) fn start_of(&self, effect: &Effect) -> usize {
        self.structure.place(effect).expect("an effect of the model")
    }
    /// The model's motion, from its fitted state at the first instant.
    pub fn motion(&self) -> Motion {
        self.structure.motion(&self.parameters, self.around).0
    }

    /// Readings of the model on `grid`, which begins where the free decay does.
    pub fn readings(&self, grid: &Grid) -> Vec<f64> {
        let (motion, zero) = self.structure.motion(&self.parameters, self.around);
        motion.readings(grid).into_iter().map(|y| y + zero).collect()
    }
}

impl Part<'_> {
    /// The release's model in a fit that found the numbers `all`.
    pub(crate) fn fitted(
        &self,
        all: &[f64],
        converged: bool,
        covariance: Option<&DMatrix<f64>>,
    ) -> Fitted {
        let (p, decay) = (self.numbers(all), self.release.decay);
        let (motion, zero) = self.motion(&p);
        let mut residuals = match self.states {
            None => motion.readings(&self.grid()),
            Some(states) => motion.readings_along(states, &self.grid()),
        };
        residuals.iter_mut().zip(&decay.yaw_rad).for_each(|(r, y)| *r += zero - y);
        let own = covariance.map(|c| c.select_rows(&self.places).select_columns(&self.places));
        Fitted::new(self.structure.clone(), p, residuals, converged, own, decay.around())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fitting::{fit_added, fit_plain};
    use crate::record::Record;

    /// With a clock that is 0.3 % off for all one knows, numbers are off by that times the power of a second in
    /// their unit, and by the same in common; a damping ratio is not.
    #[test]
    fn the_clock_s_rate_is_in_every_number_with_a_second_in_its_unit() {
        let (wn, k3) = (7.0f64, 60.0);
        let (mut yaw_rad, mut rate_rad_s, step_s) = (0.2f64, 0.0f64, 1e-4);
        let mut record = Record::new("mine", Vec::new(), Vec::new());
        for k in 0..120_000 {
            if k % 100 == 0 {
                record.time_s.push(f64::from(k) * step_s);
                let noise = 0.02 * f64::from(k / 100 % 7 * 5 % 7 - 3) / 2.0;
                record.yaw_deg.push(yaw_rad.to_degrees() + noise);
            }
            // Symplectic: the step's error is far below the noise.
            rate_rad_s -=
                step_s * (wn * wn * yaw_rad + k3 * yaw_rad.powi(3) + 2.0 * 0.01 * wn * rate_rad_s);
            yaw_rad += step_s * rate_rad_s;
        }
        let fit = |rate_u: f64| {
            let decay =
                FreeDecay::from_record(&Record { rate_u, ..record.clone() }).expect("a decay");
            let plain = fit_plain(&decay, false, decay.yaw_rad.len());
            fit_added(&decay, &plain, &Effect::CubicStiffness)
        };
        let (exact, coarse) = (fit(0.0), fit(3e-3));
        let of = |fit: &Fitted| {
            let stiffness = fit.effect_parameters()[0].1;
            [fit.natural_frequency_rad_s(), fit.damping_ratio(), stiffness]
        };
        for ((known, told), seconds) in
            of(&exact).into_iter().zip(of(&coarse)).zip([-1.0, 0.0, -2.0])
        {
            assert_eq!(known.value, told.value);
            let expected = known.u.hypot(known.value * seconds * 3e-3);
            assert!((told.u / expected - 1.0).abs() < 1e-12, "{known} {told}");
        }
        assert!((of(&exact)[2].value / k3 - 1.0).abs() < 0.05, "{}", of(&exact)[2]);
        // What is known from before has its own clock in its ±, at every amplitude, too.
        let mut fixed = coarse.clone();
        fixed.covariance.iter_mut().for_each(|c| c.fill(0.0));
        let [told, _, stiffness] = of(&coarse);
        let known = fixed.knowing(&[told.u, 0.0, 0.0, 0.0, stiffness.u]);
        for (known, told) in [(of(&known)[0], told), (of(&known)[2], stiffness)] {
            assert!((known.u / told.u - 1.0).abs() < 1e-9, "{known} {told}");
        }
        let [exact, coarse] =
            [exact, coarse].map(|fit| fit.named_covariance().expect("one").matrix);
        let common = coarse[0][2] - exact[0][2];
        let expected = 2.0 * (3e-3f64).powi(2) * 7.0 * k3;
        assert!((common / expected - 1.0).abs() < 0.05, "{common} {expected}");
    }
}
