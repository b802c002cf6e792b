//! A device's events as text and as JSON.

mod json;
mod names;

use crate::numbers::Named;
pub use json::{
    device_json, event_from_json, event_json, learnt_json, precise, quantity, refined_json,
    release_json, sensor_json, start_json, topology, window_json,
};
use names::sensor_name;
pub use names::{flag_advice, flag_names, forgotten_name, forgotten_of, is_refined};
use yawrig_base::error::{Error, Exit, Result};
use yawrig_core::quantity::Quantity;
use yawrig_shared::wire::{
    counting, is_safe, Cause, Crash, Derivatives, Event, Flags, Forgotten, Learnt, Measured, Phase,
    Refined, ReleaseResult, Sensor, Start, Status,
};

/// What the samples are of.
pub fn sensor_text(sensor: &Sensor) -> String {
    let Sensor { rate_hz, delay_us, .. } = sensor;
    format!(
        "{}, read at {rate_hz} Hz, up to {} ms late",
        sensor_name(sensor),
        f64::from(*delay_us) / 1e3
    )
}

/// How this run of the device began, and what ended the one before.
pub fn start_text(start: &Start) -> String {
    let cause = match start.cause {
        Cause::Unknown => "the board does not say why",
        Cause::Power => "power came",
        Cause::Pin => "the reset button, or a debugger",
        Cause::Watchdog => "its watchdog: the firmware hung, or no sample came for seconds",
        Cause::Software => "the firmware restarted",
    };
    match &start.crash {
        None => cause.to_owned(),
        Some(Crash { file, line }) if file.is_empty() => {
            format!("{cause} after a fault of the processor at {line:#010x}; please report it")
        }
        Some(Crash { file, line }) => {
            format!("{cause} after a panic at {file}:{line}; please report it")
        }
    }
}

/// The same of a device as it is, with how often in a row that was.
pub fn began_text(status: &Status) -> String {
    let (why, restarts) = (start_text(&status.start), status.restarts);
    match restarts {
        0 | 1 => why,
        _ if is_safe(restarts) => format!("{why}, {restarts} times in a row; {SAFE}"),
        _ => format!("{why}, {restarts} times in a row"),
    }
}

/// What a device in safe mode is.
const SAFE: &str =
    "it is in safe mode: it measures nothing and has taken up nothing of what it keeps";

/// A device that measures nothing.
///
/// # Errors
/// Exit 4 where it is in safe mode.
pub fn check_measures(status: &Status) -> Result<()> {
    if !is_safe(status.restarts) {
        return Ok(());
    }
    let why = format!("the device began anew: {}", began_text(status));
    Err(Error::new(Exit::Device, why).help(
        "look at the potentiometer's wires, unplug the device and plug it in; if it comes to this again, write its network anew \
         (`yawrig flash`), and have it forget what it corrects its converter by (`yawrig device linearity`)",
    ))
}

/// What the device has learnt of its network's error on a rig.
pub fn learnt_text(learnt: &Learnt) -> String {
    let Learnt { releases, kept, forgotten } = *learnt;
    let mut said = match releases {
        0 => "nothing of its network's error on a rig".to_owned(),
        1 => "its network's error on the rig, from 1 release".to_owned(),
        _ => format!("its network's error on the rig, from {releases} releases"),
    };
    if let Some(why) = forgotten {
        said += match why {
            Forgotten::Rig => "; what it knew was of another rig",
            Forgotten::Network => "; what it knew was of another network",
            Forgotten::Contradicted => {
                "; a release showed that the rig is another than was said: see what is mounted"
            }
            Forgotten::Damaged => {
                "; its flash does not hold what it knew as it was written: it learns anew"
            }
        };
    }
    if !kept {
        said += "; not in its flash yet";
    }
    said
}

