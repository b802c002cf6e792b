//! Errors of the libraries, which know no flags, with those of this program.

use yawrig_base::error::{Cause, Error};
use yawrig_core::error::Error as Core;
use yawrig_rig::Quantity;

/// `error` with the flag that it is about, or that helps.
pub fn named(error: Error) -> Error {
    let help = match error.cause.as_deref() {
        Some(Cause::Rig(quantity)) => {
            let flag = match quantity {
                Quantity::Effect => "--effect",
                Quantity::Spring => "--spring",
                Quantity::WindSpeed => "--wind",
            };
            return Error { message: format!("{flag}: {}", error.message), ..error };
        }
        Some(Cause::Core(Core::TooFewCycles { .. })) => {
            "record a longer free decay, or widen the amplitude window with --from-deg and --to-deg"
        }
        Some(Cause::Core(Core::BeyondHalfTurn { .. })) => {
            "name the column yaw_deg if it is in degrees (`yawrig convert --unit deg` does); if that angle is meant, say so \
             with a --from-deg above it"
        }
        Some(Cause::Core(Core::Elsewhere { .. })) => {
            "choose --from-deg and --to-deg between those of the record"
        }
        Some(Cause::Core(Core::NoEstimate { .. })) => "try another --method",
        _ => return error,
    };
    error.help(help)
}
