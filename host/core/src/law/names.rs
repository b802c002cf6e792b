//! The name of a measured law: formulas fitted to its curves, the best then to the record, ranked by what
//! they predict.

use super::beside::{beside, Beside};
use super::estimate::{over_noise, Measured};
use super::forms::Formula;
use super::on_curve::{OnCurve, Target};
use super::tables::Point;
use crate::diagnosis::likelihood::BREADTH;
use crate::diagnosis::over_pieces::Lengths;
use crate::diagnosis::prediction::{predict_within, Prediction, MIN_GAIN, ONE_STANDARD_ERROR};
use crate::diagnosis::together::Releases;
use crate::discrepancy::ABOVE_NOISE;
use crate::effects::{Effect, Part};
use crate::error::Result;
use crate::fit::fitting::Fitted;
use crate::fit::segments::{fit_from, PieceFit, FIRST, ROUGH, SETTLED};
use crate::fit::structure::WN;
use crate::par_map::ParMap;
use crate::quantity::Quantity;
use std::sync::Arc;

/// A formula fitted to the record in place of the law.
#[derive(Clone, Debug)]
pub struct Name {
    /// The formula: of the library, or written as a user's own.
    pub effect: Effect,
    /// Fitted to the releases whole; the first one's numbers.
    pub fit: Fitted,
    /// By name; u is not a number where the record gives none.
    pub parameters: Vec<(String, Quantity)>,
    /// The file of an own effect, beginning at these numbers; `None` for an effect of the library.
    pub text: Option<String>,
    /// Rms of the block means less the formula, over the noise of such a mean.
    pub residual_over_noise: f64,
    /// The same on pieces that were not fitted, their state estimated anew.
    pub held_out_over_noise: f64,
}

/// The formulas that a law may be.
#[derive(Clone, Debug)]
pub struct Names {
    /// What predicts best first; where the difference is less than a standard error, what has fewer
    /// parameters.
    pub ranked: Vec<Name>,
    /// How many of the first, of as many parameters, cannot be told apart by this record.
    pub indistinguishable: usize,
    /// Hysteresis, where it predicts better than every formula, and as well as the law or better beside it
    /// than the law alone: the moment depends on where the model last turned, and no law of angle and rate
    /// can hold it.
    pub memory: Option<Name>,
    /// What else no law of angle and rate holds, where it is no memory.
    pub beside: Option<Beside>,
}

/// Both parts in one formula.
fn joined(stiffness: &OnCurve, damping: &OnCurve) -> OnCurve {
    OnCurve {
        formula: Formula { forms: [&stiffness.formula.forms[..], &damping.formula.forms].concat() },
        values: [&stiffness.values[..], &damping.values].concat(),
        misfit: stiffness.misfit + damping.misfit,
    }
}

