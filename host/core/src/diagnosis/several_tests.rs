use super::*;
use crate::diagnosis::diagnose::diagnose;
use crate::effects::Terms;
use crate::error::Error;
use crate::motion::simulate::{Grid, Motion};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const WN: f64 = 6.0;
const FRICTION: f64 = 0.05;

/// The readings of a motion about `rest_deg`, with noise of this rms.
fn record(
    seed: u64,
    (step_s, count): (f64, usize),
    motion: &Motion,
    rest_deg: f64,
    noise_deg: f64,
) -> Record {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let grid = Grid { start_s: 0.0, step_s, count, mean_width_s: 0.0 };
    let yaw_rad = motion.readings(&grid);
    let mut noise = || -> f64 { StandardNormal.sample(&mut rng) };
    Record::new(
        format!("{seed}.csv"),
        (0..count).map(|i| grid.time_s(i)).collect(),
        yaw_rad.iter().map(|y| y.to_degrees() + rest_deg + noise_deg * noise()).collect(),
    )
}

/// A release of a model with dry friction, at another amplitude and rest each, the last with a softer spring.
fn release(k: usize, amplitude_deg: f64) -> Record {
    let motion = Motion {
        natural_frequency_rad_s: WN * if k == 2 { 0.9 } else { 1.0 },
        damping_ratio: 0.006,
        yaw_rad: amplitude_deg.to_radians(),
        rate_rad_s: 0.0,
        terms: Terms::new([
            (Effect::CoulombFriction, &[FRICTION][..]),
            (Effect::CubicStiffness, &[-30.0]),
        ]),
    };
    record(k as u64, (0.01, 2000), &motion, 0.4 * k as f64, 0.05)
}

#[test]
fn three_releases_share_their_coefficients_and_not_their_rest() {
    let records = [release(0, 30.0), release(1, 18.0), release(2, 24.0)];
    let found = of_several(&records, &Grouping::default(), &Options::default()).unwrap().diagnosis;
    println!("{:?} {:?} {}", found.status, found.effects, found.sentence);
    // Two of the three rest off the sensor's zero, each where it does.
    let planted = [Effect::StaticOffset, Effect::CoulombFriction, Effect::CubicStiffness];
    for effect in &planted {
        assert!(found.effects.contains(effect), "{effect}");
    }
    assert_eq!(found.effects.len(), planted.len());
    assert_eq!(found.sharing["static_offset"], "each release its own");
    assert_eq!(found.status, Status::Explained);
    assert!(found.sentence.ends_with("is left, no more than the noise"), "{}", found.sentence);
    let last = found.steps.last().unwrap();
    let c = last.parameters["coulomb_friction.c"];
    assert!(c.holds(FRICTION, 3.0) && c.u < 0.03 * FRICTION, "{c}");
    for (k, record) in found.releases.iter().enumerate() {
        assert!((record.rest_angle_deg.unwrap().value - 0.4 * k as f64).abs() < 0.03, "{record:?}");
        assert_eq!(record.parameters["coulomb_friction.c"].value, c.value);
    }
    assert!((found.releases[2].modal.natural_frequency_rad_s.value / WN - 0.9).abs() < 1e-3);
    let held: Vec<f64> = found.steps.iter().map(|s| s.held_out_over_noise).collect();
    assert!(held.windows(2).all(|h| h[1] <= h[0]) && held.last().unwrap() < &1.2, "{held:?}");
}

#[test]
fn one_spring_or_a_coefficient_each_where_asked() {
    let records = [release(0, 30.0), release(1, 18.0)];
    let common = Common { same_rig: true, own: vec![Effect::CoulombFriction] };
    let found =
        of_several(&records, &Grouping::Rig(common), &Options::default()).unwrap().diagnosis;
    let [a, b] = &found.releases[..] else { panic!("two records") };
    assert_eq!(a.modal.natural_frequency_rad_s.value, b.modal.natural_frequency_rad_s.value);
    assert_eq!(
        found.modal.unwrap().natural_frequency_rad_s.value,
        a.modal.natural_frequency_rad_s.value
    );
    assert_ne!(a.parameters["coulomb_friction.c"].value, b.parameters["coulomb_friction.c"].value);
    assert_eq!(found.sharing["coulomb_friction"], "each release its own");
    assert!(!found.steps.last().unwrap().parameters.contains_key("coulomb_friction.c"));
}

