//! Opening a serial port, and saying what is wrong with one that does not open.

use crate::error::{Error, Exit, Result};
use crate::own_effect::nearest;
use nix::fcntl::OFlag;
use nix::sys::termios::{tcgetattr, tcsetattr, ControlFlags, SetArg};
use serialport::{ClearBuffer, ErrorKind, SerialPort, TTYPort};
use std::fs::OpenOptions;
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::Duration;

/// Speed of the link; pseudo-terminals ignore it.
pub const BAUD: u32 = 115_200;
/// How long one read waits before it looks whether it should stop.
pub const READ_SLICE: Duration = Duration::from_millis(20);

/// Opens `path` for this program alone and drops what was waiting in it.
///
/// # Errors
/// Exit code 4, saying whether the port is absent, busy, forbidden or no port at all.
pub fn open(path: &str) -> Result<TTYPort> {
    keep_lines_up(path);
    let port = TTYPort::open(&serialport::new(path, BAUD).timeout(READ_SLICE))
        .map_err(|e| explain(path, &e))?;
    port.clear(ClearBuffer::Input).map_err(|e| explain(path, &e))?;
    Ok(port)
}

/// Has the system leave DTR and RTS as they are when the port is closed. Boards that take a falling
/// DTR for a reset are then left running, and find no edge when the port is opened again. What does
/// not open here will not open a moment later, and is explained there.
fn keep_lines_up(path: &str) {
    let flags = OFlag::O_NOCTTY | OFlag::O_NONBLOCK;
    let port = OpenOptions::new().read(true).write(true).custom_flags(flags.bits()).open(path);
    if let Ok(port) = port {
        if let Ok(mut settings) = tcgetattr(&port) {
            settings.control_flags.remove(ControlFlags::HUPCL);
            // Where it cannot be set, the board may be reset at the end, as by any other program.
            let _ = tcsetattr(&port, SetArg::TCSANOW, &settings);
        }
    }
}

fn explain(path: &str, error: &serialport::Error) -> Error {
    let no_port =
        ("it is not a serial port".to_owned(), "list the ports there are with `yawrig ports`");
    let (why, help) = match error.kind() {
        ErrorKind::Io(io::ErrorKind::NotFound) => {
            ("there is no such port".to_owned(), "list the ports there are with `yawrig ports`")
        }
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => (
            "you may not open it".to_owned(),
            "join the group that owns it (mostly `sudo usermod -aG dialout $USER`) and log in anew",
        ),
        ErrorKind::NoDevice => (
            "another program has it open".to_owned(),
            "close that program (`fuser -v` with the port's path names it)",
        ),
        _ if error.description == nix::errno::Errno::ENOTTY.desc() => no_port,
        _ if Path::new(path).is_dir() => no_port,
        _ => (error.to_string(), "unplug the device, plug it in again, and try once more"),
    };
    let near = match error.kind() {
        ErrorKind::Io(io::ErrorKind::NotFound) => nearest(path, ["emulated", "qemu"]),
        _ => None,
    };
    let help = near.map_or(help.to_owned(), |near| format!("did you mean {near}?"));
    Error::new(Exit::Device, format!("cannot open port {path}: {why}")).help(help)
}

/// A serial port of this machine.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct PortInfo {
    pub path: String,
    /// What the system knows of it: USB product, or its kind.
    pub description: String,
}

/// The serial ports of this machine.
pub fn list() -> Result<Vec<PortInfo>> {
    let ports = serialport::available_ports()
        .map_err(|e| Error::device(format!("cannot list the serial ports: {e}")))?;
    let describe = |kind: serialport::SerialPortType| match kind {
        serialport::SerialPortType::UsbPort(usb) => {
            let names = [usb.manufacturer, usb.product];
            let names: Vec<String> = names.into_iter().flatten().collect();
            format!("USB {:04x}:{:04x} {}", usb.vid, usb.pid, names.join(" ")).trim().to_owned()
        }
        serialport::SerialPortType::BluetoothPort => "Bluetooth".to_owned(),
        serialport::SerialPortType::PciPort => "on board".to_owned(),
        serialport::SerialPortType::Unknown => "unknown kind".to_owned(),
    };
    Ok(ports
        .into_iter()
        .map(|port| PortInfo { path: port.port_name, description: describe(port.port_type) })
        .collect())
}
