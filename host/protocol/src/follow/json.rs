//! A device's events and state as JSON, and read from it.

use super::names::{flag_names, forgotten_name, is_refined, phase_name, sensor_name, PHASES};
use crate::client::Identity;
use crate::numbers::{named, number, release_numbers, window_numbers, Named};
use serde_json::{json, Value};
use yawrig_core::quantity::Quantity;
use yawrig_shared::wire::{
    counting, Cause, Derivatives, Event, Flags, Learnt, Measured, Precise, Refined, ReleaseResult,
    Sensor, Start, Status, WindowResult,
};

/// `{"value","u"}`.
pub fn quantity(measured: Measured) -> Value {
    json!({"value": number(measured.value), "u": number(measured.u)})
}

/// The same of a value that has more digits.
pub fn precise(measured: Precise) -> Quantity {
    Quantity::new(measured.value, f64::from(measured.u))
}

/// A window as `identify` lists it, with the device's own fields.
pub fn window_json(window: &WindowResult, names: &[Named]) -> Value {
    json!({
        "amplitude_deg": number(window.amplitude_deg),
        "natural_frequency_rad_s": number(window.natural_frequency_rad_s),
        "damping_ratio": number(window.damping_ratio),
        "numbers": window_numbers(names, &window.numbers),
        "midline_deg": number(window.midline_deg),
        "start_sample": window.start_sample,
        "end_sample": window.end_sample,
        "sent_sample": window.sent_sample,
        "flags": flag_names(window.flags),
    })
}

/// A release's result.
pub fn release_json(result: &ReleaseResult, names: &[Named]) -> Value {
    let given = result.windows > 0;
    json!({
        "release": result.release,
        "release_sample": result.release_sample,
        "finished_sample": result.finished_sample,
        "windows": result.windows,
        "natural_frequency_rad_s": given.then(|| quantity(result.natural_frequency_rad_s)),
        "damping_ratio": given.then(|| quantity(result.damping_ratio)),
        "numbers": release_numbers(names, &result.numbers),
        "derivatives": result.derivatives.as_ref().map(derivatives_json),
        "usable": counting(Some(result), None).is_some(),
        "flags": flag_names(result.flags),
    })
}

fn derivatives_json(d: &Derivatives) -> Value {
    json!({
        "cn_beta": number(d.cn_beta.value),
        "cn_beta_u": number(d.cn_beta.u),
        "cn_r": number(d.cn_r.value),
        "cn_r_u": number(d.cn_r.u),
        "reduced_frequency": number(d.reduced_frequency),
        "reference_release": d.reference_release,
    })
}

/// A release's refined result; its values are null where there are none.
pub fn refined_json(refined: &Refined) -> Value {
    let given = is_refined(refined);
    json!({
        "release": refined.release,
        "from_sample": refined.from_sample,
        "samples": refined.samples,
        "natural_frequency_rad_s": given.then(|| precise(refined.natural_frequency_rad_s)),
        "damping_ratio": given.then(|| quantity(refined.damping_ratio)),
        "noise_rms_deg": given.then(|| number(refined.noise_rms_deg)),
        "residual_over_noise": given.then(|| number(refined.residual_over_noise)),
        "derivatives": refined.derivatives.as_ref().map(derivatives_json),
        "usable": counting(None, Some(refined)).is_some(),
        "misfit": refined.flags.has(Flags::MISFIT),
        "flags": flag_names(refined.flags),
    })
}

/// One event as a JSON object.
pub fn event_json(event: &Event, names: &[Named]) -> Value {
    let (name, mut object) = match event {
        Event::Phase { phase, release, at_sample } => (
            "phase",
            json!({"phase": phase_name(*phase), "release": release, "at_sample": at_sample}),
        ),
        Event::Window(window) => {
            let mut object = window_json(window, names);
            object["release"] = json!(window.release);
            object["window"] = json!(window.window);
            ("window", object)
        }
        Event::Release(result) => ("release", release_json(result, names)),
        Event::Refined(refined) => ("refined", refined_json(refined)),
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
            "numbers": named(&status.network)
                .iter()
                .map(|Named { name, unit }| json!({"name": name, "unit": unit}))
                .collect::<Vec<_>>(),
        },
    })
}

/// The same as JSON.
pub fn sensor_json(sensor: &Sensor) -> Value {
    json!({"kind": sensor_name(sensor), "rate_hz": sensor.rate_hz, "delay_us": sensor.delay_us})
}

/// The same as JSON.
pub fn start_json(start: &Start) -> Value {
    let cause = match start.cause {
        Cause::Unknown => "unknown",
        Cause::Power => "power",
        Cause::Pin => "pin",
        Cause::Watchdog => "watchdog",
        Cause::Software => "software",
    };
    let crash = start.crash.as_ref();
    json!({"cause": cause, "crash": crash.map(|c| json!({"file": c.file.as_str(), "line": c.line}))})
}

/// The same as JSON.
pub fn learnt_json(learnt: &Learnt) -> Value {
    let Learnt { releases, kept, forgotten } = *learnt;
    let forgotten = forgotten.map(forgotten_name);
    json!({"releases": releases, "kept": kept, "forgotten": forgotten})
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
    let derivatives = || match &object["derivatives"] {
        Value::Null => Some(None),
        d => Some(Some(Derivatives {
            // Stored before they had an uncertainty and a reference: without.
            cn_beta: Measured {
                value: real(d, "cn_beta")?,
                u: real(d, "cn_beta_u").unwrap_or(f32::NAN),
            },
            cn_r: Measured { value: real(d, "cn_r")?, u: real(d, "cn_r_u").unwrap_or(f32::NAN) },
            reduced_frequency: real(d, "reduced_frequency")?,
            reference_release: d["reference_release"]
                .as_u64()
                .and_then(|number| u32::try_from(number).ok())
                .unwrap_or(u32::MAX),
        })),
    };
    let numbers = || object["numbers"].as_array().into_iter().flatten();
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
            numbers: numbers().map(|of| real(of, "value")).collect::<Option<_>>()?,
            flags: flags_named(&object["flags"])?,
        }),
        "release" => Event::Release(ReleaseResult {
            release,
            release_sample: sample("release_sample")?,
            finished_sample: sample("finished_sample")?,
            windows: small("windows")?,
            natural_frequency_rad_s: measured("natural_frequency_rad_s")?,
            damping_ratio: measured("damping_ratio")?,
            numbers: numbers()
                .map(|of| Some(Measured { value: real(of, "value")?, u: real(of, "u")? }))
                .collect::<Option<_>>()?,
            derivatives: derivatives()?,
            flags: flags_named(&object["flags"])?,
        }),
        "refined" => Event::Refined(Refined {
            release,
            from_sample: sample("from_sample")?,
            samples: sample("samples")?,
            natural_frequency_rad_s: match &object["natural_frequency_rad_s"] {
                Value::Null => Precise::default(),
                of => Precise { value: of["value"].as_f64()?, u: real(of, "u")? },
            },
            damping_ratio: measured("damping_ratio")?,
            noise_rms_deg: real(object, "noise_rms_deg").unwrap_or_default(),
            residual_over_noise: real(object, "residual_over_noise").unwrap_or_default(),
            derivatives: derivatives()?,
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
