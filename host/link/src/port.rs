//! Opening a serial port, and saying what is wrong with one that does not open.

use crate::holders::holders;
use crate::socket;
use serialport::{ClearBuffer, ErrorKind, SerialPort, SerialPortType, UsbPortInfo};
use std::io::{self, Read, Write};
use std::path::Path;
use std::time::Duration;
use yawrig_base::error::{Error, Exit, Result};
use yawrig_text::nearest;

/// Speed of the link; pseudo-terminals ignore it.
pub const BAUD: u32 = 115_200;
/// How long one read waits before it looks whether it should stop.
pub const READ_SLICE: Duration = Duration::from_millis(20);

/// What is read and what is written.
pub type Ends = (Box<dyn Read + Send>, Box<dyn Write + Send>);

/// Opens `path` for this program alone and drops what was waiting in it.
///
/// # Errors
/// Exit code 4, saying whether the port is absent, busy, forbidden or no port at all.
pub fn open(path: &str) -> Result<Ends> {
    if is_socket(path) {
        let (reading, writing) = socket::connect(path, READ_SLICE)?;
        return Ok((Box::new(reading), Box::new(writing)));
    }
    system::keep_lines_up(path);
    let opened = || {
        let port = system::builder(path).timeout(READ_SLICE).open_native()?;
        port.clear(ClearBuffer::Input)?;
        Ok((port.try_clone_native()?, port))
    };
    let (reading, writing) = opened().map_err(|e| explain(path, &e))?;
    Ok((Box::new(reading), Box::new(writing)))
}

/// Whether it is not a serial port but a socket of this machine.
pub fn is_socket(path: &str) -> bool {
    path.starts_with(socket::SCHEME)
}

/// Whether a program is at the other end, which may have to wait for its turn on a busy machine, and does not
/// come back there once it has gone.
pub fn is_of_a_program(path: &str) -> bool {
    path.starts_with("/dev/pts/") || is_socket(path)
}

#[cfg(unix)]
mod system {
    use nix::fcntl::OFlag;
    use nix::sys::termios::{tcgetattr, tcsetattr, ControlFlags, SetArg};
    use std::fs::OpenOptions;
    use std::os::unix::fs::OpenOptionsExt;

    pub fn builder(path: &str) -> serialport::SerialPortBuilder {
        serialport::new(path, super::BAUD)
    }

    pub const WHO_HAS_IT: &str =
        "close that program, which is another user's: `sudo fuser -v` with the port's path names it";

    pub fn is_no_terminal(error: &serialport::Error) -> bool {
        error.description == nix::errno::Errno::ENOTTY.desc()
    }

    /// Has the system leave DTR and RTS as they are when the port is closed. Boards that take a falling
    /// DTR for a reset are then left running, and find no edge when the port is opened again. What does
    /// not open here will not open a moment later, and is explained there.
    pub fn keep_lines_up(path: &str) {
        let flags = OFlag::O_NOCTTY | OFlag::O_NONBLOCK;
        let port = OpenOptions::new().read(true).write(true).custom_flags(flags.bits()).open(path);
        if let Ok(port) = port
            && let Ok(mut settings) = tcgetattr(&port)
        {
            settings.control_flags.remove(ControlFlags::HUPCL);
            // Where it cannot be set, the board may be reset at the end, as by any other program.
            let _ = tcsetattr(&port, SetArg::TCSANOW, &settings);
        }
    }
}

#[cfg(windows)]
mod system {
    /// Unlike elsewhere DTR, for which boards wait that have their USB themselves, does not rise by itself.
    pub fn builder(path: &str) -> serialport::SerialPortBuilder {
        serialport::new(path, super::BAUD).dtr_on_open(true)
    }

    pub const WHO_HAS_IT: &str = "close that program";

    pub fn is_no_terminal(_: &serialport::Error) -> bool {
        false
    }

    /// The driver decides what DTR does when the port is closed.
    pub fn keep_lines_up(_: &str) {}
}

fn explain(path: &str, error: &serialport::Error) -> Error {
    const NAMES: &str = "list the ports there are with `yawrig ports`";
    let cannot = |why: &str| Error::new(Exit::Device, format!("cannot open port {path}: {why}"));
    let (why, help) = match error.kind() {
        _ if is_absent(path, error) => ("there is no such port".to_owned(), NAMES),
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => (
            "you may not open it".to_owned(),
            "join the group that owns it (mostly `sudo usermod -aG dialout $USER`) and log in again",
        ),
        ErrorKind::NoDevice => {
            const BUSY: &str = "another program has it open";
            match holders(Path::new(path)).first() {
                Some(holder) => {
                    return cannot(&format!("{BUSY}: {holder}")).help(holder.help());
                }
                None => (BUSY.to_owned(), system::WHO_HAS_IT),
            }
        }
        _ if system::is_no_terminal(error) || Path::new(path).is_dir() => {
            ("it is not a serial port".to_owned(), NAMES)
        }
        _ => (error.to_string(), "unplug the device, plug it in again, and try once more"),
    };
    let near = match is_absent(path, error) {
        true => nearest(path, ["emulated", "qemu"]),
        false => None,
    };
    let help = near.map_or(help.to_owned(), |near| format!("did you mean {near}?"));
    cannot(&why).help(help)
}

