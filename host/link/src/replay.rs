//! A record played into a device as its potentiometer.

use crate::bench::Bench;
use crate::follow::is_refined;
use std::time::Duration;
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::interrupt;
use yawrig_core::record::Record;
use yawrig_core::solver::linear_fit;
use yawrig_shared::window::SAMPLE_RATE_HZ;
use yawrig_shared::wire::{
    counting, Event, Refined, ReleaseResult, Reply, Request, Settings, WindowResult,
};

/// What the device makes of one record.
#[derive(Clone, Debug)]
pub struct Replayed {
    /// Device time of the record's first sample.
    pub first_sample: u32,
    /// Degrees that were taken off so that the record lies in the converter's middle.
    pub shift_deg: f64,
    pub releases: Vec<Release>,
    pub settings: Settings,
}

/// A release with its windows.
#[derive(Clone, Debug, Default)]
pub struct Release {
    pub windows: Vec<WindowResult>,
    pub result: Option<ReleaseResult>,
    /// Its refined estimate, where it sent one.
    pub refined: Option<Refined>,
}

impl Replayed {
    /// The release with the most windows, then one whose value counts: a record mostly holds one.
    pub fn main_release(&self) -> Option<&Release> {
        main_release(&self.releases)
    }
}

/// The release with the most windows, then one whose value counts, the first of equals.
pub fn main_release(releases: &[Release]) -> Option<&Release> {
    let counts = |r: &Release| counting(r.result.as_ref(), r.refined.as_ref()).is_some();
    releases.iter().rev().max_by_key(|release| (release.windows.len(), counts(release)))
}

/// The range of amplitudes to analyse, degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    pub from_deg: f64,
    pub to_deg: f64,
}

/// Counts of the record, resampled to the device's rate, and the settings they are made for.
pub fn counts(record: &Record, range: Range) -> Result<(Vec<u16>, Settings, f64)> {
    let record = record.resampled(f64::from(SAMPLE_RATE_HZ))?;
    let low = record.yaw_deg.iter().copied().fold(f64::INFINITY, f64::min);
    let high = record.yaw_deg.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let shift_deg = 0.5 * (low + high);
    // Fine enough to add no noise of its own, coarse enough that no sample meets an end.
    let degrees_per_count = ((high - low) / 65_000.0).max(0.001) as f32;
    let settings = Settings {
        degrees_per_count,
        from_deg: range.from_deg as f32,
        to_deg: range.to_deg as f32,
        ..Settings::default()
    };
    // What rounding leaves of a sample goes on to the next one: by itself it would go with the angle where
    // the record has steps of its own, and a device that looks at a hundredth of a count took it for damping.
    let mut left = 0.0;
    let counts = record
        .yaw_deg
        .iter()
        .map(|yaw_deg| {
            let steps = (yaw_deg - shift_deg) / f64::from(degrees_per_count);
            let wanted = steps + f64::from(settings.zero_counts) + left;
            left = wanted - wanted.round();
            wanted.round() as u16
        })
        .collect();
    Ok((counts, settings, shift_deg))
}

/// Plays a record into a device and collects what it says. `seen` is called with each event at once.
///
/// # Errors
/// Exit 7 where the device does not take the samples.
pub fn replay(
    bench: &mut Bench,
    record: &Record,
    range: Range,
    seen: &mut dyn FnMut(&Event) -> Result<()>,
) -> Result<Replayed> {
    let (counts, settings, shift_deg) = counts(record, range)?;
    bench.client.tell(&Request::Configure(settings), "the settings")?;
    let first_sample = bench.client.status()?.samples;
    let mut replayed = Replayed { first_sample, shift_deg, releases: Vec::new(), settings };
    let mut open = Release::default();
    for chunk in counts.chunks(1000) {
        interrupt::check()?;
        bench.play(chunk)?;
        collect(bench, Duration::ZERO, &mut open, &mut replayed.releases, seen)?;
    }
    let after_samples = first_sample.wrapping_add(counts.len() as u32);
    bench.client.tell(&Request::EndRelease { after_samples }, "the end of the record")?;
    wait_for(bench, after_samples)?;
    // Whatever the device had to say went out before it said it had all samples.
    collect(bench, Duration::ZERO, &mut open, &mut replayed.releases, seen)?;
    Ok(replayed)
}

/// Waits until the device has taken so many samples and has said what it makes of them.
pub fn wait_for(bench: &mut Bench, samples: u32) -> Result<()> {
    let (mut taken, mut refining) = (0, false);
    let resets = bench.client.resets();
    // Each question takes at least a millisecond: patience for a minute without progress.
    let mut idle = 0;
    while idle < 6000 {
        let mut now = taken;
        match bench.client.request(&Request::Status) {
            Ok(Reply::Status(status)) => (now, refining) = (status.samples, status.refining),
            Ok(_) => {}
            Err(e) => return Err(bench.client.explain(e, "its state")),
        };
        if bench.client.resets() > resets {
            return Err(Error::device("the device has restarted, after a reset or a power cut")
                .help("play the record again"));
        }
        let all = now.wrapping_sub(samples) as i32 >= 0;
        if all && !refining {
            return Ok(());
        }
        idle = if now == taken { idle + 1 } else { 0 };
        taken = now;
        std::thread::sleep(Duration::from_millis(2));
    }
    let why = if refining {
        "the device does not finish its refined estimate".to_owned()
    } else {
        format!("the device took {taken} samples of {samples} and no more")
    };
    Err(Error::new(Exit::Timeout, why).help("start it again"))
}

