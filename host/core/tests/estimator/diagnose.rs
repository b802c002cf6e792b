//! The verdicts on records with a hidden effect. Every figure asserted is printed:
//! `cargo test --release -p yawrig-core --test estimator diagnose -- --nocapture`. Chance is fixed by the
//! seeds; YAWRIG_SEED moves all of them, and YAWRIG_HIDDEN, YAWRIG_PLAIN, YAWRIG_PAIRS, YAWRIG_FAR and
//! YAWRIG_OUTSIDE say how many of each.

#[path = "hidden/detectable.rs"]
mod detectable;
#[path = "hidden/faint.rs"]
mod faint;
#[path = "hidden/least.rs"]
mod least;

use crate::hidden::{hidden, number, plant, Outside, Plan, Planted};
use rayon::prelude::*;
use std::slice::from_ref;
use yawrig_core::diagnosis::diagnose::{diagnose, Diagnosis, Grouping, Options, Status};
use yawrig_core::effects::Effect;

struct Case {
    plan: Plan,
    planted: Planted,
    found: Diagnosis,
    seconds: f64,
}

fn cases(plans: Vec<Plan>) -> Vec<Case> {
    cases_of(plans, number("YAWRIG_SEED", 0))
}

fn cases_of(plans: Vec<Plan>, shift: u64) -> Vec<Case> {
    plans
        .into_par_iter()
        .map(|mut plan| {
            plan.seed += 1_000_000 * shift;
            let planted = plant(&plan);
            let begin = std::time::Instant::now();
            let found =
                diagnose(from_ref(&planted.record), &Grouping::default(), &Options::default())
                    .expect("a free decay")
                    .diagnosis;
            Case { plan, planted, found, seconds: begin.elapsed().as_secs_f64() }
        })
        .collect()
}

/// Whether two standard uncertainties of every number of a named effect, phases apart, reach to zero.
pub fn names_what_may_be_zero(found: &Diagnosis) -> bool {
    let numbers = &found.steps.last().expect("a step").parameters;
    let is_known = |effect: &Effect| {
        let sizes = effect.parameters().iter().filter(|p| p.name != "phi" && p.name != "phase");
        sizes.map(|p| numbers[&format!("{effect}.{}", p.name)]).any(|q| !q.holds(0.0, 2.0))
    };
    found.effects.iter().any(|e| !e.is_random() && !is_known(e))
}

impl Case {
    fn names(&self) -> String {
        self.found.effects.iter().map(|e| e.id()).collect::<Vec<_>>().join("+")
    }

    /// Every planted effect named, or one declared indistinguishable from it; nothing else.
    fn names_all(&self) -> bool {
        let (found, truth) = (&self.found.effects, &self.plan.effects);
        let stands_for = |named: &Effect, planted: &Effect| {
            let pairs = self.found.indistinguishable.iter().filter(|pair| pair.contains(named));
            let others: Vec<&Effect> = pairs.flatten().filter(|e| *e != named).collect();
            named == planted || others == [planted]
        };
        found.len() == truth.len() && truth.iter().all(|t| found.iter().any(|f| stands_for(f, t)))
    }

    fn names_what_may_be_zero(&self) -> bool {
        names_what_may_be_zero(&self.found)
    }

    fn last_over_true_noise(&self) -> f64 {
        let last = self.found.steps.last().expect("a step");
        last.residual_over_noise * self.noise_ratio()
    }

    /// Estimated over true noise of the means.
    fn noise_ratio(&self) -> f64 {
        self.found.mean_noise_deg.to_radians() / self.planted.noise_rad
    }

    fn print(&self) {
        let last = self.found.steps.last().expect("a step");
        println!(
            "seed {} {:?}: {:?} [{}] {:.2} -> {:.3}, held out {:.3}, noise {:.3} of the true, {:?}, {:.1} s\n      {}",
            self.plan.seed,
            self.plan.outside,
            self.found.status,
            self.names(),
            self.found.steps[0].residual_over_noise,
            last.residual_over_noise,
            last.held_out_over_noise,
            self.noise_ratio(),
            self.found.indistinguishable,
            self.seconds,
            self.planted.described,
        );
    }
}

