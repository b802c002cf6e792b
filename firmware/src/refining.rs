//! The refined estimate of a release: its record while it swings, the fit after it, a piece at a time.

use crate::decimated::Decimated;
use crate::reference::{Known, Reference};
use crate::refine::{Fit, Progress, MIN_POINTS};
use crate::residual::Residual;
use yawrig_shared::history::{History, BLOCK};
use yawrig_shared::modal::Modal;
use yawrig_shared::network::Estimate;
use yawrig_shared::window::{CYCLES, SAMPLE_RATE_HZ};
use yawrig_shared::wire::{Condition, Flags, Measured, Precise, Refined};

/// Blocks recorded with one sample at most.
const AT_ONCE: u32 = 4;

/// Beyond so many standard uncertainties windows and refined estimate contradict each other.
const CONTRADICTED: f32 = 4.0;

/// What the fit is for.
#[derive(Clone, Copy, Debug)]
pub struct Release {
    pub number: u32,
    pub flags: Flags,
    pub condition: Option<Condition>,
    pub clock_u: f32,
    /// What its windows say, with the network's own error in the uncertainty.
    pub windows: Option<[Measured; 2]>,
}

impl Release {
    const NONE: Self =
        Self { number: 0, flags: Flags(0), condition: None, clock_u: 0.0, windows: None };
}

/// What is going on.
#[derive(Clone, Copy, Debug)]
enum Stage {
    /// Nothing is recorded.
    Idle,
    /// The next block is the one that begins with this sample.
    Recording {
        next: u32,
    },
    Fitting,
    Judging,
}

/// Records a release and refines the network's estimate of it.
#[derive(Debug)]
pub struct Refining {
    record: Decimated,
    stage: Stage,
    /// Amplitude at its beginning, and the sample from which on it is of no use, if there is one.
    begun_deg: f32,
    useless_from: Option<u32>,
    /// What was before this sample was above the range.
    above_until: u32,
    // Of the last two stages; beside the stage and not in it, so that the device is made where it stays.
    release: Release,
    fit: Fit,
    residual: Residual,
    /// Of the sensor.
    step_deg: f32,
    /// What its table's uncertainty does to a damping ratio, relative.
    table_u: f32,
    /// The last refined wind-off result.
    reference: Reference,
}

impl Default for Refining {
    fn default() -> Self {
        Self::new()
    }
}

impl Refining {
    #[inline(always)]
    pub const fn new() -> Self {
        Self {
            record: Decimated::new(),
            stage: Stage::Idle,
            begun_deg: 0.0,
            useless_from: None,
            above_until: 0,
            release: Release::NONE,
            fit: Fit::NONE,
            residual: Residual::NONE,
            step_deg: 0.0,
            table_u: 0.0,
            reference: Reference::new(),
        }
    }

    /// Readings of the sensor come so many samples from one another, and are steps apart that no noise blurs.
    pub fn set_readings(&mut self, spread: u32, step_deg: f32) {
        self.record.set_spread(spread);
        self.step_deg = step_deg;
    }

    /// Samples are corrected by a table that leaves damping ratios uncertain by this, relative.
    pub fn set_table(&mut self, damping_u: f32) {
        self.table_u = damping_u;
    }

    pub fn is_recording(&self) -> bool {
        matches!(self.stage, Stage::Recording { .. })
    }

    /// Whether there is work to do.
    pub fn is_busy(&self) -> bool {
        matches!(self.stage, Stage::Fitting | Stage::Judging)
    }

    /// What is recorded began within the range.
    pub fn is_confirmed(&self) -> bool {
        self.is_recording() && self.begun_deg > 0.0
    }

    /// What is recorded is above the range still: as it leaves this sample it may come into it.
    pub fn is_above(&mut self, until: u32) {
        self.above_until = until;
    }

    /// Since it was above it is within the range, with this amplitude: the record begins there. False where
    /// it has to be begun anew, as so much has come from above the range that there is no room.
    #[must_use]
    pub fn confirm(&mut self, amplitude_deg: f32) -> bool {
        let begins = self.record.begin_after(self.above_until);
        if begins {
            self.begun_deg = amplitude_deg;
        }
        begins
    }

