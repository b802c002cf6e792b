//! Joint fit of several releases: some numbers are each release's own, others they have in common.
//!
//! A release has its own initial state and, where unknown, its own zero of the sensor. Natural frequency and
//! damping ratio are shared by the repeats of one condition, the coefficients of an effect as a [`Sharing`]
//! says; a line's size and phase and a drift belong to their release whatever it says
//! ([`Effect::belongs_to_release`]). Residuals count over each release's noise floor. One release is the case
//! that [`crate::fit::fitting`] builds on.
//!
//! A release touches its own numbers and the shared ones only, so that many releases cost no more than one
//! after the other: simulated on all cores, their normal equations summed block by block (`Rows::part` of the
//! solver).

use crate::bic;
use crate::effects::Effect;
use crate::fit::fitting::{are_moved_by_steps, enough, held_out_over_noise, Fitted, Structure};
use crate::fit::free_decay::FreeDecay;
use crate::fit::known::{from_zero, know};
use crate::fit::layout::Layout;
pub use crate::fit::layout::Sharing;
pub use crate::fit::part::Release;
use crate::fit::part::{lengthened, Part};
use crate::fit::problem::{JointProblem, EVALUATIONS};
use crate::fit::structure::WN;
use crate::par_map::ParMap;
use crate::quantity::Quantity;
use crate::solver::{off_bounds, Fit};
use crate::statistics::weighted_rms;
use nalgebra::{DMatrix, DVector};

/// A model fitted to several releases at once.
#[derive(Clone, Debug)]
pub struct JointFit {
    /// What the model of the releases holds.
    pub structure: Structure,
    pub(crate) sharing: Sharing,
    /// Each release with its numbers; their uncertainties are those of the joint fit.
    pub fits: Vec<Fitted>,
    /// Of the residuals over each release's noise.
    pub sum_of_squares: f64,
    /// Block means that were fitted, of all releases.
    pub count: usize,
    /// Whether the fit reached a minimum.
    pub converged: bool,
    /// All numbers, the shared ones once.
    pub parameters: Vec<f64>,
    /// Not inflated for correlated residuals.
    covariance: Option<DMatrix<f64>>,
    inflation: f64,
    layout: Layout,
}

impl JointFit {
    fn new(structure: &Structure, sharing: &Sharing, together: JointProblem, fit: Fit) -> Self {
        let covariance = with_pressed(&fit, &together.bounds);
        let converged = fit.stop.is_minimum();
        let fitted = |part: &Part| part.fitted(&fit.parameters, converged, covariance.as_ref());
        let mut fits: Vec<Fitted> = together.parts.iter().par_map(fitted).collect();
        let count = fits.iter().map(|fit| fit.count).sum();
        let effective: f64 = fits.iter().map(Fitted::effective_count).sum();
        let inflation = count as f64 / effective;
        let widening = widening(&together.parts, sharing, &fits, fit.variance() * inflation);
        for (f, widening) in fits.iter_mut().zip(widening) {
            f.inflation = inflation;
            f.modal_inflation = inflation * widening;
        }
        Self {
            structure: structure.clone(),
            sharing: sharing.clone(),
            fits,
            sum_of_squares: fit.sum_of_squares,
            count,
            converged,
            parameters: fit.parameters,
            covariance,
            inflation,
            layout: together.layout,
        }
    }

    /// With uncertainties that hold what the model lacks, too: one discrepancy of all `releases`, which are
    /// those of one rig.
    pub fn with_discrepancy(mut self, releases: &[Release]) -> Self {
        let Some(covariance) = &self.covariance else { return self };
        let problem = JointProblem::new(releases, &self.structure, &self.sharing, &self.starts());
        let fixed: Vec<bool> = covariance.diagonal().iter().map(|v| *v == 0.0).collect();
        let held = self.over_noise().powi(2) * self.inflation;
        let Some(found) = problem.discrepancy(&self.parameters, &fixed, held) else { return self };
        let covariance = found.covariance().clone();
        for (i, fit) in self.fits.iter_mut().enumerate() {
            let own = found.of_release(i, self.layout.places(i), fit.parameters[WN]);
            fit.covariance = Some(own.covariance().clone());
            fit.modal_inflation /= fit.inflation;
            fit.inflation = 1.0;
            fit.discrepancy = Some(own);
        }
        (self.covariance, self.inflation) = (Some(covariance), 1.0);
        self
    }

