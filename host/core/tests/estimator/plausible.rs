//! Twenty-five sound campaigns of other rigs: none is refused, one at most is doubted.
//! `cargo test --release -p yawrig-core --test estimator plausible -- --nocapture` prints what is doubted.

use rand::seq::{IndexedRandom, SliceRandom};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use yawrig_core::derivatives::campaign::{AirEntry, Campaign, ModelEntry, ReleaseEntry, RigEntry};
use yawrig_core::derivatives::condition::Identified;
use yawrig_core::derivatives::plausible::{doubts, Doubt};
use yawrig_core::identify::{identify, Method, Settings};
use yawrig_core::record::faults::Facts;
use yawrig_core::record::Record;
use yawrig_rig::{Condition, Effects, End, Rig, Sensor, Spring, Start, SPRINGS};
use yawrig_shared::axis::Axis;

/// One unmodelled effect, in every release or with the wind on.
const EFFECTS: [&str; 12] = [
    "coulomb_friction:c=0.01",
    "quadratic_damping:d=0.05",
    "cubic_damping:c=0.5",
    "cubic_stiffness:k3=4",
    "quadratic_stiffness:k2=1",
    "static_offset:m=0.1",
    "buffeting:q=0.001",
    "sensor_nonlinearity:s=0.03",
    "baseline_drift:d=0.0005",
    "quintic_stiffness:k5=20",
    "power_damping:c=0.02,n=0.5",
    "end_stop:k=40,g=0.2",
];

/// One release before it is made.
struct Planned {
    condition: Condition,
    file: String,
    effects: Effects,
    seed: u64,
}

struct Made {
    campaign: Campaign,
    planned: Vec<Planned>,
    rig: Rig,
    sensor: Sensor,
    start: Start,
    about: String,
}

/// Model and rig in proportion to a length.
fn rig(random: &mut ChaCha8Rng) -> Rig {
    let length_m = random.random_range(0.3f64.ln()..1.6f64.ln()).exp();
    let frontal_area_m2 = length_m * length_m * random.random_range(0.06..0.14);
    let density = random.random_range(80.0..400.0);
    let mid_inertia_kg_m2 = density * length_m.powi(3) * frontal_area_m2 / 12.0;
    let axis_offset_m = length_m * random.random_range(0.06..0.14);
    let gyration_m = length_m * random.random_range(0.17..0.30);
    let front = mid_inertia_kg_m2 * (1.0 + (axis_offset_m / gyration_m).powi(2));
    Rig {
        model: yawrig_shared::derivatives::Model { length_m, frontal_area_m2 },
        air_density_kg_m3: random.random_range(1.1..1.28),
        spring_arm_m: length_m * random.random_range(0.12..0.3),
        axis_offset_m,
        mid_inertia_kg_m2,
        front_inertia_kg_m2: front,
        mechanical_damping_rad_s: random.random_range(0.05..0.2),
    }
}

/// From 4 to 26 rad/s, each pair at least a fifth apart.
fn springs(rig: &Rig, random: &mut ChaCha8Rng) -> Option<Vec<Spring>> {
    let mut springs: Vec<Spring> = Vec::new();
    let mut known: Vec<Spring> = SPRINGS.to_vec();
    known.shuffle(random);
    let count = *[2usize, 3, 4, 5, 6].choose(random)?;
    while springs.len() < count {
        let wn: f64 = random.random_range(5.0f64.ln()..26.0f64.ln()).exp();
        let stiffness_n_per_m = wn * wn * rig.mid_inertia_kg_m2 / (2.0 * rig.spring_arm_m.powi(2));
        let apart = |s: &Spring| (s.stiffness_n_per_m / stiffness_n_per_m).ln().abs() > 0.2;
        if springs.iter().all(apart) {
            let mut spring = known[springs.len()];
            spring.stiffness_n_per_m = stiffness_n_per_m;
            springs.push(spring);
        }
    }
    Some(springs)
}

