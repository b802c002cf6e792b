//! Channels of a file of any format, and which of them are a record's time and yaw angle.

use super::csv_file;
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_core::record::Record;
use yawrig_shared::units::deg_from_rad;

/// What the yaw angle of a file is counted in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    Deg,
    Rad,
}

impl Unit {
    /// The unit of this name or symbol, as measurement programs write it.
    fn of(text: &str) -> Option<Self> {
        match text.trim().to_lowercase().as_str() {
            "deg" | "degree" | "degrees" | "°" => Some(Self::Deg),
            "rad" | "radian" | "radians" => Some(Self::Rad),
            _ => None,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Deg => "deg",
            Self::Rad => "rad",
        }
    }
}

/// Which channels are meant, where their names do not say so.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    /// Channel of the time, s.
    pub time: Option<String>,
    /// Channel of the yaw angle.
    pub yaw: Option<String>,
    pub unit: Option<Unit>,
    /// Samples a second, where there is no time.
    pub rate_hz: Option<f64>,
}

/// One channel of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// With its group: `run/yaw_deg`.
    pub name: String,
    pub unit: Option<String>,
    /// Seconds between samples, where the channel says so itself.
    pub step_s: Option<f64>,
    /// Its numbers, or why it cannot be read.
    pub values: std::result::Result<Vec<f64>, String>,
}

impl Channel {
    /// Name without group.
    fn own_name(&self) -> &str {
        self.name.rsplit('/').next().unwrap_or(&self.name)
    }

    /// `run/yaw_deg (4000 numbers, V)`.
    fn described(&self) -> String {
        let unit = self.unit.as_ref().map_or(String::new(), |unit| format!(", {unit}"));
        match &self.values {
            Ok(values) => format!("{} ({} numbers{unit})", self.name, values.len()),
            Err(why) => format!("{} ({why})", self.name),
        }
    }
}

/// The channels of `table` that `selection` means as a record.
///
/// # Errors
/// Exit 3, naming the channels there are, where time, yaw angle or its unit is not clear; and for
/// numbers that are no record.
pub(super) fn record(file: &Path, table: &[Channel], selection: &Selection) -> Result<Record> {
    let yaw = yaw(file, table, selection)?;
    let unit = unit(file, yaw, selection)?;
    let values = numbers(file, yaw)?;
    let scale = match unit {
        Unit::Deg => 1.0,
        Unit::Rad => deg_from_rad(1.0),
    };
    let time_s = time(file, table, selection, yaw, values.len())?;
    let yaw_deg = values.iter().map(|value| value * scale).collect();
    let record = Record { file: file.to_owned(), time_s, yaw_deg };
    check(&record)?;
    Ok(record)
}

fn unclear(file: &Path, table: &[Channel], what: &str, help: &str) -> Error {
    let there: Vec<String> = table.iter().map(Channel::described).collect();
    let file = file.display();
    if there.is_empty() {
        return Error::data(format!("{file}: there is no channel of numbers in it"))
            .help("export the record anew, or as CSV with time_s,yaw_deg");
    }
    let there = there.join(", ");
    Error::data(format!("{file}: {what}; its channels: {there}"))
        .help(format!("yawrig convert {file} record.csv {help}"))
}

/// The channel of this name, with or without its group.
fn named<'a>(file: &Path, table: &'a [Channel], flag: &str, name: &str) -> Result<&'a Channel> {
    if let Some(channel) = table.iter().find(|channel| channel.name == name) {
        return Ok(channel);
    }
    let mut found = table.iter().filter(|channel| channel.own_name() == name);
    match (found.next(), found.next()) {
        (Some(channel), None) => Ok(channel),
        (None, _) => Err(unclear(
            file,
            table,
            &format!("there is no channel {name:?}"),
            &format!("{flag} NAME"),
        )),
        (Some(_), Some(_)) => Err(unclear(
            file,
            table,
            &format!("several channels are called {name:?}"),
            &format!("{flag} GROUP/{name}"),
        )),
    }
}

fn yaw<'a>(file: &Path, table: &'a [Channel], selection: &Selection) -> Result<&'a Channel> {
    if let Some(name) = &selection.yaw {
        return named(file, table, "--yaw", name);
    }
    let mut found =
        table.iter().filter(|channel| matches!(channel.own_name(), "yaw_deg" | "yaw_rad"));
    let help = "--yaw NAME --unit deg";
    match (found.next(), found.next()) {
        (Some(channel), None) => Ok(channel),
        (None, _) => Err(unclear(file, table, "no channel is called yaw_deg or yaw_rad", help)),
        (Some(_), Some(_)) => {
            Err(unclear(file, table, "several channels may be the yaw angle", "--yaw GROUP/NAME"))
        }
    }
}