/// Cubic stiffness, released at this angle.
fn softening(seed: u64, amplitude_deg: f64, damping_ratio: f64) -> Record {
    let motion = Motion {
        natural_frequency_rad_s: WN,
        damping_ratio,
        yaw_rad: amplitude_deg.to_radians(),
        rate_rad_s: 0.0,
        terms: Terms::new([(Effect::CubicStiffness, &[-25.0][..])]),
    };
    record(seed, (0.02, 1000), &motion, 0.0, 0.1)
}

#[test]
fn laws_that_several_releases_cannot_separate_are_a_group() {
    let odd_square = Effect::OddQuadraticStiffness;
    let near = [softening(1, 12.0, 0.004), softening(2, 11.0, 0.004)];
    let found = of_several(&near, &Grouping::default(), &Options::default()).unwrap().diagnosis;
    println!("{:?} {:?}", found.effects, found.indistinguishable);
    let odd = |pairs: &[[Effect; 2]]| pairs.iter().flatten().any(|e| *e == odd_square);
    assert!(odd(&found.indistinguishable));
    let apart = [softening(3, 35.0, 0.02), softening(4, 15.0, 0.02)];
    let found = of_several(&apart, &Grouping::default(), &Options::default()).unwrap().diagnosis;
    println!("{:?} {:?}", found.effects, found.indistinguishable);
    assert!(found.effects.contains(&Effect::CubicStiffness), "{:?}", found.effects);
    assert!(!odd(&found.indistinguishable), "{:?}", found.indistinguishable);
}

/// Two modes far above the noise and what is no line beside them: one record and two have the same answer.
#[test]
fn two_releases_of_two_modes_are_answered_as_each_alone() {
    let release = |k: u8, size_deg: f64| {
        let time_s: Vec<f64> = (0..4000).map(|k| f64::from(k) * 0.01).collect();
        let mode =
            |t: f64, decay: f64, w: f64, phase: f64| (-decay * t).exp() * (w * t + phase).cos();
        let phase = f64::from(k);
        let yaw_deg = time_s.iter().map(|t| {
            let both = mode(*t, 0.03, WN, 0.0) + 0.4 * mode(*t, 0.15, 14.3, phase);
            size_deg * (both + 0.01 * mode(*t, 0.08, 18.0, 0.0)) + 0.001 * (12989.8 * t * t).sin()
        });
        let yaw_deg = yaw_deg.collect();
        Record::new(format!("{k}.csv"), time_s, yaw_deg)
    };
    let records = [release(0, 12.0), release(1, 8.0)];
    for record in &records {
        let alone =
            diagnose(std::slice::from_ref(record), &Grouping::default(), &Options::default())
                .unwrap()
                .diagnosis;
        assert_eq!(alone.effects, [Effect::SecondMode], "{:?}", alone.status);
    }
    let common = Common { same_rig: true, own: Vec::new() };
    let found =
        of_several(&records, &Grouping::Rig(common), &Options::default()).unwrap().diagnosis;
    println!("{:?} {:?} {}", found.status, found.effects, found.sentence);
    assert_eq!((found.effects, found.status), (vec![Effect::SecondMode], Status::MostlyExplained));
    let w2 = found.steps.last().unwrap().parameters["second_mode.w2"];
    assert!((w2.value / 14.3 - 1.0).abs() < 1e-3, "{w2}");
}

#[test]
fn no_release_at_all_is_an_error() {
    let found = diagnose(&[], &Grouping::default(), &Options::default());
    assert!(matches!(found, Err(Error::NoRelease)));
}
