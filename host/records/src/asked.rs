//! Which channels of a file are a record's time and yaw angle, and what is asked where that is not clear.

use super::clock;
use super::computed;
use super::names;
use super::quantity::{self, Meant, Quantity, Unclear};
use super::suggest;
use super::table::{Channel, Selection, TimeUnit, FEWEST_SAMPLES, LONGEST_S};
use std::borrow::Cow;
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_core::record::Record;

/// A date's seconds are known to their seventh decimal.
const CLOCK_DIGITS: f64 = 1e7;

/// The channels of `table` that `selection` means as a record. `by_name`: names that say time and yaw angle
/// in the field's words are taken, numbers that are missing are gaps.
///
/// # Errors
/// Exit 3, naming the channels there are, where time, yaw angle or its unit is not clear; and for
/// numbers that are no record.
pub(super) fn record(
    file: &Path,
    table: &[Channel],
    selection: &Selection,
    by_name: bool,
) -> Result<Record> {
    let mut table = Cow::Borrowed(table);
    for name in [&selection.yaw, &selection.time] {
        table = computed::with(table, name.as_deref(), file)?;
    }
    let asked = ChannelRequest { file, table: &table, selection, by_name };
    let yaw = asked.yaw()?;
    let Meant { measurand, scale } = asked.meant(yaw)?;
    let values = numbers(file, yaw)?;
    let time_s = asked.time(yaw, values.len())?;
    let yaw_deg = values.iter().map(|value| value * scale).collect();
    let mut record = Record::new(file.to_owned(), time_s, yaw_deg);
    record.measurand = measurand;
    if by_name {
        clock::leave_out_gaps(&mut record);
        clock::spread(&mut record);
    }
    check(&record, &yaw.name)?;
    Ok(record)
}

/// What is asked of a file, to be asked of its user where it is not clear.
struct ChannelRequest<'a> {
    file: &'a Path,
    table: &'a [Channel],
    selection: &'a Selection,
    by_name: bool,
}

impl<'a> ChannelRequest<'a> {
    fn unclear(&self, what: &str) -> Error {
        let there: Vec<String> = self.table.iter().map(Channel::described).collect();
        let file = self.file.display();
        if there.is_empty() {
            return Error::data(format!("{file}: there is no channel of numbers in it"))
                .help("export the record again, or as CSV with time_s,yaw_deg");
        }
        let there = there.join(", ");
        let command = suggest::command(self.file, self.table, self.selection);
        Error::data(format!("{file}: {what}; its channels: {there}")).help(command)
    }

