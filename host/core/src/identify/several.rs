//! Where a record holds several releases: one free decay after the other, the model caught and let go again.

use super::answer::{Span, MIN_CYCLES};
use super::prepared::{prepare, Prepared};
use super::settings::Settings;
use crate::record::Record;
use std::f64::consts::TAU;
use std::ops::Range;

/// A release is at least this share of the largest one.
const MIN_OF_LARGEST: f64 = 0.1;
/// Where the free decay goes on, its amplitude is what it was; where it was released anew it is larger by
/// more than this.
const MIN_JUMP: f64 = 1.5;
/// Share of its amplitude down to which a release is seen to fall.
const DECAYS_TO: f64 = 0.9;
/// Natural frequencies of releases of one model differ less, relative.
const SAME_MODEL: f64 = 0.3;
/// What stands outside one release and moves less than this share of it, rms, holds no other.
const AT_REST: f64 = 0.03;

/// One free decay.
#[derive(Clone, Copy, Debug)]
struct Decay {
    from_s: f64,
    to_s: f64,
    frequency_rad_s: f64,
    first_deg: f64,
    last_deg: f64,
}

impl Decay {
    fn new(prepared: &Prepared) -> Option<Self> {
        let (first, last) = (prepared.windows.first()?, prepared.windows.last()?);
        let most = prepared.windows.iter().map(|w| w.amplitude_deg).fold(0.0, f64::max);
        // What grows by itself was not released, what is kept up is not left to itself.
        let ends = prepared.window();
        let decays = ends.to_deg < DECAYS_TO * ends.from_deg;
        (first.amplitude_deg > 0.8 * most && decays).then_some(Self {
            from_s: prepared.span.release_time_s,
            to_s: prepared.span.to_s,
            frequency_rad_s: prepared.span.frequency_rad_s,
            first_deg: first.amplitude_deg,
            last_deg: last.amplitude_deg,
        })
    }
}

/// The parts of `record` that hold one release each, by samples, in order of time: all of it where there is
/// one, or none.
pub fn releases(record: &Record) -> Vec<Range<usize>> {
    let decays = decays(record);
    let ends = decays.iter().map(|d| record.time_s.partition_point(|t| *t < d.to_s));
    let mut parts = Vec::new();
    let mut begin = 0;
    for end in ends {
        parts.push(begin..end);
        begin = end;
    }
    match parts.last_mut() {
        Some(last) => last.end = record.len(),
        None => parts.push(0..record.len()),
    }
    parts
}

fn decays(record: &Record) -> Vec<Decay> {
    let mut decays: Vec<Decay> = Vec::new();
    search(record, 0..record.len(), &mut decays);
    decays.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
    let largest = decays.iter().map(|d| d.first_deg).fold(0.0, f64::max);
    decays.retain(|d| d.first_deg >= MIN_OF_LARGEST * largest);
    decays.dedup_by(|next, before| next.first_deg < MIN_JUMP * before.last_deg);
    decays
}

/// The releases in the record of `prepared` besides the one that is analysed.
pub(super) fn beside(prepared: &Prepared) -> Vec<Span> {
    let record = prepared.record;
    let (Some(first), Some(last)) = (prepared.windows.first(), prepared.windows.last()) else {
        return Vec::new();
    };
    let at = |time_s: f64| record.time_s.partition_point(|t| *t < time_s);
    let span = &prepared.span;
    let before = rms(&record.yaw_deg[..at(span.release_time_s)]);
    // After it the oscillation goes on at the last amplitude and less.
    let after = record.yaw_deg[at(span.to_s)..].iter();
    let after = after.map(|yaw| (yaw - last.midline_deg).abs()).fold(0.0, f64::max);
    let moves = before > AT_REST * first.amplitude_deg || after > MIN_JUMP * last.amplitude_deg;
    if !moves {
        return Vec::new();
    }
    let decays = decays(record).into_iter();
    let others = decays.filter(|d| d.from_s >= span.to_s || d.to_s <= span.from_s);
    others.map(|d| Span { from_s: d.from_s, to_s: d.to_s }).collect()
}