/// One event as a line; `None` where there is nothing to tell. `record` is what the host can diagnose.
pub fn event_text(event: &Event, record: &str, names: &[Named]) -> Option<String> {
    Some(match event {
        Event::Phase { phase: Phase::Held, .. } => "held".to_owned(),
        Event::Phase { phase: Phase::Released, release, .. } => {
            format!("release {release}: let go")
        }
        Event::Phase { .. } => return None,
        Event::Window(window) => {
            let mut text = format!(
                "  window {:2} at {:5.2} deg   wn {:8.4} rad/s   zeta {:9.6}",
                window.window,
                window.amplitude_deg,
                window.natural_frequency_rad_s,
                window.damping_ratio,
            );
            for (Named { name, unit }, value) in names.iter().zip(window.numbers.iter()) {
                text += &format!("   {name} {value:.5} {unit}");
            }
            text += &format!("   {}", flag_names(window.flags).join(" "));
            text.trim_end().to_owned()
        }
        Event::Release(result) => release_text(result, names),
        Event::Refined(refined) => refined_text(refined, record),
    })
}

fn release_text(result: &ReleaseResult, names: &[Named]) -> String {
    let mut text = result_text(result, names);
    for advice in flag_advice(result.flags) {
        text.push_str("\n  ");
        text.push_str(advice);
    }
    text
}

fn result_text(result: &ReleaseResult, names: &[Named]) -> String {
    let flags = flag_names(result.flags).join(" ");
    if result.windows == 0 {
        return format!("release {}: not usable: {flags}", result.release);
    }
    let mut text = format!(
        "release {}: wn {} rad/s, zeta {} from {} window{}   {flags}",
        result.release,
        shown(result.natural_frequency_rad_s),
        shown(result.damping_ratio),
        result.windows,
        if result.windows == 1 { "" } else { "s" },
    )
    .trim_end()
    .to_owned();
    if counting(Some(result), None).is_none() {
        text.push_str(" (not usable)");
    }
    for (Named { name, unit }, measured) in names.iter().zip(result.numbers.iter()) {
        text += &format!("\n  {name} {} {unit}", shown(*measured));
    }
    text.push_str(&derivatives_text(result.derivatives.as_ref()));
    text
}

fn shown(measured: Measured) -> Quantity {
    Quantity::new(f64::from(measured.value), f64::from(measured.u))
}

fn derivatives_text(derivatives: Option<&Derivatives>) -> String {
    derivatives.map_or(String::new(), |d| {
        let text = format!(
            "\n  Cn_beta {}, Cn_r {} per rad at reduced frequency {:.3}",
            shown(d.cn_beta),
            shown(d.cn_r),
            d.reduced_frequency,
        );
        // An old stored session says neither.
        match d.cn_beta.u.is_nan() {
            true => text,
            false => format!("{text}, against wind-off release {}", d.reference_release),
        }
    })
}

fn refined_text(refined: &Refined, record: &str) -> String {
    let release = refined.release;
    if !is_refined(refined) {
        return format!("release {release}: no damped oscillation fits the whole record");
    }
    let mut text = format!(
        "release {release} refined: wn {} rad/s, zeta {}; the residual is {:.2} times the noise of {:.3} deg",
        precise(refined.natural_frequency_rad_s),
        shown(refined.damping_ratio),
        refined.residual_over_noise,
        refined.noise_rms_deg,
    );
    if counting(None, Some(refined)).is_none() {
        text.push_str(" (not usable)");
    }
    text.push_str(&derivatives_text(refined.derivatives.as_ref()));
    if refined.flags.has(Flags::MISFIT) {
        text.push_str(&format!(
            "\n  something is missing here: look at it on the host with `yawrig diagnose {record}`; on a board without a table \
             for its converter (`yawrig device` says) that may be the cause: `yawrig device linearity`"
        ));
    } else if refined.flags.has(Flags::WIDENED) {
        text.push_str("\n  the model may lack something: what that may do is in the uncertainties");
    }
    if refined.flags.has(Flags::WINDOWS_DIFFER) {
        text.push_str("\n  the mean over the windows contradicts this, which counts");
    }
    text
}

#[cfg(test)]
#[path = "follow_tests.rs"]
mod tests;
