//! When the samples of a channel were taken.

use super::asked::{numbers, ChannelRequest};
use super::names;
use super::suggest;
use super::swing;
use super::table::Channel;
use super::times::of_channel;
use super::units::{self, TimeUnit};
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;

/// A date's seconds are known to their seventh decimal.
const CLOCK_DIGITS: f64 = 1e7;
/// Times from a beginning so long before, s, have fewer digits than their clock.
const LONG_AGO_S: f64 = 1e6;

impl ChannelRequest<'_> {
    /// When the `length` samples of `yaw` were taken, s.
    pub(super) fn time(&self, yaw: &Channel, length: usize) -> Result<Vec<f64>> {
        let Self { file, table, selection, .. } = self;
        let by_step = |step_s: f64| Ok((0..length).map(|index| index as f64 * step_s).collect());
        let chosen = selection.time.as_deref().map(|name| self.named(name)).transpose()?;
        let found = of_channel(table, yaw, self.in_order);
        // What counts samples or pictures knows which are missing.
        let counts = |c: &&Channel| names::counts_samples(c.own_name()) && swing::increases(c);
        let channel = match (chosen, selection.rate_hz, found) {
            (Some(channel), ..) => channel,
            (None, Some(rate_hz), found) => match found.ok().flatten().filter(counts) {
                Some(counter) => counter,
                None => return by_step(1.0 / rate_hz),
            },
            (None, None, found) => match (yaw.step_s.filter(|step_s| *step_s > 0.0), found) {
                (_, Ok(Some(channel))) => channel,
                (Some(step_s), _) => return by_step(step_s),
                (None, Err(())) => return Err(self.unclear("several channels may be the time")),
                (None, Ok(None)) => {
                    let one = table.iter().filter(|c| c.values.is_ok()).count() == 1;
                    return Err(self.unclear(match one {
                        true => "there is one column, and its rate is not known",
                        false => "no channel's name says that it is the time",
                    }));
                }
            },
        };
        let values = numbers(file, channel).map_err(|error| match self.with_command {
            true => error.help(self.command(selection)),
            false => error,
        })?;
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
        let first = values.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0);
        if (first * scale).abs() < LONG_AGO_S {
            return Ok(values.iter().map(|value| value * scale).collect());
        }
        // Since some year, too few digits are left for the time between samples: what they leave is taken
        // off.
        let since = |value: &f64| ((value - first) * scale * CLOCK_DIGITS).round() / CLOCK_DIGITS;
        Ok(values.iter().map(since).collect())
    }

    fn seconds_per_unit(&self, time: &Channel) -> Result<f64> {
        let counts = names::counts_samples(time.own_name());
        let by_rate = || match self.selection.rate_hz {
            Some(rate_hz) => Ok(1.0 / rate_hz),
            None => {
                Err(self
                    .unclear(&format!("{} counts samples, and their rate is not known", time.name)))
            }
        };
        match self.selection.time_unit {
            Some(unit) => return unit.seconds().map_or_else(by_rate, Ok),
            None if counts || self.selection.rate_hz.is_some() => return by_rate(),
            None => {}
        }
        match time.unit.as_deref().map(str::trim).filter(|unit| !unit.is_empty()) {
            Some(unit) => units::seconds(unit).ok_or_else(|| {
                Error::data(format!(
                    "{}: the time in {} is in {unit:?}, not in seconds",
                    self.file.display(),
                    time.name
                ))
                .help(format!(
                    "convert it with {} ({}) of its time, or give {}",
                    settings::name("time_unit"),
                    TimeUnit::all().map(TimeUnit::name).collect::<Vec<_>>().join(", "),
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
