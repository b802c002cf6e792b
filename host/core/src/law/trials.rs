//! The laws that are tried, and the one of them that predicts best.

use super::line::{line, NO_BETTER};
use super::roughness::Nearby;
use super::tables::Tables;
use crate::diagnosis::over_pieces::Lengths;
use crate::diagnosis::prediction::{predict_within, Prediction};
use crate::diagnosis::together::Releases;
use crate::effects::{Effect, MeasuredLaw};
use crate::error::{Error, Result};
use crate::fit::fitting::Structure;
use crate::fit::segments::{fit_from, PieceFit, FINE, ROUGH};
use nalgebra::DMatrix;
use std::cmp::Ordering;
use std::sync::Arc;

/// A law fitted with one choice of its curves and their roughness.
#[derive(Clone)]
pub(super) struct Trial {
    pub(super) law: MeasuredLaw,
    pub(super) fit: PieceFit,
    pub(super) covariance: DMatrix<f64>,
    pub(super) prediction: Prediction,
}

impl Trial {
    fn is_better_than(&self, other: &Self) -> bool {
        let ratio = self.prediction.rms_rad() / other.prediction.rms_rad();
        match self.law.parts.len().cmp(&other.law.parts.len()) {
            Ordering::Less => ratio < 1.0 + NO_BETTER,
            Ordering::Equal => ratio < 1.0,
            Ordering::Greater => ratio < 1.0 - NO_BETTER,
        }
    }
}

pub(super) struct Trials<'a> {
    releases: &'a Releases<'a>,
    lengths: &'a Lengths,
    /// Without a law.
    structure: &'a Structure,
    /// Common numbers before those of the law.
    begin: usize,
    pub(super) best: Option<Trial>,
}

impl<'a> Trials<'a> {
    pub(super) fn new(
        releases: &'a Releases<'a>,
        lengths: &'a Lengths,
        structure: &'a Structure,
        begin: usize,
    ) -> Self {
        Self { releases, lengths, structure, begin, best: None }
    }

    /// The structure with `law` in it.
    pub(super) fn with(&self, law: &MeasuredLaw) -> Structure {
        self.structure.with(&Effect::Measured(Arc::new(law.clone())))
    }

    /// Rounds in which the law's roughness is chosen anew and, if `knots_move`, its knots go to where it
    /// bends; the best is kept.
    ///
    /// # Errors
    /// Interrupted.
    pub(super) fn improve(
        &mut self,
        mut law: MeasuredLaw,
        mut fit: PieceFit,
        knots_move: bool,
    ) -> Result<()> {
        let rounds = if knots_move { 4 } else { 2 };
        for round in 0..=rounds {
            let Some((trial, mut next)) = self.judged(&law, &fit) else { break };
            self.releases.first().stop.check()?;
            if self.best.as_ref().is_none_or(|best| trial.is_better_than(best)) {
                self.best = Some(trial);
            }
            if round == rounds {
                break;
            }
            if knots_move {
                next = next.placed(law.refined(&fit.common[self.begin..]).knots);
            }
            fit = self.fitted(&next, &self.translated(&law, &fit, &next))?;
            law = next;
        }
        Ok(())
    }

    /// The best with a tenth of its weight, if it predicts as well: its band knows of noise, not of what a
    /// curve that is as smooth as predicts best has lost.
    ///
    /// # Errors
    /// No law was judged, or interrupted.
    pub(super) fn with_more_roughness(&mut self) -> Result<()> {
        let Trial { law, fit, .. } = self.best.as_ref().ok_or(Error::NoLaw)?;
        let parts = law.parts.iter().map(|(part, weight)| (*part, 0.1 * weight)).collect();
        let rougher = law.with(parts, law.friction);
        let common = self.translated(law, fit, &rougher);
        self.take_if_as_good(&rougher, &common)
    }

    /// Common numbers of `fit`, which holds `law`, as those of one that holds `other`.
    fn translated(&self, law: &MeasuredLaw, fit: &PieceFit, other: &MeasuredLaw) -> Vec<f64> {
        let (common, values) = fit.common.split_at(self.begin);
        [common, &law.translated(values, other)].concat()
    }

    /// The best without the line of its dissipation, which is the damping ratio's, if it predicts as well.
    ///
    /// # Errors
    /// No law was judged, or interrupted.
    pub(super) fn without_line(&mut self, plain: &Structure) -> Result<()> {
        let Trial { law, fit, covariance, .. } = self.best.as_ref().ok_or(Error::NoLaw)?;
        let found = Tables { law, common: &fit.common, covariance };
        let begin = self.begin;
        let leveled = || -> Option<(MeasuredLaw, Vec<f64>)> {
            let law = law.without_line(Some(line(self.lengths, plain, &found)?));
            let (values, slope_per_s) = law.leveled(&fit.common[begin..])?;
            let mut common = self.releases.damped(&fit.common[..begin], slope_per_s)?;
            common.extend(values);
            Some((law, common))
        };
        match leveled() {
            Some((law, common)) => self.take_if_as_good(&law, &common),
            None => Ok(()),
        }
    }

    fn take_if_as_good(&mut self, law: &MeasuredLaw, common: &[f64]) -> Result<()> {
        let trial = self.judged(law, &self.fitted(law, common)?).map(|judged| judged.0);
        let most = self.best.as_ref().map(|best| (1.0 + NO_BETTER) * best.prediction.rms_rad());
        if let (Some(trial), Some(most)) = (trial, most)
            && trial.prediction.rms_rad() < most
        {
            self.best = Some(trial);
        }
        Ok(())
    }

    /// `law` fitted to long pieces from `common`.
    fn fitted(&self, law: &MeasuredLaw, common: &[f64]) -> Result<PieceFit> {
        let fit = fit_from(&self.lengths.long, &self.with(law), common, FINE);
        self.releases.first().stop.check()?;
        Ok(fit)
    }

    /// How well a fit predicts, and the law near it that predicts best.
    fn judged(&self, law: &MeasuredLaw, fit: &PieceFit) -> Option<(Trial, MeasuredLaw)> {
        let lengths = self.lengths;
        let nearby = Nearby::new(&lengths.predicted, fit, law, self.begin)?;
        let covariance = nearby.covariance()?;
        let prediction = predict_within(&lengths.predicted, fit);
        let trial = Trial { law: law.clone(), fit: fit.clone(), covariance, prediction };
        Some((trial, nearby.best()))
    }
}

/// `structure` fitted to short pieces, then to longer ones, from `common`.
///
/// # Errors
/// Interrupted.
pub(super) fn fit_all(
    releases: &Releases,
    lengths: &Lengths,
    structure: &Structure,
    common: &[f64],
) -> Result<PieceFit> {
    let mut common = common.to_vec();
    for pieces in [&lengths.short, &lengths.longer] {
        common = fit_from(pieces, structure, &common, ROUGH).common;
        releases.first().stop.check()?;
    }
    let fit = fit_from(&lengths.long, structure, &common, FINE);
    releases.first().stop.check()?;
    Ok(fit)
}
