//! Refined damping ratios through converters as chips have them: without a table wrong and flagged, with one
//! that was learned from other releases as good as through an ideal one.
//! `cargo test --release -p yawrig-tests --test system linearity -- --nocapture` prints each release.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use yawrig_core::diagnosis::diagnose::{diagnose, Common, Grouping, Options};
use yawrig_core::linearity::{Jumps, Knots, Swings};
use yawrig_core::record::Record;
use yawrig_link::linearity::make;
use yawrig_rig::{Effects, End, Samples, Sensor, Start};
use yawrig_shared::linearity::Table;
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{Flags, LinearityPart, Refined, Reply, Request, PART_KNOTS};
use yawrig_tests::converter::{record, settings, Converter, Release, DEG_PER_COUNT};
use yawrig_tests::desk::Desk;

/// Rests: one from which a swing of 10 deg (120 codes) crosses a wide code, where nothing says what the angle
/// is, and three from which none does.
const RESTS: [f64; 4] = [1480.0, 1834.0, 2048.0, 1000.0];
/// Releases that a table is learned from, and those that are judged; of each rest.
const LEARNED_FROM: usize = 8;
const JUDGED: usize = 12;

fn refined(counts: &[u16], table: Option<&Table>) -> Refined {
    let mut desk = Desk::default();
    assert_eq!(desk.ask(&Request::Configure(settings())), Reply::Done);
    if let Some(table) = table {
        for (index, some) in table.corrections().chunks(PART_KNOTS).enumerate() {
            let (head, at) = (*table.head(), (index * PART_KNOTS) as u16);
            let corrections = some.iter().copied().collect();
            let part = LinearityPart { head, at, corrections };
            assert_eq!(desk.ask(&Request::SetLinearity(part)), Reply::Done);
        }
    }
    desk.play(counts.iter().copied());
    assert_eq!(desk.ask(&Request::EndRelease { after_samples: 0 }), Reply::Done);
    while desk.device.idle() {}
    desk.listen();
    *desk.refined.last().expect("a refined estimate")
}

/// A damping ratio: how far it is off, in its u and relative, its relative u, and whether it is flagged.
struct Off {
    in_u: f64,
    relative: f64,
    u: f64,
    flagged: bool,
}

