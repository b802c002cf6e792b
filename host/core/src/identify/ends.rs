//! The end of a free motion: stopped, pushed, or died out.

use super::damped_sinusoid::Mode;
use super::envelope::POINTS_PER_CYCLE;
use super::flag::Flag;
use super::free_motion::FreeMotion;
use super::least_squares;
use super::release::{Ending, Run, Search};
use super::samples::Stretch;
use super::End;
use std::f64::consts::TAU;

/// Misfit of the free decay continued backwards beyond which the model was still held, as a share of its
/// amplitude and in noise.
pub(super) const MISFIT_SHARE: f64 = 0.12;
pub(super) const MISFIT_NOISE: f64 = 6.0;
/// Amplitude over noise beyond which a hand, a push and a swing are distinguished from a wandering zero.
pub(super) const CLEAR_SWING: f64 = 20.0;
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
/// Cycles that the model has swung before it can have been pushed again: what wanders is no swing.
const SWUNG: usize = 3;

impl Search<'_> {
    /// Whether a hand, a push and a swing can be distinguished: far above the noise.
    pub(super) fn is_clear(&self, run: Run) -> bool {
        let amplitudes = (run.first..=run.last).map(|i| self.points[i].amplitude_deg);
        amplitudes.fold(0.0, f64::max) > CLEAR_SWING * self.noise
    }

    pub(super) fn mode_of(&self, stretch: &Stretch<'_>) -> Option<Mode> {
        least_squares::fit_mode(stretch, TAU / self.period).map(|found| found.mode)
    }

    /// Indices in `stretch` from which on two neighbours lie off the continued motion.
    pub(super) fn misfits<'b>(
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

    /// The last point from which the amplitude is still seen to fall before it is pushed up.
    pub(super) fn push(&self, run: Run) -> Option<usize> {
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
        let reaches_end = run.last + 1 == self.points.len();
        let (natural_s, end) = match reaches_end {
            true => (self.end_s, End::Record),
            false => (self.points[run.last].time_s, End::DiedOut),
        };
        let natural = Ending { to_s: natural_s, end, smooth_to_s: natural_s };
        // Two cycles clear of what made the amplitude change, continued to the end.
        let pushed = self.push(run).filter(|_| self.is_clear(run));
        let slowed = if pushed.is_none() { self.stop(run) } else { None };
        let stopped = slowed.unwrap_or(run);
        let [within, amplitude] = self.fall(stopped, 0);
        let core_to = if let Some(pushed) = pushed {
            self.points[pushed].time_s - 0.75 * self.period
        } else if within >= STOPPED_RATIO * amplitude {
            self.points[stopped.last].time_s - 1.75 * self.period
        } else {
            return natural;
        };
        let core = self.means.between(core_to - 2.0 * self.period, core_to);
        let Some(mode) = self.mode_of(&core).map(FreeMotion::one) else { return natural };
        let after = self.means.between(core_to, natural_s);
        let Some(k) = self.misfits(&after, &mode).next() else { return natural };
        let smooth_to_s = after.time_s[k.saturating_sub(1)] - self.means.step_s;
        if pushed.is_none() && !self.falls_faster(stopped) {
            return Ending { smooth_to_s, ..natural };
        }
        flags.push(Flag::StoppedEarly);
        // What slows a swing is seen half a cycle after it has touched; what catches it, and a push, at once.
        let unseen_s = if slowed.is_some() { 0.5 * self.period } else { 0.0 };
        Ending { to_s: smooth_to_s - unseen_s, end: End::Stopped, smooth_to_s }
    }

    /// `run` up to where a hand took the most of its amplitude within a cycle, if it swings on with what is left.
    /// What is caught has swung within a cycle for the last time.
    fn stop(&self, run: Run) -> Option<Run> {
        let amplitude = |i: usize| self.points[i].amplitude_deg;
        let first = self.largest(run.first, run.last);
        let [cycle, before] = [1, 1 + SWUNG].map(|cycles| cycles * POINTS_PER_CYCLE);
        let clear = (first + before..run.last.saturating_sub(cycle))
            .take_while(|i| amplitude(i - cycle) > CLEAR_SWING * self.noise);
        let is_stopped = |stopped: &Run| {
            let [within, left] = self.fall(*stopped, 0);
            // By more than in the three cycles before it: other modes make a fall uneven.
            let had = amplitude(stopped.last - before) / amplitude(stopped.last - cycle);
            within >= STOPPED_RATIO.max(had) * left && self.falls_faster(*stopped)
        };
        let stopped = clear.map(|last| Run { first, last }).find(is_stopped)?;
        // A beat comes back.
        let most = PUSHED_RATIO * amplitude(stopped.last);
        (stopped.last..=run.last).all(|i| amplitude(i) < most).then_some(stopped)
    }

    /// Whether the last cycle of `run` takes more than damping and dry friction would.
    fn falls_faster(&self, run: Run) -> bool {
        let [first, before, last] = [2, 1, 0].map(|cycles| {
            let [from, to] = self.fall(run, cycles);
            from - to
        });
        // As it has become smaller from cycle to cycle, so it goes on.
        let shrinks = if first > 0.0 { (before / first).clamp(0.0, 1.0) } else { 0.0 };
        last >= FALLS_FASTER * before * shrinks
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
    fn a_hand_that_leaves_some_of_the_swing_ends_the_free_decay() {
        for left in [0.05, 0.2, 0.3] {
            let time_s: Vec<f64> = (0..3000).map(|k| f64::from(k) * STEP_S).collect();
            let braked_s = 9.0 * TAU / WN_RAD_S;
            let yaw = |t: f64| {
                let braked = ((t - braked_s) * WN_RAD_S / TAU / 0.8).clamp(0.0, 1.0);
                let amplitude_deg = 30.0 * (-0.06 * t).exp() * (1.0 - (1.0 - left) * braked);
                0.02 * (t * 1298.98).sin() + amplitude_deg * (WN_RAD_S * t).cos()
            };
            let record = Record::new("r", time_s.clone(), time_s.iter().map(|t| yaw(*t)).collect());
            let span = prepare(&record, &settings()).expect("a free decay").span;
            assert_eq!(span.end, End::Stopped, "{left}");
            let off = (span.to_s - braked_s) * WN_RAD_S / TAU;
            assert!(off.abs() < 0.6, "{left}: {off} cycles");
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
