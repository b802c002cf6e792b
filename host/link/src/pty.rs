//! A pseudo-terminal: a serial port to whoever opens it.

use nix::fcntl::{open, OFlag};
use nix::pty::{grantpt, posix_openpt, ptsname_r, unlockpt};
use nix::sys::stat::Mode;
use nix::sys::termios::{cfmakeraw, tcgetattr, tcsetattr, SetArg};
use rustix::termios::ioctl_tiocnxcl;
use std::fs::File;
use std::io::{Read, Result, Write};
use std::os::fd::OwnedFd;

/// The device's end. Nothing waits for the other one.
#[derive(Debug)]
pub struct Pty {
    near: File,
    /// Held open so that a client may come and go without the near end failing.
    far: OwnedFd,
}

impl Pty {
    /// With what a client opens: `/dev/pts/7`.
    pub fn new() -> Result<(Self, String)> {
        // Not `openpty`: a program started meanwhile would inherit both ends and keep the line up
        // when this one has gone.
        let flags = OFlag::O_RDWR | OFlag::O_NOCTTY | OFlag::O_CLOEXEC;
        let near = posix_openpt(flags | OFlag::O_NONBLOCK)?;
        grantpt(&near)?;
        unlockpt(&near)?;
        let path = ptsname_r(&near)?;
        let far = open(path.as_str(), flags, Mode::empty())?;
        let mut settings = tcgetattr(&far)?;
        cfmakeraw(&mut settings);
        tcsetattr(&far, SetArg::TCSANOW, &settings)?;
        Ok((Self { near: File::from(OwnedFd::from(near)), far }, path))
    }
}

impl Read for Pty {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        // A client marks the terminal as its own. Killed, it leaves the mark, which the system takes
        // away only when the last end is closed, and that is ours. Living clients hold a lock, too.
        ioctl_tiocnxcl(&self.far)?;
        self.near.read(buffer)
    }
}

impl Write for Pty {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.near.write(bytes)
    }

    fn flush(&mut self) -> Result<()> {
        self.near.flush()
    }
}