/// Windows says the same of a port that is absent and of one that another program has.
fn is_absent(path: &str, error: &serialport::Error) -> bool {
    match error.kind() {
        ErrorKind::Io(io::ErrorKind::NotFound) => true,
        ErrorKind::NoDevice if cfg!(windows) => {
            list().is_ok_and(|ports| ports.iter().all(|port| !port.path.eq_ignore_ascii_case(path)))
        }
        _ => false,
    }
}

/// A serial port of this machine.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct PortInfo {
    pub path: String,
    /// What the system knows of it: USB product, or its kind.
    pub description: String,
    /// By which it is known again under another path; none where it is not on USB.
    #[serde(skip)]
    pub usb: Option<UsbId>,
}

/// What a port on USB says of itself wherever it is plugged in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UsbId {
    pub vid: u16,
    pub pid: u16,
    pub serial_number: Option<String>,
    /// Of the ports that one device has.
    pub interface: Option<u8>,
}

impl UsbId {
    /// Whether no other device says the same of itself.
    fn is_unique(&self) -> bool {
        self.serial_number.as_ref().is_some_and(|number| !number.trim().is_empty())
    }
}

/// The serial ports of this machine.
///
/// # Errors
/// Exit 4 where the system does not list them.
pub fn list() -> Result<Vec<PortInfo>> {
    // Where there is none, asking for the ports would end the program.
    if cfg!(target_os = "linux") && !Path::new("/sys/class/tty").is_dir() {
        return Ok(Vec::new());
    }
    let ports = serialport::available_ports()
        .map_err(|e| Error::device(format!("cannot list the serial ports: {e}")))?;
    let describe = |kind: &SerialPortType| match kind {
        SerialPortType::UsbPort(usb) => {
            let names = [&usb.manufacturer, &usb.product];
            let names: Vec<&str> = names.into_iter().flatten().map(String::as_str).collect();
            format!("USB {:04x}:{:04x} {}", usb.vid, usb.pid, names.join(" ")).trim().to_owned()
        }
        SerialPortType::BluetoothPort => "Bluetooth".to_owned(),
        SerialPortType::PciPort => "on board".to_owned(),
        SerialPortType::Unknown => "unknown kind".to_owned(),
    };
    let usb = |kind: SerialPortType| match kind {
        SerialPortType::UsbPort(UsbPortInfo { vid, pid, serial_number, interface, .. }) => {
            Some(UsbId { vid, pid, serial_number, interface })
        }
        _ => None,
    };
    Ok(ports
        .into_iter()
        .map(|port| PortInfo {
            path: port.port_name,
            description: describe(&port.port_type),
            usb: usb(port.port_type),
        })
        .collect())
}

/// Whose the port at `path` is, which may be a link to one of `ports`; none where it is not on USB.
pub fn usb_at(path: &str, ports: &[PortInfo]) -> Option<UsbId> {
    let real = |path: &str| Path::new(path).canonicalize().unwrap_or_else(|_| path.into());
    let wanted = real(path);
    ports.iter().find(|port| real(&port.path) == wanted)?.usb.clone()
}

/// Whether several of these ports say the same of themselves as this one.
pub fn has_twin(usb: &UsbId, ports: &[PortInfo]) -> bool {
    ports.iter().filter(|port| port.usb.as_ref() == Some(usb)).count() > 1
}

