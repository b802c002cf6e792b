//! The derivative table of a campaign with its uncertainties.

use super::campaign::{Campaign, CampaignFile};
use super::condition::{group, Condition, Identified};
use super::inputs::{axis_index, uncertain, Inputs, Layout, PointValues, Source, Uncertain};
use super::validation;
use crate::error::{Error, Result};
use crate::interrupt;
use crate::quantity::Quantity;
use crate::record::Record;
use crate::rig::Axis;
use rayon::prelude::*;
use serde::Serialize;
use std::path::PathBuf;

/// A way to natural frequency and damping ratio.
pub type Identify<'a> = dyn Fn(&Record) -> Result<Identified> + Sync + 'a;

/// Contributions to a standard uncertainty (k = 1), in the unit of the value; their squares add up to its square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Budget {
    /// Scatter between releases of one condition beyond their fits' uncertainties.
    pub repeatability: f64,
    pub fit: f64,
    /// Springs, arm, scatter about the line, or the given inertia's own.
    pub inertia: f64,
    pub air_density: f64,
    pub wind_speed: f64,
    /// Length, frontal area, axis offset.
    pub geometry: f64,
}

/// The budgets of one point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PointBudget {
    pub cn_beta: Budget,
    pub cn_r: Budget,
    pub cy_beta: Option<Budget>,
    pub cy_r: Option<Budget>,
}

/// The derivatives on one spring at one wind speed, per radian; `cn_*` at the middle axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Point {
    pub spring: String,
    pub wind_speed_m_s: f64,
    pub reduced_frequency: f64,
    pub cn_beta: Quantity,
    /// Combined: Cn_r - Cn_betadot.
    pub cn_r: Quantity,
    pub cy_beta: Option<Quantity>,
    pub cy_r: Option<Quantity>,
    pub cn_beta_front: Option<Quantity>,
    pub cn_r_front: Option<Quantity>,
    pub budget: PointBudget,
}

/// A value for each axis; `None` where nothing is known of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ByAxis<T> {
    pub mid: Option<T>,
    pub front: Option<T>,
}

/// The straight line of Kr against wn_off^2.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct InertiaLine {
    pub springs: usize,
    /// Kr at wn_off^2 = 0, N m/rad: nought where 2 Ks b^2 is all the stiffness there is. Widened for scatter.
    pub intercept_nm: Quantity,
    /// About 1 where the stated uncertainties are true; `null` for two springs.
    pub chi_squared_per_degree: Option<f64>,
}

/// One release with what was found in it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReleaseRow {
    pub file: String,
    pub spring: String,
    pub axis: Axis,
    pub wind_speed_m_s: f64,
    #[serde(flatten)]
    pub identified: Identified,
    /// Mean squared difference between the record and the response computed from the derivatives, over what was
    /// analysed, deg2; `null` with the wind off.
    pub validation_mse_deg2: Option<f64>,
}

/// Everything `derivatives` has to say.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table {
    pub schema_version: u32,
    pub campaign: PathBuf,
    pub model: String,
    pub method: String,
    pub inertia_kg_m2: ByAxis<Quantity>,
    pub inertia_line: ByAxis<InertiaLine>,
    pub points: Vec<Point>,
    pub releases: Vec<ReleaseRow>,
    /// Entries of the campaign file left out, whose uncertainty is taken as nought.
    pub assumed_zero: Vec<String>,
    pub notes: Vec<String>,
}

