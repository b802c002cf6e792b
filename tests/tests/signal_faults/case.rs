//! A fault: what is done to the signal and what the device must say.

use crate::faults::Given;
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{Flags, Settings};

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Must {
    /// Every answer is right, or has the flag.
    Either,
    /// The flag.
    Flag,
    /// One answer is right, and no flag at all.
    BeRightAndClean,
    /// One answer is right, and the flag.
    BeRightAndFlag,
}

type Make = Box<dyn Fn(Modal, u64, f64) -> Vec<Given> + Sync>;

pub struct Case {
    pub name: &'static str,
    pub must: Must,
    /// Flags by which an answer may be wrong.
    pub excuses: Flags,
    pub settings: Settings,
    /// White noise of a sample at this severity as the Cramer-Rao bound takes it; none: 0.05 deg.
    pub noise: Option<fn(f64) -> f64>,
    /// Chance itself moves the model: an answer is right within four of its own standard uncertainties.
    pub within_its_own_u: bool,
    pub least_releases: usize,
    /// What is done, and how much of it.
    pub severities: Vec<(&'static str, f64)>,
    pub make: Make,
}

impl Case {
    pub fn noise_deg(&self, size: f64) -> f64 {
        self.noise.map_or(0.05, |noise| noise(size))
    }

    /// The same potentiometer on a converter with other counts.
    pub fn settings_at(&self, degrees_per_count: f64) -> Settings {
        let usual = Settings::default();
        let full = self.settings.full_scale_counts;
        let full_scale_counts = if full == usual.full_scale_counts {
            full
        } else {
            let ends_deg = f64::from(full - usual.zero_counts) * 0.005;
            usual.zero_counts + (ends_deg / degrees_per_count) as u16
        };
        let degrees_per_count = degrees_per_count as f32;
        Settings { degrees_per_count, full_scale_counts, ..self.settings }
    }

    pub fn must_text(&self) -> String {
        let names = yawrig_link::follow::flag_names(self.excuses).join("|");
        match self.must {
            Must::Either => format!("right or {names}"),
            Must::Flag => names,
            Must::BeRightAndClean => "right, no flag".into(),
            Must::BeRightAndFlag => format!("right and {names}"),
        }
    }
}

pub fn case(
    name: &'static str,
    must: Must,
    excuses: &[Flags],
    severities: &[(&'static str, f64)],
    make: impl Fn(Modal, u64, f64) -> Vec<Given> + Sync + 'static,
) -> Case {
    let excuses = excuses.iter().fold(Flags::default(), |mut all, flag| {
        all.set(*flag);
        all
    });
    let severities = severities.to_vec();
    Case {
        name,
        must,
        excuses,
        settings: Settings::default(),
        noise: None,
        within_its_own_u: false,
        least_releases: 1,
        severities,
        make: Box::new(make),
    }
}