    /// A swing that may be worth recording began before this sample. While the one before is being refined
    /// the buffer is not free.
    pub fn begin(&mut self, from_sample: u32, least_deg: f32, near_deg: f32) {
        if self.is_busy() {
            return;
        }
        // Blocks keep their place when the clock wraps around.
        let first = from_sample.wrapping_add(BLOCK as u32 - 1) & !(BLOCK as u32 - 1);
        self.record.begin(first, least_deg, near_deg);
        self.begun_deg = 0.0;
        self.useless_from = None;
        self.above_until = first;
        self.stage = Stage::Recording { next: first };
    }

    /// The coming releases are made under this condition.
    pub fn mount(&mut self, condition: &Condition) {
        self.reference.mount(condition);
    }

    /// The reference, for a memory that outlives a reset, and from there.
    pub fn kept(&self) -> Reference {
        self.reference
    }

    pub fn recall(&mut self, reference: Reference) {
        self.reference = reference;
    }

    /// The wind-off release that refined results are held against.
    pub fn reference(&self) -> Option<u32> {
        self.reference.release()
    }

    /// What was recorded is spoilt.
    pub fn abandon(&mut self) {
        if self.is_recording() {
            self.stage = Stage::Idle;
        }
    }

    /// From this sample on it is of no use until another is begun. The longer part counts: with half the
    /// amplitude three quarters of what a decay tells have come, and the record ends.
    pub fn interrupt(&mut self, at: u32, amplitude_deg: f32) {
        if self.useless_from.is_some() {
            return;
        }
        if self.is_recording() && amplitude_deg < 0.5 * self.begun_deg {
            self.useless_from = Some(at);
        } else {
            self.abandon();
        }
    }

    /// Takes blocks that are complete; called for each of them, it catches up with those before it by and by.
    pub fn follow<S: Copy + Default + Into<f32>>(&mut self, history: &History<S>) {
        let Stage::Recording { next } = &mut self.stage else { return };
        let end = self.useless_from.unwrap_or(history.next_index());
        for _ in 0..AT_ONCE {
            if (end.wrapping_sub(*next) as i32) < BLOCK as i32 {
                break;
            }
            self.record.block(history, *next);
            *next = next.wrapping_add(BLOCK as u32);
        }
    }

    /// The turning points have shown how long a cycle is.
    pub fn set_cycle(&mut self, samples: f32) {
        self.record.set_cycle(samples);
    }

    /// The release is over: begins to refine what its turning points say from the samples before `end`.
    pub fn finish(&mut self, release: Release, estimate: Option<Estimate>, end: u32) {
        let Release { number, condition, .. } = release;
        // Without a refined result the last wind-off release is no reference; with one it will be.
        let mut unrefined = release.flags;
        unrefined.set(Flags::NOT_REFINED);
        if condition.is_some_and(|condition| condition.wind.speed_m_s == 0.0) {
            self.reference.judge(number, None, &mut unrefined, condition.as_ref());
        }
        if !self.is_recording() {
            return;
        }
        self.stage = Stage::Idle;
        let Some(estimate) = estimate else { return };
        self.record.end_before(self.useless_from.unwrap_or(end));
        // Cut short above the range, before what was asked for: then it is to tell as much as a window does.
        let above = self.begun_deg == 0.0 && release.flags.has(Flags::CUT_SHORT);
        if above && self.record.cycles() < CYCLES as f32 {
            return;
        }
        let count = self.record.points().len();
        let per_point = self.seconds_per_point();
        let Estimate { natural_frequency_rad_s: wn, damping_ratio: zeta, .. } = estimate;
        let decay = f64::from(zeta * wn);
        let frequency = f64::from(wn * libm::sqrtf(1.0 - zeta * zeta));
        if count >= MIN_POINTS && frequency > 0.0 && decay.abs() < frequency {
            self.fit = Fit::new(count, decay * per_point, frequency * per_point);
            self.release = release;
            self.stage = Stage::Fitting;
        }
    }

    fn seconds_per_point(&self) -> f64 {
        f64::from(self.record.samples_per_point()) / f64::from(SAMPLE_RATE_HZ)
    }

    /// Goes on by one piece; the result where it is complete.
    #[inline(never)]
    pub fn work(&mut self) -> Option<Refined> {
        let points = self.record.points();
        match self.stage {
            Stage::Idle | Stage::Recording { .. } => None,
            Stage::Fitting => match self.fit.work(points) {
                Progress::Going => None,
                Progress::Done => {
                    self.residual = Residual::new(self.fit.parameters(), points.len());
                    self.stage = Stage::Judging;
                    None
                }
                Progress::Failed => {
                    self.stage = Stage::Idle;
                    Some(self.not_refined())
                }
            },
            Stage::Judging => {
                if !self.residual.work(points) {
                    return None;
                }
                self.stage = Stage::Idle;
                Some(self.result())
            }
        }
    }

