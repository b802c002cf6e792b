//! A device's events as text and as JSON.

use crate::link::client::Identity;
use serde_json::{json, Value};
use yawrig_shared::wire::{
    Derivatives, Event, Flags, Measured, Phase, ReleaseResult, Status, WindowResult,
};

/// Names of the flags that are set.
pub fn flag_names(flags: Flags) -> Vec<&'static str> {
    Flags::NAMES.iter().filter(|(flag, _)| flags.has(*flag)).map(|(_, name)| *name).collect()
}

const PHASES: [Phase; 5] =
    [Phase::Waiting, Phase::Held, Phase::Released, Phase::Ringing, Phase::Finished];

fn phase_name(phase: Phase) -> &'static str {
    match phase {
        Phase::Waiting => "waiting",
        Phase::Held => "held",
        Phase::Released => "released",
        Phase::Ringing => "ringing",
        Phase::Finished => "finished",
    }
}

/// A device's `f32` as the shortest decimal that means it.
fn number(x: f32) -> Value {
    if !x.is_finite() {
        return Value::Null;
    }
    // Through its own shortest text: 0.0061 and not 0.006099999882280827.
    x.to_string().parse::<f64>().map_or(Value::Null, |x| json!(x))
}

/// `{"value","u"}`.
pub fn quantity(measured: Measured) -> Value {
    json!({"value": number(measured.value), "u": number(measured.u)})
}

/// A window as `identify` lists it, with the device's own fields.
pub fn window_json(window: &WindowResult) -> Value {
    json!({
        "amplitude_deg": number(window.amplitude_deg),
        "natural_frequency_rad_s": number(window.natural_frequency_rad_s),
        "damping_ratio": number(window.damping_ratio),
        "midline_deg": number(window.midline_deg),
        "start_sample": window.start_sample,
        "end_sample": window.end_sample,
        "sent_sample": window.sent_sample,
        "flags": flag_names(window.flags),
    })
}

/// A release's result.
pub fn release_json(result: &ReleaseResult) -> Value {
    let derivatives = result.derivatives.map(|d| {
        json!({
            "cn_beta": number(d.cn_beta),
            "cn_r": number(d.cn_r),
            "reduced_frequency": number(d.reduced_frequency),
        })
    });
    let given = result.windows > 0;
    json!({
        "release": result.release,
        "release_sample": result.release_sample,
        "finished_sample": result.finished_sample,
        "windows": result.windows,
        "natural_frequency_rad_s": given.then(|| quantity(result.natural_frequency_rad_s)),
        "damping_ratio": given.then(|| quantity(result.damping_ratio)),
        "derivatives": derivatives,
        "usable": !result.flags.unusable(),
        "flags": flag_names(result.flags),
    })
}

/// One event as a JSON object.
pub fn event_json(event: &Event) -> Value {
    let (name, mut object) = match event {
        Event::Phase { phase, release, at_sample } => (
            "phase",
            json!({"phase": phase_name(*phase), "release": release, "at_sample": at_sample}),
        ),
        Event::Window(window) => {
            let mut object = window_json(window);
            object["release"] = json!(window.release);
            object["window"] = json!(window.window);
            ("window", object)
        }
        Event::Release(result) => ("release", release_json(result)),
    };
    object["schema_version"] = json!(1);
    object["event"] = json!(name);
    object
}

/// `41-6-2`.
pub fn topology(status: &Status) -> String {
    status.network.topology.iter().map(u8::to_string).collect::<Vec<_>>().join("-")
}

/// Firmware, protocol and network of a device.
pub fn device_json(identity: &Identity, status: &Status) -> Value {
    json!({
        "firmware": format!("{} on {}", identity.firmware, identity.board),
        "protocol": identity.protocol,
        "network": {
            "id": format!("{:08x}", status.network.id),
            "topology": topology(status),
            "generation": status.network.generation,
            "effects": status.network.effects.split_whitespace().collect::<Vec<_>>(),
        },
    })
}

