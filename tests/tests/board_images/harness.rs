//! A board's microcontroller with its image in it (`tests/boards`), and beside it the same firmware in this
//! process.

use embedded_storage::nor_flash::{
    check_erase, check_read, check_write, ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash,
};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use yawrig_firmware::device::Device;
use yawrig_firmware::slots::{ERASED, SLOT_BYTES};
use yawrig_shared::wire::{encode, Cause, Decoder, Event, Reply, Request, Start, Status};

/// What the tests know of a board; `tests/boards/NAME.py` executes its image.
pub trait Board {
    /// As its image says it.
    const NAME: &'static str;
    const CLOCK_U_PPM: f32;
    /// Of the networks' places and, where there is room for one, of the log behind them.
    const KEPT_BYTES: usize = 4 * SLOT_BYTES;
    /// Flash as the board writes and erases it.
    type Flash: Kept;
}

/// The flash in which networks, lock and log are kept.
pub trait Kept: NorFlash {
    fn of(bytes: Vec<u8>) -> Self;
    fn bytes(&self) -> &[u8];
}

/// Flash in memory, written and erased in so many bytes.
pub struct Memory<const WRITE: usize, const ERASE: usize>(Vec<u8>);

impl<const WRITE: usize, const ERASE: usize> Kept for Memory<WRITE, ERASE> {
    fn of(bytes: Vec<u8>) -> Self {
        Self(bytes)
    }

    fn bytes(&self) -> &[u8] {
        &self.0
    }
}

impl<const WRITE: usize, const ERASE: usize> ErrorType for Memory<WRITE, ERASE> {
    type Error = NorFlashErrorKind;
}

impl<const WRITE: usize, const ERASE: usize> ReadNorFlash for Memory<WRITE, ERASE> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, room: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, room.len())?;
        room.copy_from_slice(&self.0[offset as usize..][..room.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl<const WRITE: usize, const ERASE: usize> NorFlash for Memory<WRITE, ERASE> {
    const WRITE_SIZE: usize = WRITE;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        self.0[from as usize..to as usize].fill(ERASED);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        let room = &mut self.0[offset as usize..][..bytes.len()];
        room.iter_mut().zip(bytes).for_each(|(room, byte)| *room &= byte);
        Ok(())
    }
}

fn erased<B: Board>() -> B::Flash {
    B::Flash::of(vec![ERASED; B::KEPT_BYTES])
}

pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a folder above").to_owned()
}

/// The microcontroller with the image in it.
pub struct Machine {
    child: Child,
    stdin: ChildStdin,
    stdout: BufReader<ChildStdout>,
}

impl Machine {
    pub fn start(board: &str) -> Self {
        let image = Command::new(root().join("firmware/boards/build")).arg(board).output();
        let image = image.expect("the build script");
        assert!(image.status.success(), "{}", String::from_utf8_lossy(&image.stderr));
        let image = String::from_utf8(image.stdout).expect("a path");
        let python = root().join("target/nucleo/bin/python");
        assert!(python.exists(), "{} is not there: run tests/boards/install", python.display());
        let mut child = Command::new(python)
            .arg("-B")
            .arg(root().join(format!("tests/boards/{board}.py")))
            .arg(image.trim())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("python");
        let stdin = child.stdin.take().expect("a pipe");
        let stdout = BufReader::new(child.stdout.take().expect("a pipe"));
        Self { child, stdin, stdout }
    }

    pub fn ask(&mut self, command: &str) -> String {
        writeln!(self.stdin, "{command}").expect("it runs");
        let mut answer = String::new();
        self.stdout.read_line(&mut answer).expect("an answer");
        assert!(!answer.is_empty(), "the machine ended; its message stands above");
        answer.trim().to_owned()
    }

