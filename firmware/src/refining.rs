//! The refined estimate of a release: its record while it swings, the fit after it, a piece at a time.

use crate::decimated::Decimated;
use crate::reference::Reference;
use crate::refine::{Fit, Minimum, Progress, FEWEST_POINTS};
use crate::residual::Residual;
use yawrig_shared::history::{History, BLOCK};
use yawrig_shared::modal::Modal;
use yawrig_shared::network::Estimate;
use yawrig_shared::window::SAMPLE_RATE_HZ;
use yawrig_shared::wire::{Condition, Flags, Measured, Precise, Refined};

/// What the fit is for.
#[derive(Clone, Copy, Debug)]
struct Release {
    number: u32,
    flags: Flags,
    condition: Option<Condition>,
}

/// What is going on.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)] // no heap to put the fit on
enum Stage {
    /// Nothing is recorded.
    Idle,
    /// The next block is the one that begins with this sample.
    Recording {
        next: u32,
    },
    Fitting(Release, Fit),
    Judging(Release, Minimum, Residual),
}

/// Records a release and refines the network's estimate of it.
#[derive(Debug)]
pub struct Refining {
    record: Decimated,
    stage: Stage,
    /// The last refined wind-off result.
    reference: Reference,
}

impl Refining {
    pub const fn new() -> Self {
        Self { record: Decimated::new(), stage: Stage::Idle, reference: Reference::new() }
    }

    pub fn is_recording(&self) -> bool {
        matches!(self.stage, Stage::Recording { .. })
    }

    /// Whether there is work to do.
    pub fn is_busy(&self) -> bool {
        matches!(self.stage, Stage::Fitting(..) | Stage::Judging(..))
    }

    /// A swing worth recording began at this sample. While the one before is being refined the buffer is not free.
    pub fn begin(&mut self, from_sample: u32, amplitude_deg: f32, midline_deg: f32) {
        if self.is_busy() {
            return;
        }
        // Blocks keep their place when the clock wraps around.
        let first = from_sample.wrapping_add(BLOCK as u32 - 1) & !(BLOCK as u32 - 1);
        self.record.begin(first, amplitude_deg, midline_deg);
        self.stage = Stage::Recording { next: first };
    }

    /// What was recorded is spoilt.
    pub fn abandon(&mut self) {
        if self.is_recording() {
            self.stage = Stage::Idle;
        }
    }

    /// Takes the blocks that are complete.
    pub fn follow<S: Copy + Default + Into<f32>>(&mut self, history: &History<S>) {
        let Stage::Recording { next } = &mut self.stage else { return };
        while history.next_index().wrapping_sub(*next) as i32 >= BLOCK as i32 {
            self.record.block(history, *next);
            *next = next.wrapping_add(BLOCK as u32);
        }
    }

    /// The network has seen how long a cycle is.
    pub fn set_cycle(&mut self, samples: f32) {
        self.record.set_cycle(samples);
    }

    /// The release is over: begins to refine the network's estimate from the samples before `end`.
    pub fn finish(
        &mut self,
        number: u32,
        flags: Flags,
        estimate: Option<Estimate>,
        condition: Option<Condition>,
        end: u32,
    ) {
        if !self.is_recording() {
            return;
        }
        self.stage = Stage::Idle;
        let Some(estimate) = estimate else { return };
        self.record.end_before(end);
        let count = self.record.points().len();
        let per_point = self.seconds_per_point();
        let decay = f64::from(estimate.damping_ratio * estimate.natural_frequency_rad_s);
        let frequency = f64::from(estimate.natural_frequency_rad_s);
        // A network far from its range may say anything.
        if count >= FEWEST_POINTS && frequency > 0.0 && decay.abs() < frequency {
            let fit = Fit::new(count, decay * per_point, frequency * per_point);
            self.stage = Stage::Fitting(Release { number, flags, condition }, fit);
        }
    }

    fn seconds_per_point(&self) -> f64 {
        f64::from(self.record.samples_per_point()) / f64::from(SAMPLE_RATE_HZ)
    }

    /// Goes on by one piece; the result where it is complete.
    #[inline(never)]
    pub fn work(&mut self) -> Option<Refined> {
        let points = self.record.points();
        match &mut self.stage {
            Stage::Idle | Stage::Recording { .. } => None,
            Stage::Fitting(release, fit) => match fit.work(points) {
                Progress::Going => None,
                Progress::Done(minimum) => {
                    let residual = Residual::new(&minimum.parameters, points.len());
                    self.stage = Stage::Judging(*release, minimum, residual);
                    None
                }
                Progress::Failed => {
                    let release = *release;
                    self.stage = Stage::Idle;
                    let mut refined = self.empty(&release);
                    refined.flags.set(Flags::NOT_REFINED);
                    Some(refined)
                }
            },
            Stage::Judging(release, minimum, residual) => {
                if !residual.work(points) {
                    return None;
                }
                let (release, minimum, residual) = (*release, *minimum, residual.clone());
                self.stage = Stage::Idle;
                Some(self.result(&release, &minimum, &residual))
            }
        }
    }

    fn empty(&self, release: &Release) -> Refined {
        Refined {
            release: release.number,
            from_sample: self.record.from_sample(),
            samples: self.record.points().len() as u32 * self.record.samples_per_point(),
            flags: release.flags,
            ..Refined::default()
        }
    }

    #[inline(never)]
    fn result(&mut self, release: &Release, minimum: &Minimum, residual: &Residual) -> Refined {
        let seconds = self.seconds_per_point();
        let unit_deg = self.record.unit_deg();
        let p = &minimum.parameters;
        let turn = p.frequency as f32 / self.record.samples_per_point() as f32;
        let noise_deg2 = self.record.noise_variance(turn);
        let per_point = noise_deg2 / self.record.samples_per_point() as f32;
        let judged = residual.judged(per_point / (unit_deg * unit_deg));
        // wn^2 = w^2 + s^2, zeta = s / wn; and how they change with s and w.
        let (s, w) = (p.decay / seconds, p.frequency / seconds);
        let wn = libm::sqrt(w * w + s * s);
        let zeta = s / wn;
        let (cos, sin) = (w / wn, zeta);
        let [ss, sw, ww] = minimum.covariance.map(|c| c * f64::from(judged.colour));
        let along = |by_s: f64, by_w: f64| {
            let variance = by_s * by_s * ss + 2.0 * by_s * by_w * sw + by_w * by_w * ww;
            libm::sqrtf(variance as f32)
        };
        let wn_u = along(sin, cos) / seconds as f32;
        let zeta_u = along(cos * cos, -sin * cos) / (wn * seconds) as f32;
        let mut refined = Refined {
            natural_frequency_rad_s: Precise { value: wn, u: wn_u },
            damping_ratio: Measured { value: zeta as f32, u: zeta_u },
            noise_rms_deg: libm::sqrtf(noise_deg2),
            residual_over_noise: judged.over_noise,
            ..self.empty(release)
        };
        let modal = Modal { natural_frequency_rad_s: wn, damping_ratio: zeta };
        refined.derivatives = self.reference.derivatives(&modal, release.condition.as_ref());
        if judged.misfit {
            refined.flags.set(Flags::MISFIT);
        }
        refined
    }
}