    fn empty(&self) -> Refined {
        Refined {
            release: self.release.number,
            from_sample: self.record.from_sample(),
            samples: self.record.points().len() as u32 * self.record.samples_per_point(),
            flags: self.release.flags.of_record(),
            ..Refined::default()
        }
    }

    fn not_refined(&self) -> Refined {
        let mut refined = self.empty();
        refined.flags.set(Flags::NOT_REFINED);
        refined
    }

    /// Whether the windows' mean is further from these than both are uncertain.
    fn windows_differ(&self, refined: &Refined) -> bool {
        let Refined { natural_frequency_rad_s: wn, damping_ratio, .. } = refined;
        let found = [Measured { value: wn.value as f32, u: wn.u }, *damping_ratio];
        self.release.windows.is_some_and(|windows| {
            windows.iter().zip(&found).any(|(by_windows, found)| {
                let apart = by_windows.value - found.value;
                let variance = by_windows.u * by_windows.u + found.u * found.u;
                apart * apart > CONTRADICTED * CONTRADICTED * variance
            })
        })
    }

    #[inline(never)]
    fn result(&mut self) -> Refined {
        let seconds = self.seconds_per_point();
        let unit_deg = self.record.unit_deg();
        let p = self.fit.parameters();
        let turn = p.frequency as f32 / self.record.samples_per_point() as f32;
        let noise = self.record.noise(turn);
        let per_point = noise.variance_deg2 / self.record.samples_per_point() as f32;
        let per_unit = 1.0 / (unit_deg * unit_deg);
        let steps = self.step_deg * self.step_deg * per_unit / 12.0;
        let judged = self.residual.judged(per_point * per_unit, noise.freedom, steps);
        // wn^2 = w^2 + s^2, zeta = s / wn; and how they change with s and w.
        let (s, w) = (p.decay / seconds, p.frequency / seconds);
        let wn = libm::sqrt(w * w + s * s);
        let zeta = s / wn;
        let (cos, sin) = (w / wn, zeta);
        let [ss, sw, ww] = self.fit.covariance();
        let [by_decay, by_frequency] = judged.missing.map(|more| f64::from(judged.colour + more));
        let (ss, sw, ww) = (by_decay * ss, f64::from(judged.colour) * sw, by_frequency * ww);
        let along = |by_s: f64, by_w: f64| {
            let variance = by_s * by_s * ss + 2.0 * by_s * by_w * sw + by_w * by_w * ww;
            libm::sqrtf(variance as f32)
        };
        let wn_u = along(sin, cos) / seconds as f32;
        let zeta_u = along(cos * cos, -sin * cos) / (wn * seconds) as f32;
        // What a table leaves moves amplitudes against one another, and no turning point in time.
        let by_table = self.table_u * zeta as f32;
        let zeta_u = libm::sqrtf(zeta_u * zeta_u + by_table * by_table);
        let clock_u = self.release.clock_u;
        let by_clock = clock_u * wn as f32;
        let mut refined = Refined {
            natural_frequency_rad_s: Precise {
                value: wn,
                u: libm::sqrtf(wn_u * wn_u + by_clock * by_clock),
            },
            damping_ratio: Measured { value: zeta as f32, u: zeta_u },
            noise_rms_deg: libm::sqrtf(noise.variance_deg2),
            residual_over_noise: judged.over_noise,
            ..self.empty()
        };
        let modal = Modal { natural_frequency_rad_s: wn, damping_ratio: zeta };
        let known = [wn_u, zeta_u, refined.noise_rms_deg, refined.residual_over_noise];
        if !known.iter().all(|known| known.is_finite()) {
            return self.not_refined();
        }
        let differ = self.windows_differ(&refined);
        for (found, flag) in [
            (judged.misfit, Flags::MISFIT),
            (judged.widened, Flags::WIDENED),
            (differ, Flags::WINDOWS_DIFFER),
        ] {
            if found {
                refined.flags.set(flag);
            }
        }
        let known = Known { modal, natural_frequency_u: wn_u, damping_ratio_u: zeta_u, clock_u };
        let mut flags = refined.flags;
        let condition = self.release.condition.as_ref();
        refined.derivatives =
            self.reference.judge(refined.release, Some(known), &mut flags, condition);
        refined.flags = flags;
        refined
    }
}
