//! A device in memory that is asked in frames.

use yawrig_firmware::device::Device;
use yawrig_firmware::slots::MemoryFlash;
use yawrig_shared::wire::{encode, Decoder, Reply, Request, Status, CHUNK};

/// A device and the number of the last request.
pub struct Desk {
    pub device: Device<MemoryFlash>,
    sequence: u16,
}

impl Desk {
    pub fn new(flash: MemoryFlash) -> Self {
        Self { device: Device::new(flash, "desk"), sequence: 0 }
    }

    pub fn ask(&mut self, request: &Request) -> Reply {
        self.sequence += 1;
        for byte in encode(self.sequence, request).expect("a frame") {
            self.device.receive(byte);
        }
        let mut decoder = Decoder::new();
        while let Some(byte) = self.device.transmit() {
            if let Some(Ok(frame)) = decoder.push(byte) {
                if let Some(Ok(reply)) = frame.message::<Reply>() {
                    return reply;
                }
            }
        }
        panic!("no answer to {request:?}");
    }

    pub fn status(&mut self) -> Status {
        match self.ask(&Request::Status) {
            Reply::Status(status) => status,
            other => panic!("{other:?}"),
        }
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