    /// What it sends, and what reset it by then.
    pub fn run(&mut self, command: &str) -> (Vec<u8>, Option<String>) {
        let answer = self.ask(command);
        let (sent, reset) = match answer.split_once(" reset ") {
            Some((sent, by)) => (sent, Some(by.to_owned())),
            None => (answer.as_str(), None),
        };
        let sent = sent.strip_prefix("sent").expect("what was sent").trim();
        (data_encoding::HEXLOWER.decode(sent.as_bytes()).expect("hexadecimal"), reset)
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The board and the firmware in this process, side by side.
pub struct Both<B: Board> {
    pub machine: Machine,
    pub here: Device<B::Flash>,
    sequence: u16,
    decoder: Decoder,
    pub events: Vec<Event>,
}

fn device<B: Board>(flash: B::Flash, cause: Cause) -> Device<B::Flash> {
    let mut device = Device::new(flash, B::NAME);
    device.set_clock(B::CLOCK_U_PPM);
    device.set_start(Start { cause, crash: None }, u8::from(cause == Cause::Watchdog));
    device
}

/// Conversions of a sample.
pub const CONVERSIONS: usize = 16;

/// The converter's 12 bits of each of a sample's conversions, which are not all the same.
fn converted(reading: u16) -> impl Iterator<Item = u16> {
    (0..CONVERSIONS as u16).map(move |k| reading.saturating_add(k % 3).saturating_sub(1).min(4095))
}

impl<B: Board> Both<B> {
    pub fn start() -> Self {
        let machine = Machine::start(B::NAME);
        let here = device::<B>(erased::<B>(), Cause::Power);
        let mut both =
            Self { machine, here, sequence: 0, decoder: Decoder::new(), events: Vec::new() };
        // It boots, and has nothing to say.
        assert_eq!(both.machine.run("run"), (Vec::new(), None));
        both
    }

    /// Bytes of the line, then conversions, sixteen a sample; what is sent, which is the same.
    pub fn give(&mut self, bytes: &[u8], conversions: &[u16]) -> Vec<u8> {
        if !bytes.is_empty() {
            self.machine.ask(&format!("line {}", data_encoding::HEXLOWER.encode(bytes)));
        }
        if !conversions.is_empty() {
            let text: String = conversions.iter().map(|c| format!("{c:04x}")).collect();
            self.machine.ask(&format!("samples {text}"));
        }
        let (there, reset) = self.machine.run("run");
        assert_eq!(reset, None);
        let mut here = Vec::new();
        let mut listen = |device: &mut Device<B::Flash>| {
            here.extend(std::iter::from_fn(|| device.transmit()));
        };
        bytes.iter().for_each(|byte| self.here.receive(*byte));
        listen(&mut self.here);
        for sample in conversions.chunks_exact(CONVERSIONS) {
            self.here.sample(sample.iter().sum());
            self.here.work();
            listen(&mut self.here);
        }
        assert_eq!(there, here, "after {} conversions", conversions.len());
        there
    }

    /// Takes the events of what was sent; the reply, if there is one.
    fn understood(&mut self, sent: &[u8]) -> Option<Reply> {
        let mut reply = None;
        for byte in sent {
            let Some(frame) = self.decoder.push(*byte) else { continue };
            let frame = frame.expect("a whole frame");
            match (frame.message::<Reply>(), frame.message::<Event>()) {
                (Some(found), _) => reply = Some(found.expect("a reply")),
                (_, Some(event)) => self.events.push(event.expect("an event")),
                _ => {}
            }
        }
        reply
    }

    pub fn ask_while(&mut self, request: &Request, readings: &[u16]) -> Reply {
        self.sequence += 1;
        let frame = encode(self.sequence, request).expect("a frame");
        let conversions: Vec<u16> =
            readings.iter().flat_map(|reading| converted(*reading)).collect();
        let sent = self.give(&frame, &conversions);
        self.understood(&sent).unwrap_or_else(|| panic!("no answer to {request:?}"))
    }

    pub fn ask(&mut self, request: &Request) -> Reply {
        self.ask_while(request, &[])
    }

    pub fn status(&mut self) -> Status {
        match self.ask(&Request::Status) {
            Reply::Status(status) => status,
            other => panic!("{other:?}"),
        }
    }

    pub fn play(&mut self, readings: &[u16]) {
        let conversions: Vec<u16> =
            readings.iter().flat_map(|reading| converted(*reading)).collect();
        self.convert(&conversions);
    }

    /// Whole samples' conversions, one by one.
    pub fn convert(&mut self, conversions: &[u16]) {
        let whole = conversions.len() / CONVERSIONS * CONVERSIONS;
        for some in conversions[..whole].chunks(1000 * CONVERSIONS) {
            let sent = self.give(&[], some);
            self.understood(&sent);
        }
    }

    /// Off and on again.
    pub fn power_cycle(&mut self) {
        assert_eq!(self.machine.ask("reset"), "ok");
        assert_eq!(self.machine.run("run"), (Vec::new(), None));
        let flash = self.flash_here();
        self.begin_here(flash, Cause::Power);
    }

    /// The firmware in this process starts, from this flash.
    pub fn begin_here(&mut self, flash: B::Flash, cause: Cause) {
        self.here = device::<B>(flash, cause);
        self.decoder = Decoder::new();
    }

    fn flash_here(&mut self) -> B::Flash {
        std::mem::replace(&mut self.here, device::<B>(erased::<B>(), Cause::Power)).into_flash()
    }

    /// What the machine keeps.
    pub fn flash_there(&mut self) -> Vec<u8> {
        let there = self.machine.ask("flash");
        let there = there.strip_prefix("flash ").expect("its bytes");
        data_encoding::HEXLOWER.decode(there.as_bytes()).expect("hexadecimal")
    }

    /// All that either keeps is the same; both begin again.
    pub fn flashes_agree(&mut self) {
        let flash = self.flash_here();
        assert!(self.flash_there() == flash.bytes(), "the flashes differ");
        self.machine.ask("reset");
        assert_eq!(self.machine.run("run"), (Vec::new(), None));
        self.begin_here(flash, Cause::Power);
    }

    /// The machine starts again with nothing kept, and what is here, too: because of this.
    pub fn begins_again(&mut self, cause: Cause) {
        self.begin_here(erased::<B>(), cause);
        assert_eq!(self.machine.run("run"), (Vec::new(), None));
    }

    /// Asks the machine alone; none where it restarts by that, and what did.
    pub fn ask_there(&mut self, request: &Request) -> Result<Reply, String> {
        self.sequence += 1;
        let frame = encode(self.sequence, request).expect("a frame");
        self.machine.ask(&format!("line {}", data_encoding::HEXLOWER.encode(&frame)));
        match self.machine.run("run") {
            (_, Some(by)) => {
                self.decoder = Decoder::new();
                Err(by)
            }
            (sent, None) => {
                Ok(self.understood(&sent).unwrap_or_else(|| panic!("no answer to {request:?}")))
            }
        }
    }
}
