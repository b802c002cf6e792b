//! Stretches of a record without samples, for methods that need an even grid.
//!
//! A spline across a gap overshoots by what the noise of the two samples at its edges makes of its slope. So
//! a gap of up to half a period is filled with what one damped oscillation, fitted to the cycles on both
//! sides of it, says of it; a longer one parts the record.

use super::envelope::{envelope, strongest_frequency_rad_s};
use super::least_squares::fit_mode;
use super::samples::Samples;
use super::steady_line::SteadyLine;
use crate::record::Record;
use crate::statistics::median;
use std::borrow::Cow;
use std::f64::consts::TAU;
use std::fmt;

/// A longer time between two samples is a gap, where it is longer in median steps (irregular clocks stay
/// below) and in periods (less does no harm).
const LONGEST_STEP: f64 = 2.5;
const SHORTEST: f64 = 0.005;
/// Longest gap that is filled, in periods.
const LONGEST_FILLED: f64 = 0.5;
/// Periods on either side to which the oscillation is fitted.
const ABOUT: f64 = 1.5;
/// Samples of a part between gaps, at least: fewer cannot be resampled.
const MIN: usize = 4;
/// Periods at either edge over which what is measured there decides how far the filling is shifted.
const EDGE: f64 = 0.05;

/// No samples between these two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    pub(crate) from_s: f64,
    pub(crate) to_s: f64,
}

impl Gap {
    pub(crate) fn length_s(&self) -> f64 {
        self.to_s - self.from_s
    }
}

impl std::fmt::Display for Gap {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "no samples from {:.3} s to {:.3} s", self.from_s, self.to_s)
    }
}

/// What became of the gaps of a record.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Filled {
    /// Without gaps.
    pub(crate) record: Record,
    pub(crate) filled: Vec<Gap>,
    /// Those at which the record was cut; the longest free decay between them is kept.
    pub(crate) parting: Vec<Gap>,
}

/// Where `record` has longer steps than other records have.
fn gaps(record: &Record) -> Vec<Gap> {
    let mut steps: Vec<f64> = record.time_s.windows(2).map(|t| t[1] - t[0]).collect();
    if steps.is_empty() {
        return Vec::new();
    }
    let longest_s = LONGEST_STEP * median(&mut steps);
    let pairs = record.time_s.windows(2).filter(|t| t[1] - t[0] > longest_s);
    pairs.map(|t| Gap { from_s: t[0], to_s: t[1] }).collect()
}

/// `record` without its gaps; none where it has none, or no oscillation.
pub(crate) fn filled(record: &Record) -> Option<Filled> {
    let mut gaps = gaps(record);
    if gaps.is_empty() {
        return None;
    }
    let samples = Samples::new(&record.time_s, &record.yaw_deg);
    let frequency = strongest_frequency_rad_s(&samples)?;
    let periods = |gap: &Gap| gap.length_s() * frequency / TAU;
    gaps.retain(|gap| periods(gap) > SHORTEST);
    if gaps.is_empty() {
        return None;
    }
    let (parting, filled): (Vec<Gap>, Vec<Gap>) =
        gaps.into_iter().partition(|gap| periods(gap) > LONGEST_FILLED);
    let (from_s, to_s) = longest_swing(&samples, &parting, frequency)?;
    let filled: Vec<Gap> =
        filled.into_iter().filter(|gap| from_s <= gap.from_s && gap.to_s <= to_s).collect();
    let mut whole = record.with(Vec::new(), Vec::new());
    let mut next = filled.iter().peekable();
    for (&t, &y) in record.time_s.iter().zip(&record.yaw_deg) {
        if t < from_s || t > to_s {
            continue;
        }
        if let Some(gap) = next.next_if(|gap| gap.to_s <= t) {
            let inside = filling(&samples, gap, frequency);
            whole.time_s.extend(inside.iter().map(|p| p.0));
            whole.yaw_deg.extend(inside.iter().map(|p| p.1));
        }
        whole.time_s.push(t);
        whole.yaw_deg.push(y);
    }
    Some(Filled { record: whole, filled, parting })
}

/// What lies between the gaps of `record` that are too long to be filled, each named by its times, and is
/// more than a few samples; none where it has no such gap.
pub(crate) fn parts(record: &Record) -> Vec<Record> {
    let parting = filled(record).map_or(Vec::new(), |filled| filled.parting);
    if parting.is_empty() {
        return Vec::new();
    }
    let mut ends: Vec<usize> = parting
        .iter()
        .map(|gap| record.time_s.partition_point(|t| *t <= gap.from_s))
        .chain([record.len()])
        .collect();
    let mut from = 0;
    let part = |to: &mut usize| {
        let range = std::mem::replace(&mut from, *to)..*to;
        let (time_s, yaw_deg) = (&record.time_s[range.clone()], &record.yaw_deg[range]);
        let (first_s, last_s) = (time_s[0], time_s[time_s.len() - 1]);
        let file = format!("{} ({first_s:.3} s to {last_s:.3} s)", record.name()).into();
        Record { file, ..record.with(time_s.to_vec(), yaw_deg.to_vec()) }
    };
    ends.iter_mut().map(part).filter(|part| part.len() >= MIN).collect()
}

