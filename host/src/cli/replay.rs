//! `yawrig replay`: play a record into a device as its potentiometer.

use super::device_arg::DeviceArg;
use super::flash::Bar;
use clap::Args;
use serde_json::{json, Value};
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Exit, Result};
use yawrig_core::identify::gaps;
use yawrig_core::record::Record;
use yawrig_link::amplitude_trend::{trends, Trend};
use yawrig_link::flash;
use yawrig_link::follow::{
    device_json, event_text, flag_names, is_refined, precise, quantity, window_json,
};
use yawrig_link::numbers::{named, release_numbers, Named};
use yawrig_link::replay::{
    refined_residual_rms_deg, replay, residual_rms_deg, Range, Release, Replayed,
};
use yawrig_shared::window::{CYCLES, SAMPLE_RATE_HZ};
use yawrig_shared::wire::{counting, Flags, WindowResult};
use yawrig_verbs::common::{print_json, print_line, within, SCHEMA_VERSION};
use yawrig_verbs::releases::ReleaseArg;

#[derive(Args, Debug)]
pub struct Replay {
    /// Records: CSV with `time_s,yaw_deg` or `time_s,yaw_rad`
    #[arg(required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    release: ReleaseArg,
    #[command(flatten)]
    device: DeviceArg,
    /// Write this network to the device first
    #[arg(long, value_name = "NETWORK")]
    network: Option<PathBuf>,
    /// Analyse from this amplitude down
    #[arg(long, default_value_t = 10.0, allow_negative_numbers = true)]
    from_deg: f64,
    /// Analyse down to this amplitude
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    to_deg: f64,
    /// Print one JSON object, shaped like that of `identify`
    #[arg(short, long)]
    json: bool,
}

pub fn run(arguments: &Replay) -> Result<()> {
    within("--from-deg", arguments.from_deg, 0.0, 360.0)?;
    if !(arguments.to_deg > 0.0 && arguments.from_deg > arguments.to_deg) {
        return Err(Error::usage(format!(
            "--from-deg {} must lie above --to-deg {}, and that above 0",
            arguments.from_deg, arguments.to_deg
        )));
    }
    let range = Range { from_deg: arguments.from_deg, to_deg: arguments.to_deg };
    let selection = arguments.release.selection()?;
    // All are read before a device is started: a wrong name is found at once.
    let read = |file: &PathBuf| {
        let record = yawrig_records::read_selected(file, &selection)?;
        if !record.measurand.is_angle() {
            let (quantity, unit) = (record.measurand.quantity(), record.measurand.unit());
            let what =
                format!("{}: a {quantity} in {unit}, and a device reads angles", file.display());
            return Err(Error::data(what).help("identify it: yawrig identify"));
        }
        let (whole, warnings) = gaps::without(&record);
        for warning in warnings {
            crate::warn!("{warning}");
        }
        whole.check_resampling(f64::from(SAMPLE_RATE_HZ))?;
        Ok(whole.into_owned())
    };
    let files = arguments.release.of(&arguments.files)?;
    let records: Vec<Record> = files.iter().map(read).collect::<Result<_>>()?;
    let network = arguments.network.as_deref().map(flash::read).transpose()?;
    let mut bench = arguments.device.open()?;
    if let Some((blob, _)) = network {
        flash::write(&mut bench.client, &blob, &mut Bar::new())?;
    }
    let status = bench.client.status()?;
    let names = named(&status.network);
    let mut objects = Vec::new();
    let mut unusable = Vec::new();
    for record in &records {
        if !arguments.json {
            print_line(&record.file.display().to_string())?;
        }
        let name = record.file.display().to_string();
        let mut show = |event: &_| match event_text(event, &name, &names) {
            Some(text) if !arguments.json => print_line(&text),
            _ => Ok(()),
        };
        let replayed = replay(&mut bench, record, range, &mut show)?;
        if !arguments.json {
            for trend in trends_of(replayed.main_release()) {
                print_line(&trend.text(&status.network.effects))?;
            }
        }
        let usable = replayed
            .main_release()
            .is_some_and(|r| counting(r.result.as_ref(), r.refined.as_ref()).is_some());
        if !usable {
            unusable.push(why(&record.file, replayed.main_release()));
        }
        objects.push(record_json(record, range, &replayed, &names));
    }
    if arguments.json {
        print_json(&json!({
            "schema_version": SCHEMA_VERSION,
            "device": device_json(&bench.client.identity, &status),
            "records": objects,
        }))?;
    }
    match unusable.is_empty() {
        true => Ok(()),
        false => Err(Error::new(Exit::Quality, unusable.join("\n  "))
            .help("choose another range with --from-deg and --to-deg, or release again")),
    }
}

