//! The derivatives of a campaign from the natural frequencies and damping ratios of a model that was fitted to it.

use crate::document::{read_text, EffectEntry, MadeUnder, Model};
use crate::journal::{Journal, Known, KnownModal};
use std::collections::BTreeMap;
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_campaign::CampaignFile;
use yawrig_core::derivatives::campaign::ReleaseEntry;
use yawrig_core::derivatives::condition::Identified;
use yawrig_core::derivatives::table::Table;
use yawrig_core::derivatives::Computed;
use yawrig_core::diagnosis::wind::Dimensionless;
use yawrig_core::effects::Source;
use yawrig_core::quantity::Quantity;

/// A model's natural frequency and damping ratio of each condition.
pub type ByCondition = BTreeMap<String, KnownModal>;

/// What a model that was fitted to a campaign says of it.
#[derive(Clone, Debug)]
pub struct OfModel {
    /// The effects are named in a note.
    pub table: Table,
    /// By effect that the air makes: the dimensionless derivative that it is.
    pub dimensionless: BTreeMap<String, Dimensionless>,
}

/// The derivatives by the last fit of the model at `model`, and those that its effects are.
///
/// # Errors
/// Exit 3: where model or journal cannot be read, or it was not fitted to this campaign, or has changed since.
pub fn of_model(campaign: &CampaignFile, model: &Path) -> Result<OfModel> {
    let text = read_text(model)?;
    let effects = Model::parse(&text, model)?.effects;
    let journal = Journal::new(model)?;
    journal.warn(model);
    let mut fitted = journal.steps.iter().rev().filter(|step| !step.modal.is_empty());
    let is_known = fitted.clone().next().is_some();
    let step = fitted.find(|step| step.model == text);
    let table = step.and_then(|step| table(campaign, &step.modal));
    let mut table = table.ok_or_else(|| {
        let (of, named) = (model.display().to_string(), campaign.path.display().to_string());
        let (why, fit) = match is_known && step.is_none() {
            true => (
                format!("{of} has changed since it was fitted"),
                settings::command("fit", &[], &[("model", &of)]),
            ),
            false => (
                format!("{of} was fitted to no releases that make a point of {named}"),
                settings::command("fit", &[&named], &[]),
            ),
        };
        Error::data(why).help(format!("fit it first: {fit}"))
    })?;
    let names: Vec<&str> = effects.iter().map(|entry| entry.effect.id()).collect();
    table.notes.push(match names.is_empty() {
        true => format!("by {}, a second-order model", model.display()),
        false => format!("by {}, with {}", model.display(), names.join(", ")),
    });
    let of = |entry: &EffectEntry| {
        let Source::Aerodynamic { reference_m_s } = entry.effect.source() else { return None };
        let known = entry.parameters.first()?;
        let coefficient = Quantity::new(known.value?, known.u.unwrap_or(f64::NAN));
        let at = (coefficient, reference_m_s);
        let found = Dimensionless::at(&entry.effect, at, &campaign.campaign, &table.inertia_kg_m2)?;
        Some((entry.effect.id().to_owned(), found))
    };
    let dimensionless = effects.iter().filter_map(of).collect();
    Ok(OfModel { table, dimensionless })
}

/// The table of the releases whose condition is known; none without a point.
pub fn table(campaign: &CampaignFile, modal: &ByCondition) -> Option<Table> {
    let known = |entry: &ReleaseEntry| {
        let made = MadeUnder {
            spring: entry.spring.clone(),
            axis: entry.axis,
            wind_speed_m_s: entry.wind_speed_m_s,
        };
        modal.get(&made.condition()).copied()
    };
    let mut chosen = campaign.clone();
    chosen.campaign.release.clear();
    chosen.release_lines.clear();
    let mut identified = Vec::new();
    let releases = campaign.campaign.release.iter().zip(&campaign.release_lines);
    // Repeats share one fit: counted once, or they would look like repeats that agree by a miracle.
    let mut seen: Vec<String> = Vec::new();
    for (entry, line) in releases {
        let Some(found) = known(entry) else { continue };
        let condition = format!("{} {} {}", entry.spring, entry.axis, entry.wind_speed_m_s);
        if seen.contains(&condition) {
            continue;
        }
        seen.push(condition);
        chosen.campaign.release.push(entry.clone());
        chosen.release_lines.push(*line);
        let quantity = |k: Known| Quantity::new(k.value, k.u.unwrap_or(0.0));
        let [wn, zeta] = [found.natural_frequency_rad_s, found.damping_ratio].map(quantity);
        identified.push(Identified::new(wn, zeta, 0.0, 0.0));
    }
    let computed = Computed::new(&chosen.campaign, &identified).ok()?;
    let table = computed.table(&chosen.path, "model");
    (!table.points.is_empty()).then_some(table)
}
