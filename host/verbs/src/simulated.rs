//! What `simulate` says of what it has made.

use serde_json::{json, Value};
use std::path::Path;
use yawrig_campaign::simulated::Planned;
use yawrig_rig::{Condition, Effect, Effects, Rig, Sample};
use yawrig_shared::axis::Axis;
use yawrig_shared::derivatives::reduced_frequency;
use yawrig_shared::modal::Modal;

/// What was seen of its samples.
#[derive(Default)]
pub struct Seen {
    pub samples: u64,
    pub last_s: f64,
    saturated: u64,
}

impl Seen {
    pub fn of(&mut self, sample: Sample) -> (f64, f64) {
        self.samples += 1;
        self.last_s = sample.time_s;
        self.saturated += u64::from(matches!(sample.counts, Some(0 | u16::MAX)));
        (sample.time_s, sample.yaw_deg)
    }

    pub fn warn(&self) {
        let Self { samples, saturated, .. } = self;
        if *saturated > 0 {
            yawrig_base::say!(
                "yawrig: {saturated} of {samples} readings are at an end of the converter"
            );
        }
    }
}

/// The wind-on conditions at the middle axis, once each: the points of the derivative table.
pub fn points(planned: &[Planned]) -> impl Iterator<Item = (&Condition, &Modal)> {
    let mut last = None;
    planned.iter().filter_map(move |record| {
        let Condition { spring, axis, wind_speed_m_s } = &record.condition;
        let wanted = *axis == Axis::Mid && *wind_speed_m_s > 0.0 && last != Some(spring.name);
        wanted.then(|| {
            last = Some(spring.name);
            (&record.condition, &record.truth)
        })
    })
}

pub fn campaign_json(rig: &Rig, file: &Path, planned: &[Planned]) -> Value {
    let releases: Vec<Value> = planned
        .iter()
        .map(|record| {
            let mut entry = condition_json(&record.condition);
            entry["file"] = json!(record.file);
            entry["truth"] = json!({
                "natural_frequency_rad_s": record.truth.natural_frequency_rad_s,
                "damping_ratio": record.truth.damping_ratio,
                "effects": effect_ids(&record.effects),
                "parameters": effect_parameters(&record.effects),
            });
            entry
        })
        .collect();
    let points: Vec<Value> = points(planned)
        .map(|(condition, modal)| {
            json!({
                "spring": condition.spring.name,
                "wind_speed_m_s": condition.wind_speed_m_s,
                "reduced_frequency":
                    reduced_frequency(modal, &rig.wind(condition.wind_speed_m_s), &rig.model),
                "truth": rig.truth(&condition.spring),
            })
        })
        .collect();
    json!({
        "schema_version": 1,
        "campaign": file,
        "inertia_kg_m2": { "mid": rig.mid_inertia_kg_m2, "front": rig.front_inertia_kg_m2 },
        "releases": releases,
        "points": points,
    })
}

pub fn effect_ids(effects: &Effects) -> Vec<&str> {
    effects.iter().map(Effect::id).collect()
}

/// `{"coulomb_friction.c": 0.12}`, in the units of the library.
pub fn effect_parameters(effects: &Effects) -> Value {
    let parameter = |effect: &Effect| {
        let id = effect.id();
        effect
            .parameters()
            .map(|(parameter, value)| (format!("{id}.{}", parameter.name), json!(value)))
            .collect::<Vec<_>>()
    };
    Value::Object(effects.iter().flat_map(parameter).collect())
}

pub fn condition_json(condition: &Condition) -> Value {
    json!({
        "spring": condition.spring.name,
        "axis": condition.axis,
        "wind_speed_m_s": condition.wind_speed_m_s,
    })
}