/// Where the device that was on `path` is now, `usb` being what it said of itself there: at its old path, or
/// at another one where exactly one port says the same and no other device can. None while it is not there.
/// `at_path` is what is at the old path now. A device that is not on USB is looked for at its old path only,
/// and so is one `with_twin`: another device was seen that says the same.
pub fn returned<'a>(
    path: &'a str,
    usb: Option<&UsbId>,
    with_twin: bool,
    at_path: Option<&UsbId>,
    ports: &'a [PortInfo],
) -> Option<&'a str> {
    let Some(usb) = usb else { return Some(path) };
    if at_path == Some(usb) {
        return Some(path);
    }
    let may_move = usb.is_unique() && !with_twin;
    let mut same = ports.iter().filter(|port| port.usb.as_ref() == Some(usb) && may_move);
    match (same.next(), same.next()) {
        (Some(one), None) => Some(&one.path),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn board(serial_number: Option<&str>, interface: u8) -> UsbId {
        let serial_number = serial_number.map(str::to_owned);
        UsbId { vid: 0x0483, pid: 0x374b, serial_number, interface: Some(interface) }
    }

    fn port(path: &str, usb: Option<UsbId>) -> PortInfo {
        PortInfo { path: path.to_owned(), description: String::new(), usb }
    }

    /// Where it is found that was `usb` on ttyACM0.
    fn found<'a>(usb: Option<&UsbId>, ports: &'a [PortInfo]) -> Option<&'a str> {
        returned("/dev/ttyACM0", usb, false, usb_at("/dev/ttyACM0", ports).as_ref(), ports)
    }

    #[test]
    fn a_device_is_found_at_its_path_or_at_another() {
        let (ours, theirs) = (board(Some("A1"), 2), board(Some("B2"), 2));
        let usb = Some(&ours);
        assert_eq!(found(usb, &[]), None, "not there");
        let old = [port("/dev/ttyS0", None), port("/dev/ttyACM0", Some(ours.clone()))];
        assert_eq!(found(usb, &old), Some("/dev/ttyACM0"));
        let moved = [port("/dev/ttyACM1", Some(ours.clone())), port("/dev/ttyS0", None)];
        assert_eq!(found(usb, &moved), Some("/dev/ttyACM1"));
        // Another board has taken its path, or the two have changed places.
        let taken = [port("/dev/ttyACM0", Some(theirs.clone()))];
        assert_eq!(found(usb, &taken), None);
        let swapped =
            [port("/dev/ttyACM0", Some(theirs)), port("/dev/ttyACM1", Some(ours.clone()))];
        assert_eq!(found(usb, &swapped), Some("/dev/ttyACM1"));
    }

    #[test]
    fn no_port_is_taken_that_may_be_another() {
        let ours = board(Some("A1"), 2);
        let at = |usb: UsbId| [port("/dev/ttyACM1", Some(usb))];
        assert_eq!(found(Some(&ours), &at(board(Some("A2"), 2))), None, "another serial number");
        assert_eq!(found(Some(&ours), &at(board(None, 2))), None);
        assert_eq!(found(Some(&ours), &at(board(Some("A1"), 0))), None, "its other port");
        assert_eq!(found(Some(&ours), &at(UsbId { pid: 1, ..ours.clone() })), None);
        assert_eq!(found(Some(&ours), &at(UsbId { vid: 1, ..ours.clone() })), None);
        let twice = ["/dev/ttyACM1", "/dev/ttyACM2"].map(|path| port(path, Some(ours.clone())));
        assert_eq!(found(Some(&ours), &twice), None, "two say the same");
        assert!(has_twin(&ours, &twice) && !has_twin(&ours, &twice[1..]));
        // And where the other is left alone later.
        let known = |ports| {
            returned(
                "/dev/ttyACM0",
                Some(&ours),
                true,
                usb_at("/dev/ttyACM0", ports).as_ref(),
                ports,
            )
        };
        assert_eq!(known(&twice[..1]), None, "of two one is left");
        assert_eq!(known(&[port("/dev/ttyACM0", Some(ours.clone()))]), Some("/dev/ttyACM0"));
        // Without a serial number one board is as the other: only where it was.
        for number in [None, Some(""), Some(" ")] {
            let plain = board(number, 2);
            assert_eq!(found(Some(&plain), &at(plain.clone())), None);
            let back = [port("/dev/ttyACM0", Some(plain.clone()))];
            assert_eq!(found(Some(&plain), &back), Some("/dev/ttyACM0"));
        }
    }

    #[test]
    fn what_is_not_on_usb_is_looked_for_where_it_was() {
        for ports in [vec![], vec![port("/dev/ttyACM1", Some(board(Some("A1"), 2)))]] {
            assert_eq!(found(None, &ports), Some("/dev/ttyACM0"));
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_link_to_a_port_is_that_port() {
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("ttyACM3"), folder.path().join("by-id"));
        std::fs::write(&real, "").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        let real = real.canonicalize().unwrap().display().to_string();
        let ports = [port(&real, Some(board(Some("A1"), 2)))];
        let found = usb_at(&link.display().to_string(), &ports);
        assert_eq!(found, Some(board(Some("A1"), 2)));
        assert_eq!(usb_at("/dev/ttyACM9", &ports), None);
    }
}
