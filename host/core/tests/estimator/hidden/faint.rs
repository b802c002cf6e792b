//! Effects of a quarter to half of the size that is plainly visible, up to three at once, under a sensor of
//! 4096 steps a turn whose noise is correlated by 0.6 from one sample to the next. YAWRIG_FAINT,
//! YAWRIG_FAINT_PAIRS, YAWRIG_FAINT_TRIPLES and YAWRIG_FAINT_PLAIN say how many of each.

use super::{cases, hidden, number, pair, Case};
use crate::hidden::Plan;
use yawrig_core::diagnosis::diagnose::Status;
use yawrig_core::effects::Effect;

fn faint(effects: Vec<Effect>, seed: u64) -> Plan {
    Plan { effects, seed, faint: true, ..Plan::default() }
}

/// How many are named, and nothing else.
fn named(what: &str, plans: Vec<Plan>) -> (usize, usize) {
    let n = plans.len();
    let expected = |c: &Case| match c.plan.effects.is_empty() {
        true => Status::Adequate,
        false => Status::Explained,
    };
    let cases = cases(plans);
    let right = |c: &Case| c.names_all() && c.found.status == expected(c);
    cases.iter().filter(|c| !right(c)).for_each(Case::print);
    let right = cases.iter().filter(|c| right(c)).count();
    let slowest = cases.iter().map(|c| c.seconds).fold(0.0, f64::max);
    println!("faint, {what}: {right} of {n}; slowest {slowest:.1} s");
    (right, n)
}

#[test]
fn one_faint_effect_is_named() {
    let single = |i: u64| faint(vec![hidden()[i as usize % hidden().len()].clone()], 110_000 + i);
    let (right, n) = named("one effect", (0..number("YAWRIG_FAINT", 7)).map(single).collect());
    assert!(right as f64 >= 0.9 * n as f64 - 1.0);
}

#[test]
fn faint_effects_are_named_together() {
    let two = |i: u64| faint(pair(i, 0).effects, 150_000 + i);
    // Random forcing hides what moves less than it does; it is among the pairs.
    let definite: Vec<Effect> = hidden().into_iter().filter(|e| *e != Effect::Buffeting).collect();
    let three = |i: u64| {
        let k = i as usize % 12;
        let set = [k, (k + 4) % 12, (k + 9) % 12].map(|k| definite[k].clone());
        faint(set.to_vec(), 130_000 + i)
    };
    let (twos, n) = named("pairs", (0..number("YAWRIG_FAINT_PAIRS", 3)).map(two).collect());
    assert!(3 * twos >= 2 * n);
    let (threes, n) = named("triples", (0..number("YAWRIG_FAINT_TRIPLES", 2)).map(three).collect());
    assert!(threes as f64 >= 0.8 * n as f64);
}

#[test]
fn a_coarse_sensor_of_coloured_noise_is_no_effect() {
    let plain = |i: u64| faint(Vec::new(), 190_000 + i);
    let (right, n) =
        named("nothing hidden", (0..number("YAWRIG_FAINT_PLAIN", 4)).map(plain).collect());
    assert!(right as f64 >= 0.95 * n as f64);
}
