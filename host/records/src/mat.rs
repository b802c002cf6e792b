//! MAT-files of version 5, the default of MATLAB's and Octave's `save` (-v6, -v7): MathWorks, MAT-File
//! Format.
//!
//! Read here and not by a crate, since none reads structures, in which most programs keep a run's channels.

use super::table::Channel;
use flate2::read::ZlibDecoder;
use std::io::Read;

type Result<T> = std::result::Result<T, String>;

const HEADER: usize = 128;
/// Kinds of elements that are no numbers.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Flag of a matrix: it has an imaginary part.
const COMPLEX: u32 = 0x0800;
/// Most bytes of a variable that was compressed.
const LARGEST: u64 = 1 << 30;
/// Structures within structures.
const DEEPEST: usize = 8;

/// A variable is a channel, a column of a matrix `data(:,2)`, a field of a structure `run/yaw_deg`, of one of
/// several `run(3)/yaw_deg`, of a cell `runs{3}`; a matrix that lies on its side has rows, `data(2,:)`.
pub(super) fn of_bytes(bytes: &[u8]) -> Result<Vec<Channel>> {
    let (header, body) = bytes.split_at_checked(HEADER).ok_or_else(cut)?;
    let little = match &header[126..] {
        b"IM" => true,
        b"MI" => false,
        _ => return Err("its header says nothing of the order of bytes".to_owned()),
    };
    let mut channels = Vec::new();
    let mut elements = Elements { bytes: body, little };
    while !elements.bytes.is_empty() {
        let (kind, data) = elements.next()?;
        if kind == COMPRESSED {
            let mut inflated = Vec::new();
            let mut inflater = ZlibDecoder::new(data).take(LARGEST);
            inflater.read_to_end(&mut inflated).map_err(|e| e.to_string())?;
            let (kind, data) = Elements { bytes: &inflated, little }.next()?;
            variable(kind, Elements { bytes: data, little }, None, 0, &mut channels)?;
        } else {
            variable(kind, Elements { bytes: data, little }, None, 0, &mut channels)?;
        }
    }
    Ok(channels)
}

fn cut() -> String {
    "the file ends within a variable".to_owned()
}

/// What is left of a row of elements, each with its kind and its size.
struct Elements<'a> {
    bytes: &'a [u8],
    little: bool,
}

impl<'a> Elements<'a> {
    fn word(&self, at: usize) -> Result<u32> {
        let bytes = self.bytes.get(at..at + 4).ok_or_else(cut)?;
        let bytes = bytes.try_into().expect("four bytes");
        Ok(if self.little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) })
    }

    fn next(&mut self) -> Result<(u32, &'a [u8])> {
        let first = self.word(0)?;
        // Up to four bytes stand within the eight of the tag.
        let (kind, from, size): (u32, usize, usize) = match first >> 16 {
            0 => (first, 8, self.word(4)? as usize),
            size => (first & 0xffff, 4, size as usize),
        };
        let data = self.bytes.get(from..from.saturating_add(size)).ok_or_else(cut)?;
        let end = if kind == COMPRESSED { from + size } else { (from + size).next_multiple_of(8) };
        self.bytes = self.bytes.get(end..).unwrap_or_default();
        Ok((kind, data))
    }

    fn of(&self, bytes: &'a [u8]) -> Self {
        Self { bytes, little: self.little }
    }

    /// The next element's whole numbers.
    fn words(&mut self) -> Result<Vec<u32>> {
        let (_, data) = self.next()?;
        let words = self.of(data);
        (0..data.len() / 4).map(|k| words.word(4 * k)).collect()
    }
}

/// The channels of a variable, or of a structure's field `named` by its path.
fn variable(
    kind: u32,
    mut elements: Elements,
    named: Option<String>,
    depth: usize,
    channels: &mut Vec<Channel>,
) -> Result<()> {
    // An empty field has no content at all.
    if kind != MATRIX || elements.bytes.is_empty() {
        return Ok(());
    }
    let flags = *elements.words()?.first().ok_or_else(cut)?;
    let size: Vec<usize> = elements.words()?.iter().map(|n| *n as usize).collect();
    let (_, own) = elements.next()?;
    let name = named.unwrap_or_else(|| String::from_utf8_lossy(own).into_owned());
    let mut unread = |why: &str| {
        let values = Err(why.to_owned());
        channels.push(Channel { name: name.clone(), unit: None, step_s: None, values });
        Ok(())
    };
    match flags & 0xff {
        1 => cells(elements, &name, &size, depth, channels),
        2 => structure(elements, &name, &size, depth, channels),
        4 => unread("a text"),
        5 => unread("a sparse matrix"),
        6..=15 if flags & COMPLEX != 0 => unread("complex numbers"),
        6..=15 => {
            let (kind, data) = elements.next()?;
            let values = numbers(kind, data, elements.little)?;
            if Some(values.len()) != size.iter().try_fold(1, |n: usize, s| n.checked_mul(*s)) {
                return Err(cut());
            }
            matrix(&name, &size, values, channels);
            Ok(())
        }
        _ => unread("an object"),
    }
}

