//! The built-in rig before an emulated device, in step with the clock.

use crate::bench::Bench;
use std::time::Instant;
use yawrig_base::error::Result;
use yawrig_rig::{Condition, End, Rig, Samples, Sensor, Spring, Start, SPRINGS};
use yawrig_shared::axis::Axis;
use yawrig_shared::window::SAMPLE_RATE_HZ;
use yawrig_shared::wire::{self, Request};

/// Longest rest between two releases, s: for ever.
const FOR_EVER_S: f64 = 1e9;

/// What is released next.
#[derive(Clone, Copy, Debug)]
enum Order {
    /// Springs K1 to K8, wind off and on, one release after the other; the device is told each condition.
    Tour,
    /// This one; the device knows.
    Release(Condition),
    /// Nothing until it is said.
    Wait,
}

/// The built-in rig with its model, released over and over or as it is told.
pub struct BuiltInRig {
    rig: Rig,
    speed: f64,
    release: u64,
    order: Order,
    samples: Option<Samples>,
    /// The samples are those of a model at rest.
    rests: bool,
    begun: Instant,
    played: u64,
    /// Number of the first sample of the release that was ordered last; none: it is still to begin.
    ordered_from: Option<u64>,
}

impl BuiltInRig {
    /// `speed` times as fast as a real rig; springs K1 to K8, wind off and on, until it is told what to
    /// release.
    pub fn new(speed: f64) -> Self {
        Self {
            rig: Rig::default(),
            speed,
            release: 0,
            order: Order::Tour,
            samples: None,
            rests: false,
            begun: Instant::now(),
            played: 0,
            ordered_from: None,
        }
    }

    /// From now on nothing is released but what [`Self::release`] says.
    pub fn wait(&mut self) {
        self.order = Order::Wait;
    }

    /// The model is released once under this condition, as soon as it has come to rest.
    ///
    /// # Errors
    /// Exit 2 for a spring it does not have, or where the model would diverge in that wind.
    pub fn release(&mut self, spring: &str, axis: Axis, wind_speed_m_s: f64) -> Result<()> {
        let condition = Condition { spring: Spring::named(spring)?, axis, wind_speed_m_s };
        self.rig.modal(&condition)?;
        self.order = Order::Release(condition);
        self.ordered_from = None;
        if self.rests {
            self.samples = None;
        }
        Ok(())
    }

    /// The release that was ordered last is let go no sooner than with this sample, the first one played
    /// being 0.
    pub fn ordered_from(&self) -> u64 {
        self.ordered_from.unwrap_or(self.played)
    }

    /// Plays what is due by now.
    pub fn go_on(&mut self, bench: &mut Bench) -> Result<()> {
        let due = self.begun.elapsed().as_secs_f64() * self.speed * f64::from(SAMPLE_RATE_HZ);
        let count = ((due as u64).saturating_sub(self.played)).min(2000) as usize;
        self.play(bench, count)
    }

    /// Plays at most so many samples, whatever the clock says.
    pub fn play(&mut self, bench: &mut Bench, count: usize) -> Result<()> {
        let samples = match &mut self.samples {
            Some(samples) => samples,
            None => {
                let samples = self.begin(bench)?;
                self.samples.insert(samples)
            }
        };
        let chunk: Vec<u16> = samples.by_ref().filter_map(|s| s.counts).take(count).collect();
        if chunk.len() < count {
            self.samples = None;
        }
        self.played += chunk.len() as u64;
        if chunk.is_empty() {
            return Ok(());
        }
        bench.play(&chunk)
    }

    fn begin(&mut self, bench: &mut Bench) -> Result<Samples> {
        let mut start = Start::default();
        self.rests = false;
        let condition = match self.order {
            Order::Release(condition) => {
                self.order = Order::Wait;
                self.ordered_from = Some(self.played);
                condition
            }
            Order::Tour => {
                let conditions: Vec<_> = self.rig.conditions(10.0).collect();
                let condition = conditions[self.release as usize % conditions.len()];
                let announced = wire::Condition {
                    rig: wire::rig_id(condition.spring.name, condition.axis.name()),
                    wind: self.rig.wind(condition.wind_speed_m_s),
                    model: self.rig.model,
                    inertia_kg_m2: self.rig.inertia_kg_m2(condition.axis),
                };
                bench.client.tell(&Request::Condition(announced), "the wind speed")?;
                condition
            }
            Order::Wait => {
                self.rests = true;
                start =
                    Start { amplitude_deg: 0.0, hold_s: FOR_EVER_S, end: End::After(FOR_EVER_S) };
                Condition { spring: SPRINGS[0], axis: Axis::Mid, wind_speed_m_s: 0.0 }
            }
        };
        let release = self.rig.release(&condition, &start, &Sensor::default(), self.release)?;
        self.release += 1;
        Ok(release.samples)
    }
}
