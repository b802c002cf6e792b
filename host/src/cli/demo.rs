//! `yawrig demo`: the main job from training to the table of derivatives.

use super::device_arg::DeviceArg;
use super::flash;
use super::story::Riddle;
use super::train::teach;
use crate::demo::{misses, releases, results, table, Made, Miss, Plan};
use clap::Args;
use serde_json::{json, Value};
use std::path::{Path, PathBuf};
use std::time::Instant;
use yawrig_base::error::{Error, Exit, Result};
use yawrig_core::derivatives::table::Point;
use yawrig_core::quantity::Quantity;
use yawrig_link::flash::write;
use yawrig_link::follow::{flag_names, quantity, refined_json, window_json};
use yawrig_measuring::answers::By;
use yawrig_model::training;
use yawrig_rig::{Rig, Sensor, Start, Truth, SPRINGS};
use yawrig_shared::features::FeatureKind;
use yawrig_train::network_training::Settings;
use yawrig_train::Options;
use yawrig_verbs::common::{bare, print_json, print_line, within, writable, SCHEMA_VERSION};
use yawrig_verbs::model::asked;
use yawrig_verbs::report;

/// What the answer must keep to: median and worst miss of Cn_beta and Cn_r.
const GATE: [Miss; 2] = [Miss { median: 0.02, worst: 0.06 }, Miss { median: 0.04, worst: 0.12 }];

/// Train, flash, release on eight springs and tabulate the derivatives; or solve a riddle.
///
/// The demo ends with a report in its folder. With --hidden it writes releases instead that hide an effect of
/// the library, and says what to type to find it; with --reveal it opens what was hidden and judges the model
/// that was made.
#[derive(Args, Debug)]
pub struct Demo {
    #[command(flatten)]
    device: DeviceArg,
    /// Rms of the potentiometer's noise, degrees
    #[arg(long, default_value_t = 0.05, allow_negative_numbers = true)]
    noise_deg: f64,
    /// Wind speed, m/s
    #[arg(long, default_value_t = 10.0, allow_negative_numbers = true)]
    wind: f64,
    /// Seed of the training and of the noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder for network, findings and report [default: yawrig-demo, or yawrig-demo-2 and so on where it is
    /// there]
    #[arg(short, long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Write nothing
    #[arg(long, conflicts_with_all = ["out", "hidden", "reveal"])]
    no_report: bool,
    /// Overwrite what is in the folder
    #[arg(long)]
    force: bool,
    /// Hide an effect in four releases, chosen by this number [default folder: yawrig-hidden]
    #[arg(long, value_name = "SEED", conflicts_with_all = ["noise_deg", "wind", "seed"])]
    hidden: Option<u64>,
    /// With --hidden: take every step at once, as a user would
    #[arg(long, requires = "hidden")]
    yes: bool,
    /// Show what was hidden in this folder's releases, and how near the model and the network there come
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["noise_deg", "wind", "seed", "hidden", "out", "force"])]
    reveal: Option<PathBuf>,
    /// Print one JSON object
    #[arg(short, long)]
    json: bool,
}

/// The demo's default folder.
const FOLDER: &str = "yawrig-demo";
const HIDDEN_FOLDER: &str = "yawrig-hidden";

/// Where the results go; none: nowhere. Checked before the work.
fn folder(arguments: &Demo) -> Result<Option<PathBuf>> {
    if arguments.no_report {
        return Ok(None);
    }
    let folder = arguments.out.clone().unwrap_or_else(|| results::free_folder(FOLDER));
    writable(&folder, arguments.force, &[report::DEMO_FILE, results::NETWORK, results::REPORT])?;
    Ok(Some(folder))
}

