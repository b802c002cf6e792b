//! Releases with the wind off and on, to aerodynamic derivatives with their uncertainties.
//!
//!     cargo run --release -p yawrig-core --example derivatives

mod made;

use std::error::Error;
use yawrig_core::derivatives::campaign::Campaign;
use yawrig_core::derivatives::condition::Identified;
use yawrig_core::derivatives::Computed;
use yawrig_core::identify::{identify, Method, Settings};

/// As in a `campaign.toml`: one spring, wind off and on, the inertia known.
const CAMPAIGN: &str = r#"
schema_version = 1
model = { name = "a car", length_m = 0.625, frontal_area_m2 = 0.036 }
air = { density_kg_m3 = 1.2, density_u_kg_m3 = 0.006 }
rig = { spring_arm_m = 0.1, axis_offset_m = 0.05 }
inertia = { mid_kg_m2 = 0.101, mid_u_kg_m2 = 0.0003 }
[[release]]
file = "off"
spring = "K3"
spring_stiffness_n_per_m = 306.0
axis = "mid"
wind_speed_m_s = 0.0
[[release]]
file = "on"
spring = "K3"
spring_stiffness_n_per_m = 306.0
axis = "mid"
wind_speed_m_s = 10.0
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let campaign: Campaign = toml::from_str(CAMPAIGN)?;
    // The wind takes stiffness away and adds damping.
    let mut identified = Vec::new();
    for (name, mode) in [("off", [7.785, 0.004]), ("on", [7.308, 0.011])] {
        let record = made::release(name, mode, 12.0, &[]);
        let found = identify(&record, &[Method::LeastSquares], &Settings::default())?;
        identified.extend(Identified::from_identification(found));
    }
    let table = Computed::new(&campaign, &identified)?.table("campaign.toml".as_ref(), "mine");
    for point in &table.points {
        println!("{} at {} m/s", point.spring, point.wind_speed_m_s);
        println!("  reduced frequency {:.3}", point.reduced_frequency);
        println!("  Cn_beta {}", point.cn_beta);
        println!("  Cn_r    {} (with -Cn_betadot)", point.cn_r);
    }
    println!("taken as known without error: {}", table.assumed_zero.join(", "));
    Ok(())
}
