//! The ARM image on an emulated Cortex-M4F: QEMU's mps2-an386, its UART0 the link, its UART1 the
//! potentiometer.
//!
//! UART0 is a pseudo-terminal of QEMU's. QEMU drops what the device sends while nobody has it open,
//! and looks only once a second whether somebody has, so it is held open from the start. UART1 is
//! QEMU's standard input through a multiplexer, which keeps 32 bytes at hand for the UART: four
//! times the samples a second that a socket or a pipe alone brings.

use crate::hub::{Potentiometer, Side};
use crate::image;
use nix::errno::Errno;
use nix::fcntl::OFlag;
use nix::poll::{poll, PollFd, PollFlags, PollTimeout};
use nix::sys::termios::{cfmakeraw, tcgetattr, tcsetattr, SetArg};
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, ErrorKind, Read, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::fs::OpenOptionsExt;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::interrupt;
use yawrig_base::settings;
use yawrig_shared::potentiometer::Encoder;

const PROGRAM: &str = "qemu-system-arm";
const INSTALL: &str = "install QEMU (Debian: apt-get install qemu-system-arm)";
/// What QEMU says when it has made the terminal of UART0.
const TERMINAL: &str = "char device redirected to ";
/// What the image says by semihosting once it listens.
const RUNS: &str = "yawrig runs";
/// How long QEMU may take to come up, and to take a sample: only one that hangs takes so long, however busy
/// the machine is. One that has ended is noticed at once.
const PATIENCE: Duration = Duration::from_secs(600);
const SLICE: Duration = Duration::from_millis(100);
/// Lines of QEMU's output that are kept to say why it ended.
const LINES: usize = 8;

/// The device's side of the link.
pub struct Qemu {
    terminal: File,
    link_path: String,
    /// Bytes QEMU has not taken yet.
    backlog: Vec<u8>,
    process: Arc<Process>,
}

/// What feeds its potentiometer.
pub struct QemuPotentiometer {
    line: UnixStream,
    encoder: Encoder,
    /// Number of the next sample.
    index: u32,
    process: Arc<Process>,
}

/// Finds or builds the image and boots it.
pub fn start() -> Result<(Qemu, QemuPotentiometer)> {
    boot(&image::find()?)
}

/// Boots an image. QEMU ends when both parts are gone, and with this program however that ends.
///
/// # Errors
/// Exit 4: no QEMU, no such image, a QEMU that does not know the board, an image that does not run.
pub fn boot(image: &Path) -> Result<(Qemu, QemuPotentiometer)> {
    if !image.is_file() {
        return Err(Error::device(format!("there is no ARM image at {}", image.display()))
            .help("build it with firmware/boards/build mps2-an386"));
    }
    let program = in_path(PROGRAM)
        .ok_or_else(|| Error::device(format!("{PROGRAM} is not in PATH")).help(INSTALL))?;
    let fail = |e: io::Error| {
        Error::device(format!("cannot start {}: {e}", program.display())).help(INSTALL)
    };
    let (line, stdin) = UnixStream::pair().map_err(fail)?;
    line.set_write_timeout(Some(SLICE)).map_err(fail)?;
    let (process, found) = Process::start(command(&program, image), stdin).map_err(fail)?;
    let link_path = process.terminal(&found)?;
    // Before the image runs: so QEMU finds it open when it looks first.
    let terminal = open_terminal(&link_path).map_err(|e| {
        Error::device(format!("cannot open the emulated board's terminal {link_path}: {e}"))
            .help("start it again")
    })?;
    process.wait_for(&found, "does not run the image", |line| (line == RUNS).then_some(()))?;
    let process = Arc::new(process);
    let potentiometer =
        QemuPotentiometer { line, encoder: Encoder::default(), index: 0, process: process.clone() };
    Ok((Qemu { terminal, link_path, backlog: Vec::new(), process }, potentiometer))
}

