//! Files as other programs write them: read as they are, or asked about with a command that works as it
//! stands.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
use yawrig_tests::process::{binary, yawrig};

pub const ROWS: usize = 3000;
pub const RATE_HZ: f64 = 200.0;

pub fn time_s(k: usize) -> f64 {
    k as f64 / RATE_HZ
}

pub fn yaw_deg(k: usize) -> f64 {
    let t = time_s(k);
    let noise = 0.02 * ((k * 7919 % 1009) as f64 / 504.0 - 1.0);
    11.0 * (-0.12 * t).exp() * (8.0 * t).cos() + noise
}

/// `head`, then a row of each sample.
pub fn table(head: &str, row: impl Fn(usize) -> String) -> String {
    let mut text = head.to_owned();
    for k in 0..ROWS {
        let _ = writeln!(text, "{}", row(k));
    }
    text
}

pub fn comma(x: f64) -> String {
    format!("{x:.5}").replace('.', ",")
}

/// Files that are read as they are: name and text, whose line with braces there is of each sample.
const READ: &[(&str, &str)] = &[
    ("units in the header.csv", "Time (s),Yaw (deg)\n{s},{deg}\n"),
    ("German.csv", "Zeit [s];Gierwinkel [°]\r\n{s,};{deg,}\r\n"),
    ("Windows-1252.csv", "Zeit [s];Gierwinkel [°]\n{s,};{deg,}\n"),
    ("numpy.txt", "# time_s yaw_deg\n{s e18} {deg e18}\n"),
    ("pandas.csv", ",time_s,yaw_deg,wind_m_s\n{k},{s},{deg or nothing},10.0\n"),
    (
        "preamble.csv",
        "Rig: Davis\nDate: 2026-03-01, 10:00\nOperator: N. N.\n\nt,psi_deg\n{s},{deg}\n",
    ),
    ("comments.csv", "# a comment, with a comma\n#another\ntime_s,yaw_deg\n{s},{deg}\n"),
    ("two rows of header.tsv", "Time\tYaw\ns\tdeg\n{s}\t{deg}\n"),
    ("UTF-16 of Excel.csv", "Time (ms)\tYaw (deg)\r\n{ms}\t{deg}\r\n"),
    ("UTF-16 big-endian.csv", "time_s,yaw_deg\n{s},{deg}\n"),
    ("mark.csv", "\u{feff}Time (s),Yaw (deg)\n{s},{deg}\n"),
    ("more columns.csv", "Time (us),Yaw rate (deg/s),Yaw (deg),Note\n{us},1.5,{deg},ok\n"),
    ("gaps.csv", "time_ms,yaw_deg\n{ms},{deg or NaN}\n"),
    ("coarse clock.csv", "time [s],yaw [deg]\n{hundredths of s},{deg}\n"),
    (
        "LabVIEW.lvm",
        "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t,\n***End_of_Header***\t\n\
         Channels\t1\t\t\nX_Value\tYaw (deg)\tComment\n{s,}\t{deg,}\n",
    ),
    ("dates.csv", "timestamp,yaw_deg\n2026-03-01 23:59:{s after 30},{deg}\n"),
    ("quoted.csv", "\"Time, elapsed (s)\",\"Yaw (deg)\"\n\"{s}\",\"{deg}\"\n"),
    ("footer.csv", "Time (s),Yaw (deg)\n{s},{deg}\nend of run\nmax,11\n"),
];

/// What cannot be known is asked for.
const ASKED_ABOUT: &[(&str, &str)] = &[
    ("no header.txt", "% run 7, spring K3\n% recorded 2026-03-01\n  {s e7}  {deg e7}\n"),
    ("no unit.csv", "Time,Yaw\n{s},{deg}\n"),
    ("it's odd names.csv", "time,CH 1 ($),CH 2\n{s},{deg},{0 1 2}\n"),
    ("milliseconds.csv", "t,yaw_deg\n{ms},{deg}\n"),
];

