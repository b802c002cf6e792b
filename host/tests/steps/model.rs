//! What must hold of a model's fits whatever the record: nested models, the same answer each time, mirrored
//! records, other sampling rates. The records come from another integrator and sensor chain than the fits'.

use crate::hidden::{plant, Plan, Planted};
use std::path::Path;
use std::slice::from_ref;
use std::sync::OnceLock;
use yawrig_core::diagnosis::diagnose::{diagnose, Diagnosis, Grouping, Options};
use yawrig_core::effects::Effect;
use yawrig_core::record::Record;
use yawrig_model::comparison::{compare, Comparison};
use yawrig_model::revise::{self, Revision, RevisionRequest, Wanted};

const HIDDEN: [(Effect, u64); 6] = [
    (Effect::CoulombFriction, 11),
    (Effect::QuadraticDamping, 12),
    (Effect::CubicStiffness, 13),
    (Effect::QuadraticStiffness, 14),
    (Effect::StaticOffset, 15),
    (Effect::FreePlay, 16),
];

fn planted(effect: Effect, seed: u64, rate_hz: f64) -> Planted {
    plant(&Plan { effects: vec![effect], seed, rate_hz: Some(rate_hz), ..Plan::default() })
}

fn written(record: &Record, folder: &Path) -> std::path::PathBuf {
    let file = folder.join("r.csv");
    yawrig_records::write(record, &file).expect("room for it");
    file
}

fn compared(record: &Record, effects: &[Effect]) -> Revision {
    let folder = tempfile::tempdir().expect("a folder");
    let files = vec![written(record, folder.path())];
    compare(&Comparison { files, effects: effects.to_vec(), ..Comparison::default() })
        .expect("a fit")
}

fn over_noise(revision: &Revision) -> f64 {
    revision.appraisal.residuals.residual_over_noise
}

fn diagnosed(record: &Record) -> Diagnosis {
    diagnose(from_ref(record), &Grouping::default(), &Options::default())
        .expect("a free decay")
        .diagnosis
}

/// One of a few for what takes whole searches, sampled at 1 kHz.
struct Case {
    effect: Effect,
    seed: u64,
    record: Record,
    found: Diagnosis,
}

/// Searched once for all tests, the first of `HIDDEN` first.
fn few() -> &'static [Case; 3] {
    static FEW: OnceLock<[Case; 3]> = OnceLock::new();
    FEW.get_or_init(|| {
        [0, 3, 4].map(|k: usize| {
            let (effect, seed) = HIDDEN[k].clone();
            let record = planted(effect.clone(), seed, 1000.0).record;
            let found = diagnosed(&record);
            Case { effect, seed, record, found }
        })
    })
}

#[test]
fn a_model_never_fits_worse_than_one_it_contains_and_removing_undoes_adding() {
    let asked = RevisionRequest::default();
    for (effect, seed) in HIDDEN {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("model.toml");
        let files = vec![written(&planted(effect.clone(), seed, 1000.0).record, folder.path())];
        let wanted = Wanted { files, ..Wanted::default() };
        let plain = revise::fit(&path, &wanted, &asked).expect("a fit");
        let first = revise::add(&path, effect.clone(), &asked).expect("a fit");
        // More parameters on the same residuals raise the rms by a part in the number of means at most.
        let rounding = 1.0 + 1e-3;
        println!("{effect}: {:.3} -> {:.3}", over_noise(&plain), over_noise(&first));
        assert!(over_noise(&first) < 1.05, "{effect}: {}", over_noise(&first));
        assert!(over_noise(&first) <= over_noise(&plain) * rounding);
        for other in [Effect::CubicDamping, Effect::StiffnessDrift, Effect::BaselineDrift] {
            let more = revise::add(&path, other.clone(), &asked).expect("a fit");
            assert!(over_noise(&more) <= over_noise(&first) * rounding, "{effect} + {other}");
            let less = revise::remove(&path, other.id(), &asked).expect("a fit");
            let change = over_noise(&less) / over_noise(&first) - 1.0;
            assert!(change.abs() < 1e-4, "{effect} + {other} - {other}: {change:e}");
        }
        let back = revise::remove(&path, effect.id(), &asked).expect("a fit");
        let change = over_noise(&back) / over_noise(&plain) - 1.0;
        assert!(change.abs() < 1e-4, "{effect} added and removed: {change:e}");
    }
}

#[test]
fn the_same_record_gives_the_same_bytes() {
    let Case { effect, record, found, .. } = &few()[0];
    let verdict = |found: &Diagnosis| serde_json::to_string(found).expect("JSON");
    assert_eq!(verdict(found), verdict(&diagnosed(record)));
    let folder = tempfile::tempdir().expect("a folder");
    let files = vec![written(record, folder.path())];
    let comparison = Comparison { files, effects: vec![effect.clone()], ..Comparison::default() };
    let text = || serde_json::to_string(&compare(&comparison).expect("a fit")).expect("JSON");
    assert_eq!(text(), text());
}

/// Of a record turned upside down: the sign of each parameter.
fn mirrored(name: &str) -> f64 {
    match name {
        "static_offset.m" | "quadratic_stiffness.k2" | "sensor_nonlinearity.s" => -1.0,
        _ => 1.0,
    }
}

#[test]
fn a_mirrored_record_gives_the_mirrored_answer() {
    for Case { effect, record, found, .. } in few() {
        let mut flipped = record.clone();
        flipped.yaw_deg.iter_mut().for_each(|y| *y = -*y);
        let names = |found: &Diagnosis| {
            (found.status, found.effects.clone(), found.indistinguishable.clone())
        };
        assert_eq!(names(found), names(&diagnosed(&flipped)), "{effect}");
        let (a, b) = (compared(record, from_ref(effect)), compared(&flipped, from_ref(effect)));
        assert!((over_noise(&a) / over_noise(&b) - 1.0).abs() < 1e-6, "{effect}");
        for (name, value) in &a.appraisal.parameters {
            let other = b.appraisal.parameters[name];
            // A fit ends within a hundredth of a standard error of the minimum.
            let miss = (value.value - mirrored(name) * other.value).abs();
            assert!(miss < 0.02 * value.u, "{name}: {value} and {other}");
        }
    }
}

#[test]
fn another_sampling_rate_gives_the_same_effects() {
    for Case { effect, seed, record, found } in few() {
        let mut values = Vec::new();
        let mut seen = |rate_hz: f64, record: &Record, found: &Diagnosis| {
            println!("{effect} at {rate_hz} Hz: {:?} {:?}", found.status, found.effects);
            assert_eq!(found.effects, *from_ref(effect), "{effect} at {rate_hz} Hz");
            let revision = compared(record, from_ref(effect));
            let (name, value) = revision.appraisal.parameters.first_key_value().expect("one");
            values.push((rate_hz, name.clone(), *value));
        };
        seen(1000.0, record, found);
        for rate_hz in [500.0, 200.0] {
            let record = planted(effect.clone(), *seed, rate_hz).record;
            seen(rate_hz, &record, &diagnosed(&record));
        }
        for (rate_hz, name, value) in &values[1..] {
            let first = values[0].2;
            // The noise of each record is its own: 3.5 standard deviations of the difference, one in two
            // thousand.
            let scatter = value.u.hypot(first.u);
            assert!(
                (value.value - first.value).abs() < 3.5 * scatter,
                "{name} at {rate_hz} Hz: {value} and {first}"
            );
        }
    }
}
