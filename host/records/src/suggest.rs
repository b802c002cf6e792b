//! The command that is printed where a file does not say what it holds: complete, with the channels that are
//! most likely meant by what their numbers do, and run before it is printed.

use super::names;
use super::quantity::{self, Quantity, Unclear};
use super::swing::{self, finite, increases, unit_of};
use super::table::{Channel, Selection};
use super::times;
use super::units::TimeUnit;
use std::path::Path;
use yawrig_base::settings;
use yawrig_core::record::Record;

/// Rates that records have as a rule, Hz: times without a unit that belong to another may be in milliseconds,
/// or numbers of samples.
const RATES_HZ: std::ops::RangeInclusive<f64> = 5.0..=100_000.0;
/// Those of records whose times are in a unit that has to be guessed.
const LIKELY_HZ: std::ops::RangeInclusive<f64> = 20.0..=10_000.0;
/// What stands for a rate that is not known: no command runs with it. Another is tried in its place.
const UNKNOWN_HZ: &str = "HZ";
const TRIED_HZ: f64 = 100.0;
/// Angles that are never larger may be in radians.
const LARGEST_RAD: f64 = 1.6;
/// What somebody measured in a unit that nobody says: arbitrary units.
const OWN_UNIT: &str = "a.u.";
/// A clock that falls back to within so many of its steps of its beginning starts anew.
const STEPS_OF_BEGINNING: f64 = 3.0;
/// Channels that are tried, at most.
const MAX_TRIED: usize = 8;
/// From 2001 to 2065 in s since 1970; from 1890 to 2110 in days since the year 0, and from 1982 to 2064 since
/// 1900, as MATLAB and workbooks count.
const SINCE_1970_S: std::ops::Range<f64> = 1e9..3e9;
const DAYS: [std::ops::Range<f64>; 2] = [690_000.0..771_000.0, 30_000.0..60_000.0];

/// What to type to have `file` read with these settings of a [`Selection`].
pub(super) fn reading(file: &Path, settings: &[(&str, &str)]) -> String {
    settings::command("convert", &[&file.to_string_lossy(), "record.csv"], settings)
}

/// A reading of a file that may be meant.
#[derive(Default)]
struct Guess {
    reading: Selection,
    is_rate_unknown: bool,
    about: Vec<String>,
}

/// What to type to have `file` read, which `read` tries; in words where nothing that could be typed reads
/// it.
pub(super) fn command(
    file: &Path,
    table: &[Channel],
    selection: &Selection,
    in_order: bool,
    read: &dyn Fn(&Selection) -> Option<Record>,
) -> String {
    let find = |wanted: &Option<String>| {
        let wanted = wanted.as_ref()?;
        let numbered = || table.get(wanted.parse::<usize>().ok()?.checked_sub(1)?);
        table.iter().find(|c| c.name == *wanted || c.own_name() == wanted).or_else(numbered)
    };
    let chosen_time = find(&selection.time);
    let yaws = match find(&selection.yaw) {
        Some(chosen) => vec![chosen],
        None => swing::likely(table, chosen_time),
    };
    let runs = |yaw: &&Channel| {
        let time = chosen_time.or_else(|| likely_time(table, yaw, in_order));
        let guess = guessed(table, selection, yaw, time);
        let rate_hz = guess.reading.rate_hz.or(guess.is_rate_unknown.then_some(TRIED_HZ));
        let tried = Selection { rate_hz, ..guess.reading.clone() };
        read(&tried).map(|record| (guess, record))
    };
    let mut tried: Vec<(Guess, Record)> = yaws.iter().take(MAX_TRIED).filter_map(runs).collect();
    // The first of which something is found, or else the first that is read at all.
    let at = tried.iter().position(|(_, record)| swing::is_found(record)).unwrap_or(0);
    let Some((guess, _)) = (at < tried.len()).then(|| tried.swap_remove(at)) else {
        return format!(
            "say which channels are its time and its angle with {} and {}, or with {} how fast it was sampled; \
             or export it again",
            settings::name("time"),
            settings::name("yaw"),
            settings::name("rate_hz")
        );
    };
    let Guess { reading: read, is_rate_unknown, mut about } = guess;
    let keep = settings::command("convert", &[], &[("keep", "")]);
    about.push(format!("with {keep} every file of its folder is read this way"));
    let mut said = read.settings();
    if is_rate_unknown {
        said.push(("rate_hz", UNKNOWN_HZ.to_owned()));
    }
    // The channels first, then what they are.
    let order = ["time", "time_unit", "rate_hz", "yaw", "quantity", "unit"];
    said.sort_by_key(|(name, _)| order.iter().position(|known| known == name));
    let said: Vec<(&str, &str)> = said.iter().map(|(name, value)| (*name, &**value)).collect();
    format!("{}   ({})", reading(file, &said), about.join("; "))
}