/// What stands in a sample's line for a word in braces.
fn value(word: &str, k: usize) -> String {
    let (s, deg) = (time_s(k), yaw_deg(k));
    match word {
        "k" => k.to_string(),
        "0 1 2" => (k % 3).to_string(),
        "s" => format!("{s:.4}"),
        "s," => comma(s),
        "s e7" => format!("{s:.7e}"),
        "s e18" => format!("{s:.18e}"),
        "s after 30" => format!("{:09.6}", 30.0 + s),
        "hundredths of s" => format!("{:.2}", (s * 100.0).floor() / 100.0),
        "ms" => (5 * k).to_string(),
        "us" => (5000 * k).to_string(),
        "deg or nothing" if k % 500 == 77 => String::new(),
        "deg or NaN" if k % 400 == 9 => "NaN".to_owned(),
        "deg" | "deg or nothing" | "deg or NaN" => format!("{deg:.5}"),
        "deg," => comma(deg),
        "deg e7" => format!("{deg:.7e}"),
        "deg e18" => format!("{deg:.18e}"),
        _ => panic!("{word}"),
    }
}

/// The file's bytes.
fn written(name: &str, text: &str) -> Vec<u8> {
    let mut all = String::new();
    for line in text.split_inclusive('\n') {
        let of_each = if line.contains('{') { 0..ROWS } else { 0..1 };
        for k in of_each {
            let mut parts = line.split(['{', '}']);
            all.extend(parts.next());
            while let (Some(word), Some(then)) = (parts.next(), parts.next()) {
                all.push_str(&value(word, k));
                all.push_str(then);
            }
        }
    }
    let utf16 = || "\u{feff}".encode_utf16().chain(all.encode_utf16());
    match name {
        "Windows-1252.csv" => all.chars().map(|c| u8::try_from(c).expect("a byte")).collect(),
        "UTF-16 of Excel.csv" => utf16().flat_map(u16::to_le_bytes).collect(),
        "UTF-16 big-endian.csv" => utf16().flat_map(u16::to_be_bytes).collect(),
        _ => all.into_bytes(),
    }
}

/// A workbook with this sheet.
fn workbook(sheet: &str) -> Vec<u8> {
    let head = "<?xml version=\"1.0\" encoding=\"UTF-8\" standalone=\"yes\"?>\n";
    let main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main";
    let office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
    let package = "http://schemas.openxmlformats.org/package/2006";
    let one = |kind: &str, target: &str| {
        format!("{head}<Relationships xmlns=\"{package}/relationships\"><Relationship Id=\"rId1\" Type=\"{office}/{kind}\" Target=\"{target}\"/></Relationships>")
    };
    let parts = [
        ("[Content_Types].xml", format!("{head}<Types xmlns=\"{package}/content-types\"/>")),
        ("_rels/.rels", one("officeDocument", "xl/workbook.xml")),
        (
            "xl/workbook.xml",
            format!("{head}<workbook xmlns=\"{main}\" xmlns:r=\"{office}\"><sheets><sheet name=\"run\" sheetId=\"1\" r:id=\"rId1\"/></sheets></workbook>"),
        ),
        ("xl/_rels/workbook.xml.rels", one("worksheet", "worksheets/sheet1.xml")),
        (
            "xl/worksheets/sheet1.xml",
            format!("{head}<worksheet xmlns=\"{main}\"><sheetData>{sheet}</sheetData></worksheet>"),
        ),
    ];
    archive(&parts)
}

/// A zip archive of these texts, without compression.
pub fn archive(parts: &[(&str, String)]) -> Vec<u8> {
    let (mut files, mut directory) = (Vec::new(), Vec::new());
    for (name, text) in parts {
        let at = files.len() as u32;
        let mut about = vec![20, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        about.extend(crc(text.as_bytes()).to_le_bytes());
        about.extend((text.len() as u32).to_le_bytes());
        about.extend((text.len() as u32).to_le_bytes());
        about.extend((name.len() as u16).to_le_bytes());
        about.extend([0, 0]);
        files.extend(b"PK\x03\x04");
        files.extend(&about);
        files.extend(name.as_bytes());
        files.extend(text.as_bytes());
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(&about);
        directory.extend([0; 10]);
        directory.extend(at.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let (at, size) = (files.len() as u32, directory.len() as u32);
    let count = (parts.len() as u16).to_le_bytes();
    files.extend(directory);
    files.extend(b"PK\x05\x06\0\0\0\0");
    files.extend([count, count].concat());
    files.extend([size.to_le_bytes(), at.to_le_bytes()].concat());
    files.extend([0, 0]);
    files
}

/// CRC-32 as zip archives have it.
fn crc(bytes: &[u8]) -> u32 {
    let bit = |c: u32, _| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 };
    !bytes.iter().fold(!0u32, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), bit))
}

