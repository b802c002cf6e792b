//! A board's image, written to the drive that the board is while it waits for one.

use crate::image::SOURCES;
use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader, ProgramHeader};
use object::LittleEndian;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use yawrig_base::error::{Error, Result};
use yawrig_base::{built, interrupt, settings};

/// How a board takes an image.
#[derive(Debug, PartialEq, Eq)]
enum Takes {
    /// Blocks of UF2 for this family of chips, by the loader in its ROM; the drive says that it is of this board.
    Uf2 { family: u32, board_id: &'static str },
    /// All bytes of the flash, by the probe on it.
    Flat,
}

/// A board that can be written to so.
#[derive(Debug, PartialEq, Eq)]
pub struct Board {
    /// As `firmware/boards/build` has it.
    pub name: &'static str,
    takes: Takes,
    /// Labels of its drive.
    labels: &'static [&'static str],
    /// How it comes to be one.
    how: &'static str,
}

const BOOTSEL: &str = "hold its BOOTSEL button while you plug it in";

/// All of them.
pub const BOARDS: [Board; 3] = [
    Board {
        name: "pico",
        takes: Takes::Uf2 { family: 0xe48b_ff56, board_id: "RPI-RP2" },
        labels: &["RPI-RP2"],
        how: BOOTSEL,
    },
    Board {
        name: "pico2",
        takes: Takes::Uf2 { family: 0xe48b_ff59, board_id: "RP2350" },
        labels: &["RP2350"],
        how: BOOTSEL,
    },
    Board {
        name: "nucleo-f446re",
        takes: Takes::Flat,
        labels: &["NODE_F446RE", "NOD_F446RE"],
        how: "plug it in",
    },
];

/// Bytes of the largest flash that there is of these.
const LARGEST: usize = 16 << 20;
/// What a drive says of itself: UF2's, and that of a probe.
const ABOUT_UF2: &str = "INFO_UF2.TXT";
const ABOUT_PROBE: &str = "MBED.HTM";
/// Where a probe says what went wrong.
const FAILED: &str = "FAIL.TXT";
/// A board has begun with its image by then.
const TAKEN_WITHIN: Duration = Duration::from_secs(10);
/// A probe has said by then what went wrong.
const FAILS_WITHIN: Duration = Duration::from_secs(3);

