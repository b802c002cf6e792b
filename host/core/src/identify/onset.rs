//! The beginning of a free motion: let go from a hold or a hand, or pushed.

use super::ends::{CLEAR_SWING, MISFIT_NOISE, MISFIT_SHARE, PUSHED_RATIO};
use super::envelope::{rises, POINTS_PER_CYCLE};
use super::flag::Flag;
use super::free_motion::{FreeMotion, BEATING_CYCLES};
use super::release::{Run, Search};
use super::samples::Stretch;
use super::Begin;
use crate::record::Derivative;
use crate::solver::linear_fit;
use crate::statistics::median;

/// Cycles of one mode by which it is continued.
const CORE_CYCLES: f64 = 2.0;
/// Left out after a release, in cycles: the catch takes some time to let go.
const GUARD_CYCLES: f64 = 0.02;
/// Cycles in which a rise by this ratio is a hand's or a push.
const PUSHED_CYCLES: usize = 3;
/// Shares of a hold's angle between which the first swing is timed: nearer to the hold noise makes much of a
/// phase, further from it what the swing remembers has begun to pull.
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
    pub(super) fn largest(&self, first: usize, last: usize) -> usize {
        (first..=last)
            .max_by(|&a, &b| self.points[a].amplitude_deg.total_cmp(&self.points[b].amplitude_deg))
            .unwrap_or(first)
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
        let hold = |cycles| {
            let to_s = seen_s - cycles * self.period;
            Some((to_s, self.hold_before(to_s, amplitude_deg)?))
        };
        let (held_s, hold_deg) = [0.5, 0.75, 1.0].into_iter().find_map(hold)?;
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
}
