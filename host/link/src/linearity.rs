//! A device's table for its converter and sensor: made of releases that were recorded through them, written,
//! and forgotten.

use crate::client::{Client, LinkError};
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::settings;
use yawrig_core::linearity::{Knots, Learned, Swings};
use yawrig_core::record::Record;
use yawrig_protocol::linearity::code_counts;
pub use yawrig_protocol::linearity::{absent_name, codes, json, text};
use yawrig_shared::linearity::{Head, Table, KNOTS, MIN_KNOTS};
use yawrig_shared::wire::{LinearityPart, Refusal, Request, Settings, PART_KNOTS};

/// Fewest releases: what is one release's own is to be told from what is the sensor's.
pub const MIN_RELEASES: usize = 3;
/// Readings further from a whole count than this are of another scale.
const WHOLE: f64 = 0.1;
/// Bits of the largest unit of a correction.
const MAX_UNIT_BITS: u8 = 3;

/// A table with what is known of it.
#[derive(Clone, Debug)]
pub struct Made {
    pub table: Table,
    pub learned: Learned,
    /// Between two knots the corrected reading rises most here: where the converter stands still.
    pub widest: Widest,
}

/// The widest code.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Widest {
    /// How far the angle moves while the reading stands still, and where, from the rest.
    pub deg: f64,
    pub at_deg: f64,
}

/// The table of `records`, which were recorded through the sensor that has these settings. None where they
/// show no error beyond noise.
///
/// # Errors
/// Exit 2 for too few, or one given twice; exit 3 for records of another scale, or that determine no table.
pub fn make(records: &[Record], settings: &Settings) -> Result<Option<Made>> {
    if records.len() < MIN_RELEASES {
        return Err(Error::usage(format!(
            "{} releases are too few to tell the sensor's error from the rig's",
            records.len()
        ))
        .help(format!("give {MIN_RELEASES} or more, eight if there are")));
    }
    check_each_once(records)?;
    for record in records {
        check_scale(record, settings)?;
    }
    let deg_per_count = f64::from(settings.degrees_per_count.abs());
    // Rising with the counts.
    let sign = f64::from(settings.degrees_per_count.signum());
    let counted: Vec<Record> = records
        .iter()
        .map(|record| {
            let yaw_deg = record.yaw_deg.iter().map(|deg| sign * deg).collect();
            Record { yaw_deg, ..record.clone() }
        })
        .collect();
    let swings = Swings::new(&counted)?;
    let [low, high] =
        swings.range_deg().map(|deg| deg / deg_per_count + f64::from(settings.zero_counts));
    let (first, spacing_bits, count) = grid(low, high, settings).ok_or_else(|| {
        Error::data("these records hold readings that no converter of this device gives".to_owned())
            .help("give records that this device has made")
    })?;
    let step_counts = f64::from(1_u32 << spacing_bits);
    let knots = Knots {
        first_deg: (f64::from(first) - f64::from(settings.zero_counts)) * deg_per_count,
        step_deg: step_counts * deg_per_count,
        count,
    };
    let learned = swings.learn(knots, f64::from(settings.from_deg))?;
    if !learned.beyond_noise {
        return Ok(None);
    }
    let counts: Vec<f64> = learned.corrections_deg.iter().map(|deg| deg / deg_per_count).collect();
    let largest = counts.iter().fold(0.0_f64, |most, c| most.max(c.abs()));
    let unit_bits = (0..=MAX_UNIT_BITS)
        .find(|bits| largest <= f64::from(127_u16 << bits))
        .ok_or_else(|| {
            let codes = codes(largest, settings);
            Error::data(format!("these records would be corrected by {codes:.0} codes: no converter errs so"))
                .help("see that they are releases of this device, and that nothing held or touched the model")
        })?;
    let head = Head {
        first_counts: first,
        spacing_bits,
        unit_bits,
        knots: count as u16,
        learned_from: records.len() as u16,
        damping_u: learned.damping_u as f32,
    };
    let mut table = Table::new();
    table.begin(&head);
    table.put(0, &rounded(&counts, &head));
    if !table.is_sound() {
        return Err(Error::internal("a table that the device would refuse".to_owned()));
    }
    let widest = widest(&learned, knots, swings.amplitude_and_offset_deg()[1], sign);
    Ok(Some(Made { table, learned, widest }))
}

/// First reading, spacing and number of the knots that cover these readings: one a code if they can.
fn grid(low: f64, high: f64, settings: &Settings) -> Option<(u16, u8, usize)> {
    let finest = code_counts(settings).log2().floor() as u8;
    let (low, high) = (low.floor(), high.ceil());
    let within = low >= 0.0 && high <= f64::from(settings.full_scale_counts);
    let spacing_bits =
        (finest..=8).find(|bits| high - low <= f64::from((KNOTS as u32 - 1) << bits))?;
    let spacing = f64::from(1_u32 << spacing_bits);
    let count = (((high - low) / spacing).ceil() as usize + 1).max(MIN_KNOTS);
    // The last knot is a reading, too.
    let last = f64::from(u16::MAX) - spacing * (count - 1) as f64;
    (within && last >= 0.0).then_some((low.min(last.floor()) as u16, spacing_bits, count))
}

