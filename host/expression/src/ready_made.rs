//! Effects that are given by their equations and follow late: used by their names, as the library's, and written
//! as a user's own.

use super::file::{compiled, Checked};
use super::{OwnEffect, Words};
use std::path::Path;
use std::sync::{Arc, LazyLock};

/// Identifier and file of each, and what is known of it.
const FILES: [(&str, &str, &Words); 1] = [(
    "first_order_lag",
    include_str!("first_order_lag.toml"),
    &Words {
        cause: "with the wind on the wake, which changes some time after the angle; without wind a strap, rubber or an oil film",
        fingerprint: "the first cycles are off, the mid-line with them; what follows is a second-order response",
        confirm: "on other springs a and rate stay; a wake's a goes with the square of the wind speed, its rate with the speed",
        remove: "take straps and rubber away; a wake belongs to the car: its share is in the derivatives against reduced frequency",
        release: "the same amplitude on a softer and a stiffer spring, with the wind on and off",
        elsewhere: Some(&Words {
            cause: "a strap, rubber or an oil film; liquid in a tank, or a wake, that follows late",
            fingerprint: "the first cycles are off, the mid-line with them; what follows is a second-order response",
            confirm: "at another natural frequency a and rate stay",
            remove: "take straps and rubber away, empty or fill the tanks",
            release: "the same amplitude at a lower and a higher natural frequency",
            elsewhere: None,
        }),
    },
)];

static ALL: LazyLock<Vec<Arc<OwnEffect>>> = LazyLock::new(|| {
    let read = |(id, text, words)| {
        // Not checked by every program that starts: a test does.
        let known = Checked { warnings: Vec::new(), size_parameter: Some(0), keeps_moving: false };
        let effect =
            compiled(Path::new(id), text, &[], Some(known)).expect("a file that is tested");
        OwnEffect { words: Some(words), ..effect }
    };
    FILES.into_iter().map(read).map(Arc::new).collect()
});

/// The one with this identifier.
///
/// ```
/// let lag = yawrig_expression::ready_made("first_order_lag").expect("it is there");
/// assert_eq!(lag.parameters[1].unit, "1/s");
/// assert_eq!(lag.states[0].rate, "r - rate * x");
/// ```
pub fn ready_made(id: &str) -> Option<Arc<OwnEffect>> {
    ALL.iter().find(|effect| effect.id == id).cloned()
}

/// All of them.
pub fn all_ready_made() -> &'static [Arc<OwnEffect>] {
    &ALL
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::from_text;

    #[test]
    fn the_checks_find_what_is_known() {
        for effect in all_ready_made() {
            let checked = from_text(Path::new(&effect.id), &effect.text, &[]).expect(&effect.id);
            assert_eq!(checked.warnings, effect.warnings);
            assert_eq!(checked.size_parameter, effect.size_parameter);
            assert_eq!(checked.keeps_moving, effect.keeps_moving);
        }
    }
}