    /// This, or where its sum of squares is not `near` what it may be the fit over ever longer parts of the
    /// releases: what one has in common with the others may lead to another count of cycles in all of it.
    fn or_lengthened(self, near: f64, releases: &[Release], mut starts: Vec<Vec<f64>>) -> Self {
        if self.converged && self.sum_of_squares <= near {
            return self;
        }
        let found = lengthened(releases, |parts| {
            let found = fit(parts, &self.structure, &self.sharing, &starts);
            if found.sum_of_squares.is_finite() {
                starts = found.starts();
            }
            found
        });
        if found.is_better_than(&self) {
            found
        } else {
            self
        }
    }

    /// The numbers of each release.
    fn starts(&self) -> Vec<Vec<f64>> {
        self.fits.iter().map(|fit| fit.parameters.clone()).collect()
    }

    /// The same by precise simulations, fitted again where the error of quick ones moves its numbers: they
    /// are then those of the equation, whatever integrates it. As it is where that does not converge.
    pub fn polished(mut self, releases: &[Release]) -> Self {
        let each: Vec<(&Fitted, &FreeDecay)> =
            self.fits.iter().zip(releases.iter().map(|release| release.decay)).collect();
        let Some(moved) = are_moved_by_steps(&each) else { return self };
        if !moved {
            self.structure = self.structure.precisely();
            self.fits.iter_mut().for_each(|fit| fit.structure = fit.structure.precisely());
            return self;
        }
        let polished = fit(releases, &self.structure.precisely(), &self.sharing, &self.starts());
        if polished.converged {
            polished
        } else {
            self
        }
    }

    /// The same numbers, to be simulated quickly: where thousands of simulations follow, one model is like
    /// the other.
    pub fn quickly(mut self) -> Self {
        self.structure.precise = false;
        self.fits.iter_mut().for_each(|fit| fit.structure.precise = false);
        self
    }

    /// Whether it has converged where the other has not, or has the smaller sum of squares; one that is no
    /// number is the larger.
    pub fn is_better_than(&self, other: &Self) -> bool {
        let by_squares = self.sum_of_squares.total_cmp(&other.sum_of_squares);
        other.converged.cmp(&self.converged).then(by_squares).is_lt()
    }

    /// Residuals that count as independent.
    pub fn effective_count(&self) -> f64 {
        self.fits.iter().map(Fitted::effective_count).sum()
    }

    /// What it puts into a difference of BIC ([`bic::Score::gain_over`]).
    pub fn bic(&self) -> bic::Score {
        bic::Score {
            sum_of_squares: self.sum_of_squares,
            independent: self.effective_count(),
            numbers: self.parameters.len(),
        }
    }

    /// Rms of the residuals over each release's noise.
    pub fn over_noise(&self) -> f64 {
        let freedom = self.count.saturating_sub(self.parameters.len()).max(1);
        (self.sum_of_squares / freedom as f64).sqrt()
    }

    /// Where number `number` (of those the fit varies) of `effect` in `release` is among
    /// [`Self::parameters`].
    pub fn place(&self, effect: &Effect, number: usize, release: usize) -> Option<usize> {
        let at = self.fits[release].structure.place(effect)?;
        Some(self.layout.places(release)[at + number])
    }

    /// Covariance of two of [`Self::parameters`], inflated for correlated residuals. NaN where the fit has
    /// none.
    pub(crate) fn covariance(&self, a: usize, b: usize) -> f64 {
        self.covariance.as_ref().map_or(f64::NAN, |c| c[(a, b)] * self.inflation)
    }

