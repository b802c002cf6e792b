//! What the names and units of other programs' columns say.

use super::quantity;
use super::units;

/// Of what else a channel may hold, without `/s` and its like.
const OTHERS: [&str; 52] = [
    "V", "volt", "volts", "mV", "uV", "\u{b5}V", "\u{3bc}V", "A", "mA", "g", "mg", "m", "cm", "mm",
    "um", "\u{b5}m", "\u{3bc}m", "nm", "km", "in", "inch", "ft", "px", "pixel", "pixels", "Hz",
    "kHz", "N", "mN", "kN", "Nm", "N m", "kg", "Pa", "kPa", "bar", "mbar", "hPa", "K", "\u{b0}C",
    "T", "mT", "uT", "\u{b5}T", "\u{3bc}T", "%", "counts", "count", "digits", "LSB", "ticks",
    "steps",
];
const PER: [&str; 7] = ["/s2", "/s^2", "/s\u{b2}", "/s/s", "/s\u{b3}", "/s", "/sec"];

/// Whether this is how a unit of any kind is written.
pub(super) fn is_known(unit: &str) -> bool {
    let unit = unit.trim();
    if unit == "-" || units::seconds(unit).is_some() || quantity::angular(unit).is_some() {
        return true;
    }
    let per = PER.iter().find_map(|per| unit.strip_suffix(per)).unwrap_or(unit);
    let is = |known: &str| known == per || known.len() > 1 && known.eq_ignore_ascii_case(per);
    OTHERS.iter().any(|known| is(known)) || ["v", "rpm"].contains(&per)
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
    is_known(inner).then(|| inner.to_owned())
}

/// The unit that a name says and what it says besides: of `Yaw (deg)`, `Position (mm) Run #1`, `Zeit [s]`,
/// `t/ms`, `yaw, deg`, `time_s`, `rate_rad_s`. A unit of time without brackets belongs to a name that says
/// time: `V_s` is one.
fn parted(name: &str) -> (String, Option<String>) {
    let name = name.trim();
    for (open, _) in name.match_indices(['(', '[']).collect::<Vec<_>>().into_iter().rev() {
        let inside = &name[open + 1..];
        let close = inside.find([')', ']']).unwrap_or(inside.len());
        let around = || format!("{} {}", &name[..open], inside.get(close + 1..).unwrap_or(""));
        if let Some(unit) = bracketed(&inside[..close]) {
            return (around().trim().to_owned(), Some(unit));
        }
        // In capitals as the rest of the name: `TIME (S)`.
        let lower = inside[..close].trim().to_lowercase();
        if units::seconds(&lower).is_some() && says_time(&cleaned(&name[..open])) {
            return (around().trim().to_owned(), Some(lower));
        }
    }
    if name.contains(['(', '[']) {
        return (name.to_owned(), None);
    }
    for sign in [' ', ',', '_', '.', '/'] {
        let Some((stem, last)) = name.rsplit_once(sign) else { continue };
        if let Some((before, over)) = stem.rsplit_once('_').filter(|_| sign == '_') {
            // A stroke cannot stand in a variable's name.
            let per = format!("{over}/{last}");
            if (last == "s" || last == "s2") && is_known(&per) && !says_time(&cleaned(stem)) {
                return (before.to_owned(), Some(per));
            }
        }
        let of_time = match name.chars().any(char::is_lowercase) {
            true => last.trim().to_owned(),
            false => last.trim().to_lowercase(),
        };
        match (units::seconds(&of_time).is_some(), says_time(&cleaned(stem))) {
            (true, true) => return (stem.to_owned(), Some(of_time)),
            (false, _) => match bracketed(last).filter(|unit| !is_letter(sign, unit)) {
                Some(unit) => return (stem.to_owned(), Some(unit)),
                None => continue,
            },
            (true, false) => continue,
        }
    }
    (name.to_owned(), None)
}

/// Whether it may as well be a letter that tells channels apart: `Position A`.
fn is_letter(sign: char, unit: &str) -> bool {
    let one = unit.len() == 1;
    one && (sign == ' ' || "_.".contains(sign) && !["V", "v", "g", "m"].contains(&unit))
}

/// The unit that a name says.
pub(super) fn unit_in(name: &str) -> Option<String> {
    parted(name).1
}

