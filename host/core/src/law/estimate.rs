//! A law measured from free decays: K(b) and D(r) beside wn^2 b and 2 zeta wn r, fitted by simulation.
//!
//! The curves are fitted to short pieces of the records with states of their own, then to longer ones; how
//! smooth they are is what predicts left-out pieces best.

use super::roughness::{inflation, reached};
use super::tables::Tables;
use super::trials::{fit_all, Trial, Trials};
use crate::diagnosis::over_pieces::{whole, Lengths};
use crate::diagnosis::prediction::{predict_within, Prediction};
use crate::diagnosis::together::Releases;
use crate::effects::{Effect, MeasuredLaw, Part};
use crate::error::{Error, Result};
use crate::fit::at_amplitude::{at_amplitudes, AtAmplitude};
use crate::fit::fitting::{refitted, Fitted, Structure};
use crate::fit::free_decay::FreeDecay;
use crate::fit::pieces::{Piece, Pieces};
use crate::fit::segments::{fit_from, fit_pieces, PieceFit, Until, FINE, ROUGH};
use crate::fit::structure::{WN, ZETA};
use crate::motion::oscillator::Motion;
use crate::quantity::Quantity;
use nalgebra::DMatrix;
use std::sync::Arc;

/// A law as an equation of motion.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Its linear part, its curves as effects, and the state at the first instant.
    pub motion: Motion,
    /// Where the motion comes to rest, on the sensor, rad.
    pub rest_rad: f64,
    /// The largest yaw angle about the rest: it is known as far as that.
    pub yaw_rad: f64,
    /// The largest yaw rate: it is known as far as that.
    pub rate_rad_s: f64,
}

impl Curve {
    fn new(decay: &FreeDecay, fit: &PieceFit, law: &MeasuredLaw) -> Self {
        let (motion, rest_rad) = fit.structure.motion(&fit.numbers(0), decay.around());
        Self { motion, rest_rad, yaw_rad: law.yaw_rad, rate_rad_s: law.rate_rad_s }
    }
}

/// A law with what it was fitted to.
#[derive(Clone, Debug)]
pub struct Measured {
    /// The shape; its values are [`Self::effect_numbers`].
    pub law: Arc<MeasuredLaw>,
    pub(crate) fit: PieceFit,
    /// wn (rad/s) and zeta of each release, in the order in which they were given.
    pub modal: Vec<[f64; 2]>,
    /// Of `fit.common`, widened for residuals above the noise and for their correlation.
    pub(crate) covariance: DMatrix<f64>,
    pub(crate) prediction: Prediction,
    /// Rms of the block means less the law, over the noise of such a mean.
    pub residual_over_noise: f64,
    /// The same on pieces that were not fitted, their state estimated anew.
    pub held_out_over_noise: f64,
    /// The same without a law.
    pub(crate) plain: PieceFit,
    /// `residual_over_noise` without a law.
    pub plain_residual_over_noise: f64,
    /// `held_out_over_noise` without a law.
    pub plain_held_out_over_noise: f64,
    /// Standard uncertainty of the record's clock rate, as a share of it.
    pub(crate) rate_u: f64,
}

/// Measures the law that `releases` follow beside the second-order response and the effects of `inner`.
///
/// `numbers`: those of the effects from which their fit begins, as [`Effect::varied`] has them, one after the
/// other. `dissipative`: the law takes energy out at every rate. `show` is given the first law that is
/// fitted, before it is known how smooth it has to be.
///
/// # Errors
/// Interrupted, or not converged.
pub fn measure(
    releases: &Releases,
    inner: &Structure,
    numbers: &[f64],
    dissipative: bool,
    show: &dyn Fn(Curve),
) -> Result<Measured> {
    let (decay, lengths) = (releases.first(), releases.lengths());
    let (mut structure, mut common) = releases.plain_start();
    structure.effects = inner.effects.clone();
    structure.limits.extend(inner.limits.clone());
    common.extend(numbers);
    let plain = fit_all(releases, &lengths, &structure, &common)?;
    let short = fit_from(&lengths.short, &structure, &common, ROUGH);
    let (yaw, rate) = reached(&lengths.short, &short);
    let friction = !structure.effects.iter().any(Effect::sticks);
    let mut trials = Trials::new(releases, &lengths, &structure, short.common.len());
    // Where the first fit is too smooth or too rough, the choice that is made near it is a bad one.
    for scale in [1.0, 1e-2, 1e-4] {
        let weight = |part: Part| scale * if part.is_odd() { 1e-6 } else { 1e-3 };
        let parts = Part::ALL.map(|part| (part, weight(part))).to_vec();
        // The last knot is a little beyond a value that is reached once.
        let law = MeasuredLaw::new(1.001 * yaw, 1.001 * rate, parts, friction, dissipative);
        let mut common = short.common.clone();
        common.extend(law.no_law());
        let fit = fit_all(releases, &lengths, &trials.with(&law), &common)?;
        if trials.best.is_none() {
            show(Curve::new(decay, &fit, &law));
        }
        trials.improve(law, fit, false)?;
    }
    if let Some(Trial { law, fit, .. }) = trials.best.clone() {
        trials.improve(law, fit, true)?;
    }
    trials.with_more_roughness()?;
    trials.without_line(&plain.structure)?;
    let Trial { law, fit, covariance, prediction } = trials.best.ok_or(Error::NoLaw)?;
    // A law of no curvature is the plain model: what is worse was not found.
    if fit.sum() > 1.01 * plain.sum() {
        return Err(Error::NoLaw);
    }
    let plain_prediction = predict_within(&lengths.predicted, &plain);
    let residual_over_noise = over_noise(&lengths.long, &fit);
    Ok(Measured {
        covariance: covariance
            * residual_over_noise.max(1.0).powi(2)
            * inflation(&lengths.long, &fit),
        held_out_over_noise: prediction.rms_rad() / decay.noise_rad,
        plain_residual_over_noise: over_noise(&lengths.long, &plain),
        plain_held_out_over_noise: plain_prediction.rms_rad() / decay.noise_rad,
        modal: releases.modal(&fit),
        law: Arc::new(law),
        prediction,
        residual_over_noise,
        fit,
        plain,
        rate_u: decay.rate_u,
    })
}

