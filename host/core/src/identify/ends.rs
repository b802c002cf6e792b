//! The beginning and the end of a free motion: let go from a hold or a hand, stopped, pushed, or died out.

use super::damped_sinusoid::Mode;
use super::envelope::{rises, POINTS_PER_CYCLE};
use super::flag::Flag;
use super::free_motion::{FreeMotion, BEATING_CYCLES};
use super::least_squares;
use super::release::{Ending, Run, Search};
use super::samples::Stretch;
use super::{Begin, End};
use crate::record::Derivative;
use crate::solver::linear_fit;
use crate::statistics::median;
use std::f64::consts::TAU;

/// Misfit of the free decay continued backwards beyond which the model was still held, as a share of its
/// amplitude and in noise.
const MISFIT_SHARE: f64 = 0.12;
const MISFIT_NOISE: f64 = 6.0;
/// Amplitude over noise beyond which a hand, a push and a swing are distinguished from a wandering zero.
const CLEAR_SWING: f64 = 20.0;
/// Cycles of one mode by which it is continued.
const CORE_CYCLES: f64 = 2.0;
/// Left out after a release, in cycles: the catch takes some time to let go.
const GUARD_CYCLES: f64 = 0.02;
/// Fall of the amplitude within a cycle that no damping in range explains (damping ratio 0.15).
const STOPPED_RATIO: f64 = 2.5;
/// Fall of the amplitude within the last cycle, over what damping and dry friction, which takes as much from
/// each cycle, would let it fall by, from which on it was stopped. A hand takes all that is left: 1.63 times
/// that at the damping ratio of 0.15, more at a smaller one.
const FALLS_FASTER: f64 = 1.5;
/// A rise of the amplitude within three cycles, by this factor and this share of the largest, that is a push
/// where the fall within the two cycles before it is less than its root: a beat falls as fast as it rises.
pub(super) const PUSHED_RATIO: f64 = 1.5;
const PUSHED_SHARE: f64 = 0.25;
/// Cycles in which a rise by this ratio is a hand's or a push.
const PUSHED_CYCLES: usize = 3;
/// Cycles that the model has swung before it can have been pushed again: what wanders is no swing.
const SWUNG: usize = 3;

/// Shares of a hold's angle between which the first swing is timed.
const LEAVES: [f64; 2] = [0.97, 0.4];
/// Time that it may take over that of the mode that follows: a hand that carries half of the springs' moment
/// makes it 1.4 times as long.
const HELD_BACK: f64 = 1.3;

pub(super) struct Onset {
    pub(crate) release_s: f64,
    pub(crate) free_from_s: f64,
    pub(crate) begin: Begin,
}

