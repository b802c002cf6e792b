//! The main job: releases on all springs, played into a device, to a table of derivatives.

pub mod results;
pub mod reveal;
pub mod story;

use std::path::Path;
use std::time::Duration;
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::interrupt;
use yawrig_campaign::simulated;
use yawrig_core::derivatives::table::Point;
use yawrig_core::derivatives::Computed;
use yawrig_core::identify::damped_sinusoid::DampedSinusoid;
use yawrig_core::identify::least_squares::linear_start;
use yawrig_core::identify::samples::Samples;
use yawrig_link::bench::Bench;
use yawrig_link::replay::{self, collect, main_release, wait_for};
use yawrig_measuring::answers::{identified, Answer, By};
use yawrig_report::drawn;
use yawrig_report::trace::{ModelTrace, Trace};
use yawrig_rig::{Condition, Rig, Sensor, Spring, Start, Truth};
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{self, Flags, Refined, ReleaseResult, Request, Settings, WindowResult};

/// Samples handed to the device at once.
const CHUNK: usize = 2000;
/// Values of a curve of one release.
const TRACE_VALUES: usize = 1600;

/// One release as the device saw it.
#[derive(Clone, Debug)]
pub struct Made {
    pub condition: Condition,
    pub truth: Modal,
    pub result: ReleaseResult,
    pub refined: Option<Refined>,
    pub windows: Vec<WindowResult>,
    /// What was analysed, with the response of the device's answer; none without windows.
    pub trace: Option<Trace>,
}

impl Made {
    /// Whether the device has an estimate to rely on.
    pub fn usable(&self) -> bool {
        self.answer().is_usable()
    }

    /// What the device said of it.
    pub fn answer(&self) -> Answer {
        Answer { result: self.result, refined: self.refined }
    }

