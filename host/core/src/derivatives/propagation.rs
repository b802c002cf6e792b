//! What each uncertain number does to the derivatives: first-order propagation, one number at a time.

use super::condition::Condition;
use super::inputs::{axis_index, Inputs, Layout, PointValues, Source, Uncertain};
use super::table::{Budget, Point, PointBudget};
use crate::quantity::Quantity;
use yawrig_shared::axis::Axis;

/// The values and what each uncertain number does to them.
pub(super) struct Propagation<'a> {
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
    pub(super) fn new(layout: &'a Layout, inputs: &Inputs, uncertain: &'a [Uncertain]) -> Self {
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
                Source::Clock => &mut squares.clock,
            };
            *place += (0.5 * (of(up) - of(down))).powi(2);
        }
        let Budget { repeatability, fit, inertia, air_density, wind_speed, geometry, clock } =
            squares;
        let u =
            (repeatability + fit + inertia + air_density + wind_speed + geometry + clock).sqrt();
        let budget = Budget {
            repeatability: repeatability.sqrt(),
            fit: fit.sqrt(),
            inertia: inertia.sqrt(),
            air_density: air_density.sqrt(),
            wind_speed: wind_speed.sqrt(),
            geometry: geometry.sqrt(),
            clock: clock.sqrt(),
        };
        value.is_finite().then_some((Quantity::new(value, u), budget))
    }

    pub(super) fn inertia(&self, axis: Axis) -> Option<Quantity> {
        self.assess(|outputs| outputs.inertia_kg_m2[axis_index(axis)]).map(|(quantity, _)| quantity)
    }

    pub(super) fn points(&self, conditions: &[Condition]) -> Vec<Point> {
        let point = |index: usize| {
            let at =
                |of: fn(&PointValues) -> f64| self.assess(|outputs| of(&outputs.points[index]));
            let (cn_beta, cn_beta_budget) = at(|p| p.mid.cn_beta)?;
            let (cn_r, cn_r_budget) = at(|p| p.mid.cn_r)?;
            let (cy_beta, cy_r) = (at(|p| p.cy_beta), at(|p| p.cy_r));
            let on = &conditions[self.layout.places[index].mid.on];
            Some(Point {
                spring: on.setting.spring.clone(),
                wind_speed_m_s: on.setting.wind_speed_m_s,
                at: on.setting.at.clone(),
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
