//! `--release N|all`, `--from-s`, `--to-s`: which part of a record; `--quantity`, `--yaw` and their like: how
//! it is read.

use super::choices::{time_unit, MotionChoice, QuantityChoice};
use super::common::within;
use clap::Args;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use yawrig_base::error::{Error, Result};
use yawrig_records::place::{parted, with_part, Part, Times};
use yawrig_records::{Selection, TimeUnit};

/// Rates of a day's swing of a bridge and of a microphone, with room on both sides.
const SLOWEST_HZ: f64 = 1e-3;
const FASTEST_HZ: f64 = 1e7;

#[derive(Args, Debug, Clone)]
pub struct ReleaseArg {
    /// Which release of a record that holds several, from 1, or `all` of them; also written r.csv#2
    #[arg(long, value_name = "N|all")]
    release: Option<Which>,
    /// Use what comes after this time of the record's own clock; also written r.csv#12.5s..40s
    #[arg(long, value_name = "S", allow_negative_numbers = true, conflicts_with = "release")]
    from_s: Option<f64>,
    /// Use what comes before this time
    #[arg(long, value_name = "S", allow_negative_numbers = true, conflicts_with = "release")]
    to_s: Option<f64>,
    #[command(flatten)]
    reading: ReadingArgs,
}

/// How records are read whose files do not say it.
#[derive(Args, Debug, Clone)]
pub struct ReadingArgs {
    /// What was recorded [default: what its unit says, else an angle]
    #[arg(long, value_enum)]
    quantity: Option<QuantityChoice>,
    /// What it is in, where the file does not say it: deg, rad/s, mm, V, ...
    #[arg(long, value_name = "UNIT")]
    unit: Option<String>,
    /// What the motion is called in tables, plots and reports [default: yaw; of a displacement: displacement]
    #[arg(long, value_enum)]
    motion: Option<MotionChoice>,
    /// Channel of it, by its name or number, or an expression of channels such as 'atan2(x, -y)' or
    /// '("CH 1 (V)" - 0.2) * 45' [default: the one whose name says it]
    #[arg(long, value_name = "NAME")]
    yaw: Option<String>,
    /// Channel of the time, by its name or number [default: the one whose name says it]
    #[arg(long, value_name = "NAME")]
    time: Option<String>,
    /// What the time is in, where the file does not say it; of numbers of samples --rate-hz says how many a
    /// second
    #[arg(long, value_parser = time_unit(), value_name = "TIME_UNIT")]
    time_unit: Option<TimeUnit>,
    /// Samples a second, where there is no channel of the time or it counts samples
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    rate_hz: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Which {
    All,
    Nth(usize),
}

impl FromStr for Which {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text.parse() {
            _ if text == "all" => Ok(Self::All),
            Ok(number @ 1..) => Ok(Self::Nth(number)),
            _ => Err("give a number from 1 on, or all".to_owned()),
        }
    }
}

impl ReleaseArg {
    /// How records are to be read, as far as it was said.
    ///
    /// # Errors
    /// Exit 2 for a rate that no record has.
    pub fn selection(&self) -> Result<Selection> {
        let ReadingArgs { quantity, unit, motion, yaw, time, time_unit, rate_hz } = &self.reading;
        if let Some(rate_hz) = rate_hz {
            within("--rate-hz", *rate_hz, SLOWEST_HZ, FASTEST_HZ)?;
        }
        Ok(Selection {
            time: time.clone(),
            yaw: yaw.clone(),
            quantity: quantity.map(Into::into),
            unit: unit.clone(),
            motion: motion.map(Into::into),
            time_unit: *time_unit,
            rate_hz: *rate_hz,
            ..Selection::default()
        })
    }

    /// The times that were asked for.
    pub fn times(&self) -> Times {
        Times { from_s: self.from_s, to_s: self.to_s }
    }

    /// `files` with the releases that are meant; a record that holds several, of which none was chosen, is
    /// said to.
    ///
    /// # Errors
    /// Exit 3 where a record cannot be read or has no such release.
    pub fn of(&self, files: &[PathBuf]) -> Result<Vec<PathBuf>> {
        let mut out = Vec::new();
        for file in files {
            out.extend(self.of_one(file)?);
        }
        Ok(out)
    }

    fn of_one(&self, file: &Path) -> Result<Vec<PathBuf>> {
        let chosen = parted(file).1.is_some() || file.extension().is_some_and(|e| e == "toml");
        let times = self.times();
        if times != Times::default() {
            if let (Some(from_s), Some(to_s)) = (self.from_s, self.to_s)
                && from_s >= to_s
            {
                let what = format!("--from-s {from_s} is not before --to-s {to_s}");
                return Err(Error::usage(what).help("give a time before the other"));
            }
            return match chosen {
                true => Err(Error::usage(format!("--from-s or --to-s beside {}", file.display()))
                    .help("give them with a record, without a # in its name")),
                false => Ok(vec![with_part(file, Part::Between(times))]),
            };
        }
        match self.release {
            None => Ok(vec![file.to_owned()]),
            Some(_) if chosen => Err(Error::usage(format!("--release beside {}", file.display()))
                .help("leave --release out")),
            Some(Which::Nth(number)) => Ok(vec![with_part(file, Part::Release(number))]),
            Some(Which::All) => {
                let count = yawrig_records::releases(file, &self.selection()?)?;
                Ok(match count {
                    1 => vec![file.to_owned()],
                    _ => (1..=count).map(|number| with_part(file, Part::Release(number))).collect(),
                })
            }
        }
    }
}

/// Says that a record, read so, holds more releases than the one that is judged.
pub fn warn_of_more(file: &Path, selection: &Selection) {
    if parted(file).1.is_some() {
        return;
    }
    if let Ok(count @ 2..) = yawrig_records::releases(file, selection) {
        yawrig_base::warn!(
            "{} holds {count} releases; one of them is used: choose with --release N, or --release all",
            file.display()
        );
    }
}