fn cleaned(stem: &str) -> String {
    let lower = stem.trim().to_lowercase();
    let cut = lower.find(['(', '[']).map_or(lower.as_str(), |open| &lower[..open]);
    cut.trim_end_matches(" in").trim_matches([' ', '_', '/', ',']).replace('_', " ")
}

/// The name without its unit, in lower case.
pub(super) fn stem(name: &str) -> String {
    cleaned(&parted(name).0)
}

fn is_number(text: &str) -> bool {
    text.bytes().all(|byte| byte.is_ascii_digit())
}

/// Whether these words, in lower case, are a name of the time.
fn says_time(stem: &str) -> bool {
    const TIMES: [&str; 12] = [
        "zeit",
        "temps",
        "tiempo",
        "tempo",
        "elapsed",
        "messzeit",
        "t",
        "epoch",
        "clock",
        "uhrzeit",
        "datenum",
        "zeitstempel",
    ];
    TIMES.contains(&stem) || stem.contains("time")
}

/// How surely a name says time: 0 surely, `None` not at all.
pub(super) fn as_time(name: &str) -> Option<u8> {
    let stem = stem(name);
    let timely = ["time", "timestamp", "time stamp", "elapsed time", "relative time"];
    let is_word = stem.len() > 2 && units::seconds(&stem).is_some();
    if is_word || timely.contains(&stem.as_str()) || says_time(&stem) && !stem.contains("time") {
        return Some(0);
    }
    let is_numbered = stem.len() > 1 && stem.strip_prefix('t').is_some_and(is_number);
    (["x value", "x", "date", "datetime"].contains(&stem.as_str())
        || says_time(&stem)
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

/// How surely a name says a place or a reading of a sensor, and so no angle.
pub(super) fn says_no_angle(name: &str) -> bool {
    const OTHERS: [&str; 16] = [
        "pos",
        "displacement",
        "weg",
        "voltage",
        "spannung",
        "potential",
        "force",
        "load",
        "strain",
        "pressure",
        "current",
        "accel",
        "speed",
        "velocity",
        "count",
        "adc",
    ];
    let stem = stem(name);
    OTHERS.iter().any(|word| stem.starts_with(word) || stem.contains(&format!(" {word}")))
        || ["v", "x", "y", "z", "u"]
            .iter()
            .any(|one| stem == *one || stem.starts_with(&format!("{one} ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_found_wherever_a_name_has_it() {
        for (name, unit) in [
            ("Yaw (deg)", Some("deg")),
            ("Position (mm) Run #1", Some("mm")),
            ("Run 1 Time (s)", Some("s")),
            ("Time (min)", Some("min")),
            ("TIME (S)", Some("s")),
            ("TIME_S", Some("s")),
            ("timestamp_ns", Some("ns")),
            ("t/ms", Some("ms")),
            ("yaw, deg", Some("deg")),
            ("Yaw rate deg/s", Some("deg/s")),
            ("yaw_rate_rad_s", Some("rad/s")),
            ("Angle (counts)", Some("counts")),
            ("V_S", None),
            ("V_s", None),
            ("V_C", None),
            ("Yaw (filtered)", None),
            ("Time A", None),
            ("Pos A", None),
            ("Sensor 1", None),
        ] {
            assert_eq!(unit_in(name).as_deref(), unit, "{name}");
        }
    }

    #[test]
    fn a_name_says_time_more_or_less_surely() {
        for (name, rank) in [
            ("Zeit [s]", Some(0)),
            ("timestamp_ns", Some(0)),
            ("Time (min)", Some(0)),
            ("t", Some(0)),
            ("Time A", Some(1)),
            ("Run 1 Time (s)", Some(1)),
            ("frame", Some(1)),
            ("V_S", None),
            ("Angle (deg)", None),
            ("min", Some(0)),
        ] {
            assert_eq!(as_time(name), rank, "{name}");
        }
    }

    #[test]
    fn units_of_any_kind_are_known() {
        for known in ["mm/s\u{b2}", "counts", "rad/s", "-", "Volt", "arcminutes", "g"] {
            assert!(is_known(known), "{known}");
        }
        for unknown in ["S", "C", "filtered", "run", ""] {
            assert!(!is_known(unknown), "{unknown}");
        }
    }
}
