//! `yawrig device linearity`: what a device's converter and sensor err by, learned from its own releases.

use crate::cli::device_arg::DeviceArg;
use clap::Args;
use serde_json::{json, Value};
use std::path::PathBuf;
use yawrig_base::error::{Error, Result};
use yawrig_core::quantity::Quantity;
use yawrig_core::record::Record;
use yawrig_link::bench::Target;
use yawrig_link::linearity::{self as link, Made};
use yawrig_shared::wire::Settings;
use yawrig_verbs::common::{print_json, print_line, within, SCHEMA_VERSION};

#[derive(Args, Debug)]
pub struct Linearity {
    /// Releases that `yawrig monitor --record` made of this device while it had no table; eight at
    /// one rest angle are enough. Without any: what it has
    #[arg(value_name = "RECORD")]
    records: Vec<PathBuf>,
    /// A sweep in place of releases: a CSV file with the columns yaw_deg, what the device reads, and
    /// reference_deg, where the model is, turned slowly through all of its readings
    #[arg(long, value_name = "FILE", conflicts_with_all = ["records", "forget"])]
    sweep: Option<PathBuf>,
    /// Make it forget its table
    #[arg(long, conflicts_with = "records")]
    forget: bool,
    /// The --travel-deg that the records were made with [default: as the device is set]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    travel_deg: Option<f64>,
}

impl Linearity {
    pub fn run(&self, device: &DeviceArg, as_json: bool) -> Result<()> {
        if let Some(travel_deg) = self.travel_deg {
            within("--travel-deg", travel_deg, 1.0, 36_000.0)?;
        }
        // Before the device is opened.
        let source = self.read()?;
        let mut bench = device.open()?;
        let status = bench.client.status()?;
        let mut settings = status.settings;
        if let Some(travel_deg) = self.travel_deg {
            settings.degrees_per_count = (travel_deg / 65_536.0) as f32;
        }
        let mut made = None;
        if self.forget {
            link::forget(&mut bench.client)?;
        } else if let Some(source) = &source {
            if status.linearity.knots > 0 {
                return Err(Error::usage(
                    "the device has a table already, and what it reads is corrected by that".to_owned(),
                )
                .help(
                    "have it forget that (`yawrig device linearity --forget`), and give what it read before it or after",
                ));
            }
            made = match source {
                Source::Releases(records) => {
                    crate::say!("learning from {} releases", records.len());
                    link::make(records, &settings)?
                }
                Source::Sweep(points) => link::make_of_sweep(points, &settings)?,
            };
            if let Some(made) = &made {
                link::write(&mut bench.client, &made.table)?;
            }
        }
        let has = bench.client.status()?.linearity;
        if as_json {
            return print_json(&json!({
                "schema_version": SCHEMA_VERSION,
                "linearity": link::json(&has, &settings),
                "linearity_absent": has.absent.map(link::absent_name),
                "learned": made.as_ref().map(learned_json),
            }));
        }
        if !matches!(device.device, Target::Port(_)) {
            crate::say!(
                "this {} device ends with this command, and its table with it",
                device.device
            );
        }
        match made {
            Some(made) => print_line(&learned_text(&made, &settings))?,
            None if source.is_some() => print_line(
                "these readings show no error of the sensor beyond their noise: nothing was written",
            )?,
            None => {}
        }
        print_line(&link::text(&has, &settings))
    }

    fn read(&self) -> Result<Option<Source>> {
        if let Some(file) = &self.sweep {
            return Ok(Some(Source::Sweep(yawrig_records::read_sweep(file)?)));
        }
        let records = self.records.iter().map(|file| yawrig_records::read(file));
        let records = records.collect::<Result<Vec<Record>>>()?;
        Ok((!records.is_empty()).then_some(Source::Releases(records)))
    }
}

/// What a table is learned from.
enum Source {
    Releases(Vec<Record>),
    /// Readings and angles, deg.
    Sweep(Vec<[f64; 2]>),
}

fn learned_json(made: &Made) -> Value {
    let Made { learned, widest, .. } = made;
    json!({
        "damping_error": Quantity::new(learned.damping_error, learned.damping_u),
        "seen_deg": learned.seen_deg,
        "removed_rms_deg": learned.removed_rms_deg,
        "left_rms_deg": learned.left_rms_deg,
        "frequency_change": learned.frequency_change,
        "gain": made.gain,
        "widest": {"deg": widest.deg, "at_deg": widest.at_deg},
    })
}

fn learned_text(made: &Made, settings: &Settings) -> String {
    let Made { learned, widest, .. } = made;
    let percent = |share: f64| 100.0 * share;
    let mut lines = vec![
        format!(
            "the converter's error makes damping ratios from {:.3} deg down {:+.2} % wrong; the table leaves {:.3} %",
            settings.from_deg,
            percent(learned.damping_error),
            percent(learned.damping_u)
        ),
        format!(
            "it takes {:.4} deg rms out of the residual and leaves {:.4} deg a sample",
            learned.removed_rms_deg, learned.left_rms_deg
        ),
    ];
    let count_deg = f64::from(settings.degrees_per_count.abs());
    let codes = link::codes(widest.deg / count_deg, settings);
    if codes > WIDE_CODES {
        lines.push(format!(
            "the reading stands still over {codes:.0} codes, {:+.2} deg from rest: no table knows the angle there; turn the \
             potentiometer so that the rest is further from it than the amplitudes to be analysed",
            widest.at_deg
        ));
    }
    if let Some(gain) = made.gain.map(f64::abs).filter(|gain| (gain - 1.0).abs() > OTHER_TRAVEL) {
        lines.push(format!(
            "the angle rises by {gain:.4} deg for each deg read: --travel-deg {:.1} makes angles right; natural frequency and \
             damping ratio do not change",
            gain * count_deg * 65_536.0
        ));
    }
    if learned.frequency_change > STIFF {
        lines.push(format!(
            "the frequency changes by {:.2} % over the amplitude: a spring's law is told from the sensor's by that, and a \
             tenth of what it could be taken for is in the uncertainty",
            percent(learned.frequency_change)
        ));
    }
    lines.join("\n")
}

/// A reading that stands still for longer is worth a word.
const WIDE_CODES: f64 = 3.0;
/// A share of the angle that is worth one.
const OTHER_TRAVEL: f64 = 2e-3;
/// A relative change of the frequency that is worth one.
const STIFF: f64 = 1e-3;
