//! What a board does with the bytes of its UARTs, losses included. The registers are the board's.

use crate::device::Device;
use crate::slots::Flash;
use yawrig_shared::potentiometer::Decoder;

/// The receiving half of a UART that holds one byte.
pub trait Receiver {
    /// Whether a byte is there, and whether one before it was lost.
    fn state(&self) -> Received;
    /// The byte that is there.
    fn take(&mut self) -> u8;
    /// Forgets that one was lost.
    fn clear_overrun(&mut self);
}

/// What a UART says of what it has received.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Received {
    pub byte: bool,
    pub overrun: bool,
}

/// Takes a byte of the host's, if one is there. A frame in which one was lost is dropped; the host asks again.
pub fn serve_link<F: Flash>(uart: &mut impl Receiver, device: &mut Device<F>) -> bool {
    let Received { byte, overrun } = uart.state();
    if overrun {
        uart.clear_overrun();
        device.overrun();
    }
    if byte {
        device.receive(uart.take());
    }
    byte
}

/// Takes a byte of the potentiometer's, if one is there. Where one was lost, the next absolute sample tells how many
/// samples are missing.
pub fn serve_potentiometer<F: Flash>(
    uart: &mut impl Receiver,
    decoder: &mut Decoder,
    device: &mut Device<F>,
) -> bool {
    let Received { byte, overrun } = uart.state();
    if overrun {
        uart.clear_overrun();
        decoder.overrun();
    }
    if byte {
        if let Some(sample) = decoder.decode(uart.take()) {
            if sample.lost > 0 {
                device.lost(sample.lost);
            }
            device.sample(sample.counts);
            device.work();
        }
    }
    byte
}
