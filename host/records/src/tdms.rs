//! TDMS, LabVIEW's measurement files.
//!
//! Reference: National Instruments, "TDMS File Format Internal Structure". A file is a row of segments:
//! a lead-in of 28 bytes, what is new about groups and channels, then their raw data, chunk after chunk
//! of the same shape. Read here and not by a crate, since those there are misread what LabVIEW writes
//! every day: `tdms` 0.3 never ends on a segment without data, `tdms-rs` 2.0 reads the first chunk
//! of each segment only and takes interleaved data for contiguous.
//!
//! Refused, rather than misread: raw data of DAQmx, scales (`NI_Scale...`), extended and complex numbers.

use super::table::Channel;
use std::collections::HashMap;

const META_DATA: u32 = 1 << 1;
const NEW_OBJECTS: u32 = 1 << 2;
const RAW_DATA: u32 = 1 << 3;
const INTERLEAVED: u32 = 1 << 5;
const BIG_ENDIAN: u32 = 1 << 6;
const DAQMX: u32 = 1 << 7;
const LEAD_IN: usize = 28;
/// Where LabVIEW was ended in the middle of a segment.
const UNFINISHED: u64 = u64::MAX;

type Result<T> = std::result::Result<T, String>;

/// Raw data of one object in one chunk.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Index {
    kind: u32,
    count: u64,
    /// Bytes in a chunk.
    bytes: u64,
}

#[derive(Debug, Default)]
struct Object {
    values: Vec<f64>,
    /// Of its last segment with raw data.
    index: Option<Index>,
    properties: HashMap<String, Property>,
    refused: Option<String>,
}

#[derive(Clone, Debug, PartialEq)]
enum Property {
    Text(String),
    Number(f64),
    Other,
}

pub(super) fn of_bytes(bytes: &[u8]) -> Result<Vec<Channel>> {
    let mut objects = Objects::default();
    let mut at = 0;
    while at < bytes.len() {
        at = objects.segment(bytes, at)?;
    }
    let channels = objects.order.iter().filter_map(|path| {
        let object = objects.by_path.get(path)?;
        let [group, name] = &names(path)[..] else { return None };
        Some(channel(format!("{group}/{name}"), object))
    });
    Ok(channels.collect())
}

fn channel(name: String, object: &Object) -> Channel {
    let property = |name: &str| object.properties.get(name);
    let text = |name: &str| match property(name) {
        Some(Property::Text(text)) => Some(text.clone()),
        _ => None,
    };
    let step_s = match property("wf_increment") {
        Some(Property::Number(step_s)) => Some(*step_s),
        _ => None,
    };
    let scaled = object.properties.keys().any(|name| name.starts_with("NI_Scale"))
        || property("NI_Number_Of_Scales").is_some();
    let is_scaled_already = text("NI_Scaling_Status").is_some_and(|status| status == "scaled");
    let values = match &object.refused {
        Some(why) => Err(why.clone()),
        None if scaled && !is_scaled_already => Err(
            "its numbers are raw and its scale (NI_Scale) is not applied here: export it scaled"
                .to_owned(),
        ),
        None => Ok(object.values.clone()),
    };
    Channel { name, unit: text("unit_string"), step_s, values }
}

/// Group and channel of `/'group'/'channel'`; a quote in a name is doubled.
fn names(path: &str) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    let mut inside = false;
    let mut characters = path.chars().peekable();
    while let Some(c) = characters.next() {
        match (c, inside) {
            ('\'', true) if characters.peek() == Some(&'\'') => {
                characters.next();
                if let Some(name) = names.last_mut() {
                    name.push('\'');
                }
            }
            ('\'', true) => inside = false,
            ('\'', false) => {
                inside = true;
                names.push(String::new());
            }
            (c, true) => {
                if let Some(name) = names.last_mut() {
                    name.push(c);
                }
            }
            (_, false) => {}
        }
    }
    names
}

#[derive(Debug, Default)]
struct Objects {
    order: Vec<String>,
    by_path: HashMap<String, Object>,
    /// Objects with raw data in the present segment, in order.
    active: Vec<String>,
}

