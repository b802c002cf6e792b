//! Whether what was found is an oscillation rather than whatever fits noise best.

use super::envelope::block_of;
use super::free_motion::{FreeMotion, BEATING_CYCLES};
use super::release::FreeSpan;
use super::samples::Samples;
use super::windows::Window;
use crate::statistics::median;
use std::f64::consts::TAU;

/// Share of the motion of some cycles, white noise not counted, that one mode, or two, explain where there is
/// an oscillation.
const MIN_EXPLAINED: f64 = 0.8;
/// Largest middle deviation of the frequencies from their median, as a share of it: what wanders has no
/// frequency of its own.
const LARGEST_WANDER: f64 = 0.1;
/// Stretches of two modes whose frequencies are held against each other, at least: one agrees with itself. And
/// about how many of a long record: a median of more is no other.
const MIN_STRETCHES: usize = 3;
const MAX_STRETCHES: usize = 64;
/// Of two modes and a level: so many they explain of any values.
const NUMBERS_OF_TWO: usize = 9;

/// Whether the windows hold one and the same mode, or the span two that beat.
pub(super) fn is_one(
    windows: &[Window],
    samples: &Samples<'_>,
    span: &FreeSpan,
    white_noise_deg: f64,
) -> bool {
    let of = |w: &Window| (w.explained(white_noise_deg), w.natural_frequency_rad_s);
    let is_same = |cycles| is_same(cycles, span.frequency_rad_s);
    is_same(windows.iter().map(of).collect()) || is_same(beats(samples, span))
}

/// Of shares that are explained and frequencies. The one that was searched for is one of these: a single window
/// agrees with itself.
fn is_same(cycles: Vec<(f64, f64)>, searched: f64) -> bool {
    if cycles.is_empty() {
        return false;
    }
    let (mut explained, mut frequencies): (Vec<f64>, Vec<f64>) = cycles.into_iter().unzip();
    frequencies.push(searched);
    let middle = median(&mut frequencies);
    let mut off: Vec<f64> = frequencies.iter().map(|f| (f - middle).abs()).collect();
    median(&mut explained) >= MIN_EXPLAINED && median(&mut off) <= LARGEST_WANDER * middle
}

/// The share of the variance that two modes explain of some cycles here and there, and the larger one's frequency.
fn beats(samples: &Samples<'_>, span: &FreeSpan) -> Vec<(f64, f64)> {
    let means = span.stretch(samples).block_means(block_of(samples, span.frequency_rad_s));
    let none = vec![false; means.len()];
    let means = means.stretch(&none);
    let long_s = BEATING_CYCLES * TAU / span.frequency_rad_s;
    let count = ((span.to_s - span.from_s) / long_s) as usize;
    let of = |k: usize| {
        let from_s = span.from_s + k as f64 * long_s;
        let cycles = means.between(from_s, from_s + long_s);
        let motion = FreeMotion::two(&cycles)?;
        let n = cycles.len() as f64;
        let mean = cycles.yaw_deg.iter().sum::<f64>() / n;
        let points = || cycles.time_s.iter().zip(cycles.yaw_deg);
        let all: f64 = points().map(|(_, y)| (y - mean).powi(2)).sum();
        let left: f64 = points().map(|(t, y)| (y - motion.yaw_deg(*t)).powi(2)).sum();
        let free = cycles.len().checked_sub(NUMBERS_OF_TWO).filter(|free| *free > 0)?;
        let explained = 1.0 - left / free as f64 / (all / (n - 1.0));
        Some((explained, motion.main().natural_frequency_rad_s()))
    };
    match count >= MIN_STRETCHES {
        true => (0..count).step_by(count.div_ceil(MAX_STRETCHES)).filter_map(of).collect(),
        false => Vec::new(),
    }
}