impl Search<'_> {
    /// The beginning of the free motion that `run` belongs to.
    pub(super) fn onset(&self, run: Run, flags: &mut Vec<Flag>) -> Onset {
        // What a later push brings is another motion.
        let pushed = self.push(run).filter(|_| self.is_clear(run)).unwrap_or(run.last);
        let peak = self.largest(run.first, pushed);
        let first_s = (self.points[run.first].time_s - 0.5 * self.period).max(self.begin_s);
        let is_clear = self.is_clear(run);
        // Where it is not seen to be let go from standing still or pushed, an amplitude that grows grows by
        // itself.
        let before = self.points[peak.saturating_sub(PUSHED_CYCLES * POINTS_PER_CYCLE)];
        let pushed_up = self.points[peak].amplitude_deg > PUSHED_RATIO * before.amplitude_deg;
        let grows = peak - run.first > 2 * POINTS_PER_CYCLE && !(is_clear && pushed_up);
        let begin = Begin::Record;
        let by_itself = Onset { release_s: first_s, free_from_s: first_s, begin };
        if grows && !is_clear {
            return by_itself;
        }
        // Two cycles that are free for certain, continued backwards by half a cycle at a time as long as that
        // fits.
        let mut free_s = match is_clear {
            true => self.free_for_certain(run, peak),
            false => self.points[peak].time_s + 0.5 * self.period,
        };
        // Two modes beat where the amplitude rises again.
        let after: Vec<f64> =
            self.points[peak..=run.last].iter().map(|p| p.amplitude_deg).collect();
        let beats = rises(&after, after[0]);
        if grows {
            // Its largest amplitude may be its last: the two cycles are before that, then.
            let whole_s = self.points[run.last].time_s + (0.5 - CORE_CYCLES) * self.period;
            free_s = free_s.min(whole_s);
        }
        loop {
            let before = self.means.between(free_s - 0.5 * self.period, free_s);
            let Some(motion) = self.continued(free_s, &before, beats) else {
                if grows {
                    return by_itself;
                }
                flags.push(Flag::StartsInMidSwing);
                let begin = Begin::MidSwing;
                return Onset { release_s: free_s, free_from_s: free_s, begin };
            };
            let misfit = self.misfits(&before, &motion).last();
            if let Some(last) = misfit {
                let seen_s = before.time_s[last] + self.means.step_s;
                let amplitude_deg = motion.amplitude_deg(seen_s);
                // A wandering zero stands still at times, too, but what follows is no damped mode far above
                // the noise.
                let is_let_go = || {
                    let core = self.means.between(free_s, free_s + CORE_CYCLES * self.period);
                    self.misfits(&core, &motion).next().is_none()
                        && self.hold_before(seen_s, amplitude_deg).is_some()
                };
                if grows && !is_let_go() {
                    return by_itself;
                }
                return self.released(seen_s, &motion, flags);
            }
            free_s -= 0.5 * self.period;
            if free_s <= self.begin_s {
                if grows {
                    return by_itself;
                }
                let [_, rate] = motion.state(self.derivative, self.begin_s);
                let wn = motion.main().natural_frequency_rad_s();
                let amplitude = self.derivative.of_motion(motion.amplitude_deg(self.begin_s), wn);
                let in_mid_swing = rate.abs() > 0.15 * amplitude * wn;
                if in_mid_swing {
                    flags.push(Flag::StartsInMidSwing);
                }
                let begin = if in_mid_swing { Begin::MidSwing } else { Begin::Record };
                return Onset { release_s: self.begin_s, free_from_s: self.begin_s, begin };
            }
        }
    }

    /// What is free from `free_s` on for two cycles, or where it `beats` for five: where one mode does not hold
    /// its own cycles, or two go on `before` them and one does not.
    fn continued(&self, free_s: f64, before: &Stretch<'_>, beats: bool) -> Option<FreeMotion> {
        let cycles = |n: f64| self.means.between(free_s, free_s + n * self.period);
        let holds =
            |motion: &FreeMotion, over: &Stretch<'_>| self.misfits(over, motion).next().is_none();
        let core = cycles(CORE_CYCLES);
        let one = FreeMotion::one(self.mode_of(&core)?);
        let is_one = holds(&one, &core);
        if !beats || is_one && holds(&one, before) {
            return Some(one);
        }
        let core = cycles(BEATING_CYCLES);
        let beat = |two: &FreeMotion| holds(two, &core) && (!is_one || holds(two, before));
        Some(FreeMotion::two(&core).filter(beat).unwrap_or(one))
    }

    /// The point with the largest amplitude.
    fn largest(&self, first: usize, last: usize) -> usize {
        (first..=last)
            .max_by(|&a, &b| self.points[a].amplitude_deg.total_cmp(&self.points[b].amplitude_deg))
            .unwrap_or(first)
    }

    /// Whether a hand, a push and a swing can be distinguished: far above the noise.
    fn is_clear(&self, run: Run) -> bool {
        let amplitudes = (run.first..=run.last).map(|i| self.points[i].amplitude_deg);
        amplitudes.fold(0.0, f64::max) > CLEAR_SWING * self.noise
    }

    /// Half a cycle from the largest amplitude, or later, where the model stands still after that: it was a
    /// hand's.
    fn free_for_certain(&self, run: Run, peak: usize) -> f64 {
        let peak = self.points[peak];
        let last_s = self.points[run.last].time_s - 1.5 * self.period;
        let stands_still = |from_s: f64| {
            let halves = [0.5, 1.0].map(|cycles| from_s + cycles * self.period);
            halves.iter().any(|to_s| self.hold_before(*to_s, peak.amplitude_deg).is_some())
        };
        let first_s = peak.time_s + 0.5 * self.period;
        let later = (0..).map(|k| first_s + 0.5 * self.period * f64::from(k));
        later.take_while(|s| *s < last_s).find(|s| !stands_still(*s)).unwrap_or(first_s)
    }

    /// The release, seen to be over at `free_s` from the free motion after it.
    fn released(&self, free_s: f64, motion: &FreeMotion, flags: &mut Vec<Flag>) -> Onset {
        let hold = self.hold_before(free_s, motion.amplitude_deg(free_s));
        let (release_s, begin) = match hold.map(|hold| self.leaves(motion, hold, free_s)) {
            Some(release_s) => (release_s, Begin::Held),
            None => match self.let_go_before(free_s, motion) {
                Some(release_s) => (release_s, Begin::Held),
                None => {
                    flags.push(Flag::PushedAtStart);
                    (free_s, Begin::Pushed)
                }
            },
        };
        let guarded = release_s + GUARD_CYCLES * self.period;
        Onset { release_s, free_from_s: free_s.max(guarded), begin }
    }

    /// When the model was let go from a hold within the cycle before `seen_s`, from where on one mode holds it: a
    /// memory of the hold, or a mode that dies out at once, is in its first swing. It is let go if the springs
    /// pull with all they have from the start.
    fn let_go_before(&self, seen_s: f64, motion: &FreeMotion) -> Option<f64> {
        let amplitude_deg = motion.amplitude_deg(seen_s);
        let halves = [0.5, 0.75, 1.0].map(|cycles| seen_s - cycles * self.period);
        let hold = |to_s: &f64| Some((*to_s, self.hold_before(*to_s, amplitude_deg)?));
        let (held_s, hold_deg) = halves.iter().find_map(hold)?;
        let rest_deg = motion.main().offset_deg;
        let size_deg = hold_deg - rest_deg;
        if size_deg.abs() < amplitude_deg.max(CLEAR_SWING * self.noise) {
            return None;
        }
        let share = |(t, yaw_deg): (f64, f64)| (t, (yaw_deg - rest_deg) / size_deg);
        let after = self.means.between(held_s - 0.5 * self.period, seen_s);
        let passed = after.kept().map(share).take_while(|(_, left)| *left > LEAVES[1]);
        // Of a cosine that begins at the hold, the phase at which so much is left.
        let phases = passed.filter(|(_, left)| *left < LEAVES[0]).map(|(t, left)| (t, left.acos()));
        let [phase, wn] = linear_fit(phases.map(|(t, phase)| ([1.0, t - seen_s], phase)))?;
        let pulled = wn * HELD_BACK > motion.main().natural_frequency_rad_s();
        pulled.then(|| seen_s - phase / wn)
    }

    fn mode_of(&self, stretch: &Stretch<'_>) -> Option<Mode> {
        least_squares::fit_mode(stretch, TAU / self.period).map(|found| found.mode)
    }

    /// Indices in `stretch` from which on two neighbours lie off the continued motion.
    fn misfits<'b>(
        &self,
        stretch: &'b Stretch<'_>,
        motion: &'b FreeMotion,
    ) -> impl DoubleEndedIterator<Item = usize> + 'b {
        let noise = MISFIT_NOISE * self.noise;
        let off = move |k: usize| {
            let t = stretch.time_s[k];
            let allowed = noise.max(MISFIT_SHARE * motion.amplitude_deg(t));
            (stretch.yaw_deg[k] - motion.yaw_deg(t)).abs() > allowed
        };
        (0..stretch.len()).filter(move |&k| off(k) && (k == 0 || off(k - 1)))
    }

    /// The level before `time_s`, if the model stood still there.
    fn hold_before(&self, time_s: f64, amplitude_deg: f64) -> Option<f64> {
        let before = self.means.between(time_s - 0.5 * self.period, time_s);
        if before.is_empty() {
            return None;
        }
        let level = median(&mut before.yaw_deg.to_vec());
        let allowed = (MISFIT_NOISE * self.noise).max(0.1 * amplitude_deg);
        // The last means before the motion is found to be free are moving already.
        let still = before.yaw_deg.iter().filter(|y| (*y - level).abs() <= allowed).count();
        (still as f64 >= 0.75 * before.len() as f64).then_some(level)
    }

    /// When the motion leaves the hold: at its turning point if that is the hold's level, else where it crosses
    /// it.
    fn leaves(&self, motion: &FreeMotion, hold_deg: f64, seen_s: f64) -> f64 {
        let steps = 64;
        let span = 0.25 * self.period;
        let times = (0..=2 * steps).map(|i| seen_s + span * (i as f64 / steps as f64 - 1.0));
        let off = |t: f64| (motion.yaw_deg(t) - hold_deg).abs();
        let Some(nearest) = times.min_by(|a, b| off(*a).total_cmp(&off(*b))) else { return seen_s };
        // Held still there is no acceleration, and the largest at once when it is let go.
        let jumps = self.derivative == Derivative::Acceleration;
        let nearest = if jumps { seen_s } else { nearest };
        // Newton on the rate: a turning point within a sixteenth of a cycle is the release from rest.
        let mut turning = nearest;
        for _ in 0..20 {
            let [rate, acceleration] = motion.slopes(turning);
            turning -= rate / acceleration;
        }
        let near = (turning - nearest).abs() < self.period / 8.0;
        let allowed = (MISFIT_NOISE * self.noise).max(MISFIT_SHARE * motion.amplitude_deg(seen_s));
        if near && (jumps || off(turning) <= allowed) {
            turning
        } else {
            nearest
        }
    }

    /// The last point from which the amplitude is still seen to fall before it is pushed up.
    fn push(&self, run: Run) -> Option<usize> {
        let amplitude = |i: usize| self.points[i].amplitude_deg;
        let largest = (run.first..=run.last).map(amplitude).fold(0.0, f64::max);
        let [before, after] = [2, 3].map(|cycles| cycles * POINTS_PER_CYCLE);
        // Another mode in the cycles that the envelope is made of lifts it again and again.
        let rises_by_itself = |i: usize| {
            let mut least = f64::INFINITY;
            (i - after..i).map(amplitude).any(|a| {
                least = least.min(a);
                a > PUSHED_RATIO * least
            })
        };
        let is_before_push = |i: &usize| {
            let then = (*i..=(i + after).min(run.last)).map(amplitude).fold(0.0, f64::max);
            let now = amplitude(*i);
            then > PUSHED_RATIO * now
                && then - now > PUSHED_SHARE * largest
                && (i - before..*i).all(|j| amplitude(j) >= now)
                && (amplitude(i - before) / now).powi(2) < then / now
                && !rises_by_itself(*i)
                && self.points[i - after..*i].iter().filter(|p| p.swings()).count() > after / 2
        };
        let first = (run.first + SWUNG * POINTS_PER_CYCLE..run.last).find(is_before_push)?;
        (first..run.last).take_while(is_before_push).last()
    }

    /// The end of the free motion that `run` belongs to: where it dies out, is stopped, or the record ends.
    pub(super) fn end(&self, run: Run, flags: &mut Vec<Flag>) -> Ending {
        let end_point = self.points[run.last];
        let reaches_end = run.last + 1 == self.points.len();
        let (natural_s, end) = match reaches_end {
            true => (self.end_s, End::Record),
            false => (end_point.time_s, End::DiedOut),
        };
        let natural = Ending { to_s: natural_s, end, smooth_to_s: natural_s };
        let [first, before, within] = [2, 1, 0].map(|cycles| self.fall(run, cycles));
        // Two cycles clear of what made the amplitude change, continued to the end.
        let pushed = self.push(run).filter(|_| self.is_clear(run));
        let core_to = if let Some(pushed) = pushed {
            self.points[pushed].time_s - 0.75 * self.period
        } else if within[0] >= STOPPED_RATIO * within[1] {
            end_point.time_s - 1.75 * self.period
        } else {
            return natural;
        };
        let core = self.means.between(core_to - 2.0 * self.period, core_to);
        let Some(mode) = self.mode_of(&core).map(FreeMotion::one) else { return natural };
        let after = self.means.between(core_to, natural_s);
        let Some(k) = self.misfits(&after, &mode).next() else { return natural };
        let smooth_to_s = after.time_s[k.saturating_sub(1)] - self.means.step_s;
        let [first, before, last] = [first, before, within].map(|[from, to]| from - to);
        // As it has become smaller from cycle to cycle, so it goes on.
        let expected = before * (before / first).clamp(0.0, 1.0);
        if pushed.is_none() && last < FALLS_FASTER * expected {
            return Ending { smooth_to_s, ..natural };
        }
        flags.push(Flag::StoppedEarly);
        Ending { to_s: smooth_to_s, end: End::Stopped, smooth_to_s }
    }

    /// The largest and the last amplitude of a cycle, so many before the last one of `run`.
    fn fall(&self, run: Run, cycles: usize) -> [f64; 2] {
        let before = |i: usize| i.saturating_sub(POINTS_PER_CYCLE).max(run.first);
        let last = (0..cycles).fold(run.last, |i, _| before(i));
        let amplitude = |i: usize| self.points[i].amplitude_deg;
        [(before(last)..=last).map(amplitude).fold(0.0, f64::max), amplitude(last)]
    }
}

