//! A device and what turns its potentiometer: the emulated ones, or one on a port.

use crate::client::Client;
use crate::emulated;
use crate::hub::Hub;
pub use crate::hub::Potentiometer;
use crate::port::{self, PortInfo, UsbId};
#[cfg(unix)]
use crate::qemu;
use std::convert::Infallible;
use std::str::FromStr;
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;

/// A device, as `device` names it.
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

/// Tells the serial ports there are.
pub type ListPorts = Box<dyn Fn() -> Result<Vec<PortInfo>> + Send>;

/// A device ready to be talked to.
pub struct Bench {
    pub client: Client,
    /// What the device on a USB port says of itself.
    usb: Option<UsbId>,
    /// Another device was there that says the same of itself.
    has_twin: bool,
    list: ListPorts,
    potentiometer: Option<Box<dyn Potentiometer>>,
    // Dropped last: the client's port is one end of it.
    hub: Option<Hub>,
}

impl Bench {
    /// Starts or opens a device.
    pub fn open(target: &Target) -> Result<Self> {
        let (hub, potentiometer): (_, Box<dyn Potentiometer>) = match target {
            Target::Port(path) => {
                return Self::on_port(path, Box::new(port::list));
            }
            Target::Emulated => {
                let (device, potentiometer) = emulated::start();
                (Hub::start(device)?, Box::new(potentiometer))
            }
            #[cfg(not(unix))]
            Target::Qemu => {
                let [qemu, emulated] = ["qemu", "emulated"].map(|of| settings::given("device", of));
                return Err(Error::usage(format!("{qemu} is for Unix systems only"))
                    .help(format!("use {emulated}, the same logic in this process")));
            }
            #[cfg(unix)]
            Target::Qemu => {
                let (board, potentiometer) = qemu::start()?;
                (Hub::start(board)?, Box::new(potentiometer))
            }
        };
        let client = Client::open(hub.own_path())?;
        let list = Box::new(port::list);
        Ok(Self {
            client,
            usb: None,
            has_twin: false,
            list,
            potentiometer: Some(potentiometer),
            hub: Some(hub),
        })
    }

    /// Opens the device on a port; `list` is asked for the ports there are, then and when it was unplugged.
    ///
    /// # Errors
    /// As [`Client::open`].
    pub fn on_port(path: &str, list: ListPorts) -> Result<Self> {
        let client = Client::open(path)?;
        // Where the system does not list its ports, it is treated as one without USB.
        let ports = list().unwrap_or_default();
        let usb = port::usb_at(path, &ports);
        let has_twin = usb.as_ref().is_some_and(|usb| port::has_twin(usb, &ports));
        Ok(Self { client, usb, has_twin, list, potentiometer: None, hub: None })
    }

    /// Opens the port again after the device was unplugged, on USB wherever it is plugged in now; its
    /// potentiometer is its own. The path it had before, where it has another one.
    ///
    /// # Errors
    /// Exit 4 while it is not there; as [`Client::open`].
    pub fn open_again(&mut self) -> Result<Option<String>> {
        let old = self.client.path().to_owned();
        // The ports are listed only for a device on USB: others have nothing that identifies them.
        let ports = if self.usb.is_some() { (self.list)()? } else { Vec::new() };
        let at_path = port::usb_at(&old, &ports);
        let usb = self.usb.as_ref();
        self.has_twin |= usb.is_some_and(|usb| port::has_twin(usb, &ports));
        let path = port::returned(&old, usb, self.has_twin, at_path.as_ref(), &ports)
            .ok_or_else(|| Error::device(format!("the device that was on {old} is not there")))?;
        self.client = Client::open(path)?;
        Ok((self.client.path() != old).then_some(old))
    }

    /// Whether the device may be plugged in again: not one of this program, nor of another, whose
    /// terminal goes with it.
    pub fn is_pluggable(&self) -> bool {
        self.hub.is_none() && !port::is_of_a_program(self.client.path())
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
            .help(format!(
                "use {} or {}",
                settings::given("device", "emulated"),
                settings::given("device", "qemu")
            ))),
        }
    }
}
