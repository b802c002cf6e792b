//! A device's events as text and as JSON.

use crate::quantity::Quantity;
use serde_json::{json, Value};
use yawrig_shared::wire::{
    Derivatives, Event, Flags, Measured, Phase, Precise, Refined, ReleaseResult, WindowResult,
};

/// Names of the flags that are set.
pub fn flag_names(flags: Flags) -> Vec<&'static str> {
    Flags::NAMES.iter().filter(|(flag, _)| flags.has(*flag)).map(|(_, name)| *name).collect()
}

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

/// The same of a value that has more digits.
pub fn precise(measured: Precise) -> Quantity {
    Quantity::new(measured.value, f64::from(measured.u))
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
    let given = result.windows > 0;
    json!({
        "release": result.release,
        "release_sample": result.release_sample,
        "finished_sample": result.finished_sample,
        "windows": result.windows,
        "natural_frequency_rad_s": given.then(|| quantity(result.natural_frequency_rad_s)),
        "damping_ratio": given.then(|| quantity(result.damping_ratio)),
        "derivatives": result.derivatives.as_ref().map(derivatives_json),
        "usable": !result.flags.unusable(),
        "flags": flag_names(result.flags),
    })
}

fn derivatives_json(d: &Derivatives) -> Value {
    json!({
        "cn_beta": number(d.cn_beta),
        "cn_r": number(d.cn_r),
        "reduced_frequency": number(d.reduced_frequency),
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
        Event::Refined(refined) => ("refined", refined_json(refined)),
    };
    object["schema_version"] = json!(1);
    object["event"] = json!(name);
    object
}

/// One event as a line; `None` where there is nothing to tell. `record` is what the host can diagnose.
pub fn event_text(event: &Event, record: &str) -> Option<String> {
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
        Event::Refined(refined) => refined_text(refined, record),
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
    text.push_str(&derivatives_text(result.derivatives.as_ref()));
    text.trim_end().to_owned()
}

fn derivatives_text(derivatives: Option<&Derivatives>) -> String {
    derivatives.map_or(String::new(), |d| {
        format!(
            "\n  Cn_beta {:.4}, Cn_r {:.4} per rad at reduced frequency {:.3}",
            d.cn_beta, d.cn_r, d.reduced_frequency
        )
    })
}

fn refined_text(refined: &Refined, record: &str) -> String {
    let release = refined.release;
    if !is_refined(refined) {
        return format!(
            "release {release}: no damped oscillation fits the whole record; the estimate above stands"
        );
    }
    let zeta = refined.damping_ratio;
    let mut text = format!(
        "release {release} refined: wn {} rad/s, zeta {}; the residual is {:.2} times the noise of {:.3} deg",
        precise(refined.natural_frequency_rad_s),
        Quantity::new(f64::from(zeta.value), f64::from(zeta.u)),
        refined.residual_over_noise,
        refined.noise_rms_deg,
    );
    if refined.flags.unusable() {
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