/// The event of such an object; none where it is no such object.
pub fn event_from_json(object: &Value) -> Option<Event> {
    let whole = |key: &str| object[key].as_u64();
    let sample = |key: &str| u32::try_from(whole(key)?).ok();
    let small = |key: &str| u16::try_from(whole(key)?).ok();
    let real = |object: &Value, key: &str| Some(object[key].as_f64()? as f32);
    let measured = |key: &str| match &object[key] {
        Value::Null => Some(Measured::default()),
        value => Some(Measured { value: real(value, "value")?, u: real(value, "u")? }),
    };
    let release = sample("release")?;
    Some(match object["event"].as_str()? {
        "phase" => {
            let name = object["phase"].as_str()?;
            let phase = PHASES.into_iter().find(|phase| phase_name(*phase) == name)?;
            Event::Phase { phase, release, at_sample: sample("at_sample")? }
        }
        "window" => Event::Window(WindowResult {
            release,
            window: small("window")?,
            start_sample: sample("start_sample")?,
            end_sample: sample("end_sample")?,
            sent_sample: sample("sent_sample")?,
            amplitude_deg: real(object, "amplitude_deg")?,
            midline_deg: real(object, "midline_deg")?,
            natural_frequency_rad_s: real(object, "natural_frequency_rad_s")?,
            damping_ratio: real(object, "damping_ratio")?,
            flags: flags_named(&object["flags"])?,
        }),
        "release" => Event::Release(ReleaseResult {
            release,
            release_sample: sample("release_sample")?,
            finished_sample: sample("finished_sample")?,
            windows: small("windows")?,
            natural_frequency_rad_s: measured("natural_frequency_rad_s")?,
            damping_ratio: measured("damping_ratio")?,
            derivatives: match &object["derivatives"] {
                Value::Null => None,
                d => Some(Derivatives {
                    cn_beta: real(d, "cn_beta")?,
                    cn_r: real(d, "cn_r")?,
                    reduced_frequency: real(d, "reduced_frequency")?,
                }),
            },
            flags: flags_named(&object["flags"])?,
        }),
        _ => return None,
    })
}

fn flags_named(names: &Value) -> Option<Flags> {
    let mut flags = Flags::default();
    for name in names.as_array()? {
        let name = name.as_str()?;
        flags.set(Flags::NAMES.iter().find(|(_, n)| *n == name)?.0);
    }
    Some(flags)
}

/// One event as a line; `None` where there is nothing to tell.
pub fn event_text(event: &Event) -> Option<String> {
    Some(match event {
        Event::Phase { phase: Phase::Held, .. } => "held".to_owned(),
        Event::Phase { phase: Phase::Released, release, .. } => {
            format!("release {release}: let go")
        }
        Event::Phase { .. } => return None,
        Event::Window(window) => format!(
            "  window {:2} at {:5.2} deg   wn {:8.4} rad/s   zeta {:9.6}   {}",
            window.window,
            window.amplitude_deg,
            window.natural_frequency_rad_s,
            window.damping_ratio,
            flag_names(window.flags).join(" ")
        ),
        Event::Release(result) => release_text(result),
    })
}

fn release_text(result: &ReleaseResult) -> String {
    let flags = flag_names(result.flags).join(" ");
    if result.windows == 0 {
        return format!("release {}: not usable: {flags}", result.release);
    }
    let mut text = format!(
        "release {}: wn {:.4} ± {:.4} rad/s, zeta {:.6} ± {:.6} from {} windows   {flags}",
        result.release,
        result.natural_frequency_rad_s.value,
        result.natural_frequency_rad_s.u,
        result.damping_ratio.value,
        result.damping_ratio.u,
        result.windows,
    );
    if result.flags.unusable() {
        text.push_str(" (not usable)");
    }
    if let Some(d) = result.derivatives {
        text.push_str(&format!(
            "\n  Cn_beta {:.4}, Cn_r {:.4} per rad at reduced frequency {:.3}",
            d.cn_beta, d.cn_r, d.reduced_frequency
        ));
    }
    text.trim_end().to_owned()
}
