//! A TCP socket of this machine as a serial line: where the system has no pseudo-terminals.

use std::io::{ErrorKind, Read, Result, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::time::Duration;
use yawrig_base::error::{Error, Exit};

/// How a path begins that is one: `tcp://127.0.0.1:50123`.
pub const SCHEME: &str = "tcp://";

/// The device's end, for one client at a time: another one is turned away. Nothing waits for the other end.
#[derive(Debug)]
pub struct Socket {
    listener: TcpListener,
    client: Option<TcpStream>,
}

impl Socket {
    /// With what a client opens.
    pub fn new() -> Result<(Self, String)> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        listener.set_nonblocking(true)?;
        let path = format!("{SCHEME}{}", listener.local_addr()?);
        Ok((Self { listener, client: None }, path))
    }

    /// The client that waits first, where none is there; the others are closed.
    fn accept(&mut self) -> Result<bool> {
        let accepted = self.listener.accept();
        match accepted {
            Ok((client, _)) if self.client.is_none() => {
                client.set_nonblocking(true)?;
                client.set_nodelay(true)?;
                self.client = Some(client);
                Ok(true)
            }
            Ok(_) => Ok(true),
            // One that has gone again before it was met.
            Err(e) if is_gone(&e) => Ok(true),
            Err(e) if e.kind() == ErrorKind::WouldBlock => Ok(false),
            Err(e) => Err(e),
        }
    }
}

fn is_gone(error: &std::io::Error) -> bool {
    use ErrorKind::{BrokenPipe, ConnectionAborted, ConnectionReset};
    matches!(error.kind(), BrokenPipe | ConnectionAborted | ConnectionReset)
}

impl Read for Socket {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        loop {
            // Before the next is met: the one that was here may have left.
            match self.client.as_mut().map(|client| client.read(buffer)) {
                None => {}
                Some(Ok(0)) => self.client = None,
                Some(Err(e)) if is_gone(&e) => self.client = None,
                Some(Err(e)) if e.kind() == ErrorKind::WouldBlock => {}
                Some(found) => return found,
            }
            if !self.accept()? {
                return Err(ErrorKind::WouldBlock.into());
            }
        }
    }
}

impl Write for Socket {
    /// What has no reader is lost, as on a serial line.
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        match self.client.as_mut().map(|client| client.write(bytes)) {
            None => Ok(bytes.len()),
            Some(Err(e)) if is_gone(&e) => {
                self.client = None;
                Ok(bytes.len())
            }
            Some(done) => done,
        }
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

/// The client's end of the socket at `path`, to read from, each time for so long at most, and to write to.
///
/// # Errors
/// Exit code 4 where nobody listens.
pub fn connect(
    path: &str,
    read_slice: Duration,
) -> std::result::Result<(TcpStream, TcpStream), Error> {
    let connected = || {
        let stream = TcpStream::connect(path.trim_start_matches(SCHEME))?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(read_slice))?;
        Ok((stream.try_clone()?, stream))
    };
    connected().map_err(|e: std::io::Error| {
        let why = match e.kind() {
            ErrorKind::ConnectionRefused => "no program has a device there".to_owned(),
            _ => e.to_string(),
        };
        Error::new(Exit::Device, format!("cannot open port {path}: {why}"))
            .help("use the path that the other program says, as long as that one runs")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::Client;
    use crate::emulated;
    use crate::hub::{Hub, Potentiometer};
    use crate::terminal::Terminal;

    /// A device behind two sockets, as where there are no pseudo-terminals.
    fn device() -> (Hub, impl Potentiometer) {
        let (device, potentiometer) = emulated::start();
        let socket = || Terminal::socket().expect("a socket");
        (Hub::between(device, socket(), socket()).expect("a thread"), potentiometer)
    }

    #[test]
    fn both_ends_of_a_device_answer_and_each_is_one_clients() {
        let (hub, _potentiometer) = device();
        for path in [hub.own_path(), hub.shared_path()] {
            let mut client = Client::open(path).unwrap();
            assert_eq!(client.identity.board, "emulated");
            let error = Client::open(path).err().expect("it is taken");
            assert_eq!(error.exit, Exit::Device);
            assert!(error.message.contains("another program has it open"), "{error}");
            client.status().expect("the first is not disturbed");
        }
    }

    #[test]
    fn one_client_after_the_other_however_it_ends() {
        let (hub, mut potentiometer) = device();
        for _ in 0..20 {
            // In the middle of a frame, and without reading what it was answered.
            let hello =
                yawrig_shared::wire::encode_raw(yawrig_shared::wire::HELLO_KEY, 1, &[]).unwrap();
            let mut rude = TcpStream::connect(hub.own_path().trim_start_matches(SCHEME)).unwrap();
            rude.write_all(&hello).unwrap();
            rude.write_all(&hello[..5]).unwrap();
            drop(rude);
            // The next may be met before that one's leaving is.
            let mut client = Client::open(hub.own_path()).unwrap();
            client.status().unwrap();
            potentiometer.send(&[2048; 100]).unwrap();
        }
    }

    #[test]
    fn a_device_that_has_gone_is_said_to() {
        let (hub, _potentiometer) = device();
        let path = hub.own_path().to_owned();
        let mut client = Client::open(&path).unwrap();
        drop(hub);
        let error = client.status().unwrap_err();
        assert!(error.message.contains("is gone"), "{error}");
        let error = Client::open(&path).err().expect("nobody is there");
        assert_eq!(error.exit, Exit::Device);
        assert!(error.message.contains("no program has a device there"), "{error}");
    }
}
