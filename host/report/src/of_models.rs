//! The report of several models of the same records, side by side.

use super::of_model::of_model;
use super::{Made, Report, SideReport};
use std::path::PathBuf;
use yawrig_base::error::Result;
use yawrig_model::side_by_side::{side_by_side, Side};
use yawrig_records::Selection;

/// The report of `models`, each with its releases.
///
/// # Errors
/// Exit 2 where they are about different records; those of [`of_model`].
pub fn of_models(models: &[PathBuf], made: Made) -> Result<Report> {
    let sides = side_by_side(models, &[], &Selection::default())?;
    let mut whole: Option<Report> = None;
    for model in models {
        let mut one = of_model(model, made.clone())?;
        let name = model.display();
        one.releases.iter_mut().for_each(|r| r.name = format!("{name}: {}", r.name));
        one.verdict = format!("{name}: {}", one.verdict);
        // Each model's own; they are seen with `report` of one.
        (one.criticism, one.journal) = (None, Vec::new());
        match &mut whole {
            None => whole = Some(one),
            Some(all) => {
                all.title = format!("{}, {}", all.title, one.title);
                all.verdict = format!("{} {}", all.verdict, one.verdict);
                let known = |source: &super::SourceFile| all.sources.contains(source);
                let new: Vec<_> = one.sources.iter().filter(|s| !known(s)).cloned().collect();
                all.sources.extend(new);
                all.releases.extend(one.releases);
                all.notes.extend(one.notes);
            }
        }
    }
    let mut report = whole.expect("a model at least");
    report.sides = sides.iter().map(side).collect();
    Ok(report)
}

fn side(side: &Side) -> SideReport {
    let a = &side.appraisal;
    SideReport {
        model: side.model.display().to_string(),
        effects: a.effects.iter().map(ToString::to_string).collect(),
        numbers: side.numbers,
        residual_rms_deg: a.residuals.residual_rms_deg,
        residual_over_noise: a.residuals.residual_over_noise,
        held_out_over_noise: Some(a.residuals.held_out_over_noise).filter(|x| x.is_finite()),
        bic_gain: side.bic_gain,
        parameters: a.parameters.iter().map(|(name, q)| (name.clone(), *q)).collect(),
    }
}