/// Identifies every record on all cores and computes the table. `method` is the name to print.
///
/// # Errors
/// Exit 3 for a record that cannot be read or in which nothing is found, or where there is no point to compute;
/// 130 where the user stops it.
pub fn evaluate(file: &CampaignFile, method: &str, identify: &Identify) -> Result<Table> {
    let campaign = &file.campaign;
    let one = |index: usize| {
        interrupt::check()?;
        identify(&Record::read(&file.record_path(index))?)
    };
    let found: Vec<Result<Identified>> =
        (0..campaign.release.len()).into_par_iter().map(one).collect();
    // Collected first, so that of several bad records always the first is named.
    let identified = found.into_iter().collect::<Result<Vec<_>>>()?;
    let conditions = group(campaign, &identified);
    let layout = Layout::new(campaign, &conditions);
    if layout.places.is_empty() {
        return Err(Error::data(format!(
            "{}: no spring was released at the middle axis with the wind on",
            file.path.display()
        ))
        .help("add releases with axis = \"mid\": Cn_beta and Cn_r are those of the middle axis"));
    }
    let inputs = Inputs::new(campaign, &conditions, &layout);
    let uncertain = uncertain(campaign, &conditions, &layout, &inputs);
    let propagation = Propagation::new(&layout, &inputs, &uncertain);
    let points = propagation.points(&conditions);
    let releases = releases(file, &identified, &conditions, &layout, &inputs)?;
    Ok(Table {
        schema_version: 1,
        campaign: file.path.clone(),
        model: campaign.model.name.clone(),
        method: method.to_owned(),
        inertia_kg_m2: ByAxis {
            mid: propagation.inertia(Axis::Mid),
            front: propagation.inertia(Axis::Front),
        },
        inertia_line: ByAxis {
            mid: inertia_line(campaign, &layout, &inputs, Axis::Mid),
            front: inertia_line(campaign, &layout, &inputs, Axis::Front),
        },
        points,
        releases,
        assumed_zero: assumed_zero(campaign),
        notes: notes(campaign, &conditions, &layout, &inputs),
    })
}

/// The values and what each uncertain number does to them.
struct Propagation<'a> {
    layout: &'a Layout,
    uncertain: &'a [Uncertain],
    values: Outputs,
    /// Half the difference between each number one standard uncertainty up and down.
    changes: Vec<(Outputs, Outputs)>,
}

struct Outputs {
    inertia_kg_m2: [f64; 2],
    points: Vec<PointValues>,
}

impl Outputs {
    fn new(layout: &Layout, inputs: &Inputs) -> Self {
        let inertia = Axis::BOTH.map(|axis| layout.inertia_kg_m2(inputs, axis).unwrap_or(f64::NAN));
        let points =
            layout.places.iter().map(|place| layout.values(inputs, place, inertia)).collect();
        Self { inertia_kg_m2: inertia, points }
    }
}

impl<'a> Propagation<'a> {
    fn new(layout: &'a Layout, inputs: &Inputs, uncertain: &'a [Uncertain]) -> Self {
        let changed = |input: &Uncertain, by: f64| {
            let mut inputs = inputs.clone();
            (input.change)(&mut inputs, by);
            Outputs::new(layout, &inputs)
        };
        let changes = uncertain
            .iter()
            .map(|input| (changed(input, input.u), changed(input, -input.u)))
            .collect();
        Self { layout, uncertain, values: Outputs::new(layout, inputs), changes }
    }

    /// A value with its standard uncertainty and budget; `None` where it was not measured.
    fn assess(&self, of: impl Fn(&Outputs) -> f64) -> Option<(Quantity, Budget)> {
        let value = of(&self.values);
        let mut squares = Budget::default();
        for (input, (up, down)) in self.uncertain.iter().zip(&self.changes) {
            let place = match input.source {
                Source::Repeatability => &mut squares.repeatability,
                Source::Fit => &mut squares.fit,
                Source::Inertia => &mut squares.inertia,
                Source::AirDensity => &mut squares.air_density,
                Source::WindSpeed => &mut squares.wind_speed,
                Source::Geometry => &mut squares.geometry,
            };
            *place += (0.5 * (of(up) - of(down))).powi(2);
        }
        let Budget { repeatability, fit, inertia, air_density, wind_speed, geometry } = squares;
        let u = (repeatability + fit + inertia + air_density + wind_speed + geometry).sqrt();
        let budget = Budget {
            repeatability: repeatability.sqrt(),
            fit: fit.sqrt(),
            inertia: inertia.sqrt(),
            air_density: air_density.sqrt(),
            wind_speed: wind_speed.sqrt(),
            geometry: geometry.sqrt(),
        };
        value.is_finite().then_some((Quantity::new(value, u), budget))
    }

