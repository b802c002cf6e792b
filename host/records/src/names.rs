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

/// 2020-03-01, in days from the year 0 on.
const SPRING_2020: i64 = 737_791;

/// Seconds of `12:03:04.125`, or of a date with such a time behind it, from spring 2020 on.
pub(super) fn clock_s(text: &str) -> Option<f64> {
    let (date, time) = match text.trim().trim_end_matches('Z').rsplit_once(['T', ' ']) {
        Some((date, time)) => (Some(date), time),
        None => (None, text.trim()),
    };
    let mut parts = time.split(':');
    let (hours, minutes, seconds) = (parts.next()?, parts.next()?, parts.next()?);
    if parts.next().is_some() {
        return None;
    }
    let hours: u32 = hours.parse().ok().filter(|h| *h < 24)?;
    let minutes: u32 = minutes.parse().ok().filter(|m| *m < 60)?;
    let seconds: f64 =
        seconds.replace(',', ".").parse().ok().filter(|s| (0.0..61.0).contains(s))?;
    let days = match date {
        None => 0.0,
        Some(date) => days(date)?,
    };
    Some(86_400.0 * days + 3600.0 * f64::from(hours) + 60.0 * f64::from(minutes) + seconds)
}

/// Days of `2026-03-01` or `01.03.2026`, counted from a day so near that their seconds keep their digits.
fn days(date: &str) -> Option<f64> {
    let is_reversed = date.contains('.');
    let parts: Vec<&str> = date.split(if is_reversed { '.' } else { '-' }).collect();
    let [first, month, last] = parts[..] else { return None };
    let (year, day) = if is_reversed { (last, first) } else { (first, last) };
    let (year, month, day): (i64, i64, i64) =
        (year.parse().ok()?, month.parse().ok()?, day.parse().ok()?);
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    // March is the first month, so that a leap day is a year's last.
    let (year, month) = if month < 3 { (year - 1, month + 9) } else { (year, month - 3) };
    let since_year_0 = 365 * year + year / 4 - year / 100 + year / 400;
    Some((since_year_0 + (153 * month + 2) / 5 + day - SPRING_2020) as f64)
}
