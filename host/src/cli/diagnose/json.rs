//! A diagnosis as one object.

use crate::cli::common::SCHEMA_VERSION;
use crate::cli::law;
use serde::Serialize;
use std::path::{Path, PathBuf};
use yawrig_core::diagnosis::campaign::CampaignDiagnosis;
use yawrig_core::diagnosis::diagnose::Diagnosis;
use yawrig_core::diagnosis::several::SeveralDiagnosis;
use yawrig_core::roll::RollDecay;
use yawrig_model::law::LawAnswer;

#[derive(Serialize)]
pub(super) struct Object<'a, D> {
    schema_version: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    campaign: Option<&'a Path>,
    #[serde(flatten)]
    diagnosis: &'a D,
    seconds: f64,
    /// As `law` prints it.
    #[serde(skip_serializing_if = "Option::is_none")]
    law: Option<serde_json::Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    roll: Option<RollDecay>,
}

pub(super) fn object<'a>(
    diagnosis: &'a Diagnosis,
    law: Option<&LawAnswer>,
    files: &[PathBuf],
    roll: Option<RollDecay>,
    seconds: f64,
) -> Object<'a, Diagnosis> {
    let law = law.map(|found| law::object(found, files));
    Object { schema_version: SCHEMA_VERSION, campaign: None, diagnosis, seconds, law, roll }
}

pub(super) fn several_object(
    diagnosis: &SeveralDiagnosis,
    seconds: f64,
) -> Object<'_, SeveralDiagnosis> {
    Object {
        schema_version: SCHEMA_VERSION,
        campaign: None,
        diagnosis,
        seconds,
        law: None,
        roll: None,
    }
}

pub(super) fn campaign_object<'a>(
    path: &'a Path,
    diagnosis: &'a CampaignDiagnosis,
    seconds: f64,
) -> Object<'a, CampaignDiagnosis> {
    Object {
        schema_version: SCHEMA_VERSION,
        campaign: Some(path),
        diagnosis,
        seconds,
        law: None,
        roll: None,
    }
}
