//! What is wrong with a record that identification does not see: a reading that is cut off, a dead spot of
//! the potentiometer, samples that were lost and counted as if they were not; and what tells that two records
//! are one.

use super::Record;
use crate::solver::linear_fit;
use crate::statistics::median;
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

/// A reading is cut off where so many more samples than next to it are at its end: two and a half times as
/// many are where a motion that does not decay turns round.
const PILED_UP: usize = 5;
/// And at least so many, in at least so many swings, which are more samples apart than noise dips for; and
/// the next reading is no further than this share of the range.
const MIN_AT_END: usize = 10;
const MIN_SWINGS: usize = 2;
const DIP: usize = 3;
const NEXT: f64 = 0.1;
/// A hole in the angles that were read is so many times as wide as the distance of neighbouring ones (the
/// largest of n distances of chance is ln n), so many steps of the reading, and this share of the amplitude.
const HOLE: f64 = 30.0;
const HOLE_STEPS: f64 = 4.0;
const HOLE_SHARE: f64 = 0.01;
/// Share of the samples missing in a hole that have the reading before, or are found at one value.
const FOUND_ELSEWHERE: f64 = 0.4;
/// One in so many samples with the same reading is no accident.
const MANY: usize = 20;
/// Samples of a cycle below which a hole is chance.
const MIN_OF_CYCLE: f64 = 20.0;
/// Whole cycles on each side of a jump of the phase.
const BESIDE: usize = 4;
/// A jump is so many times the others' standard deviation and so many radians.
const JUMP: f64 = 8.0;
const SMALLEST_JUMP_RAD: f64 = 0.05;
/// Amplitudes below this share of the first are not looked at: friction and play bend the phase there.
const SMALLEST_SHARE: f64 = 0.15;
/// Successive readings that are hashed together (coarse steps make a few of two releases the same), where one
/// in how many places, how many hashes are kept, and how many two records must share.
const BLOCK: usize = 200;
const PLACES: u64 = 8;
const SKETCH: usize = 64;
const SHARED: usize = 6;

/// The kind of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// The reading ends before the motion does.
    Clipped,
    /// Angles that were passed and never read.
    DeadSpot,
    /// The oscillation jumps ahead while the clock does not.
    LostSamples,
}

/// A fault of a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// What is wrong.
    pub kind: FaultKind,
    /// One sentence for the user, without a full stop.
    pub message: String,
    /// The numbers behind it.
    pub evidence: String,
}

/// A record's faults, and what it is recognised by.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facts {
    /// Of all its readings, whatever their clock.
    content: u64,
    /// The smallest hashes of successive readings.
    sketch: Vec<u64>,
    /// What is wrong with it.
    pub faults: Vec<Fault>,
}

impl Facts {
    /// Of a record that was analysed from `from_s` to `to_s` with this natural frequency.
    pub fn new(record: &Record, from_s: f64, to_s: f64, natural_frequency_rad_s: f64) -> Self {
        let first = record.time_s.partition_point(|t| *t < from_s);
        let last = record.time_s.partition_point(|t| *t <= to_s);
        let (time_s, yaw_deg) = (&record.time_s[first..last], &record.yaw_deg[first..last]);
        let faults = match time_s.len() > 2 * MIN_AT_END && natural_frequency_rad_s > 0.0 {
            true => [
                clipped(yaw_deg),
                dead_spot(time_s, yaw_deg, natural_frequency_rad_s),
                lost_samples(time_s, yaw_deg, natural_frequency_rad_s),
            ],
            false => [const { None }; 3],
        };
        let faults = faults.into_iter().flatten().collect();
        Self { content: content(&record.yaw_deg), sketch: sketch(&record.yaw_deg), faults }
    }

    /// Whether two records have the same readings.
    pub fn is_same(&self, other: &Self) -> bool {
        self.content == other.content
    }

    /// Whether readings of one record are in the other, too.
    pub fn shares(&self, other: &Self) -> bool {
        let common = self.sketch.iter().filter(|hash| other.sketch.binary_search(hash).is_ok());
        common.count() >= SHARED
    }
}

/// FxHash, as rustc has it for its tables, its high half mixed into the low one: quick, and nobody chooses
/// readings so that two hashes are one.
fn hash(readings: &[f64]) -> u64 {
    let mixed = readings.iter().fold(0u64, |hash, reading| {
        (hash.rotate_left(5) ^ reading.to_bits()).wrapping_mul(0x517c_c1b7_2722_0a95)
    });
    mixed ^ (mixed >> 32)
}

fn content(yaw_deg: &[f64]) -> u64 {
    hash(yaw_deg)
}

