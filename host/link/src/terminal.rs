//! Pseudo-terminals: what stands where a board's serial port would.

use nix::fcntl::{open, OFlag};
use nix::pty::{grantpt, posix_openpt, ptsname_r, unlockpt};
use nix::sys::stat::Mode;
use nix::sys::termios::{cfmakeraw, tcgetattr, tcsetattr, SetArg};
use rustix::termios::ioctl_tiocnxcl;
use std::fs::File;
use std::io::{self, Read, Write};
use std::os::fd::OwnedFd;
use yawrig_base::error::{Error, Result};

/// The device's end of a pseudo-terminal.
#[derive(Debug)]
pub struct Terminal {
    near: File,
    /// Held open so that a client may come and go without the near end failing.
    far: OwnedFd,
    path: String,
    /// Frames begun by the client and not ended yet.
    partial: Vec<u8>,
    /// Bytes the client has not taken yet.
    backlog: Vec<u8>,
}

impl Terminal {
    pub fn new() -> Result<Self> {
        let fail = |e: nix::Error| Error::device(format!("cannot open a pseudo-terminal: {e}"));
        // Not `openpty`: a program started meanwhile would inherit both ends and keep the line up
        // when this one has gone.
        let flags = OFlag::O_RDWR | OFlag::O_NOCTTY | OFlag::O_CLOEXEC;
        let near = posix_openpt(flags | OFlag::O_NONBLOCK).map_err(fail)?;
        grantpt(&near).map_err(fail)?;
        unlockpt(&near).map_err(fail)?;
        let path = ptsname_r(&near).map_err(fail)?;
        let far = open(path.as_str(), flags, Mode::empty()).map_err(fail)?;
        let mut settings = tcgetattr(&far).map_err(fail)?;
        cfmakeraw(&mut settings);
        tcsetattr(&far, SetArg::TCSANOW, &settings).map_err(fail)?;
        Ok(Self {
            near: File::from(OwnedFd::from(near)),
            far,
            path,
            partial: Vec::new(),
            backlog: Vec::new(),
        })
    }

    /// What a client opens: `/dev/pts/7`.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Whole frames the client has sent, zeros included: two clients of one device must not cut
    /// into each other's.
    pub fn take_frames(&mut self) -> io::Result<Vec<u8>> {
        // A client marks the terminal as its own. Killed, it leaves the mark, which the system takes
        // away only when the last end is closed, and that is ours. Living clients hold a lock, too.
        ioctl_tiocnxcl(&self.far)?;
        let mut buffer = [0; 1024];
        loop {
            match self.near.read(&mut buffer) {
                Ok(0) => break,
                Ok(count) => self.partial.extend_from_slice(&buffer[..count]),
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => break,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        // A client that never ends a frame may not fill the memory.
        let end = match self.partial.iter().rposition(|&byte| byte == 0) {
            Some(last) => last + 1,
            None if self.partial.len() > 4096 => self.partial.len(),
            None => 0,
        };
        Ok(self.partial.drain(..end).collect())
    }

    /// Sends what the client will take; the rest waits.
    pub fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.backlog.extend_from_slice(bytes);
        while !self.backlog.is_empty() {
            match self.near.write(&self.backlog) {
                Ok(count) => drop(self.backlog.drain(..count)),
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => break,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        Ok(())
    }

    /// Bytes that wait for the client.
    pub fn waiting(&self) -> usize {
        self.backlog.len()
    }

    /// Drops what has no reader, as a serial line does.
    pub fn forget(&mut self) {
        self.backlog.clear();
    }
}
