//! The thread that takes frames off a port.

use std::io::{self, Read};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::Sender;
use yawrig_protocol::line::{completed, Incoming as Came};
use yawrig_shared::wire::Decoder;

/// What it found.
pub(super) enum Incoming {
    Came(Came),
    Gone(String),
}

/// Errors that only mean "not now".
pub(super) fn passing(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
    )
}

/// Reads until it is stopped, or the receiver is gone.
pub(super) fn read(
    mut port: Box<dyn Read + Send>,
    sender: &Sender<Incoming>,
    stop: &AtomicBool,
    bytes: &AtomicU64,
) {
    let mut decoder = Decoder::new();
    let mut buffer = [0; 1024];
    while !stop.load(Ordering::Relaxed) {
        let count = match port.read(&mut buffer) {
            Ok(0) => {
                let _ = sender.send(Incoming::Gone("the port was closed".into()));
                return;
            }
            Ok(count) => count,
            Err(e) if passing(&e) => continue,
            Err(e) => {
                let _ = sender.send(Incoming::Gone(e.to_string()));
                return;
            }
        };
        bytes.fetch_add(count as u64, Ordering::Relaxed);
        for &byte in &buffer[..count] {
            let Some(found) = completed(&mut decoder, byte) else { continue };
            if sender.send(Incoming::Came(found)).is_err() {
                return;
            }
        }
    }
}