impl Board {
    /// The board of this name.
    ///
    /// # Errors
    /// Exit 2, naming those there are.
    pub fn named(name: &str) -> Result<&'static Self> {
        BOARDS.iter().find(|board| board.name == name).ok_or_else(|| {
            Error::usage(format!("no image for a board '{name}' can be written so"))
                .help(format!("name one of {}", BOARDS.each_ref().map(|b| b.name).join(", ")))
        })
    }

    /// What its image is called: in an archive, and on its drive.
    pub fn file_name(&self) -> String {
        let ending = if self.takes == Takes::Flat { "bin" } else { "uf2" };
        format!("yawrig-{}.{ending}", self.name)
    }

    /// Its image as its drive takes it: of this ELF file, or built from the sources, or that of the archive that this
    /// program came in.
    ///
    /// # Errors
    /// Exit 3 for a file that is no such image; exit 4 where there is none, or the sources do not build.
    pub fn image(&self, elf: Option<&Path>) -> Result<Vec<u8>> {
        let built = match (elf, SOURCES.map(|boards| Path::new(boards).join("build"))) {
            (Some(elf), _) => Some(elf.to_owned()),
            (None, Some(script)) if script.exists() => {
                let fail = |why: &str| {
                    let what = format!("cannot build the image with {}: {why}", script.display());
                    Error::device(what).help(format!("run firmware/boards/build {}", self.name))
                };
                Some(built::by(&script, &[self.name], fail)?)
            }
            _ => None,
        };
        let read = |path: &Path| {
            let why = |e: std::io::Error| format!("cannot read {}: {e}", path.display());
            fs::read(path).map_err(|e| Error::data(why(e)))
        };
        let Some(elf) = built else {
            let name = self.file_name();
            let beside = std::env::current_exe()
                .ok()
                .map(|program| program.with_file_name("firmware").join(&name))
                .filter(|image| image.exists());
            let beside = beside.ok_or_else(|| {
                Error::device(format!("there is no firmware/{name} beside this program"))
                    .help("take the program from its archive, which has one, or give an image that is built")
            })?;
            return read(&beside);
        };
        let (start, flat) = flat(&read(&elf)?).ok_or_else(|| {
            Error::data(format!(
                "{} is no image of a board (an ELF file of 32 bits)",
                elf.display()
            ))
            .help(format!("give what firmware/boards/build {} prints", self.name))
        })?;
        Ok(match self.takes {
            Takes::Flat => flat,
            Takes::Uf2 { family, .. } => uf2(start, &flat, family),
        })
    }

    /// The drive that it is now, of those that are mounted.
    ///
    /// # Errors
    /// Exit 4: none, or several.
    pub fn drive(&self) -> Result<PathBuf> {
        let mut found: Vec<PathBuf> =
            mounts().into_iter().filter(|drive| self.is_drive(drive, false)).collect();
        if let (Some(drive), true) = (found.pop(), found.is_empty()) {
            return Ok(drive);
        }
        if let Some(device) = self.label().filter(|_| found.is_empty()) {
            let what = format!("the drive of the {} is not mounted", self.name);
            let mount = format!("udisksctl mount -b {}", device.display());
            return Err(Error::device(what).help(format!("run {mount}, and this once more")));
        }
        let (what, how) = match found.is_empty() {
            true => ("no drive of a", self.how),
            false => ("several drives of a", "leave one of them plugged in"),
        };
        Err(Error::device(format!("{what} {} is there", self.name)).help(format!(
            "{how}, or say where its drive is mounted: {}",
            settings::given("drive", "FOLDER")
        )))
    }

    /// Its drive by its label, mounted or not, where the system shows that.
    fn label(&self) -> Option<PathBuf> {
        let device = |label: &&str| Path::new("/dev/disk/by-label").join(label);
        self.labels.iter().map(device).find(|device| device.exists())
    }

    /// That this folder is its drive.
    ///
    /// # Errors
    /// Exit 2, saying what is missing.
    pub fn check_drive(&self, drive: &Path) -> Result<()> {
        if self.is_drive(drive, true) {
            return Ok(());
        }
        let what = match &self.takes {
            Takes::Uf2 { board_id, .. } => format!("no {ABOUT_UF2} with Board-ID: {board_id}"),
            Takes::Flat => format!("no {ABOUT_PROBE}"),
        };
        Err(Error::usage(format!("{} is no drive of a {}: {what}", drive.display(), self.name))
            .help(format!("{}, and give the folder where its drive is mounted", self.how)))
    }

    /// Where the user `said` so, a probe's may be mounted under any name.
    fn is_drive(&self, drive: &Path, said: bool) -> bool {
        let name =
            || drive.file_name().is_some_and(|n| self.labels.iter().any(|label| n == *label));
        match &self.takes {
            Takes::Uf2 { board_id, .. } => {
                fs::read_to_string(drive.join(ABOUT_UF2)).is_ok_and(|about| {
                    about.lines().any(|l| l.trim() == format!("Board-ID: {board_id}"))
                })
            }
            Takes::Flat => drive.join(ABOUT_PROBE).exists() && (said || name()),
        }
    }

    /// Writes an image to its drive, and sees the board take it.
    ///
    /// # Errors
    /// Exit 4 where it is not taken; exit 130 where the user stops it.
    pub fn write(&self, image: &[u8], drive: &Path) -> Result<()> {
        let path = drive.join(self.file_name());
        let had_label = self.label().is_some();
        let written = File::create(&path).and_then(|mut file| {
            file.write_all(image)?;
            file.sync_all()
        });
        let began = Instant::now();
        loop {
            interrupt::check()?;
            // What was read of a drive may be there for longer than it.
            let is_there = self.is_drive(drive, true) && (!had_label || self.label().is_some());
            // It restarts with the last byte, and its drive goes with the system still at work on it.
            match (&self.takes, &written) {
                (Takes::Uf2 { .. }, _) if !is_there => return Ok(()),
                (_, Err(e)) if began.elapsed() > FAILS_WITHIN => {
                    let what = format!("cannot write {}: {e}", path.display());
                    return Err(Error::device(what).help(self.how));
                }
                (Takes::Uf2 { .. }, _) if began.elapsed() > TAKEN_WITHIN => {
                    let what =
                        format!("{} was written, and the board does not begin", path.display());
                    return Err(Error::device(what).help(self.how));
                }
                // The probe may show what it said of another image until then.
                (Takes::Flat, Ok(())) if began.elapsed() > FAILS_WITHIN => {
                    let Ok(why) = fs::read_to_string(drive.join(FAILED)) else { return Ok(()) };
                    let what = format!("the board has not taken its image: {}", why.trim());
                    return Err(Error::device(what).help("unplug it, plug it in, and try again"));
                }
                _ => {}
            }
            std::thread::sleep(Duration::from_millis(100));
        }
    }
}

