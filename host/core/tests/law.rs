//! Laws that the library does not hold, planted by another integrator, measured.
//!
//! More and other cases: `YAWRIG_LAWS=10 YAWRIG_SEED=3 cargo test --release -p yawrig --test law -- --nocapture`.

mod planted_laws;

use planted_laws::{planted, Kind, Planted};
use rayon::prelude::*;
use std::time::Instant;
use yawrig_core::fit::fitting::Structure;
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::law::estimate::{measure, Measured};
use yawrig_core::law::names::{names, Names};

struct Case {
    planted: Planted,
    seed: u64,
    found: Measured,
    names: Names,
    naming: f64,
    seconds: f64,
    /// Points of both laws inside their k = 2 bands.
    inside: (usize, usize),
}

fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

fn case(kind: Kind, seed: u64) -> Case {
    let planted = planted(kind, seed);
    let decay = FreeDecay::of(&planted.record).expect("a free decay");
    let begun = Instant::now();
    let found = measure(&decay, &Structure::default(), &[], true).expect("a law");
    let seconds = begun.elapsed().as_secs_f64();
    let begun = Instant::now();
    let names = names(&decay, &found).expect("names");
    let naming = begun.elapsed().as_secs_f64();
    let inside = inside(&planted, &found);
    Case { planted, seed, found, names, naming, seconds, inside }
}

/// Points at which the whole restoring moment and the whole dissipation are where the band says.
fn inside(planted: &Planted, found: &Measured) -> (usize, usize) {
    if planted.kind.has_memory() || planted.kind == Kind::GrowingFriction {
        return (0, 0);
    }
    let mut count = (0, 0);
    for point in found.total_stiffness() {
        let truth = planted.stiffness(point.at);
        let q = point.moment_rad_s2;
        let ok = (q.value - truth).abs() <= 2.0 * q.u;
        count = (count.0 + usize::from(ok), count.1 + 1);
    }
    for point in found.total_damping() {
        let truth = planted.damping(point.at);
        let q = point.moment_rad_s2;
        let ok = (q.value - truth).abs() <= 2.0 * q.u;
        count = (count.0 + usize::from(ok), count.1 + 1);
    }
    count
}

/// The formula that was planted, under every name that is right for it.
fn right(kind: Kind) -> &'static [&'static str] {
    match kind {
        Kind::RootDamping | Kind::PowerDamping => &["power_law"],
        Kind::Stribeck => &["stribeck_friction"],
        Kind::EndStop => &["stop"],
        Kind::OneSidedSpring => &["one_sided_spring"],
        Kind::Quintic => &["quintic"],
        Kind::Sine => &["sine"],
        Kind::AsymmetricDamping => &["asymmetric_drag"],
        Kind::PowerStiffness => &["power_stiffness"],
        Kind::GrowingFriction | Kind::BoucWen | Kind::LuGre => &[],
    }
}

impl Case {
    fn is_named(&self) -> bool {
        let alike = &self.names.ranked[..self.names.indistinguishable];
        alike.iter().any(|name| right(self.planted.kind).contains(&name.effect.id()))
    }

    fn print(&self) {
        let Self { planted: p, found, names, .. } = self;
        println!(
            "{:?} {}: wn {:.2}, zeta {:.4}, {:.1} deg, {:.0} s, noise {:.3} deg: over noise {:.2} -> {:.3}, held out {:.2} -> {:.3}, in band {} of {}, {:.2} s; {:?}",
            p.kind, self.seed, p.wn, p.zeta, p.released_deg, p.seconds, p.noise_deg,
            found.plain_residual_over_noise, found.residual_over_noise,
            found.plain_held_out_over_noise, found.held_out_over_noise,
            self.inside.0, self.inside.1, self.seconds, found.law.parts,
        );
        println!(
            "    named in {:.2} s, {} alike, memory {}",
            self.naming,
            names.indistinguishable,
            names.memory.is_some()
        );
        for name in names.ranked.iter().take(3).chain(&names.memory) {
            let numbers: Vec<String> =
                name.parameters.iter().map(|(n, q)| format!("{n} {q}")).collect();
            println!(
                "    {} held out {:.3}, residual {:.3}: {}",
                name.effect,
                name.held_out_over_noise,
                name.residual_over_noise,
                numbers.join(", ")
            );
        }
    }
}

/// Short of the noise where friction grows with the angle, which no D(r) holds, and of memory where bristles are stiff
/// (LuGre). Seen with three of each kind and YAWRIG_SEED=5: residual 29 of 30, held out 28 of 30, in the band 2088 of 2214,
/// named 26 of 27, memory 4 of 6 and wrongly 0 of 30; that seed misses the bar for memory.
#[test]
fn laws_that_the_library_does_not_hold_are_measured_and_named() {
    let (n, seed) = (number("YAWRIG_LAWS", 1), number("YAWRIG_SEED", 1));
    let plan = |kind: Kind| (0..n).map(move |i| (kind, 1000 * seed + i));
    let plans: Vec<(Kind, u64)> = Kind::ALL.into_iter().flat_map(plan).collect();
    let cases: Vec<Case> = plans.into_par_iter().map(|(kind, seed)| case(kind, seed)).collect();
    cases.iter().for_each(Case::print);
    let (memory, laws): (Vec<&Case>, Vec<&Case>) =
        cases.iter().partition(|c| c.planted.kind.has_memory());
    let count = |of: &dyn Fn(&Case) -> bool| laws.iter().filter(|c| of(c)).count();
    let residual = count(&|c| c.found.residual_over_noise <= 1.05);
    let held_out = count(&|c| c.found.held_out_over_noise <= 1.15);
    let banded = laws.iter().fold((0, 0), |s, c| (s.0 + c.inside.0, s.1 + c.inside.1));
    let nameable = count(&|c| !right(c.planted.kind).is_empty());
    let named = count(&Case::is_named);
    let called = memory.iter().filter(|c| c.names.memory.is_some()).count();
    let wrongly = count(&|c| c.names.memory.is_some());
    println!(
        "{} laws: residual to 1.05 in {residual}, held out to 1.15 in {held_out}; in the band {} of {}; named {named} of {nameable}; memory called so in {called} of {}, wrongly in {wrongly} of {}",
        laws.len(), banded.0, banded.1, memory.len(), laws.len(),
    );
    let share = |part: usize, whole: usize| part as f64 / whole as f64;
    assert!(share(residual, laws.len()) >= 0.85, "residual");
    assert!(share(held_out, laws.len()) >= 0.9, "held out");
    assert!(share(banded.0, banded.1) >= 0.9, "band");
    assert!(share(named, nameable) >= 0.8, "names");
    assert!(share(called, memory.len()) >= 0.8, "memory is called so");
    assert!(wrongly as f64 <= 0.05 * laws.len() as f64, "memory where there is none");
}
