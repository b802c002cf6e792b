//! `yawrig monitor`: follow a device's results as they come.

use super::common::{print_json_line, print_line, within, DeviceArg};
use crate::amplitude_trend::{trends, Trend};
use crate::error::{Error, Exit, Result};
use crate::follow::{event_json, event_text};
use crate::interrupt;
use crate::link::bench::{Bench, Target};
use crate::rig::{Rig, Sensor, Start};
use clap::Args;
use std::time::{Duration, Instant};
use yawrig_shared::window::SAMPLE_RATE_HZ;
use yawrig_shared::wire::{self, Event, Request, Settings, WindowResult};

#[derive(Args, Debug)]
pub struct Monitor {
    #[command(flatten)]
    device: DeviceArg,
    /// Print a JSON object a line
    #[arg(long)]
    jsonl: bool,
    /// End after so many releases
    #[arg(long, value_name = "N")]
    releases: Option<u32>,
    /// End after so many seconds; exit code 7 if --releases were not reached by then
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// How many times faster than life the built-in rig swings (emulated devices only)
    #[arg(long, value_name = "X", default_value_t = 1.0, allow_negative_numbers = true)]
    speed: f64,
    /// Angle between the ends of the potentiometer's track; devices on a port only, which else take it for 328
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    travel_deg: Option<f64>,
}

pub fn run(arguments: &Monitor) -> Result<()> {
    within("--speed", arguments.speed, 1e-3, 1e6)?;
    if let Some(seconds) = arguments.seconds {
        within("--seconds", seconds, 0.0, 1e9)?;
    }
    let on_a_port = matches!(arguments.device.device, Target::Port(_));
    if let Some(travel_deg) = arguments.travel_deg {
        within("--travel-deg", travel_deg, 1.0, 36_000.0)?;
        if !on_a_port {
            return Err(Error::usage(
                "--travel-deg is for a device on a port: the built-in rig has its own sensor",
            )
            .help("leave it out, or name the port with --device"));
        }
    }
    let mut bench = arguments.device.open()?;
    if let Some(travel_deg) = arguments.travel_deg {
        let degrees_per_count = (travel_deg / 65_536.0) as f32;
        let settings = Settings { degrees_per_count, ..Settings::default() };
        bench.client.tell(&Request::Configure(settings), "the settings")?;
    }
    let mut swing = match arguments.device.device {
        Target::Port(_) => None,
        _ => {
            crate::say!(
                "the built-in rig swings: springs K1 to K8, wind off and on; Ctrl-C ends it"
            );
            Some(Swing::new(arguments.speed))
        }
    };
    let mut follow =
        Follow { seen: 0, refined: false, missed: 0, resets: 0, windows: Vec::new(), arguments };
    let deadline = arguments.seconds.map(|s| Instant::now() + Duration::from_secs_f64(s));
    loop {
        if let Some(swing) = &mut swing {
            swing.go_on(&mut bench)?;
        }
        follow.take(&mut bench)?;
        // The last release's refined estimate is still to come.
        if arguments.releases.is_some_and(|wanted| follow.seen >= wanted)
            && (follow.refined || !bench.client.status()?.refining)
        {
            // What it had to say went out before it said so.
            return follow.take(&mut bench);
        }
        if deadline.is_some_and(|deadline| Instant::now() >= deadline) {
            return match arguments.releases {
                None => Ok(()),
                Some(wanted) => Err(Error::new(
                    Exit::Timeout,
                    format!("{} releases of {wanted} came in the given time", follow.seen),
                )
                .help("give it more --seconds, or see that the model is released")),
            };
        }
        interrupt::check()?;
    }
}

struct Follow<'a> {
    seen: u32,
    /// The refined estimate of the last of them has come.
    refined: bool,
    missed: u64,
    resets: u64,
    /// Of the release that is going on.
    windows: Vec<WindowResult>,
    arguments: &'a Monitor,
}

impl Follow<'_> {
    /// Prints what has come, waiting a moment for it.
    fn take(&mut self, bench: &mut Bench) -> Result<()> {
        let mut patience = Duration::from_millis(20);
        loop {
            let next = bench.client.next_event(patience);
            let next = next.map_err(|e| bench.client.explain(e, "its events"))?;
            if bench.client.missed_events() > self.missed {
                let lost = bench.client.missed_events() - self.missed;
                self.missed = bench.client.missed_events();
                crate::say!("{lost} results were lost on the line");
            }
            if bench.client.resets() > self.resets {
                self.resets = bench.client.resets();
                self.windows.clear();
                crate::say!("the device has begun anew, after a reset or a power cut; what it sent before stands");
            }
            let Some(numbered) = next else { return Ok(()) };
            patience = Duration::ZERO;
            let mut found = Vec::new();
            match numbered.event {
                Event::Window(window) => self.windows.push(window),
                Event::Release(_) => {
                    self.seen += 1;
                    self.refined = false;
                    found = trends(&std::mem::take(&mut self.windows));
                }
                Event::Refined(_) => self.refined = true,
                Event::Phase { .. } => {}
            }
            match event_text(&numbered.event, "FILE") {
                _ if self.arguments.jsonl => {
                    let mut object = event_json(&numbered.event);
                    if matches!(numbered.event, Event::Release(_)) {
                        object["trends"] = found.iter().map(Trend::to_json).collect();
                    }
                    print_json_line(&object)?;
                }
                Some(text) => print_line(&text)?,
                None => {}
            }
            if !found.is_empty() && !self.arguments.jsonl {
                let effects = bench.client.status()?.network.effects;
                found.iter().try_for_each(|trend| print_line(&trend.text(&effects)))?;
            }
            if self.refined && self.arguments.releases.is_some_and(|wanted| self.seen >= wanted) {
                return Ok(());
            }
        }
    }
}

/// The built-in rig, released over and over in step with the clock.
struct Swing {
    rig: Rig,
    speed: f64,
    release: u64,
    samples: Option<crate::rig::Samples>,
    begun: Instant,
    played: u64,
}

impl Swing {
    fn new(speed: f64) -> Self {
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
    fn go_on(&mut self, bench: &mut Bench) -> Result<()> {
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

    fn begin(&mut self, bench: &mut Bench) -> Result<crate::rig::Samples> {
        let conditions: Vec<_> = self.rig.conditions(10.0).collect();
        let condition = conditions[self.release as usize % conditions.len()];
        let announced = wire::Condition {
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