/// `record` without its gaps, for who needs an even grid, and what was done about them.
pub fn without(record: &Record) -> (Cow<'_, Record>, Vec<Warning>) {
    let Some(filled) = filled(record) else { return (Cow::Borrowed(record), Vec::new()) };
    let longest = filled.filled.iter().max_by(|a, b| a.length_s().total_cmp(&b.length_s()));
    let (whole, file) = (&filled.record, filled.record.file.display().to_string());
    let fill = longest.map(|&longest| Warning::Filled {
        record: file.clone(),
        longest,
        others: filled.filled.len() - 1,
    });
    let part = filled.parting.first().map(|&gap| Warning::Parted {
        record: file.clone(),
        gap,
        from_s: whole.time_s[0],
        to_s: whole.time_s[whole.len() - 1],
    });
    let warnings = fill.into_iter().chain(part).collect();
    (Cow::Owned(filled.record), warnings)
}

/// What was done about samples that are missing, and about what is no motion.
#[derive(Clone, Debug, PartialEq)]
pub enum Warning {
    /// A steady line far above the oscillation is taken out of the reading.
    Line {
        /// Name of the record.
        record: String,
        /// What was taken out.
        line: SteadyLine,
        /// Of the reading.
        unit: String,
    },
    /// Short gaps are filled by fits to the cycles about them.
    Filled {
        /// Name of the record.
        record: String,
        /// The longest of the gaps.
        longest: Gap,
        /// How many shorter ones there are.
        others: usize,
    },
    /// So many parts between gaps too long for that are judged as releases of one rig.
    Joined {
        /// Name of the record.
        record: String,
        /// How many.
        parts: usize,
    },
    /// A gap too long for that: the part between these times is used.
    Parted {
        /// Name of the record.
        record: String,
        /// The first such gap.
        gap: Gap,
        /// Beginning of the part, on the record's clock.
        from_s: f64,
        /// End of the part, on the record's clock.
        to_s: f64,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line { record, line, unit } => write!(
                f,
                "{record}: a steady line of {:.2} Hz and {:.4} {unit} is taken out of the reading (mains hum?)",
                line.frequency_rad_s / std::f64::consts::TAU,
                line.amplitude_deg()
            ),
            Self::Filled { record, longest, others } => {
                let others = match others {
                    0 => String::new(),
                    1 => " and in a shorter gap".to_owned(),
                    more => format!(" and in {more} shorter gaps"),
                };
                write!(f, "{record}: {longest}{others}; filled by fits to the cycles about them")
            }
            Self::Joined { record, parts } => write!(
                f,
                "{record}: its gaps are too long to be filled; the {parts} parts between them are judged as releases of one rig"
            ),
            Self::Parted { record, gap, from_s, to_s } => {
                write!(
                    f,
                    "{record}: {gap}; used is what lies between {from_s:.3} s and {to_s:.3} s"
                )
            }
        }
    }
}

/// First and last time between the gaps `parting` where there is most of a free decay, amplitude times time;
/// none where nowhere between them is enough of one to see its amplitude.
fn longest_swing(samples: &Samples<'_>, parting: &[Gap], frequency: f64) -> Option<(f64, f64)> {
    let all = samples.all();
    let last_s = all.time_s[all.len() - 1];
    let begins = std::iter::once(all.time_s[0]).chain(parting.iter().map(|gap| gap.to_s));
    let ends = parting.iter().map(|gap| gap.from_s).chain([last_s]);
    // Of the oscillation: noise is no swing, however long it lasts.
    let swing = |&(from_s, to_s): &(f64, f64)| -> f64 {
        let part = all.between(from_s, to_s);
        // A sample alone between two gaps is none, either.
        match part.is_empty() {
            true => 0.0,
            false => envelope(&part, frequency).iter().map(|p| p.amplitude_deg).sum(),
        }
    };
    let parts = begins.zip(ends).map(|part| (swing(&part), part));
    let most = parts.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (most.0 > 0.0).then_some(most.1)
}

