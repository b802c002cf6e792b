//! The free decay is found without a hint: holds, rests, offsets, wild samples, pushes, catches, odd clocks.

use crate::common;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use yawrig_core::identify::flag::Flag;
use yawrig_core::identify::{identify, Estimate, Identification, Method, Settings};
use yawrig_core::record::Record;

fn record(time_s: Vec<f64>, yaw_deg: Vec<f64>) -> Record {
    Record::new("release.csv", time_s, yaw_deg)
}

fn even(yaw_deg: Vec<f64>, rate_hz: f64) -> Record {
    record((0..yaw_deg.len()).map(|k| k as f64 / rate_hz).collect(), yaw_deg)
}

fn found(record: &Record) -> Identification {
    identify(record, &[Method::LeastSquares], &Settings::default()).unwrap()
}

fn refusal(record: &Record) -> String {
    let error = identify(record, &[Method::LeastSquares], &Settings::default()).unwrap_err();
    assert!(error.to_string().contains("release.csv"), "{error}");
    error.to_string()
}

/// Four standard uncertainties: one honest estimate in 16000 lies outside.
fn assert_holds(e: &Estimate, wn: f64, zeta: f64) {
    assert!(e.natural_frequency_rad_s.holds(wn, 4.0), "{wn}: {e:?}");
    assert!(e.damping_ratio.holds(zeta, 4.0), "{zeta}: {e:?}");
    // An uncertainty that holds because it is useless does not count.
    assert!(e.natural_frequency_rad_s.u < 0.01 * wn, "{e:?}");
    assert!(e.damping_ratio.u < 0.01, "{e:?}");
}

/// Hold, release from `from_deg`, swing for `seconds`.
fn held(wn: f64, zeta: f64, rate: f64, from_deg: f64, hold_s: f64, seconds: f64) -> Vec<f64> {
    let mut yaw = vec![from_deg; (hold_s * rate) as usize];
    yaw.extend(common::swing(wn, zeta, rate, from_deg, seconds).1);
    yaw
}

#[test]
fn hold_rest_and_offset_at_any_rate() {
    let cases = [(7.5, 0.012, 30.0), (2.5, 0.06, 25.0), (26.5, 0.004, 40.0), (15.0, 0.05, 12.0)];
    for (wn, zeta, seconds) in cases {
        for (rate, noise, hold_s, offset) in [
            (20.0, 0.1, 4.0, 0.0),
            (100.0, 0.05, 20.0, -50.0),
            (1000.0, 0.2, 0.4, 3.0),
            (1e4, 0.1, 1.0, 0.5),
        ] {
            let clean = held(wn, zeta, rate, 15.0, hold_s, seconds);
            let yaw = common::with_noise(&clean, noise, 0.0, 8);
            let found = found(&even(yaw.iter().map(|y| y + offset).collect(), rate));
            let e = &found.estimates[0];
            assert_holds(e, wn, zeta);
            let period = std::f64::consts::TAU / wn;
            let late = found.release_time_s - hold_s;
            assert!(late.abs() < 0.02 * period, "{wn} {rate}: {late}");
            assert!((found.window.from_deg - 10.0).abs() < 1.0, "{:?}", found.window);
            assert!((found.window.to_deg - 1.0).abs() < 0.2, "{:?}", found.window);
            assert_eq!(found.outliers, 0);
            assert!(
                e.flags.is_empty() || e.flags == [Flag::FewCycles],
                "{wn} {rate}: {:?}",
                e.flags
            );
        }
    }
}

#[test]
fn a_release_at_the_upper_limit_loses_nothing() {
    let yaw = common::with_noise(&held(7.5, 0.012, 1000.0, 10.0, 1.5, 26.0), 0.1, 0.0, 1);
    let found = found(&even(yaw, 1000.0));
    assert!(found.window.from_s < 1.53, "{:?}", found.window);
}

