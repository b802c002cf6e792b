//! The virtual rig: a model on springs in the wind, released and watched by a potentiometer.
//!
//! Its truth is planted: springs, inertia and the derivatives of the thesis's Tables 3.3 and 3.4 (Ramli
//! 2008). The motion is integrated step by step from the equation of motion, never taken from the closed
//! form, so that a fit of the closed form to it proves something.

#![forbid(unsafe_code)]

mod corners;
mod effects;
mod error;
mod library;
mod moments;
mod motion;
mod runge_kutta;
mod sensor;
mod springs;

pub use effects::{kinds, Effect, Effects};
pub use error::{Error, Quantity, Result};
pub use library::{Kind, Parameter, LIBRARY};
pub use motion::{End, Motion, Sample, Samples, Start};
pub use runge_kutta::runge_kutta;
pub use sensor::{Sees, Sensor};
pub use springs::{Spring, SPRINGS};

use serde::Serialize;
use yawrig_shared::axis::Axis;
use yawrig_shared::derivatives::{side_force, torsional_stiffness_nm, Model, Wind, YawDerivatives};
use yawrig_shared::modal::Modal;

/// What one release is made under.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Condition {
    pub spring: Spring,
    pub axis: Axis,
    /// 0: wind off.
    pub wind_speed_m_s: f64,
}

/// The rig and the model on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rig {
    pub model: Model,
    pub air_density_kg_m3: f64,
    /// Distance of each spring from the axis of rotation, m.
    pub spring_arm_m: f64,
    /// How far the front axis lies ahead of the middle one, m.
    pub axis_offset_m: f64,
    pub mid_inertia_kg_m2: f64,
    pub front_inertia_kg_m2: f64,
    /// Cr / Izz, the same on every spring and axis, rad/s.
    pub mechanical_damping_rad_s: f64,
}

impl Default for Rig {
    /// The thesis's rig: Davis model, inertias of 3.5 (the front one with its misprint put right), mechanical
    /// damping from spring K3's half-life of 21.97 s with the wind off (Fig 3.10).
    fn default() -> Self {
        Self {
            model: Model { length_m: 0.625, frontal_area_m2: 0.036 },
            air_density_kg_m3: 1.2,
            spring_arm_m: 0.1,
            axis_offset_m: 0.05,
            mid_inertia_kg_m2: 0.101,
            front_inertia_kg_m2: 0.1205,
            mechanical_damping_rad_s: 2.0 * std::f64::consts::LN_2 / 21.97,
        }
    }
}

/// Everything planted about one spring at one wind speed, per radian.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Truth {
    pub cn_beta: f64,
    pub cn_r: f64,
    pub cy_beta: f64,
    pub cy_r: f64,
}

/// One release under way.
pub struct Release {
    /// What an identification should find.
    pub truth: Modal,
    /// About this release's axis; `None` with the wind off.
    pub derivatives: Option<YawDerivatives>,
    /// The potentiometer's readings, made as they are asked for.
    pub samples: Samples,
}

impl Rig {
    /// Izz about `axis`, kg m2.
    pub fn inertia_kg_m2(&self, axis: Axis) -> f64 {
        match axis {
            Axis::Mid => self.mid_inertia_kg_m2,
            Axis::Front => self.front_inertia_kg_m2,
        }
    }

    /// The air stream at `speed_m_s`.
    pub fn wind(&self, speed_m_s: f64) -> Wind {
        Wind { density_kg_m3: self.air_density_kg_m3, speed_m_s }
    }

    /// The planted derivatives on `spring`: yaw moment at the middle axis and side force.
    pub fn truth(&self, spring: &Spring) -> Truth {
        let (mid, front) =
            (self.derivatives(spring, Axis::Mid), self.derivatives(spring, Axis::Front));
        let side = |mid, front| side_force(mid, front, self.model.length_m, self.axis_offset_m);
        Truth {
            cn_beta: mid.cn_beta,
            cn_r: mid.cn_r,
            cy_beta: side(mid.cn_beta, front.cn_beta),
            cy_r: side(mid.cn_r, front.cn_r),
        }
    }

    /// The planted yaw moment derivatives about `axis`, the same at every wind speed.
    pub fn derivatives(&self, spring: &Spring, axis: Axis) -> YawDerivatives {
        spring.derivatives(axis, self.model.length_m, self.axis_offset_m)
    }

    /// Every spring on both axes, with the wind off and then at `wind_speed_m_s`.
    pub fn conditions(&self, wind_speed_m_s: f64) -> impl Iterator<Item = Condition> {
        SPRINGS.into_iter().flat_map(move |spring| {
            Axis::BOTH.into_iter().flat_map(move |axis| {
                [0.0, wind_speed_m_s].map(|wind_speed_m_s| Condition {
                    spring,
                    axis,
                    wind_speed_m_s,
                })
            })
        })
    }

    /// Natural frequency and damping ratio under `condition`.
    ///
    /// # Errors
    /// Where the wind overcomes the springs, so that the model diverges instead of oscillating.
    pub fn modal(&self, condition: &Condition) -> Result<Modal> {
        let Condition { spring, axis, wind_speed_m_s } = condition;
        let inertia_kg_m2 = self.inertia_kg_m2(*axis);
        let stiffness_nm = torsional_stiffness_nm(spring.stiffness_n_per_m, self.spring_arm_m);
        let off = Modal::from_stiffness_and_damping(
            stiffness_nm / inertia_kg_m2,
            self.mechanical_damping_rad_s,
        );
        off.and_then(|off| {
            let wind = self.wind(*wind_speed_m_s);
            self.derivatives(spring, *axis).wind_on(&off, inertia_kg_m2, &wind, &self.model)
        })
        .ok_or_else(|| {
            Error::wrong(Quantity::WindSpeed, format!(
                "spring {} at {wind_speed_m_s} m/s: the wind overcomes the springs, the model does not oscillate",
                spring.name
            ), "take a stiffer spring or a lower wind speed")
        })
    }

    /// Releases the model. The same seed gives the same noise.
    ///
    /// # Errors
    /// Those of [`Self::modal`].
    pub fn release(
        &self,
        condition: &Condition,
        start: &Start,
        sensor: &Sensor,
        seed: u64,
    ) -> Result<Release> {
        self.release_with(condition, &Effects::default(), start, sensor, seed)
    }

    /// Releases the model with `effects` hidden in the record, its end put where [`Start::limited`] says.
    ///
    /// # Errors
    /// Those of [`Self::modal`] and [`Samples::with_effects`].
    pub fn release_with(
        &self,
        condition: &Condition,
        effects: &Effects,
        start: &Start,
        sensor: &Sensor,
        seed: u64,
    ) -> Result<Release> {
        let truth = self.modal(condition)?;
        let derivatives = (condition.wind_speed_m_s != 0.0)
            .then(|| self.derivatives(&condition.spring, condition.axis));
        let effects = effects.clone().in_wind(condition.wind_speed_m_s);
        let start = start.limited(&truth, &effects);
        let samples = Samples::with_effects(&truth, &effects, &start, sensor, seed)?;
        Ok(Release { truth, derivatives, samples })
    }
}

#[cfg(test)]
mod tests;
