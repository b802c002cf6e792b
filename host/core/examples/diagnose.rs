//! What two releases of one rig lack beside a second-order response, judged together.
//!
//!     cargo run --release -p yawrig-core --example diagnose

mod made;

use yawrig_core::diagnosis::diagnose::{diagnose, Common, Grouping, Options};
use yawrig_core::effects::Effect;
use yawrig_core::error::Result;

fn main() -> Result<()> {
    let rubbing: (Effect, &[f64]) = (Effect::CoulombFriction, &[0.05]);
    let mode = [7.5, 0.008];
    let records = [
        made::release("from 16 deg", mode, 16.0, std::slice::from_ref(&rubbing)),
        made::release("from 11 deg", mode, 11.0, std::slice::from_ref(&rubbing)),
    ];
    let grouping = Grouping::Rig(Common { same_rig: true, ..Common::default() });
    let found = diagnose(&records, &grouping, &Options::default())?.diagnosis;
    println!("{}", found.sentence);
    for step in &found.steps {
        let added = step.added.as_ref().map_or("second order", Effect::id);
        println!(
            "{added:>18}: residual over noise {:7.2}, held out {:7.2}",
            step.residual_over_noise, step.held_out_over_noise
        );
    }
    for (name, value) in found.steps.iter().flat_map(|step| &step.parameters) {
        println!("{name} {value}");
    }
    Ok(())
}
