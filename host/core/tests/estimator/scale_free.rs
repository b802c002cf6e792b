//! The same record in other units of time and angle has the same answer in these units:
//! `cargo test --release -p yawrig-core --test estimator scale_free -- --nocapture`.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::slice::from_ref;
use yawrig_core::diagnosis::diagnose::{diagnose, Diagnosis, Grouping, Options};
use yawrig_core::effects::Effect;
use yawrig_core::identify::{identify, Method, Settings};
use yawrig_core::record::Record;

/// Dry friction and a hardening spring from 12 deg, held for a second and a half, by steps of 50 us.
fn planted() -> (Vec<f64>, Vec<f64>) {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (wn, zeta, friction, cubic) = (6.0, 0.004, 0.03, 120.0);
    let (mut b, mut r) = (12f64.to_radians(), 0.0);
    let h = 5e-5;
    (0..12_000)
        .map(|k| {
            let time_s = f64::from(k) * 2e-3;
            let noise: f64 = StandardNormal.sample(&mut rng);
            let sample = (time_s, b.to_degrees() + 0.05 * noise);
            for _ in 0..40 {
                if time_s < 1.5 {
                    break;
                }
                let free = r - h * (wn * wn * b + cubic * b * b * b + 2.0 * zeta * wn * r);
                r = if f64::abs(free) <= h * friction {
                    0.0
                } else {
                    free - h * friction * free.signum()
                };
                b += h * r;
            }
            sample
        })
        .unzip()
}

struct Said {
    wn_rad_s: f64,
    zeta: f64,
    diagnosis: Diagnosis,
}

fn said(time_s: Vec<f64>, yaw_deg: Vec<f64>) -> Said {
    let record = Record::new("scaled.csv", time_s, yaw_deg);
    // All of it, wherever its amplitudes are.
    let settings = Settings { from_deg: f64::INFINITY, to_deg: 0.0, ..Settings::default() };
    let found = identify(&record, &[Method::LeastSquares], &settings).unwrap();
    let estimate = &found.estimates[0];
    Said {
        wn_rad_s: estimate.natural_frequency_rad_s.value,
        zeta: estimate.damping_ratio.value,
        diagnosis: diagnose(from_ref(&record), &Grouping::default(), &Options::default())
            .unwrap()
            .diagnosis,
    }
}

#[test]
fn a_record_in_other_units_has_the_same_answer() {
    let (time_s, yaw_deg) = planted();
    let here = said(time_s.clone(), yaw_deg.clone());
    println!("wn {:.5} zeta {:.6} {:?}", here.wn_rad_s, here.zeta, here.diagnosis.effects);
    let mut names = here.diagnosis.effects.clone();
    names.sort();
    assert_eq!(names, [Effect::CoulombFriction, Effect::CubicStiffness]);
    // Times as long, angles as large (and on the other side), seconds later.
    let cases = [
        (0.02, 1.0, 0.0),
        (20.0, 1.0, 0.0),
        (1.0, 0.05, 0.0),
        (1.0, 5.0, 0.0),
        (1.0, -1.0, 0.0),
        (1.0, 1.0, 3000.0),
        (7.0, -0.3, 12.5),
    ];
    for (longer, larger, later_s) in cases {
        let time_s: Vec<f64> = time_s.iter().map(|t| later_s + longer * t).collect();
        let there = said(time_s, yaw_deg.iter().map(|y| larger * y).collect());
        let wn = there.wn_rad_s * longer / here.wn_rad_s - 1.0;
        let zeta = there.zeta / here.zeta - 1.0;
        let modal = there.diagnosis.modal.unwrap().natural_frequency_rad_s;
        let off = (modal.value * longer
            - here.diagnosis.modal.unwrap().natural_frequency_rad_s.value)
            / (modal.u * longer);
        let mut found = there.diagnosis.effects.clone();
        found.sort();
        println!(
            "times {longer} angles {larger} later {later_s} s: wn {wn:+.1e} zeta {zeta:+.1e}, {found:?} wn off by {off:+.3} u"
        );
        assert!(wn.abs() < 1e-6 && zeta.abs() < 1e-4, "identify");
        assert_eq!(found, names);
        assert!(off.abs() < 0.05, "diagnose");
    }
    // Every fourth sample.
    let thin = |all: &[f64]| all.iter().step_by(4).copied().collect::<Vec<f64>>();
    let there = said(thin(&time_s), thin(&yaw_deg));
    let mut found = there.diagnosis.effects.clone();
    found.sort();
    let modal = there.diagnosis.modal.unwrap().natural_frequency_rad_s;
    assert_eq!(found, names);
    assert!(
        modal.holds(here.diagnosis.modal.unwrap().natural_frequency_rad_s.value, 3.0),
        "{modal}"
    );
}
