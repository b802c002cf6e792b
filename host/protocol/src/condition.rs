//! The condition of releases as the device takes it, and why it does not.

use yawrig_base::error::{Error, Result};
use yawrig_shared::wire::{Condition, ConditionFault};

/// Whether releases can be made under it.
///
/// # Errors
/// Exit 2, naming the quantity, its value and the range, for what is no number, negative, or beyond what any
/// tunnel and model have.
pub fn check(condition: &Condition) -> Result<()> {
    let Condition { wind, model, inertia_kg_m2, .. } = condition;
    let Err(fault) = condition.check() else { return Ok(()) };
    let (what, value, unit, range) = match fault {
        ConditionFault::Density => {
            ("air density", wind.density_kg_m3, "kg/m3", "0.01 to 100 kg/m3")
        }
        ConditionFault::WindSpeed => {
            ("wind speed", wind.speed_m_s, "m/s", "0 (wind off) to 340 m/s")
        }
        ConditionFault::Length => ("model's length", model.length_m, "m", "0.01 to 20 m"),
        ConditionFault::FrontalArea => {
            ("model's frontal area", model.frontal_area_m2, "m2", "1e-5 to 100 m2")
        }
        ConditionFault::Inertia => {
            ("moment of inertia", *inertia_kg_m2, "kg m2", "1e-8 to 1e5 kg m2")
        }
    };
    Err(Error::usage(format!("{what} {value} {unit}: it is not in {range}, where any rig's is"))
        .help("correct that number"))
}
