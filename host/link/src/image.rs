//! The ARM image: found, or built from the sources it stands beside.

use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_base::{built, settings};

/// The boards' workspaces, where this program was built; none of a program that is given away
/// (`tests/release`).
pub const SOURCES: Option<&str> = match option_env!("YAWRIG_WITHOUT_SOURCES") {
    None => Some(concat!(env!("CARGO_MANIFEST_DIR"), "/../../firmware/boards")),
    Some(_) => None,
};
const BOARD: &str = "mps2-an386";
const NAME: &str = "yawrig-mps2-an386";
/// What builds it, from the root of the sources.
const BUILD: &str = "firmware/boards/build mps2-an386";

/// The image's path. With the sources at hand they are built first, so that the image is never an
/// older firmware than this program; without them it lies beside this program.
///
/// # Errors
/// Exit 4: no image and no sources, or the sources do not build.
pub fn find() -> Result<PathBuf> {
    if let Some(script) = SOURCES.map(|boards| Path::new(boards).join("build"))
        && script.exists()
    {
        return build(&script);
    }
    let beside = std::env::current_exe()
        .ok()
        .map(|program| program.with_file_name(NAME))
        .filter(|image| image.exists());
    beside.ok_or_else(|| {
        let sources = SOURCES.map_or(String::new(), |boards| format!(" and no {boards}/{BOARD}"));
        Error::device(format!("there is no ARM image: no {NAME} beside this program{sources}"))
            .help(format!(
                "in yawrig's sources run {BUILD}, and put what it builds beside this program"
            ))
    })
}

/// Whether the image is still to be built, which takes a minute the first time; later a moment.
pub fn takes_a_minute() -> bool {
    SOURCES.map(Path::new).is_some_and(|boards| {
        let built = boards.join("../../target/boards");
        let image = |folder| built.join(folder).join("thumbv7em-none-eabihf/release").join(NAME);
        boards.join("build").exists() && !["", "debian"].map(image).iter().any(|path| path.exists())
    })
}

fn build(script: &Path) -> Result<PathBuf> {
    let fail = |why: &str| {
        Error::device(format!("cannot build the ARM image with {}: {why}", script.display())).help(
            format!(
                "run {BUILD} and see what it says, or use {}",
                settings::given("device", "emulated")
            ),
        )
    };
    built::by(script, &[BOARD], fail)
}
