//! One emulated device behind two terminals: one for this program, one for any other.
//!
//! Everything the device says goes to both; whole frames from either go to the device.

use crate::terminal::Terminal;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::thread::JoinHandle;
use yawrig_base::error::{Error, Result};

/// Bytes that may wait on the second terminal, which may have no reader.
const UNREAD: usize = 4096;

/// The device's side of the link.
pub trait Side: Send + 'static {
    /// Does a slice of work; waits at most about a millisecond where there is none.
    fn work(&mut self) -> io::Result<()>;
    /// Bytes from the host.
    fn receive(&mut self, bytes: &[u8]) -> io::Result<()>;
    /// Bytes for the host.
    fn transmit(&mut self, out: &mut Vec<u8>) -> io::Result<()>;
}

/// Something that can play samples into a device.
pub trait Potentiometer: Send {
    /// The converter's next counts, 1 ms apart. Waits while the device has enough.
    fn send(&mut self, counts: &[u16]) -> Result<()>;
}

/// The thread that carries bytes between a device and its terminals.
#[derive(Debug)]
pub struct Hub {
    own_path: String,
    shared_path: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Hub {
    pub fn start(side: impl Side) -> Result<Self> {
        Self::between(side, Terminal::new()?, Terminal::new()?)
    }

    /// Between the device and these terminals.
    ///
    /// # Errors
    /// Exit 1 where the system gives no thread.
    pub fn between(side: impl Side, own: Terminal, shared: Terminal) -> Result<Self> {
        let (own_path, shared_path) = (own.path().to_owned(), shared.path().to_owned());
        let stop = Arc::new(AtomicBool::new(false));
        let thread = {
            let stop = stop.clone();
            std::thread::Builder::new()
                .name("device".into())
                // The device is some 40 KB and its blobs are decoded on the stack.
                .stack_size(4 << 20)
                .spawn(move || {
                    // A terminal that fails ends the device; the client sees its port go.
                    let _ = carry(side, own, shared, &stop);
                })
                .map_err(|e| Error::internal(format!("cannot start the device's thread: {e}")))?
        };
        Ok(Self { own_path, shared_path, stop, thread: Some(thread) })
    }

    /// The terminal this program opens.
    pub fn own_path(&self) -> &str {
        &self.own_path
    }

    /// The terminal for another shell.
    pub fn shared_path(&self) -> &str {
        &self.shared_path
    }
}

impl Drop for Hub {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn carry(
    mut side: impl Side,
    mut own: Terminal,
    mut shared: Terminal,
    stop: &AtomicBool,
) -> io::Result<()> {
    let mut out = Vec::new();
    while !stop.load(Ordering::Relaxed) {
        for terminal in [&mut own, &mut shared] {
            let frames = terminal.take_frames()?;
            if !frames.is_empty() {
                side.receive(&frames)?;
            }
        }
        // A program that has not read what it was sent gets no more to read: the potentiometer
        // of a simulation can wait.
        if own.waiting() > UNREAD {
            own.send(&[])?;
            std::thread::sleep(std::time::Duration::from_millis(1));
        } else {
            side.work()?;
        }
        out.clear();
        side.transmit(&mut out)?;
        if !out.is_empty() || own.waiting() > 0 || shared.waiting() > 0 {
            own.send(&out)?;
            shared.send(&out)?;
            if shared.waiting() > UNREAD {
                shared.forget();
            }
        }
    }
    Ok(())
}