pub fn run(arguments: &Demo) -> Result<()> {
    let Demo { device, force, json, .. } = arguments;
    if let Some(folder) = &arguments.reveal {
        return Riddle::at(folder.clone(), device, *json).reveal();
    }
    if let Some(seed) = arguments.hidden {
        let folder = arguments.out.clone().unwrap_or_else(|| results::free_folder(HIDDEN_FOLDER));
        return Riddle::at(folder, device, *json).hide(seed, *force, arguments.yes);
    }
    within("--noise-deg", arguments.noise_deg, 0.0, 1.0)?;
    // Without wind there is nothing to make derivatives of.
    within("--wind", arguments.wind, 0.1, 300.0)?;
    let rig = Rig::default();
    for condition in rig.conditions(arguments.wind) {
        // Refused before the training rather than after it.
        rig.modal(&condition)?;
    }
    let folder = folder(arguments)?;
    let begun = Instant::now();
    let settings = lesson(arguments.seed);
    let outcome = teach(&settings)?;
    let mut bench = arguments.device.open()?;
    let generation = write(&mut bench.client, &outcome.blob, &mut flash::Bar::new())?;
    crate::say!("flashed and verified; the device runs it as generation {generation}");
    let plan = Plan {
        rig,
        wind_speed_m_s: arguments.wind,
        start: Start::default(),
        sensor: Sensor { noise_deg: arguments.noise_deg, offset_deg: 1.5, ..Sensor::default() },
        seed: arguments.seed,
    };
    let mut show = |made: &Made| match arguments.json {
        true => Ok(()),
        false => print_line(&release_line(made)),
    };
    let made = releases(&mut bench, &plan, &mut show)?;
    let unusable: Vec<&Made> = made.iter().filter(|made| !made.usable()).collect();
    // Every release goes into the table, because the inertia is common to all: one without an estimate leaves
    // no table.
    let table = |by, all| if all { table(&plan, &made, by) } else { Ok(Vec::new()) };
    let points = table(By::Refined, unusable.is_empty())?;
    let by_network = table(By::Network, made.iter().all(|m| m.answer().counts_by_windows()))?;
    let seconds = begun.elapsed().as_secs_f64();
    if !arguments.json && !points.is_empty() {
        print_line(&to_text(&points, &by_network))?;
    }
    let report = folder.map(|folder| folder.join(results::REPORT));
    if let Some(page) = &report {
        let device = arguments.device.device.to_string();
        let training = results::training(&settings, &outcome);
        let by = yawrig_report::Made::now(asked(None).command);
        let kept = results::report(&plan, &device, &made, &points, training, by);
        results::keep(page.parent().unwrap_or(Path::new("")), &kept, &outcome.blob)?;
        report::write(&kept, page)?;
    }
    match (arguments.json, &report) {
        (true, page) => {
            print_json(&to_json(arguments, &made, &points, seconds, page.as_deref()))?;
        }
        (false, Some(page)) => print_line(&format!("report: {}", page.display()))?,
        (false, None) => {}
    }
    crate::say!("{seconds:.1} s in all, training included");
    gate(&unusable, &points)
}

/// What the demo's network learns.
fn lesson(seed: u64) -> Settings {
    Settings {
        components: None,
        features: FeatureKind::BinMeans,
        model: None,
        numbers: Vec::new(),
        amplitude: false,
        ranges: training::RANGES,
        samples: 8000,
        training: Options { epochs: 300, seed, ..Options::default() },
    }
}

/// `K1 mid   wind on `.
fn name(made: &Made) -> String {
    let condition = &made.condition;
    let wind = if condition.wind_speed_m_s == 0.0 { "off" } else { "on" };
    format!("{} {:5} wind {wind:3}", condition.spring.name, condition.axis.to_string())
}

fn flags(made: &Made) -> String {
    flag_names(made.flags()).join(" ")
}

fn release_line(made: &Made) -> String {
    if !made.usable() {
        return format!("{}  not usable: {}", name(made), flags(made));
    }
    let refined = made.refined.and_then(|refined| refined.derivatives);
    let derivatives = refined.or(made.result.derivatives).map_or(String::new(), |d| {
        format!("   Cn_beta {:7.4}  Cn_r {:7.4}", d.cn_beta.value, d.cn_r.value)
    });
    let [wn, zeta] = made.answer().estimate(By::Refined);
    format!(
        "{}  {:3} windows  wn {wn:>22} rad/s  zeta {zeta:>24}{derivatives}   {}",
        name(made),
        made.result.windows,
        flags(made)
    )
    .trim_end()
    .to_owned()
}