/// Finds the free decay in a part of the record, and those before and after it.
fn search(record: &Record, part: Range<usize>, found: &mut Vec<Decay>) {
    let piece = sliced(record, &part);
    let settings = Settings { from_deg: f64::INFINITY, to_deg: 1e-3, ..Settings::default() };
    let Ok(prepared) = prepare(&piece, &settings) else { return };
    let Some(decay) = Decay::new(&prepared) else { return };
    let like =
        |other: &Decay| (other.frequency_rad_s / decay.frequency_rad_s - 1.0).abs() < SAME_MODEL;
    if !found.first().is_none_or(like) {
        return;
    }
    found.push(decay);
    let at = |time_s: f64| record.time_s.partition_point(|t| *t < time_s);
    let shortest = MIN_CYCLES * TAU / decay.frequency_rad_s;
    for rest in [part.start..at(decay.from_s), at(decay.to_s)..part.end] {
        let long =
            rest.len() > 1 && record.time_s[rest.end - 1] - record.time_s[rest.start] > shortest;
        if long
            && rest.len() < part.len()
            && rms(&record.yaw_deg[rest.clone()]) > AT_REST * decay.first_deg
        {
            search(record, rest, found);
        }
    }
}

fn rms(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
}

/// The samples of `part`.
pub fn sliced(record: &Record, part: &Range<usize>) -> Record {
    record.with(record.time_s[part.clone()].to_vec(), record.yaw_deg[part.clone()].to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Held for two seconds, let go at 12 deg, caught after `swings_s`, as often as `times`.
    fn released(times: usize, swings_s: f64) -> Record {
        let (mut time_s, mut yaw_deg) = (Vec::new(), Vec::new());
        let each = 2.0 + swings_s;
        for k in 0..(times as f64 * each * 200.0) as usize {
            let t = k as f64 / 200.0;
            let since = t % each - 2.0;
            let noise = 0.02 * ((k * 7919 % 1000) as f64 / 500.0 - 1.0);
            let yaw = match since < 0.0 {
                true => 12.0,
                false => 12.0 * (-0.25 * since).exp() * (9.0 * since).cos(),
            };
            time_s.push(t);
            yaw_deg.push(yaw + noise);
        }
        Record::new("r", time_s, yaw_deg)
    }

    #[test]
    fn each_release_has_its_own_part() {
        for (times, swings_s) in [(1, 20.0), (2, 20.0), (3, 6.0), (2, 40.0)] {
            let record = released(times, swings_s);
            let parts = releases(&record);
            assert_eq!(parts.len(), times, "{times} of {swings_s} s: {parts:?}");
            for (k, part) in parts.iter().enumerate() {
                let let_go = 2.0 + k as f64 * (2.0 + swings_s);
                let from = record.time_s[part.start];
                let to = record.time_s[part.end - 1];
                assert!(from < let_go && to > let_go + 0.8 * swings_s.min(16.0), "{from} {to}");
            }
        }
    }

    #[test]
    fn a_beat_and_a_growing_oscillation_are_one() {
        let time_s: Vec<f64> = (0..8000).map(|k| f64::from(k) / 200.0).collect();
        let of = |yaw: fn(f64) -> f64| {
            Record::new("r", time_s.clone(), time_s.iter().map(|t| yaw(*t)).collect())
        };
        let beat =
            of(|t| 8.0 * (-0.02 * t).exp() * (9.0 * t).cos() * (0.55 + 0.45 * (0.7 * t).cos()));
        assert_eq!(releases(&beat).len(), 1);
        let grows = of(|t| 0.3 * (0.08 * t).exp() * (9.0 * t).sin());
        assert_eq!(releases(&grows).len(), 1);
    }
}