#[test]
fn wild_samples_are_survived_and_counted() {
    for (rate, seed) in [(20.0, 1), (200.0, 2), (1000.0, 3), (10_000.0, 4)] {
        let clean = held(7.5, 0.012, rate, 15.0, 2.0, 30.0);
        let mut yaw = common::with_noise(&clean, 0.05, 0.0, seed);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        // Five per thousand: dropouts to a rail, spikes of either sign, codes gone mad.
        let planted = (0.005 * yaw.len() as f64) as usize;
        let mut hit = std::collections::BTreeSet::new();
        while hit.len() < planted {
            let k = random.random_range(0..yaw.len());
            yaw[k] = match hit.len() % 3 {
                0 => -90.0,
                1 => yaw[k] + random.random_range(3.0..40.0),
                _ => 1e4,
            };
            hit.insert(k);
        }
        // After the window nobody looks for what is hidden in it.
        let found = found(&even(yaw, rate));
        let e = &found.estimates[0];
        assert_holds(e, 7.5, 0.012);
        assert!(e.flags.contains(&Flag::OutliersExcluded));
        let (least, most) = (planted * 9 / 10, planted + 2);
        assert!(
            (least..=most).contains(&found.outliers),
            "{rate}: {} of {planted}",
            found.outliers
        );
        assert!((found.noise_rms_deg - 0.05).abs() < 0.01, "{rate}: {}", found.noise_rms_deg);
    }
}

#[test]
fn jittered_time_stamps_are_used_as_they_are() {
    let (wn, zeta) = (7.5, 0.012);
    for rate in [20.0, 100.0, 1000.0] {
        let fine = 20.0;
        let (_, yaw) = common::swing(wn, zeta, fine * rate, 10.0, 25.0);
        let mut random = ChaCha8Rng::seed_from_u64(5);
        // Any of the twenty fine steps about each nominal one, within a third of it.
        let picked: Vec<usize> = (1..(yaw.len() as f64 / fine) as usize - 1)
            .map(|k| (k as f64 * fine) as usize + random.random_range(0..7))
            .collect();
        let time = picked.iter().map(|&k| k as f64 / (fine * rate)).collect();
        let clean: Vec<f64> = picked.iter().map(|&k| yaw[k]).collect();
        let found = found(&record(time, common::with_noise(&clean, 0.05, 0.0, 2)));
        let e = &found.estimates[0];
        assert_holds(e, wn, zeta);
        assert!(e.flags.contains(&Flag::IrregularTimeStamps));
        assert!((found.rate_hz / rate - 1.0).abs() < 0.05);
    }
}

#[test]
fn a_start_in_mid_swing_is_said() {
    let (_, yaw) = common::release(7.5, 0.012, 1000.0, 12.0, 0.8);
    let yaw = common::with_noise(&yaw[200..], 0.05, 0.0, 3);
    let found = found(&even(yaw, 1000.0));
    assert_holds(&found.estimates[0], 7.5, 0.012);
    assert_eq!(found.estimates[0].flags, [Flag::StartsInMidSwing]);
    assert_eq!(found.release_time_s, 0.0);
}

#[test]
fn what_is_still_pushed_is_left_out_and_said() {
    let (wn, zeta, rate) = (9.0, 0.02, 1000.0);
    // A hand carries the model in an arc of its own for half a second, then the free decay from rest.
    let mut yaw: Vec<f64> = (0..500)
        .map(|k| 12.0 - 22.0 * (1.0 - k as f64 / 500.0).powi(2) * (6.0 * k as f64 / 500.0).cos())
        .collect();
    yaw.extend(common::swing(wn, zeta, rate, 12.0, 16.0).1);
    let found = found(&even(common::with_noise(&yaw, 0.05, 0.0, 4), rate));
    let e = &found.estimates[0];
    assert_holds(e, wn, zeta);
    assert!(e.flags.contains(&Flag::PushedAtStart), "{:?}", e.flags);
    assert!((found.release_time_s - 0.5).abs() < 0.2, "{}", found.release_time_s);
}

#[test]
fn a_swing_that_is_caught_ends_there() {
    let mut yaw = held(7.5, 0.012, 500.0, 15.0, 1.0, 14.0);
    let caught = *yaw.last().unwrap();
    yaw.extend(vec![caught; 4000]);
    let found = found(&even(common::with_noise(&yaw, 0.05, 0.0, 5), 500.0));
    let e = &found.estimates[0];
    assert_holds(e, 7.5, 0.012);
    assert!(e.flags.contains(&Flag::StoppedEarly), "{:?}", e.flags);
    assert!((found.window.to_s - 15.0).abs() < 0.3, "{:?}", found.window);
}

#[test]
fn a_second_release_in_the_record_is_left_alone() {
    let mut yaw = held(7.5, 0.012, 500.0, 15.0, 1.0, 30.0);
    yaw.extend(held(7.5, 0.012, 500.0, 12.0, 2.0, 10.0));
    let found = found(&even(common::with_noise(&yaw, 0.05, 0.0, 5), 500.0));
    assert_holds(&found.estimates[0], 7.5, 0.012);
    assert!((found.release_time_s - 1.0).abs() < 0.01);
    assert!(found.window.to_s < 31.05, "{:?}", found.window);
}