/// Hashes of blocks of successive readings that begin where the readings themselves say, the smallest of
/// them.
fn sketch(yaw_deg: &[f64]) -> Vec<u64> {
    let begins = |block: &&[f64]| block[0] != block[1] && hash(&block[..3]).is_multiple_of(PLACES);
    let differ = |block: &&[f64]| block.windows(2).filter(|y| y[0] != y[1]).count() > BLOCK / 8;
    let blocks = yaw_deg.windows(BLOCK).filter(begins).filter(differ);
    let mut all: Vec<u64> = blocks.map(hash).collect();
    all.sort_unstable();
    all.dedup();
    all.truncate(SKETCH);
    all
}

/// How often each reading comes, in order.
fn counted(yaw_deg: &[f64]) -> Vec<(f64, usize)> {
    let mut sorted = yaw_deg.to_vec();
    sorted.sort_by(f64::total_cmp);
    let mut counted: Vec<(f64, usize)> = Vec::new();
    for y in sorted {
        match counted.last_mut() {
            Some((value, count)) if *value == y => *count += 1,
            _ => counted.push((y, 1)),
        }
    }
    counted
}

fn clipped(yaw_deg: &[f64]) -> Option<Fault> {
    let counted = counted(yaw_deg);
    let range = counted.last()?.0 - counted[0].0;
    let ends = [counted.iter().take(4).collect::<Vec<_>>(), counted.iter().rev().take(4).collect()];
    let cut = ends.iter().find_map(|end| {
        let (&&(level, count), beside) = end.split_first()?;
        let next = beside.iter().map(|(_, count)| *count).max()?;
        // Separate visits, each left by more than noise that dips below the level.
        let mut swings = 0;
        let mut away = usize::MAX;
        for y in yaw_deg {
            match *y == level {
                true if away > DIP => (swings, away) = (swings + 1, 0),
                true => away = 0,
                false => away = away.saturating_add(1),
            }
        }
        let is_near = (beside[0].0 - level).abs() < NEXT * range;
        let is_cut =
            count >= MIN_AT_END && count > PILED_UP * next && swings >= MIN_SWINGS && is_near;
        is_cut.then_some((level, count, swings))
    });
    cut.map(|(level, count, swings)| Fault {
        kind: FaultKind::Clipped,
        message: format!(
            "its reading is cut off at {level:.4} deg: the amplifier or converter ends there, and the motion goes beyond"
        ),
        evidence: format!("{count} samples in {swings} swings read {level:.4} deg"),
    })
}

fn dead_spot(time_s: &[f64], yaw_deg: &[f64], wn: f64) -> Option<Fault> {
    let span_s = time_s[time_s.len() - 1] - time_s[0];
    if (time_s.len() as f64) * TAU / wn < MIN_OF_CYCLE * span_s {
        return None;
    }
    // A reading that many samples have may be what a worn track falls to.
    let (most_at, most) = counted(yaw_deg).into_iter().max_by_key(|(_, count)| *count)?;
    let is_level = most * MANY > yaw_deg.len();
    let moving: Vec<f64> = yaw_deg.iter().copied().filter(|y| !is_level || *y != most_at).collect();
    if moving.is_empty() {
        return None;
    }
    let centre = median(&mut moving.clone());
    let largest = moving.iter().map(|y| (y - centre).abs()).fold(0.0, f64::max);
    let inside: Vec<f64> =
        moving.iter().copied().filter(|y| (y - centre).abs() < 0.6 * largest).collect();
    if inside.len() < 200 {
        return None;
    }
    let counted = counted(&inside);
    let gaps: Vec<f64> = counted.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
    let step = gaps.iter().copied().fold(f64::INFINITY, f64::min);
    let (k, gap) = gaps.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let (low, high) = (counted[k].0, counted[k + 1].0);
    // Samples for each degree on both sides, the edges apart.
    let number =
        |from: f64, to: f64| inside.iter().filter(|y| from < **y && **y < to).count() as f64;
    let reach = 4.0 * gap;
    let edge = 0.25 * gap;
    let about = number(low - reach, low - edge) + number(high + edge, high + reach);
    let per_deg = about / (2.0 * (reach - edge));
    let missing = per_deg * gap;
    // What was read in its place: the reading before again, or one that it falls to.
    // Repeats elsewhere are those of turning points and of coarse steps.
    let fastest = yaw_deg.windows(2).map(|y| (y[1] - y[0]).abs()).fold(0.0, f64::max);
    let is_beside = |y: f64| low - fastest <= y && y <= high + fastest;
    let twice = yaw_deg.windows(2).filter(|y| y[0] == y[1] && is_beside(y[0])).count() as f64;
    let found = twice.max(most as f64 - per_deg * step);
    let passes = yaw_deg.windows(2).filter(|y| (y[0] <= low) != (y[1] <= low)).count();
    let is_hole = missing > HOLE
        && gap > HOLE_STEPS * step
        && gap > HOLE_SHARE * largest
        && passes >= 6
        && found > FOUND_ELSEWHERE * missing;
    is_hole.then(|| Fault {
        kind: FaultKind::DeadSpot,
        message: format!(
            "its reading has a dead spot from {low:.3} to {high:.3} deg: it is passed and never read (a worn track?)"
        ),
        evidence: format!("{passes} passes, {missing:.0} samples missing there"),
    })
}

