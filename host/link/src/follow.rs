//! A device's events as text and as JSON.

use crate::client::Identity;
use crate::numbers::{named, number, release_numbers, window_numbers, Named};
use serde_json::{json, Value};
use yawrig_core::quantity::Quantity;
use yawrig_shared::wire::{
    Cause, Crash, Derivatives, Event, Flags, Forgotten, Learnt, Measured, Phase, Precise, Refined,
    ReleaseResult, Sensor, SensorKind, Start, Status, WindowResult,
};

/// Names of the flags that are set.
pub fn flag_names(flags: Flags) -> Vec<&'static str> {
    Flags::NAMES.iter().filter(|(flag, _)| flags.has(*flag)).map(|(_, name)| *name).collect()
}

const PHASES: [Phase; 5] =
    [Phase::Waiting, Phase::Held, Phase::Released, Phase::Ringing, Phase::Finished];
/// What the flags that are set mean for the user, and what to do: a sentence each.
pub fn flag_advice(flags: Flags) -> impl Iterator<Item = &'static str> {
    ADVICE.iter().filter(move |(flag, _)| flags.has(*flag)).map(|(_, text)| *text)
}

const ADVICE: [(Flags, &str); Flags::NAMES.len()] = [
    (Flags::TOO_SMALL, "too_small: the oscillation never rose above the lower end of the network's range; a refined estimate stands; for the network's, release it from further out"),
    (
        Flags::TOO_FEW_CYCLES,
        "too_few_cycles: the network found no three clean cycles within the range, at 2.5 rad/s or more; a refined estimate \
         needs one alone, and stands; for the network's, widen the range or release from further out",
    ),
    (
        Flags::SATURATED,
        "saturated: the converter was at one of its ends; centre the potentiometer, release from less far out, \
         or see that its wire is not off",
    ),
    (
        Flags::LOST_SAMPLES,
        "lost_samples: samples were lost on the way to the device; see to the line or its load, and release again",
    ),
    (
        Flags::OUT_OF_RANGE,
        "out_of_trained_range: the network was not trained there; train one with a wider range, or check the settings",
    ),
    (
        Flags::MID_SWING,
        "started_in_mid_swing: it was oscillating already when first seen; hold it still for two seconds before letting go",
    ),
    (
        Flags::CUT_SHORT,
        "cut_short: the release ended before the lower end of the range; wait until the oscillation has died down",
    ),
    (Flags::NO_NETWORK, "no_network: no network passed its checks; write one with `yawrig flash`"),
    (
        Flags::STUCK,
        "stuck: the reading did not change while the model should have moved; check the potentiometer and its coupling",
    ),
    (
        Flags::NOISY,
        "noisy: more noise or hum than 0.25 deg rms; check shielding, ground and supply of the potentiometer",
    ),
    (Flags::SPIKES, "spikes: outlying readings were left out; look for a loose contact or a worn potentiometer track"),
    (
        Flags::MISFIT,
        "misfit: the second-order model does not explain the record; look at it on the host with `yawrig diagnose`",
    ),
    (
        Flags::NOT_REFINED,
        "not_refined: no damped oscillation fits the whole record; the estimate from its windows, if there is one, stands",
    ),
    (
        Flags::NO_REFERENCE,
        "no_reference: there is no good wind-off release of this spring and axis; make one, then this one again",
    ),
    (
        Flags::MAGNET,
        "magnet: the encoder sees no magnet, or one too weak or too strong; mount it 0.5 to 3 mm away, in the middle",
    ),
    (
        Flags::LOST_COUNTS,
        "lost_counts: the encoder's index did not come after whole turns; check its supply, its cable and how fast it turns",
    ),
    (Flags::NO_SENSOR, "no_sensor: this is no potentiometer's signal; check that it is connected"),
    (
        Flags::DISTURBED,
        "disturbed: part of it is not one damped oscillation: a touch, a gust, a drifting zero; release again, and \
         if it stays, look for the cause in a record with `yawrig diagnose`",
    ),
];

fn phase_name(phase: Phase) -> &'static str {
    match phase {
        Phase::Waiting => "waiting",
        Phase::Held => "held",
        Phase::Released => "released",
        Phase::Ringing => "ringing",
        Phase::Finished => "finished",
    }
}

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
        "usable": !result.flags.unusable(),
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

/// Whether the refined values are there.
pub fn is_refined(refined: &Refined) -> bool {
    !refined.flags.has(Flags::NOT_REFINED)
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

/// What the samples are of.
pub fn sensor_text(sensor: &Sensor) -> String {
    let Sensor { rate_hz, delay_us, .. } = sensor;
    format!(
        "{}, read at {rate_hz} Hz, up to {} ms late",
        sensor_name(sensor),
        f64::from(*delay_us) / 1e3
    )
}

/// The same as JSON.
pub fn sensor_json(sensor: &Sensor) -> Value {
    json!({"kind": sensor_name(sensor), "rate_hz": sensor.rate_hz, "delay_us": sensor.delay_us})
}

fn sensor_name(sensor: &Sensor) -> &'static str {
    match sensor.kind {
        SensorKind::Potentiometer => "potentiometer",
        SensorKind::As5600 => "as5600",
        SensorKind::Quadrature => "quadrature",
        SensorKind::Absolute => "absolute",
    }
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

/// The same as JSON.
pub fn learnt_json(learnt: &Learnt) -> Value {
    let Learnt { releases, kept, forgotten } = *learnt;
    let forgotten = forgotten.map(forgotten_name);
    json!({"releases": releases, "kept": kept, "forgotten": forgotten})
}

/// Why the device forgot what it had learnt, as JSON names it.
pub fn forgotten_name(why: Forgotten) -> &'static str {
    match why {
        Forgotten::Rig => "rig",
        Forgotten::Network => "network",
        Forgotten::Contradicted => "contradicted",
        Forgotten::Damaged => "damaged",
    }
}

/// What has this name.
pub fn forgotten_of(name: &str) -> Option<Forgotten> {
    let all = [Forgotten::Rig, Forgotten::Network, Forgotten::Contradicted, Forgotten::Damaged];
    all.into_iter().find(|why| forgotten_name(*why) == name)
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
    if result.flags.unusable() {
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
        return format!(
            "release {release}: no damped oscillation fits the whole record; the estimate above stands"
        );
    }
    let mut text = format!(
        "release {release} refined: wn {} rad/s, zeta {}; the residual is {:.2} times the noise of {:.3} deg",
        precise(refined.natural_frequency_rad_s),
        shown(refined.damping_ratio),
        refined.residual_over_noise,
        refined.noise_rms_deg,
    );
    if refined.flags.of_record().unusable() {
        text.push_str(" (not usable)");
    }
    text.push_str(&derivatives_text(refined.derivatives.as_ref()));
    if refined.flags.has(Flags::MISFIT) {
        text.push_str(&format!(
            "\n  something is missing here: look at it on the host with `yawrig diagnose {record}`"
        ));
    }
    text
}

#[cfg(test)]
#[path = "follow_tests.rs"]
mod tests;
