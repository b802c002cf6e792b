//! What each uncertain number does to the derivatives: first-order propagation, one number at a time.

use super::condition::Condition;
use super::inputs::{Inputs, Layout, Outputs, PointValues, Uncertain};
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

impl<'a> Propagation<'a> {
    pub(super) fn new(layout: &'a Layout, inputs: &Inputs, uncertain: &'a [Uncertain]) -> Self {
        let changed = |input: &Uncertain, by: f64| {
            let mut inputs = inputs.clone();
            (input.change)(&mut inputs, by);
            layout.outputs(&inputs)
        };
        let changes = uncertain
            .iter()
            .map(|input| (changed(input, input.u), changed(input, -input.u)))
            .collect();
        Self { layout, uncertain, values: layout.outputs(inputs), changes }
    }

    /// A value with its standard uncertainty and budget; `None` where it was not measured.
    fn assess(&self, of: impl Fn(&Outputs) -> f64) -> Option<(Quantity, Budget)> {
        let value = of(&self.values);
        let mut budget = Budget::default();
        for (input, (up, down)) in self.uncertain.iter().zip(&self.changes) {
            *(input.source)(&mut budget) += (0.5 * (of(up) - of(down))).powi(2);
        }
        let u = budget.shares().iter().map(|square| **square).sum::<f64>().sqrt();
        budget.shares().into_iter().for_each(|share| *share = share.sqrt());
        value.is_finite().then_some((Quantity::new(value, u), budget))
    }

    pub(super) fn inertia(&self, axis: Axis) -> Option<Quantity> {
        self.assess(|outputs| outputs.inertia_kg_m2[axis as usize]).map(|(quantity, _)| quantity)
    }

    pub(super) fn points(&self, conditions: &[Condition]) -> Vec<Point> {
        let point = |index: usize| {
            let at =
                |of: fn(&PointValues) -> f64| self.assess(|outputs| of(&outputs.points[index]));
            let (cn_beta, cn_beta_budget) = at(|p| p.mid.cn_beta)?;
            let (cn_r, cn_r_budget) = at(|p| p.mid.cn_r)?;
            let (cy_beta, cy_beta_budget) = at(|p| p.cy_beta).unzip();
            let (cy_r, cy_r_budget) = at(|p| p.cy_r).unzip();
            let on = &conditions[self.layout.places[index].mid.on];
            Some(Point {
                spring: on.setting.spring.clone(),
                wind_speed_m_s: on.setting.wind_speed_m_s,
                at: on.setting.at.clone(),
                reduced_frequency: self.values.points[index].reduced_frequency,
                cn_beta,
                cn_r,
                cy_beta,
                cy_r,
                cn_beta_front: at(|p| p.front.cn_beta).unzip().0,
                cn_r_front: at(|p| p.front.cn_r).unzip().0,
                budget: PointBudget {
                    cn_beta: cn_beta_budget,
                    cn_r: cn_r_budget,
                    cy_beta: cy_beta_budget,
                    cy_r: cy_r_budget,
                },
            })
        };
        (0..self.layout.places.len()).filter_map(point).collect()
    }
}