/// A campaign as an engineer makes one: any size, springs known to 2 % or as they say, few releases or many.
fn sound(seed: u64) -> Option<Made> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let random = &mut random;
    let rig = rig(random);
    let wind_speed_m_s = random.random_range(6.0..20.0);
    let springs = springs(&rig, random)?;
    let repeats = *[1u32, 1, 1, 2, 3].choose(random)?;
    let axes: &[Axis] = if random.random_bool(0.8) { &Axis::BOTH } else { &Axis::BOTH[..1] };
    let text = *EFFECTS.choose(random)?;
    let hidden = match random.random_bool(0.5) {
        true => Effects::new(vec![text.parse().expect(text)]).expect(text),
        false => Effects::default(),
    };
    let only_in_wind = random.random_bool(0.3);
    let mut planned = Vec::new();
    for spring in &springs {
        for axis in axes {
            for speed in [0.0, wind_speed_m_s] {
                let condition = Condition { spring: *spring, axis: *axis, wind_speed_m_s: speed };
                let truth = rig.modal(&condition).ok()?;
                // A wind that nearly overcomes a spring is no campaign.
                if truth.natural_frequency_rad_s < 3.0 {
                    return None;
                }
                for repeat in 0..repeats {
                    let wind = if speed == 0.0 { "off" } else { "on" };
                    let file = format!("{}-{axis}-{wind}-{repeat}.csv", spring.name);
                    let effects = if only_in_wind && speed == 0.0 {
                        Effects::default()
                    } else {
                        hidden.clone()
                    };
                    planned.push(Planned { condition, file, effects, seed: random.random() });
                }
            }
        }
    }
    let mut campaign = describe(&rig, &planned);
    let mut normal = || -> f64 { StandardNormal.sample(random) };
    let says = normal() > 0.0;
    for name in &springs {
        let (deviation, off) = (if says { 0.005 } else { 0.012 }, normal());
        for release in campaign.release.iter_mut().filter(|r| r.spring == name.name) {
            release.spring_stiffness_u_n_per_m =
                says.then_some(deviation * release.spring_stiffness_n_per_m);
            release.spring_stiffness_n_per_m *= 1.0 + deviation * off;
        }
    }
    let sensor = Sensor {
        rate_hz: *[100.0, 200.0, 250.0].choose(random)?,
        noise_deg: *[0.005, 0.02, 0.05, 0.1].choose(random)?,
        adc_step_deg: *[0.0, 0.005, 0.022, 0.088].choose(random)?,
        offset_deg: random.random_range(-3.0..3.0),
        ..Sensor::default()
    };
    let start = Start {
        amplitude_deg: random.random_range(11.0..17.0),
        hold_s: random.random_range(0.5..2.0),
        end: End::After(random.random_range(20.0..45.0)),
    };
    let about = format!(
        "seed {seed}: {:.2} m, {} springs, {repeats} repeats, {} axes, {} by {text}, {sensor:?}",
        rig.model.length_m,
        springs.len(),
        axes.len(),
        if hidden.is_empty() { "not" } else { "moved" }
    );
    Some(Made { campaign, planned, rig, sensor, start, about })
}

fn doubted(made: &Made) -> Vec<Doubt> {
    let found: Vec<(Identified, Facts)> = made
        .planned
        .par_iter()
        .map(|p| {
            let release = made
                .rig
                .release_with(&p.condition, &p.effects, &made.start, &made.sensor, p.seed)
                .expect(&made.about);
            let (time_s, yaw_deg) = release.samples.map(|s| (s.time_s, s.yaw_deg)).unzip();
            let record = Record::new(p.file.clone(), time_s, yaw_deg);
            let found = identify(&record, &[Method::LeastSquares], &Settings::default());
            let found =
                Identified::from_identification(found.expect(&made.about)).expect("an estimate");
            let wn = found.natural_frequency_rad_s.value;
            let facts = Facts::new(&record, found.from_s, found.to_s, wn);
            (found, facts)
        })
        .collect();
    let (identified, facts): (Vec<_>, Vec<_>) = found.into_iter().unzip();
    doubts(&made.campaign, &identified, &facts)
}

/// The campaign's file.
fn describe(rig: &Rig, planned: &[Planned]) -> Campaign {
    let release = planned.iter().map(|p| {
        let spring = (p.condition.spring.name, p.condition.spring.stiffness_n_per_m);
        ReleaseEntry::new(&p.file, spring, p.condition.axis, p.condition.wind_speed_m_s)
    });
    Campaign::new(
        ModelEntry::new("sound", rig.model.length_m, rig.model.frontal_area_m2),
        AirEntry::new(rig.air_density_kg_m3),
        RigEntry::new(rig.spring_arm_m, rig.axis_offset_m),
        release.collect(),
    )
}

/// How many of `count` are refused and how many doubted.
fn judged(first: u64, count: usize) -> (usize, usize) {
    let (mut refused, mut doubtful) = (0, 0);
    for made in (first..).filter_map(sound).take(count) {
        let all = doubted(&made);
        if !all.is_empty() {
            println!("{}", made.about);
        }
        for doubt in &all {
            println!(
                "  {} {}: {} ({})",
                doubt.is_error,
                doubt.kind.name(),
                doubt.message,
                doubt.evidence
            );
        }
        refused += usize::from(all.iter().any(|doubt| doubt.is_error));
        doubtful += usize::from(!all.is_empty());
    }
    println!("{refused} refused, {doubtful} doubted of {count}");
    (refused, doubtful)
}

#[test]
fn twenty_five_sound_campaigns_are_neither_refused_nor_doubted() {
    let (refused, doubtful) = judged(1, 25);
    assert!(refused == 0 && doubtful <= 1, "{refused} refused, {doubtful} doubted");
}

#[test]
fn four_hundred_others_at_full_size() {
    let (refused, doubtful) = judged(20_000, 400);
    assert!(refused == 0 && doubtful <= 16, "{refused} refused, {doubtful} doubted");
}
