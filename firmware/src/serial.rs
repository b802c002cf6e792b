//! What a board does with the bytes of its lines, losses included. It gives a line as `embedded_io` has them:
//! a read that fails is a byte that was lost, and the bytes behind it come with the next ones.

use crate::device::Device;
use embedded_io::{Read, ReadReady, Write, WriteReady};
use embedded_storage::nor_flash::NorFlash;
use yawrig_shared::potentiometer::Decoder;

/// A byte was lost.
struct Lost;

fn next(line: &mut (impl Read + ReadReady)) -> Option<Result<u8, Lost>> {
    let mut byte = [0];
    match line.read_ready() {
        Ok(false) => None,
        Ok(true) => match line.read(&mut byte) {
            Ok(0) => None,
            Ok(_) => Some(Ok(byte[0])),
            Err(_) => Some(Err(Lost)),
        },
        Err(_) => Some(Err(Lost)),
    }
}

/// Takes a byte of the host's, if one is there; whether one was. A frame in which one was lost is dropped;
/// the host asks again.
pub fn receive<F: NorFlash, const LOCKABLE: bool>(
    line: &mut (impl Read + ReadReady),
    device: &mut Device<F, LOCKABLE>,
) -> bool {
    match next(line) {
        Some(Ok(byte)) => device.receive(byte),
        Some(Err(Lost)) => device.overrun(),
        None => return false,
    }
    true
}

/// Gives the line a byte for the host, if there is one and it takes it without waiting; whether it did.
pub fn send<F: NorFlash, const LOCKABLE: bool>(
    line: &mut (impl Write + WriteReady),
    device: &mut Device<F, LOCKABLE>,
) -> bool {
    if !line.write_ready().unwrap_or(false) {
        return false;
    }
    // What the line does not take after all is lost on it, and the host asks again.
    device.transmit().is_some_and(|byte| line.write(&[byte]).is_ok())
}

/// Takes a byte of a potentiometer's whose samples come over a line, if one is there; whether one was. Where
/// one was lost, the next absolute sample tells how many samples are missing.
pub fn receive_sample<F: NorFlash, const LOCKABLE: bool>(
    line: &mut (impl Read + ReadReady),
    decoder: &mut Decoder,
    device: &mut Device<F, LOCKABLE>,
) -> bool {
    match next(line) {
        Some(Ok(byte)) => {
            if let Some(sample) = decoder.decode(byte) {
                if sample.lost > 0 {
                    device.lost(sample.lost);
                }
                device.sample(sample.counts);
                device.work();
            }
        }
        Some(Err(Lost)) => decoder.overrun(),
        None => return false,
    }
    true
}