/// Names the law that was `found` in `releases`.
///
/// # Errors
/// Interrupted.
pub fn names(releases: &Releases, found: &Measured) -> Result<Names> {
    let stop = &releases.first().stop;
    let wn = found.fit.common[WN];
    let all = nearest(releases, found)?;
    let lengths = releases.lengths();
    let reach = (found.law.yaw_rad, found.law.rate_rad_s);
    let trial = Trial { releases, lengths: &lengths, found };
    let tried = |on_curve: &OnCurve| {
        let effect = on_curve.formula.effect(&on_curve.values, reach, |f| f.moment)?;
        let tried = trial.fitted(Effect::Own(Arc::new(effect)), &on_curve.values)?;
        Some((tried, on_curve.formula.clone()))
    };
    let mut ranked: Vec<(NameFit, Formula)> = all.iter().par_map(tried).flatten().collect();
    stop.check()?;
    let least =
        |a: &NameFit, b: &NameFit| a.prediction.rms_rad().total_cmp(&b.prediction.rms_rad());
    // A spring with a little of the stiffness yields at some share of the largest angle.
    let yields = [0.05, 0.2, 0.6].into_iter().par_map(|share| {
        trial.fitted(Effect::with_memory(), &[0.03 * wn * wn, share * found.law.yaw_rad])
    });
    let memory = yields.flatten().min_by(least);
    stop.check()?;
    ranked.sort_by(|a, b| least(&a.0, &b.0));
    // Among those that predict as well as the best, or leave no more than the noise, what has fewest
    // parameters.
    let noise_rad = releases.first().noise_rad;
    let alike = |k: &usize| {
        let (best, other) = (&ranked[0].0.prediction, &ranked[*k].0.prediction);
        best.rms_rad() > (1.0 - MIN_GAIN) * other.rms_rad()
            || best.gain_over(other) < ONE_STANDARD_ERROR
            || other.rms_rad() < (1.0 + MIN_GAIN) * noise_rad
    };
    let first = (0..ranked.len()).take_while(alike).count();
    let count = |(_, formula): &(NameFit, Formula)| formula.parameters().count();
    let fewest = ranked[..first].iter().map(count).min();
    ranked[..first].sort_by_key(count);
    let indistinguishable = ranked[..first].iter().filter(|n| Some(count(n)) == fewest).count();
    let best = ranked.first().map(|(best, _)| best);
    // Randomness is predicted by nothing, hysteresis neither.
    let plain_rad = found.plain_held_out_over_noise * noise_rad;
    let memory = memory.filter(|memory| memory.prediction.rms_rad() < (1.0 - MIN_GAIN) * plain_rad);
    let memory = memory.filter(|memory| {
        let beats = |other: &Prediction, by: f64| memory.prediction.gain_over(other) > by;
        best.is_none_or(|best| beats(&best.prediction, ONE_STANDARD_ERROR))
            && (beats(&found.prediction, -ONE_STANDARD_ERROR)
                || memory.prediction.rms_rad() < (1.0 + MIN_GAIN) * found.prediction.rms_rad()
                || trial.lacks(memory))
            || trial.remembers(memory, best)
    });
    stop.check()?;
    ranked.truncate(indistinguishable.max(BREADTH));
    let name = |(tried, formula): &(NameFit, Formula)| {
        let mut name = trial.named(tried)?;
        // The file begins where the fit has ended.
        let values: Vec<f64> = name.parameters.iter().map(|(_, q)| q.value).collect();
        name.text = Some(formula.text(&values, reach, |f| f.moment));
        Some(name)
    };
    let ranked: Vec<Name> = ranked.iter().par_map(name).collect::<Option<_>>().unwrap_or_default();
    let memory = memory.and_then(|memory| trial.named(&memory));
    stop.check()?;
    let beside = match memory.is_none() {
        true => beside(releases, &lengths, found),
        false => None,
    };
    stop.check()?;
    Ok(Names { ranked, indistinguishable, memory, beside })
}

/// Formulas whose curves are nearest to the measured ones: for both parts, and for one where the other is
/// little.
fn nearest(releases: &Releases, found: &Measured) -> Result<Vec<OnCurve>> {
    let wn = found.fit.common[WN];
    let of_angle = releases.first().measurand.is_of_angle();
    let of = |is_there: bool, curve: Vec<Point>, is_stiffness: bool| match is_there {
        true => Target::new(&curve, wn).nearest(is_stiffness, of_angle),
        false => Vec::new(),
    };
    let has = |part: Part| found.law.parts.iter().any(|(p, _)| *p == part);
    let bends = has(Part::Stiffness) || has(Part::UnevenStiffness);
    let dissipates = found.law.friction || has(Part::Damping) || has(Part::UnevenDamping);
    let stiffness = of(bends, found.tables().stiffness(), true);
    let damping = of(dissipates, found.tables().damping(), false);
    releases.first().stop.check()?;
    let mut all: Vec<OnCurve> =
        stiffness.iter().flat_map(|s| damping.iter().map(move |d| joined(s, d))).collect();
    all.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
    all.truncate(12);
    all.extend(stiffness.into_iter().chain(damping));
    Ok(all)
}

/// An effect in place of the law, fitted to long pieces.
struct NameFit {
    effect: Effect,
    fit: PieceFit,
    prediction: Prediction,
}

impl NameFit {
    /// The effect's numbers.
    fn numbers(&self) -> &[f64] {
        &self.fit.common[self.fit.start_of(&self.effect)..]
    }
}

/// What a formula is tried on.
struct Trial<'a> {
    releases: &'a Releases<'a>,
    lengths: &'a Lengths,
    found: &'a Measured,
}

