//! A device's table for its converter and sensor: made of releases that were recorded through them, written,
//! and forgotten.

use crate::client::{Client, LinkError};
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::settings;
use yawrig_core::linearity::{Knots, Learned, Sweep, Swept, Swings};
use yawrig_core::record::Record;
pub use yawrig_protocol::linearity::{absent_name, codes, json, text};
use yawrig_protocol::linearity::{code_counts, FROM_SWEEP};
use yawrig_shared::linearity::{Head, Table, KNOTS, MIN_KNOTS};
use yawrig_shared::wire::{LinearityPart, Refusal, Request, Settings, PART_KNOTS};

/// Fewest releases: what is one release's own is to be told from what is the sensor's.
pub const MIN_RELEASES: usize = 3;
/// Readings further from a whole count than this are of another scale.
const WHOLE: f64 = 0.1;
/// Bits of the largest unit of a correction, and of the widest spacing.
const MAX_UNIT_BITS: u8 = 3;
const MAX_SPACING_BITS: u8 = 8;

/// The factor by which angles are off that are in another unit: 17 for mrad is the least. A travel is not.
const OTHER_UNIT: f64 = 10.0;

/// A table with what is known of it.
#[derive(Clone, Debug)]
pub struct Made {
    pub table: Table,
    pub learned: Learned,
    /// Of a sweep: by how much the angle rises while the reading does by 1.
    pub gain: Option<f64>,
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
    let grid = Grid::new(swings.range_deg(), settings, KNOTS).ok_or_else(|| {
        no_readings("these records hold").help("give records that this device has made")
    })?;
    let learned = swings.learn(grid.knots(settings), f64::from(settings.from_deg))?;
    let rest_deg = swings.amplitude_and_offset_deg()[1];
    made(learned, grid, records.len() as u16, (rest_deg, sign), settings)
}

/// The table of a sweep: readings of the sensor that has these settings, and the angles at which they were read, deg.
/// None where they show no error beyond noise.
///
/// # Errors
/// Exit 2 for too few for their range; exit 3 for readings of another scale, or that determine no table.
pub fn make_of_sweep(points: &[[f64; 2]], settings: &Settings) -> Result<Option<Made>> {
    // Rising with the counts.
    let sign = f64::from(settings.degrees_per_count.signum());
    let sweep = Sweep::new(points.iter().map(|point| point.map(|deg| sign * deg)).collect());
    let [low, high] = sweep.range_deg();
    let grid = |most: usize| {
        let no_readings =
            || no_readings("this sweep holds").help("give readings that this device has made");
        Grid::new([low, high], settings, most).ok_or_else(no_readings)
    };
    grid(KNOTS)?;
    // Two rows for each knot, and as many knots as the widest spacing needs.
    let deg_per_knot =
        f64::from(1_u32 << MAX_SPACING_BITS) * f64::from(settings.degrees_per_count.abs());
    let fewest = 2 * MIN_KNOTS.max(((high - low) / deg_per_knot).ceil() as usize + 2);
    if points.len() < fewest {
        let rows = points.len();
        return Err(Error::usage(format!("{rows} rows are too few for this sweep: {fewest} at least"))
            .help("turn the model slowly through all readings that it will have, and give what was read on the way"));
    }
    let grid = grid((points.len() / 2).min(KNOTS))?;
    // The model swings to either side as far as it was turned.
    let rest_deg = 0.5 * (low + high);
    let swept = sweep.learn(grid.knots(settings), rest_deg, f64::from(settings.from_deg));
    let Swept { learned, gain } = swept.map_err(|_| {
        Error::data("in this sweep the angle does not follow the reading".to_owned())
            .help("turn the model slowly from one end of its swing to the other, and give both columns in deg")
    })?;
    if !(1.0 / OTHER_UNIT..OTHER_UNIT).contains(&gain.abs()) {
        return Err(Error::data(format!(
            "in this sweep the angle rises by {gain:.3} for each deg read"
        ))
        .help("give both columns in deg"));
    }
    let made = made(learned, grid, FROM_SWEEP, (rest_deg, sign), settings)?;
    Ok(made.map(|made| Made { gain: Some(gain), ..made }))
}

fn no_readings(whose: &str) -> Error {
    Error::data(format!("{whose} readings that no converter of this device gives"))
}

/// The table that was learned; `None` where it is none beyond noise. Its motion rests at this reading, which has the
/// sign of the counts' direction.
fn made(
    learned: Learned,
    grid: Grid,
    learned_from: u16,
    (rest_deg, sign): (f64, f64),
    settings: &Settings,
) -> Result<Option<Made>> {
    if !learned.beyond_noise {
        return Ok(None);
    }
    let deg_per_count = f64::from(settings.degrees_per_count.abs());
    let counts: Vec<f64> = learned.corrections_deg.iter().map(|deg| deg / deg_per_count).collect();
    let largest = counts.iter().fold(0.0_f64, |most, c| most.max(c.abs()));
    let unit_bits = (0..=MAX_UNIT_BITS)
        .find(|bits| largest <= f64::from(127_u16 << bits))
        .ok_or_else(|| {
            let codes = codes(largest, settings);
            Error::data(format!(
                "readings would be corrected by {codes:.0} codes: no converter errs so"
            ))
            .help("see that they are of this device, and that nothing held or touched the model")
        })?;
    let head = Head {
        first_counts: grid.first,
        spacing_bits: grid.spacing_bits,
        unit_bits,
        knots: grid.count as u16,
        learned_from,
        damping_u: learned.damping_u as f32,
    };
    let mut table = Table::new();
    table.begin(&head);
    table.put(0, &rounded(&counts, &head));
    if !table.is_sound() {
        return Err(Error::internal("a table that the device would refuse".to_owned()));
    }
    let widest = widest(&learned, grid.knots(settings), rest_deg, sign);
    Ok(Some(Made { table, learned, gain: None, widest }))
}

/// Where a table's knots are, in counts.
#[derive(Clone, Copy)]
struct Grid {
    first: u16,
    spacing_bits: u8,
    count: usize,
}

impl Grid {
    /// Knots that cover these readings, rising with the counts: one a code if so many suffice. `None` where no
    /// converter has such readings, or `most` knots cannot cover them.
    fn new(range_deg: [f64; 2], settings: &Settings, most: usize) -> Option<Self> {
        let deg_per_count = f64::from(settings.degrees_per_count.abs());
        let [low, high] =
            range_deg.map(|deg| deg / deg_per_count + f64::from(settings.zero_counts));
        let finest = code_counts(settings).log2().floor() as u8;
        let (low, high) = (low.floor(), high.ceil());
        let within = low >= 0.0 && high <= f64::from(settings.full_scale_counts);
        let spacing_bits = (finest..=MAX_SPACING_BITS)
            .find(|bits| high - low <= f64::from((most as u32 - 1) << bits))?;
        let spacing = f64::from(1_u32 << spacing_bits);
        let count = (((high - low) / spacing).ceil() as usize + 1).max(MIN_KNOTS);
        // The last knot is a reading, too.
        let last = f64::from(u16::MAX) - spacing * (count - 1) as f64;
        let first = low.min(last.floor()) as u16;
        (within && last >= 0.0).then_some(Self { first, spacing_bits, count })
    }

    /// Readings.
    fn knots(&self, settings: &Settings) -> Knots {
        let deg_per_count = f64::from(settings.degrees_per_count.abs());
        Knots {
            first_deg: (f64::from(self.first) - f64::from(settings.zero_counts)) * deg_per_count,
            step_deg: f64::from(1_u32 << self.spacing_bits) * deg_per_count,
            count: self.count,
        }
    }
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