impl Objects {
    /// Reads the segment at `at`; where the next one begins.
    fn segment(&mut self, file: &[u8], at: usize) -> Result<usize> {
        let mut lead = Bytes { bytes: file, at, big_endian: false };
        if lead.take(4)? != b"TDSm" {
            return Err(format!("no segment begins at byte {at}"));
        }
        let contents = lead.u32()?;
        let mut reader = Bytes { big_endian: contents & BIG_ENDIAN != 0, ..lead };
        let _version = reader.u32()?;
        let (next, raw) = (reader.u64()?, reader.u64()?);
        let begin = at + LEAD_IN;
        let end = match next {
            // What had come is there.
            UNFINISHED => file.len(),
            next => usize::try_from(next)
                .ok()
                .and_then(|next| begin.checked_add(next))
                .filter(|end| *end <= file.len())
                .ok_or(format!("the segment at byte {at} is cut off"))?,
        };
        if contents & NEW_OBJECTS != 0 {
            self.active.clear();
        }
        if contents & META_DATA != 0 {
            for _ in 0..reader.u32()? {
                self.object(&mut reader)?;
            }
        }
        if contents & RAW_DATA != 0 {
            let from = usize::try_from(raw).ok().and_then(|raw| begin.checked_add(raw));
            let from = from.filter(|from| *from <= end).ok_or("raw data beyond its segment")?;
            if contents & DAQMX != 0 {
                self.refuse_active("raw data of DAQmx, which has no scale of its own");
            } else {
                self.raw(&file[from..end], contents, reader.big_endian)?;
            }
        }
        Ok(end)
    }

    fn refuse_active(&mut self, why: &str) {
        for path in &self.active {
            if let Some(object) = self.by_path.get_mut(path) {
                object.refused = Some(why.to_owned());
            }
        }
    }

    /// What is new about one object.
    fn object(&mut self, reader: &mut Bytes) -> Result<()> {
        const NO_DATA: u32 = 0xFFFF_FFFF;
        const AS_BEFORE: u32 = 0;
        const DAQMX_INDEX: [u32; 2] = [0x1269, 0x1369];
        let path = reader.text()?;
        if !self.by_path.contains_key(&path) {
            self.order.push(path.clone());
        }
        let object = self.by_path.entry(path.clone()).or_default();
        let has_data = match reader.u32()? {
            NO_DATA => false,
            AS_BEFORE => true,
            index if DAQMX_INDEX.contains(&index) => {
                object.refused =
                    Some("raw data of DAQmx, which has no scale of its own".to_owned());
                reader.daqmx_index(index == DAQMX_INDEX[1])?;
                true
            }
            _ => {
                let (kind, dimension, count) = (reader.u32()?, reader.u32()?, reader.u64()?);
                let bytes = match size(kind) {
                    _ if kind == TEXT => reader.u64()?,
                    Some(size) => count.checked_mul(size).ok_or("a channel without end")?,
                    None => return Err(format!("numbers of the kind {kind:#x} are not read")),
                };
                if dimension != 1 {
                    return Err(format!("an array of {dimension} dimensions"));
                }
                object.index = Some(Index { kind, count, bytes });
                true
            }
        };
        for _ in 0..reader.u32()? {
            let name = reader.text()?;
            let value = reader.property()?;
            object.properties.insert(name, value);
        }
        if has_data && !self.active.contains(&path) {
            self.active.push(path);
        } else if !has_data {
            self.active.retain(|active| *active != path);
        }
        Ok(())
    }

    /// Raw data: chunks until it is over, the last one perhaps cut short.
    fn raw(&mut self, raw: &[u8], contents: u32, big_endian: bool) -> Result<()> {
        let mut plan = Vec::new();
        for path in &self.active {
            let object = self.by_path.get(path).ok_or("raw data of no channel")?;
            plan.push((path.clone(), object.index.ok_or(format!("{path} has no raw data index"))?));
        }
        let chunk: u64 = plan.iter().map(|(_, index)| index.bytes).sum();
        if chunk == 0 {
            return if raw.is_empty() { Ok(()) } else { Err("raw data of no channel".to_owned()) };
        }
        let chunk = usize::try_from(chunk).map_err(|_| "a chunk without end")?;
        for part in raw.chunks(chunk) {
            if contents & INTERLEAVED != 0 {
                self.interleaved(part, &plan, big_endian)?;
                continue;
            }
            let mut at = 0;
            for (path, index) in &plan {
                let end = at + index.bytes as usize;
                // Where a chunk is cut short, so are its last channels.
                let bytes = &part[at.min(part.len())..end.min(part.len())];
                self.take(path, index.kind, bytes, big_endian);
                at = end;
            }
        }
        Ok(())
    }

