//! At which strength each effect of the library is first named in half of the records, in units of the least
//! that a likelihood-ratio test which knew the effect could detect:
//! `YAWRIG_RIGS=10 cargo test --release -p yawrig-core --test estimator detectable -- --nocapture`, ten rigs
//! each (three else: a line that is drawn at a harmonic of its rig is refused however strong).

use super::least::ladder;
use super::number;
use crate::hidden::Plan;
use rayon::prelude::*;
use std::slice::from_ref;
use yawrig_core::diagnosis::diagnose::{diagnose, Diagnosis, Grouping, Options};
use yawrig_core::effects::Effect;

const STRENGTHS: [f64; 8] = [1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 16.0];
/// At the latest at this strength an effect is named; not one that bends to what simpler ones do.
const LATEST: f64 = 4.0;

/// Whether `effect`, or one that is said to do as well, is in the answer.
fn is_named(effect: &Effect, found: &Diagnosis) -> bool {
    found.effects.contains(effect) || found.indistinguishable.iter().any(|g| g.contains(effect))
}

/// Where the share named, which a stronger effect cannot lower, passes a half.
fn half(shares: &[f64]) -> Option<f64> {
    let rising: Vec<f64> = shares
        .iter()
        .scan(0.0, |most, share| {
            *most = f64::max(*most, *share);
            Some(*most)
        })
        .collect();
    let k = rising.iter().position(|share| *share >= 0.5)?;
    let Some(before) = k.checked_sub(1) else { return Some(STRENGTHS[0]) };
    let part = (0.5 - rising[before]) / (rising[k] - rising[before]);
    Some(STRENGTHS[before] * (STRENGTHS[k] / STRENGTHS[before]).powf(part))
}

#[test]
fn detectable_at_full_size() {
    let rigs = number("YAWRIG_RIGS", 3);
    let alike = [Effect::PendulumGravity, Effect::OddQuadraticStiffness];
    let effects: Vec<Effect> = Effect::ALL.into_iter().filter(|e| !alike.contains(e)).collect();
    println!(
        "effect; strength at which half are named; share named at {STRENGTHS:?}; others named"
    );
    let mut late = Vec::new();
    for effect in effects {
        let of_rig = |i: u64| -> Vec<(bool, Vec<Effect>)> {
            let seed = 210_000 + i + 1_000_000 * number("YAWRIG_SEED", 0);
            let plan = Plan { effects: vec![effect.clone()], seed, ..Plan::default() };
            let named = |planted: &crate::hidden::Planted| {
                let found =
                    diagnose(from_ref(&planted.record), &Grouping::default(), &Options::default())
                        .expect("a free decay")
                        .diagnosis;
                let others = found.effects.iter().filter(|e| **e != effect).cloned().collect();
                (is_named(&effect, &found), others)
            };
            ladder(&plan, &STRENGTHS).iter().map(named).collect()
        };
        let all: Vec<Vec<(bool, Vec<Effect>)>> = (0..rigs).into_par_iter().map(of_rig).collect();
        let share = |k: usize| all.iter().filter(|rig| rig[k].0).count() as f64 / rigs as f64;
        let shares: Vec<f64> = (0..STRENGTHS.len()).map(share).collect();
        let mut others: Vec<String> = all
            .iter()
            .flatten()
            .filter(|n| !n.0)
            .flat_map(|n| &n.1)
            .map(|e| e.to_string())
            .collect();
        others.sort();
        let count = |e: &String| others.iter().filter(|o| *o == e).count();
        let mut said: Vec<String> = others.iter().map(|e| format!("{e} {}", count(e))).collect();
        said.dedup();
        let half = half(&shares);
        if !effect.is_flexible() && half.is_none_or(|strength| strength > LATEST) {
            late.push(effect.clone());
        }
        let half = half.map_or("above 16".to_owned(), |x| format!("{x:.1}"));
        println!("{:22} {half:>8}  {shares:.2?}  {}", effect.id(), said.join(", "));
    }
    assert!(late.is_empty(), "named above {LATEST} only: {late:?}");
}