#[cfg(test)]
mod tests {
    use crate::identify::flag::Flag;
    use crate::identify::{prepare, Begin, End, Settings};
    use crate::record::Record;
    use std::f64::consts::TAU;

    const STEP_S: f64 = 0.01;
    const WN_RAD_S: f64 = 6.0;

    /// `before`, then a free decay of so many cycles from 30 deg, then `after`, with some noise.
    fn record(before: &[f64], cycles: f64, after: impl Fn(f64, f64) -> Option<f64>) -> Record {
        let free = (cycles * TAU / WN_RAD_S / STEP_S) as usize;
        let swing = |t: f64| 30.0 * (-0.03 * WN_RAD_S * t).exp() * (WN_RAD_S * t).cos();
        let mut yaw_deg = before.to_vec();
        yaw_deg.extend((0..free).map(|k| swing(k as f64 * STEP_S)));
        let last = *yaw_deg.last().expect("a swing");
        yaw_deg.extend((0..).map_while(|k| after(last, f64::from(k) * STEP_S)));
        for (k, yaw) in yaw_deg.iter_mut().enumerate() {
            *yaw += 0.05 * (k as f64 * 12.9898).sin();
        }
        let time_s = (0..yaw_deg.len()).map(|k| k as f64 * STEP_S).collect();
        Record::new("r", time_s, yaw_deg)
    }

