//! The command that is printed where a file does not say what it holds: complete, with the channels that are
//! most likely meant by what their numbers do.

use super::names;
use super::quantity::{self, Quantity, Unclear};
use super::table::{Channel, Selection, FEWEST_SAMPLES};
use std::path::Path;
use yawrig_base::settings;
use yawrig_core::identify::{identify, Method, Settings};
use yawrig_core::record::Record;

/// Rates that records have as a rule, Hz: times without a unit that belong to another may be in milliseconds,
/// or numbers of samples.
const RATES_HZ: std::ops::RangeInclusive<f64> = 5.0..=100_000.0;
/// Rates that can be chosen.
const TAKEN_HZ: std::ops::RangeInclusive<f64> = 20.0..=10_000.0;
/// What stands for a rate that is not known: of a camera, and of anything else.
const FRAMES_HZ: f64 = 30.0;
const SAMPLES_HZ: f64 = 1000.0;
/// Share of its amplitude down to which what is left to itself is seen to fall.
const DECAYS_TO: f64 = 0.9;
/// Of more samples, means are looked at.
const MOST_SAMPLES: usize = 50_000;
/// Angles that are never larger may be in radians.
const LARGEST_RAD: f64 = 1.6;
/// A clock that falls back to within so many of its steps of its beginning starts anew.
const STEPS_OF_BEGINNING: f64 = 3.0;

/// What to type to have `file` read with these settings of a [`Selection`].
pub(super) fn reading(file: &Path, settings: &[(&str, &str)]) -> String {
    settings::command("convert", &[&file.to_string_lossy(), "record.csv"], settings)
}

/// What to type to have `file` read.
pub(super) fn command(file: &Path, table: &[Channel], selection: &Selection) -> String {
    let find = |wanted: &Option<String>| {
        let wanted = wanted.as_ref()?;
        table.iter().find(|c| c.name == *wanted || c.own_name() == wanted)
    };
    let chosen_time = find(&selection.time);
    let yaw = find(&selection.yaw).or_else(|| likely_yaw(table, chosen_time));
    let time = chosen_time.or_else(|| likely_time(table, yaw));
    let (mut said, mut about) = (Vec::new(), Vec::new());
    let unknown_rate = |hz: f64, about: &mut Vec<String>| {
        about.push("with the record's own rate".to_owned());
        ("rate_hz", hz.to_string())
    };
    match (selection.rate_hz, time) {
        (Some(hz), _) => said.push(("rate_hz", hz.to_string())),
        (None, Some(time)) if names::counts_samples(time.own_name()) => {
            let frames = names::counts_frames(time.own_name());
            said.push(unknown_rate(if frames { FRAMES_HZ } else { SAMPLES_HZ }, &mut about));
        }
        (None, Some(time)) => {
            said.push(("time", called(table, time)));
            let known = time.unit.as_deref().is_some_and(|unit| !unit.trim().is_empty());
            if selection.time_unit.is_none() && !known && !is_in_seconds(time) {
                said.push(("time_unit", likely_time_unit(time).to_owned()));
            }
        }
        (None, None) if yaw.is_some_and(|c| c.step_s.is_some()) => {}
        (None, None) => said.push(unknown_rate(SAMPLES_HZ, &mut about)),
    }
    said.push(("yaw", yaw.map_or("NAME".to_owned(), |yaw| called(table, yaw))));
    let quantity = |name: &str| ("quantity", name.to_owned());
    let own = yaw.and_then(unit_of);
    match quantity::meant(selection.quantity, own.or(selection.unit.as_deref())) {
        Ok(meant) => {
            // What the unit says need not be said again, but is better seen.
            if !meant.measurand.is_angle() {
                let own = meant.measurand.quantity();
                said.push(quantity(selection.quantity.map_or(own, Quantity::name)));
            }
        }
        Err(Unclear::NoUnit) => {
            let unit = match selection.quantity {
                None | Some(Quantity::Angle) => {
                    let unit = yaw.map_or("deg", likely_unit);
                    let other = if unit == "deg" { "rad" } else { "deg" };
                    let other = settings::given("unit", other);
                    about.push(format!("or {other}: the file does not say it"));
                    let other = settings::given("quantity", "displacement");
                    about.push(format!("no angle: {other}, with its unit"));
                    unit
                }
                Some(known) => {
                    said.push(quantity(known.name()));
                    about.push("with the channel's own unit".to_owned());
                    match known {
                        Quantity::Displacement => "mm",
                        Quantity::Rate => "rad/s",
                        _ => "m/s2",
                    }
                }
            };
            said.push(("unit", unit.to_owned()));
        }
        Err(Unclear::NoAngle) => {
            let likely = Quantity::likely(own.or(selection.unit.as_deref()).unwrap_or_default());
            said.push(quantity(likely.name()));
        }
        Err(Unclear::Against(_, is)) => said.push(quantity(is.name())),
    }
    if let (Some(unit), None) = (&selection.unit, own) {
        said.push(("unit", unit.clone()));
    }
    let keep = settings::name("keep");
    about.push(format!("with {keep} every file of its folder is read this way"));
    let said: Vec<(&str, &str)> = said.iter().map(|(name, value)| (*name, &**value)).collect();
    format!("{}   ({})", reading(file, &said), about.join("; "))
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
    (anew && even && TAKEN_HZ.contains(&rate_hz)).then(|| {
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

/// The numbers of a channel without its gaps.
fn finite(channel: &Channel) -> Vec<f64> {
    let values = channel.values.as_deref().unwrap_or_default();
    values.iter().copied().filter(|value| value.is_finite()).collect()
}

fn increases(channel: &Channel) -> bool {
    let values = finite(channel);
    values.len() > 2
        && values.windows(2).all(|v| v[1] >= v[0])
        && values.windows(2).filter(|v| v[1] > v[0]).count() > values.len() / 4
}

fn time_rank(channel: &Channel) -> Option<u8> {
    names::as_time(&channel.name).or_else(|| names::as_time(channel.own_name()))
}

/// Digits that a name ends with: `1` of `theta1`.
fn number_of(name: &str) -> &str {
    name.trim_start_matches(|c: char| !c.is_ascii_digit())
}

/// What a channel stands in with others: a group, or a matrix.
fn group_of(channel: &Channel) -> &str {
    let matrix = channel.name.rsplit_once('(').filter(|(_, of)| of.contains(':'));
    let group = || channel.name.strip_suffix(channel.own_name()).unwrap_or("");
    matrix.map_or_else(group, |(matrix, _)| matrix)
}

/// What increases, best by its name, beside the angle.
fn likely_time<'a>(table: &'a [Channel], yaw: Option<&Channel>) -> Option<&'a Channel> {
    let other = |c: &&Channel| yaw.is_none_or(|yaw| !std::ptr::eq(yaw, *c));
    let fit = |c: &Channel| {
        let same = |of: fn(&Channel) -> &str| yaw.is_some_and(|yaw| of(c) == of(yaw));
        let numbers = yaw.is_some_and(|yaw| number_of(c.own_name()) == number_of(yaw.own_name()));
        let length = |c: &Channel| c.values.as_ref().map_or(0, Vec::len);
        let as_long = yaw.is_none_or(|yaw| length(yaw) == length(c));
        (!as_long, !same(group_of), time_rank(c).unwrap_or(u8::MAX), !numbers)
    };
    table.iter().filter(other).filter(|c| increases(c)).min_by_key(|c| fit(c))
}

/// What swings and dies away, best by its name, then by its unit, then by how well it does so; without any,
/// what is called an angle.
fn likely_yaw<'a>(table: &'a [Channel], time: Option<&Channel>) -> Option<&'a Channel> {
    let is_other = |c: &&Channel| {
        time.is_none_or(|time| !std::ptr::eq(time, *c)) && time_rank(c) != Some(0) && !increases(c)
    };
    let rank = |c: &Channel| {
        let by_name = names::as_yaw(c.own_name()).or_else(|| names::as_angle(c.own_name()));
        let is_angle = unit_of(c).is_some_and(|unit| quantity::meant(None, Some(unit)).is_ok());
        (by_name.unwrap_or(u8::MAX), !is_angle)
    };
    let others = || table.iter().filter(is_other);
    let swings = others().filter_map(|c| Some(((rank(c), misfit(c)?), c)));
    let best = swings.min_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let named = || others().filter(|c| rank(c) < (u8::MAX, true)).min_by_key(|c| rank(c));
    let only = || {
        let mut numbers = others().filter(|c| finite(c).len() > 2);
        numbers.next().filter(|_| numbers.next().is_none())
    };
    best.map(|(_, channel)| channel).or_else(named).or_else(only)
}