    /// The flags of both.
    pub fn flags(&self) -> Flags {
        Flags(self.result.flags.0 | self.refined.map_or(0, |refined| refined.flags.0))
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
/// `seen` is called with each as soon as the device has answered.
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
    for planned in simulated::plan(&plan.rig, plan.wind_speed_m_s, 1, plan.seed)? {
        let release = release(bench, plan, &planned.condition, planned.seed)?;
        seen(&release)?;
        made.push(release);
    }
    Ok(made)
}

fn release(bench: &mut Bench, plan: &Plan, condition: &Condition, seed: u64) -> Result<Made> {
    let rig = &plan.rig;
    let announced = wire::Condition {
        rig: wire::rig_id(condition.spring.name, condition.axis.name()),
        wind: rig.wind(condition.wind_speed_m_s),
        model: rig.model,
        inertia_kg_m2: rig.inertia_kg_m2(condition.axis),
    };
    bench.client.tell(&Request::Condition(announced), "the wind speed")?;
    let mut after_samples = bench.client.status()?.samples;
    let release = rig.release(condition, &plan.start, &plan.sensor, seed)?;
    let mut samples = release.samples;
    let first_sample = after_samples;
    let (mut time_s, mut yaw_deg) = (Vec::new(), Vec::new());
    loop {
        interrupt::check()?;
        let mut chunk: Vec<u16> = Vec::with_capacity(CHUNK);
        for sample in samples.by_ref().take(CHUNK) {
            time_s.push(sample.time_s);
            yaw_deg.push(sample.yaw_deg);
            chunk.extend(sample.counts);
        }
        if chunk.is_empty() {
            break;
        }
        after_samples = after_samples.wrapping_add(chunk.len() as u32);
        bench.play(&chunk)?;
    }
    bench.client.tell(&Request::EndRelease { after_samples }, "the end of the record")?;
    wait_for(bench, after_samples)?;
    // All the device had to say went out before it said it had all samples.
    let (mut open, mut releases) = (replay::Release::default(), Vec::new());
    collect(bench, Duration::ZERO, &mut open, &mut releases, &mut |_| Ok(()))?;
    // Noise may make more than one of it.
    let main = main_release(&releases).cloned().unwrap_or_default();
    let result = main.result.ok_or_else(|| {
        Error::new(
            Exit::Timeout,
            format!("the device reported nothing about the release on {}", condition.spring.name),
        )
    })?;
    let replay::Release { windows, refined, .. } = main;
    let mut made =
        Made { condition: *condition, truth: release.truth, result, refined, windows, trace: None };
    made.trace = trace_of(&time_s, &yaw_deg, first_sample, &made);
    Ok(made)
}

/// The analysed part of a release beside the decaying sinusoid of the device's answer, amplitude, phase and
/// mid-line fitted.
fn trace_of(time_s: &[f64], yaw_deg: &[f64], first_sample: u32, made: &Made) -> Option<Trace> {
    let Made { result, windows, .. } = made;
    let at = |sample: u32| (sample.wrapping_sub(first_sample) as usize).min(time_s.len());
    let (from, to) = (at(windows.first()?.start_sample), at(windows.last()?.end_sample));
    let released_s = *time_s.get(at(result.release_sample))?;
    let (time_s, yaw_deg) = (time_s.get(from..to)?, &yaw_deg[from..to]);
    let [wn, zeta] = made.answer().estimate(By::Refined).map(|quantity| quantity.value);
    let samples = Samples::new(time_s, yaw_deg);
    let damped = wn * (1.0 - zeta * zeta).max(0.0).sqrt();
    let mode = linear_start(&samples.all(), zeta * wn, damped)?;
    let residual = DampedSinusoid { stretch: samples.all() }.residuals_deg(&mode);
    let response: Vec<f64> = yaw_deg.iter().zip(&residual).map(|(y, r)| y - r).collect();
    let from_release: Vec<f64> = time_s.iter().map(|t| t - released_s).collect();
    Some(Trace {
        said: Default::default(),
        time_s: drawn::times(&from_release, TRACE_VALUES),
        measured_deg: drawn::decimated(yaw_deg, TRACE_VALUES),
        models: vec![ModelTrace {
            name: "the device's answer".to_owned(),
            yaw_deg: drawn::decimated(&response, TRACE_VALUES),
            residual_deg: drawn::decimated(&residual, TRACE_VALUES),
        }],
        of: time_s.len(),
    })
}

/// The device's answers as derivatives, one point a spring, beside what was planted.
///
/// # Errors
/// Exit 3 where a release that is needed is missing. All releases given are [`Made::usable`].
pub fn table(plan: &Plan, made: &[Made], by: By) -> Result<Vec<(Point, Truth)>> {
    let rig = &plan.rig;
    let planned = simulated::plan(rig, plan.wind_speed_m_s, 1, plan.seed)?;
    let campaign = simulated::describe(rig, &planned);
    let answers: Vec<Answer> = made.iter().map(Made::answer).collect();
    let identified = identified(&campaign.release, &answers, by);
    let table =
        Computed::new(&campaign, &identified)?.table(Path::new("the built-in rig"), "device");
    table
        .points
        .into_iter()
        .map(|point| {
            let truth = rig.truth(&Spring::named(&point.spring)?);
            Ok((point, truth))
        })
        .collect()
}

/// Median and worst share by which estimates miss their truths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Miss {
    pub median: f64,
    pub worst: f64,
}

impl Miss {
    /// Of pairs of estimate and truth; infinite without any.
    pub fn new(pairs: impl Iterator<Item = (f64, f64)>) -> Self {
        let mut all: Vec<f64> =
            pairs.map(|(estimate, truth)| (estimate / truth - 1.0).abs()).collect();
        all.sort_by(f64::total_cmp);
        let Some(&worst) = all.last() else {
            return Self { median: f64::INFINITY, worst: f64::INFINITY };
        };
        let (low, high) = (all[(all.len() - 1) / 2], all[all.len() / 2]);
        Self { median: 0.5 * (low + high), worst }
    }

    /// Whether neither is larger than `most`'s.
    pub fn within(&self, most: &Self) -> bool {
        self.median <= most.median && self.worst <= most.worst
    }
}

/// Misses of Cn_beta and of Cn_r.
pub fn misses(points: &[(Point, Truth)]) -> [Miss; 2] {
    [
        Miss::new(points.iter().map(|(p, truth)| (p.cn_beta.value, truth.cn_beta))),
        Miss::new(points.iter().map(|(p, truth)| (p.cn_r.value, truth.cn_r))),
    ]
}