    fn settings() -> Settings {
        Settings { from_deg: 360.0, to_deg: 1e-3, ..Settings::default() }
    }

    #[test]
    fn a_model_turned_by_hand_and_held_for_cycles_is_released_where_it_is_let_go() {
        let mut by_hand = vec![0.0; 100];
        by_hand.extend((0..80).map(|k| f64::from(k) * 0.4));
        by_hand.extend((0..260).map(|k| 32.0 - 2.0 * f64::from(k) / 260.0));
        let released_s = by_hand.len() as f64 * STEP_S;
        let record = record(&by_hand, 14.0, |_, _| None);
        let found = prepare(&record, &settings()).expect("a free decay").span.release_time_s;
        assert!((found - released_s).abs() < 0.05, "{found} for {released_s}");
    }

    /// A fifth of the springs' moment is in a strap that lets go within a third of a cycle: one mode does not hold
    /// the first swing. A hand that takes as long is no release.
    #[test]
    fn a_swing_that_is_no_mode_at_first_is_released_where_its_hold_ends() {
        let held = vec![30.0; 200];
        let strap = |t: f64| 5.0 * (-t / 0.2).exp() * (1.0 - (-t / 0.04).exp());
        let with = |added: &dyn Fn(f64) -> f64| {
            let mut record = record(&held, 12.0, |_, _| None);
            for (t, yaw) in record.time_s.iter().zip(&mut record.yaw_deg) {
                *yaw += if *t > 2.0 { added(*t - 2.0) } else { 0.0 };
            }
            prepare(&record, &settings()).expect("a free decay").span
        };
        let found = with(&strap);
        assert_eq!(found.begin, Begin::Held, "{found:?}");
        assert!((found.release_time_s - 2.0).abs() < 0.05, "{found:?}");
        let mut by_hand = held.clone();
        by_hand.extend((0..40).map(|k| 30.0 + 4.0 * (f64::from(k) / 40.0 * TAU / 2.0).cos() - 4.0));
        let found =
            prepare(&record(&by_hand, 12.0, |_, _| None), &settings()).expect("a free decay").span;
        assert!(found.release_time_s > 2.2, "{found:?}");
    }