impl Off {
    fn new(release: &Release, refined: &Refined) -> Self {
        let (value, u) =
            (f64::from(refined.damping_ratio.value), f64::from(refined.damping_ratio.u));
        Self {
            in_u: (value - release.zeta) / u,
            relative: value / release.zeta - 1.0,
            u: u / release.zeta,
            flagged: refined.flags.has(Flags::MISFIT) || refined.flags.has(Flags::WIDENED),
        }
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn with_a_table_of_eight_releases_a_chip_is_as_good_as_an_ideal_converter() {
    let mut found: [Vec<Off>; 3] = Default::default();
    for (chip, rest_code) in (1..).zip(RESTS) {
        let converter = Converter::chip(chip);
        let mut random = ChaCha8Rng::seed_from_u64(100 + chip);
        let mut release = || Release::random(rest_code, &mut random);
        let records: Vec<Record> = (0..LEARNED_FROM)
            .map(|k| {
                let counts = release().counts(&converter, 1000 * chip + k as u64);
                record(&format!("learned-{k}"), &counts)
            })
            .collect();
        let made = make(&records, &settings()).expect("a table").expect("more than noise");
        println!("{rest_code}: {:?}, widest {:?}", made.table.head(), made.widest);
        for k in 0..JUDGED {
            let (release, seed) = (release(), 5000 * chip + k as u64);
            let counts = release.counts(&converter, seed);
            let through = [
                refined(&counts, None),
                refined(&counts, Some(&made.table)),
                refined(&release.counts(&Converter::ideal(), seed), None),
            ];
            for (found, refined) in found.iter_mut().zip(&through) {
                let off = Off::new(&release, refined);
                let flagged = if off.flagged { " flagged" } else { "" };
                let (relative, u) = (100.0 * off.relative, 100.0 * off.u);
                print!("  {:+6.2} u {relative:+8.4} % ± {u:7.4}{flagged}", off.in_u);
                found.push(off);
            }
            println!();
        }
    }
    let [without, with, ideal] = &found;
    let share = |found: &[Off], is: fn(&Off) -> bool| {
        found.iter().filter(|off| is(off)).count() as f64 / found.len() as f64
    };
    let error = |found: &[Off]| median(found.iter().map(|off| off.relative.abs()).collect());
    let u = |found: &[Off]| median(found.iter().map(|off| off.u).collect());
    let within = |off: &Off| off.in_u.abs() <= 3.0;
    for (name, found) in [("without", without), ("with", with), ("ideal", ideal)] {
        println!(
            "{name}: {:.3} beyond 3 u, {:.3} flagged, median error {:.4} %, median u {:.4} %",
            1.0 - share(found, within),
            share(found, |off| off.flagged),
            100.0 * error(found),
            100.0 * u(found)
        );
    }
    // Without a table: flagged, and wrong by much more than noise makes it.
    assert!(share(without, |off| off.flagged) >= 0.9);
    assert!(error(without) > 10.0 * error(ideal));
    // With it: one in forty-eight is what 97 % allow; by chance it is one in 370.
    assert!(share(with, within) >= 0.97);
    let (crossing, clear) = with.split_at(JUDGED);
    assert!(u(clear) <= 3.0 * u(&ideal[JUDGED..]));
    assert!(share(clear, |off| off.flagged) <= 0.05);
    // Across a wide code it is better than without by as much, and less certain.
    assert!(error(crossing) < 0.1 * error(&without[..JUDGED]));
    assert!(u(crossing) < 0.3 * u(&without[..JUDGED]));
    assert!(share(ideal, within) >= 0.97);
}

/// One release through a chip is not explained by any moment, and what is left is said to be the reading's; through
/// an ideal converter nothing is left. A spring's law and friction, which bend a cycle, too, are no jumps.
#[test]
fn a_diagnosis_names_the_jumps_of_a_converter() {
    let mut random = ChaCha8Rng::seed_from_u64(31);
    for (chip, rest_code) in [(1, 1480.0), (2, 2500.0), (3, 1536.0)] {
        let release = Release { zeta: 0.008, ..Release::random(rest_code, &mut random) };
        let through = |converter: &Converter| {
            let record = record("r", &release.counts(converter, chip));
            let grouping = Grouping::Rig(Common { same_rig: true, own: Vec::new() });
            diagnose(&[record], &grouping, &Options::default()).expect("a decay").diagnosis
        };
        let chip = through(&Converter::chip(chip));
        println!("{rest_code}: {:?}, {}", chip.jumps, chip.sentence);
        let jumps = chip.jumps.expect("jumps");
        // The wide code next to its rest: 36 and 60 codes away on the far side of it, or there.
        let wide = if rest_code < 2000.0 { 1536.0 } else { 2560.0 };
        let at_code = jumps.at_deg / (16.0 * DEG_PER_COUNT) + 2048.0;
        assert!((at_code - wide).abs() < 8.0, "{at_code}");
        assert!(chip.sentence.ends_with("no moment does that"), "{}", chip.sentence);
        let ideal = through(&Converter::ideal());
        assert!(ideal.jumps.is_none() && !ideal.lacks_more(), "{}", ideal.sentence);
    }
    let start = Start { amplitude_deg: 15.0, hold_s: 1.0, end: End::After(60.0) };
    for effect in
        ["cubic_stiffness:k3=60", "coulomb_friction:c=0.05", "odd_quadratic_stiffness:k=5"]
    {
        let effects = Effects::new(vec![effect.parse().expect("an effect")]).expect("one");
        let truth = Modal { natural_frequency_rad_s: 8.0, damping_ratio: 0.01 };
        let sensor = Sensor { noise_deg: 0.02, adc_step_deg: 0.0, ..Sensor::default() };
        let samples =
            Samples::with_effects(&truth, &effects, &start, &sensor, 5).expect("a release");
        let (time_s, yaw_deg) = samples.map(|s| (s.time_s, s.yaw_deg)).unzip();
        assert_eq!(Jumps::of_reading(&Record::new("r", time_s, yaw_deg)), None, "{effect}");
    }
}

/// An ideal converter is not corrected, and neither is a spring that stiffens with the angle taken for one.
#[test]
fn noise_and_a_stiff_spring_are_no_converter_s_error() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let records: Vec<Record> = (0..4)
        .map(|k| {
            let release = Release::random(2048.0, &mut random);
            record(&format!("ideal-{k}"), &release.counts(&Converter::ideal(), k))
        })
        .collect();
    assert!(make(&records, &settings()).expect("it can be learned").is_none());

    // A frequency that changes by a percent from 15 deg to none: what the spring does to the shape of a cycle
    // would be taken for an error that makes damping ratios a quarter of a percent wrong.
    let stiff: Vec<Record> = (0..4)
        .map(|k| {
            let truth = Modal { natural_frequency_rad_s: 8.0 + k as f64, damping_ratio: 0.01 };
            let wn2 = truth.natural_frequency_rad_s.powi(2);
            let k3 = 0.01 * 8.0 / 3.0 * wn2 / 15_f64.to_radians().powi(2);
            let end = End::Below { amplitude_deg: 0.7, at_most_s: 60.0 };
            let start = Start { amplitude_deg: 15.0, hold_s: 1.0, end };
            let sensor = Sensor { noise_deg: 0.02, adc_step_deg: 0.0, ..Sensor::default() };
            let effect = format!("cubic_stiffness:k3={k3}").parse().expect("an effect");
            let effects = Effects::new(vec![effect]).expect("one");
            let samples =
                Samples::with_effects(&truth, &effects, &start, &sensor, k).expect("a release");
            let (time_s, yaw_deg) = samples.map(|s| (s.time_s, s.yaw_deg)).unzip();
            Record::new(format!("stiff-{k}"), time_s, yaw_deg)
        })
        .collect();
    let knots = Knots { first_deg: -16.0, step_deg: 0.25, count: 129 };
    let learned = Swings::new(&stiff).expect("releases").learn(knots, 10.0).expect("a table");
    println!(
        "{:.4} % of damping, u {:.4} %, frequency {:.3} %",
        100.0 * learned.damping_error,
        100.0 * learned.damping_u,
        100.0 * learned.frequency_change
    );
    // Half a cycle after it was let go the amplitude is 14.5 deg.
    assert!((learned.frequency_change / 0.0094 - 1.0).abs() < 0.1, "{}", learned.frequency_change);
    assert!(learned.damping_error.abs() < 2.0 * learned.damping_u, "{learned:?}");
    assert!(learned.damping_u < 0.001);
}
