//! Serial lines for the program under test: pseudo-terminals with anything at their other end.

use crate::PATIENCE;
use nix::fcntl::{open, OFlag};
use nix::pty::{grantpt, posix_openpt, ptsname_r, unlockpt};
use nix::sys::stat::Mode;
use nix::sys::termios::{cfmakeraw, tcgetattr, tcsetattr, SetArg};
use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use yawrig_firmware::device::Device;
use yawrig_firmware::slots::MemoryFlash;
use yawrig_shared::wire::Status;

/// A line; gone with this value, as when a plug is pulled.
pub struct Line {
    path: PathBuf,
    /// How often all that was said has gone out, and nothing was left.
    carried: Arc<AtomicU64>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Line {
    /// A line served by `far`: bytes from the program in (none where it sent none for a
    /// millisecond), bytes for it out, `None` pulls the plug.
    pub fn new(far: impl FnMut(&[u8]) -> Option<Vec<u8>> + Send + 'static) -> Self {
        // Closed in the programs the tests start, or a pulled plug would be held by one of them.
        let flags = OFlag::O_RDWR | OFlag::O_NOCTTY | OFlag::O_CLOEXEC;
        let near = posix_openpt(flags | OFlag::O_NONBLOCK).expect("a pseudo-terminal");
        grantpt(&near).expect("a pseudo-terminal");
        unlockpt(&near).expect("a pseudo-terminal");
        let path = PathBuf::from(ptsname_r(&near).expect("its name"));
        let far_side = open(&path, flags, Mode::empty()).expect("its other end");
        let mut settings = tcgetattr(&far_side).expect("its settings");
        cfmakeraw(&mut settings);
        tcsetattr(&far_side, SetArg::TCSANOW, &settings).expect("its settings");
        let near = File::from(OwnedFd::from(near));
        let stop = Arc::new(AtomicBool::new(false));
        let carried = Arc::new(AtomicU64::new(0));
        let thread = {
            let (stop, carried) = (stop.clone(), carried.clone());
            std::thread::spawn(move || carry(near, far_side, far, &stop, &carried))
        };
        Self { path, carried, stop, thread: Some(thread) }
    }

    /// Plays counts into a board that is plugged in here, each few of them when what was said to those before
    /// has gone out over the line: however slow its reader is, nothing is lost on the way. `meanwhile` lets
    /// it read.
    pub fn play(&self, board: &Board, counts: &[u16], mut meanwhile: impl FnMut()) {
        for some in counts.chunks(100) {
            board.samples(some);
            // The first of the two may have begun before.
            let enough = self.carried.load(Ordering::Acquire) + 2;
            let until = Instant::now() + PATIENCE;
            while self.carried.load(Ordering::Acquire) < enough {
                meanwhile();
                assert!(Instant::now() < until, "nobody reads what the board says");
                std::thread::yield_now();
            }
        }
        meanwhile();
    }

    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// `_far_side` is held open so that programs may come and go; it closes with the line.
fn carry(
    mut near: File,
    _far_side: OwnedFd,
    mut far: impl FnMut(&[u8]) -> Option<Vec<u8>>,
    stop: &AtomicBool,
    carried: &AtomicU64,
) {
    let mut buffer = [0; 1024];
    let mut backlog = Vec::new();
    while !stop.load(Ordering::Relaxed) {
        let count = match near.read(&mut buffer) {
            Ok(count) => count,
            Err(e) if e.kind() == ErrorKind::WouldBlock => 0,
            Err(e) => panic!("the test's end of a line fails: {e}"),
        };
        if count == 0 {
            std::thread::sleep(Duration::from_millis(1));
        }
        let Some(answer) = far(&buffer[..count]) else { return };
        backlog.extend(answer);
        if let Ok(taken) = near.write(&backlog) {
            backlog.drain(..taken);
        }
        if backlog.is_empty() {
            carried.fetch_add(1, Ordering::Release);
        }
        // Where nobody reads, the rest is lost, as on a wire.
        backlog.truncate(4096);
    }
}

/// A device on the test's bench: the firmware's own logic, that can be plugged into several lines
/// one after the other and keeps its flash.
#[derive(Clone)]
pub struct Board(Arc<Mutex<Device<Flash>>>);

/// With room for a log.
pub type Flash = MemoryFlash<8>;

impl Default for Board {
    fn default() -> Self {
        Self::new(MemoryFlash::with_log())
    }
}

impl Board {
    /// One that starts from this flash.
    pub fn new(flash: Flash) -> Self {
        Self(Arc::new(Mutex::new(Device::new(flash, "on the bench"))))
    }

    /// One that says it is this board.
    pub fn named(board: &'static str) -> Self {
        Self(Arc::new(Mutex::new(Device::new(MemoryFlash::with_log(), board))))
    }

    /// What the device says to these bytes.
    pub fn exchange(&self, bytes: &[u8]) -> Vec<u8> {
        let mut device = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut said: Vec<u8> = std::iter::from_fn(|| device.transmit()).collect();
        for &byte in bytes {
            device.receive(byte);
            said.extend(std::iter::from_fn(|| device.transmit()));
        }
        said
    }

    /// What its potentiometer shows next.
    pub fn samples(&self, counts: &[u16]) {
        let mut device = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        for &count in counts {
            device.sample(count);
            device.work();
        }
    }

    /// Asked without a line, as by another program.
    pub fn tell(&self, request: &yawrig_shared::wire::Request) {
        self.exchange(&[0]);
        self.exchange(&yawrig_shared::wire::encode(0xBEEE, request).expect("a request"));
    }

    /// Plugs it into an honest line.
    pub fn plug(&self) -> Line {
        let board = self.clone();
        Line::new(move |bytes| Some(board.exchange(bytes)))
    }

    /// Plugs it into a line that does as `tamper` says to what passes: first with the bytes for the
    /// device, then with those for the program. `false` pulls the plug.
    pub fn plug_with(
        &self,
        mut tamper: impl FnMut(Way, &mut Vec<u8>) -> bool + Send + 'static,
    ) -> Line {
        let board = self.clone();
        Line::new(move |bytes| {
            let mut bytes = bytes.to_vec();
            if !tamper(Way::ToDevice, &mut bytes) {
                board.exchange(&bytes);
                return None;
            }
            let mut said = board.exchange(&bytes);
            tamper(Way::ToProgram, &mut said).then_some(said)
        })
    }

    /// The device after a power cut: it starts anew from its flash.
    pub fn restart(&self) {
        let mut device = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let old = std::mem::replace(&mut *device, Device::new(MemoryFlash::with_log(), "gone"));
        *device = Device::new(old.into_flash(), "on the bench");
    }

    /// Its state, asked without a line.
    pub fn status(&self) -> Status {
        use yawrig_shared::wire::{encode, Decoder, Reply, Request};
        let request = encode(0xBEEF, &Request::Status).expect("a request");
        let mut decoder = Decoder::new();
        // Ends whatever frame was cut off.
        let said = [self.exchange(&[0]), self.exchange(&request)].concat();
        let found = said.into_iter().find_map(|byte| {
            match decoder.push(byte)?.ok()?.message::<Reply>()? {
                Ok(Reply::Status(status)) => Some(status),
                _ => None,
            }
        });
        found.expect("its state")
    }
}

/// Which way bytes go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    ToDevice,
    ToProgram,
}
