//! A diagnosis as one object, the same for one release, several and a campaign.

use crate::commands::Words;
use crate::common::SCHEMA_VERSION;
use crate::diagnose::outcome::Outcome;
use crate::law;
use serde::Serialize;
use std::path::{Path, PathBuf};
use yawrig_core::diagnosis::diagnose::{Diagnosis, ReleaseVerdict};
use yawrig_core::fit::at_amplitude::AtAmplitude;
use yawrig_core::fit::fitting::Covariance;
use yawrig_core::quantity::Quantity;
use yawrig_core::roll::RollDecay;

#[derive(Serialize)]
pub(super) struct Object<'a> {
    schema_version: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    campaign: Option<&'a Path>,
    #[serde(flatten)]
    diagnosis: &'a Diagnosis,
    /// Of one release its numbers beside the verdict, too.
    #[serde(flatten)]
    only: Option<Only<'a>>,
    /// Of several releases, as `releases`: the name that they had first.
    #[serde(skip_serializing_if = "Option::is_none")]
    records: Option<&'a [ReleaseVerdict]>,
    seconds: f64,
    /// Which make the model of the answer.
    commands: &'a [Words],
    /// As `law` prints it.
    #[serde(skip_serializing_if = "Option::is_none")]
    law: Option<serde_json::Value>,
}

#[derive(Serialize)]
struct Only<'a> {
    at_amplitude: &'a [AtAmplitude],
    #[serde(skip_serializing_if = "Option::is_none")]
    covariance: Option<&'a Covariance>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rest_angle_deg: Option<Quantity>,
    #[serde(skip_serializing_if = "Option::is_none")]
    roll: Option<&'a RollDecay>,
}

/// `files`: where the formulas of a law were written.
pub(super) fn object<'a>(outcome: &'a Outcome, files: &[PathBuf]) -> Object<'a> {
    let diagnosis = &outcome.diagnosed.diagnosis;
    let only = |release: &'a ReleaseVerdict| Only {
        at_amplitude: &release.at_amplitude,
        covariance: release.covariance.as_ref(),
        rest_angle_deg: release.rest_angle_deg,
        roll: release.roll.as_ref(),
    };
    Object {
        schema_version: SCHEMA_VERSION,
        campaign: outcome.campaign.as_deref(),
        only: diagnosis.only().filter(|_| outcome.campaign.is_none()).map(only),
        records: (outcome.records.len() > 1).then_some(&diagnosis.releases),
        seconds: outcome.seconds,
        commands: &outcome.commands,
        law: outcome.law.as_ref().map(|found| law::object(found, files)),
        diagnosis,
    }
}
