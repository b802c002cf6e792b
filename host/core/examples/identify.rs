//! Natural frequency and damping ratio of a release, as one mean and against the amplitude.
//!
//!     cargo run --release -p yawrig-core --example identify

mod made;

use yawrig_core::effects::Effect;
use yawrig_core::error::Result;
use yawrig_core::identify::{identify, Method, Settings};

fn main() -> Result<()> {
    let rubbing: (Effect, &[f64]) = (Effect::CoulombFriction, &[0.05]);
    let record = made::release("rubbing", [7.5, 0.008], 12.0, &[rubbing]);
    let identification = identify(&record, &[Method::LeastSquares], &Settings::default())?;
    let mode = &identification.estimates[0];
    println!("natural frequency {} rad/s", mode.natural_frequency_rad_s);
    println!("damping ratio     {}", mode.damping_ratio);
    println!("{:>8}  {:>20}  {:>22}", "deg", "wn, rad/s", "zeta");
    for at in &mode.at_amplitude {
        let (wn, zeta) = (at.natural_frequency_rad_s, at.damping_ratio);
        println!("{:8.2}  {:>20}  {:>22}", at.amplitude_deg, wn.to_string(), zeta.to_string());
    }
    Ok(())
}