/// `yaw` by its `time`, as far as its user has not said otherwise.
fn guessed(
    table: &[Channel],
    selection: &Selection,
    yaw: &Channel,
    time: Option<&Channel>,
) -> Guess {
    let mut guess = Guess { reading: selection.clone(), ..Guess::default() };
    let reading = &mut guess.reading;
    let mut unknown_rate = |whose: &str| {
        guess.is_rate_unknown = true;
        guess.about.push(format!("{UNKNOWN_HZ} stands for {whose}, which the file does not say"));
    };
    match (selection.rate_hz, time) {
        (Some(_), _) => {}
        (None, Some(time)) => {
            reading.time = Some(called(table, time));
            let is_known = time.unit.as_deref().is_some_and(|unit| !unit.trim().is_empty());
            if selection.time_unit.is_none() && !is_known {
                if counts(time) {
                    reading.time_unit = Some(TimeUnit::Samples);
                    let frames = names::counts_frames(time.own_name());
                    unknown_rate(if frames { "pictures a second" } else { "samples a second" });
                } else if !is_in_seconds(time) {
                    reading.time_unit =
                        TimeUnit::all().find(|u| u.name() == likely_time_unit(time));
                }
            } else if selection.time_unit == Some(TimeUnit::Samples) {
                unknown_rate("samples a second");
            }
        }
        (None, None) if yaw.step_s.is_some() => {}
        (None, None) => unknown_rate("samples a second"),
    }
    reading.yaw = Some(called(table, yaw));
    let own = unit_of(yaw);
    match quantity::meant(selection.quantity, own.or(selection.unit.as_deref())) {
        Ok(meant) if meant.measurand.is_angle() => {}
        // What the unit says need not be said again, but is better seen.
        Ok(meant) => reading.quantity = Quantity::named(meant.measurand.quantity()),
        Err(Unclear::NoUnit) => {
            let is_angle = matches!(selection.quantity, None | Some(Quantity::Angle))
                && !names::says_no_angle(yaw.own_name());
            let unit = if is_angle {
                let (unit, other) = likely_unit(yaw);
                let other = settings::given("unit", other);
                guess.about.push(format!("or {other}: the file does not say it"));
                let other = settings::given("quantity", "displacement");
                guess.about.push(format!("no angle: {other}, with its unit"));
                unit
            } else {
                let is = selection.quantity.filter(|said| *said != Quantity::Angle);
                reading.quantity = is.or(Some(Quantity::Displacement));
                guess
                    .about
                    .push("with the channel's own unit, which the file does not say".to_owned());
                OWN_UNIT
            };
            reading.unit = Some(unit.to_owned());
        }
        Err(Unclear::NoAngle) => {
            let name = super::computed::written(&called(table, yaw));
            if let Some(turn) = swing::counts_a_turn(yaw) {
                reading.yaw = Some(format!("{name} * 360 / {turn}"));
                reading.unit = Some("deg".to_owned());
                guess
                    .about
                    .push(format!("it begins anew after {turn}, as an encoder does after a turn"));
                return guess;
            }
            let unit = own.or(selection.unit.as_deref()).unwrap_or_default();
            reading.quantity = Some(Quantity::likely(unit));
            let sum = format!("({name} - ZERO) * SCALE");
            let angle = settings::given("yaw", &sum);
            guess
                .about
                .push(format!("as an angle by its calibration: {angle}, with the angle's unit"));
        }
        Err(Unclear::Against(_, is)) => reading.quantity = Some(is),
    }
    guess
}

/// Whether numbers count samples: by their name, or one by one without a name that says time.
fn counts(time: &Channel) -> bool {
    let values = finite(time);
    let by_one = values.windows(2).all(|v| v[1] - v[0] == 1.0);
    names::counts_samples(time.own_name()) || by_one && times::rank(time).is_none()
}