/// Share of its amplitude that a damped oscillation leaves of a channel; none where it is none.
fn misfit(channel: &Channel) -> Option<f64> {
    let values = finite(channel);
    let each = values.len() / MOST_SAMPLES + 1;
    let means = values.chunks(each).map(|part| part.iter().sum::<f64>() / part.len() as f64);
    let values: Vec<f64> = means.collect();
    if values.len() < FEWEST_SAMPLES {
        return None;
    }
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let largest = values.iter().map(|value| (value - mean).abs()).fold(0.0, f64::max);
    if !(largest > 0.0 && largest.is_finite()) {
        return None;
    }
    // Neither its size nor its clock matters.
    let scaled = values.iter().map(|value| (value - mean) / largest * 10.0).collect();
    let time_s = (0..values.len()).map(|k| k as f64 / SAMPLES_HZ).collect();
    let record = Record::new("", time_s, scaled);
    let settings = Settings { from_deg: 360.0, to_deg: 1e-3, ..Settings::default() };
    let found = identify(&record, &[Method::LeastSquares], &settings).ok()?;
    let decays = found.window.to_deg < DECAYS_TO * found.window.from_deg;
    let estimate = found.estimates.first().filter(|_| decays)?;
    Some(estimate.residual_rms_deg / found.window.from_deg)
}

/// The unit that a channel says it is in.
fn unit_of(channel: &Channel) -> Option<&str> {
    let by_name = channel.own_name().rsplit_once('_').map(|(_, unit)| unit);
    let by_name = by_name.filter(|unit| quantity::angular(unit).is_some());
    by_name.or(channel.unit.as_deref()).map(str::trim).filter(|unit| !unit.is_empty())
}

fn likely_unit(channel: &Channel) -> &'static str {
    let largest = finite(channel).iter().fold(0.0f64, |most, value| most.max(value.abs()));
    // A swing of so few degrees would be a small one.
    match largest <= LARGEST_RAD {
        true => "rad",
        false => "deg",
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

/// Whole numbers count milliseconds or less; so do others that would be too slow by far.
fn likely_time_unit(time: &Channel) -> &'static str {
    let is_whole = finite(time).iter().all(|t| t.fract() == 0.0);
    let rate = per_unit(time).unwrap_or(0.0);
    let fits = |seconds: f64| TAKEN_HZ.contains(&(rate / seconds));
    match is_whole || rate < 0.5 {
        true if fits(1e-3) => "ms",
        true if fits(1e-6) => "us",
        _ => "s",
    }
}