/// Where drives are mounted.
fn mounts() -> Vec<PathBuf> {
    if cfg!(windows) {
        return ('A'..='Z').map(|letter| PathBuf::from(format!("{letter}:\\"))).collect();
    }
    if let Ok(text) = fs::read_to_string("/proc/self/mounts") {
        // A blank in a path is written as its octal number.
        let place = |line: &str| Some(PathBuf::from(line.split(' ').nth(1)?.replace("\\040", " ")));
        return text.lines().filter_map(place).collect();
    }
    let volumes = fs::read_dir("/Volumes").into_iter().flatten().flatten();
    volumes.map(|entry| entry.path()).collect()
}

/// What an ELF file has flash hold: the address of the first byte, and all bytes up to the last, erased flash between
/// them.
fn flat(elf: &[u8]) -> Option<(u32, Vec<u8>)> {
    let header = FileHeader32::<LittleEndian>::parse(elf).ok()?;
    let endian = header.endian().ok()?;
    let mut parts: Vec<(u32, &[u8])> = Vec::new();
    for part in header.program_headers(endian, elf).ok()? {
        let bytes = part.data(endian, elf).ok()?;
        if part.p_type(endian) == PT_LOAD && !bytes.is_empty() {
            parts.push((part.p_paddr(endian), bytes));
        }
    }
    parts.sort_by_key(|part| part.0);
    let (start, _) = *parts.first()?;
    let mut all = Vec::new();
    for (at, bytes) in parts {
        let gap = ((at - start) as usize).checked_sub(all.len()).filter(|gap| *gap <= LARGEST)?;
        all.resize(all.len() + gap, 0xff);
        all.extend_from_slice(bytes);
    }
    Some((start, all))
}

/// Blocks of UF2 (<https://github.com/microsoft/uf2>): 256 bytes in each 512.
fn uf2(start: u32, flat: &[u8], family: u32) -> Vec<u8> {
    const PAYLOAD: usize = 256;
    const HAS_FAMILY: u32 = 0x2000;
    let count = flat.len().div_ceil(PAYLOAD) as u32;
    let mut out = Vec::new();
    for (k, piece) in flat.chunks(PAYLOAD).enumerate() {
        let at = start + (k * PAYLOAD) as u32;
        let head =
            [0x0a32_4655, 0x9e5d_5157, HAS_FAMILY, at, PAYLOAD as u32, k as u32, count, family];
        out.extend(head.iter().flat_map(|word| word.to_le_bytes()));
        let mut data = [0; 476];
        data[..PAYLOAD].fill(0xff);
        data[..piece.len()].copy_from_slice(piece);
        out.extend(data);
        out.extend(0x0ab1_6f30_u32.to_le_bytes());
    }
    out
}