/// How many of `cases` the planted numbers and modal values lie in their k = 2 intervals, of how many.
fn coverage(cases: &[Case]) -> [(usize, usize); 2] {
    let (mut sizes, mut modal) = ((0, 0), (0, 0));
    for case in cases.iter().filter(|c| c.plan.effects == c.found.effects) {
        let last = case.found.steps.last().expect("a step");
        for (effect, truth) in &case.planted.effects {
            for (p, truth) in effect.parameters().iter().zip(truth) {
                // The model's clock starts at the release that is found, not at the true one.
                if p.name == "phi" || p.name == "phase" {
                    continue;
                }
                let q = last.parameters[&format!("{effect}.{}", p.name)];
                let inside = q.holds(*truth, 2.0);
                sizes = (sizes.0 + usize::from(inside), sizes.1 + 1);
                if !inside {
                    println!("seed {} {effect}.{}: {truth:.5} found {q:?}", case.plan.seed, p.name);
                }
            }
        }
        let truth = [case.planted.natural_frequency_rad_s, case.planted.damping_ratio];
        let found = [
            case.found.modal.unwrap().natural_frequency_rad_s,
            case.found.modal.unwrap().damping_ratio,
        ];
        for (truth, q) in truth.into_iter().zip(found) {
            let inside = q.holds(truth, 2.0);
            modal = (modal.0 + usize::from(inside), modal.1 + 1);
            if !inside {
                println!(
                    "seed {} {:?} modal: {truth:.5} found {q:?}",
                    case.plan.seed, case.plan.effects
                );
            }
        }
    }
    [sizes, modal]
}

/// Each effect but the flexible ones, of any amplitude. The short test of single effects is in `same_answer`: every
/// effect on a rig drawn alike, from 16 deg.
#[test]
fn one_hidden_effect_is_named_and_its_size_found_at_full_size() {
    let n = number("YAWRIG_HIDDEN", 14);
    let plan = |i: u64| Plan {
        effects: vec![hidden()[i as usize % hidden().len()].clone()],
        seed: 10_000 + i,
        ..Plan::default()
    };
    let cases = cases((0..n).map(plan).collect());
    let right = cases.iter().filter(|c| c.names_all() && c.found.status == Status::Explained);
    let right = right.count();
    cases
        .iter()
        .filter(|c| !c.names_all() || c.found.status != Status::Explained)
        .for_each(Case::print);
    let last = |c: &Case| c.found.steps.last().expect("a step").clone();
    let residual = cases.iter().filter(|c| last(c).residual_over_noise <= 1.05).count();
    let held_out = cases.iter().filter(|c| last(c).held_out_over_noise <= 1.10).count();
    let [sizes, modal] = coverage(&cases);
    println!("one effect named: {right} of {n}; residual at most 1.05: {residual}; held out at most 1.10: {held_out}");
    println!("numbers in k = 2: {sizes:?}; wn and zeta: {modal:?}");
    let slowest = cases.iter().map(|c| c.seconds).fold(0.0, f64::max);
    println!("slowest {slowest:.1} s");
    assert!(right as f64 >= 0.9 * n as f64);
    assert!(!cases.iter().any(Case::names_what_may_be_zero));
}

/// What bends to much is named where simple effects leave more than they should; where they do as well, they
/// stand.
#[test]
fn a_flexible_effect_is_named_where_simple_ones_do_not_explain() {
    let n = number("YAWRIG_FLEXIBLE", 4);
    let all: Vec<Effect> = Effect::ALL.into_iter().filter(Effect::is_flexible).collect();
    let plan = |i: u64| Plan {
        effects: vec![all[i as usize % all.len()].clone()],
        seed: 30_000 + i,
        ..Plan::default()
    };
    let cases = cases((0..n).map(plan).collect());
    cases.iter().filter(|c| !c.names_all()).for_each(Case::print);
    let named = cases.iter().filter(|c| c.names_all()).count();
    let simple = |c: &&Case| !c.names_all() && c.found.status == Status::Explained;
    let simple = cases.iter().filter(simple).count();
    println!("flexible effects named: {named} of {n}; explained by simple ones: {simple}");
    assert!(4 * named as u64 >= 3 * n && named + simple >= n as usize - 1);
}

#[test]
fn nothing_hidden_is_adequate() {
    let n = number("YAWRIG_PLAIN", 5);
    let cases = cases((0..n).map(|i| Plan { seed: 90_000 + i, ..Plan::default() }).collect());
    let wrong: Vec<&Case> = cases.iter().filter(|c| c.found.status != Status::Adequate).collect();
    wrong.iter().for_each(|c| c.print());
    let [_, modal] = coverage(&cases);
    println!("adequate: {} of {n}; wn and zeta in k = 2: {modal:?}", n as usize - wrong.len());
    assert!(wrong.len() as f64 <= 0.05 * n as f64);
}

fn pair(i: u64, shift: u64) -> Plan {
    let seed = 50_000 + i + 1_000_000 * shift;
    let i = i as usize;
    let (a, b) = (i % 13, (i % 13 + 1 + (i / 13 + 5 * i) % 12) % 13);
    Plan { effects: [a, b].map(|k| hidden()[k].clone()).to_vec(), seed, ..Plan::default() }
}

