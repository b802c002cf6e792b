//! What a device is at the other end of.

use std::time::Duration;
use yawrig_shared::wire::Decoder;

/// A line to a device. One that waits by itself is ready whenever it is polled (a program's port); another one is
/// polled again when something has come or time has passed (a page's stream).
// Polled where it is called: no other thread ever has such a future.
#[allow(async_fn_in_trait)]
pub trait Line {
    /// What it is called in what is said of it: a port's path.
    fn name(&self) -> &str;

    /// What users do about what is wrong, in the words of what they use.
    fn words(&self) -> &'static Words;

    /// How often a request is sent before its answer counts as not coming.
    fn tries(&self) -> u32;

    /// A number that another client does not have.
    fn random(&mut self) -> u32;

    /// How many bytes have come, whatever they were.
    fn bytes(&self) -> u64;

    /// Sends these bytes; false where the line has taken no more for too long.
    ///
    /// # Errors
    /// Why the line is gone.
    async fn send(&mut self, bytes: &[u8]) -> Result<bool, String>;

    /// The next that has come, waiting for it at most so long.
    ///
    /// # Errors
    /// Why the line is gone.
    async fn receive(&mut self, patience: Duration) -> Result<Option<Incoming>, String>;

    /// Lets so much time pass.
    async fn pause(&mut self, duration: Duration);

    /// Another program that reads from it, too, and what to do about that.
    fn other_reader(&self) -> Option<[String; 2]> {
        None
    }

    /// Whether one that is gone at once has gone because another program has it.
    fn turns_away(&self) -> bool {
        false
    }
}

/// What has come over a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Incoming {
    Frame { key: u32, sequence: u16, body: Vec<u8> },
    Garbled,
}

/// What `byte` completes, if anything.
pub fn completed(decoder: &mut Decoder, byte: u8) -> Option<Incoming> {
    decoder.push(byte).map(|found| match found {
        Ok(frame) => {
            Incoming::Frame { key: frame.key, sequence: frame.sequence, body: frame.body.to_vec() }
        }
        Err(_) => Incoming::Garbled,
    })
}

/// What users do, where that depends on what they talk to the device by.
#[derive(Clone, Copy, Debug)]
pub struct Words {
    /// Where what answers is no device.
    pub another_port: &'static str,
    /// Where nothing answers.
    pub nobody: &'static str,
    /// Where the device is gone.
    pub gone: &'static str,
    /// Once more, where a network could not be written.
    pub write_again: &'static str,
    /// What tells which network runs.
    pub which_runs: &'static str,
    /// How to sign a network for a locked device.
    pub sign: fn() -> String,
}
