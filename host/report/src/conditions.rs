//! The releases of a campaign at a glance: a small picture of each condition, its repeats drawn over each
//! other.

use super::escape::escaped;
use super::ReleaseReport;
use crate::drawn::{decimated, times};
use std::fmt::Write as _;

/// Values of a release in its picture, and of all of them together, at most.
const VALUES: usize = 400;
const ALL_VALUES: usize = 40_000;
/// Of a picture, in its own units.
const WIDTH: f64 = 220.0;
const HEIGHT: f64 = 80.0;

/// Nothing where the report knows no conditions.
pub(super) fn pictures(releases: &[ReleaseReport]) -> String {
    let mut conditions: Vec<(&str, Vec<&ReleaseReport>)> = Vec::new();
    for release in releases.iter().filter(|release| release.trace.is_some()) {
        let Some(condition) = release.condition.as_deref() else { continue };
        match conditions.iter_mut().find(|(known, _)| *known == condition) {
            Some((_, its)) => its.push(release),
            None => conditions.push((condition, vec![release])),
        }
    }
    if conditions.is_empty() {
        return String::new();
    }
    let most = VALUES.min(ALL_VALUES / releases.len().max(1)).max(60);
    let pictures = conditions.iter().map(|(name, its)| picture(name, its, most));
    format!(
        "<p class=\"note\">Measured yaw from the release on, the repeats of a condition over each other.</p>\n\
         <div class=\"small\">\n{}</div>\n",
        pictures.collect::<String>()
    )
}

fn picture(name: &str, releases: &[&ReleaseReport], most: usize) -> String {
    let traces = || releases.iter().filter_map(|release| release.trace.as_ref());
    let last_s = traces().filter_map(|t| t.time_s.last()).fold(0.0, |a: f64, b| a.max(*b));
    let values = traces().flat_map(|t| &t.measured_deg).filter(|y| y.is_finite());
    let largest_deg = values.fold(0.0, |a: f64, b| a.max(b.abs()));
    let [x, y] = [WIDTH / last_s.max(f64::MIN_POSITIVE), 0.5 * HEIGHT / largest_deg.max(1e-300)];
    let mut lines = String::new();
    for (k, trace) in traces().enumerate() {
        let points =
            times(&trace.time_s, most).into_iter().zip(decimated(&trace.measured_deg, most));
        let shown = points.filter(|(_, yaw)| yaw.is_finite());
        let points = shown.map(|(t, yaw)| format!("{:.1},{:.1}", t * x, 0.5 * HEIGHT - yaw * y));
        let _ = write!(
            lines,
            "<polyline points=\"{}\" stroke=\"var(--curve-{})\"/>",
            points.collect::<Vec<_>>().join(" "),
            k % 7 + 1
        );
    }
    let repeats = match releases.len() {
        1 => String::new(),
        n => format!(", {n} releases"),
    };
    let left = releases.iter().filter_map(|r| r.residual_over_noise.last()).copied();
    let worst = left.fold(f64::NAN, f64::max);
    let worst = match worst.is_finite() {
        true => format!("; residual {worst:.2} of the noise"),
        false => String::new(),
    };
    format!(
        "<figure><svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{name}\">\
         <path d=\"M0 {0}H{WIDTH}\"/>{lines}</svg>\
         <figcaption><b>{name}</b>{repeats}: {1} deg, {2} s{worst}</figcaption></figure>\n",
        0.5 * HEIGHT,
        digits(largest_deg),
        digits(last_s),
        name = escaped(name),
    )
}

/// Three of them.
fn digits(x: f64) -> String {
    let decimals = (2.0 - x.abs().max(1e-9).log10().floor()).clamp(0.0, 9.0);
    format!("{x:.0$}", decimals as usize)
}
