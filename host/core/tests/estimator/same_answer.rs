//! The same effect asked in four ways: of one release, of two repeats of other amplitudes, of a model's two
//! records, and of a campaign of the two. Every figure asserted is printed:
//! `cargo test --release -p yawrig-core --test estimator same_answer -- --nocapture`. YAWRIG_SEED moves the
//! rigs that are drawn, YAWRIG_ONLY names an effect. At full size every effect is asked in all four ways,
//! else of one release, and every other effect in the next of the others, too: each of these four times or three.

use crate::diagnose::names_what_may_be_zero;
use crate::hidden::laws::{draw, Law};
use crate::hidden::{scaled, simulate, Setup};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use yawrig_core::derivatives::campaign::Campaign;
use yawrig_core::diagnosis::diagnose::{diagnose, Common, Diagnosis, Grouping, Options, Status};
use yawrig_core::effects::Effect;
use yawrig_core::record::Record;

/// Released from, deg.
const AMPLITUDES_DEG: [f64; 2] = [16.0, 12.0];

/// Two releases of one rig with `effect` of a size at which the plain model leaves 2.5 to 20 times the noise
/// of the first.
fn releases(effect: &Effect, seed: u64) -> [Record; 2] {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    loop {
        let [first, second] = {
            let setup = Setup::draw(&mut rng);
            AMPLITUDES_DEG.map(|deg| {
                let mut setup = setup.clone();
                setup.amplitude = deg.to_radians();
                setup
            })
        };
        let law = Law::Known(effect.clone(), draw(effect.clone(), &first, &mut rng));
        let target = rng.random_range(2.5f64.ln()..20f64.ln()).exp();
        let Some(law) = scaled(&first, law, target, rng.random()) else { continue };
        let law = [law];
        let mut record = |setup: &Setup| simulate(setup, &law, rng.random());
        let planted = [record(&first), record(&second)];
        println!("{}", planted[0].described);
        return planted.map(|p| p.record);
    }
}

/// Both with the wind off.
fn campaign() -> Campaign {
    toml::from_str(
        r#"
        schema_version = 1
        model = { name = "planted", length_m = 0.625, frontal_area_m2 = 0.022 }
        air = { density_kg_m3 = 1.2 }
        rig = { spring_arm_m = 0.1, axis_offset_m = 0.1 }
        stiffness_n_per_m = { K1 = 100.0 }
        release = [
            { file = "a.csv", spring = "K1", axis = "mid", wind_speed_m_s = 0.0 },
            { file = "b.csv", spring = "K1", axis = "mid", wind_speed_m_s = 0.0 },
        ]
        "#,
    )
    .unwrap()
}

/// And how long it took, s.
type Answer = (Diagnosis, f64);

/// The four ways, of which the first is asked and `others`.
fn asked(records: &[Record; 2], others: &[usize]) -> Vec<(&'static str, Answer)> {
    let options = Options::default();
    let ask = |records: &[Record], grouping: Grouping| {
        let begin = std::time::Instant::now();
        let found = diagnose(records, &grouping, &options).unwrap().diagnosis;
        (found, begin.elapsed().as_secs_f64())
    };
    let one = || ask(&records[..1], Grouping::default());
    let several = |same_rig| ask(records, Grouping::Rig(Common { same_rig, ..Common::default() }));
    let made = || ask(records, Grouping::Campaign(&campaign()));
    let ways: [(&str, &dyn Fn() -> Answer); 3] =
        [("two", &|| several(true)), ("model", &|| several(false)), ("campaign", &made)];
    let asked = others.iter().map(|k| (ways[*k].0, ways[*k].1()));
    std::iter::once(("one", one())).chain(asked).collect()
}

/// Whether `effect` alone is named, or what the record cannot tell from it.
fn is_right(effect: &Effect, (found, _): &Answer) -> bool {
    let [only] = &found.effects[..] else { return false };
    let stands_for = |pair: &[Effect; 2]| pair.contains(only) && pair.contains(effect);
    found.status == Status::Explained
        && (only == effect || found.indistinguishable.iter().any(stands_for))
}

#[test]
fn an_effect_is_named_the_same_asked_in_two_ways() {
    named_the_same(false);
}

#[test]
fn an_effect_is_named_the_same_asked_in_all_four_ways_at_full_size() {
    named_the_same(true);
}

/// A spring that no model of the library is, dry friction and a sensor that was not zeroed, by steps of
/// Runge and Kutta, read every 10 ms.
fn ripple() -> Record {
    let (wn, h) = (8.0, 0.0005);
    let moment = |b: f64, r: f64| {
        let spring = -wn * wn * (b - 0.003 * (12.0 * b).sin()) - 20.0 * b * b;
        spring - 2.0 * 0.003 * wn * r - 0.03 * (r / 0.001).tanh()
    };
    let (mut b, mut r) = (50f64.to_radians(), 0.0);
    let (mut time_s, mut yaw_deg) = (Vec::new(), Vec::new());
    for k in 0..80_000u32 {
        if k % 20 == 0 {
            let n = k / 20;
            time_s.push(h * f64::from(k));
            yaw_deg.push(b.to_degrees() - 3.0 + 0.02 * (3.88 * f64::from(n * n % 997)).sin());
        }
        let [mut db, mut dr] = [0.0, 0.0];
        let (mut kb, mut kr) = (0.0, 0.0);
        for (part, weight) in [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
            let (bb, rr) = (b + part * h * kb, r + part * h * kr);
            (kb, kr) = (rr, moment(bb, rr));
            db += weight * kb / 6.0;
            dr += weight * kr / 6.0;
        }
        (b, r) = (b + h * db, r + h * dr);
    }
    Record::new("whole", time_s, yaw_deg)
}

