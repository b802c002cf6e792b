//! A device in memory that is asked in frames.

use embedded_storage::nor_flash::NorFlash;
use yawrig_firmware::device::Device;
use yawrig_firmware::slots::MemoryFlash;
use yawrig_shared::wire::{
    encode, Decoder, Event, Phase, Refined, ReleaseResult, Reply, Request, Samples, Status,
    WindowResult, CHUNK, SAMPLES_KEY,
};

/// A device, the number of the last request, and what it has said unasked.
pub struct Desk<F = MemoryFlash> {
    pub device: Device<F>,
    sequence: u16,
    decoder: Decoder,
    pub windows: Vec<WindowResult>,
    pub releases: Vec<ReleaseResult>,
    pub refined: Vec<Refined>,
    pub phases: Vec<Phase>,
    samples: Vec<u16>,
}

impl<F: NorFlash> Desk<F> {
    pub fn new(flash: F) -> Self {
        Self::on("desk", flash)
    }

    /// One of another name.
    pub fn on(board: &'static str, flash: F) -> Self {
        Self {
            device: Device::new(flash, board),
            sequence: 0,
            decoder: Decoder::new(),
            windows: Vec::new(),
            releases: Vec::new(),
            refined: Vec::new(),
            phases: Vec::new(),
            samples: Vec::new(),
        }
    }

    /// Takes what the device has to say; its reply, if one is among it.
    pub fn listen(&mut self) -> Option<Reply> {
        let mut reply = None;
        while let Some(byte) = self.device.transmit() {
            let Some(frame) = self.decoder.push(byte) else { continue };
            let frame = frame.expect("the device sends whole frames");
            if let Some(found) = frame.message::<Reply>() {
                reply = Some(found.expect("a reply"));
                continue;
            }
            if frame.key == SAMPLES_KEY {
                self.samples.extend(Samples::read(frame.body).expect("samples").counts);
                continue;
            }
            match frame.message::<Event>() {
                Some(Ok(Event::Phase { phase, .. })) => self.phases.push(phase),
                Some(Ok(Event::Window(window))) => self.windows.push(window),
                Some(Ok(Event::Release(release))) => self.releases.push(release),
                Some(Ok(Event::Refined(refined))) => self.refined.push(refined),
                _ => {}
            }
        }
        reply
    }

    /// The samples it has sent since this was last asked.
    pub fn streamed(&mut self) -> Vec<u16> {
        self.listen();
        std::mem::take(&mut self.samples)
    }

    pub fn ask(&mut self, request: &Request) -> Reply {
        self.sequence += 1;
        for byte in encode(self.sequence, request).expect("a frame") {
            self.device.receive(byte);
        }
        self.listen().unwrap_or_else(|| panic!("no answer to {request:?}"))
    }

    pub fn status(&mut self) -> Status {
        match self.ask(&Request::Status) {
            Reply::Status(status) => status,
            other => panic!("{other:?}"),
        }
    }

    pub fn play(&mut self, counts: impl IntoIterator<Item = u16>) {
        for count in counts {
            self.device.sample(count);
            self.device.work();
            self.listen();
        }
    }

    /// The record is over, and what there is to refine is refined.
    pub fn end(&mut self) {
        assert_eq!(self.ask(&Request::EndRelease { after_samples: 0 }), Reply::Done);
        while self.device.idle() {}
        self.listen();
    }

    /// Writes a network, up to its trial.
    pub fn write(&mut self, bytes: &[u8]) {
        let done = |reply| assert_eq!(reply, Reply::Done);
        done(self.ask(&Request::FlashBegin { length: bytes.len() as u32 }));
        for (index, chunk) in bytes.chunks(CHUNK).enumerate() {
            let bytes = chunk.iter().copied().collect();
            done(self.ask(&Request::FlashChunk { offset: (index * CHUNK) as u32, bytes }));
        }
    }

    pub fn power_cut(self) -> Self {
        Self::new(self.device.into_flash())
    }
}

/// Normal deviates that are the same in every run: sums of twelve even ones (xorshift32, Marsaglia 2003).
pub struct Noise(pub u32);

impl Noise {
    pub fn next(&mut self) -> f64 {
        let mut even = || {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 17;
            self.0 ^= self.0 << 5;
            f64::from(self.0) / f64::from(u32::MAX) - 0.5
        };
        (0..12).map(|_| even()).sum()
    }
}

/// A release in closed form: held for two seconds at `from_deg`, let go, `seconds` in all, read with white
/// noise.
#[derive(Clone, Copy, Debug)]
pub struct Swing {
    pub wn: f64,
    pub zeta: f64,
    pub from_deg: f64,
    pub seconds: f64,
    pub noise_deg: f64,
    pub degrees_per_count: f64,
}

impl Swing {
    pub const HELD: usize = 2000;

    pub fn new(wn: f64, zeta: f64) -> Self {
        let seconds = 2.0 + (12.0_f64 / 0.3).ln() / (zeta * wn);
        Self { wn, zeta, from_deg: 12.0, seconds, noise_deg: 0.05, degrees_per_count: 0.005 }
    }

    pub fn counts(&self, seed: u32) -> Vec<u16> {
        let mut noise = Noise(seed.wrapping_mul(2_654_435_761).max(1));
        let wd = self.wn * (1.0 - self.zeta * self.zeta).sqrt();
        (0..(self.seconds * 1000.0) as usize)
            .map(|k| {
                let t = k.saturating_sub(Self::HELD) as f64 * 1e-3;
                let decay = (-self.zeta * self.wn * t).exp();
                let lag = self.zeta * self.wn / wd;
                let yaw = self.from_deg * decay * ((wd * t).cos() + lag * (wd * t).sin());
                let counts = (yaw + self.noise_deg * noise.next()) / self.degrees_per_count;
                (32_768.0 + counts).round().clamp(0.0, 65_535.0) as u16
            })
            .collect()
    }
}
