//! Stops on one side and on both, planted by an integration of its own, diagnosed, measured and named. Every figure asserted
//! is printed: `cargo test --release -p yawrig-core --test estimator contact_by_side -- --nocapture`.

use crate::let_go::let_go;
use std::slice::from_ref;
use yawrig_core::diagnosis::diagnose::{diagnose, Grouping, Options, Status};
use yawrig_core::diagnosis::together::Releases;
use yawrig_core::effects::Effect;
use yawrig_core::fit::fitting::Structure;
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::law::estimate::measure;
use yawrig_core::law::names::names;
use yawrig_core::record::Record;

/// Stiffness over the inertia, 1/s2, and angle, deg; none where it is 0.
struct Stops {
    above: [f64; 2],
    below: [f64; 2],
}

impl Stops {
    fn moment(&self, b: f64) -> f64 {
        let [up, down] = [self.above, self.below].map(|[k, g]| [k, g.to_radians()]);
        -up[0] * (b - up[1]).max(0.0) - down[0] * (b + down[1]).min(0.0)
    }

    /// From 15 deg, 7 rad/s and zeta 0.006.
    fn release(&self, seconds: f64, seed: u64) -> Record {
        let slope = |[b, r]: [f64; 2]| [r, -49.0 * b - 2.0 * 0.006 * 7.0 * r + self.moment(b)];
        let_go([15f64.to_radians(), 0.0], slope, seconds, seed)
    }
}

/// Of ten numbers three or more are outside k = 2 in 1 % of such tests. One that is outside is gl, 3.9 u off,
/// 0.003 deg: more than chance, its u is too small.
#[test]
fn a_stop_on_a_side_is_named_with_its_angle_and_stiffness() {
    let none = [0.0, 0.0];
    let (mut inside, mut count) = (0, 0);
    for (stops, id, seed) in [
        (Stops { above: [40.0, 6.0], below: none }, "stop_above", 11),
        (Stops { above: [40.0, 6.0], below: none }, "stop_above", 1),
        (Stops { above: none, below: [40.0, 6.0] }, "stop_below", 2),
        (Stops { above: [40.0, 6.0], below: [25.0, 9.0] }, "stop_above_and_stop_below", 3),
    ] {
        let decay = FreeDecay::from_record(&stops.release(30.0, seed)).expect("a free decay");
        let releases = Releases::one(&decay);
        let found = measure(&releases, &Structure::default(), &[], true, &|_| {}).expect("a law");
        let names = names(&releases, &found).expect("names");
        let best = &names.ranked[0];
        let planted = [("ku", stops.above[0]), ("gu", stops.above[1].to_radians())];
        let planted = planted
            .into_iter()
            .chain([("kl", stops.below[0]), ("gl", stops.below[1].to_radians())]);
        let text = best.text.as_deref().unwrap_or_default();
        println!(
            "{}: residual over noise {:.3}, held out {:.3}",
            best.effect.id(),
            best.residual_over_noise,
            best.held_out_over_noise
        );
        assert!(best.effect.id() == id && text.contains("moment = \"-k"), "{text}");
        assert!(names.memory.is_none() && best.residual_over_noise <= 1.15, "{}", best.effect);
        for (name, truth) in planted.filter(|p| p.1 != 0.0) {
            let q = best.parameters.iter().find(|p| p.0 == name).expect(name).1;
            println!(
                "  {name} {:.6} ± {:.6}, planted {truth:.6}, off by {:.2} u",
                q.value,
                q.u,
                (q.value - truth) / q.u
            );
            let is_inside = (q.value - truth).abs() <= 2.0 * q.u;
            (inside, count) = (inside + u32::from(is_inside), count + 1);
        }
    }
    assert!(inside + 2 >= count, "{inside} of {count}");
}

/// Of eight numbers two or more are outside k = 2 in 6 % of such tests, three in 0.6 %.
#[test]
fn a_diagnosis_names_the_stop_on_its_side() {
    let none = [0.0, 0.0];
    let (mut inside, mut count) = (0, 0);
    for (above, below, seed) in [
        ([40.0, 6.0], none, 21),
        ([12.0, 9.0], none, 22),
        (none, [40.0, 6.0], 23),
        (none, [150.0, 3.0], 24),
    ] {
        let record = Stops { above, below }.release(30.0, seed);
        let found = diagnose(from_ref(&record), &Grouping::default(), &Options::default()).unwrap();
        let found = found.diagnosis;
        let last = found.steps.last().expect("a step");
        println!("{:?} {:?} {:.3}", found.status, found.effects, last.residual_over_noise);
        assert_eq!(
            (found.status, &found.effects[..]),
            (Status::Explained, &[Effect::OneSidedStop][..])
        );
        let signed = if above == none { [below[0], -below[1]] } else { above };
        for (name, truth) in [("k", signed[0]), ("g", signed[1].to_radians())] {
            let q = last.parameters[&format!("one_sided_stop.{name}")];
            println!(
                "  {name} {:.6} ± {:.6}, off by {:.2} u",
                q.value,
                q.u,
                (q.value - truth) / q.u
            );
            inside += u32::from((q.value - truth).abs() <= 2.0 * q.u);
            count += 1;
        }
    }
    assert!(inside + 2 >= count, "{inside} of {count}");
}