/// Phase and amplitude of each whole cycle.
fn cycles(time_s: &[f64], yaw_deg: &[f64], wn: f64) -> Vec<(f64, f64)> {
    let period_s = TAU / wn;
    let (first, end) = (time_s[0], time_s[time_s.len() - 1]);
    let count = ((end - first) / period_s) as usize;
    let one = |k: usize| {
        let (from, to) = (first + k as f64 * period_s, first + (k + 1) as f64 * period_s);
        let (a, b) = (time_s.partition_point(|t| *t < from), time_s.partition_point(|t| *t < to));
        let rows = (a..b).map(|i| {
            let (sin, cos) = (wn * (time_s[i] - first)).sin_cos();
            ([cos, sin, 1.0], yaw_deg[i])
        });
        let [c, s, _] = linear_fit(rows)?;
        Some(((-s).atan2(c), c.hypot(s)))
    };
    let mut found: Vec<(f64, f64)> = (0..count).map_while(one).collect();
    let mut turned = 0.0;
    for k in 1..found.len() {
        let step = found[k].0 + turned - found[k - 1].0;
        turned -= TAU * ((step + PI) / TAU).floor();
        found[k].0 += turned;
    }
    found
}

/// Where a line through four values of `y` after place `k` is ahead of one through the four before it.
fn jump(y: impl Fn(usize) -> f64, k: usize) -> f64 {
    let line = |first: usize| {
        let rows = (first..first + BESIDE).map(|i| ([1.0, i as f64 - k as f64], y(i)));
        linear_fit(rows).map_or(f64::NAN, |[at, _]: [f64; 2]| at)
    };
    line(k + 1) - line(k - BESIDE)
}

fn lost_samples(time_s: &[f64], yaw_deg: &[f64], wn: f64) -> Option<Fault> {
    let cycles = cycles(time_s, yaw_deg, wn);
    let first = cycles.first()?.1;
    let large = cycles.iter().take_while(|(_, a)| *a > SMALLEST_SHARE * first).count();
    let places: Vec<usize> = (BESIDE..large.saturating_sub(BESIDE)).collect();
    if places.len() < 2 * BESIDE {
        return None;
    }
    let jumps: Vec<f64> = places.iter().map(|&k| jump(|i| cycles[i].0, k)).collect();
    let usual = |scale: &dyn Fn(usize) -> f64| {
        let mut sizes: Vec<f64> =
            jumps.iter().zip(&places).map(|(j, &k)| (j * scale(k)).abs()).collect();
        1.4826 * median(&mut sizes)
    };
    // Neither what moves the phase as such nor what moves the angle has made it.
    let (plain, scaled) = (usual(&|_| 1.0), usual(&|k| cycles[k].1));
    let size = |j: &f64| j.abs();
    let (at, most) = jumps.iter().enumerate().max_by(|a, b| size(a.1).total_cmp(&size(b.1)))?;
    let k = places[at];
    let louder = jump(|i| cycles[i].1.ln(), k).abs();
    let is_jump = most.abs() > (JUMP * plain).max(SMALLEST_JUMP_RAD)
        && (most * cycles[k].1).abs() > JUMP * scaled
        && louder < 0.1;
    let at_s = time_s[0] + (k as f64 + 0.5) * TAU / wn;
    is_jump.then(|| Fault {
        kind: FaultKind::LostSamples,
        message: format!(
            "its oscillation jumps by {:.4} s at {at_s:.2} s while its clock goes on evenly: samples are lost there, or twice",
            most.abs() / wn
        ),
        evidence: format!(
            "{most:+.3} rad, {:.0} times what its phase moves elsewhere",
            most.abs() / plain.max(1e-9)
        ),
    })
}

/// Pairs of records, the earlier first, that are the same or share readings; each later one once.
pub fn copies(facts: &[Facts]) -> Vec<(usize, usize)> {
    let mut seen: HashMap<u64, Vec<usize>> = HashMap::new();
    let mut whole: HashMap<u64, usize> = HashMap::new();
    let mut found = Vec::new();
    for (later, of) in facts.iter().enumerate() {
        let mut near: Vec<usize> = of
            .sketch
            .iter()
            .flat_map(|hash| seen.get(hash).into_iter().flatten())
            .copied()
            .collect();
        near.sort_unstable();
        near.dedup();
        let same = whole.get(&of.content).copied();
        let shares = || near.into_iter().find(|&k| facts[k].shares(of));
        found.extend(same.or_else(shares).map(|earlier| (earlier, later)));
        whole.entry(of.content).or_insert(later);
        of.sketch.iter().for_each(|hash| seen.entry(*hash).or_default().push(later));
    }
    found
}
