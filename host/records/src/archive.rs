//! A zip archive with texts in it, as phyphox exports them: `Raw Data.csv`, and `meta/` about the device; or with
//! tracks of Tracker.

use super::grid;
use super::names;
use super::table::Channel;
use super::tracker;
use super::units;
use std::io::{Read, Seek};
use yawrig_text::rows::{self, Separator};
use zip::ZipArchive;

/// Most bytes of a text that was compressed.
const LARGEST: u64 = 1 << 30;
/// When an experiment was started and stopped, by its own clock and by the phone's.
const EVENTS: &str = "meta/time.csv";
/// Endings of the texts.
const ENDINGS: [&str; 5] = ["csv", "tsv", "txt", "dat", "trk"];

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
    let pauses = pauses(&mut archive);
    for name in &names {
        let bytes = entry(&mut archive, name)?;
        let text = rows::decoded(&bytes);
        let inside = match tracker::is_one(&bytes) {
            true => tracker::of_text(&text),
            false => grid::of_text(&text),
        };
        // A text without numbers is about something else.
        let Ok(mut inside) = inside else { continue };
        for time in inside.iter_mut().filter(|c| names::as_time(c.own_name()) == Some(0)) {
            pauses.iter().for_each(|pause| pause.put_into(time));
        }
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

fn entry(archive: &mut ZipArchive<impl Read + Seek>, name: &str) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let entry = archive.by_name(name).map_err(|e| format!("{name}: {e}"))?;
    entry.take(LARGEST + 1).read_to_end(&mut bytes).map_err(|e| format!("{name}: {e}"))?;
    match bytes.len() as u64 > LARGEST {
        true => Err(format!("{name} is larger than {} MiB", LARGEST >> 20)),
        false => Ok(bytes),
    }
}

/// Where a phone's experiment was stopped and gone on with: its clock stood still meanwhile.
struct Pause {
    /// By that clock, before other pauses are put into it.
    at_s: f64,
    length_s: f64,
}

impl Pause {
    /// Moves what comes after it.
    fn put_into(&self, time: &mut Channel) {
        let scale = match time.unit.as_deref() {
            Some(unit) => units::seconds(unit).unwrap_or(1.0),
            None => 1.0,
        };
        let Ok(values) = &mut time.values else { return };
        values
            .iter_mut()
            .filter(|t| **t * scale >= self.at_s)
            .for_each(|t| *t += self.length_s / scale);
    }
}

/// The pauses that phyphox notes beside its samples, the last first; each is said.
fn pauses(archive: &mut ZipArchive<impl Read + Seek>) -> Vec<Pause> {
    let Ok(text) = entry(archive, EVENTS) else { return Vec::new() };
    let text = rows::decoded(&text);
    let events: Vec<(bool, f64, f64)> = rows::rows(&text, Separator::Comma)
        .iter()
        .filter_map(|row| {
            let number = |k: usize| row.fields.get(k)?.parse::<f64>().ok();
            Some((row.fields.first()? == "START", number(1)?, number(2)?))
        })
        .collect();
    let mut pauses: Vec<Pause> = events
        .windows(2)
        .filter(|pair| !pair[0].0 && pair[1].0)
        .map(|pair| Pause { at_s: pair[1].1, length_s: pair[1].2 - pair[0].2 })
        .filter(|pause| pause.length_s > 0.0)
        .collect();
    for Pause { at_s, length_s } in &pauses {
        yawrig_base::warn!(
            "the recording was paused at {at_s:.3} s for {length_s:.3} s ({EVENTS}): times after it are moved by so much"
        );
    }
    pauses.reverse();
    pauses
}
