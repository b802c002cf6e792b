//! A model with effects, as the criticism loop has fitted it, as what training windows are drawn from.
//!
//! The motion is that of [`yawrig_core::motion::simulate`], the integrator that fitted the effects. Their
//! coefficients are the model's, but those that the network is to say, which are drawn; natural frequency,
//! damping ratio, amplitude, phase and noise are drawn, and the targets are the natural frequency and damping
//! ratio of the second-order part: what would be left if the effects were taken away.

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::path::PathBuf;
use yawrig_base::error::{Error, Result};
use yawrig_core::effects::{Effect, Terms};
use yawrig_core::motion::simulate::{Grid, Motion};
use yawrig_shared::blob::EffectIds;
use yawrig_shared::modal::Modal;
use yawrig_shared::network::NumberNames;
use yawrig_shared::units::{deg_from_rad, rad_from_deg};
use yawrig_shared::window::{CYCLES, SAMPLE_RATE_HZ};

/// Amplitudes at which a release is drawn, deg: a little beyond what is analysed (10 deg down to 1 deg), as
/// it decays before its first window and a network is at its worst at the edges.
const AMPLITUDE_DEG: [f64; 2] = [0.9, 14.0];
/// Amplitudes of the windows that are kept, deg.
pub const KEPT_DEG: [f64; 2] = [0.7, 11.0];
/// Where a release begins, deg, and the longest it is taken to last, s: how long ago it was when a window
/// begins.
const RELEASED_DEG: f64 = 15.0;
const LONGEST_S: f64 = 60.0;

/// The text of a `model.toml` to train on, so that a training can be repeated without the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Source {
    pub path: PathBuf,
    pub text: String,
}

/// A number of an effect that a network is to say, and what it is drawn from, in its own unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Asked {
    /// `effect.number`.
    pub name: String,
    pub unit: String,
    pub range: [f64; 2],
}

/// The effects of a model with their coefficients.
#[derive(Clone, Debug, PartialEq)]
pub struct Augmented {
    /// Each with its numbers as users read and write them.
    effects: Vec<(Effect, Vec<f64>)>,
    /// One of these is drawn for each release; none: off.
    wind_speeds_m_s: Vec<f64>,
    /// Numbers that are drawn, each by the places of its effect and of the number among the effect's.
    asked: Vec<([usize; 2], Asked)>,
}

/// A release as the sensor shows it, without noise.
pub struct Response {
    /// Amplitude about the mid-line at its beginning, deg.
    pub amplitude_deg: f64,
    /// At the device's sampling rate, deg.
    pub readings_deg: Vec<f64>,
}

impl Augmented {
    /// The `effects` with their numbers, in the units and order of [`Effect::parameters`], at the wind speeds
    /// that they may depend on; `None` where there is none and the response is of second order alone.
    ///
    /// # Errors
    /// Exit 2 for what a network cannot be trained on.
    pub fn new(
        effects: Vec<(Effect, Vec<f64>)>,
        wind_speeds_m_s: Vec<f64>,
    ) -> Result<Option<Self>> {
        if effects.is_empty() {
            return Ok(None);
        }
        for (effect, _) in &effects {
            if effect.is_random() {
                return Err(Error::usage(format!(
                    "no network can be trained on {effect}, which takes another course every time"
                ))
                .help("train without it: the device's mean over its windows averages it"));
            }
        }
        let augmented = Self { effects, wind_speeds_m_s, asked: Vec::new() };
        augmented.ids().ok_or_else(|| {
            Error::usage("the identifiers of its effects do not fit a network's file")
                .help("give your own effects shorter ids: all together 96 characters at most")
        })?;
        Ok(Some(augmented))
    }

    /// The same with numbers of its effects drawn, which a network is to say.
    ///
    /// # Errors
    /// Exit 2 for a number that is none of its effects', and for names that do not fit a network's file.
    pub fn asking(self, asked: &[Asked]) -> Result<Self> {
        let place = |asked: &Asked| {
            let mut all = self.effects.iter().enumerate().flat_map(|(effect, (of, _))| {
                let numbers = of.parameters().iter().enumerate();
                numbers.map(move |(number, p)| ([effect, number], format!("{of}.{}", p.name)))
            });
            let found = all.find(|(_, name)| *name == asked.name);
            found.map(|(place, _)| (place, asked.clone())).ok_or_else(|| {
                Error::usage(format!("{} is no number of the model's effects", asked.name))
                    .help("see what numbers its effects have in the model's file")
            })
        };
        let asked = asked.iter().map(place).collect::<Result<_>>()?;
        let augmented = Self { asked, ..self };
        augmented.number_names().ok_or_else(|| {
            Error::usage("the names and units of the numbers do not fit a network's file")
                .help("ask for one of them alone, or give your own effects' numbers shorter names")
        })?;
        Ok(augmented)
    }