/// Samples inside `gap` at the record's own step.
fn filling(samples: &Samples<'_>, gap: &Gap, frequency: f64) -> Vec<(f64, f64)> {
    let period_s = TAU / frequency;
    let about = samples.between(gap.from_s - ABOUT * period_s, gap.to_s + ABOUT * period_s);
    // Where nothing swings, a straight line.
    let mode = fit_mode(&about, frequency).map(|found| found.mode);
    let of_mode = |t: f64| mode.as_ref().map_or(0.0, |mode| mode.yaw_deg(t));
    let edge_s = (EDGE * period_s).max(1.5 * about.step_s);
    let beside = |from_s: f64, to_s: f64| {
        let off = about.kept().filter(|(t, _)| from_s <= *t && *t <= to_s);
        let off: Vec<f64> = off.map(|(t, y)| y - of_mode(t)).collect();
        off.iter().sum::<f64>() / off.len() as f64
    };
    let before = beside(gap.from_s - edge_s, gap.from_s);
    let after = beside(gap.to_s, gap.to_s + edge_s);
    let count = ((gap.to_s - gap.from_s) / about.step_s).round() as usize;
    (1..count)
        .map(|k| {
            let share = k as f64 / count as f64;
            let t = gap.from_s + share * (gap.to_s - gap.from_s);
            (t, of_mode(t) + before + share * (after - before))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use yawrig_rig::{Effects, Samples as RigSamples, Sensor, Start};
    use yawrig_shared::modal::Modal;

    const NOISE_DEG: f64 = 0.05;

    /// A record of the rig with dry friction, 6 rad/s, at 1 kHz with white noise, released at 2 s.
    fn record(noise_deg: f64) -> Record {
        let modal = Modal { natural_frequency_rad_s: 6.0, damping_ratio: 0.01 };
        let effects = Effects::new(vec!["coulomb_friction:c=0.03".parse().unwrap()]).unwrap();
        let sensor = Sensor { noise_deg, ..Sensor::default() };
        let start = Start::default().limited(&modal, &effects);
        let samples = RigSamples::with_effects(&modal, &effects, &start, &sensor, 3).unwrap();
        let (time_s, yaw_deg) = samples.map(|s| (s.time_s, s.yaw_deg)).unzip();
        Record::new("rig", time_s, yaw_deg)
    }

    fn without(record: &Record, missing: &[(f64, f64)]) -> Record {
        let kept = |t: f64| !missing.iter().any(|(from_s, to_s)| *from_s < t && t < *to_s);
        let pairs = record.time_s.iter().zip(&record.yaw_deg).filter(|(t, _)| kept(**t));
        let (time_s, yaw_deg) = pairs.unzip();
        Record::new("rig", time_s, yaw_deg)
    }

    #[test]
    fn samples_alone_between_long_gaps_are_no_part() {
        let swing = |t: f64| 20.0 * (-0.1 * t).exp() * (6.0 * t).cos();
        let times = (0..60).map(|k| f64::from(k) * 0.1).chain([6.9, 7.9, 8.9]);
        let (time_s, yaw_deg): (Vec<f64>, Vec<f64>) = times.map(|t| (t, swing(t))).unzip();
        let record = Record::new("r", time_s, yaw_deg);
        let found = filled(&record).expect("gaps");
        // All that lies before the first gap.
        assert_eq!((found.record.len(), found.parting.len()), (60, 3));
        assert_eq!(parts(&record).len(), 1);
    }

    #[test]
    fn a_record_without_gaps_is_left_alone() {
        assert_eq!(filled(&record(NOISE_DEG)), None);
    }

    #[test]
    fn short_gaps_are_filled_to_less_than_the_noise() {
        let (noisy, quiet) = (record(NOISE_DEG), record(0.0));
        // Held, and swinging: at a zero of the angle, at an extreme, late.
        let missing = [(1.0, 1.02), (4.0, 4.05), (6.5, 6.8), (9.0, 9.5), (14.2, 14.25)];
        let found = filled(&without(&noisy, &missing)).expect("a swing");
        assert_eq!((found.filled.len(), found.parting.len()), (missing.len(), 0));
        assert_eq!(found.record.len(), noisy.len());
        for (from_s, to_s) in missing {
            let inside = |t: f64| from_s < t && t < to_s;
            let pairs = found.record.time_s.iter().zip(&found.record.yaw_deg).zip(&quiet.yaw_deg);
            let off =
                pairs.filter(|((t, _), _)| inside(**t)).map(|((_, y), truth)| (y - truth).abs());
            let worst = off.fold(0.0, f64::max);
            println!("{from_s} to {to_s} s: at most {worst:.4} deg");
            assert!(worst < NOISE_DEG, "{from_s} to {to_s} s: {worst}");
        }
    }

    #[test]
    fn a_long_gap_parts_the_record_where_most_of_the_swing_is() {
        let noisy = record(NOISE_DEG);
        let found = filled(&without(&noisy, &[(4.0, 4.7), (12.0, 12.1)])).expect("a swing");
        assert_eq!((found.filled.len(), found.parting.len()), (1, 1));
        assert!((found.record.time_s[0] - 4.7).abs() < 1e-9, "{}", found.record.time_s[0]);
        assert_eq!(found.parting[0].to_string(), "no samples from 4.000 s to 4.700 s");
        // Two seconds of hold and six of a larger swing are less than what comes then.
        let found = filled(&without(&noisy, &[(8.0, 8.7)])).expect("a swing");
        assert!((found.record.time_s[0] - 8.7).abs() < 1e-9, "{}", found.record.time_s[0]);
        let found = filled(&without(&noisy, &[(18.0, 18.7)])).expect("a swing");
        assert!(found.record.time_s[0] == 0.0);
        // A long rest afterwards is no swing, however noisy its sensor.
        let mut rests = noisy.clone();
        let end_s = noisy.time_s[noisy.len() - 1] + 5.0;
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for k in 0..600_000 {
            rests.time_s.push(end_s + 1e-3 * f64::from(k));
            rests.yaw_deg.push(random.random_range(-1.5..1.5));
        }
        assert!(filled(&rests).expect("a swing").record.time_s[0] == 0.0);
    }
}
