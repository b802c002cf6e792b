//! What the names and units of other programs' columns say.

/// Seconds in a unit of time; `None` for what is none.
pub(super) fn seconds(unit: &str) -> Option<f64> {
    match unit.trim().to_lowercase().as_str() {
        "s" | "sec" | "secs" | "second" | "seconds" | "sekunden" | "sekunde" => Some(1.0),
        "ms" | "msec" | "millisecond" | "milliseconds" => Some(1e-3),
        "us" | "µs" | "μs" | "usec" | "microsecond" | "microseconds" => Some(1e-6),
        _ => None,
    }
}

/// Whether a name counts samples.
fn is_count(text: &str) -> bool {
    ["sample", "samples", "sample number", "index", "n", "nr", "no"].contains(&text)
        || is_frame(text)
}

/// Whether a name counts pictures.
fn is_frame(text: &str) -> bool {
    ["frame", "frames", "frame number", "frame no", "bild"].contains(&text)
}

/// A unit that stands alone in a field, with or without brackets: `[s]`, `deg`.
pub(super) fn bracketed(field: &str) -> Option<String> {
    let inner = field.trim().trim_matches(['(', ')', '[', ']']).trim();
    let known = [
        "deg", "degree", "degrees", "°", "rad", "radian", "radians", "v", "volt", "volts", "mv",
        "g", "hz", "-", "deg/s", "°/s", "rad/s", "m/s", "mrad", "turn", "turns", "rev", "gon",
        "rpm", "rad/s2", "rad/s^2", "rad/s²", "deg/s2", "deg/s^2", "deg/s²", "°/s2", "°/s²", "m",
        "cm", "mm", "um", "µm", "μm", "px", "pixel", "pixels", "mm/s", "cm/s", "m/s2", "m/s^2",
        "m/s²", "mm/s2", "mm/s^2", "mm/s²",
    ];
    let is_known = known.contains(&inner.to_lowercase().as_str()) || seconds(inner).is_some();
    is_known.then(|| inner.to_owned())
}

/// The unit that a name ends with: `Yaw (deg)`, `Zeit [s]`, `t/ms`, `yaw, deg`, `time_s`.
pub(super) fn unit_in(name: &str) -> Option<String> {
    let name = name.trim();
    if let Some(open) = name.rfind(['(', '[']) {
        let inner = name[open + 1..].trim_end_matches([')', ']']).trim();
        return bracketed(inner);
    }
    let (_, last) = name.rsplit_once(['_', '/', ',', ' ', '.'])?;
    bracketed(last)
}

/// The name without its unit, in lower case.
fn stem(name: &str) -> String {
    let lower = name.trim().to_lowercase();
    let cut = match lower.find(['(', '[']) {
        Some(open) => &lower[..open],
        None if unit_in(&lower).is_some() => {
            lower.rsplit_once(['_', '/', ',', ' ', '.']).map_or(lower.as_str(), |(stem, _)| stem)
        }
        None => &lower,
    };
    cut.trim_end_matches(" in").trim_matches([' ', '_', '/', ',']).replace('_', " ")
}

fn is_number(text: &str) -> bool {
    text.bytes().all(|byte| byte.is_ascii_digit())
}

/// How surely a name says time: 0 surely, `None` not at all.
pub(super) fn as_time(name: &str) -> Option<u8> {
    let stem = stem(name);
    let surely = [
        "time",
        "zeit",
        "temps",
        "tiempo",
        "tempo",
        "timestamp",
        "time stamp",
        "elapsed",
        "elapsed time",
        "relative time",
        "messzeit",
        "t",
    ];
    if surely.contains(&stem.as_str()) || seconds(&stem).is_some_and(|_| stem.len() > 2) {
        return Some(0);
    }
    let is_numbered = stem.len() > 1 && stem.strip_prefix('t').is_some_and(is_number);
    (["x value", "x", "date", "datetime"].contains(&stem.as_str())
        || stem.contains("time")
        || is_numbered
        || is_count(&stem))
    .then_some(1)
}

/// How surely a name says yaw angle.
pub(super) fn as_yaw(name: &str) -> Option<u8> {
    let (stem, lower) = (stem(name), name.to_lowercase());
    let rates = [
        "/s", "rate", "geschw", "speed", "velocity", "dot", "accel", "torque", "moment", "setpoint",
    ];
    if rates.iter().any(|word| lower.contains(word)) {
        return None;
    }
    if ["yaw", "yaw angle", "gierwinkel", "psi", "ψ"].contains(&stem.as_str()) {
        return Some(0);
    }
    if stem.contains("yaw")
        || stem.contains("gier")
        || ["lacet", "beta", "β"].contains(&stem.as_str())
    {
        return Some(1);
    }
    ["angle", "winkel"].contains(&stem.as_str()).then_some(2)
}

/// How surely a name says angle, where it does not say yaw: as it is written in formulas.
pub(super) fn as_angle(name: &str) -> Option<u8> {
    const ANGLES: [&str; 10] =
        ["angle", "winkel", "theta", "phi", "alpha", "θ", "φ", "ϑ", "α", "roll"];
    let stem = stem(name);
    let bare = stem.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end();
    ANGLES.contains(&bare).then_some(3)
}

/// Whether a name counts the pictures of a camera.
pub(super) fn counts_frames(name: &str) -> bool {
    is_frame(&stem(name))
}

/// Whether a name counts samples instead of seconds.
pub(super) fn counts_samples(name: &str) -> bool {
    is_count(&stem(name))
}
