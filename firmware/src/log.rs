//! What a board says over its debug plug, as defmt over RTT, with the feature `log`; without it the image
//! holds nothing of this.

#[cfg(feature = "log")]
use yawrig_shared::wire::{Cause, Phase};
use yawrig_shared::wire::{Event, Start};

/// How this run began, and what ended the one before.
pub fn start(board: &str, start: &Start) {
    #[cfg(not(feature = "log"))]
    let _ = (board, start);
    #[cfg(feature = "log")]
    {
        let cause = match start.cause {
            Cause::Unknown => "unknown",
            Cause::Power => "power",
            Cause::Pin => "reset pin",
            Cause::Watchdog => "watchdog",
            Cause::Software => "itself",
        };
        defmt::info!("yawrig on {=str} begins; reset by: {=str}", board, cause);
        if let Some(crash) = &start.crash {
            let (file, line) = (crash.file.as_str(), crash.line);
            defmt::error!("the run before ended at {=str}:{=u32}", file, line);
        }
    }
}

/// So many samples were lost.
pub fn lost(samples: u32) {
    #[cfg(not(feature = "log"))]
    let _ = samples;
    #[cfg(feature = "log")]
    defmt::warn!("{=u32} samples lost", samples);
}

/// The flash has not taken what was learnt.
pub fn not_kept() {
    #[cfg(feature = "log")]
    defmt::warn!("the flash does not take what was learnt: a reset will lose it");
}

/// Nobody can write to it any more.
pub fn lock_lost() {
    #[cfg(feature = "log")]
    defmt::error!("the lock cannot be read: nobody's key opens it; erase the flash");
}

/// What the host is told unasked.
pub fn event(event: &Event) {
    #[cfg(not(feature = "log"))]
    let _ = event;
    #[cfg(feature = "log")]
    match event {
        Event::Phase { phase, release, .. } => {
            let phase = match phase {
                Phase::Waiting => "waits",
                Phase::Held => "held",
                Phase::Released => "let go",
                Phase::Ringing => "rings",
                Phase::Finished => "finished",
            };
            defmt::info!("release {=u32}: {=str}", release, phase);
        }
        Event::Window(window) => defmt::info!(
            "window {=u16}: {=f32} rad/s, damping ratio {=f32}",
            window.window,
            window.natural_frequency_rad_s,
            window.damping_ratio
        ),
        Event::Release(release) => defmt::info!(
            "mean of {=u16} windows: {=f32} rad/s, damping ratio {=f32}",
            release.windows,
            release.natural_frequency_rad_s.value,
            release.damping_ratio.value
        ),
        Event::Refined(refined) => defmt::info!(
            "refined: {=f64} rad/s, damping ratio {=f32}",
            refined.natural_frequency_rad_s.value,
            refined.damping_ratio.value
        ),
    }
}