/// Cells of a variable that are channels, at most: more are a list of something else.
const MAX_CELLS: usize = 1024;

fn cells(
    mut elements: Elements,
    name: &str,
    size: &[usize],
    depth: usize,
    channels: &mut Vec<Channel>,
) -> Result<()> {
    if depth == DEEPEST {
        return Err(format!("cells within cells more than {DEEPEST} deep"));
    }
    let count = size.iter().try_fold(1, |n: usize, s| n.checked_mul(*s)).ok_or_else(cut)?;
    if count > MAX_CELLS {
        let values = Err(format!("{count} cells, of which none is read"));
        channels.push(Channel { name: name.to_owned(), unit: None, step_s: None, values });
        return Ok(());
    }
    for k in 0..count {
        let (kind, data) = elements.next()?;
        let cell = Some(format!("{name}{{{}}}", k + 1));
        variable(kind, elements.of(data), cell, depth + 1, channels)?;
    }
    Ok(())
}

fn structure(
    mut elements: Elements,
    name: &str,
    size: &[usize],
    depth: usize,
    channels: &mut Vec<Channel>,
) -> Result<()> {
    if depth == DEEPEST {
        return Err(format!("structures within structures more than {DEEPEST} deep"));
    }
    let width = elements.words()?.first().map_or(0, |n| *n as usize).max(1);
    let (_, fields) = elements.next()?;
    let text = |field: &[u8]| {
        let end = field.iter().position(|c| *c == 0).unwrap_or(field.len());
        String::from_utf8_lossy(&field[..end]).into_owned()
    };
    let fields: Vec<String> = fields.chunks(width).map(text).collect();
    let count = size.iter().try_fold(1, |n: usize, s| n.checked_mul(*s)).ok_or_else(cut)?;
    if fields.is_empty() {
        return Ok(());
    }
    for k in 0..count {
        let of = if count == 1 { name.to_owned() } else { format!("{name}({})", k + 1) };
        for field in &fields {
            let (kind, data) = elements.next()?;
            let path = Some(format!("{of}/{field}"));
            variable(kind, elements.of(data), path, depth + 1, channels)?;
        }
    }
    Ok(())
}

fn matrix(name: &str, size: &[usize], values: Vec<f64>, channels: &mut Vec<Channel>) {
    let mut add = |name: String, values| {
        channels.push(Channel { name, unit: None, step_s: None, values });
    };
    match *size {
        // The numbers stand column by column.
        [rows, columns @ 2..=MAX_COLUMNS] if rows > 1 && columns <= rows => {
            for (k, column) in values.chunks(rows).enumerate() {
                add(column_name(name, k), Ok(column.to_vec()));
            }
        }
        [rows @ 2..=MAX_COLUMNS, columns] if rows < columns => {
            for k in 0..rows {
                let row = values.iter().skip(k).step_by(rows).copied().collect();
                add(format!("{name}({},:)", k + 1), Ok(row));
            }
        }
        _ => add(name.to_owned(), vector(size).map(|()| values)),
    }
}

/// Columns of a matrix that are channels of their own, at most.
pub(super) const MAX_COLUMNS: usize = 32;

/// As MATLAB writes a column: `data(:,2)`.
pub(super) fn column_name(matrix: &str, index: usize) -> String {
    format!("{matrix}(:,{})", index + 1)
}

/// That a variable is a row or a column.
fn vector(size: &[usize]) -> Result<()> {
    if size.iter().filter(|n| **n != 1).count() <= 1 {
        return Ok(());
    }
    let size: Vec<String> = size.iter().map(usize::to_string).collect();
    Err(format!("a {} matrix", size.join(" by ")))
}

/// Whatever a matrix is, its numbers are kept in the smallest kind that holds them.
fn numbers(kind: u32, data: &[u8], little: bool) -> Result<Vec<f64>> {
    macro_rules! of {
        ($kind:ty) => {{
            let (each, rest) = data.as_chunks::<{ size_of::<$kind>() }>();
            let number = |bytes: &[u8; size_of::<$kind>()]| match little {
                true => <$kind>::from_le_bytes(*bytes) as f64,
                false => <$kind>::from_be_bytes(*bytes) as f64,
            };
            if rest.is_empty() {
                Ok(each.iter().map(number).collect())
            } else {
                Err(cut())
            }
        }};
    }
    match kind {
        1 => of!(i8),
        2 => of!(u8),
        3 => of!(i16),
        4 => of!(u16),
        5 => of!(i32),
        6 => of!(u32),
        7 => of!(f32),
        9 => of!(f64),
        12 => of!(i64),
        13 => of!(u64),
        kind => Err(format!("numbers of kind {kind}, which the format does not have")),
    }
}
