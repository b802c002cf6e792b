//! What stands where a board's serial port would: a pseudo-terminal, or a socket where the system has none.

#[cfg(unix)]
use crate::pty::Pty;
use crate::socket::Socket;
use std::io::{self, Read, Write};
use yawrig_base::error::{Error, Result};

/// Bytes from and to a client, none of them waited for.
trait Near: Read + Write + Send {}
impl<T: Read + Write + Send> Near for T {}

/// The device's end of a line.
pub struct Terminal {
    near: Box<dyn Near>,
    path: String,
    /// Frames begun by the client and not ended yet.
    partial: Vec<u8>,
    /// Bytes the client has not taken yet.
    backlog: Vec<u8>,
}

impl Terminal {
    /// What this system has.
    ///
    /// # Errors
    /// Exit 4 where it has no more of them.
    pub fn new() -> Result<Self> {
        #[cfg(unix)]
        {
            // As in a container with nothing in its /dev, or nothing behind what is there.
            let there_are_none = |e: &io::Error| {
                let errno = e.raw_os_error().map(nix::errno::Errno::from_raw);
                matches!(errno, Some(nix::errno::Errno::ENOENT | nix::errno::Errno::ENODEV))
            };
            match Pty::new() {
                Err(e) if there_are_none(&e) => {}
                opened => return Self::on(opened, "a pseudo-terminal"),
            }
        }
        Self::socket()
    }

    /// A socket, wherever.
    ///
    /// # Errors
    /// As [`Terminal::new`].
    pub fn socket() -> Result<Self> {
        Self::on(Socket::new(), "a socket")
    }

    fn on(opened: io::Result<(impl Near + 'static, String)>, what: &str) -> Result<Self> {
        let (near, path) =
            opened.map_err(|e| Error::device(format!("cannot open {what} for the device: {e}")))?;
        Ok(Self { near: Box::new(near), path, partial: Vec::new(), backlog: Vec::new() })
    }

    /// What a client opens: `/dev/pts/7` or `tcp://127.0.0.1:50123`.
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

    /// Drops what has no reader, as a serial line does.
    pub fn forget(&mut self) {
        self.backlog.clear();
    }
}