fn command(program: &Path, image: &Path) -> Command {
    // So that QEMU goes even where this program is killed and can put nothing away.
    let mut command = match in_path("setpriv") {
        Some(setpriv) => {
            let mut command = Command::new(setpriv);
            command.args(["--pdeathsig", "TERM"]).arg(program);
            command
        }
        None => Command::new(program),
    };
    command
        .args(["-machine", "mps2-an386", "-nodefaults", "-display", "none", "-monitor", "none"])
        .args(["-chardev", "pty,id=link", "-serial", "chardev:link"])
        .args(["-chardev", "stdio,id=potentiometer,signal=off,mux=on"])
        .args(["-serial", "chardev:potentiometer"])
        // The multiplexer's escape byte, by default 1, would be missing from the samples: none is 256.
        .args(["-echr", "256"])
        // By this the image says why it stops.
        .args(["-semihosting-config", "enable=on,target=native"])
        .arg("-kernel")
        .arg(image)
        // Ctrl-C is for this program, which then stops QEMU.
        .process_group(0);
    command
}

fn in_path(program: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).map(|folder| folder.join(program)).find(|file| file.is_file())
}

fn open_terminal(path: &str) -> io::Result<File> {
    let flags = OFlag::O_NOCTTY | OFlag::O_NONBLOCK;
    let terminal =
        OpenOptions::new().read(true).write(true).custom_flags(flags.bits()).open(path)?;
    let mut settings = tcgetattr(&terminal)?;
    cfmakeraw(&mut settings);
    tcsetattr(&terminal, SetArg::TCSANOW, &settings)?;
    Ok(terminal)
}

impl Qemu {
    /// QEMU's terminal of UART0.
    pub fn link_path(&self) -> &str {
        &self.link_path
    }

    /// Process number of QEMU.
    pub fn pid(&self) -> u32 {
        self.process.child().id()
    }