fn unit(file: &Path, yaw: &Channel, selection: &Selection) -> Result<Unit> {
    let by_name = yaw.own_name().rsplit_once('_').and_then(|(_, unit)| Unit::of(unit));
    let by_property = yaw.unit.as_deref().and_then(Unit::of);
    let said = [by_name, by_property, selection.unit];
    let mut units = said.into_iter().flatten();
    let file = file.display();
    let Some(unit) = units.next() else {
        let other = match &yaw.unit {
            Some(unit) => format!("in {unit:?}"),
            None => "in an unknown unit".to_owned(),
        };
        return Err(Error::data(format!("{file}: channel {} is {other}", yaw.name)).help(format!(
            "if it is an angle: yawrig convert {file} record.csv --yaw {} --unit deg (or rad)",
            yaw.name
        )));
    };
    // A voltage is no angle, whatever the flag says.
    let other = yaw.unit.as_deref().filter(|u| !u.trim().is_empty() && Unit::of(u).is_none());
    if let Some(other) = other {
        return Err(Error::data(format!(
            "{file}: channel {} is in {other:?}, not in {}",
            yaw.name,
            unit.name()
        ))
        .help("scale it to an angle first"));
    }
    if let Some(against) = units.find(|other| *other != unit) {
        return Err(Error::data(format!(
            "{file}: channel {} is said to be in {} and in {}",
            yaw.name,
            unit.name(),
            against.name()
        ))
        .help("leave --unit away, or correct the file"));
    }
    Ok(unit)
}

fn time(
    file: &Path,
    table: &[Channel],
    selection: &Selection,
    yaw: &Channel,
    length: usize,
) -> Result<Vec<f64>> {
    let by_step = |step_s: f64| Ok((0..length).map(|index| index as f64 * step_s).collect());
    if let Some(rate_hz) = selection.rate_hz {
        return by_step(1.0 / rate_hz);
    }
    let channel = match &selection.time {
        Some(name) => named(file, table, "--time", name)?,
        None => {
            let group = yaw.name.strip_suffix(yaw.own_name()).unwrap_or("");
            let beside = format!("{group}time_s");
            let mut found = table.iter().filter(|channel| channel.own_name() == "time_s");
            match (table.iter().find(|c| c.name == beside), found.next(), found.next()) {
                (Some(channel), ..) | (None, Some(channel), None) => channel,
                _ if yaw.step_s.is_some_and(|step_s| step_s > 0.0) => {
                    return by_step(yaw.step_s.unwrap_or_default());
                }
                (_, None, _) => {
                    let help = "--time NAME (in seconds), or --rate-hz HZ";
                    return Err(unclear(file, table, "no channel is called time_s", help));
                }
                _ => {
                    let what = "several channels are called time_s";
                    return Err(unclear(file, table, what, "--time GROUP/time_s"));
                }
            }
        }
    };
    let seconds = ["s", "sec", "second", "seconds"];
    if let Some(unit) = &channel.unit {
        if !unit.trim().is_empty() && !seconds.contains(&unit.trim().to_lowercase().as_str()) {
            return Err(Error::data(format!(
                "{}: the time in {} is in {unit:?}, not in seconds",
                file.display(),
                channel.name
            ))
            .help("write it in seconds, or give --rate-hz"));
        }
    }
    let time_s = numbers(file, channel)?;
    if time_s.len() != length {
        return Err(Error::data(format!(
            "{}: {} has {} numbers and {} has {length}",
            file.display(),
            channel.name,
            time_s.len(),
            yaw.name
        ))
        .help("give the channel of the time that belongs to it with --time, or --rate-hz"));
    }
    Ok(time_s.to_vec())
}

fn numbers<'a>(file: &Path, channel: &'a Channel) -> Result<&'a [f64]> {
    channel.values.as_deref().map_err(|why| {
        Error::data(format!("{}: channel {} cannot be used: {why}", file.display(), channel.name))
            .help(
                "choose another channel with `yawrig convert --yaw` and --time, or export it anew",
            )
    })
}

/// What `csv_file` refuses line by line.
fn check(record: &Record) -> Result<()> {
    let refuse = |index: usize, what: String| {
        let file = record.file.display();
        Error::data(format!("{file}, sample {}: {what}", index + 1))
            .help("correct the file where it was recorded, or cut it here")
    };
    for (index, (time_s, yaw_deg)) in record.time_s.iter().zip(&record.yaw_deg).enumerate() {
        if !time_s.is_finite() || !yaw_deg.is_finite() {
            return Err(refuse(index, "not a finite number".to_owned()));
        }
        if index > 0 && *time_s <= record.time_s[index - 1] {
            let before = record.time_s[index - 1];
            return Err(refuse(index, format!("time runs from {before} s to {time_s} s")));
        }
        if time_s - record.time_s[0] > csv_file::LONGEST_S {
            return Err(refuse(index, "more than a day after the first sample".to_owned()));
        }
    }
    if record.len() < csv_file::FEWEST_SAMPLES {
        return Err(Error::data(format!(
            "{}: {} samples are too few for three cycles",
            record.file.display(),
            record.len()
        ))
        .help("record at least three cycles of the swing"));
    }
    Ok(())
}