    fn interleaved(&mut self, part: &[u8], plan: &[(String, Index)], big: bool) -> Result<()> {
        let sizes: Option<Vec<usize>> =
            plan.iter().map(|(_, index)| size(index.kind).map(|size| size as usize)).collect();
        let sizes = sizes.ok_or("interleaved text")?;
        let row: usize = sizes.iter().sum();
        for values in part.chunks_exact(row) {
            let mut at = 0;
            for ((path, index), size) in plan.iter().zip(&sizes) {
                self.take(path, index.kind, &values[at..at + size], big);
                at += size;
            }
        }
        Ok(())
    }

    fn take(&mut self, path: &str, kind: u32, bytes: &[u8], big_endian: bool) {
        let Some(object) = self.by_path.get_mut(path) else { return };
        let Some(size) = size(kind) else {
            object.refused = Some("text".to_owned());
            return;
        };
        for value in bytes.chunks_exact(size as usize) {
            let mut little = [0; 16];
            little[..value.len()].copy_from_slice(value);
            if big_endian {
                little[..value.len()].reverse();
            }
            match number(kind, &little) {
                Some(number) => object.values.push(number),
                None => {
                    object.refused = Some(format!("numbers of the kind {kind:#x}"));
                    return;
                }
            }
        }
    }
}

const TEXT: u32 = 0x20;
const TIME_STAMP: u32 = 0x44;

/// Bytes of one value.
fn size(kind: u32) -> Option<u64> {
    Some(match kind {
        1 | 5 | 0x21 => 1,
        2 | 6 => 2,
        3 | 7 | 9 | 0x19 => 4,
        4 | 8 | 10 | 0x1A | 0x0008_000C => 8,
        TIME_STAMP | 0x0010_000D => 16,
        _ => return None,
    })
}

/// A value of sixteen little-endian bytes at most; a time in seconds.
fn number(kind: u32, little: &[u8; 16]) -> Option<f64> {
    let [b0, b1, b2, b3, b4, b5, b6, b7, ..] = *little;
    let (two, four) = ([b0, b1], [b0, b1, b2, b3]);
    let eight = [b0, b1, b2, b3, b4, b5, b6, b7];
    Some(match kind {
        1 => f64::from(b0 as i8),
        2 => f64::from(i16::from_le_bytes(two)),
        3 => f64::from(i32::from_le_bytes(four)),
        4 => i64::from_le_bytes(eight) as f64,
        5 => f64::from(b0),
        6 => f64::from(u16::from_le_bytes(two)),
        7 => f64::from(u32::from_le_bytes(four)),
        8 => u64::from_le_bytes(eight) as f64,
        9 | 0x19 => f64::from(f32::from_le_bytes(four)),
        10 | 0x1A => f64::from_le_bytes(eight),
        TIME_STAMP => {
            // 2^-64 s, then whole seconds since 1904.
            let whole = u128::from_le_bytes(*little) >> 64;
            whole as i64 as f64 + u64::from_le_bytes(eight) as f64 * 2.0_f64.powi(-64)
        }
        _ => return None,
    })
}

/// A file read from front to back.
#[derive(Clone, Copy)]
struct Bytes<'a> {
    bytes: &'a [u8],
    at: usize,
    big_endian: bool,
}

impl<'a> Bytes<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        let end = self.at.checked_add(count).filter(|end| *end <= self.bytes.len());
        let end = end.ok_or(format!("it ends at byte {} in the middle of a value", self.at))?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        if self.big_endian {
            array.reverse();
        }
        Ok(array)
    }

    fn u32(&mut self) -> Result<u32> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64> {
        self.array().map(u64::from_le_bytes)
    }

    fn text(&mut self) -> Result<String> {
        let length = self.u32()? as usize;
        Ok(String::from_utf8_lossy(self.take(length)?).into_owned())
    }

    fn property(&mut self) -> Result<Property> {
        let kind = self.u32()?;
        if kind == TEXT {
            return self.text().map(Property::Text);
        }
        let size = size(kind).ok_or(format!("a property of the kind {kind:#x}"))? as usize;
        let mut little = [0; 16];
        little[..size].copy_from_slice(self.take(size)?);
        if self.big_endian {
            little[..size].reverse();
        }
        Ok(number(kind, &little).map_or(Property::Other, Property::Number))
    }

    /// Kind, dimension, count; scalers of 20 bytes (17 of digital lines); widths of 4 bytes.
    fn daqmx_index(&mut self, digital: bool) -> Result<()> {
        self.take(16)?;
        let scalers = self.u32()? as usize;
        let each = if digital { 17 } else { 20 };
        self.take(scalers.checked_mul(each).ok_or("scalers without end")?)?;
        let widths = self.u32()? as usize;
        self.take(widths.checked_mul(4).ok_or("widths without end")?).map(drop)
    }
}
