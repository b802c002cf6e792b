//! Which channels of a file are a record's time and yaw angle, and what is asked where that is not clear.

use super::clock;
use super::computed;
use super::names;
use super::quantity::{self, Meant, Quantity, Unclear};
use super::suggest;
use super::swing;
use super::table::{Channel, Selection, LONGEST_S, MIN_SAMPLES};
use super::units;
use std::borrow::Cow;
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_core::record::Record;

/// Channels whose swing is drawn, at most.
const MAX_PICTURES: usize = 12;

/// The channels of `table` that `selection` means as a record, and what is to be said of it. `in_order`: the
/// channels stand beside each other as somebody wrote them.
///
/// # Errors
/// Exit 3, naming the channels there are, where time, yaw angle or its unit is not clear; and for
/// numbers that are no record.
pub(super) fn record(
    file: &Path,
    table: &[Channel],
    selection: &Selection,
    in_order: bool,
) -> Result<(Record, Vec<String>)> {
    read(file, table, selection, in_order, true)
}

/// The same; where it fails and `with_command` is not set, no command is looked for.
pub(super) fn read(
    file: &Path,
    table: &[Channel],
    selection: &Selection,
    in_order: bool,
    with_command: bool,
) -> Result<(Record, Vec<String>)> {
    let mut table = Cow::Borrowed(table);
    for name in [&selection.yaw, &selection.time] {
        table = computed::with(table, name.as_deref(), file)?;
    }
    let asked = ChannelRequest { file, table: &table, selection, in_order, with_command };
    let yaw = asked.yaw()?;
    let Meant { measurand, scale } = asked.meant(yaw)?;
    let values = numbers(file, yaw)?;
    let time_s = asked.time(yaw, values.len())?;
    let yaw_deg = values.iter().map(|value| value * scale).collect();
    let mut record = Record::new(file.to_owned(), time_s, yaw_deg);
    record.measurand = measurand;
    let notes = settled(&mut record, &yaw.name)?;
    Ok((record, notes))
}

/// Leaves out of `record` what is no sample, sets its clock straight, and says what of that its user should
/// know.
///
/// # Errors
/// Exit 3, naming the sample, for numbers that are no record.
pub(super) fn settled(record: &mut Record, yaw: &str) -> Result<Vec<String>> {
    let mut notes = Vec::new();
    let rows = record.len();
    let gaps = clock::leave_out_gaps(record);
    let said = |count: usize, what: &str| format!("{count} of {rows} samples {what}");
    if gaps > 0 {
        notes.push(said(gaps, "have no number and are gaps"));
    }
    let stragglers = clock::leave_out_stragglers(record);
    if stragglers > 0 {
        notes.push(said(
            stragglers,
            "have a time before that of others in front of them and are left out",
        ));
    }
    let before = record.len();
    clock::spread(record).map_err(|why| {
        Error::data(format!("{}: {why}", record.file.display())).help(format!(
            "give a channel of finer times with {}, or the rate with {}",
            settings::name("time"),
            settings::name("rate_hz")
        ))
    })?;
    if record.len() < before {
        notes.push(said(before - record.len(), "have the time of the one before and are left out"));
    }
    check(record, yaw)?;
    Ok(notes)
}

/// What to type to have `file` read: it has been tried.
pub(super) fn command(
    file: &Path,
    table: &[Channel],
    selection: &Selection,
    in_order: bool,
) -> String {
    let tried = |tried: &Selection| Some(read(file, table, tried, in_order, false).ok()?.0);
    suggest::command(file, table, selection, in_order, &tried)
}

/// What is asked of a file, to be asked of its user where it is not clear.
pub(super) struct ChannelRequest<'a> {
    pub(super) file: &'a Path,
    pub(super) table: &'a [Channel],
    pub(super) selection: &'a Selection,
    pub(super) in_order: bool,
    pub(super) with_command: bool,
}

impl<'a> ChannelRequest<'a> {
    pub(super) fn unclear(&self, what: &str) -> Error {
        let there: Vec<String> = self.table.iter().map(Channel::described).collect();
        let file = self.file.display();
        if there.is_empty() {
            return Error::data(format!("{file}: there is no channel of numbers in it"))
                .help("export the record again, or as CSV with time_s,yaw_deg");
        }
        let there = there.join(", ");
        let pictures: String = self
            .table
            .iter()
            .filter_map(|c| Some(format!("\n  {} {}", swing::picture(c)?, c.name)))
            .take(MAX_PICTURES)
            .collect();
        let error = Error::data(format!("{file}: {what}; its channels: {there}{pictures}"));
        match self.with_command {
            true => error.help(self.command(self.selection)),
            false => error,
        }
    }

    pub(super) fn command(&self, selection: &Selection) -> String {
        command(self.file, self.table, selection, self.in_order)
    }

    /// The channel of this name, with or without its group, or of this number.
    pub(super) fn named(&self, name: &str) -> Result<&'a Channel> {
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
        let no_place = |c: &Channel| c.unit.as_deref().is_none_or(|u| units::seconds(u).is_some());
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
            (None, _) => {}
        }
        self.surest_yaw()
    }

    /// The channel whose name says most surely that it is the yaw angle.
    fn surest_yaw(&self) -> Result<Option<&'a Channel>> {
        let of = |c: &Channel| names::as_yaw(c.own_name()).or_else(|| names::as_yaw(&c.name));
        let ranked = || self.table.iter().filter_map(|c| Some((of(c)?, c)));
        let Some(best) = ranked().map(|(rank, _)| rank).min() else { return Ok(None) };
        let mut of_best = ranked().filter(|(rank, _)| *rank == best).map(|(_, channel)| channel);
        match (of_best.next(), of_best.next()) {
            (one, None) => Ok(one),
            _ => Err(self.unclear("several channels may be the yaw angle")),
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
                        settings::given(
                            "yaw",
                            &format!("({} - ZERO) * SCALE", computed::written(&yaw.name))
                        )
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
        let error = Error::data(format!("{file}: {what}"));
        Err(match self.with_command {
            true => error.help(self.command(&chosen)),
            false => error,
        })
    }
}

pub(super) fn numbers<'a>(file: &Path, channel: &'a Channel) -> Result<&'a [f64]> {
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
    if record.len() < MIN_SAMPLES {
        return Err(Error::data(format!(
            "{}: {} samples are too few for three cycles",
            record.file.display(),
            record.len()
        ))
        .help("record at least three cycles of the free decay"));
    }
    Ok(())
}
