//! Laws that the library does not hold, planted by another integrator, measured.
//!
//! More and other cases:
//! `YAWRIG_LAWS=10 YAWRIG_SEED=3 cargo test --release -p yawrig-core --test estimator law:: -- --nocapture`.

use crate::planted_laws::{family, planted, Kind, Planted};
use rayon::prelude::*;
use std::time::Instant;
use yawrig_core::diagnosis::together::Releases;
use yawrig_core::fit::fitting::Structure;
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::law::estimate::{measure, Measured};
use yawrig_core::law::names::{names, Name, Names};
use yawrig_core::quantity::Quantity;

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
    let decay = FreeDecay::from_record(&planted.record).expect("a free decay");
    let begun = Instant::now();
    let releases = Releases::one(&decay);
    let found = measure(&releases, &Structure::default(), &[], true, &|_| {}).expect("a law");
    let seconds = begun.elapsed().as_secs_f64();
    let begun = Instant::now();
    let names = names(&releases, &found).expect("names");
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
    for point in found.tables().total_stiffness() {
        let truth = planted.stiffness(point.at);
        let q = point.moment_rad_s2;
        let ok = (q.value - truth).abs() <= 2.0 * q.u;
        count = (count.0 + usize::from(ok), count.1 + 1);
    }
    for point in found.tables().total_damping() {
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
    /// The right form, and its place among those that this record cannot tell apart.
    fn named(&self) -> Option<(usize, &Name)> {
        let alike = &self.names.ranked[..self.names.indistinguishable];
        let is_right =
            |(_, name): &(usize, &Name)| right(self.planted.kind).contains(&name.effect.id());
        alike.iter().enumerate().find(is_right)
    }

    /// Whether the right form has its exponent or scale within k = 2; `None` where it is not named, or has no
    /// error bar.
    fn is_exact(&self) -> Option<bool> {
        let (number, truth) = self.planted.number()?;
        let (_, q) = self.named()?.1.parameters.iter().find(|(name, _)| name == number)?;
        println!("    {:?} {}: {number} {q}, truth {truth:.6}", self.planted.kind, self.seed);
        q.u.is_finite().then(|| (q.value - truth).abs() <= 2.0 * q.u)
    }

    /// Damping ratio as it was planted, without the law and beside it, where the law is of the rate.
    fn damping_ratios(&self) -> Option<(f64, f64, Quantity)> {
        use Kind::{AsymmetricDamping, PowerDamping, RootDamping, Stribeck};
        let Self { planted, found, .. } = self;
        [RootDamping, PowerDamping, Stribeck, AsymmetricDamping]
            .contains(&planted.kind)
            .then(|| (planted.zeta, found.plain_damping_ratio(), found.damping_ratio()))
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

/// Short of the noise where friction grows with the angle, which no D(r) holds. Seen with three of each kind
/// and YAWRIG_SEED=8: residual 29 of 30, held out 27 of 30, in the band 2067 of 2214, named 27 of 27, all of
/// them first, numbers 23 of 27 (with YAWRIG_SEED=1 and one of each, 7 of 9), memory 6 of 6 and wrongly 0 of
/// 30.
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
    let named = count(&|c| c.named().is_some());
    let first = count(&|c| c.named().is_some_and(|(place, _)| place == 0));
    let exact: Vec<bool> = laws.iter().filter_map(|c| c.is_exact()).collect();
    let right_numbers = exact.iter().filter(|e| **e).count();
    let ratios: Vec<(f64, f64, Quantity)> =
        laws.iter().filter_map(|c| c.damping_ratios()).collect();
    for (truth, plain, found) in &ratios {
        println!("    zeta {truth:.5}: {plain:.5} without the law, {found} beside it");
    }
    let fivefold = |(truth, plain, found): &&(f64, f64, Quantity)| {
        5.0 * (found.value - truth).abs() <= (plain - truth).abs()
    };
    let nearer = ratios.iter().filter(fivefold).count();
    println!("zeta a fifth as far from the truth, or nearer: {nearer} of {}", ratios.len());
    let called = memory.iter().filter(|c| c.names.memory.is_some()).count();
    let wrongly = count(&|c| c.names.memory.is_some());
    println!(
        "{} laws: residual to 1.05 in {residual}, held out to 1.15 in {held_out}; in the band {} of {}; named {named} of {nameable}, {first} of them first, its number within k = 2 in {right_numbers} of {}; memory called so in {called} of {}, wrongly in {wrongly} of {}",
        laws.len(), banded.0, banded.1, exact.len(), memory.len(), laws.len(),
    );
    let share = |part: usize, whole: usize| part as f64 / whole as f64;
    assert!(share(residual, laws.len()) >= 0.85, "residual");
    assert!(share(held_out, laws.len()) >= 0.9, "held out");
    assert!(share(banded.0, banded.1) >= 0.9, "band");
    assert!(share(named, nameable) >= 0.8, "names");
    // Wanted of 85 %; short of it by more than two standard deviations of such a count is no chance.
    let spread = (0.85 * 0.15 / exact.len() as f64).sqrt();
    assert!(share(right_numbers, exact.len()) >= 0.85 - 2.0 * spread, "numbers of the names");
    assert!(share(nearer, ratios.len()) >= 0.75, "damping ratio");
    assert!(share(called, memory.len()) >= 0.8, "memory is called so");
    assert!(wrongly as f64 <= 0.05 * laws.len() as f64, "memory where there is none");
}

/// Two springs, two angles, rests of their own: one law, and the natural frequency and damping ratio of each
/// spring.
///
/// Eight releases: `YAWRIG_RELEASES=8`.
#[test]
fn several_releases_on_two_springs_measure_one_law() {
    several(&[Kind::Quintic]);
}

#[test]
fn several_releases_measure_laws_of_angle_and_rate_at_full_size() {
    several(&[Kind::PowerDamping, Kind::Quintic, Kind::OneSidedSpring]);
}

fn several(kinds: &[Kind]) {
    let (releases, seed) = (number("YAWRIG_RELEASES", 4), number("YAWRIG_SEED", 1));
    let (mut inside, mut of, mut narrower) = (0, 0, 0);
    for &kind in kinds {
        let family = family(kind, seed, releases as usize);
        let decays: Vec<FreeDecay> = family
            .iter()
            .map(|p| FreeDecay::from_record(&p.record).expect("a free decay"))
            .collect();
        let spring = |p: &Planted| usize::from(p.spring > 1.0);
        let all: Vec<_> = decays.iter().zip(&family).map(|(d, p)| (d, spring(p))).collect();
        let all = Releases::new(&all);
        let begun = Instant::now();
        let found = measure(&all, &Structure::default(), &[], true, &|_| {}).expect("a law");
        let measured_s = begun.elapsed().as_secs_f64();
        let names = names(&all, &found).expect("names");
        // Natural frequency and damping ratio of the law are those of the release from the largest angle.
        let is_first = |d: &&FreeDecay| std::ptr::eq(*d, all.first());
        let first = decays.iter().position(|d| is_first(&d)).expect("it is one of them");
        let here = self::inside(&family[first], &found);
        println!(
            "{kind:?}: over noise {:.2} -> {:.3}, held out {:.2} -> {:.3}, in band {} of {}, measured in {measured_s:.1} s, named in {:.1} s",
            found.plain_residual_over_noise, found.residual_over_noise,
            found.plain_held_out_over_noise, found.held_out_over_noise,
            here.0, here.1, begun.elapsed().as_secs_f64() - measured_s,
        );
        for name in names.ranked.iter().take(3) {
            println!(
                "    {} held out {:.3}: {:?}",
                name.effect, name.held_out_over_noise, name.parameters
            );
        }
        assert!(found.residual_over_noise <= 1.05 && found.held_out_over_noise <= 1.15, "{kind:?}");
        let alike = &names.ranked[..names.indistinguishable];
        assert!(alike.iter().any(|name| right(kind).contains(&name.effect.id())), "{kind:?}");
        // wn and zeta are those of small motions, those of the law's curves taken in.
        for (p, [wn, zeta]) in family.iter().zip(&found.modal) {
            println!(
                "    spring {}: wn {wn:.4} of {:.4}, zeta {zeta:.5}",
                p.spring,
                p.wn * p.spring.sqrt()
            );
        }
        let alone = measure(&Releases::one(&decays[0]), &Structure::default(), &[], true, &|_| {});
        let u = |m: &Measured| {
            let all = [m.tables().total_stiffness(), m.tables().total_damping()].concat();
            all.iter().map(|p| p.moment_rad_s2.u).sum::<f64>()
        };
        narrower += usize::from(u(&found) < u(&alone.expect("a law")));
        (inside, of) = (inside + here.0, of + here.1);
    }
    println!(
        "in the band {inside} of {of}; narrower than from one release in {narrower} of {}",
        kinds.len()
    );
    assert!(inside as f64 >= 0.9 * f64::from(of as u32), "band");
    assert!(3 * narrower >= 2 * kinds.len(), "a law from several releases is known better");
}
