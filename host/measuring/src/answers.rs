//! A device's answers to releases, as derivatives are computed from them.

use yawrig_core::derivatives::campaign::ReleaseEntry;
use yawrig_core::derivatives::condition::Identified;
use yawrig_core::quantity::Quantity;
use yawrig_link::follow::{is_refined, precise};
use yawrig_shared::window::SAMPLE_RATE_HZ;
use yawrig_shared::wire::{counting, Measured, Refined, ReleaseResult};

/// What the device says of one release.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    pub result: ReleaseResult,
    pub refined: Option<Refined>,
}

/// Whose estimates are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum By {
    /// The network, as a mean over the windows.
    Network,
    /// The fit to the whole record; the network where there is none.
    Refined,
}

impl Answer {
    /// Whether the device has an estimate to rely on.
    pub fn is_usable(&self) -> bool {
        counting(Some(&self.result), self.refined.as_ref()).is_some()
    }

    /// Whether wind-on releases may be held against this wind-off one: the device's own rule.
    pub fn is_reference(&self) -> bool {
        let by_windows = self.counts_by_windows() && !self.result.flags.unfit_as_reference();
        by_windows || self.is_refined_reference()
    }

    /// Whether its network's estimate is one to rely on.
    pub fn counts_by_windows(&self) -> bool {
        counting(Some(&self.result), None).is_some()
    }

    /// The same of its refined estimate.
    fn is_refined_reference(&self) -> bool {
        let fit = |r: &Refined| is_refined(r) && !r.flags.of_record().unfit_as_reference();
        self.refined.as_ref().is_some_and(fit)
    }

    /// Natural frequency (rad/s) and damping ratio.
    pub fn estimate(&self, by: By) -> [Quantity; 2] {
        let quantity = |m: Measured| Quantity::new(f64::from(m.value), f64::from(m.u));
        match self.refined.filter(|refined| by == By::Refined && is_refined(refined)) {
            Some(r) => [precise(r.natural_frequency_rad_s), quantity(r.damping_ratio)],
            None => [self.result.natural_frequency_rad_s, self.result.damping_ratio].map(quantity),
        }
    }

    fn identified(&self, by: By) -> Identified {
        let seconds = |sample: u32| f64::from(sample) / f64::from(SAMPLE_RATE_HZ);
        let [natural_frequency_rad_s, damping_ratio] = self.estimate(by);
        let [from_s, to_s] = [self.result.release_sample, self.result.finished_sample].map(seconds);
        Identified::new(natural_frequency_rad_s, damping_ratio, from_s, to_s)
    }
}

/// The answers to `releases` for the table, by the device's own rule: an estimate is held against one of its
/// kind. Where a refined estimate of a spring and axis is missing, or a wind-off one is flagged, all of them
/// are the network's, if all of those count.
pub fn identified(releases: &[ReleaseEntry], answers: &[Answer], by: By) -> Vec<Identified> {
    let rig = |release: &ReleaseEntry| (release.spring.clone(), release.axis);
    let all = || releases.iter().zip(answers);
    let of = |(release, answer): (&ReleaseEntry, &Answer)| {
        let of_rig = || all().filter(|(other, _)| rig(other) == rig(release));
        let are_refined = of_rig().all(|(r, a)| match r.wind_speed_m_s {
            0.0 => a.is_refined_reference(),
            _ => a.refined.as_ref().is_some_and(is_refined),
        });
        let by_network = of_rig().all(|(_, a)| a.counts_by_windows());
        answer.identified(if by_network && !are_refined { By::Network } else { by })
    };
    all().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::of_network;
    use yawrig_shared::axis::Axis;
    use yawrig_shared::wire::{Flags, Precise};

    fn answer(flags: Flags) -> Answer {
        let result = of_network(Measured { value: 1.0, u: 0.1 });
        let natural_frequency_rad_s = Precise { value: 2.0, u: 0.01 };
        Answer {
            result,
            refined: Some(Refined { natural_frequency_rad_s, flags, ..Refined::default() }),
        }
    }

    fn frequencies(flags: [Flags; 4]) -> Vec<f64> {
        of(flags.map(answer))
    }

    fn of(answers: [Answer; 4]) -> Vec<f64> {
        let entry = |(spring, wind_speed_m_s): (&str, f64)| {
            ReleaseEntry::new("", (spring, 100.0), Axis::Mid, wind_speed_m_s)
        };
        let releases = [("K1", 0.0), ("K1", 10.0), ("K2", 0.0), ("K2", 10.0)].map(entry);
        let found = identified(&releases, &answers, By::Refined);
        found.iter().map(|found| found.natural_frequency_rad_s.value).collect()
    }

    /// What the device withholds (`firmware/src/reference.rs`) does not come back by the host's table.
    #[test]
    fn refined_estimates_are_held_against_refined_ones_that_the_device_takes_as_reference() {
        let good = Flags(0);
        assert_eq!(frequencies([good; 4]), [2.0; 4]);
        assert_eq!(frequencies([Flags::MISFIT, good, good, good]), [1.0, 1.0, 2.0, 2.0]);
        assert_eq!(frequencies([good, Flags::MISFIT, good, good]), [2.0; 4], "says so itself");
        assert_eq!(frequencies([good, good, good, Flags::NOT_REFINED]), [2.0, 2.0, 1.0, 1.0]);
    }

    #[test]
    fn what_the_network_says_where_it_was_not_trained_is_no_way_out() {
        let [misfit, good] = [Flags::MISFIT, Flags(0)].map(answer);
        let mut outside = good;
        outside.result.flags = Flags::OUT_OF_RANGE;
        assert!(outside.is_usable() && outside.is_reference() && !outside.counts_by_windows());
        assert_eq!(of([misfit, outside, good, good]), [2.0; 4]);
    }
}