/// Corrections in the head's unit that leave corrected readings rising. What is rounded off one goes to the
/// next: rounded each by itself, a correction that changes slowly would be a staircase, and damping ratios off
/// by its steps.
fn rounded(counts: &[f64], head: &Head) -> Vec<i8> {
    let unit = f64::from(1_u16 << head.unit_bits);
    let most_fall = ((1_i32 << head.spacing_bits) - 1) >> head.unit_bits;
    let (mut before, mut left) = (i32::from(i8::MIN), 0.0_f64);
    counts
        .iter()
        .map(|counts| {
            let wanted = counts / unit + left;
            before = (wanted.round() as i32).max(before - most_fall).min(127);
            left = (wanted - f64::from(before)).clamp(-1.0, 1.0);
            before as i8
        })
        .collect()
}

/// Where corrected readings rise most from knot to knot.
fn widest(learned: &Learned, knots: Knots, offset_deg: f64, sign: f64) -> Widest {
    let rises = learned.corrections_deg.windows(2).map(|pair| pair[1] - pair[0]);
    let (knot, rise) = rises.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0));
    let at_deg = sign * (knots.deg(knot) + 0.5 * knots.step_deg - offset_deg);
    Widest { deg: rise + knots.step_deg, at_deg }
}

/// What a device has sent lies on its counts.
fn check_scale(record: &Record, settings: &Settings) -> Result<()> {
    let per_count = f64::from(settings.degrees_per_count);
    let off = |deg: &&f64| {
        let counts = **deg / per_count;
        (counts - counts.round()).abs() > WHOLE
    };
    if 100 * record.yaw_deg.iter().filter(off).count() <= record.yaw_deg.len() {
        return Ok(());
    }
    let file = record.file.display();
    Err(Error::data(format!(
        "{file}: these are no readings of a sensor with {per_count:.6} deg a count"
    ))
    .help(format!(
        "give records that `yawrig monitor` made of this device, with the {} they were made with",
        settings::name("travel_deg")
    )))
}

/// A release given twice, under one name or two, would count for two that agree.
fn check_each_once(records: &[Record]) -> Result<()> {
    for (k, record) in records.iter().enumerate() {
        let same =
            |other: &&Record| other.time_s == record.time_s && other.yaw_deg == record.yaw_deg;
        let Some(first) = records[..k].iter().find(same) else { continue };
        let names = [first, record].map(|record| record.file.display().to_string());
        let [first, second] = &names;
        return Err(Error::usage(match first == second {
            true => format!("{first} is given twice"),
            false => format!("{first} and {second} are the same release"),
        })
        .help("give each release once"));
    }
    Ok(())
}

/// Writes a table to a device, where it corrects what comes and is kept.
///
/// # Errors
/// Exit 5 where the device refuses it; exit 4 or 7 for the line.
pub fn write(client: &mut Client, table: &Table) -> Result<()> {
    let head = *table.head();
    for (index, some) in table.corrections().chunks(PART_KNOTS).enumerate() {
        let at = (index * PART_KNOTS) as u16;
        let part = LinearityPart { head, at, corrections: some.iter().copied().collect() };
        tell(client, part)?;
    }
    Ok(())
}

/// Makes it forget its table.
///
/// # Errors
/// As [`write()`].
pub fn forget(client: &mut Client) -> Result<()> {
    let corrections = Default::default();
    tell(client, LinearityPart { head: Head::default(), at: 0, corrections })
}

fn tell(client: &mut Client, part: LinearityPart) -> Result<()> {
    client.request(&Request::SetLinearity(part)).map(drop).map_err(|error| why(client, error))
}

fn why(client: &Client, error: LinkError) -> Error {
    let LinkError::Refused(refusal) = error else { return client.explain(error, "its table") };
    let (what, help) = match refusal {
        Refusal::Unsigned => {
            let unlock = settings::command("device unlock", &[], &[("key", "KEY")]);
            ("it is locked", format!("open it first: `{unlock}`"))
        }
        Refusal::Releasing => {
            ("a release is going on", "wait until the model is at rest and try again".to_owned())
        }
        Refusal::FlashWrite => (
            "its flash did not take the table",
            "try again; it uses the one before, if any".to_owned(),
        ),
        other => return client.explain(LinkError::Refused(other), "the table"),
    };
    Error::new(Exit::Flash, format!("the device on {} refused: {what}", client.path())).help(help)
}
