//! What another place on the track, another sensor or another converter would buy in damping ratios.

use yawrig_shared::wire::{SensorKind, Status};

/// How an angle is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// A potentiometer of 340 deg at a Pico's converter, resting in the middle of its track.
    Centred,
    /// The same, 200 codes (17 deg) beside the middle.
    Beside,
    /// The same, where the converter stands still over several codes.
    OnAStep,
    /// The same in the middle, four times as many codes a degree: by a gear, or a track of 85 deg.
    FourTimesTheTravel,
    Mcp3208,
    Ads1115,
    As5600,
}

/// All of them, as they are told.
pub const CHOICES: [Choice; 7] = [
    Choice::OnAStep,
    Choice::Centred,
    Choice::Beside,
    Choice::FourTimesTheTravel,
    Choice::Mcp3208,
    Choice::Ads1115,
    Choice::As5600,
];

impl Choice {
    pub fn name(self) -> &'static str {
        match self {
            Self::OnAStep => "at rest on a wide code",
            Self::Centred => "at rest in the middle",
            Self::Beside => "200 codes beside the middle",
            Self::FourTimesTheTravel => "four times the travel",
            Self::Mcp3208 => "an MCP3208 instead",
            Self::Ads1115 => {
                "an ADS1115 instead (it gives 860 samples a second at most, the device takes 1000)"
            }
            Self::As5600 => "an AS5600 instead",
        }
    }

    /// Refined damping ratios of half of all releases are off by more than so much, in percent of their
    /// value, without a table. A Pico's through what four chips were measured to read, the others' through
    /// what their data sheets allow (the test `advice`).
    pub fn damping_error_percent(self) -> f64 {
        match self {
            Self::OnAStep => 12.0,
            Self::Centred => 1.4,
            Self::Beside => 0.16,
            Self::FourTimesTheTravel => 0.35,
            Self::Mcp3208 => 0.06,
            Self::Ads1115 => 0.005,
            Self::As5600 => 0.016,
        }
    }
}

/// Boards whose converter has the wide codes that these figures are of.
const BOARDS: [&str; 2] = ["pico", "pico2"];

/// What a device should be told to correct, or what should be changed of it; none where nothing is known to
/// be wrong.
pub fn of(board: &str, status: &Status) -> Option<String> {
    let bare = status.sensor.kind == SensorKind::Potentiometer && status.linearity.knots == 0;
    if !bare || !BOARDS.contains(&board) {
        return None;
    }
    let choices: Vec<String> = CHOICES
        .iter()
        .map(|choice| format!("{} {} %", choice.name(), choice.damping_error_percent()))
        .collect();
    Some(format!(
        "its converter's codes are of unlike widths, and it has no table of them: half of all damping ratios are off by more \
         than this ({}); with a table by less than 0.03 %, but for a rest on a wide code",
        choices.join(", ")
    ))
}
