//! `yawrig device install`: a board's image, written to the drive that the board is while it waits for one.

use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use yawrig_base::error::Result;
use yawrig_base::files::write_atomically;
use yawrig_link::install::Board;
use yawrig_verbs::common::{print_json, print_line, SCHEMA_VERSION};

#[derive(Args, Debug)]
pub struct Install {
    /// pico, pico2 or nucleo-f446re
    #[arg(value_name = "BOARD")]
    board: String,
    /// Where its drive is mounted [default: found]
    #[arg(long, value_name = "FOLDER", conflicts_with = "out")]
    drive: Option<PathBuf>,
    /// An image that is built already, an ELF file [default: built from the sources, or the archive's]
    #[arg(long, value_name = "FILE")]
    image: Option<PathBuf>,
    /// Write the file that its drive takes, and no board
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl Install {
    pub fn run(&self, as_json: bool) -> Result<()> {
        let board = Board::named(&self.board)?;
        // Before an image is built.
        let drive = match (&self.drive, &self.out) {
            (_, Some(_)) => None,
            (Some(drive), None) => Some(drive.clone()),
            (None, None) => Some(board.drive()?),
        };
        if let Some(drive) = &drive {
            board.check_drive(drive)?;
        }
        let image = board.image(self.image.as_deref())?;
        match (&drive, &self.out) {
            (Some(drive), _) => board.write(&image, drive)?,
            (None, Some(out)) => write_atomically(out, &image)?,
            (None, None) => {}
        }
        let to = drive.iter().chain(&self.out).next();
        if as_json {
            return print_json(&json!({
                "schema_version": SCHEMA_VERSION,
                "board": board.name,
                "bytes": image.len(),
                "drive": drive,
                "out": self.out,
            }));
        }
        let to = to.map_or(String::new(), |path| path.display().to_string());
        print_line(&match drive {
            Some(_) => format!(
                "{} bytes written to {to}; `yawrig ports` lists the {}",
                image.len(),
                board.name
            ),
            None => format!("{to}: {} bytes, for the drive of a {}", image.len(), board.name),
        })
    }
}