#[test]
fn missing_stretches_do_no_harm() {
    for gap_s in [0.5, 2.0, 5.0] {
        let yaw = common::with_noise(&held(7.5, 0.012, 200.0, 15.0, 1.0, 31.0), 0.05, 0.0, 3);
        let (time, yaw) = (0..yaw.len())
            .map(|k| (k as f64 / 200.0, yaw[k]))
            .filter(|(t, _)| *t < 9.0 || *t > 9.0 + gap_s)
            .unzip();
        let found = found(&record(time, yaw));
        assert_holds(&found.estimates[0], 7.5, 0.012);
        assert!(found.estimates[0].flags.contains(&Flag::IrregularTimeStamps));
    }
}

#[test]
fn a_record_without_noise_gives_the_truth() {
    let found = found(&even(common::release(7.5, 0.012, 1000.0, 10.0, 1.0).1, 1000.0));
    let e = &found.estimates[0];
    assert!((e.natural_frequency_rad_s.value - 7.5).abs() < 1e-9, "{e:?}");
    assert!((e.damping_ratio.value - 0.012).abs() < 1e-10, "{e:?}");
    assert_eq!(found.outliers, 0);
}

#[test]
fn growing_and_steady_oscillations_are_results() {
    let (_, yaw) = common::swing(8.0, -0.01, 500.0, 0.5, 40.0);
    let grows = found(&even(common::with_noise(&yaw, 0.05, 0.0, 6), 500.0));
    assert_holds(&grows.estimates[0], 8.0, -0.01);
    assert!(grows.estimates[0].flags.contains(&Flag::Grows));

    let (_, yaw) = common::swing(8.0, 0.0, 500.0, 5.0, 30.0);
    let steady = found(&even(common::with_noise(&yaw, 0.05, 0.0, 7), 500.0));
    let e = &steady.estimates[0];
    assert_holds(e, 8.0, 0.0);
    assert!(!e.flags.contains(&Flag::Grows));
}

#[test]
fn amplitudes_elsewhere_are_analysed_and_said() {
    for (from_deg, to_deg) in [(80.0, 30.0), (0.8, 0.2)] {
        let (_, yaw) = common::release(7.5, 0.01, 500.0, from_deg, to_deg);
        let found = found(&even(common::with_noise(&yaw, 0.002 * from_deg, 0.0, 8), 500.0));
        let e = &found.estimates[0];
        assert_holds(e, 7.5, 0.01);
        assert_eq!(e.flags, [Flag::AmplitudeOutsideWindow]);
        assert!((found.window.from_deg / from_deg - 1.0).abs() < 0.05, "{:?}", found.window);
        assert!((found.window.to_deg / to_deg - 1.0).abs() < 0.05, "{:?}", found.window);
    }
}

#[test]
fn the_window_can_be_set() {
    let (_, yaw) = common::release(7.5, 0.012, 500.0, 15.0, 0.5);
    let settings = Settings { from_deg: 6.0, to_deg: 2.0, ..Settings::default() };
    let record = even(common::with_noise(&yaw, 0.05, 0.0, 9), 500.0);
    let found = identify(&record, &[Method::LeastSquares], &settings).unwrap();
    assert!((found.window.from_deg - 6.0).abs() < 0.2 && (found.window.to_deg - 2.0).abs() < 0.1);
    assert_holds(&found.estimates[0], 7.5, 0.012);
}

#[test]
fn what_is_no_swing_is_refused() {
    let n = 20_000;
    let zeros = vec![0.0; n];
    assert!(refusal(&even(zeros.clone(), 1000.0)).contains("no oscillation"));
    for seed in 0..20 {
        let white = common::with_noise(&zeros, 0.2, 0.0, seed);
        let words = refusal(&even(white, 1000.0));
        assert!(words.contains("no oscillation"), "white {seed}: {words}");
        // Neither a wandering zero nor a slow drift is a free decay.
        let wander = common::with_noise(&zeros, 2.0, 0.9999, seed);
        let words = refusal(&even(wander, 1000.0));
        assert!(
            words.contains("no oscillation") || words.contains("cycles"),
            "wander {seed}: {words}"
        );
    }
    let fall: Vec<f64> = (0..n).map(|k| 10.0 * (-(k as f64) / 3000.0).exp()).collect();
    let words = refusal(&even(common::with_noise(&fall, 0.05, 0.0, 1), 1000.0));
    assert!(words.contains("no oscillation") || words.contains("cycles"), "{words}");
    let short = held(7.5, 0.012, 1000.0, 10.0, 1.0, 2.0 * 0.84);
    assert!(refusal(&even(common::with_noise(&short, 0.05, 0.0, 1), 1000.0)).contains("cycles"));
}

