//! Derivatives from a campaign's identified releases.

use super::campaign::{Campaign, ReleaseEntry};
use super::condition::{group, Condition, Identified};
use super::critical;
use super::inputs::{uncertain, Inputs, Layout};
use super::propagation::Propagation;
use super::table::{
    ByAxis, ConditionRow, InertiaLine, InertiaOrigin, ReleaseRow, SpringRow, Table,
};
use crate::error::{Error, Result};
use crate::quantity::Quantity;
use std::path::Path;
use yawrig_shared::axis::Axis;
use yawrig_shared::modal::Modal;

/// The releases by condition, and which conditions make a point.
///
/// ```
/// use yawrig_core::derivatives::campaign::{
///     AirEntry, Campaign, InertiaEntry, ModelEntry, ReleaseEntry, RigEntry,
/// };
/// use yawrig_core::derivatives::{condition::Identified, Computed};
/// use yawrig_core::quantity::Quantity;
/// use yawrig_shared::axis::Axis;
///
/// let release = |file: &str, wind_speed_m_s| {
///     ReleaseEntry::new(file, ("K4", 800.0), Axis::Mid, wind_speed_m_s)
/// };
/// let campaign = Campaign {
///     inertia: Some(InertiaEntry { mid_kg_m2: Some(0.5), ..InertiaEntry::default() }),
///     ..Campaign::new(
///         ModelEntry::new("mine", 0.6, 0.05),
///         AirEntry::new(1.2),
///         RigEntry::new(0.2, 0.1),
///         vec![release("off.csv", 0.0), release("on.csv", 10.0)],
///     )
/// };
/// let identified = [(8.0, 0.010), (7.9, 0.015)].map(|(wn, zeta)| {
///     Identified::new(Quantity::new(wn, 0.001), Quantity::new(zeta, 0.0001), 0.0, 30.0)
/// });
/// let table = Computed::new(&campaign, &identified)?.table("campaign.toml".as_ref(), "mine");
/// let point = &table.points[0];
/// // Izz (wn_off^2 - wn_on^2) over the dynamic pressure times area and length.
/// let expected = 0.5 * (8.0 * 8.0 - 7.9 * 7.9) / (0.5 * 1.2 * 10.0 * 10.0 * 0.05 * 0.6);
/// assert!((point.cn_beta.value / expected - 1.0).abs() < 1e-9, "{}", point.cn_beta);
/// assert!(point.cn_beta.u > 0.0 && point.cn_r.value < 0.0);
/// # Ok::<(), yawrig_core::error::Error>(())
/// ```
pub struct Computed<'a> {
    pub(super) campaign: &'a Campaign,
    identified: &'a [Identified],
    pub(super) conditions: Vec<Condition>,
    pub(super) layout: Layout,
    pub(super) inputs: Inputs,
}

impl<'a> Computed<'a> {
    /// `identified` holds one entry for each release of the campaign, in its order.
    ///
    /// # Errors
    /// Where no spring was released at the middle axis with the wind on.
    pub fn new(campaign: &'a Campaign, identified: &'a [Identified]) -> Result<Self> {
        let conditions = group(campaign, identified);
        let layout = Layout::new(campaign, &conditions);
        if layout.places.is_empty() {
            return Err(Error::NoMiddleAxis);
        }
        let inputs = Inputs::new(campaign, &conditions, &layout);
        Ok(Self { campaign, identified, conditions, layout, inputs })
    }

    /// The whole table, not validated yet; `file` and `method` are the names to print.
    pub fn table(&self, file: &Path, method: &str) -> Table {
        let uncertain = uncertain(self.campaign, &self.conditions, &self.layout, &self.inputs);
        let propagation = Propagation::new(&self.layout, &self.inputs, &uncertain);
        let row = |(entry, identified): (&ReleaseEntry, &Identified)| ReleaseRow {
            file: entry.file.clone(),
            spring: entry.spring.clone(),
            axis: entry.axis,
            wind_speed_m_s: entry.wind_speed_m_s,
            at: entry.at.clone(),
            identified: identified.clone(),
            validation_mse_deg2: None,
        };
        Table {
            schema_version: 1,
            campaign: file.to_owned(),
            model: self.campaign.model.name.clone(),
            method: method.to_owned(),
            inertia_kg_m2: ByAxis::from_fn(|axis| propagation.inertia(axis)),
            inertia_origin: ByAxis::from_fn(|axis| self.inertia_origin(axis)),
            springs: self.springs(),
            inertia_line: ByAxis::from_fn(|axis| self.inertia_line(axis)),
            points: propagation.points(&self.conditions),
            conditions: self
                .conditions
                .iter()
                .map(|condition| ConditionRow::new(condition, self.identified))
                .collect(),
            critical_speed: critical::speeds(&self.conditions, self.identified),
            releases: self.campaign.release.iter().zip(self.identified).map(row).collect(),
            assumed_zero: assumed_zero(self.campaign),
            notes: self.notes(),
            doubts: Vec::new(),
        }
    }

    /// For each release: the wind-on mode that the derivatives give back from the wind-off one, thesis Fig
    /// 4.21. `None` with the wind off, and where there is no point.
    pub fn responses(&self) -> Vec<Option<Modal>> {
        let mut responses = vec![None; self.identified.len()];
        let outputs = self.layout.outputs(&self.inputs);
        for (place, values) in self.layout.places.iter().zip(&outputs.points) {
            let front = place.front.map(|pair| (pair, values.front, Axis::Front));
            for (pair, derivatives, axis) in
                [(place.mid, values.mid, Axis::Mid)].into_iter().chain(front)
            {
                let response = derivatives.wind_on(
                    &self.inputs.modal(pair.off),
                    outputs.inertia_kg_m2[axis as usize],
                    &self.inputs.wind(pair.on),
                    self.inputs.model(),
                );
                for &release in &self.conditions[pair.on].setting.releases {
                    responses[release] = response;
                }
            }
        }
        responses
    }

