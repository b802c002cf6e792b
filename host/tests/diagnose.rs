//! The verdicts on records with a hidden effect. Every figure asserted is printed: `cargo test --release -p yawrig
//! --test diagnose -- --nocapture`.

mod hidden;

use hidden::{plant, Outside, Plan, Planted};
use yawrig::criticism::diagnose::{diagnose, Diagnosis, Options, Status};
use yawrig::criticism::effects::Effect;

fn verdict(plan: &Plan) -> (Planted, Diagnosis) {
    let planted = plant(plan);
    let found = diagnose(&planted.record, &Options::default()).expect("a swing");
    (planted, found)
}

fn names(found: &Diagnosis) -> String {
    found.effects.iter().map(|e| e.id()).collect::<Vec<_>>().join("+")
}

fn seeds(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|n| n.parse().ok()).unwrap_or(default)
}

#[test]
fn one_hidden_effect_is_named_and_its_size_found() {
    let per_effect = seeds("YAWRIG_HIDDEN", 1);
    let (mut right, mut total, mut sized, mut sizes, mut modal) = (0, 0, 0, 0, 0);
    let (mut residual_ok, mut held_ok) = (0, 0);
    for (k, effect) in Effect::deterministic().enumerate() {
        for i in 0..per_effect {
            let size = [1.0, 3.0, 0.4][i as usize % 3];
            let seed = 1000 * (k as u64 + 1) + i;
            let plan = Plan { effects: vec![effect], size, seed, ..Plan::default() };
            let (planted, found) = verdict(&plan);
            total += 1;
            let named = found.effects.len() == 1
                && (found.effects[0] == effect
                    || found.indistinguishable.len() == 1
                        && found.indistinguishable[0][1] == effect);
            right += u32::from(named);
            let last = found.steps.last().unwrap();
            residual_ok += u32::from(last.residual_over_noise <= 1.05);
            held_ok += u32::from(last.held_out_over_noise <= 1.10);
            if found.effects == [effect] {
                for (p, truth) in effect.parameters().iter().zip(&planted.effects[0].1) {
                    if p.name == "phi" || p.name == "phase" {
                        continue;
                    }
                    sizes += 1;
                    let q = last.parameters[&format!("{effect}.{}", p.name)];
                    sized += u32::from(q.holds(*truth, 2.0));
                }
                modal += u32::from(
                    found.modal.natural_frequency_rad_s.holds(planted.natural_frequency_rad_s, 2.0),
                ) + u32::from(found.modal.damping_ratio.holds(planted.damping_ratio, 2.0));
            }
            println!(
                "{:<20} size {size:.1}: {:?} {:<30} {:.2} -> {:.3}, held out {:.3} {:?}",
                effect.id(),
                found.status,
                names(&found),
                found.steps[0].residual_over_noise,
                last.residual_over_noise,
                last.held_out_over_noise,
                found.indistinguishable
            );
        }
    }
    println!("named: {right} of {total}; residual at most 1.05 noise: {residual_ok}; held out at most 1.10: {held_ok}");
    println!("coefficients in k = 2: {sized} of {sizes}; wn and zeta: {modal} of {}", 2 * right);
    assert!(right as f64 >= 0.9 * f64::from(total));
}

#[test]
fn random_forcing_is_named_and_its_level_found() {
    let n = seeds("YAWRIG_BUFFETING", 2);
    let (mut right, mut level) = (0, 0);
    for seed in 0..n {
        let size = [1.0, 0.1, 4.0][seed as usize % 3];
        let plan =
            Plan { effects: vec![Effect::Buffeting], size, seed: 80_000 + seed, ..Plan::default() };
        let (planted, found) = verdict(&plan);
        right += u64::from(found.effects == [Effect::Buffeting]);
        let truth = planted.effects[0].1[0];
        let q = found.steps.last().unwrap().parameters.get("buffeting.q").copied();
        level += u64::from(q.is_some_and(|q| q.holds(truth, 2.0)));
        println!(
            "buffeting {truth:.3e}: {:?} {} {q:?} {:.2} -> {:.3}",
            found.status,
            names(&found),
            found.steps[0].residual_over_noise,
            found.steps.last().unwrap().residual_over_noise
        );
    }
    println!("buffeting named: {right} of {n}; level in k = 2: {level}");
    assert_eq!(right, n);
}

#[test]
fn nothing_hidden_is_adequate() {
    let n = seeds("YAWRIG_PLAIN", 8);
    let mut right = 0;
    for seed in 0..n {
        let (_, found) = verdict(&Plan { seed: 90_000 + seed, ..Plan::default() });
        right += u64::from(found.status == Status::Adequate);
        if found.status != Status::Adequate {
            println!("seed {seed}: {:?} {}", found.status, names(&found));
        }
    }
    println!("adequate: {right} of {n}");
    assert_eq!(right, n);
}

#[test]
fn two_hidden_effects_are_both_named_and_nothing_else() {
    let n = seeds("YAWRIG_PAIRS", 4);
    let effects: Vec<Effect> = Effect::deterministic().collect();
    let mut right = 0;
    for i in 0..n as usize {
        let a = effects[i % 12];
        let b = effects[(i % 12 + 1 + (i * 5) % 11) % 12];
        let plan = Plan { effects: vec![a, b], seed: 50_000 + i as u64, ..Plan::default() };
        let (_, found) = verdict(&plan);
        let mut set = found.effects.clone();
        set.sort();
        let mut truth = vec![a, b];
        truth.sort();
        right += u32::from(set == truth);
        println!(
            "{a}+{b}: {:?} {} {:.2} -> {:.3} {:?}",
            found.status,
            names(&found),
            found.steps[0].residual_over_noise,
            found.steps.last().unwrap().residual_over_noise,
            found.indistinguishable
        );
    }
    println!("pairs named exactly: {right} of {n}");
    assert!(f64::from(right) >= 0.5 * n as f64);
}

#[test]
fn what_the_library_lacks_is_unexplained() {
    let n = seeds("YAWRIG_OUTSIDE", 1);
    let (mut right, mut total) = (0, 0);
    for outside in [Outside::Ripple, Outside::Detent, Outside::Jump] {
        for seed in 0..n {
            let plan = Plan { outside: Some(outside), seed: 70_000 + seed, ..Plan::default() };
            let (_, found) = verdict(&plan);
            let residual = found.steps.last().unwrap().residual_over_noise;
            println!("{outside:?}: {:?} {} {residual:.3}", found.status, names(&found));
            total += 1;
            right += u64::from(found.status == Status::Unexplained);
        }
    }
    println!("unexplained: {right} of {total}");
    assert_eq!(right, total);
}