    fn inertia(&self, axis: Axis) -> Option<Quantity> {
        self.assess(|outputs| outputs.inertia_kg_m2[axis_index(axis)]).map(|(quantity, _)| quantity)
    }

    fn points(&self, conditions: &[Condition]) -> Vec<Point> {
        let point = |index: usize| {
            let at =
                |of: fn(&PointValues) -> f64| self.assess(|outputs| of(&outputs.points[index]));
            let (cn_beta, cn_beta_budget) = at(|p| p.mid.cn_beta)?;
            let (cn_r, cn_r_budget) = at(|p| p.mid.cn_r)?;
            let (cy_beta, cy_r) = (at(|p| p.cy_beta), at(|p| p.cy_r));
            let on = &conditions[self.layout.places[index].mid.on];
            Some(Point {
                spring: on.spring.clone(),
                wind_speed_m_s: on.wind_speed_m_s,
                reduced_frequency: self.values.points[index].reduced_frequency,
                cn_beta,
                cn_r,
                cy_beta: cy_beta.map(|(quantity, _)| quantity),
                cy_r: cy_r.map(|(quantity, _)| quantity),
                cn_beta_front: at(|p| p.front.cn_beta).map(|(quantity, _)| quantity),
                cn_r_front: at(|p| p.front.cn_r).map(|(quantity, _)| quantity),
                budget: PointBudget {
                    cn_beta: cn_beta_budget,
                    cn_r: cn_r_budget,
                    cy_beta: cy_beta.map(|(_, budget)| budget),
                    cy_r: cy_r.map(|(_, budget)| budget),
                },
            })
        };
        (0..self.layout.places.len()).filter_map(point).collect()
    }
}

fn inertia_line(
    campaign: &Campaign,
    layout: &Layout,
    inputs: &Inputs,
    axis: Axis,
) -> Option<InertiaLine> {
    let known = campaign.inertia.clone().unwrap_or_default();
    let is_known = match axis {
        Axis::Mid => known.mid_kg_m2.is_some(),
        Axis::Front => known.front_kg_m2.is_some(),
    };
    let line = layout.line(inputs, axis).filter(|_| !is_known)?;
    let freedom = line.degrees_of_freedom;
    Some(InertiaLine {
        springs: freedom + 2,
        intercept_nm: Quantity::new(line.intercept, line.u_intercept * line.scatter_ratio()),
        chi_squared_per_degree: (freedom > 0).then(|| line.chi_squared / freedom as f64),
    })
}

/// Every release with what was found in it and, with the wind on, its validation.
fn releases(
    file: &CampaignFile,
    identified: &[Identified],
    conditions: &[Condition],
    layout: &Layout,
    inputs: &Inputs,
) -> Result<Vec<ReleaseRow>> {
    let mut responses = vec![None; identified.len()];
    let inertia = Axis::BOTH.map(|axis| layout.inertia_kg_m2(inputs, axis).unwrap_or(f64::NAN));
    for place in &layout.places {
        let values = layout.values(inputs, place, inertia);
        let both =
            [(Some(place.mid), values.mid, Axis::Mid), (place.front, values.front, Axis::Front)];
        for (pair, derivatives, axis) in both {
            let Some(pair) = pair else { continue };
            let response = derivatives.wind_on(
                &inputs.modal(pair.off),
                inertia[axis_index(axis)],
                &inputs.wind(pair.on),
                inputs.model(),
            );
            for &release in &conditions[pair.on].releases {
                responses[release] = response;
            }
        }
    }
    let row = |index: usize| {
        interrupt::check()?;
        let entry = &file.campaign.release[index];
        let validation_mse_deg2 = match &responses[index] {
            Some(modal) => {
                let record = Record::read(&file.record_path(index))?;
                let Identified { from_s, to_s, .. } = identified[index];
                validation::mean_squared_error_deg2(&record, from_s, to_s, modal)
            }
            None => None,
        };
        Ok(ReleaseRow {
            file: entry.file.clone(),
            spring: entry.spring.clone(),
            axis: entry.axis,
            wind_speed_m_s: entry.wind_speed_m_s,
            identified: identified[index],
            validation_mse_deg2,
        })
    };
    (0..identified.len()).into_par_iter().map(row).collect()
}

