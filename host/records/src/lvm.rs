//! LabVIEW Measurement, National Instruments' text: its header says what parts the columns, what the decimal
//! sign is and which columns are times, so that nothing is guessed (NI, Specification for the LabVIEW
//! Measurement File).

use super::names;
use super::table::Channel;

type Result<T> = std::result::Result<T, String>;

const FIRST_LINE: &str = "LabVIEW Measurement";
const END_OF_HEADER: &str = "***End_of_Header***";
const SPECIAL: [&str; 2] = ["***Start_Special***", "***End_Special***"];
const NAMES: &str = "X_Value";

pub(super) fn is_one(text: &str) -> bool {
    text.trim_start().starts_with(FIRST_LINE)
}

/// What its header says of a file.
struct Header {
    separator: char,
    has_decimal_comma: bool,
}

/// Columns of time: none, one for all, one for each channel.
#[derive(Clone, Copy, PartialEq)]
enum Times {
    No,
    One,
    Multi,
}

/// What stands above a segment's numbers, a value for each channel.
#[derive(Default)]
struct Segment {
    units: Vec<String>,
    steps: Vec<String>,
}

/// The channels of a text; those of the second segment and later ones with its number, `segment 2/Voltage`.
pub(super) fn of_text(text: &str) -> Result<Vec<Channel>> {
    let mut lines = text.lines().enumerate().map(|(index, line)| (index + 1, line));
    let mut header = Header { separator: '\t', has_decimal_comma: false };
    let mut times = Times::One;
    for (_, line) in lines.by_ref() {
        let tag = |name: &str| line.trim_end().strip_prefix(name)?.strip_prefix([',', '\t']);
        if line.starts_with(END_OF_HEADER) {
            break;
        }
        if let Some(separator) = tag("Separator") {
            header.separator = if separator.trim() == "Comma" { ',' } else { '\t' };
        }
        header.has_decimal_comma |= tag("Decimal_Separator") == Some(",");
        times = match tag("X_Columns").map(str::trim) {
            Some("No") => Times::No,
            Some("Multi") => Times::Multi,
            Some(_) => Times::One,
            None => times,
        };
    }
    let mut channels = Vec::new();
    let mut segment = Segment::default();
    // Where the channels of the open segment begin, and which column each is.
    let mut open: Option<(usize, Vec<usize>)> = None;
    let (mut count, mut is_special) = (0, false);
    for (number, line) in lines {
        is_special = (is_special || line.starts_with(SPECIAL[0])) && !line.starts_with(SPECIAL[1]);
        let fields: Vec<&str> = line.split(header.separator).map(str::trim).collect();
        if is_special || line.starts_with(SPECIAL[1]) {
            continue;
        }
        if fields[0] == NAMES {
            count += 1;
            let group = if count == 1 { String::new() } else { format!("segment {count}/") };
            open = Some((channels.len(), columns(&fields, times, &group, &segment, &mut channels)));
            segment = Segment::default();
        } else if let Some((first, columns)) = open.as_ref().filter(|_| is_row(&fields)) {
            for (channel, column) in channels[*first..].iter_mut().zip(columns) {
                header.push(channel, fields.get(*column).copied().unwrap_or(""), number);
            }
        } else {
            open = open.filter(|_| fields.iter().all(|f| f.is_empty()));
            let values = || fields[1..].iter().map(|f| header.plain(f)).collect();
            match fields[0] {
                "Y_Unit_Label" => segment.units = values(),
                "Delta_X" => segment.steps = values(),
                _ => {}
            }
        }
    }
    // Some programs announce columns that stay empty.
    channels
        .retain(|c: &Channel| c.values.as_ref().map_or(true, |v| v.iter().any(|v| v.is_finite())));
    match channels.is_empty() {
        true => Err(format!("there are no numbers below {NAMES}")),
        false => Ok(channels),
    }
}

/// Whether a line holds numbers: the first that is not empty begins as one does.
fn is_row(fields: &[&str]) -> bool {
    let first = fields.iter().find(|f| !f.is_empty());
    first.is_some_and(|f| f.starts_with(|c: char| c.is_ascii_digit() || "+-.,NI".contains(c)))
}

