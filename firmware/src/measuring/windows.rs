//! What becomes of three cycles: an estimate, and whether they are one damped oscillation.

use super::{Context, Measuring};
use yawrig_shared::features::{features, FeatureKind, Features, SHAPE};
use yawrig_shared::history::BLOCK;
use yawrig_shared::misfit::misfit;
use yawrig_shared::network::Estimate;
use yawrig_shared::window::Window;
use yawrig_shared::wire::{Event, Flags, WindowResult};

/// What of a window may be left over by one damped oscillation: this many times the noise, and a share of its
/// rms; beyond the larger share the window does not count.
const NOISE: f32 = 3.0;
const SLIGHTLY: f32 = 0.003;
const BADLY: f32 = 0.075;

#[derive(Clone, Copy, PartialEq)]
enum Disturbed {
    No,
    Slightly,
    Badly,
}

impl Measuring {
    /// Three cycles are complete: the network's estimate goes out at once.
    pub(super) fn window(&mut self, window: &Window, context: &mut Context) {
        let start = window.start.next_sample();
        if self.is_spoilt(start) {
            return;
        }
        let Some(network) = context.network else {
            self.current.flags.set(Flags::NO_NETWORK);
            return;
        };
        let features = features(network.features, self.tracker.history(), window);
        let estimate = network.estimate(&features);
        let disturbed =
            self.disturbed(network.features, window, &features, &estimate, context.second_order);
        if disturbed == Disturbed::Badly {
            self.current.flags.set(Flags::DISTURBED);
            return;
        }
        let mut flags = Flags::default();
        if !network.holds(&estimate) {
            flags.set(Flags::OUT_OF_RANGE);
        }
        if disturbed == Disturbed::Slightly {
            flags.set(Flags::DISTURBED);
            self.current.flags.set(Flags::DISTURBED);
        }
        let number = self.current.windows.count();
        self.current.windows.add(&estimate, features.amplitude_deg, &network.numbers);
        self.current.windows_end = window.end;
        let Estimate { natural_frequency_rad_s, damping_ratio, numbers } =
            self.learning.corrected(&estimate);
        context.line.event(&Event::Window(WindowResult {
            release: self.releases,
            window: number,
            start_sample: start,
            end_sample: window.end,
            sent_sample: self.now().wrapping_sub(1),
            amplitude_deg: features.amplitude_deg,
            midline_deg: self.sampler.yaw_deg(window.midline_deg),
            natural_frequency_rad_s,
            damping_ratio,
            numbers,
            flags,
        }));
    }

    /// Whether a window is one damped oscillation with the noise that the signal has.
    fn disturbed(
        &self,
        kind: FeatureKind,
        window: &Window,
        features: &Features,
        estimate: &Estimate,
        second_order: bool,
    ) -> Disturbed {
        // Samples behind each number of the shape.
        let samples = match kind {
            FeatureKind::BinMeans => window.length / SHAPE as f32,
            FeatureKind::PointSamples => 1.0,
        };
        let noise_deg = self.signal.block_noise_deg() * libm::sqrtf(BLOCK as f32 / samples);
        let rms_deg = features.amplitude_deg * core::f32::consts::FRAC_1_SQRT_2;
        let beyond = misfit(&features.values, estimate.damping_ratio) - NOISE * noise_deg / rms_deg;
        // A network with effects has learnt windows that are bent.
        let allowed = if second_order { SLIGHTLY } else { BADLY };
        // Not a number where the window is none.
        if beyond.is_nan() || beyond > BADLY {
            Disturbed::Badly
        } else if beyond > allowed {
            Disturbed::Slightly
        } else {
            Disturbed::No
        }
    }
}