    #[test]
    fn what_a_push_brings_after_the_free_decay_is_left_out() {
        // Along with the motion, and against it.
        for size_deg in [15.0, -15.0] {
            let pushed = |last: f64, t: f64| {
                (t < 4.0).then(|| last + size_deg * (8.0 * t).sin() * (3.0 * t).min(1.0))
            };
            let record = record(&[], 12.0, pushed);
            let prepared = prepare(&record, &settings()).expect("a free decay");
            let pushed_s = 12.0 * TAU / WN_RAD_S;
            let to_s = prepared.span.to_s;
            assert!(to_s < pushed_s + 0.2 && to_s > pushed_s - 2.5, "{to_s} for {pushed_s}");
            assert!(prepared.span.flags.contains(&Flag::StoppedEarly), "{:?}", prepared.span.flags);
        }
    }

    /// Dry friction takes as much from each cycle: three times in the last what is left after it, and no more
    /// than before.
    #[test]
    fn dry_friction_ends_a_free_decay_by_itself_and_a_hand_does_not() {
        let released = |cycle_deg: f64, zeta: f64, stopped_s: f64| -> Record {
            let time_s: Vec<f64> = (0..2000).map(|k| f64::from(k) * STEP_S).collect();
            let yaw = |t: f64| {
                let amplitude_deg = (30.0 - cycle_deg * t * WN_RAD_S / TAU).max(0.0);
                let amplitude_deg = amplitude_deg * (-zeta * WN_RAD_S * t).exp();
                let noise = 0.05 * (t * 1298.98).sin();
                noise + if t < stopped_s { amplitude_deg * (WN_RAD_S * t).cos() } else { 0.0 }
            };
            let yaw_deg = time_s.iter().map(|t| yaw(*t)).collect();
            Record::new("r", time_s, yaw_deg)
        };
        let ends = |record: &Record| prepare(record, &settings()).expect("a free decay").span;
        let span = ends(&released(5.0, 0.0, f64::INFINITY));
        let at_rest_s = 6.0 * TAU / WN_RAD_S;
        assert_eq!((span.end, span.flags), (End::DiedOut, vec![]));
        assert!((span.to_s - at_rest_s).abs() < 0.5 * TAU / WN_RAD_S, "{}", span.to_s);
        assert!(span.smooth_to_s < at_rest_s - 0.5 * TAU / WN_RAD_S, "{}", span.smooth_to_s);
        // A hand at any damping.
        for (cycle_deg, zeta, cycles) in [(2.0, 0.0, 6.0), (0.0, 0.06, 4.0), (0.0, 0.1, 4.0)] {
            let span = ends(&released(cycle_deg, zeta, cycles * TAU / WN_RAD_S));
            assert_eq!(span.end, End::Stopped, "{zeta}");
            assert!(span.flags.contains(&Flag::StoppedEarly), "{zeta}: {:?}", span.flags);
        }
    }

    #[test]
    fn beats_and_what_grows_by_itself_are_whole() {
        let time_s: Vec<f64> = (0..3000).map(|k| f64::from(k) * STEP_S).collect();
        let beats = |t: f64| (-0.02 * t).exp() * (20.0 * (6.0 * t).cos() + 14.0 * (6.9 * t).cos());
        let grows = |t: f64| 0.5 * (0.1 * t).exp() * (6.0 * t).cos();
        for motion in [&beats as &dyn Fn(f64) -> f64, &grows] {
            let yaw_deg = time_s.iter().map(|t| motion(*t)).collect();
            let record = Record::new("r", time_s.clone(), yaw_deg);
            let span = prepare(&record, &settings()).expect("a free decay").span;
            assert!(span.from_s < 1.1 && span.to_s > 29.0, "{} to {}", span.from_s, span.to_s);
        }
    }
}