    /// One of [`Self::parameters`], its u inflated for correlated residuals.
    pub fn quantity(&self, index: usize) -> Quantity {
        Quantity::new(self.parameters[index], self.covariance(index, index).max(0.0).sqrt())
    }

    /// With the number of `effect` that is furthest from zero, of each group that shares it, at least `k` of its standard
    /// uncertainties from there, and what releases have in common conditioned on that.
    pub(crate) fn known_from_zero(&mut self, effect: &Effect, k: f64) {
        let over = |at: &usize| {
            let Quantity { value, u } = self.quantity(*at);
            value.abs() / u
        };
        let of_release = |release: usize| {
            let numbers = 0..effect.parameters().len();
            let places = numbers.filter_map(|number| self.place(effect, number, release));
            places.max_by(|a, b| over(a).total_cmp(&over(b)))
        };
        let mut furthest: Vec<usize> = (0..self.fits.len()).filter_map(of_release).collect();
        furthest.sort_unstable();
        furthest.dedup();
        for at in furthest {
            let known = from_zero(self.parameters[at], k) / self.inflation;
            let row = DVector::from_fn(self.parameters.len(), |j, _| f64::from(u8::from(j == at)));
            if let Some(covariance) = &mut self.covariance {
                know(covariance, &row, known);
            }
        }
    }

    /// Residual over noise on the means after those fitted; not a number where there are none.
    pub fn held_out_over_noise<'a>(&self, decays: impl IntoIterator<Item = &'a FreeDecay>) -> f64 {
        let later = |(fit, decay): (&Fitted, &FreeDecay)| {
            let n = decay.yaw_rad.len().saturating_sub(fit.count);
            (n > 0).then(|| (n as f64, held_out_over_noise(decay, fit)))
        };
        weighted_rms(self.fits.iter().zip(decays).filter_map(later))
    }
}

/// By what factor, at least 1, the covariance of each release's natural frequency and damping ratio is larger
/// than its share in the joint fit: mean square of its condition's residuals over the noise, inflated for
/// their correlation, over `common`, the same of all releases. Where the model explains some releases and
/// others not, an average over all would make the others too certain.
fn widening(releases: &[Part], sharing: &Sharing, fits: &[Fitted], common: f64) -> Vec<f64> {
    let of_group = |group: usize| {
        let (mut squares, mut count, mut effective, mut numbers) = (0.0, 0.0, 0.0, 2.0);
        for ((part, fit), own) in releases.iter().zip(fits).zip(&sharing.modal) {
            if *own == group {
                squares += fit.sum_of_squares / part.release.decay.noise_rad.powi(2);
                count += fit.count as f64;
                effective += fit.effective_count();
                numbers += (fit.structure.own_numbers() - 2) as f64;
            }
        }
        let level = squares / f64::max(count - numbers, 1.0) * count / effective;
        (level / common).max(1.0)
    };
    sharing.modal.iter().map(|group| of_group(*group)).collect()
}

/// The covariance with a variance for numbers that ended on a bound without being fixed.
fn with_pressed(fit: &Fit, bounds: &[(f64, f64)]) -> Option<DMatrix<f64>> {
    let covariance = fit.covariance.as_ref()?;
    let is_pressed = |j: usize| fit.at_bound[j] && bounds[j].0 < bounds[j].1;
    Some(off_bounds(covariance, &fit.normal_matrix, fit.variance(), is_pressed))
}