impl Trial<'_> {
    /// Whether the law predicts better with `other` beside it.
    fn lacks(&self, other: &NameFit) -> bool {
        let Self { releases, lengths, found } = self;
        if found.held_out_over_noise < ABOVE_NOISE {
            return false;
        }
        let structure = found.with_line().with(&other.effect);
        let common = [&found.fit.common[..], other.numbers()].concat();
        let fit = fit_from(&lengths.long, &structure, &common, SETTLED);
        let with = predict_within(&lengths.predicted, &fit);
        !releases.first().stop.is_requested() && with.is_better_than(&found.prediction)
    }

    /// Whether hysteresis stands for the law's stiffness: beside its dissipation it leaves a hundredth of the
    /// squares that that alone misses, and predicts better than `best`, the best formula. A curve through
    /// many knots may do as well where the springs that yield are stiff.
    fn remembers(&self, hysteresis: &NameFit, best: Option<&NameFit>) -> bool {
        let Self { releases, lengths, found } = self;
        let of_yaw = |(part, _): &(Part, f64)| part.is_of_yaw();
        let held = ABOVE_NOISE * releases.first().noise_rad;
        if best.is_some_and(|n| n.prediction.rms_rad() < held)
            || !found.law.parts.iter().any(of_yaw)
        {
            return false;
        }
        let parts = found.law.parts.iter().filter(|p| !of_yaw(p)).copied().collect();
        let law = found.law.with(parts, found.law.friction).without_line(None);
        let begin = found.plain.common.len();
        let dissipation = found.law.translated(&found.fit.common[begin..], &law);
        let begun = |others: &[(&Effect, &[f64])]| {
            let mut structure = found.plain.structure.clone();
            let mut common = found.fit.common[..begin].to_vec();
            for (effect, numbers) in others {
                structure = structure.with(effect);
                common.extend(*numbers);
            }
            let short = fit_from(&lengths.short, &structure, &common, ROUGH);
            fit_from(&lengths.long, &structure, &short.common, FIRST)
        };
        let predicted = |begun: &PieceFit| {
            let fit = fit_from(&lengths.long, &begun.structure, &begun.common, SETTLED);
            predict_within(&lengths.predicted, &fit)
        };
        let law = (&Effect::Measured(Arc::new(law)), dissipation.as_slice());
        // Of what the stiffness does.
        let square = |prediction: &Prediction| prediction.rms_rad().powi(2);
        let with = begun(&[(&hysteresis.effect, hysteresis.numbers()), law]);
        let (with, by_law) = (predicted(&with), square(&found.prediction));
        if best.is_some_and(|n| !with.is_better_than(&n.prediction)) {
            return false;
        }
        let left =
            (square(&with) - by_law) / (square(&predicted(&begun(&[law]))) - by_law).max(0.0);
        !releases.first().stop.is_requested() && left < 0.01
    }

    /// `effect` in place of the law, fitted from `values` of what the fit varies.
    fn fitted(&self, effect: Effect, values: &[f64]) -> Option<NameFit> {
        let Self { lengths, found, .. } = self;
        let mut structure = found.plain.structure.with(&effect);
        structure.swift = true;
        let inner = found.plain.common.len();
        let mut common = found.fit.common[..inner].to_vec();
        common.extend(values);
        // Short pieces first: a shape that is a little wrong has lost the phase of a long one.
        let short = fit_from(&lengths.short, &structure, &common, ROUGH);
        let fit = fit_from(&lengths.long, &structure, &short.common, SETTLED);
        if !fit.sum().is_finite() {
            return None;
        }
        let prediction = predict_within(&lengths.predicted, &fit);
        Some(NameFit { effect, fit, prediction })
    }

    /// Fitted to whole records, by steps that adapt; `None` where the user stops it.
    fn named(&self, tried: &NameFit) -> Option<Name> {
        let Self { releases, lengths, .. } = self;
        let NameFit { effect, fit, prediction } = tried;
        let whole = releases.whole(fit).ok()?;
        let prefix = format!("{effect}.");
        let own = |(name, q): (String, Quantity)| {
            // A number at its bound has no error bar.
            let u = if q.u > 0.0 { q.u } else { f64::NAN };
            Some((name.strip_prefix(&prefix)?.to_owned(), Quantity::new(q.value, u)))
        };
        Some(Name {
            parameters: whole.effect_parameters().into_iter().filter_map(own).collect(),
            residual_over_noise: over_noise(&lengths.long, fit),
            held_out_over_noise: prediction.rms_rad() / releases.first().noise_rad,
            text: None,
            fit: whole,
            effect: effect.clone(),
        })
    }
}
