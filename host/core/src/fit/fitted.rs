//! A fitted model: its numbers, their covariance, and what it leaves of the record.

use crate::bic;
use crate::effects::Effect;
use crate::fit::free_decay::FreeDecay;
use crate::fit::structure::{motion, Structure, PLAIN};
use crate::motion::oscillator::{Grid, Motion};
use crate::quantity::Quantity;
use crate::statistics::independent_share;
use nalgebra::DMatrix;

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
    pub fn over_noise(&self, decay: &FreeDecay) -> f64 {
        self.rms_rad() / decay.noise_rad
    }
    /// Residuals that count as independent.
    pub fn effective_count(&self) -> f64 {
        (self.count as f64 * independent_share(self.correlation)).max(2.0)
    }
    /// For a difference of BIC.
    pub fn bic(&self) -> bic::Score {
        let Self { sum_of_squares, .. } = *self;
        bic::Score {
            sum_of_squares,
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
    pub fn natural_frequency_rad_s(&self) -> Quantity {
        self.modal_quantity(0)
    }
    pub fn damping_ratio(&self) -> Quantity {
        self.modal_quantity(1)
    }
    /// The sensor's reading at no yaw, rad, where the fit varies it.
    pub fn sensor_zero_rad(&self) -> Option<Quantity> {
        if !self.structure.zero_unknown {
            return None;
        }
        let variance = self.covariance.as_ref().map_or(f64::NAN, |c| c[(PLAIN, PLAIN)]);
        let u = (variance * self.inflation).max(0.0).sqrt();
        Some(Quantity::new(self.parameters[PLAIN], u))
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

    /// The states of what remembers, in the order of the effects, at the first instant of a grid that starts at `start_s`:
    /// of hysteresis the deflection z of what yields, rad.
    pub fn remembered(&self, start_s: f64) -> Vec<f64> {
        let motion = self.motion();
        motion.memories(start_s).states(motion.yaw_rad)
    }
    /// Readings of the model on `grid`, which begins where the free decay does.
    pub fn readings(&self, grid: &Grid) -> Vec<f64> {
        let (motion, zero) =
            motion(&self.structure, &self.starts, &self.parameters, self.wind_speed_m_s);
        let mut y = vec![0.0; grid.count];
        motion.readings(grid, &mut y);
        y.iter_mut().for_each(|y| *y += zero);
        y
    }
}
