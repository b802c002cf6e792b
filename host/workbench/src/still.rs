//! The page that needs no server: a folder of files, for any web server. What it is asked a worker answers,
//! yawrig compiled to WebAssembly.

use super::assets;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_base::{built, files};
use yawrig_link::install::Board;
use yawrig_shared::checksum::crc32;

/// The module's workspace, where this program was built; none of a program that is given away
/// (`tests/release`).
const SOURCES: Option<&str> = match option_env!("YAWRIG_WITHOUT_SOURCES") {
    None => Some(concat!(env!("CARGO_MANIFEST_DIR"), "/../web")),
    Some(_) => None,
};
/// Beside a program that is given away, what the script builds.
const BESIDE: &str = "yawrig-web";
/// The module and the script between it and the page.
const MODULE: [&str; 2] = ["yawrig.lzma", "yawrig.js"];
/// What keeps the page in the browser.
const OFFLINE: &str = "offline.js";
const PAGE: &str = "index.html";
/// Where in the folder the boards' first images are, and where in the page it is said what to do with them.
const IMAGES: &str = "boards";
const ABOUT_IMAGES: [&str; 2] = ["<details id=\"board-first\">", "</details>"];
/// What builds it, from the root of the sources.
const BUILD: &str = "host/web/build";

/// Writes the page to `folder`; its first file.
///
/// # Errors
/// Exit 3 where there is no module and it cannot be built, or the folder cannot be written or holds another
/// page.
pub fn write(folder: &Path) -> Result<PathBuf> {
    let page = folder.join(PAGE);
    let is_ours = |text: &str| text.contains(assets::STILL_MARK);
    if std::fs::read_to_string(&page).is_ok_and(|text| !is_ours(&text)) {
        return Err(Error::data(format!("{} is another page", page.display()))
            .help("give a folder that is empty, or not there yet"));
    }
    let module = module()?;
    let mut all: Vec<(&str, Vec<u8>)> = Vec::new();
    for name in MODULE {
        let from = module.join(name);
        let bytes = std::fs::read(&from).map_err(|e| {
            Error::data(format!("cannot read {}: {e}", from.display()))
                .help(format!("in yawrig's sources run {BUILD}"))
        })?;
        all.push((name, bytes));
    }
    all.extend(
        assets::still().into_iter().map(|(name, asset)| (name, asset.text.into_owned().into())),
    );
    let images = images();
    if images.is_empty() {
        all.iter_mut().filter(|(name, _)| *name == PAGE).for_each(|(_, page)| without_images(page));
    }
    all.push((OFFLINE, offline(&all).into()));
    files::make_folder(&folder.join(IMAGES))?;
    for (name, image) in &images {
        files::write_atomically(&folder.join(IMAGES).join(name), image)?;
    }
    for (name, bytes) in &all {
        files::write_atomically(&folder.join(name), bytes)?;
    }
    Ok(page)
}

/// Of the boards that are a drive: the image for that, by its name. None where they are not there and cannot be built,
/// which is said.
fn images() -> Vec<(String, Vec<u8>)> {
    let image = |name: &str| {
        let board = Board::named(name)?;
        Ok((board.file_name(), board.image(None)?))
    };
    let all: Result<Vec<_>> = ["pico", "pico2"].map(image).into_iter().collect();
    all.unwrap_or_else(|e| {
        yawrig_base::say!("boards' images are not in the page: {e}");
        Vec::new()
    })
}

fn without_images(page: &mut Vec<u8>) {
    let text = String::from_utf8_lossy(page).into_owned();
    let [begins, ends] = ABOUT_IMAGES;
    if let Some((before, (_, after))) =
        text.split_once(begins).and_then(|(before, rest)| Some((before, rest.split_once(ends)?)))
    {
        *page = format!("{before}{after}").into();
    }
}

/// What keeps these files in the browser: another script where one of them is another.
fn offline(all: &[(&str, Vec<u8>)]) -> String {
    let names: Vec<String> = all.iter().map(|(name, _)| format!("{name:?}")).collect();
    let sums: String = all.iter().map(|(_, bytes)| format!("{:08x}", crc32(bytes))).collect();
    assets::OFFLINE
        .replace("\"FILES\"", &names.join(", "))
        .replace("\"VERSION\"", &format!("\"{:08x}\"", crc32(sums.as_bytes())))
}

/// The folder that the module is in. With the sources at hand they are built first, so that the page never
/// answers otherwise than this program; without them it lies beside this program.
fn module() -> Result<PathBuf> {
    if let Some(script) = SOURCES.map(|web| Path::new(web).join("build"))
        && script.exists()
    {
        if !Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../target/web")).exists() {
            yawrig_base::say!("building the page's module (the first time takes some minutes)");
        }
        return built::by(&script, &[], |why| {
            Error::data(format!("cannot build the page's module with {}: {why}", script.display()))
                .help(format!("run {BUILD} and see what it says"))
        });
    }
    let beside = std::env::current_exe()
        .ok()
        .map(|program| program.with_file_name(BESIDE))
        .filter(|module| module.exists());
    beside.ok_or_else(|| {
        Error::data(format!("there is no module for the page: no {BESIDE} beside this program"))
            .help(format!("in yawrig's sources run {BUILD}, and put the folder that it prints beside this program as {BESIDE}"))
    })
}
