//! Pseudo-terminals: what stands where a board's serial port would.

use crate::error::{Error, Result};
use nix::fcntl::{fcntl, FcntlArg, OFlag};
use nix::pty::openpty;
use nix::sys::termios::{cfmakeraw, tcgetattr, tcsetattr, SetArg};
use std::fs::File;
use std::io::{self, Read, Write};
use std::os::fd::{AsFd, OwnedFd};

/// The device's end of a pseudo-terminal.
#[derive(Debug)]
pub struct Terminal {
    near: File,
    /// Held open so that a client may come and go without the near end failing.
    _far: OwnedFd,
    path: String,
    /// Frames begun by the client and not ended yet.
    partial: Vec<u8>,
    /// Bytes the client has not taken yet.
    backlog: Vec<u8>,
}

impl Terminal {
    pub fn new() -> Result<Self> {
        let fail = |e: nix::Error| Error::device(format!("cannot open a pseudo-terminal: {e}"));
        let pair = openpty(None, None).map_err(fail)?;
        let mut settings = tcgetattr(&pair.slave).map_err(fail)?;
        cfmakeraw(&mut settings);
        tcsetattr(&pair.slave, SetArg::TCSANOW, &settings).map_err(fail)?;
        fcntl(pair.master.as_fd(), FcntlArg::F_SETFL(OFlag::O_NONBLOCK)).map_err(fail)?;
        let path = nix::unistd::ttyname(&pair.slave).map_err(fail)?;
        Ok(Self {
            near: File::from(pair.master),
            _far: pair.slave,
            path: path.display().to_string(),
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

    /// Drops what nobody is there to read, as a serial line does.
    pub fn forget(&mut self) {
        self.backlog.clear();
    }
}
