//! `campaign`: the file that says what each record was made under, begun from the records' names and checked.

use clap::{Args, Subcommand};
use serde::Serialize;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_base::files;
use yawrig_campaign::check::check;
use yawrig_campaign::doubted;
use yawrig_campaign::init::{begin, NewCampaign, MISSING};
use yawrig_campaign::pattern::Pattern;
use yawrig_campaign::simulated::{refuse_existing, CAMPAIGN_FILE};
use yawrig_core::derivatives::plausible::Doubt;
use yawrig_text::quoted;
use yawrig_verbs::common::{print_json, print_line};

const EXAMPLE: &str = r#"A whole campaign.toml:

  schema_version = 1
  # motion = "roll"        # what tables, plots and reports call it; else yaw
  [model]
  name = "Davis model"
  length_m = 0.625         # reference length
  frontal_area_m2 = 0.036
  [air]
  density_kg_m3 = 1.2
  [rig]
  spring_arm_m = 0.1       # distance of each spring from the axis
  axis_offset_m = 0.05     # how far the front axis lies ahead of the middle one
  # [inertia]              # optional; else from the wind-off releases, by axis
  # mid_kg_m2 = 0.101
  # front_kg_m2 = 0.1205
  [stiffness_n_per_m]      # of one spring, by its name; Kr = 2 Ks arm^2
  K1 = 119.0
  K2 = 214.0
  [[release]]              # repeated; several of one condition are repeats
  file = "K1-mid-off.csv"  # relative to this file; r.csv#2: its second release
  spring = "K1"
  axis = "mid"             # or "front"
  wind_speed_m_s = 0.0     # 0: wind off; each wind-on release needs one
  [[release]]
  file = "K1-mid-on.csv"
  spring = "K1"
  axis = "mid"
  wind_speed_m_s = 10.0
  # density_kg_m3 = 1.18   # where it is not that of [air]; or temperature_deg_c
                           # and pressure_pa; here and in [air]
  # dynamic_pressure_pa = 60.0  # in place of wind_speed_m_s
  # at = { ride_height_mm = 40, wing = "low" }  # groups the derivatives

Each number may have its standard uncertainty beside it, as length_u_m = 0.001
(also frontal_area_u_m2, density_u_kg_m3, spring_arm_u_m, axis_offset_u_m,
clock_u_ppm under [rig], mid_u_kg_m2, front_u_kg_m2, and in a release
spring_stiffness_u_n_per_m, wind_speed_u_m_s). A release may state
spring_stiffness_n_per_m itself. accept = ["no_wind"] in a release, or at the top
of the file, marks doubts of that kind as looked into.

Then: yawrig derivatives campaign.toml"#;

/// Begin the file that says what each record was made under, or check one
#[derive(Args, Debug)]
#[command(after_help = EXAMPLE)]
pub struct CampaignArgs {
    #[command(subcommand)]
    act: Act,
}

#[derive(Subcommand, Debug)]
enum Act {
    /// Write a campaign.toml for a folder of records, what is missing marked
    Init(Init),
    /// Say all that is wrong with a campaign, its records too
    Check {
        /// The campaign's file
        #[arg(value_name = "campaign.toml")]
        campaign: PathBuf,
        /// Print one JSON object
        #[arg(short, long)]
        json: bool,
    },
}

#[derive(Args, Debug)]
struct Init {
    /// The folder with the records
    folder: PathBuf,
    /// How the records are called, as "{spring}_V{wind}_{axis}_run{number}.csv": {wind} is a speed in m/s (in
    /// km/h as {wind}kmh) or off, {axis} mid or front, {at.ride_height_mm} a setting of that name, {number}
    /// or any other name stands for anything; folders are parted by /
    #[arg(long, value_name = "PATTERN")]
    pattern: String,
    /// The file to write [default: campaign.toml in the folder]
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Overwrite what is there
    #[arg(long)]
    force: bool,
}

pub fn run(arguments: &CampaignArgs) -> Result<()> {
    match &arguments.act {
        Act::Init(init) => init.run(),
        Act::Check { campaign, json } => checked(campaign, *json),
    }
}

impl Init {
    fn run(&self) -> Result<()> {
        let pattern = Pattern::new(&self.pattern)?;
        let out = self.out.clone().unwrap_or_else(|| self.folder.join(CAMPAIGN_FILE));
        if !self.force {
            refuse_existing(&out)?;
        }
        let NewCampaign { text, releases, springs, left_over } =
            begin(&self.folder, &pattern, &out)?;
        files::write_atomically(&out, text.as_bytes())?;
        for name in left_over {
            crate::warn!("{name} does not match the pattern and was left out");
        }
        let gaps = text
            .lines()
            .filter(|line| {
                line.split('#').nth(1).is_some_and(|c| c.trim().starts_with(&format!("{MISSING}:")))
            })
            .count();
        print_line(&format!(
            "{}: {releases} releases with springs {}; {gaps} lines marked {MISSING} are to be filled in, then: yawrig campaign check {}",
            out.display(),
            springs.join(", "),
            quoted(&out.to_string_lossy())
        ))
    }
}

/// `campaign check --json`.
#[derive(Serialize)]
struct CheckedJson<'a> {
    schema_version: u32,
    errors: Vec<&'a Doubt>,
    doubts: Vec<&'a Doubt>,
    notes: &'a [String],
}

fn checked(campaign: &Path, json: bool) -> Result<()> {
    let found = check(campaign)?;
    let errors: Vec<&Doubt> = found.errors().collect();
    if json {
        let doubts = found.doubtful().collect();
        let (errors, notes) = (errors.clone(), &found.notes[..]);
        print_json(&CheckedJson { schema_version: 1, errors, doubts, notes })?;
    } else {
        for error in &errors {
            print_line(&doubted::line(error))?;
        }
        let doubtful: Vec<Doubt> = found.doubtful().cloned().collect();
        for line in doubted::lines(&doubtful) {
            print_line(&line)?;
        }
    }
    if !errors.is_empty() {
        let (n, s) = (errors.len(), if errors.len() == 1 { "" } else { "s" });
        return Err(Error::data(format!("{}: {n} fault{s}, listed above", campaign.display()))
            .help("correct them and check again"));
    }
    if json {
        return Ok(());
    }
    for note in &found.notes {
        print_line(&format!("Note: {note}"))?;
    }
    let open = found.doubtful().filter(|doubt| !doubt.accepted).count();
    let (releases, springs) = (found.releases, found.springs);
    let verdict = match open {
        0 => format!("nothing is wrong with its {releases} releases of {springs} springs"),
        1 => format!("{releases} releases of {springs} springs, one thing doubtful: see above"),
        n => format!("{releases} releases of {springs} springs, {n} things doubtful: see above"),
    };
    print_line(&format!(
        "{}: {verdict}; next: yawrig derivatives {}",
        campaign.display(),
        quoted(&campaign.to_string_lossy())
    ))
}
