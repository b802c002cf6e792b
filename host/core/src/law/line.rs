//! What of a measured dissipation is its line, which the damping ratio takes.
//!
//! Any share of 2 zeta wn r may stand in D(r) instead: the motion is the same. Without a choice a fit ends
//! wherever it began, and zeta has the uncertainty of all that D could take over. Chosen is the line that is
//! left beside the simplest formula that does as well as any: beside dry friction or a power of the rate, the
//! true one. The uncertainty of zeta is then that of the line beside this formula, not of the choice.

use super::on_curve::{OnCurve, Target};
use super::tables::Tables;
use crate::diagnosis::over_pieces::Lengths;
use crate::effects::{Effect, Line, Part};
use crate::fit::fitting::Structure;
use crate::fit::segments::{fit_from, ROUGH};
use crate::fit::structure::{WN, ZETA};
use crate::par_map::ParMap;
use std::sync::Arc;

/// Share by which a law has to predict better than one with fewer curves, or a formula than a simpler one.
pub(super) const NO_BETTER: f64 = 0.02;

/// What to multiply the values of the law's dissipation with for its line; `None` where it has no such curve,
/// or no formula. `plain` is the model without the law.
pub(super) fn line(lengths: &Lengths, plain: &Structure, found: &Tables) -> Option<Line> {
    let law = found.law;
    let is_damping = |(part, _): &(Part, f64)| *part == Part::Damping;
    if !law.parts.iter().any(is_damping) {
        return None;
    }
    let wn_rad_s = found.common[WN];
    let damping = found.damping();
    let mut near = Target::new(&damping, wn_rad_s).nearest(false, true);
    let least = near.iter().map(|n| n.misfit).fold(f64::INFINITY, f64::min);
    near.retain(|n| n.misfit <= 20.0 * least);
    // In place of the dissipation, beside the other curves.
    let parts = law.parts.iter().filter(|p| !is_damping(p)).copied().collect();
    let others = law.with(parts, false);
    let begin = found.common.len() - law.no_law().len();
    // Formula, squares left, and damping ratio beside it.
    let fitted = |near: &OnCurve| -> Option<(usize, f64, f64)> {
        let reach = (law.yaw_rad, law.rate_rad_s);
        let own = near.formula.effect(&near.values, reach, |f| f.moment)?;
        let (mut structure, mut common) = (plain.clone(), found.common[..begin].to_vec());
        if !others.is_none() {
            structure = structure.with(&Effect::Measured(Arc::new(others.clone())));
            common.extend(law.translated(&found.common[begin..], &others));
        }
        let mut structure = structure.with(&Effect::Own(Arc::new(own)));
        structure.swift = true;
        common.extend(&near.values);
        let short = fit_from(&lengths.short, &structure, &common, ROUGH);
        let fit = fit_from(&lengths.long, &structure, &short.common, ROUGH);
        Some((near.formula.parameters().count(), fit.sum(), fit.common[ZETA]))
    };
    let all: Vec<(usize, f64, f64)> = near.iter().par_map(fitted).flatten().collect();
    let least = all.iter().map(|(_, sum, _)| *sum).fold(f64::INFINITY, f64::min);
    let as_well = all.into_iter().filter(|(_, sum, _)| *sum <= (1.0 + NO_BETTER) * least);
    let (_, _, zeta) = as_well.min_by_key(|(count, _, _)| *count)?;
    // What the curve is without that line has none.
    let knots = law.knots[Part::Damping as usize];
    let more = 2.0 * wn_rad_s * (found.common[ZETA] - zeta);
    let rates = knots.map(|x| x * law.rate_rad_s);
    let left = rates.map(|r| found.dissipation(r) + more * r);
    let dot = |a: &Line, b: &Line| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let share = dot(&knots, &left) / dot(&left, &left);
    let beside: Line = std::array::from_fn(|k| knots[k] - share * left[k]);
    let own = dot(&beside, &knots);
    // Where a multiple of the curve stands for the line nothing is left.
    (own > 1e-3 * dot(&knots, &knots)).then(|| beside.map(|x| x / own))
}
