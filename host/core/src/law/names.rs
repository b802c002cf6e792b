//! The name of a measured law: formulas fitted to its curves, the best then to the record, ranked by what they predict.

use super::estimate::{over_noise, Measured, Point};
use super::forms::{moment, Form, Formula, Role, FORMS};
use super::releases::Releases;
use crate::diagnosis::over_pieces::Lengths;
use crate::diagnosis::prediction::{predict_within, Prediction};
use crate::effects::{Effect, Part};
use crate::error::Result;
use crate::fit::fitting::{Fitted, Structure};
use crate::fit::segments::{fit_from, PieceFit, ROUGH};
use crate::quantity::Quantity;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::sync::Arc;
use yawrig_expression::OwnEffect;

/// Formulas for each part that are taken on from the curves: single forms, and sums of two.
const SINGLE: usize = 4;
const SUMS: usize = 2;
/// Names that are kept at least, where there are so many.
const NAMED: usize = 6;
/// Models tried on the record.
const TRIED: usize = 12;
/// Uncertainty of a curve at least, of its largest value: no formula is asked to go through each bend of a spline.
const LEAST_U: f64 = 0.01;
/// Where the fit of a spring that yields begins: yield angles as shares of the largest, and its share of the stiffness.
const YIELDS: [f64; 3] = [0.05, 0.2, 0.6];
const YIELDING: f64 = 0.03;
const SETTLED: f64 = 1e-4;
/// Standard errors by which a longer formula has to predict better, and the share by which its error has to be smaller.
const BETTER: f64 = 1.0;
const LEAST_GAIN: f64 = 0.05;
/// Ratio of errors up to which the two numbers of hysteresis predict as well as the many of a law.
const AS_WELL: f64 = 1.1;
/// Share of the squares missed without the law's stiffness that hysteresis in its place may leave.
const LITTLE: f64 = 0.01;
/// Held out over the noise, up to which a law of angle and rate holds all there is.
const HELD: f64 = 1.15;

/// A formula fitted to the record in place of the law.
#[derive(Clone, Debug)]
pub struct Name {
    pub effect: Effect,
    pub fit: Fitted,
    /// By name; u is not a number where the record gives none.
    pub parameters: Vec<(String, Quantity)>,
    /// The file of an own effect, beginning at these numbers; `None` for an effect of the library.
    pub text: Option<String>,
    pub residual_over_noise: f64,
    pub held_out_over_noise: f64,
}

/// The formulas that a law may be.
#[derive(Clone, Debug)]
pub struct Names {
    /// What predicts best first; where the difference is less than a standard error, what has fewer parameters.
    pub ranked: Vec<Name>,
    /// How many of the first, of as many parameters, cannot be told apart by this record.
    pub indistinguishable: usize,
    /// Hysteresis, where it predicts better than every formula, and as well as the law or better beside it than the law
    /// alone: the moment depends on where the model last turned, and no law of angle and rate can hold it.
    pub memory: Option<Name>,
}

/// A formula on a curve: its parameters there, and how far it is from it.
struct OnCurve {
    formula: Formula,
    values: Vec<f64>,
    misfit: f64,
}

fn products(lists: &[Vec<f64>]) -> Vec<Vec<f64>> {
    lists.iter().fold(vec![Vec::new()], |all, list| {
        all.iter()
            .flat_map(|head| list.iter().map(move |x| [head.as_slice(), &[*x]].concat()))
            .collect()
    })
}