/// b'' = -2 zeta wn r - wn^2 b - `extra(b, r)` (rad, s) from `from_deg` at rest, by Runge-Kutta at 1 kHz.
fn nonlinear(
    wn: f64,
    zeta: f64,
    from_deg: f64,
    seconds: f64,
    extra: impl Fn(f64, f64) -> f64,
) -> Vec<f64> {
    let slope = |x: [f64; 2]| [x[1], -2.0 * zeta * wn * x[1] - wn * wn * x[0] - extra(x[0], x[1])];
    let h = 1e-3;
    let mut x = [from_deg.to_radians(), 0.0];
    (0..(seconds / h) as usize)
        .map(|_| {
            let yaw = x[0].to_degrees();
            let at = |k: [f64; 2], h: f64| slope([x[0] + h * k[0], x[1] + h * k[1]]);
            let a = slope(x);
            let b = at(a, 0.5 * h);
            let c = at(b, 0.5 * h);
            let d = at(c, h);
            for i in 0..2 {
                x[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
            }
            yaw
        })
        .collect()
}

#[test]
fn what_changes_with_amplitude_shows_in_the_windows_and_as_a_range() {
    // Quadratic damping: zeta = z0 + 4/(3 pi) d A.
    let (wn, z0, d) = (7.5, 0.006, 0.08);
    let yaw = nonlinear(wn, z0, 15.0, 60.0, |_, r| d * r.abs() * r);
    let found1 = found(&even(common::with_noise(&yaw, 0.05, 0.0, 1), 1000.0));
    let e = &found1.estimates[0];
    assert!(e.flags.contains(&Flag::AmplitudeDependentDamping), "{:?}", e.flags);
    assert!(!e.flags.contains(&Flag::AmplitudeDependentFrequency), "{:?}", e.flags);
    let zeta = |a: f64| z0 + 4.0 / (3.0 * std::f64::consts::PI) * d * a.to_radians();
    for w in e.windows.iter().filter(|w| w.amplitude_deg > 3.0) {
        assert!((w.damping_ratio - zeta(w.amplitude_deg)).abs() < 3e-4, "{w:?}");
    }
    // Of the mean cycle from 10 to 1 deg: ln 10 over the phase, d ln A / d phase being -zeta(A).
    let phase = (10.0 * zeta(1.0) / zeta(10.0)).ln() / z0;
    assert!(e.damping_ratio.holds(10f64.ln() / phase, 3.0), "{e:?}");
    assert!(e.damping_ratio.u < 1e-4, "{e:?}");
    let [low, high] = e.damping_ratio_range;
    assert!((low - zeta(1.0)).abs() < 3e-4 && (high - zeta(10.0)).abs() < 3e-4, "{e:?}");

    // Cubic stiffness: wn (1 + 3/8 k3 A^2 / wn^2).
    let k3 = 60.0;
    let yaw = nonlinear(wn, 0.01, 15.0, 40.0, |b, _| k3 * b * b * b);
    let found2 = found(&even(common::with_noise(&yaw, 0.05, 0.0, 2), 1000.0));
    let e = &found2.estimates[0];
    assert!(e.flags.contains(&Flag::AmplitudeDependentFrequency), "{:?}", e.flags);
    for w in e.windows.iter().filter(|w| w.amplitude_deg > 2.0) {
        let a = w.amplitude_deg.to_radians();
        let expected = wn * (1.0 + 0.375 * k3 * a * a / (wn * wn));
        assert!((w.natural_frequency_rad_s - expected).abs() < 2e-3, "{w:?} {expected}");
    }
}

#[test]
fn a_linear_rig_is_not_called_anything_else() {
    let mut flagged = 0;
    for seed in 0..60 {
        for correlation in [0.0, 0.9, 0.99] {
            let clean = held(9.0, 0.015, 500.0, 15.0, 1.0, 25.0);
            let yaw = common::with_noise(&clean, 0.1, correlation, seed);
            let found = found(&even(yaw, 500.0));
            flagged += usize::from(!found.estimates[0].flags.is_empty());
        }
    }
    // Five standard uncertainties and six deviations: hardly ever by chance.
    assert!(flagged <= 2, "{flagged} of 180");
}