/// Dry friction under random forcing, twice; free play under it, twice; friction and damping in noise that
/// the swing hides; forcing that shows once the damping is known; a mode that outlasts the motion which dry
/// friction stops; friction that holds the model for less than a step. Chosen by their seeds, which nothing
/// moves.
#[test]
fn pairs_of_which_one_hides_the_other_are_named() {
    let hiding = [(22, 3), (22, 7), (9, 17), (9, 101), (2, 7), (15, 11), (10, 101), (39, 29)];
    let cases = cases_of(hiding.map(|(i, s)| pair(i, s)).to_vec(), 0);
    let right = |c: &&Case| c.names_all() && c.found.status == Status::Explained;
    cases.iter().filter(|c| !right(c)).for_each(Case::print);
    let right = cases.iter().filter(right).count();
    println!("hiding pairs named exactly: {right} of {}", cases.len());
    assert!(right >= 7);
}

#[test]
fn two_hidden_effects_are_both_named_and_nothing_else() {
    let n = number("YAWRIG_PAIRS", 6);
    let cases = cases((0..n).map(|i| pair(i, 0)).collect());
    let right = cases.iter().filter(|c| c.names_all() && c.found.status == Status::Explained);
    let right = right.count();
    cases
        .iter()
        .filter(|c| !c.names_all() || c.found.status != Status::Explained)
        .for_each(Case::print);
    println!("pairs named exactly: {right} of {n}");
    assert!(right as f64 >= 0.8 * n as f64);
    assert!(!cases.iter().any(Case::names_what_may_be_zero));
}

/// As far from the noise as measured records are, where pieces of them show nothing that follows time.
#[test]
fn pairs_far_from_the_noise_are_both_named() {
    let n = number("YAWRIG_FAR", 4);
    // What takes energy out ends the motion before it is so far off, and forcing outgrows it.
    let no_swing = [
        Effect::CoulombFriction,
        Effect::QuadraticDamping,
        Effect::CubicDamping,
        Effect::HarmonicForcing,
        Effect::Buffeting,
    ];
    let reaches = |plan: &Plan| !plan.effects.iter().any(|e| no_swing.contains(e));
    let far = |i: u64| Plan { far: true, ..pair(i, 0) };
    let cases = cases((0..).map(far).filter(reaches).take(n as usize).collect());
    let right = |c: &&Case| c.names_all() && c.found.status == Status::Explained;
    cases.iter().filter(|c| !right(c)).for_each(Case::print);
    let right = cases.iter().filter(right).count();
    let slowest = cases.iter().map(|c| c.seconds).fold(0.0, f64::max);
    println!("far pairs named exactly: {right} of {n}; slowest {slowest:.1} s");
    // Of sixty, drawn with seeds 0 and 1, 58 are: of four all.
    assert!(right as f64 >= 0.8 * n as f64);
}

/// Free play under a drift of which the earlier part does not tell enough; forcing beside free play, to whose
/// quick simulation a third effect makes up. Chosen by their seeds, which nothing moves.
#[test]
fn far_pairs_are_told_to_the_noise_of_the_record() {
    let far = |(i, shift): (u64, u64)| Plan { far: true, ..pair(i, shift) };
    let cases = cases_of([(21, 1), (7, 2)].map(far).to_vec(), 0);
    cases.iter().for_each(Case::print);
    assert!(cases.iter().all(|c| c.names_all() && c.found.status == Status::Explained));
}

#[test]
fn what_the_library_lacks_is_unexplained() {
    let n = number("YAWRIG_OUTSIDE", 4);
    let plan = |i: u64| {
        let outside = Outside::ALL[i as usize % Outside::ALL.len()];
        Plan { outside: Some(outside), seed: 70_000 + i, ..Plan::default() }
    };
    let cases = cases((0..n).map(plan).collect());
    // Random forcing is judged one step ahead, and is no explanation of a definite law.
    let random = |c: &Case| c.found.effects.contains(&Effect::Buffeting);
    let counted = |c: &Case| random(c) || c.last_over_true_noise() > 1.1;
    let total = cases.iter().filter(|c| counted(c)).count();
    // Mostly explained says what is left, and claims no more.
    let owned = |c: &Case| matches!(c.found.status, Status::Unexplained | Status::MostlyExplained);
    let wrong: Vec<&Case> = cases.iter().filter(|c| counted(c) && !owned(c)).collect();
    wrong.iter().for_each(|c| c.print());
    println!(
        "unexplained: {} of {total}; {} more explained to 1.1 times the noise",
        total - wrong.len(),
        n as usize - total
    );
    assert!(wrong.len() as f64 <= 0.2 * total as f64);
}
