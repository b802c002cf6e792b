//! `--campaign`, `--condition` and the flags of a single condition.

use clap::Args;
use std::path::PathBuf;
use yawrig_campaign::plan::Wanted;
use yawrig_shared::axis::Axis;
use yawrig_verbs::choices;

/// The condition of the coming releases: with it the device gives derivatives. It holds from the next release
/// on.
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "Condition of the releases")]
pub struct ConditionArgs {
    /// Measure this campaign: its releases one after the other, whose records need not be there. With
    /// --record FOLDER the records and a campaign.toml of them come there, and what is there already is not
    /// made again. A line typed /next leaves a release out, /back makes the last one again
    #[arg(long, value_name = "campaign.toml", conflicts_with_all = ["condition", "spring", "axis", "wind"])]
    campaign: Option<PathBuf>,
    /// Release N of a campaign's file, over and over; without #N, what the file says of model, air and rig
    #[arg(long, value_name = "campaign.toml#N")]
    condition: Option<String>,
    /// Name of the spring
    #[arg(long, value_name = "NAME")]
    spring: Option<String>,
    /// Axis the model turns about [default: mid]
    #[arg(long, value_parser = choices::axis())]
    axis: Option<Axis>,
    /// Wind speed, m/s; 0: off
    #[arg(long, value_name = "M_S", allow_negative_numbers = true)]
    wind: Option<f64>,
    /// Density of the air
    #[arg(long, value_name = "KG_M3", allow_negative_numbers = true)]
    density_kg_m3: Option<f64>,
    /// Moment of inertia about that axis [default: from the wind-off releases]
    #[arg(long, value_name = "KG_M2", allow_negative_numbers = true)]
    inertia_kg_m2: Option<f64>,
    /// Length of the model
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    length_m: Option<f64>,
    /// Its frontal area
    #[arg(long, value_name = "M2", allow_negative_numbers = true)]
    frontal_area_m2: Option<f64>,
    /// Linear stiffness of each spring
    #[arg(long, value_name = "N_PER_M", allow_negative_numbers = true)]
    stiffness_n_per_m: Option<f64>,
    /// Distance of each spring from the axis
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    spring_arm_m: Option<f64>,
    /// How far the front axis lies ahead of the middle one
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    axis_offset_m: Option<f64>,
}

impl ConditionArgs {
    /// What was said of them.
    pub fn wanted(&self) -> Wanted {
        let Self { campaign, condition, spring, axis, .. } = self.clone();
        Wanted {
            campaign,
            condition,
            spring,
            axis,
            wind_speed_m_s: self.wind,
            density_kg_m3: self.density_kg_m3,
            inertia_kg_m2: self.inertia_kg_m2,
            length_m: self.length_m,
            frontal_area_m2: self.frontal_area_m2,
            stiffness_n_per_m: self.stiffness_n_per_m,
            spring_arm_m: self.spring_arm_m,
            axis_offset_m: self.axis_offset_m,
        }
    }
}