/// For a `record` whose clock falls to `time_s` at sample `index`: where it starts anew there and was even
/// before, the command that reads all of it by its rate.
pub(super) fn by_rate(record: &Record, index: usize, time_s: f64, yaw: &str) -> Option<String> {
    let before = record.time_s.get(..index)?;
    let (first, last) = (before.first()?, before.last()?);
    let step_s = (last - first) / (before.len().checked_sub(1)?) as f64;
    let anew = time_s <= first + STEPS_OF_BEGINNING * step_s;
    let off = |(k, t): (usize, &f64)| (t - first - k as f64 * step_s).abs();
    let even = before.iter().enumerate().map(off).fold(0.0, f64::max) < step_s;
    let rate_hz = step_s.recip();
    (anew && even && RATES_HZ.contains(&rate_hz)).then(|| {
        let rate_hz = ((rate_hz * 1e4).round() / 1e4).to_string();
        format!(
            "the clock starts anew there; by the rate before it: {}   (then `{}`)",
            reading(&record.file, &[("rate_hz", &rate_hz), ("yaw", yaw)]),
            settings::command("identify", &["record.csv"], &[("release", "all")])
        )
    })
}

/// What selects it: a column without a name its number.
fn called(table: &[Channel], channel: &Channel) -> String {
    let is_one = table.iter().filter(|c| c.name == channel.name).count() == 1;
    match channel.name.strip_prefix("column ") {
        Some(number) => number.to_owned(),
        None if is_one => channel.name.clone(),
        None => {
            let at = table.iter().position(|c| std::ptr::eq(c, channel));
            at.map_or_else(|| channel.name.clone(), |at| (at + 1).to_string())
        }
    }
}

/// What is the time of `yaw` by its name, or increases beside it.
fn likely_time<'a>(table: &'a [Channel], yaw: &Channel, in_order: bool) -> Option<&'a Channel> {
    let length = |c: &Channel| c.values.as_ref().map_or(0, Vec::len);
    let by_name = times::of_channel(table, yaw, in_order).ok().flatten();
    if let Some(time) = by_name.filter(|c| increases(c) && length(c) == length(yaw)) {
        return Some(time);
    }
    let fit = |c: &Channel| {
        (
            length(yaw) != length(c),
            times::group_of(c) != times::group_of(yaw),
            times::rank(c).unwrap_or(u8::MAX),
            times::marks(c.own_name()) != times::marks(yaw.own_name()),
        )
    };
    let others = table.iter().filter(|c| !std::ptr::eq(*c, yaw) && increases(c));
    others.min_by_key(|c| fit(c))
}

/// In degrees or radians, and the other of the two.
fn likely_unit(channel: &Channel) -> (&'static str, &'static str) {
    let largest = finite(channel).iter().fold(0.0f64, |most, value| most.max(value.abs()));
    // A swing of so few degrees would be a small one.
    match largest <= LARGEST_RAD {
        true => ("rad", "deg"),
        false => ("deg", "rad"),
    }
}

/// Numbers in a unit of time.
fn per_unit(time: &Channel) -> Option<f64> {
    match finite(time).as_slice() {
        known @ [first, .., last] => Some((known.len() - 1) as f64 / (last - first)),
        _ => None,
    }
}

/// Whether times without a unit can be seconds.
pub(super) fn is_in_seconds(time: &Channel) -> bool {
    per_unit(time).is_some_and(|rate_hz| RATES_HZ.contains(&rate_hz))
}

/// By the calendar, where its beginning is in our days. Else whole numbers count milliseconds or less; so do
/// others that would be too slow by far.
fn likely_time_unit(time: &Channel) -> &'static str {
    const SMALL: [(&str, f64); 3] = [("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];
    let values = finite(time);
    let rate = per_unit(time).unwrap_or(0.0);
    let first = values.first().copied().unwrap_or(0.0);
    let calendar = SMALL.into_iter().find(|(_, s)| SINCE_1970_S.contains(&(first * s)));
    if let Some((unit, _)) = calendar {
        return unit;
    }
    if DAYS.iter().any(|days| days.contains(&first)) && RATES_HZ.contains(&(rate / 86_400.0)) {
        return "d";
    }
    let is_whole = values.iter().all(|t| t.fract() == 0.0);
    let small = SMALL.into_iter().find(|(_, s)| LIKELY_HZ.contains(&(rate / s)));
    match small.filter(|_| is_whole || rate < 0.5) {
        Some((unit, _)) => unit,
        None => "s",
    }
}