fn to_text(points: &[(Point, Truth)], by_network: &[(Point, Truth)]) -> String {
    let mut text = bare(&[
        "spring", "km", "Cn_beta", "truth", "miss %", "Cn_r", "truth", "miss %", "Cy_beta",
        "truth", "Cy_r", "truth",
    ]);
    let optional = |q: Option<Quantity>| q.map_or("-".to_owned(), |q| format!("{:.3}", q.value));
    for (p, truth) in points {
        let miss = |x: Quantity, truth: f64| format!("{:+.3}", 100.0 * (x.value / truth - 1.0));
        text.add_row([
            p.spring.clone(),
            format!("{:.3}", p.reduced_frequency),
            p.cn_beta.to_string(),
            format!("{:.4}", truth.cn_beta),
            miss(p.cn_beta, truth.cn_beta),
            p.cn_r.to_string(),
            format!("{:.4}", truth.cn_r),
            miss(p.cn_r, truth.cn_r),
            optional(p.cy_beta),
            format!("{:.3}", truth.cy_beta),
            optional(p.cy_r),
            format!("{:.3}", truth.cy_r),
        ]);
    }
    let percent =
        |m: Miss| format!("{:.3} % median, {:.3} % worst", 100.0 * m.median, 100.0 * m.worst);
    let missed = |from: &str, points| {
        let [beta, r] = misses(points).map(percent);
        format!("\nfrom {from} Cn_beta misses the truth by {beta}; Cn_r by {r}")
    };
    let mut text = format!(
        "{}\nper radian about the middle axis; Cn_r is the combined Cn_r - Cn_betadot{}",
        text.trim_fmt(),
        missed("the device's refined estimates", points),
    );
    if !by_network.is_empty() {
        text += &missed("its network's alone", by_network);
    }
    text
}

fn to_json(
    arguments: &Demo,
    made: &[Made],
    points: &[(Point, Truth)],
    seconds: f64,
    report: Option<&Path>,
) -> Value {
    let releases: Vec<Value> = made
        .iter()
        .map(|m| {
            let given = m.result.windows > 0;
            json!({
                "spring": m.condition.spring.name,
                "axis": m.condition.axis,
                "wind_speed_m_s": m.condition.wind_speed_m_s,
                "natural_frequency_rad_s":
                    given.then(|| quantity(m.result.natural_frequency_rad_s)),
                "damping_ratio": given.then(|| quantity(m.result.damping_ratio)),
                "windows": m.windows.iter().map(|w| window_json(w, &[])).collect::<Vec<_>>(),
                "flags": flag_names(m.result.flags),
                "refined": m.refined.as_ref().map(refined_json),
                "truth": {
                    "natural_frequency_rad_s": m.truth.natural_frequency_rad_s,
                    "damping_ratio": m.truth.damping_ratio,
                },
            })
        })
        .collect();
    let points: Vec<Value> = points
        .iter()
        .map(|(p, truth)| {
            json!({
                "spring": p.spring,
                "wind_speed_m_s": p.wind_speed_m_s,
                "reduced_frequency": p.reduced_frequency,
                "cn_beta": p.cn_beta,
                "cn_r": p.cn_r,
                "cy_beta": p.cy_beta,
                "cy_r": p.cy_r,
                "truth": truth,
            })
        })
        .collect();
    json!({
        "schema_version": SCHEMA_VERSION,
        "device": arguments.device.device.to_string(),
        "seconds": seconds,
        "releases": releases,
        "points": points,
        "derivatives_from": "device-refined",
        "report": report.map(|page| page.display().to_string()),
    })
}

/// Exit 6 where a release gave no estimate or the table is further from the truth than it may be.
fn gate(unusable: &[&Made], points: &[(Point, Truth)]) -> Result<()> {
    if let Some(first) = unusable.first() {
        return Err(Error::new(
            Exit::Quality,
            format!(
                "no table: the device has no estimate to rely on for {} of the releases, the first \
                 {} ({})",
                unusable.len(),
                name(first).trim_end(),
                flags(first)
            ),
        )
        .help("lower --noise-deg or --wind"));
    }
    let [beta, r] = misses(points);
    if points.len() == SPRINGS.len() && beta.within(&GATE[0]) && r.within(&GATE[1]) {
        return Ok(());
    }
    Err(Error::new(
        Exit::Quality,
        "the derivatives miss the rig's truth by more than 2 % (Cn_beta) or 4 % (Cn_r) in the \
         median, or three times that at worst",
    )
    .help("lower --noise-deg or raise --wind"))
}
