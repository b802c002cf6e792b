use super::*;
use yawrig_shared::derivatives::reduced_frequency;

#[test]
fn side_force_truth_is_the_table_s() {
    let rig = Rig::default();
    let cy_beta = [1.9719, 3.2180, 2.1192, 2.4591, 2.0465, 3.4285, 2.6974, 1.4104];
    let cy_r = [0.7967, 0.5764, 0.5729, 0.2913, 0.4492, 0.8613, 0.5731, 0.3870];
    for (spring, (cy_beta, cy_r)) in SPRINGS.iter().zip(cy_beta.into_iter().zip(cy_r)) {
        let truth = rig.truth(spring);
        assert!((truth.cy_beta - cy_beta).abs() < 1e-3, "{truth:?}");
        assert!((truth.cy_r - cy_r).abs() < 1e-12, "{truth:?}");
    }
}

/// Every condition of the thesis lies in the range the device is trained for, and the wind softens and damps.
#[test]
fn every_condition_is_in_the_rig_s_range() {
    let rig = Rig::default();
    for spring in SPRINGS {
        for axis in Axis::BOTH {
            let at =
                |wind_speed_m_s| rig.modal(&Condition { spring, axis, wind_speed_m_s }).unwrap();
            let (off, on) = (at(0.0), at(10.0));
            for modal in [off, on] {
                assert!((2.5..26.5).contains(&modal.natural_frequency_rad_s), "{modal:?}");
                assert!((0.001..0.1).contains(&modal.damping_ratio), "{modal:?}");
            }
            assert!(on.natural_frequency_rad_s < off.natural_frequency_rad_s);
            assert!(on.damping_ratio > off.damping_ratio);
        }
    }
}

/// Measured reduced frequencies of Table 3.2. Its rig was not exactly 2 Ks b^2 stiff, hence 0.03.
#[test]
fn reduced_frequencies_are_near_the_thesis_s() {
    let rig = Rig::default();
    for (spring, km) in SPRINGS.into_iter().zip([0.13, 0.19, 0.25, 0.39, 0.44, 0.55, 0.66, 0.70]) {
        let on = rig.modal(&Condition { spring, axis: Axis::Mid, wind_speed_m_s: 10.0 }).unwrap();
        let found = reduced_frequency(&on, &rig.wind(10.0), &rig.model);
        assert!((found - km).abs() < 0.03, "{}: {found} is not {km}", spring.name);
    }
}

#[test]
fn too_much_wind_is_an_error_and_not_a_nan() {
    let rig = Rig::default();
    let condition = Condition { spring: SPRINGS[0], axis: Axis::Mid, wind_speed_m_s: 30.0 };
    let error = rig.modal(&condition).unwrap_err();
    assert!(error.to_string().contains("K1"), "{error}");
}

#[test]
fn a_release_starts_where_it_is_held_and_knows_its_truth() {
    let rig = Rig::default();
    let condition = Condition { spring: SPRINGS[3], axis: Axis::Front, wind_speed_m_s: 10.0 };
    let sensor = Sensor { offset_deg: 3.0, ..Sensor::default() };
    let release = rig.release(&condition, &Start::default(), &sensor, 5).unwrap();
    assert_eq!(release.truth, rig.modal(&condition).unwrap());
    assert!((release.derivatives.unwrap().cn_beta - 0.3495).abs() < 1e-12);
    let held: Vec<Sample> = release.samples.take(2000).collect();
    let mean = held.iter().map(|s| s.yaw_deg).sum::<f64>() / 2000.0;
    assert!((mean - 18.0).abs() < 4.0 * 0.05 / 2000f64.sqrt(), "{mean}");
    assert!(held.iter().all(|s| s.counts.is_some()));
    assert_eq!(Spring::named("k4").unwrap(), SPRINGS[3]);
    assert!(Spring::named("K9").is_err());
}

/// A least value without a largest is said as such: the number is finite.
#[test]
fn a_value_below_the_least_is_told_the_least() {
    for (text, says) in [
        ("first_order_lag:a=4,rate=-1", "rate=-1 is not finite and at least 0.01"),
        ("first_order_lag:a=nan,rate=3", "a=NaN is not finite"),
        ("one_sided_stop:k=-1,g=0.1", "k=-1 is not positive and finite"),
    ] {
        let error = text.parse::<Effect>().expect_err(text);
        assert!(error.to_string().ends_with(says), "{error}");
    }
}