#[test]
fn a_workbook_is_read_from_its_first_sheet() {
    let folder = tempfile::tempdir().expect("a folder");
    let text =
        |at: &str, word: &str| format!("<c r=\"{at}\" t=\"inlineStr\"><is><t>{word}</t></is></c>");
    let mut sheet = format!("<row r=\"1\">{}</row>", text("A1", "Rig 2, spring K3"));
    let _ = write!(
        sheet,
        "<row r=\"3\">{}{}</row>",
        text("A3", "Zeit [ms]"),
        text("B3", "Gierwinkel [°]")
    );
    for k in 0..ROWS {
        let (row, ms) = (k + 4, 5 * k);
        let _ = write!(sheet, "<row r=\"{row}\"><c r=\"A{row}\"><v>{ms}</v></c>");
        match k % 700 {
            13 => sheet.push_str("</row>"),
            _ => drop(write!(sheet, "<c r=\"B{row}\"><v>{:.6}</v></c></row>", yaw_deg(k))),
        }
    }
    std::fs::write(folder.path().join("run1.xlsx"), workbook(&sheet)).expect("room for it");
    assert!((frequency(folder.path(), "run1.xlsx") - 8.0f64.hypot(0.12)).abs() < 2e-3);
    std::fs::write(folder.path().join("bad.xlsx"), &workbook(&sheet)[..5000]).expect("room for it");
    yawrig("identify bad.xlsx").in_folder(folder.path()).run().exits(3);
}

pub fn frequency(folder: &Path, file: &str) -> f64 {
    let ended = yawrig("identify --json").and(file).in_folder(folder).run().exits(0);
    let object = ended.json();
    object["records"][0]["estimates"][0]["natural_frequency_rad_s"]["value"].as_f64().expect("wn")
}

/// The command in what is printed.
pub fn suggested(text: &str) -> String {
    let line = text.lines().find(|l| l.contains("yawrig convert")).expect("a command");
    let command = &line[line.find("yawrig convert").expect("it")..];
    command.split("   (").next().expect("it").to_owned()
}

/// Types a command in `folder`.
pub fn typed(folder: &Path, command: &str) {
    let ran = Command::new("sh")
        .args(["-c", &format!("yawrig() {{ \"$PROGRAM\" \"$@\"; }}; {command} --force")])
        .env("PROGRAM", binary())
        .current_dir(folder)
        .output()
        .expect("a shell");
    assert!(ran.status.success(), "{command}: {}", String::from_utf8_lossy(&ran.stderr));
}

#[test]
fn a_folder_of_foreign_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let expected = 8.0f64.hypot(0.12);
    let ran = |name: &str, text: &str| {
        std::fs::write(folder.join(name), written(name, text)).expect("room for it");
        yawrig("identify").and(name).in_folder(folder).run()
    };
    for (name, text) in READ {
        let ended = ran(name, text).exits(0);
        println!("{name}: {}", ended.stdout.lines().nth(3).unwrap_or_default());
        assert!((frequency(folder, name) - expected).abs() < 2e-3, "{name}");
    }
    for (name, text) in ASKED_ABOUT {
        let command = suggested(&ran(name, text).exits(3).helps().stderr);
        println!("{name}: {command}");
        assert!(
            *name != "no header.txt" || command.ends_with("--time 1 --yaw 2 --unit deg"),
            "{command}"
        );
        typed(folder, &command);
        assert!((frequency(folder, "record.csv") - expected).abs() < 2e-3, "{command}");
    }
}

#[test]
fn a_choice_is_kept_for_its_folder() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    for name in ["a.txt", "b.txt"] {
        let text = table("", |k| format!("{k} {:.5}", yaw_deg(k).to_radians()));
        std::fs::write(folder.join(name), text).expect("room for it");
    }
    let run = |command: &str| yawrig(command).in_folder(folder).run();
    run("identify b.txt").exits(3).helps();
    let convert =
        "convert a.txt a.csv --time 1 --time-unit samples --rate-hz 200 --yaw 2 --unit rad --keep";
    run(convert).exits(0).says("records.toml");
    assert!((frequency(folder, "b.txt") - 8.0f64.hypot(0.12)).abs() < 2e-3);
    std::fs::write(folder.join("records.toml"), "time = \"1\"\nyaww = \"2\"\n").expect("room");
    run("identify b.txt").exits(3).says("records.toml, line 2").helps();
}