fn assumed_zero(campaign: &Campaign) -> Vec<String> {
    let Campaign { model, air, rig, inertia, release, .. } = campaign;
    let known = inertia.clone().unwrap_or_default();
    let from_line = known.mid_kg_m2.is_none() || known.front_kg_m2.is_none();
    let missing_in = |of: fn(&super::campaign::ReleaseEntry) -> Option<f64>, wind_on: bool| {
        release.iter().any(|r| of(r).is_none() && (r.wind_speed_m_s > 0.0 || !wind_on))
    };
    [
        ("air.density_u_kg_m3", air.density_u_kg_m3.is_none()),
        ("release.wind_speed_u_m_s", missing_in(|r| r.wind_speed_u_m_s, true)),
        ("model.length_u_m", model.length_u_m.is_none()),
        ("model.frontal_area_u_m2", model.frontal_area_u_m2.is_none()),
        ("rig.axis_offset_u_m", rig.axis_offset_u_m.is_none()),
        ("rig.spring_arm_u_m", from_line && rig.spring_arm_u_m.is_none()),
        (
            "release.spring_stiffness_u_n_per_m",
            from_line && missing_in(|r| r.spring_stiffness_u_n_per_m, false),
        ),
        ("inertia.mid_u_kg_m2", known.mid_kg_m2.is_some() && known.mid_u_kg_m2.is_none()),
        ("inertia.front_u_kg_m2", known.front_kg_m2.is_some() && known.front_u_kg_m2.is_none()),
    ]
    .into_iter()
    .filter(|(_, missing)| *missing)
    .map(|(name, _)| name.to_owned())
    .collect()
}

fn notes(
    campaign: &Campaign,
    conditions: &[Condition],
    layout: &Layout,
    inputs: &Inputs,
) -> Vec<String> {
    let mut notes = Vec::new();
    if conditions.iter().all(|condition| condition.releases.len() == 1) {
        notes.push("repeatability is not assessed: no condition was released twice".to_owned());
    }
    let used: Vec<usize> = layout.places.iter().filter_map(|place| Some(place.front?.on)).collect();
    for (index, condition) in conditions.iter().enumerate() {
        let is_left_over = condition.axis == Axis::Front && !used.contains(&index);
        if is_left_over && condition.wind_speed_m_s > 0.0 {
            notes.push(format!(
                "spring {} at {} m/s was released on the front axis only: no point",
                condition.spring, condition.wind_speed_m_s
            ));
        }
    }
    for axis in Axis::BOTH {
        let Some(line) = inertia_line(campaign, layout, inputs, axis) else { continue };
        if line.intercept_nm.value.abs() > 3.0 * line.intercept_nm.u && line.springs > 2 {
            notes.push(format!(
                "{axis} axis: the line of Kr against wn_off^2 misses the origin by {} N m/rad: there is other stiffness than 2 Ks b^2",
                line.intercept_nm
            ));
        }
        if line.chi_squared_per_degree.is_some_and(|chi| chi > 4.0) {
            notes.push(format!(
                "{axis} axis: the springs scatter about that line more than stated, the inertia's uncertainty is widened for it"
            ));
        }
    }
    notes
}
