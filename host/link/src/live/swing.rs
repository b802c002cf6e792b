//! The built-in rig before an emulated device, released over and over in step with the clock.

use crate::bench::Bench;
use std::time::Instant;
use yawrig_base::error::Result;
use yawrig_rig::{Rig, Samples, Sensor, Start};
use yawrig_shared::window::SAMPLE_RATE_HZ;
use yawrig_shared::wire::{self, Request};

/// Springs K1 to K8, wind off and on, one release after the other.
pub struct Swing {
    rig: Rig,
    speed: f64,
    release: u64,
    samples: Option<Samples>,
    begun: Instant,
    played: u64,
}

impl Swing {
    /// `speed` times as fast as life.
    pub fn new(speed: f64) -> Self {
        Self {
            rig: Rig::default(),
            speed,
            release: 0,
            samples: None,
            begun: Instant::now(),
            played: 0,
        }
    }

    /// Plays what is due by now.
    pub fn go_on(&mut self, bench: &mut Bench) -> Result<()> {
        let due = self.begun.elapsed().as_secs_f64() * self.speed * f64::from(SAMPLE_RATE_HZ);
        let count = ((due as u64).saturating_sub(self.played)).min(2000) as usize;
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
        let conditions: Vec<_> = self.rig.conditions(10.0).collect();
        let condition = conditions[self.release as usize % conditions.len()];
        let announced = wire::Condition {
            rig: wire::rig_id(condition.spring.name, &condition.axis.to_string()),
            wind: self.rig.wind(condition.wind_speed_m_s),
            model: self.rig.model,
            inertia_kg_m2: self.rig.inertia_kg_m2(condition.axis),
        };
        bench.client.tell(&Request::Condition(announced), "the wind speed")?;
        let sensor = Sensor::default();
        let release = self.rig.release(&condition, &Start::default(), &sensor, self.release)?;
        self.release += 1;
        Ok(release.samples)
    }
}
