//! From a sensor's readings, at any rate from 100 Hz to 4 kHz, to the device's samples, a thousand a second.
//!
//! Of a faster sensor's readings the mean is a sample; between those of a slower one samples lie on straight
//! lines. Either leaves a damped sinusoid what it is but for one constant, which amplitude and phase take up,
//! and on straight lines a remainder about the sensor's own rate. What is rounded off a sample goes to the
//! next.

use crate::device::Device;
use crate::sensor::{ratio, About, Sensor, FINE_BITS};
use embedded_storage::nor_flash::NorFlash;
use yawrig_shared::wire::Flags;

/// A reading without an angle, as the device knows it: at the end of the scale.
const NO_ANGLE: u16 = 0;
const HALF: i32 = 1 << (FINE_BITS - 1);

/// A sensor on its way to the device.
#[derive(Clone, Debug)]
pub struct Input<S> {
    sensor: S,
    together: u32,
    spread: u32,
    /// Of the sample that is coming: the sum of its readings, how many, and what was the matter.
    sum: i32,
    taken: u32,
    lost: bool,
    blind: bool,
    flags: Flags,
    /// The last reading, where samples lie between it and the next.
    last: Option<i32>,
    rounded_off: i32,
}

impl<S: Sensor> Input<S> {
    /// Of this sensor.
    ///
    /// # Panics
    /// Where its rate is none of [`ratio`].
    pub fn new(sensor: S) -> Self {
        let (together, spread) = ratio(sensor.about().sensor.rate_hz).expect("one of the rates");
        Self {
            sensor,
            together,
            spread,
            sum: 0,
            taken: 0,
            lost: false,
            blind: false,
            flags: Flags::default(),
            last: None,
            rounded_off: HALF,
        }
    }

    /// The sensor.
    pub fn sensor(&self) -> &S {
        &self.sensor
    }

    /// What it is, for [`Device::set_sensor`].
    pub fn about(&self) -> About {
        let mut about = self.sensor.about();
        // Of those that make a sample the mean is early, and a line's other end has to be waited for.
        let period_us = 1_000_000 / u32::from(about.sensor.rate_hz);
        let late_us = if self.spread > 1 { period_us } else { period_us * (self.together - 1) / 2 };
        about.sensor.delay_us = about.sensor.delay_us.saturating_add(late_us as u16);
        about
    }

    /// The next reading, at the sensor's rate; none: it was lost.
    #[inline]
    pub fn take<F: NorFlash, const LOCKABLE: bool>(
        &mut self,
        raw: Option<S::Raw>,
        device: &mut Device<F, LOCKABLE>,
    ) {
        match raw.map(|raw| self.sensor.reading(raw)) {
            None => self.lost = true,
            Some(reading) => {
                self.flags.set(reading.flags);
                match reading.fine {
                    Some(fine) => self.sum += fine,
                    None => self.blind = true,
                }
            }
        }
        self.taken += 1;
        if self.taken == self.together {
            self.give(device);
        }
    }

    fn give<F: NorFlash, const LOCKABLE: bool>(&mut self, device: &mut Device<F, LOCKABLE>) {
        let fine = self.sum / self.together as i32;
        let flags = self.flags;
        let (lost, blind) = (self.lost, self.blind);
        (self.sum, self.taken, self.flags) = (0, 0, Flags::default());
        (self.lost, self.blind) = (false, false);
        if lost {
            self.last = None;
            device.lost(self.spread);
            return;
        }
        if blind {
            self.last = None;
            for _ in 0..self.spread {
                device.flagged(NO_ANGLE, flags);
                device.work();
            }
            return;
        }
        let last = self.last.replace(fine).unwrap_or(fine);
        for k in 1..=self.spread as i32 {
            let exact =
                if self.spread == 1 { fine } else { last + (fine - last) * k / self.spread as i32 };
            let with_rest = exact + self.rounded_off;
            let counts = (with_rest >> FINE_BITS).clamp(0, i32::from(u16::MAX));
            self.rounded_off = with_rest & ((1 << FINE_BITS) - 1);
            device.flagged(counts as u16, flags);
            device.work();
        }
    }
}
