//! Time stamps as clocks, files and radio links make them, through what reads a record: an answer or a
//! refusal, and never a panic.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;
use std::slice::from_ref;
use yawrig_core::diagnosis::diagnose::{diagnose, Grouping, Options};
use yawrig_core::diagnosis::together::Releases;
use yawrig_core::fit::fitting::{fit_plain, Structure};
use yawrig_core::fit::free_decay::FreeDecay;
use yawrig_core::identify::{identify, Method, Settings};
use yawrig_core::law::estimate::measure;
use yawrig_core::record::Record;

/// Steps in units of the nominal one, and how they are written.
fn stamps(rng: &mut ChaCha8Rng, count: usize, step_s: f64) -> Vec<f64> {
    let kind = rng.random_range(0..6);
    let share = [0.02, 0.1, 0.5][rng.random_range(0..3)];
    let longest: f64 = [3.0, 20.0, 300.0][rng.random_range(0..3)];
    let digits: f64 = [1e3, 1e6][rng.random_range(0..2)];
    let mut t = 0.0;
    let each = (0..count).map(|k| {
        t += step_s
            * match kind {
                // Late rows; pauses one after the other; bursts; equal stamps; all of it.
                0 if rng.random_bool(share) => rng.random_range(1.0..longest),
                1 if k % 40 < 3 => longest,
                2 => [0.01, longest][usize::from(k % 8 == 0)],
                3 if rng.random_bool(share) => 0.0,
                4 => [0.0, 0.3, 1.0, 1.0, longest][rng.random_range(0..5)],
                _ => 1.0,
            };
        (t * digits).round() / digits
    });
    each.collect()
}

fn swing(rng: &mut ChaCha8Rng) -> Record {
    let count = [1, 5, 12, 60, 200, 200][rng.random_range(0..6)];
    let (wn, zeta) = (rng.random_range(1.0..12.0), rng.random_range(0.0..0.05));
    let per_cycle = rng.random_range(4.0..40.0);
    let mut time_s = stamps(rng, count, TAU / wn / per_cycle);
    // As the readers of files leave them: rising.
    time_s.dedup();
    let resting = rng.random_bool(0.1);
    let yaw = |t: &f64| match resting {
        true => 1.0,
        false => 12.0 * (-zeta * wn * t).exp() * (wn * t).cos() + rng.random_range(-0.05..0.05),
    };
    let yaw_deg = time_s.iter().map(yaw).collect();
    Record::new("stamps", time_s, yaw_deg)
}

/// The long ones only where a short look has found a free decay.
#[test]
fn no_stamps_make_it_panic() {
    let methods = [Method::LeastSquares, Method::Conventional, Method::Network];
    let (mut identified, mut decays, mut diagnosed) = (0, 0, 0);
    for seed in 0..1200 {
        let record = swing(&mut ChaCha8Rng::seed_from_u64(seed));
        identified += u32::from(identify(&record, &methods, &Settings::default()).is_ok());
        let Ok(decay) = FreeDecay::from_record(&record) else { continue };
        decays += 1;
        let _ = fit_plain(&decay, false, decay.yaw_rad.len());
        if decays % 40 == 0 {
            let _ = measure(&Releases::one(&decay), &Structure::default(), &[], true, &|_| {});
            let found = diagnose(from_ref(&record), &Grouping::default(), &Options::default());
            diagnosed += u32::from(found.is_ok());
        }
    }
    println!("identified {identified}, free decays {decays}, diagnosed {diagnosed} of 1200");
    assert!(identified > 150 && decays > 150 && diagnosed > 2);
}