/// Takes the events there are; windows wait in `open` for their release's result.
pub fn collect(
    bench: &mut Bench,
    patience: Duration,
    open: &mut Release,
    releases: &mut Vec<Release>,
    seen: &mut dyn FnMut(&Event) -> Result<()>,
) -> Result<()> {
    loop {
        match bench.client.next_event(patience) {
            Ok(Some(numbered)) => {
                seen(&numbered.event)?;
                match numbered.event {
                    Event::Window(window) => open.windows.push(window),
                    Event::Release(result) => {
                        open.result = Some(result);
                        releases.push(std::mem::take(open));
                    }
                    Event::Refined(refined) => {
                        let mut last = releases.iter_mut().rev();
                        let own = last.find(|release| {
                            release.result.is_some_and(|result| result.release == refined.release)
                        });
                        if let Some(release) = own {
                            release.refined = Some(refined);
                        }
                    }
                    Event::Phase { .. } => {}
                }
            }
            Ok(None) => return Ok(()),
            Err(e) => return Err(bench.client.explain(e, "its events")),
        }
    }
}

/// Rms in degrees of what a decaying sinusoid with each window's own estimate leaves of the
/// record, its amplitude, phase and mid-line fitted. `None` without windows.
pub fn residual_rms_deg(record: &Record, replayed: &Replayed, release: &Release) -> Option<f64> {
    let stretches = release.windows.iter().map(|window| Stretch {
        from: window.start_sample,
        to: window.end_sample,
        natural_frequency_rad_s: f64::from(window.natural_frequency_rad_s),
        damping_ratio: f64::from(window.damping_ratio),
    });
    rms_deg(record, replayed, stretches)
}

/// The same of the refined estimate and its whole record.
pub fn refined_residual_rms_deg(
    record: &Record,
    replayed: &Replayed,
    refined: &Refined,
) -> Option<f64> {
    let stretch = is_refined(refined).then(|| Stretch {
        from: refined.from_sample,
        to: refined.from_sample.wrapping_add(refined.samples),
        natural_frequency_rad_s: refined.natural_frequency_rad_s.value,
        damping_ratio: f64::from(refined.damping_ratio.value),
    });
    rms_deg(record, replayed, stretch.into_iter())
}

/// A part of the record, in device time, and the estimate it is held against.
struct Stretch {
    from: u32,
    to: u32,
    natural_frequency_rad_s: f64,
    damping_ratio: f64,
}

fn rms_deg(
    record: &Record,
    replayed: &Replayed,
    stretches: impl Iterator<Item = Stretch>,
) -> Option<f64> {
    let (mut square, mut count) = (0.0, 0_usize);
    let start_s = *record.time_s.first()?;
    for stretch in stretches {
        let time_of = |sample: u32| {
            start_s
                + f64::from(sample.wrapping_sub(replayed.first_sample)) / f64::from(SAMPLE_RATE_HZ)
        };
        let (from_s, to_s) = (time_of(stretch.from), time_of(stretch.to));
        let (wn, zeta) = (stretch.natural_frequency_rad_s, stretch.damping_ratio);
        let wd = wn * (1.0 - zeta * zeta).max(0.0).sqrt();
        let rows: Vec<([f64; 3], f64)> = record
            .time_s
            .iter()
            .zip(&record.yaw_deg)
            .filter(|(time_s, _)| (from_s..to_s).contains(*time_s))
            .map(|(time_s, yaw_deg)| {
                let t = time_s - from_s;
                let envelope = (-zeta * wn * t).exp();
                ([envelope * (wd * t).cos(), envelope * (wd * t).sin(), 1.0], *yaw_deg)
            })
            .collect();
        let [a, b, zero] = linear_fit(rows.iter().copied())?;
        for ([c, s, _], y) in &rows {
            square += (y - (a * c + b * s + zero)).powi(2);
        }
        count += rows.len();
    }
    (count > 0).then(|| (square / count as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A converter's record without noise, its steps ten counts and its middle between two counts: all that
    /// rounding takes off half a swing, or off any other stretch, is less than a count and so does not go
    /// with the angle.
    #[test]
    fn rounding_takes_nothing_off_a_stretch() {
        let time_s: Vec<f64> = (0..20_000).map(|k| f64::from(k) * 1e-3).collect();
        let yaw = |t: f64| (1200.0 * (-0.09 * t).exp() * (7.5 * t).cos()).round() * 0.01 + 0.005;
        let mut yaw_deg: Vec<f64> = time_s.iter().map(|t| yaw(*t)).collect();
        // The ends of the range, so that its middle is at half a count.
        (yaw_deg[0], yaw_deg[1]) = (12.0, -11.999);
        let record = Record::new("quantised.csv", time_s, yaw_deg.clone());
        let range = Range { from_deg: 10.0, to_deg: 1.0 };
        let (counts, settings, shift_deg) = counts(&record, range).expect("counts");
        let mut taken = 0.0_f64;
        for (yaw_deg, counts) in yaw_deg.iter().zip(counts) {
            let steps = (yaw_deg - shift_deg) / f64::from(settings.degrees_per_count);
            taken += steps - (f64::from(counts) - f64::from(settings.zero_counts));
            assert!(taken.abs() < 0.501, "{taken}");
        }
    }
}