/// Opens the channels of a segment under the names in `fields`, and says which column each is.
fn columns(
    fields: &[&str],
    times: Times,
    group: &str,
    segment: &Segment,
    channels: &mut Vec<Channel>,
) -> Vec<usize> {
    let named: Vec<usize> =
        (0..fields.len()).filter(|k| !fields[*k].is_empty() && fields[*k] != "Comment").collect();
    let mut channel_number = 0;
    let mut columns = Vec::new();
    for column in named {
        let is_time = fields[column] == NAMES;
        if is_time && (times == Times::No || (times == Times::One && column > 0)) {
            continue;
        }
        let value = |of: &[String]| of.get(channel_number).cloned().filter(|v| !v.is_empty());
        let name = match (is_time, times) {
            (true, Times::Multi) => format!("{group}{NAMES} {}", channel_number + 1),
            _ => format!("{group}{}", fields[column]),
        };
        let unit = match is_time {
            true => Some("s".to_owned()),
            false => value(&segment.units).or_else(|| names::unit_in(&name)),
        };
        let step_s = value(&segment.steps).and_then(|v| v.parse().ok());
        let step_s = step_s.filter(|_| times == Times::No && !is_time);
        channels.push(Channel { name, unit, step_s, values: Ok(Vec::new()) });
        channel_number += usize::from(!is_time);
        columns.push(column);
    }
    columns
}

impl Header {
    /// With a decimal point.
    fn plain(&self, field: &str) -> String {
        if self.has_decimal_comma {
            field.replace(',', ".")
        } else {
            field.to_owned()
        }
    }

    fn push(&self, channel: &mut Channel, field: &str, line: usize) {
        let Ok(values) = &mut channel.values else { return };
        match self.plain(field).parse::<f64>() {
            Ok(value) => values.push(value),
            Err(_) if field.is_empty() => values.push(f64::NAN),
            Err(_) => channel.values = Err(format!("line {line}: {field:?} is not a number")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As LabVIEW writes it with `columns` of times, and two channels.
    fn file(columns: &str, names: &str, row: impl Fn(usize) -> String) -> String {
        let head = "LabVIEW Measurement\t\r\nWriter_Version\t2\r\nReader_Version\t2\r\nSeparator\tTab\r\nDecimal_Separator\t,\r\nMulti_Headings\tNo\r\n";
        let segment = "Time_Pref\tRelative\r\nDate\t2026/03/01\r\nTime\t17:18:18,93\r\n***End_of_Header***\t\r\n\t\r\nChannels\t2\t\r\nSamples\t3\t3\t\r\nY_Unit_Label\tDegrees\tVolts\t\r\nX_Dimension\tTime\tTime\t\r\nX0\t0,0E+0\t0,0E+0\t\r\nDelta_X\t0,005000\t0,005000\t\r\n***End_of_Header***\t\t\r\n";
        let rows: String = (0..3).map(|k| row(k) + "\r\n").collect();
        format!("{head}X_Columns\t{columns}\r\n{segment}{names}\r\n{rows}")
    }

    fn values(channel: &Channel) -> Vec<f64> {
        channel.values.clone().expect("numbers")
    }

    #[test]
    fn columns_are_what_the_header_says() {
        let none =
            of_text(&file("No", "X_Value\tYaw\tVoltage\tComment", |k| format!("\t{k},5\t-0,{k}")));
        let none = none.expect("two channels");
        assert_eq!(none.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["Yaw", "Voltage"]);
        assert_eq!((none[0].step_s, none[0].unit.as_deref()), (Some(0.005), Some("Degrees")));
        assert_eq!(
            (values(&none[0]), values(&none[1])),
            (vec![0.5, 1.5, 2.5], vec![0.0, -0.1, -0.2])
        );
        let one =
            of_text(&file("One", "X_Value\tYaw\tEmpty\tComment", |k| format!("0,0{k}\t{k},5\t\t")));
        let one = one.expect("time and a channel");
        assert_eq!(one.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["X_Value", "Yaw"]);
        assert_eq!((values(&one[0]), one[1].step_s), (vec![0.0, 0.01, 0.02], None));
        let multi = of_text(&file("Multi", "X_Value\tYaw\tX_Value\tVoltage\tComment", |k| {
            format!("0,0{k}\t{k}\t0,1{k}\t7")
        }));
        let multi = multi.expect("two times and two channels");
        let names: Vec<&str> = multi.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["X_Value 1", "Yaw", "X_Value 2", "Voltage"]);
        assert_eq!(values(&multi[2]), [0.1, 0.11, 0.12]);
    }

    #[test]
    fn segments_are_kept_apart_and_a_word_is_an_error_with_its_line() {
        let first = file("One", "X_Value\tYaw\tComment", |k| format!("0,0{k}\t{k}"));
        let again = "\r\nChannels\t1\r\nY_Unit_Label\tRad\r\n***End_of_Header***\r\nX_Value\tYaw\tComment\r\n0,5\toops\r\n";
        let both = of_text(&(first + again)).expect("segments");
        let names: Vec<&str> = both.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["X_Value", "Yaw", "segment 2/X_Value", "segment 2/Yaw"]);
        assert_eq!(values(&both[1]), [0.0, 1.0, 2.0]);
        let why = both[3].values.clone().expect_err("a word");
        assert_eq!(why, "line 29: \"oops\" is not a number");
    }
}
