//! `yawrig device install`: a board's image, written to the drive that the board is while it waits for one.

use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
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

/// Where an image goes.
enum To<'a> {
    Drive(PathBuf),
    File(&'a Path),
}

impl Install {
    pub fn run(&self, as_json: bool) -> Result<()> {
        let board = Board::named(&self.board)?;
        // Before an image is built.
        let to = match (&self.out, &self.drive) {
            (Some(out), _) => To::File(out),
            (None, None) => To::Drive(board.drive()?),
            (None, Some(drive)) => {
                board.check_drive(drive)?;
                To::Drive(drive.clone())
            }
        };
        let image = board.image(self.image.as_deref())?;
        let (bytes, name) = (image.len(), board.name);
        let (key, path, said) = match &to {
            To::Drive(drive) => {
                board.write(&image, drive)?;
                let to = drive.display();
                let said =
                    format!("{bytes} bytes written to {to}; `yawrig ports` lists the {name}");
                ("drive", drive.as_path(), said)
            }
            To::File(out) => {
                write_atomically(out, &image)?;
                let said = format!("{}: {bytes} bytes, for the drive of a {name}", out.display());
                ("out", *out, said)
            }
        };
        if as_json {
            let mut object = json!({
                "schema_version": SCHEMA_VERSION,
                "board": name,
                "bytes": bytes,
                "drive": null,
                "out": null,
            });
            object[key] = json!(path);
            return print_json(&object);
        }
        print_line(&said)
    }
}
