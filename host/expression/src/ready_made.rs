//! Effects that are given by their equations and follow late: used by their names, as the library's, and written
//! as a user's own.

use super::{from_text, OwnEffect};
use std::path::Path;
use std::sync::{Arc, LazyLock};

/// Identifier and file of each.
const FILES: [(&str, &str); 1] = [("first_order_lag", include_str!("first_order_lag.toml"))];

static ALL: LazyLock<Vec<Arc<OwnEffect>>> = LazyLock::new(|| {
    let read = |(id, text)| from_text(Path::new(id), text, &[]).expect("a file that is tested");
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
