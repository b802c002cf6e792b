//! A device without a line or a thread: samples in, events out.

use yawrig_firmware::device::Device;
use yawrig_firmware::slots::MemoryFlash;
use yawrig_shared::wire::{
    self, Decoder, Event, Message, Phase, Refined, ReleaseResult, Reply, Request, WindowResult,
};

/// The device and what it has said.
pub struct Desk {
    pub device: Box<Device<MemoryFlash>>,
    decoder: Decoder,
    sequence: u16,
    pub windows: Vec<WindowResult>,
    pub releases: Vec<ReleaseResult>,
    pub refined: Vec<Refined>,
    pub phases: Vec<Phase>,
    /// Numbers of the events, in the order they came.
    pub numbers: Vec<u16>,
}

impl Default for Desk {
    fn default() -> Self {
        Self::new(Device::new(MemoryFlash::new(), "desk"))
    }
}

impl Desk {
    pub fn new(device: Device<MemoryFlash>) -> Self {
        Self {
            device: Box::new(device),
            decoder: Decoder::new(),
            sequence: 0,
            windows: Vec::new(),
            releases: Vec::new(),
            refined: Vec::new(),
            phases: Vec::new(),
            numbers: Vec::new(),
        }
    }

    /// Takes what the device has to say; its reply, if one is among it.
    pub fn listen(&mut self) -> Option<Reply> {
        let mut reply = None;
        while let Some(byte) = self.device.transmit() {
            let Some(frame) = self.decoder.push(byte) else { continue };
            let frame = frame.expect("the device sends whole frames");
            if frame.key == Reply::KEY {
                assert_eq!(frame.sequence, self.sequence, "a reply has its request's number");
                reply = Some(frame.message::<Reply>().expect("its key").expect("a reply"));
                continue;
            }
            self.numbers.push(frame.sequence);
            match frame.message::<Event>().expect("an event's key").expect("an event") {
                Event::Phase { phase, .. } => self.phases.push(phase),
                Event::Window(window) => self.windows.push(window),
                Event::Release(release) => self.releases.push(release),
                Event::Refined(refined) => self.refined.push(refined),
            }
        }
        reply
    }

    pub fn ask(&mut self, request: &Request) -> Reply {
        self.sequence = self.sequence.wrapping_add(1);
        for byte in wire::encode(self.sequence, request).expect("a frame") {
            self.device.receive(byte);
        }
        self.listen().expect("a reply")
    }

    pub fn play(&mut self, counts: impl IntoIterator<Item = u16>) {
        for count in counts {
            self.device.sample(count);
            self.device.work();
            self.listen();
        }
    }

    pub fn lost(&mut self, count: u32) {
        self.device.lost(count);
        self.listen();
    }

    /// The record is over.
    pub fn end(&mut self) {
        assert_eq!(self.ask(&Request::EndRelease { after_samples: 0 }), Reply::Done);
        while self.device.idle() {}
        self.listen();
    }
}
