//! A zip archive with texts in it, as phyphox exports them: `Raw Data.csv`, and `meta/` about the device.

use super::grid;
use super::table::Channel;
use std::io::{Read, Seek};
use yawrig_text::rows;
use zip::ZipArchive;

/// Most bytes of a text that was compressed.
const LARGEST: u64 = 1 << 30;
/// Endings of the texts.
const ENDINGS: [&str; 4] = ["csv", "tsv", "txt", "dat"];

/// Whether it is a workbook, which is an archive, too.
pub(super) fn is_workbook(archive: &ZipArchive<impl Read + Seek>) -> bool {
    let mut names = archive.file_names().flatten();
    names.any(|name| name == "[Content_Types].xml" || name.starts_with("xl/"))
}

/// The channels of the texts in it, with their names in front where there are several.
pub(super) fn read(mut archive: ZipArchive<impl Read + Seek>) -> Result<Vec<Channel>, String> {
    let is_text = |name: &String| {
        let ending = name.rsplit_once('.').map_or("", |(_, ending)| ending);
        let hidden = name.split('/').any(|part| ["meta", "__MACOSX"].contains(&part));
        !hidden && ENDINGS.iter().any(|known| known.eq_ignore_ascii_case(ending))
    };
    let mut names: Vec<String> =
        archive.file_names().flatten().map(String::from).filter(is_text).collect();
    names.sort();
    let mut channels = Vec::new();
    for name in &names {
        let mut bytes = Vec::new();
        let entry = archive.by_name(name).map_err(|e| format!("{name}: {e}"))?;
        entry.take(LARGEST + 1).read_to_end(&mut bytes).map_err(|e| format!("{name}: {e}"))?;
        if bytes.len() as u64 > LARGEST {
            return Err(format!("{name} is larger than {} MiB", LARGEST >> 20));
        }
        // A text without numbers is about something else.
        let Ok(mut inside) = grid::of_text(&rows::decoded(&bytes)) else { continue };
        if names.len() > 1 {
            let stem = name.rsplit_once('.').map_or(name.as_str(), |(stem, _)| stem);
            inside.iter_mut().for_each(|c| c.name = format!("{stem}/{}", c.name));
        }
        channels.append(&mut inside);
    }
    match channels.is_empty() {
        true => Err("the archive holds no text with columns of numbers".to_owned()),
        false => Ok(channels),
    }
}