/// Far from the noise nothing explains it. Parted in two and asked as two releases of one rig, from a large
/// angle and from a small one, it has what it has as a whole, or what is planted besides.
#[test]
fn a_record_that_is_parted_in_two_is_answered_as_the_whole() {
    let whole = ripple();
    let part = |name: &str, range: std::ops::Range<usize>| {
        Record::new(name, whole.time_s[range.clone()].to_vec(), whole.yaw_deg[range].to_vec())
    };
    let half = whole.len() / 2;
    let parts = [part("first", 0..half), part("second", half..whole.len())];
    let options = Options::default();
    let common = Common { same_rig: true, ..Common::default() };
    let of = |records: &[Record], grouping: Grouping| {
        diagnose(records, &grouping, &options).unwrap().diagnosis
    };
    let one = of(&[whole], Grouping::default());
    let two = of(&parts, Grouping::Rig(common));
    println!("one {:?} {:?}, two {:?} {:?}", one.status, one.effects, two.status, two.effects);
    let planted = [Effect::StaticOffset, Effect::QuadraticStiffness, Effect::CoulombFriction];
    assert_eq!([one.status, two.status], [Status::MostlyExplained; 2]);
    assert!(one.effects.iter().all(|e| two.effects.contains(e)));
    assert!(two.effects.iter().all(|e| planted.contains(e)));
    let wn = two.modal.expect("one rig").natural_frequency_rad_s;
    let of_one = one.modal.expect("one rig").natural_frequency_rad_s;
    assert!((wn.value - of_one.value).abs() < 2.0 * wn.u.hypot(of_one.u), "{wn}, {of_one}");
}

/// A stop that one release does not tell from free play. Chosen by its seed, which nothing moves.
#[test]
fn a_stop_is_named_by_two_releases_that_neither_names() {
    let k = Effect::ALL.into_iter().filter(|e| !alike(e)).position(|e| e == Effect::EndStop);
    let records = releases(&Effect::EndStop, 29_000 + k.expect("of the library") as u64);
    let answers = asked(&records, &[0]);
    for (way, (found, seconds)) in &answers {
        println!("{way} {:?} {:?} {seconds:.1} s", found.status, found.effects);
    }
    assert!(is_right(&Effect::EndStop, &answers[1].1));
}

/// Below 20 deg a pendulum is a cube, and |b| b is as near to both.
fn alike(effect: &Effect) -> bool {
    [Effect::PendulumGravity, Effect::OddQuadraticStiffness].contains(effect)
}

fn named_the_same(in_all_ways: bool) {
    let seed = std::env::var("YAWRIG_SEED").map_or(1, |s| s.parse().unwrap());
    let only = std::env::var("YAWRIG_ONLY").ok();
    let effects = Effect::ALL.into_iter().filter(|e| !alike(e));
    let (mut right, mut same, mut count, mut asked_in_all) = (0, 0, 0, 0);
    for (k, effect) in effects.enumerate() {
        if only.as_ref().is_some_and(|only| only != effect.id()) {
            continue;
        }
        let others: &[usize] = match k {
            _ if in_all_ways => &[0, 1, 2],
            _ if k % 2 == 0 => &[k % 3],
            _ => &[],
        };
        let answers = asked(&releases(&effect, 1000 * seed + k as u64), others);
        let are_right: Vec<bool> =
            answers.iter().map(|(_, answer)| is_right(&effect, answer)).collect();
        asked_in_all += answers.len();
        right += are_right.iter().filter(|r| **r).count();
        same += usize::from(are_right.iter().all(|r| *r));
        count += 1;
        println!("{effect}");
        for ((way, (found, seconds)), is_right) in answers.iter().zip(are_right) {
            let mark = if is_right { "ok" } else { "NO" };
            let (status, names, pairs) = (found.status, &found.effects, &found.indistinguishable);
            println!("  {mark} {way} {status:?} {names:?} {pairs:?} {seconds:.1} s");
        }
        assert!(!names_what_may_be_zero(&answers[0].1 .0), "{effect}");
    }
    println!("right {right} of {asked_in_all}, in all ways {same} of {count}");
    // Of 84 effects, drawn with seeds 1 to 4, six are not named for what they are in all ways: two of 72, their
    // course being another's, and four of the twelve stops at both ends or that take energy out, beside or in
    // place of which another stop is named. Of 21 two at most, as a rule.
    assert!(same + 2 >= count, "in all ways {same} of {count}");
}
