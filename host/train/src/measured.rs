//! What measured records say windows should be drawn from: the noise, natural frequencies and damping ratios
//! that the network will see.
//!
//! Window position and phase are drawn from everything there is, and a window's duration is estimated, as
//! ever. What frequency and damping do within three cycles matters little, as the amplitude hardly changes
//! there; what they do over the whole record is in the ranges, for windows at all amplitudes count.

use super::draws::Ranges;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_base::interrupt;
use yawrig_core::identify::{identify, Method, Settings};
use yawrig_core::record::Record;

/// Share of a range it is widened by at either end: a network is at its worst at the edges.
const MARGIN: f64 = 0.15;
/// Least width of a range as a share of its middle.
const MIN_WIDTH: f64 = 0.2;
/// Shares of the windows' values left out at either end: the last windows are mostly noise.
const TAIL: f64 = 0.02;
/// Limits of what networks are trained on.
const NATURAL_FREQUENCY_RAD_S: [f64; 2] = [2.4, 60.0];
const DAMPING_RATIO: [f64; 2] = [-0.1, 0.2];
const NOISE: [f64; 2] = [1e-4, 0.2];

/// How a record is read from its file.
pub type Read<'a> = dyn Fn(&Path) -> Result<Record> + Sync + 'a;

/// Ranges from the records in `files`.
///
/// # Errors
/// Exit 3, naming the file, where one cannot be read or holds no oscillation, or where they leave nothing
/// that a network can be trained on; 130 where the user stops it.
pub fn ranges(files: &[PathBuf], read: &Read) -> Result<Ranges> {
    let settings = Settings::default();
    let found = files
        .par_iter()
        .map(|file| {
            interrupt::check()?;
            Ok(identify(&read(file)?, &[Method::LeastSquares], &settings)?)
        })
        .collect::<Result<Vec<_>>>()?;
    let windows: Vec<_> =
        found.iter().flat_map(|f| &f.estimates).flat_map(|e| &e.windows).collect();
    let values = |of: &dyn Fn(&yawrig_core::identify::WindowEstimate) -> f64| {
        let mut all: Vec<f64> = windows.iter().map(|w| of(w)).filter(|v| v.is_finite()).collect();
        all.sort_by(f64::total_cmp);
        all
    };
    let noise: Vec<[f64; 2]> = found
        .iter()
        .map(|f| [f.noise_rms_deg / f.window.from_deg, f.noise_rms_deg / f.window.to_deg])
        .collect();
    let low = noise.iter().map(|n| n[0]).fold(f64::INFINITY, f64::min);
    let high = noise.iter().map(|n| n[1]).fold(0.0, f64::max);
    let ranges = Ranges {
        natural_frequency_rad_s: range(
            &values(&|w| w.natural_frequency_rad_s),
            NATURAL_FREQUENCY_RAD_S,
        )
        .ok_or_else(|| outside("natural frequencies", "2.4 to 60 rad/s"))?,
        damping_ratio: range(&values(&|w| w.damping_ratio), DAMPING_RATIO)
            .ok_or_else(|| outside("damping ratios", "-0.1 to 0.2"))?,
        noise: [low.clamp(NOISE[0], NOISE[1]), high.clamp(NOISE[0], NOISE[1])],
    };
    Ok(ranges)
}

fn outside(what: &str, limits: &str) -> Error {
    Error::data(format!(
        "the records' {what} do not lie within {limits}, which networks are trained on"
    ))
    .help("see what `identify` finds in them, or give the ranges yourself")
}

/// Least and largest without the tails, widened, within `limits`; `None` where nothing is left.
fn range(sorted: &[f64], limits: [f64; 2]) -> Option<[f64; 2]> {
    let tail = (sorted.len() as f64 * TAIL) as usize;
    let (low, high) = (*sorted.get(tail)?, *sorted.get(sorted.len() - 1 - tail)?);
    let width = (high - low).max(MIN_WIDTH * 0.5 * (low + high).abs());
    let middle = 0.5 * (low + high);
    let half = (0.5 + MARGIN) * width;
    let widened = [(middle - half).max(limits[0]), (middle + half).min(limits[1])];
    (widened[0] < widened[1]).then_some(widened)
}

#[cfg(test)]
mod tests {
    use super::*;
    use yawrig_rig::{Condition, Rig, Sensor, Spring, Start};
    use yawrig_shared::axis::Axis;

    fn write(folder: &std::path::Path, spring: &str, noise_deg: f64) -> (PathBuf, [f64; 2]) {
        let rig = Rig::default();
        let condition = Condition {
            spring: Spring::named(spring).unwrap(),
            axis: Axis::Mid,
            wind_speed_m_s: 10.0,
        };
        let truth = rig.modal(&condition).unwrap();
        let sensor = Sensor { noise_deg, ..Sensor::default() };
        let release = rig.release(&condition, &Start::default(), &sensor, 5).unwrap();
        let file = folder.join(format!("{spring}.csv"));
        let samples = release.samples.map(|s| (s.time_s, s.yaw_deg));
        yawrig_records::write_samples(&file, samples).unwrap();
        (file, [truth.natural_frequency_rad_s, truth.damping_ratio])
    }

    #[test]
    fn ranges_hold_what_was_planted_and_little_more() {
        let folder = tempfile::tempdir().unwrap();
        let (first, slow) = write(folder.path(), "K3", 0.02);
        let (second, fast) = write(folder.path(), "K5", 0.05);
        let found = ranges(&[first, second], &yawrig_records::read).unwrap();
        let [low, high] = found.natural_frequency_rad_s;
        assert!(low < slow[0] && fast[0] < high, "{found:?}");
        assert!(high - low < 1.5 * (fast[0] - slow[0]), "{found:?}");
        let [low, high] = found.damping_ratio;
        assert!(low < slow[1].min(fast[1]) && slow[1].max(fast[1]) < high, "{found:?}");
        // 0.02 deg at 10 deg, 0.05 deg at 1 deg.
        assert!((found.noise[0] / 0.002 - 1.0).abs() < 0.1, "{found:?}");
        assert!((found.noise[1] / 0.05 - 1.0).abs() < 0.1, "{found:?}");
    }

    #[test]
    fn nothing_within_limits_is_no_range() {
        assert_eq!(range(&[70.0, 80.0], NATURAL_FREQUENCY_RAD_S), None);
        assert_eq!(range(&[], NATURAL_FREQUENCY_RAD_S), None);
        let [low, high] = range(&[7.0, 7.0], NATURAL_FREQUENCY_RAD_S).unwrap();
        assert!((low, high) < (6.9, 8.0) && high > 7.5, "{low} {high}");
    }
}
