//! What lies between two times that somebody chose.

use super::place::Times;
use super::table::MIN_SAMPLES;
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_core::record::Record;

/// `record` between these times of its own clock, which somebody typed or are `kept` for its folder.
///
/// # Errors
/// Exit 3, with the times of the record, where they are not in it, or hold too little of it.
pub(super) fn between(record: Record, times: Times, kept: bool) -> Result<Record> {
    let Times { from_s, to_s } = times;
    if times == Times::default() {
        return Ok(record);
    }
    let [from, to] = match kept {
        true => ["from_s", "to_s"].map(|name| format!("{name} in records.toml")),
        false => ["from_s", "to_s"].map(settings::name),
    };
    let (first, last) = (record.time_s[0], record.time_s[record.len() - 1]);
    let refuse = |what: String| {
        Err(Error::data(format!("{}: {what}", record.file.display()))
            .help(format!("choose {from} and {to} between {first:.3} and {last:.3}")))
    };
    if let Some(from_s) = from_s.filter(|s| !(first..last).contains(s)) {
        return refuse(format!(
            "{from} {from_s} is not in the record, which goes from {first:.3} to {last:.3} s"
        ));
    }
    if let Some(to_s) = to_s.filter(|s| !(*s > first && *s <= last)) {
        return refuse(format!(
            "{to} {to_s} is not in the record, which goes from {first:.3} to {last:.3} s"
        ));
    }
    let begin = record.time_s.partition_point(|t| *t < from_s.unwrap_or(first));
    let end = record.time_s.partition_point(|t| *t <= to_s.unwrap_or(last));
    if end < begin + MIN_SAMPLES {
        let from_s = from_s.unwrap_or(first);
        let to_s = to_s.unwrap_or(last);
        let samples = end.saturating_sub(begin);
        return refuse(format!(
            "from {from_s} to {to_s} s there are {samples} samples, too few for three cycles"
        ));
    }
    let part = |values: &[f64]| values[begin..end].to_vec();
    let (time_s, yaw_deg) = (part(&record.time_s), part(&record.yaw_deg));
    Ok(Record { time_s, yaw_deg, ..record })
}