    fn flush(&mut self) -> io::Result<()> {
        while !self.backlog.is_empty() {
            match self.terminal.write(&self.backlog) {
                Ok(count) => drop(self.backlog.drain(..count)),
                Err(e) if e.kind() == ErrorKind::WouldBlock => break,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        Ok(())
    }
}

impl Side for Qemu {
    fn work(&mut self) -> io::Result<()> {
        const IDLE_MS: u8 = 1;
        self.flush()?;
        let mut events = PollFlags::POLLIN;
        events.set(PollFlags::POLLOUT, !self.backlog.is_empty());
        match poll(&mut [PollFd::new(self.terminal.as_fd(), events)], PollTimeout::from(IDLE_MS)) {
            Ok(_) | Err(Errno::EINTR) => Ok(()),
            Err(e) => Err(e.into()),
        }
    }

    fn receive(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.backlog.extend_from_slice(bytes);
        self.flush()
    }

    fn transmit(&mut self, out: &mut Vec<u8>) -> io::Result<()> {
        let mut buffer = [0; 1024];
        loop {
            match self.terminal.read(&mut buffer) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(count) => out.extend_from_slice(&buffer[..count]),
                Err(e) if e.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
    }
}

impl QemuPotentiometer {
    /// Sends bytes to UART1 as they are. Waits while QEMU has enough.
    ///
    /// # Errors
    /// Exit 4 with QEMU's last words where it has ended, exit 7 where it takes nothing.
    pub fn write_samples(&mut self, mut bytes: &[u8]) -> Result<()> {
        // A dead board's line may take bytes for a moment still.
        if self.process.has_ended() {
            return Err(self.process.ended());
        }
        let mut waited = Duration::ZERO;
        while !bytes.is_empty() {
            interrupt::check()?;
            match self.line.write(bytes) {
                Ok(count) => {
                    bytes = &bytes[count..];
                    waited = Duration::ZERO;
                }
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                    waited += SLICE;
                }
                Err(_) => return Err(self.process.ended()),
            }
            if waited >= PATIENCE {
                return Err(Error::new(Exit::Timeout, "the emulated board takes no samples").help(
                    format!("start it again, or use {}", settings::given("device", "emulated")),
                ));
            }
        }
        Ok(())
    }
}

impl Potentiometer for QemuPotentiometer {
    fn send(&mut self, counts: &[u16]) -> Result<()> {
        let mut bytes = Vec::with_capacity(2 * counts.len());
        for &counts in counts {
            self.encoder.encode(self.index, counts, &mut bytes);
            self.index = self.index.wrapping_add(1);
        }
        self.write_samples(&bytes)
    }
}

/// QEMU's process; killed and reaped with this value.
#[derive(Debug)]
struct Process {
    child: Mutex<Child>,
    output: Arc<Mutex<Vec<String>>>,
    minder: Option<JoinHandle<()>>,
}

impl Process {
    /// Starts it; the receiver gives the lines of its output.
    fn start(command: Command, stdin: UnixStream) -> io::Result<(Self, Receiver<String>)> {
        let (started, starting) = mpsc::channel();
        let (found, terminal) = mpsc::channel();
        let output = Arc::new(Mutex::new(Vec::new()));
        let lines = output.clone();
        // The system ends QEMU when the *thread* that started it ends, so that is this one, which
        // reads QEMU's output and lasts as long.
        let minder =
            std::thread::Builder::new().name("qemu".into()).spawn(move || {
                match spawn(command, stdin) {
                    Ok((child, said)) => {
                        if started.send(Ok(child)).is_ok() {
                            mind(said, &lines, &found);
                        }
                    }
                    Err(e) => drop(started.send(Err(e))),
                }
            })?;
        let child = starting.recv().map_err(|_| io::Error::from(ErrorKind::BrokenPipe))??;
        Ok((Self { child: Mutex::new(child), output, minder: Some(minder) }, terminal))
    }

    fn child(&self) -> MutexGuard<'_, Child> {
        self.child.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for QEMU to name the terminal of UART0.
    fn terminal(&self, lines: &Receiver<String>) -> Result<String> {
        self.wait_for(lines, "names no terminal for the board's UART0", |line| {
            let (_, rest) = line.split_once(TERMINAL)?;
            rest.split_whitespace().next().map(str::to_owned)
        })
    }

    /// Waits for a line of QEMU's output.
    fn wait_for<T>(
        &self,
        lines: &Receiver<String>,
        otherwise: &str,
        find: impl Fn(&str) -> Option<T>,
    ) -> Result<T> {
        let mut waited = Duration::ZERO;
        while waited < PATIENCE {
            interrupt::check()?;
            match lines.recv_timeout(SLICE) {
                Ok(line) => {
                    if let Some(found) = find(line.trim_end()) {
                        return Ok(found);
                    }
                }
                Err(RecvTimeoutError::Disconnected) => return Err(self.ended()),
                Err(RecvTimeoutError::Timeout) => waited += SLICE,
            }
        }
        Err(Error::device(format!("{PROGRAM} {otherwise}")).help(INSTALL))
    }

    fn has_ended(&self) -> bool {
        matches!(self.child().try_wait(), Ok(Some(_)))
    }

    /// Why it has ended, in its own words.
    fn ended(&self) -> Error {
        // It has closed its line, so it is gone or about to go.
        let status = self.child().wait();
        let status = status.map_or_else(|e| e.to_string(), |status| status.to_string());
        // What it said last may be on its way still.
        if let Some(minder) = &self.minder {
            while !minder.is_finished() {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        let output = self.output.lock().unwrap_or_else(PoisonError::into_inner).join("\n  ");
        if output.contains("unsupported machine type") {
            return Error::device(format!("this {PROGRAM} does not know the board mps2-an386"))
                .help("install QEMU 5.2 or later");
        }
        let said = if output.is_empty() { "nothing".to_owned() } else { format!("\n  {output}") };
        Error::device(format!("the emulated board has stopped ({status}); it said {said}"))
            .help("build the image again with firmware/boards/build mps2-an386")
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        {
            let mut child = self.child();
            // Fails where it has ended already.
            let _ = child.kill();
            let _ = child.wait();
        }
        if let Some(minder) = self.minder.take() {
            let _ = minder.join();
        }
    }
}

fn spawn(mut command: Command, stdin: UnixStream) -> io::Result<(Child, UnixStream)> {
    let (ours, theirs) = UnixStream::pair()?;
    let stdio = |stream: UnixStream| Stdio::from(OwnedFd::from(stream));
    command.stdin(stdio(stdin)).stdout(stdio(theirs.try_clone()?)).stderr(stdio(theirs));
    // The command goes, and with it the last of its ends here: our end closes with QEMU.
    Ok((command.spawn()?, ours))
}

fn mind(said: UnixStream, output: &Mutex<Vec<String>>, found: &Sender<String>) {
    for line in BufReader::new(said).split(b'\n') {
        let Ok(line) = line else { return };
        let line = String::from_utf8_lossy(&line).into_owned();
        let mut output = output.lock().unwrap_or_else(PoisonError::into_inner);
        if output.len() == LINES {
            output.remove(0);
        }
        output.push(line.clone());
        // Nobody listens once the terminal is known.
        let _ = found.send(line);
    }
}
