//! Model, measurement and residual, sample by sample.

use super::release::Release;
use std::fmt::Write as _;
use yawrig_base::error::Result;
use yawrig_core::motion::readings_at;

/// CSV: a row for each sample of each record, from the first instant of its fit to the last.
///
/// # Errors
/// Exit 3 where a record cannot be read any more.
pub fn written(releases: &[Release]) -> Result<String> {
    let mut out = "time_s,yaw_deg,model_yaw_deg,residual_deg,file\n".to_owned();
    for Release { recorded, fit, .. } in releases {
        let (decay, file) = (&recorded.decay, recorded.path.display().to_string());
        let record = yawrig_records::read_selected(&recorded.path, &recorded.entry.reading)?;
        let grid = &decay.grid;
        let end_s = grid.time_s(grid.count);
        let kept: Vec<(f64, f64)> = record
            .time_s
            .iter()
            .zip(&record.yaw_deg)
            .map(|(t, yaw)| (t - decay.release_time_s, *yaw))
            .filter(|(t, _)| (grid.start_s..end_s).contains(t))
            .collect();
        let times: Vec<f64> = kept.iter().map(|k| k.0).collect();
        let zero = fit.sensor_zero_rad().map_or(0.0, |q| q.value);
        let model = readings_at(&fit.motion(), grid.start_s, &times);
        // A path with a comma or a quotation mark in it stays one field.
        let file = match file.contains([',', '"']) {
            true => format!("\"{}\"", file.replace('"', "\"\"")),
            false => file,
        };
        for ((t, yaw_deg), reading) in kept.iter().zip(model) {
            let model_deg = decay.measurand.shown(reading + zero);
            let time_s = t + decay.release_time_s;
            let residual_deg = model_deg - yaw_deg;
            let _ = writeln!(out, "{time_s},{yaw_deg},{model_deg:.9},{residual_deg:.9},{file}");
        }
    }
    Ok(out)
}