/// `forms` fitted to a curve beside a linear term, which natural frequency or damping ratio takes.
fn on_curve(forms: &[&'static Form], curve: &[Point], wn: f64) -> Option<OnCurve> {
    let formula = Formula { forms: forms.to_vec() };
    let reach = curve.last()?.at;
    let largest = curve.iter().fold(0.0f64, |m, p| m.max(p.moment_rad_s2.value.abs()));
    let tried = |role: Role| match role {
        Role::Size => vec![1.0],
        Role::Plain(tried) => tried.to_vec(),
        Role::OfReach(tried) => tried.iter().map(|x| x * reach).collect(),
    };
    let parameters: Vec<_> = formula.parameters().collect();
    let lists: Vec<Vec<f64>> = parameters.iter().map(|p| tried(p.role)).collect();
    let single: Vec<OwnEffect> = forms
        .iter()
        .map(|form| {
            let one = Formula { forms: vec![*form] };
            one.effect(&one.typical(), (1.0, 1.0), |f| f.alike.unwrap_or(f.moment))
        })
        .collect::<Option<_>>()?;
    let points: Vec<&Point> = curve.iter().filter(|p| p.at != 0.0).collect();
    let u: Vec<f64> = points.iter().map(|p| p.moment_rad_s2.u.max(LEAST_U * largest)).collect();
    let mut best: Option<OnCurve> = None;
    for values in products(&lists) {
        // Each form at a size of one, and the linear term.
        let a = DMatrix::from_fn(points.len(), forms.len() + 1, |i, j| {
            let x = points[i].at;
            if j == forms.len() {
                return x / u[i];
            }
            let begin: usize = forms[..j].iter().map(|f| f.parameters.len()).sum();
            let p = &values[begin..begin + forms[j].parameters.len()];
            let (b, r) = if forms[j].is_stiffness { (x, 0.0) } else { (0.0, x) };
            -moment(&single[j], p, b, r, wn) / u[i]
        });
        let y = DVector::from_fn(points.len(), |i, _| points[i].moment_rad_s2.value / u[i]);
        let svd = a.clone().svd(true, true);
        let Ok(sizes) = svd.solve(&y, 1e-9) else { continue };
        let wrong = (0..forms.len()).any(|j| !forms[j].is_stiffness && sizes[j] <= 0.0);
        let misfit = (a * &sizes - y).norm_squared() / points.len() as f64;
        if wrong || !misfit.is_finite() || best.as_ref().is_some_and(|b| b.misfit <= misfit) {
            continue;
        }
        let mut found = values.clone();
        let mut begin = 0;
        for (j, form) in forms.iter().enumerate() {
            found[begin] *= sizes[j];
            begin += form.parameters.len();
        }
        best = Some(OnCurve { formula: formula.clone(), values: found, misfit });
    }
    best
}

/// The formulas of a kind that are nearest to a curve.
fn nearest(curve: &[Point], is_stiffness: bool, wn: f64) -> Vec<OnCurve> {
    let forms: Vec<&'static Form> =
        FORMS.iter().filter(|f| f.is_stiffness == is_stiffness).collect();
    let sorted = |mut all: Vec<OnCurve>, most: usize| {
        all.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
        all.truncate(most);
        all
    };
    let single = forms.iter().filter_map(|form| on_curve(&[form], curve, wn)).collect();
    let plain: Vec<&'static Form> =
        forms.iter().filter(|f| f.parameters.len() == 1).copied().collect();
    let pairs: Vec<[&'static Form; 2]> = plain
        .iter()
        .enumerate()
        .flat_map(|(k, a)| plain[..k].iter().map(move |b| [*b, *a]))
        .collect();
    let sums = pairs.par_iter().filter_map(|pair| on_curve(pair, curve, wn)).collect();
    let mut out = sorted(single, SINGLE);
    out.extend(sorted(sums, SUMS));
    out
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
    let wn = found.fit.common[0];
    let of = |is_there: bool, curve: Vec<Point>, is_stiffness: bool| match is_there {
        true => nearest(&curve, is_stiffness, wn),
        false => Vec::new(),
    };
    let has = |part: Part| found.law.parts.iter().any(|(p, _)| *p == part);
    let bends = has(Part::Stiffness) || has(Part::UnevenStiffness);
    let dissipates = found.law.friction || has(Part::Damping) || has(Part::UnevenDamping);
    let stiffness = of(bends, found.stiffness(), true);
    let damping = of(dissipates, found.damping(), false);
    stop.check()?;
    // A formula for both parts, or for one where the other is little.
    let mut all: Vec<OnCurve> =
        stiffness.iter().flat_map(|s| damping.iter().map(move |d| joined(s, d))).collect();
    all.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
    all.truncate(TRIED);
    all.extend(stiffness.into_iter().chain(damping));
    let lengths = releases.lengths();
    let reach = (found.law.yaw_rad, found.law.rate_rad_s);
    let trial = Trial { releases, lengths: &lengths, found };
    let tried = |on_curve: &OnCurve| {
        let effect = on_curve.formula.effect(&on_curve.values, reach, |f| f.moment)?;
        let tried = trial.fitted(Effect::Own(Arc::new(effect)), &on_curve.values)?;
        Some((tried, on_curve.formula.clone()))
    };
    let mut ranked: Vec<(Tried, Formula)> = all.par_iter().filter_map(tried).collect();
    stop.check()?;
    let least = |a: &Tried, b: &Tried| a.prediction.rms_rad().total_cmp(&b.prediction.rms_rad());
    let yields = YIELDS.par_iter().filter_map(|y| {
        trial.fitted(Effect::Hysteresis, &[YIELDING * wn * wn, y * found.law.yaw_rad])
    });
    let memory = yields.min_by(least);
    stop.check()?;
    ranked.sort_by(|a, b| least(&a.0, &b.0));
    // Among those that predict as well as the best, or leave no more than the noise, what has fewest parameters.
    let noise_rad = releases.first().noise_rad;
    let alike = |k: &usize| {
        let (best, other) = (&ranked[0].0.prediction, &ranked[*k].0.prediction);
        best.rms_rad() > (1.0 - LEAST_GAIN) * other.rms_rad()
            || best.gain_over(other) < BETTER
            || other.rms_rad() < (1.0 + LEAST_GAIN) * noise_rad
    };
    let first = (0..ranked.len()).take_while(alike).count();
    let count = |(_, formula): &(Tried, Formula)| formula.parameters().count();
    let fewest = ranked[..first].iter().map(count).min();
    ranked[..first].sort_by_key(count);
    let indistinguishable = ranked[..first].iter().filter(|n| Some(count(n)) == fewest).count();
    let best = ranked.first().map(|(best, _)| best);
    let memory = memory.filter(|memory| {
        let beats = |other: &Prediction, by: f64| memory.prediction.gain_over(other) > by;
        best.is_none_or(|best| beats(&best.prediction, BETTER))
            && (beats(&found.prediction, -BETTER)
                || memory.prediction.rms_rad() < AS_WELL * found.prediction.rms_rad()
                || trial.lacks(memory))
            || trial.remembers(memory, best)
    });
    stop.check()?;
    ranked.truncate(indistinguishable.max(NAMED));
    let name = |(tried, formula): &(Tried, Formula)| {
        let mut name = trial.named(tried)?;
        // The file begins where the fit has ended.
        let values: Vec<f64> = name.parameters.iter().map(|(_, q)| q.value).collect();
        name.text = Some(formula.text(&values, reach, |f| f.moment));
        Some(name)
    };
    let ranked: Vec<Name> = ranked.par_iter().map(name).collect::<Option<_>>().unwrap_or_default();
    let memory = memory.and_then(|memory| trial.named(&memory));
    stop.check()?;
    Ok(Names { ranked, indistinguishable, memory })
}

/// An effect in place of the law, fitted to long pieces.
struct Tried {
    effect: Effect,
    fit: PieceFit,
    prediction: Prediction,
}

impl Tried {
    /// The effect's numbers.
    fn numbers(&self) -> &[f64] {
        &self.fit.common[self.fit.start_of(self.fit.structure.effects.len() - 1)..]
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
    fn lacks(&self, other: &Tried) -> bool {
        let Self { releases, lengths, found } = self;
        if found.held_out_over_noise < HELD {
            return false;
        }
        let structure = found.fit.structure.with(&other.effect);
        let mut common = found.fit.common.clone();
        common.extend(other.numbers());
        let fit = fit_from(&lengths.long, &structure, &common, SETTLED);
        let with = predict_within(&lengths.predicted, &fit);
        !releases.first().stop.is_requested() && with.is_better_than(&found.prediction)
    }

    /// Whether hysteresis stands for the law's stiffness: beside its dissipation it leaves little of what that alone misses,
    /// and predicts better than `best`, the best formula. A curve through many knots may do as well where the springs that
    /// yield are stiff.
    fn remembers(&self, hysteresis: &Tried, best: Option<&Tried>) -> bool {
        let Self { releases, lengths, found } = self;
        let of_yaw = |(part, _): &(Part, f64)| part.is_of_yaw();
        let held = HELD * releases.first().noise_rad;
        if best.is_some_and(|n| n.prediction.rms_rad() < held)
            || !found.law.parts.iter().any(of_yaw)
        {
            return false;
        }
        let parts = found.law.parts.iter().filter(|p| !of_yaw(p)).copied().collect();
        let law = found.law.with(parts, found.law.friction);
        let begin = found.plain.common.len();
        let dissipation = found.law.translated(&found.fit.common[begin..], &law);
        let predicted = |others: &[(&Effect, &[f64])]| {
            let mut structure = found.plain.structure.clone();
            let mut common = found.fit.common[..begin].to_vec();
            for (effect, numbers) in others {
                structure = structure.with(effect);
                common.extend(*numbers);
            }
            let short = fit_from(&lengths.short, &structure, &common, ROUGH);
            let fit = fit_from(&lengths.long, &structure, &short.common, SETTLED);
            predict_within(&lengths.predicted, &fit)
        };
        let law = (&Effect::Measured(Arc::new(law)), dissipation.as_slice());
        // Of what the stiffness does.
        let square = |prediction: &Prediction| prediction.rms_rad().powi(2);
        let (with, by_law) = (
            predicted(&[(&hysteresis.effect, hysteresis.numbers()), law]),
            square(&found.prediction),
        );
        let left = (square(&with) - by_law) / (square(&predicted(&[law])) - by_law).max(0.0);
        !releases.first().stop.is_requested()
            && best.is_none_or(|n| with.is_better_than(&n.prediction))
            && left < LITTLE
    }

    /// `effect` in place of the law, fitted from `values` of what the fit varies.
    fn fitted(&self, effect: Effect, values: &[f64]) -> Option<Tried> {
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
        Some(Tried { effect, fit, prediction })
    }

    /// Fitted to whole records, by steps that adapt; `None` where the user stops it.
    fn named(&self, tried: &Tried) -> Option<Name> {
        let Self { releases, lengths, .. } = self;
        let Tried { effect, fit, prediction } = tried;
        let structure = Structure { swift: false, ..fit.structure.clone() };
        let whole = releases.whole(&structure, fit).ok()?;
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