    /// The numbers that are drawn.
    pub fn asked(&self) -> impl Iterator<Item = &Asked> {
        self.asked.iter().map(|(_, asked)| asked)
    }

    /// Their names as a network's file has them; `None` where they are too long.
    pub fn number_names(&self) -> Option<NumberNames> {
        let line = |([effect, number], asked): &([usize; 2], Asked)| {
            let name = &self.effects[*effect].0.parameters()[*number].name;
            format!("{effect}.{name} {}", asked.unit)
        };
        let lines: Vec<String> = self.asked.iter().map(line).collect();
        NumberNames::try_from(lines.join("\n").as_str()).ok()
    }

    /// The effects' identifiers as a network's file has them; `None` where they are too long.
    pub fn ids(&self) -> Option<EffectIds> {
        let ids: Vec<&str> = self.effects.iter().map(|(effect, _)| effect.id()).collect();
        EffectIds::try_from(ids.join(" ").as_str()).ok()
    }

    /// What a fit varies of each effect, with these values of the numbers that are drawn.
    fn varied(&self, numbers: &[f64]) -> Vec<(&Effect, Vec<f64>)> {
        let mut effects: Vec<(&Effect, Vec<f64>)> =
            self.effects.iter().map(|(effect, users)| (effect, users.clone())).collect();
        for (([effect, number], _), value) in self.asked.iter().zip(numbers) {
            effects[*effect].1[*number] = *value;
        }
        effects.into_iter().map(|(effect, users)| (effect, effect.varied(&users))).collect()
    }

    /// Draws a free decay of this natural frequency and damping ratio and these numbers; `None` where the
    /// effects leave none.
    pub fn swing(
        &self,
        modal: &Modal,
        numbers: &[f64],
        random: &mut ChaCha8Rng,
    ) -> Option<Response> {
        let Modal { natural_frequency_rad_s: wn, damping_ratio } = *modal;
        let effects = self.varied(numbers);
        if effects.iter().any(|(effect, varied)| effect.resonates(varied, wn)) {
            return None;
        }
        let wind_speed_m_s = match &self.wind_speeds_m_s[..] {
            [] => 0.0,
            [only] => *only,
            all => all[random.random_range(0..all.len())],
        };
        let [low, high] = AMPLITUDE_DEG.map(f64::ln);
        let amplitude_deg = (low + (high - low) * random.random::<f64>()).exp();
        let mut phase = || TAU * random.random::<f64>();
        let (sin, cos) = phase().sin_cos();
        let mut terms = Terms::in_wind(wind_speed_m_s);
        // A release comes upon a periodic moment and rings a second mode at any phase.
        let lines = Effect::ALL.into_iter().filter(Effect::is_line);
        let turns: Vec<(Effect, f64)> = lines.map(|line| (line, phase())).collect();
        for (effect, varied) in &effects {
            let turn = turns.iter().find(|(line, _)| line == *effect).map_or(0.0, |t| t.1);
            effect.write(&effect.turned(varied, turn, 1.0), &mut terms);
        }
        let decay_per_s = (damping_ratio * wn).max(f64::MIN_POSITIVE);
        let since_s = ((RELEASED_DEG / amplitude_deg).ln() / decay_per_s).clamp(0.0, LONGEST_S);
        let amplitude_rad = rad_from_deg(amplitude_deg);
        let motion = Motion {
            natural_frequency_rad_s: wn,
            damping_ratio,
            yaw_rad: terms.constant_moment_rad_s2 / (wn * wn) + amplitude_rad * cos,
            rate_rad_s: -amplitude_rad * wn * sin,
            terms,
        };
        let step_s = 1.0 / f64::from(SAMPLE_RATE_HZ);
        let grid = Grid {
            start_s: since_s,
            step_s,
            // Friction makes no cycle longer; play and softening may.
            count: ((CYCLES as f64 + 4.0) * TAU / wn / step_s) as usize,
            mean_width_s: 0.0,
        };
        let readings_deg: Vec<f64> = motion.readings(&grid).into_iter().map(deg_from_rad).collect();
        readings_deg
            .iter()
            .all(|reading| reading.is_finite())
            .then_some(Response { amplitude_deg, readings_deg })
    }
}
