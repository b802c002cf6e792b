//! From a release that meets a stop on one side to the model by the printed commands alone.
//! Figures: `cargo test --release -p yawrig --test steps walls -- --nocapture`.

use crate::by_hand::{campaign, Made, Planted};
use crate::sources::{json, run, within};

/// 40 rad/s2 a rad beyond 6 deg on the positive side, released from 12 deg.
#[test]
fn the_printed_commands_make_the_model_of_a_stop_on_one_side() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let made = Made {
        springs: &[("K4", 284.0)],
        speeds_m_s: &[0.0],
        amplitude_deg: 12.0,
        seconds: 30.0,
        rate_hz: 500.0,
        noise_deg: 0.04,
        seed: 3,
    };
    let stop_rad = 6f64.to_radians();
    let planted = Planted {
        moment: &|b, _, _, _| -40.0 * (b - stop_rad).max(0.0),
        state: &|_, _, _, _| 0.0,
        friction_rad_s2: 0.0,
        damping_ratio: 0.006,
    };
    campaign(folder, &made, &planted);
    let found = json(folder, &["diagnose", "K4-0.csv", "--json"]);
    println!("{} {}", found["status"], found["effects"]);
    assert_eq!(found["effects"], serde_json::json!(["one_sided_stop"]));
    let last = run(folder, &found);
    assert!(last["residual_over_noise"].as_f64().unwrap() <= 1.15);
    assert!(last["held_out_over_noise"].as_f64().unwrap() <= 1.3);
    assert!(within(&last["parameters"]["one_sided_stop.k"], 40.0, 2.0));
    assert!(within(&last["parameters"]["one_sided_stop.g"], stop_rad, 2.0));
}

/// A moment that follows late, 4 x with x' = r - 3 x, in releases on two springs at once.
#[test]
fn a_lag_of_two_springs_is_named_and_added_by_the_printed_commands() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let made = Made {
        springs: &[("K2", 214.0), ("K4", 806.0)],
        speeds_m_s: &[0.0],
        amplitude_deg: 12.0,
        seconds: 12.0,
        rate_hz: 500.0,
        noise_deg: 0.04,
        seed: 4,
    };
    let planted = Planted {
        moment: &|_, _, x, _| -4.0 * x,
        state: &|_, r, x, _| r - 3.0 * x,
        friction_rad_s2: 0.0,
        damping_ratio: 0.006,
    };
    campaign(folder, &made, &planted);
    let found = json(folder, &["diagnose", "campaign.toml", "--json"]);
    assert_eq!(found["effects"], serde_json::json!(["first_order_lag"]));
    let added = run(folder, &found);
    println!(
        "residual {:.3}, held out {:.3}",
        added["residual_over_noise"].as_f64().unwrap(),
        added["held_out_over_noise"].as_f64().unwrap()
    );
    assert!(added["residual_over_noise"].as_f64().unwrap() <= 1.15);
    assert!(added["held_out_over_noise"].as_f64().unwrap() <= 1.3);
    assert!(within(&added["parameters"]["first_order_lag.a"], 4.0, 2.0));
    assert!(within(&added["parameters"]["first_order_lag.rate"], 3.0, 2.0));
}