/// Residual of `pieces` over their noise.
pub(super) fn over_noise(pieces: &Pieces, fit: &PieceFit) -> f64 {
    let of = |(squares, piece): (&f64, &Piece)| {
        (squares / piece.noise_rad.powi(2), piece.yaw_rad.len() as f64)
    };
    let each = fit.squares.iter().zip(&pieces.decays).map(of);
    let (squares, n) = each.fold((0.0, 0.0), |sum, e| (sum.0 + e.0, sum.1 + e.1));
    f64::sqrt(squares / n)
}

/// `structure`, which holds a measured law, fitted to the whole of `decay` from numbers in the order of
/// [`Fitted::parameters`].
pub fn fit_whole(decay: &FreeDecay, structure: &Structure, start: &[f64]) -> Fitted {
    let piece = Piece::whole(decay);
    let (common, states) = Piece::layout(&[&piece], structure).parted(start);
    let direct = fit_pieces(&[&piece], structure, &common, &states, Until { steps: 60, ..FINE });
    let lengths = Lengths::new(decay);
    let long = fit_from(&lengths.long, structure, &common, ROUGH);
    // A phase that is lost over the whole record shows in pieces with states of their own.
    let is_lost = direct.sum() > 2.0 * long.sum();
    let stepped = is_lost.then(|| whole(decay, &lengths, &long));
    let fit = stepped.filter(|stepped| stepped.sum() < direct.sum()).unwrap_or(direct);
    refitted(decay, structure, &fit.numbers(0))
}

impl Measured {
    /// What it was fitted as, with the line in its dissipation: beside another effect that is another.
    pub(super) fn with_line(&self) -> Structure {
        let mut structure = self.fit.structure.clone();
        structure.effects.pop();
        structure.with(&Effect::Measured(Arc::new(self.law.without_line(None))))
    }

    /// The law as tables.
    pub fn tables(&self) -> Tables<'_> {
        Tables { law: &self.law, common: &self.fit.common, covariance: &self.covariance }
    }

    /// Of the linear part, at rest, rad/s.
    pub fn natural_frequency_rad_s(&self) -> Quantity {
        Quantity::new(self.fit.common[WN], self.covariance[(WN, WN)].max(0.0).sqrt())
            .on_clock(self.rate_u, -1.0)
    }

    /// Of the linear part, beside a dissipation without a line.
    pub fn damping_ratio(&self) -> Quantity {
        Quantity::new(self.fit.common[ZETA], self.covariance[(ZETA, ZETA)].max(0.0).sqrt())
    }

    /// Of the release from the largest angle without a law: what takes the place of the law's dissipation is
    /// in it.
    pub fn plain_damping_ratio(&self) -> f64 {
        self.plain.common[ZETA]
    }

    /// Natural frequency and damping ratio of `decay`, the release with the largest angle, under the law.
    pub fn at_amplitude(&self, decay: &FreeDecay) -> Vec<AtAmplitude> {
        let (structure, layout) = (&self.fit.structure, &self.fit.layout);
        let numbers = self.fit.numbers(0);
        let place: Vec<_> = (0..numbers.len()).map(|j| layout.shared_of(0, j)).collect();
        let covariance = DMatrix::from_fn(numbers.len(), numbers.len(), |a, b| {
            place[a].zip(place[b]).map_or(0.0, |(a, b)| self.covariance[(a, b)])
        });
        let left = vec![0.0; decay.yaw_rad.len()];
        let around = decay.around();
        let whole = Fitted::new(structure.clone(), numbers, left, true, Some(covariance), around);
        at_amplitudes(decay, &whole)
    }

    /// The law as an equation of motion, with all that it was fitted beside.
    pub fn curve(&self, decay: &FreeDecay) -> Curve {
        Curve::new(decay, &self.fit, &self.law)
    }

    /// Numbers of all effects as the fit varies them, one after the other; the law's are last.
    pub fn effect_numbers(&self) -> &[f64] {
        self.fit.of_effects()
    }

    /// Where the model comes to rest, on the sensor, rad.
    pub fn rest_rad(&self) -> f64 {
        let zero = self.fit.layout.zero(0, &self.fit.structure);
        zero.map_or(0.0, |at| self.fit.common[at])
    }
}
