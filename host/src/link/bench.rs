//! A device and what turns its potentiometer: the emulated ones, or one on a port.

use crate::error::{Error, Result};
use crate::link::client::Client;
use crate::link::emulated;
use crate::link::hub::Hub;
use crate::link::qemu;
use std::convert::Infallible;
use std::str::FromStr;

/// What `--device` names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// The firmware's logic in this process.
    Emulated,
    /// The ARM image on an emulated Cortex-M4F.
    Qemu,
    /// A serial port.
    Port(String),
}

impl FromStr for Target {
    type Err = Infallible;

    fn from_str(name: &str) -> std::result::Result<Self, Infallible> {
        Ok(match name {
            "emulated" => Self::Emulated,
            "qemu" => Self::Qemu,
            path => Self::Port(path.to_owned()),
        })
    }
}

impl std::fmt::Display for Target {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Emulated => "emulated",
            Self::Qemu => "qemu",
            Self::Port(path) => path,
        })
    }
}

/// Something that can play samples into a device.
pub trait Potentiometer: Send {
    /// The converter's next counts, 1 ms apart. Waits while the device has enough.
    fn send(&mut self, counts: &[u16]) -> Result<()>;
}

/// A device ready to be talked to.
pub struct Bench {
    pub client: Client,
    potentiometer: Option<Box<dyn Potentiometer>>,
    // Dropped last: the client's port is one end of it.
    hub: Option<Hub>,
}

impl Bench {
    /// Starts or opens a device.
    pub fn open(target: &Target) -> Result<Self> {
        let (hub, potentiometer): (_, Box<dyn Potentiometer>) = match target {
            Target::Port(path) => {
                return Ok(Self { client: Client::open(path)?, potentiometer: None, hub: None });
            }
            Target::Emulated => {
                let (device, potentiometer) = emulated::start();
                (Hub::start(device)?, Box::new(potentiometer))
            }
            Target::Qemu => {
                let (board, potentiometer) = qemu::start()?;
                (Hub::start(board)?, Box::new(potentiometer))
            }
        };
        let client = Client::open(hub.own_path())?;
        Ok(Self { client, potentiometer: Some(potentiometer), hub: Some(hub) })
    }

    /// Opens the port again after the device was unplugged; its potentiometer is its own.
    pub fn reopen(&mut self) -> Result<()> {
        self.client = Client::open(self.client.path())?;
        Ok(())
    }

    /// Whether the device may be plugged in again: not one of this program, nor of another, whose
    /// pseudo-terminal goes with it.
    pub fn may_come_back(&self) -> bool {
        self.hub.is_none() && !self.client.path().starts_with("/dev/pts/")
    }

    /// The terminal by which another shell can follow this device.
    pub fn shared_path(&self) -> &str {
        self.hub.as_ref().map_or_else(|| self.client.path(), Hub::shared_path)
    }

    /// Plays samples into the device as its potentiometer.
    ///
    /// # Errors
    /// Exit 2 for a device on a port: that one has a potentiometer of its own.
    pub fn play(&mut self, counts: &[u16]) -> Result<()> {
        match &mut self.potentiometer {
            Some(potentiometer) => potentiometer.send(counts),
            None => Err(Error::usage(format!(
                "the device on {} has a potentiometer of its own; nothing can be played into it",
                self.client.path()
            ))
            .help("use --device emulated or --device qemu")),
        }
    }
}
