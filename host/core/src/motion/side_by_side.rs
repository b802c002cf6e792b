//! Motions of the same effects that hardly differ, four at a time: a step of one motion waits for its last,
//! those of four side by side need not wait for each other.

use crate::effects::{Moments, States, LANES};
use crate::motion::oscillator::{Grid, Motion, Walk};
use crate::motion::pace::{Pace, Steps};
use crate::motion::piece::Piece;
use crate::motion::simulate::{substeps, Walker};
use crate::par_map::ParMap;
use crate::record::Derivative;
use std::array::from_fn;

type Lanes = [f64; LANES];

/// The readings of all `motions`, which hardly differ from the first, on one `grid`.
pub(crate) fn readings_of_all(motions: &[Motion], grid: &Grid) -> Vec<Vec<f64>> {
    if motions.iter().any(|m| m.terms.adapts_steps()) {
        let Some((first, others)) = motions.split_first() else { return Vec::new() };
        let mut steps = Steps::default();
        let mut readings = vec![first.run(grid, Pace::Kept(&mut steps), |_| {})];
        let followed = |motion: &Motion| motion.run(grid, Pace::followed(&steps), |_| {});
        readings.extend(others.iter().par_map(followed).collect::<Vec<_>>());
        return readings;
    }
    let each = |motions: &[Motion]| -> Vec<Vec<f64>> {
        let several = motions.len() > 1;
        match several.then(|| Four::new(motions, grid)).flatten() {
            Some(mut four) => four.readings(grid).into_iter().take(motions.len()).collect(),
            None => motions.iter().map(|motion| motion.readings(grid)).collect(),
        }
    };
    motions.chunks(LANES).par_map(each).flatten().collect()
}

/// Four motions that are followed as one.
struct Four<'a> {
    motions: [&'a Motion; LANES],
    /// Each alone: what flows, and what dry friction does where it turns.
    walkers: [Walker<'a>; LANES],
    /// Of the rate where there is dry friction, 0: stuck; else no number.
    direction: Lanes,
    moments: Moments,
    flow: [Lanes; 4],
    stiffness: Lanes,
    /// Where each is in balance, dry friction in its direction with it.
    middle: Lanes,
    substeps: f64,
    step_s: f64,
}

impl<'a> Four<'a> {
    /// `None` where the motions have not the same effects, or other corners than those of friction. Where
    /// they are fewer than four, the last stands in for the rest.
    fn new(motions: &'a [Motion], grid: &Grid) -> Option<Self> {
        let motions: [&Motion; LANES] = from_fn(|l| &motions[l.min(motions.len() - 1)]);
        if !motions.iter().all(|m| m.terms.is_smooth_between_turns()) {
            return None;
        }
        let moments = Moments::new(motions.map(|m| &m.terms))?;
        let fastest = motions.iter().map(|m| m.natural_frequency_rad_s).fold(0.0, f64::max);
        let substeps = substeps(grid, fastest);
        let step_s = grid.step_s / substeps;
        let walkers = motions.map(|m| Walker::new(m, 0.5 * step_s, grid.start_s, None));
        let mut four = Self {
            direction: [f64::NAN; LANES],
            flow: from_fn(|i| from_fn(|l| walkers[l].flow.0[i])),
            stiffness: from_fn(|l| walkers[l].stiffness),
            middle: [0.0; LANES],
            motions,
            walkers,
            moments,
            substeps,
            step_s,
        };
        (0..LANES).for_each(|l| four.take_direction(l));
        Some(four)
    }

    /// From the motion followed alone.
    fn take_direction(&mut self, l: usize) {
        let Walker { friction, piece: Piece { direction, .. }, turns, .. } = self.walkers[l];
        let constant = self.motions[l].terms.constant_moment_rad_s2;
        self.middle[l] = (constant - friction * direction) / self.stiffness[l];
        self.direction[l] = if turns { direction } else { f64::NAN };
    }

    /// Those that stick, or whose rate is against its direction.
    #[inline]
    fn turned(&self, r: &Lanes) -> [bool; LANES] {
        from_fn(|l| (self.direction[l] == 0.0) | (r[l] * self.direction[l] < 0.0))
    }

    /// As [`Motion::readings`] of each.
    fn readings(&mut self, grid: &Grid) -> [Vec<f64>; LANES] {
        let h = self.step_s;
        let mut out = [const { Vec::new() }; LANES];
        let mut drives = self.motions.map(|m| m.terms.drive(grid.start_s + 0.5 * h, h));
        let driven = self.motions.iter().any(|m| m.terms.is_driven());
        let mut b = self.motions.map(|m| m.yaw_rad);
        let mut r = self.motions.map(|m| m.rate_rad_s);
        let observed = self.motions[0].terms.observed;
        let mut last = r;
        for k in 0..grid.count {
            let t = grid.time_s(k);
            let seen = match observed {
                Derivative::None => b,
                Derivative::Rate => r,
                Derivative::Acceleration => {
                    from_fn(|l| self.walkers[l].acceleration(b[l], r[l], t))
                }
            };
            out.iter_mut().zip(seen).for_each(|(out, seen)| out.push(seen));
            last = r;
            for i in 0..self.substeps as usize {
                let middle_s = t + (i as f64 + 0.5) * h;
                let drive = match driven {
                    true => from_fn(|l| drives[l].step()),
                    false => [0.0; LANES],
                };
                let (before, rate) = (b, r);
                self.half_step(&mut b, &mut r);
                self.kick(&b, &mut r, middle_s, &drive);
                self.half_step(&mut b, &mut r);
                let turned = self.turned(&r);
                if turned != [false; LANES] {
                    for l in (0..LANES).filter(|l| turned[*l]) {
                        let walker = &mut self.walkers[l];
                        (b[l], r[l]) = walker.with_corners(before[l], rate[l], middle_s, drive[l]);
                        self.take_direction(l);
                    }
                }
            }
        }
        // What has run away is no number, as where one motion is followed.
        for ((motion, last), out) in self.motions.iter().zip(last).zip(&mut out) {
            motion.read(grid, out, [motion.rate_rad_s, last]);
            let runaway = observed.recorded(motion.runaway_rad(), motion.natural_frequency_rad_s);
            if let Some(first) = out.iter().position(|y| !y.is_finite() || y.abs() > runaway) {
                out[first..].fill(f64::NAN);
            }
        }
        out
    }

    #[inline]
    fn half_step(&self, b: &mut Lanes, r: &mut Lanes) {
        let [p, q, u, v] = &self.flow;
        for l in 0..LANES {
            let (x, rate) = (b[l] - self.middle[l], r[l]);
            b[l] = self.middle[l] + p[l] * x + q[l] * rate;
            r[l] = u[l] * x + v[l] * rate;
        }
    }

    #[inline]
    fn kick(&self, b: &Lanes, r: &mut Lanes, time_s: f64, drive: &Lanes) {
        let h = self.step_s;
        let spring = from_fn(|l| -self.stiffness[l] * b[l]);
        let mut states =
            States { yaw_rad: *b, rate_rad_s: *r, time_s, spring_moment_rad_s2: spring };
        let mut first = [0.0; LANES];
        self.moments.add(&states, &mut first);
        for l in 0..LANES {
            states.rate_rad_s[l] = r[l] + 0.5 * h * (first[l] + drive[l]);
        }
        let mut second = [0.0; LANES];
        self.moments.add(&states, &mut second);
        for l in 0..LANES {
            r[l] += h * (second[l] + drive[l]);
        }
    }
}
