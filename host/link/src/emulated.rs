//! The firmware's own logic on a thread of this program, behind a real pseudo-terminal.

use crate::hub::{Potentiometer, Side};
use std::io;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, SyncSender};
use std::time::Duration;
use yawrig_base::error::{Error, Result};
use yawrig_firmware::device::Device;
use yawrig_firmware::slots::MemoryFlash;
use yawrig_shared::wire::STREAM_CHUNK;

/// Chunks of samples that may wait for the device.
const CHUNKS: usize = 4;

/// The device's thread's part.
pub struct Emulated {
    device: Box<Device<MemoryFlash<8>>>,
    samples: Receiver<Vec<u16>>,
    /// Said while the samples came: the device's line would not hold it all.
    said: Vec<u8>,
    unplugged: bool,
}

/// What feeds it.
pub struct EmulatedPotentiometer(SyncSender<Vec<u16>>);

/// A device with empty slots and an empty log, and its potentiometer.
pub fn start() -> (Emulated, EmulatedPotentiometer) {
    let (sender, samples) = mpsc::sync_channel(CHUNKS);
    let device = Box::new(Device::new(MemoryFlash::with_log(), "emulated"));
    (
        Emulated { device, samples, said: Vec::new(), unplugged: false },
        EmulatedPotentiometer(sender),
    )
}

impl Potentiometer for EmulatedPotentiometer {
    fn send(&mut self, counts: &[u16]) -> Result<()> {
        self.0.send(counts.to_vec()).map_err(|_| Error::device("the emulated device has stopped"))
    }
}

impl Side for Emulated {
    fn work(&mut self) -> io::Result<()> {
        const IDLE: Duration = Duration::from_millis(1);
        if self.unplugged {
            std::thread::sleep(IDLE);
            return Ok(());
        }
        match self.samples.recv_timeout(IDLE) {
            Ok(counts) => {
                for counts in counts.chunks(STREAM_CHUNK) {
                    for &count in counts {
                        self.device.sample(count);
                        self.device.work();
                    }
                    self.said.extend(std::iter::from_fn(|| self.device.transmit()));
                }
            }
            Err(RecvTimeoutError::Timeout) => while self.device.idle() {},
            Err(RecvTimeoutError::Disconnected) => self.unplugged = true,
        }
        Ok(())
    }

    fn receive(&mut self, bytes: &[u8]) -> io::Result<()> {
        bytes.iter().for_each(|&byte| self.device.receive(byte));
        Ok(())
    }

    fn transmit(&mut self, out: &mut Vec<u8>) -> io::Result<()> {
        out.append(&mut self.said);
        out.extend(std::iter::from_fn(|| self.device.transmit()));
        Ok(())
    }
}
