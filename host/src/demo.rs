//! The main job: releases on all springs, played into a device, to a table of derivatives.

use crate::error::Result;
use crate::interrupt;
use crate::link::bench::Bench;
use crate::replay::wait_for;
use crate::rig::{Axis, Condition, Rig, Sensor, Spring, Start, Truth, SPRINGS};
use std::time::Duration;
use yawrig_shared::derivatives::{
    reduced_frequency, side_force, torsional_stiffness_nm, YawDerivatives,
};
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{self, Event, ReleaseResult, Request, Settings, WindowResult};

/// Samples handed to the device at once.
const CHUNK: usize = 2000;

/// One release as the device saw it.
#[derive(Clone, Debug)]
pub struct Made {
    pub condition: Condition,
    pub truth: Modal,
    pub result: ReleaseResult,
    pub windows: Vec<WindowResult>,
}

impl Made {
    /// The device's estimate.
    pub fn modal(&self) -> Modal {
        Modal {
            natural_frequency_rad_s: f64::from(self.result.natural_frequency_rad_s.value),
            damping_ratio: f64::from(self.result.damping_ratio.value),
        }
    }
}

/// What a demo is run with.
#[derive(Clone, Debug)]
pub struct Plan {
    pub rig: Rig,
    pub wind_speed_m_s: f64,
    pub start: Start,
    pub sensor: Sensor,
    pub seed: u64,
}

/// Makes every release, in an order that gives the device its wind-off reference first.
/// `seen` is told of each as soon as the device has spoken.
///
/// # Errors
/// Those of the link, and 130.
pub fn releases(
    bench: &mut Bench,
    plan: &Plan,
    seen: &mut dyn FnMut(&Made) -> Result<()>,
) -> Result<Vec<Made>> {
    let settings =
        Settings { degrees_per_count: plan.sensor.adc_step_deg as f32, ..Settings::default() };
    bench.client.tell(&Request::Configure(settings), "the settings")?;
    let mut made = Vec::new();
    for (index, condition) in plan.rig.conditions(plan.wind_speed_m_s).enumerate() {
        let release = release(bench, plan, &condition, plan.seed.wrapping_add(index as u64))?;
        seen(&release)?;
        made.push(release);
    }
    Ok(made)
}

fn release(bench: &mut Bench, plan: &Plan, condition: &Condition, seed: u64) -> Result<Made> {
    let rig = &plan.rig;
    let announced = wire::Condition {
        wind: rig.wind(condition.wind_speed_m_s),
        model: rig.model,
        inertia_kg_m2: rig.inertia_kg_m2(condition.axis),
    };
    bench.client.tell(&Request::Condition(announced), "the wind speed")?;
    let mut after_samples = bench.client.status()?.samples;
    let release = rig.release(condition, &plan.start, &plan.sensor, seed)?;
    let mut samples = release.samples.filter_map(|sample| sample.counts);
    loop {
        interrupt::check()?;
        let chunk: Vec<u16> = samples.by_ref().take(CHUNK).collect();
        if chunk.is_empty() {
            break;
        }
        after_samples = after_samples.wrapping_add(chunk.len() as u32);
        bench.play(&chunk)?;
    }
    bench.client.tell(&Request::EndRelease { after_samples }, "the end of the record")?;
    wait_for(bench, after_samples)?;
    let (mut windows, mut result) = (Vec::new(), None);
    // All the device had to say went out before it said it had all samples.
    while let Some(numbered) = bench
        .client
        .next_event(Duration::ZERO)
        .map_err(|e| bench.client.explain(e, "its events"))?
    {
        match numbered.event {
            Event::Window(window) => windows.push(window),
            Event::Release(release) => result = Some(release),
            Event::Phase { .. } => {}
        }
    }
    let result = result.ok_or_else(|| {
        crate::error::Error::new(
            crate::error::Exit::Timeout,
            format!("the device said nothing of the release on {}", condition.spring.name),
        )
    })?;
    Ok(Made { condition: *condition, truth: release.truth, result, windows })
}

/// One spring's derivatives, per radian, and what was planted.
#[derive(Clone, Debug)]
pub struct Point {
    pub spring: Spring,
    pub reduced_frequency: f64,
    pub cn_beta: f64,
    pub cn_r: f64,
    pub cy_beta: f64,
    pub cy_r: f64,
    pub truth: Truth,
}

/// The device's answers as derivatives.
#[derive(Clone, Debug)]
pub struct Table {
    /// About the middle and the front axis, from the wind-off releases.
    pub inertia_kg_m2: [f64; 2],
    pub points: Vec<Point>,
}

impl Table {
    /// From all releases of a plan.
    pub fn of(plan: &Plan, made: &[Made]) -> Self {
        let rig = &plan.rig;
        let find = |spring: &Spring, axis: Axis, on: bool| {
            made.iter().find(|m| {
                m.condition.spring.name == spring.name
                    && m.condition.axis == axis
                    && (m.condition.wind_speed_m_s != 0.0) == on
            })
        };
        let inertia = |axis: Axis| {
            let points: Vec<(f64, f64)> = SPRINGS
                .iter()
                .filter_map(|spring| {
                    let off = find(spring, axis, false)?.modal().stiffness_rad2_s2();
                    Some((off, torsional_stiffness_nm(spring.stiffness_n_per_m, rig.spring_arm_m)))
                })
                .collect();
            slope(&points)
        };
        let inertia_kg_m2 = Axis::BOTH.map(inertia);
        let wind = rig.wind(plan.wind_speed_m_s);
        let at = |spring: &Spring, axis: Axis| {
            let (on, off) = (find(spring, axis, true)?.modal(), find(spring, axis, false)?.modal());
            let inertia = inertia_kg_m2[axis as usize];
            Some((on, YawDerivatives::from_releases(&on, &off, inertia, &wind, &rig.model)))
        };
        let points = SPRINGS
            .into_iter()
            .filter_map(|spring| {
                let (on, mid) = at(&spring, Axis::Mid)?;
                let (_, front) = at(&spring, Axis::Front)?;
                let side =
                    |mid, front| side_force(mid, front, rig.model.length_m, rig.axis_offset_m);
                Some(Point {
                    reduced_frequency: reduced_frequency(&on, &wind, &rig.model),
                    cn_beta: mid.cn_beta,
                    cn_r: mid.cn_r,
                    cy_beta: side(mid.cn_beta, front.cn_beta),
                    cy_r: side(mid.cn_r, front.cn_r),
                    truth: rig.truth(&spring),
                    spring,
                })
            })
            .collect();
        Self { inertia_kg_m2, points }
    }

    /// Shares by which Cn_beta and Cn_r miss the truth: median and worst of each.
    pub fn misses(&self) -> [[f64; 2]; 2] {
        let spread = |miss: &dyn Fn(&Point) -> f64| {
            let mut all: Vec<f64> = self.points.iter().map(|p| miss(p).abs()).collect();
            all.sort_by(f64::total_cmp);
            let middle = all.len() / 2;
            let median = if all.len() % 2 == 0 {
                0.5 * (all[middle - 1] + all[middle])
            } else {
                all[middle]
            };
            [median, all[all.len() - 1]]
        };
        [spread(&|p| p.cn_beta / p.truth.cn_beta - 1.0), spread(&|p| p.cn_r / p.truth.cn_r - 1.0)]
    }
}

fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (mx, my) =
        (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>()
        / points.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>()
}
