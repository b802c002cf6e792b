//! What of the device's events is shown, and how: apart from the program, so that it is tried without a
//! board.

use heapless::String;
use yawrig_shared::wire::{Event, Flags, Phase};

/// A display's text, if the event has one.
pub fn text(event: &Event) -> Option<String<64>> {
    use core::fmt::Write;
    let mut text = String::new();
    match event {
        Event::Phase { phase: Phase::Held, .. } => write!(text, "let go"),
        Event::Refined(refined) if refined.flags.has(Flags::NOT_REFINED) => write!(text, "again"),
        Event::Refined(refined) => {
            let (wn, zeta) = (refined.natural_frequency_rad_s, refined.damping_ratio);
            write!(text, "{:.4} rad/s\nzeta {:.5}\n+- {:.5}", wn.value, zeta.value, zeta.u)
        }
        _ => return None,
    }
    .ok()?;
    Some(text)
}