/// Fits `structure` to `releases` at once, from `starts`: each release's numbers in the order of [`Fitted`],
/// of which shared ones are averaged. One release's are fitted as they are.
///
/// ```
/// use yawrig_core::effects::{Effect, Terms};
/// use yawrig_core::fit::fitting::{fit_added, fit_plain};
/// use yawrig_core::fit::free_decay::FreeDecay;
/// use yawrig_core::fit::joint::{self, Release, Sharing};
/// use yawrig_core::motion::simulate::{Grid, Motion};
/// use yawrig_core::record::Record;
///
/// // Two releases of one model with a friction of 0.05 rad/s2, and a trace of noise.
/// let noise = |k: u64| ((k.wrapping_mul(2_654_435_761) >> 7) % 1000) as f64 * 1e-4 - 0.05;
/// let decays = [14.0f64, 9.0].map(|amplitude_deg| {
///     let motion = Motion {
///         natural_frequency_rad_s: 6.0,
///         damping_ratio: 0.01,
///         yaw_rad: amplitude_deg.to_radians(),
///         rate_rad_s: 0.0,
///         terms: Terms::new([(Effect::CoulombFriction, &[0.05][..])]),
///     };
///     let grid = Grid { start_s: 0.0, step_s: 0.005, count: 4000, mean_width_s: 0.0 };
///     let reading = |(k, y): (usize, &f64)| y.to_degrees() + noise(k as u64);
///     let yaw_deg = motion.readings(&grid).iter().enumerate().map(reading).collect();
///     let time_s = (0..grid.count).map(|k| grid.time_s(k)).collect();
///     FreeDecay::from_record(&Record::new("mine", time_s, yaw_deg)).unwrap()
/// });
/// let alone = decays.each_ref().map(|decay| {
///     let plain = fit_plain(decay, false, decay.yaw_rad.len());
///     fit_added(decay, &plain, &Effect::CoulombFriction)
/// });
/// // Natural frequency, damping ratio and friction are shared; each has its initial condition.
/// let sharing = Sharing { modal: vec![0, 0], effects: vec![vec![Some(0), Some(0)]] };
/// let releases = decays.each_ref().map(Release::whole);
/// let starts = alone.each_ref().map(|fit| fit.parameters.clone());
/// let both = joint::fit(&releases, &alone[0].structure, &sharing, &starts);
/// let at = both.place(&Effect::CoulombFriction, 0, 0).unwrap();
/// assert_eq!(both.place(&Effect::CoulombFriction, 0, 1), Some(at));
/// assert!((both.quantity(at).value / 0.05 - 1.0).abs() < 0.02, "{}", both.quantity(at));
/// ```
pub fn fit(
    releases: &[Release],
    structure: &Structure,
    sharing: &Sharing,
    starts: &[Vec<f64>],
) -> JointFit {
    let together = JointProblem::new(releases, structure, sharing, starts);
    let fit = together.minimise(&together.gathered(starts), EVALUATIONS);
    JointFit::new(structure, sharing, together, fit)
}

/// Fits `structure` from each release's own fit, which holds every effect that `sharing` gives the release.
pub fn fit_from(
    releases: &[Release],
    structure: &Structure,
    sharing: &Sharing,
    singles: &[&Fitted],
) -> JointFit {
    let ordered =
        |(i, single): (usize, &&Fitted)| single.in_order_of(&sharing.of_release(structure, i));
    let starts: Vec<Vec<f64>> = singles.iter().enumerate().map(ordered).collect();
    let direct = fit(releases, structure, sharing, &starts);
    let over =
        |(r, single): (&Release, &&Fitted)| single.sum_of_squares / r.decay.noise_rad.powi(2);
    let apart: f64 = releases.iter().zip(singles).map(over).sum();
    // Where what they have in common leads to another count of cycles it is far more.
    let near = 1.5 * apart.max(enough(direct.count));
    direct.or_lengthened(near, releases, starts)
}

/// As [`fit`], and where that is not down to the noise over lengthening horizons.
pub(crate) fn fit_or_lengthened(
    releases: &[Release],
    structure: &Structure,
    sharing: &Sharing,
    starts: Vec<Vec<f64>>,
) -> JointFit {
    let direct = fit(releases, structure, sharing, &starts);
    let near = enough(direct.count);
    direct.or_lengthened(near, releases, starts)
}

#[cfg(test)]
#[path = "joint_tests.rs"]
mod tests;
