//! A rig whose damping falls with the wind, until it swings by itself.

use std::fmt::Write as _;
use std::path::Path;
use yawrig_rig::runge_kutta;

/// From which on it does.
pub const CRITICAL_M_S: f64 = 11.3;
const HEAD: &str = "schema_version = 1\n[model]\nname = \"Swinging model\"\nlength_m = 0.625\nfrontal_area_m2 = 0.036\n\
    [air]\ndensity_kg_m3 = 1.2\n[rig]\nspring_arm_m = 0.1\naxis_offset_m = 0.05\n[inertia]\nmid_kg_m2 = 0.12\n";

/// b'' = -7.1^2 b - (0.3 (1 - V / 11.3) + 9.2 b^2) b', held for a second at 15 deg; in place of noise what is
/// left of a reading to 0.02 deg.
fn record(wind_m_s: f64) -> String {
    let mut text = "time_s,yaw_deg\n".to_owned();
    let mut x = [15f64.to_radians(), 0.0];
    let h = 1e-3;
    for k in 0..8200 {
        let read = (x[0].to_degrees() / 0.02).round() * 0.02;
        let _ = writeln!(text, "{:.3},{read:.2}", f64::from(k) * 5e-3);
        for _ in 0..if k < 200 { 0 } else { 5 } {
            x = runge_kutta(x, h, |_, [b, r]: [f64; 2]| {
                let damping = 0.3 * (1.0 - wind_m_s / CRITICAL_M_S) + 9.2 * b * b;
                [r, -7.1 * 7.1 * b - damping * r]
            });
        }
    }
    text
}

/// Its releases and their `campaign.toml`.
///
/// # Panics
/// Where they cannot be written.
pub fn campaign(folder: &Path) {
    let mut text = HEAD.to_owned();
    for wind_m_s in [0.0, 5.0, 8.0, 10.0] {
        let file = format!("K3-{wind_m_s}.csv");
        std::fs::write(folder.join(&file), record(wind_m_s)).expect("room for it");
        let _ = writeln!(
            text,
            "[[release]]\nfile = \"{file}\"\nspring = \"K3\"\nspring_stiffness_n_per_m = 306.0\naxis = \"mid\"\n\
             wind_speed_m_s = {wind_m_s:?}"
        );
    }
    std::fs::write(folder.join("campaign.toml"), text).expect("room for it");
}