fn trends_of(release: Option<&Release>) -> Vec<Trend> {
    release.map_or_else(Vec::new, |release| trends(&release.windows))
}

fn why(file: &Path, release: Option<&Release>) -> String {
    let flags = release.and_then(|r| r.result).map(|r| flag_names(r.flags).join(", "));
    let flags = flags.unwrap_or_else(|| "no release found".to_owned());
    format!("{}: the device has no estimate to rely on ({flags})", file.display())
}

fn record_json(record: &Record, range: Range, replayed: &Replayed, names: &[Named]) -> Value {
    let seconds = |sample: u32| {
        f64::from(sample.wrapping_sub(replayed.first_sample)) / f64::from(SAMPLE_RATE_HZ)
            + record.time_s.first().copied().unwrap_or(0.0)
    };
    let release = replayed.main_release();
    let result = release.and_then(|release| release.result);
    let refined = release.and_then(|release| {
        let refined = release.refined?;
        let given = is_refined(&refined);
        Some(json!({
            "method": "device-refined",
            "natural_frequency_rad_s": given.then(|| precise(refined.natural_frequency_rad_s)),
            "damping_ratio": given.then(|| quantity(refined.damping_ratio)),
            "residual_rms_deg": refined_residual_rms_deg(record, replayed, &refined),
            "residual_over_noise": given.then_some(refined.residual_over_noise),
            "noise_rms_deg": given.then_some(refined.noise_rms_deg),
            "usable": counting(None, Some(&refined)).is_some(),
            "misfit": refined.flags.has(Flags::MISFIT),
            "windows": [],
            "flags": flag_names(refined.flags),
        }))
    });
    // The device's zero is not the record's.
    let on_records_scale = |window: &WindowResult| {
        let mut object = window_json(window, names);
        object["midline_deg"] = json!(f64::from(window.midline_deg) + replayed.shift_deg);
        object
    };
    let estimates: Vec<Value> = release
        .zip(result)
        .map(|(release, result)| {
            let given = result.windows > 0;
            json!({
                "method": "device",
                "natural_frequency_rad_s": given.then(|| quantity(result.natural_frequency_rad_s)),
                "damping_ratio": given.then(|| quantity(result.damping_ratio)),
                "numbers": release_numbers(names, &result.numbers),
                "residual_rms_deg": residual_rms_deg(record, replayed, release),
                "usable": counting(Some(&result), None).is_some(),
                "windows": release.windows.iter().map(on_records_scale).collect::<Vec<_>>(),
                "trends": trends_of(Some(release)).iter().map(Trend::to_json).collect::<Vec<_>>(),
                "flags": flag_names(result.flags),
            })
        })
        .into_iter()
        .chain(refined)
        .collect();
    let midlines: Vec<f64> = release
        .iter()
        .flat_map(|release| &release.windows)
        .map(|window| f64::from(window.midline_deg) + replayed.shift_deg)
        .collect();
    let offset_deg = midlines.iter().sum::<f64>() / midlines.len() as f64;
    json!({
        "file": record.file.display().to_string(),
        "release_time_s": result.map(|r| seconds(r.release_sample)),
        "rate_hz": record.timing().rate_hz,
        "window": {
            "from_deg": range.from_deg,
            "to_deg": range.to_deg,
            "cycles": result.map_or(0, |r| usize::from(r.windows) * CYCLES),
        },
        "offset_deg": if midlines.is_empty() { Value::Null } else { json!(offset_deg) },
        "noise_rms_deg": record.noise_rms_deg(),
        "estimates": estimates,
    })
}