    /// The channel of this name, with or without its group, or of this number.
    fn named(&self, name: &str) -> Result<&'a Channel> {
        if let Some(channel) = self.table.iter().find(|channel| channel.name == name) {
            return Ok(channel);
        }
        let mut found = self.table.iter().filter(|channel| channel.own_name() == name);
        match (found.next(), found.next()) {
            (Some(channel), None) => Ok(channel),
            (None, _) => {
                let number = name.parse::<usize>().ok().and_then(|n| n.checked_sub(1));
                number
                    .and_then(|k| self.table.get(k))
                    .ok_or_else(|| self.unclear(&format!("there is no channel {name:?}")))
            }
            (Some(first), Some(_)) => {
                Err(self
                    .unclear(&format!("several channels are called {name:?}, as {}", first.name)))
            }
        }
    }

    fn yaw(&self) -> Result<&'a Channel> {
        if let Some(name) = &self.selection.yaw {
            return self.named(name);
        }
        if matches!(self.selection.quantity, None | Some(Quantity::Angle))
            && let Some(yaw) = self.called_yaw()?
        {
            return Ok(yaw);
        }
        // Of two, one the time and the other by its unit what is meant, that is it.
        let numbers = self.table.iter().filter(|c| c.values.is_ok());
        // What is called x may be a place.
        let no_place = |c: &Channel| c.unit.as_deref().is_none_or(|u| names::seconds(u).is_some());
        let is_time = |c: &Channel| names::as_time(c.own_name()).is_some() && no_place(c);
        let others: Vec<&Channel> = numbers.filter(|c| !is_time(c)).collect();
        let is_meant = |c: &Channel| match (self.selection.quantity, c.unit.as_deref()) {
            (quantity, Some(unit)) => quantity::meant(quantity, Some(unit)).is_ok(),
            (quantity, None) => quantity.is_some() && self.selection.unit.is_some(),
        };
        let fit: Vec<&Channel> = others.iter().copied().filter(|c| is_meant(c)).collect();
        match (others.as_slice(), fit.as_slice()) {
            ([_], [one]) => Ok(one),
            // Of several, what alone is of the quantity that somebody names.
            (_, [one]) if self.selection.quantity.is_some() => Ok(one),
            _ => Err(self.unclear(&match self.selection.quantity {
                None | Some(Quantity::Angle) => {
                    "no channel's name says that it is the yaw angle".to_owned()
                }
                Some(quantity) => format!("which channel is the {}?", quantity.name()),
            })),
        }
    }

    /// The channel whose name says that it is the yaw angle.
    fn called_yaw(&self) -> Result<Option<&'a Channel>> {
        let mut found =
            self.table.iter().filter(|channel| matches!(channel.own_name(), "yaw_deg" | "yaw_rad"));
        match (found.next(), found.next()) {
            (Some(channel), None) => return Ok(Some(channel)),
            (Some(_), Some(_)) => return Err(self.unclear("several channels may be the yaw angle")),
            (None, _) if !self.by_name => {
                return Err(self.unclear("no channel is called yaw_deg or yaw_rad"))
            }
            (None, _) => {}
        }
        self.surest(names::as_yaw, "the yaw angle")
    }

    /// The channel whose name says it most surely.
    fn surest(&self, rank: fn(&str) -> Option<u8>, what: &str) -> Result<Option<&'a Channel>> {
        let ranked = || self.table.iter().filter_map(|c| Some((rank(&c.name)?, c)));
        let Some(best) = ranked().map(|(rank, _)| rank).min() else { return Ok(None) };
        let mut of_best = ranked().filter(|(rank, _)| *rank == best).map(|(_, channel)| channel);
        match (of_best.next(), of_best.next()) {
            (one, None) => Ok(one),
            _ => Err(self.unclear(&format!("several channels may be {what}"))),
        }
    }

    /// What the numbers of `yaw` are.
    fn meant(&self, yaw: &Channel) -> Result<Meant> {
        let (quantity, unit) = (self.selection.quantity, self.selection.unit.as_deref());
        if let (Some(meant), None) = (quantity::of_column(yaw.own_name()), unit)
            && quantity.is_none_or(|said| said.name() == meant.measurand.quantity())
        {
            return Ok(meant);
        }
        let by_name = yaw.own_name().rsplit_once('_').map(|(_, unit)| unit);
        let by_name = by_name.filter(|unit| quantity::angular(unit).is_some());
        let own = by_name.or(yaw.unit.as_deref()).map(str::trim).filter(|unit| !unit.is_empty());
        let file = self.file.display();
        if let (Some(own), Some(said)) = (own, unit) {
            // A voltage is no angle, whatever is said of it.
            match (quantity::angular(own), quantity::angular(said)) {
                _ if own == said => {}
                (Some(a), Some(b)) if a == b => {}
                (Some(_), Some(_)) => {
                    let name = &yaw.name;
                    return Err(Error::data(format!(
                        "{file}: channel {name} is said to be in {own} and in {said}"
                    ))
                    .help(format!("leave {} away, or correct the file", settings::name("unit"))));
                }
                _ => {
                    return Err(Error::data(format!(
                        "{file}: channel {} is in {own:?}, not in {said}",
                        yaw.name
                    ))
                    .help(format!(
                        "leave {} away; to convert it, an expression of channels: {}",
                        settings::name("unit"),
                        settings::given("yaw", "(V - 0.217) * 3.38")
                    )));
                }
            }
        }
        let unclear = match quantity::meant(quantity, own.or(unit)) {
            Ok(meant) => return Ok(meant),
            Err(unclear) => unclear,
        };
        let unit = own.or(unit).unwrap_or_default();
        let what = unclear.said_of(&format!("channel {}", yaw.name), unit);
        let chosen = Selection {
            yaw: Some(yaw.name.clone()),
            quantity: quantity.filter(|_| unclear == Unclear::NoUnit),
            ..self.selection.clone()
        };
        let command = suggest::command(self.file, self.table, &chosen);
        Err(Error::data(format!("{file}: {what}")).help(command))
    }

    fn time(&self, yaw: &Channel, length: usize) -> Result<Vec<f64>> {
        let Self { file, table, selection, .. } = self;
        let by_step = |step_s: f64| Ok((0..length).map(|index| index as f64 * step_s).collect());
        let chosen = selection.time.as_deref().map(|name| self.named(name)).transpose()?;
        if let (Some(rate_hz), None) = (selection.rate_hz, chosen) {
            return by_step(1.0 / rate_hz);
        }
        let beside = || {
            let group = yaw.name.strip_suffix(yaw.own_name()).unwrap_or("");
            let beside = format!("{group}time_s");
            let mut found = table.iter().filter(|channel| channel.own_name() == "time_s");
            match (table.iter().find(|c| c.name == beside), found.next(), found.next()) {
                (Some(channel), ..) | (None, Some(channel), None) => Ok(Some(channel)),
                (_, None, _) if self.by_name => match self.time_of(group) {
                    Some(time) => Ok(Some(time)),
                    None => self.surest(names::as_time, "the time"),
                },
                (_, None, _) => Ok(None),
                _ => Err(self.unclear("several channels are called time_s")),
            }
        };
        let channel = match chosen {
            Some(channel) => channel,
            None => match (yaw.step_s.filter(|step_s| *step_s > 0.0), beside()) {
                (_, Ok(Some(channel))) => channel,
                (Some(step_s), _) => return by_step(step_s),
                (None, Err(unclear)) => return Err(unclear),
                (None, Ok(None)) => {
                    let one = table.iter().filter(|c| c.values.is_ok()).count() == 1;
                    return Err(self.unclear(match (self.by_name, one) {
                        (true, true) => "there is one column, and its rate is not known",
                        (true, false) => "no channel's name says that it is the time",
                        (false, _) => "no channel is called time_s",
                    }));
                }
            },
        };
        let values = numbers(file, channel)?;
        if values.len() != length {
            return Err(Error::data(format!(
                "{}: {} has {} numbers and {} has {length}",
                file.display(),
                channel.name,
                values.len(),
                yaw.name
            ))
            .help(format!(
                "give the channel of the time that belongs to it with {}, or {}",
                settings::name("time"),
                settings::name("rate_hz")
            )));
        }
        let scale = self.seconds_per_unit(channel)?;
        // Days since some year leave too few digits for the time between samples.
        let begin = values
            .first()
            .copied()
            .filter(|first| self.by_name && first.abs() > 1e6)
            .unwrap_or(0.0);
        // What their own digits leave is taken off.
        let since = |value: &f64| match begin == 0.0 {
            true => *value,
            false => ((value - begin) * CLOCK_DIGITS).round() / CLOCK_DIGITS,
        };
        Ok(values.iter().map(|value| since(value) * scale).collect())
    }

    /// The only channel of a group, a sheet for instance, that is called time.
    fn time_of(&self, group: &str) -> Option<&'a Channel> {
        let is_time = |c: &&Channel| names::as_time(c.own_name()) == Some(0);
        let of_group = |c: &&Channel| c.name.strip_suffix(c.own_name()) == Some(group);
        let mut found = self.table.iter().filter(of_group).filter(is_time);
        found.next().filter(|_| !group.is_empty() && found.next().is_none())
    }

    fn seconds_per_unit(&self, time: &Channel) -> Result<f64> {
        let counts = names::counts_samples(time.own_name()) && self.by_name;
        let by_rate = || match self.selection.rate_hz {
            Some(rate_hz) => Ok(1.0 / rate_hz),
            None => {
                Err(self
                    .unclear(&format!("{} counts samples, and their rate is not known", time.name)))
            }
        };
        match self.selection.time_unit {
            Some(TimeUnit::S) => return Ok(1.0),
            Some(TimeUnit::Ms) => return Ok(1e-3),
            Some(TimeUnit::Us) => return Ok(1e-6),
            Some(TimeUnit::Samples) => return by_rate(),
            None if counts || self.selection.rate_hz.is_some() => return by_rate(),
            None => {}
        }
        match time.unit.as_deref().map(str::trim).filter(|unit| !unit.is_empty()) {
            Some(unit) => names::seconds(unit).ok_or_else(|| {
                Error::data(format!(
                    "{}: the time in {} is in {unit:?}, not in seconds",
                    self.file.display(),
                    time.name
                ))
                .help(format!(
                    "convert it with {} (s, ms or us) of its time, or give {}",
                    settings::name("time_unit"),
                    settings::name("rate_hz")
                ))
            }),
            // Of all units but seconds a record would be too slow or too fast.
            None if suggest::is_in_seconds(time) => Ok(1.0),
            None => {
                Err(self.unclear(&format!("the unit of the time in {} is not known", time.name)))
            }
        }
    }
}

fn numbers<'a>(file: &Path, channel: &'a Channel) -> Result<&'a [f64]> {
    channel.values.as_deref().map_err(|why| {
        Error::data(format!("{}: channel {} cannot be used: {why}", file.display(), channel.name))
            .help(format!(
                "convert it with another channel, {} and {}, or export it again",
                settings::name("yaw"),
                settings::name("time")
            ))
    })
}

/// What `csv_file` refuses line by line.
pub(super) fn check(record: &Record, yaw: &str) -> Result<()> {
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
            let error = refuse(index, format!("time runs from {before} s to {time_s} s"));
            return Err(match suggest::by_rate(record, index, *time_s, yaw) {
                Some(command) => error.help(command),
                None => error,
            });
        }
        if time_s - record.time_s[0] > LONGEST_S {
            return Err(refuse(index, "more than a day after the first sample".to_owned()));
        }
    }
    if record.len() < FEWEST_SAMPLES {
        return Err(Error::data(format!(
            "{}: {} samples are too few for three cycles",
            record.file.display(),
            record.len()
        ))
        .help("record at least three cycles of the free decay"));
    }
    Ok(())
}