    fn inertia_line(&self, axis: Axis) -> Option<InertiaLine> {
        let (known, _) = self.campaign.known_inertia()[axis as usize];
        let line = self.layout.line(&self.inputs, axis).filter(|_| known.is_none())?;
        let freedom = line.degrees_of_freedom;
        Some(InertiaLine {
            springs: freedom + 2,
            intercept_nm: Quantity::new(line.intercept, line.u_intercept * line.scatter_ratio()),
            chi_squared_per_degree: (freedom > 0).then(|| line.chi_squared / freedom as f64),
        })
    }

    fn inertia_origin(&self, axis: Axis) -> Option<InertiaOrigin> {
        let (known, _) = self.campaign.known_inertia()[axis as usize];
        if known.is_some() {
            return Some(InertiaOrigin::Given);
        }
        self.layout.inertia_kg_m2(&self.inputs, axis)?;
        Some(match self.layout.line(&self.inputs, axis) {
            Some(_) => InertiaOrigin::Line,
            None => InertiaOrigin::OneSpring,
        })
    }

    fn springs(&self) -> Vec<SpringRow> {
        let mut springs: Vec<SpringRow> = Vec::new();
        for entry in &self.campaign.release {
            if springs.iter().all(|row| row.spring != entry.spring) {
                let stiffness_n_per_m = self.campaign.stiffness_of(&entry.spring);
                springs.push(SpringRow { spring: entry.spring.clone(), stiffness_n_per_m });
            }
        }
        springs
    }

    /// What a reader of the table must know besides, a sentence each.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if self.conditions.iter().all(|condition| condition.setting.releases.len() == 1) {
            notes.push("repeatability is not assessed: no condition was released twice".to_owned());
        }
        notes.extend(self.conditions.iter().filter_map(Condition::scatter));
        let used: Vec<usize> =
            self.layout.places.iter().filter_map(|place| Some(place.front?.on)).collect();
        for (index, condition) in self.conditions.iter().enumerate() {
            let is_left_over = condition.setting.axis == Axis::Front && !used.contains(&index);
            if is_left_over && condition.setting.wind_speed_m_s > 0.0 {
                notes.push(format!(
                    "spring {} at {} m/s was released on the front axis only: no point",
                    condition.setting.spring, condition.setting.wind_speed_m_s
                ));
            }
        }
        for axis in Axis::BOTH {
            let Some(line) = self.inertia_line(axis) else { continue };
            if line.intercept_nm.value.abs() > 3.0 * line.intercept_nm.u && line.springs > 2 {
                notes.push(format!(
                    "{axis} axis: the line of Kr against wn_off^2 misses the origin by {} N m/rad: there is other stiffness than 2 Ks b^2",
                    line.intercept_nm
                ));
            }
            if line.chi_squared_per_degree.is_some_and(|chi| chi > 4.0) {
                notes.push(format!(
                    "{axis} axis: the springs scatter about that line more than stated; the inertia's uncertainty is widened for it"
                ));
            }
        }
        notes
    }
}

/// Izz about `axis` (kg m2) as the table of these releases will have it: the campaign's own, or from those
/// made with the wind off; `None` where there is neither.
pub fn inertia_kg_m2(campaign: &Campaign, identified: &[Identified], axis: Axis) -> Option<f64> {
    let conditions = group(campaign, identified);
    let layout = Layout::new(campaign, &conditions);
    layout.inertia_kg_m2(&Inputs::new(campaign, &conditions, &layout), axis)
}

/// The campaign file's entries left out, whose uncertainty is taken as zero.
fn assumed_zero(campaign: &Campaign) -> Vec<String> {
    let Campaign { model, air, rig, release, .. } = campaign;
    let known = campaign.known_inertia();
    let from_line = known.iter().any(|(inertia, _)| inertia.is_none());
    let lacks_u = |axis: Axis| matches!(known[axis as usize], (Some(_), None));
    let missing_in = |of: fn(&ReleaseEntry) -> Option<f64>, wind_on: bool| {
        release.iter().any(|r| of(r).is_none() && (r.wind_speed_m_s > 0.0 || !wind_on))
    };
    [
        ("air.density_u_kg_m3", air.density_u_kg_m3.is_none()),
        ("release.wind_speed_u_m_s", missing_in(|r| r.wind_speed_u_m_s, true)),
        ("model.length_u_m", model.length_u_m.is_none()),
        ("model.frontal_area_u_m2", model.frontal_area_u_m2.is_none()),
        ("rig.axis_offset_u_m", rig.axis_offset_u_m.is_none()),
        ("rig.clock_u_ppm", rig.clock_u_ppm.is_none()),
        ("rig.spring_arm_u_m", from_line && rig.spring_arm_u_m.is_none()),
        (
            "release.spring_stiffness_u_n_per_m",
            from_line && missing_in(|r| r.spring_stiffness_u_n_per_m, false),
        ),
        ("inertia.mid_u_kg_m2", lacks_u(Axis::Mid)),
        ("inertia.front_u_kg_m2", lacks_u(Axis::Front)),
    ]
    .into_iter()
    .filter(|(_, missing)| *missing)
    .map(|(name, _)| name.to_owned())
    .collect()
}
