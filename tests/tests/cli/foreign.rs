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

/// Each file with whether it is read as it is.
fn files() -> Vec<(&'static str, Vec<u8>, bool)> {
    let plain = |head: &str| table(head, |k| format!("{:.4},{:.5}", time_s(k), yaw_deg(k)));
    let utf16 = |text: &str, to: fn(u16) -> [u8; 2]| -> Vec<u8> {
        std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(to).collect()
    };
    let matlab_head = "% run 7, spring K3\n% recorded 2026-03-01\n";
    let labview = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t,\n***End_of_Header***\t\nChannels\t1\t\t\nX_Value\tYaw (deg)\tComment\n";
    vec![
        ("units in the header.csv", plain("Time (s),Yaw (deg)\n").into_bytes(), true),
        (
            "German.csv",
            table("Zeit [s];Gierwinkel [°]\r\n", |k| {
                format!("{};{}\r", comma(time_s(k)), comma(yaw_deg(k)))
            })
            .into_bytes(),
            true,
        ),
        (
            "Windows-1252.csv",
            // A degree sign in one byte.
            table("Zeit [s];Gierwinkel [@]\n", |k| {
                format!("{};{}", comma(time_s(k)), comma(yaw_deg(k)))
            })
            .bytes()
            .map(|b| if b == b'@' { 0xb0 } else { b })
            .collect(),
            true,
        ),
        (
            "numpy.txt",
            table("# time_s yaw_deg\n", |k| format!("{:.18e} {:.18e}", time_s(k), yaw_deg(k)))
                .into_bytes(),
            true,
        ),
        (
            "pandas.csv",
            table(",time_s,yaw_deg,wind_m_s\n", |k| {
                format!(
                    "{k},{:.4},{:.5},{:.1}",
                    time_s(k),
                    if k % 500 == 77 { f64::NAN } else { yaw_deg(k) },
                    10.0
                )
            })
            .replace("NaN", "")
            .into_bytes(),
            true,
        ),
        (
            "preamble.csv",
            plain("Rig: Davis\nDate: 2026-03-01, 10:00\nOperator: N. N.\n\nt,psi_deg\n")
                .into_bytes(),
            true,
        ),
        (
            "comments.csv",
            plain("# a comment, with a comma\n#another\ntime_s,yaw_deg\n").into_bytes(),
            true,
        ),
        (
            "two rows of header.tsv",
            table("Time\tYaw\ns\tdeg\n", |k| format!("{:.4}\t{:.5}", time_s(k), yaw_deg(k)))
                .into_bytes(),
            true,
        ),
        (
            "Excel.csv",
            utf16(
                &table("Time (ms)\tYaw (deg)\r\n", |k| format!("{}\t{:.5}\r", 5 * k, yaw_deg(k))),
                u16::to_le_bytes,
            ),
            true,
        ),
        ("big-endian.csv", utf16(&plain("time_s,yaw_deg\n"), u16::to_be_bytes), true),
        (
            "mark.csv",
            plain("\u{feff}Time (s),Yaw (rad)\n").replace("(rad)", "(deg)").into_bytes(),
            true,
        ),
        (
            "more columns.csv",
            table("Time (us),Yaw rate (deg/s),Yaw (deg),Note\n", |k| {
                format!("{},1.5,{:.5},ok", 5000 * k, yaw_deg(k))
            })
            .into_bytes(),
            true,
        ),
        (
            "gaps.csv",
            table("time_ms,yaw_deg\n", |k| {
                if k % 400 == 9 {
                    format!("{},NaN", 5 * k)
                } else {
                    format!("{},{:.5}", 5 * k, yaw_deg(k))
                }
            })
            .into_bytes(),
            true,
        ),
        (
            "coarse clock.csv",
            table("time [s],yaw [deg]\n", |k| {
                format!("{:.2},{:.5}", (time_s(k) * 100.0).floor() / 100.0, yaw_deg(k))
            })
            .into_bytes(),
            true,
        ),
        (
            "LabVIEW.lvm",
            table(labview, |k| format!("{}\t{}", comma(time_s(k)), comma(yaw_deg(k)))).into_bytes(),
            true,
        ),
        (
            "dates.csv",
            table("timestamp,yaw_deg\n", |k| {
                format!("2026-03-01 23:59:{:09.6},{:.5}", 30.0 + time_s(k), yaw_deg(k))
            })
            .into_bytes(),
            true,
        ),
        (
            "quoted.csv",
            table("\"Time, elapsed (s)\",\"Yaw (deg)\"\n", |k| {
                format!("\"{:.4}\",\"{:.5}\"", time_s(k), yaw_deg(k))
            })
            .into_bytes(),
            true,
        ),
        ("footer.csv", (plain("Time (s),Yaw (deg)\n") + "end of run\nmax,11\n").into_bytes(), true),
        // What cannot be known is asked for.
        (
            "no header.txt",
            table(matlab_head, |k| format!("  {:.7e}  {:.7e}", time_s(k), yaw_deg(k))).into_bytes(),
            false,
        ),
        ("no unit.csv", plain("Time,Yaw\n").into_bytes(), false),
        (
            "it's odd names.csv",
            table("time,CH 1 ($),CH 2\n", |k| {
                format!("{:.4},{:.5},{}", time_s(k), yaw_deg(k), k % 3)
            })
            .into_bytes(),
            false,
        ),
        (
            "milliseconds.csv",
            table("t,yaw_deg\n", |k| format!("{},{:.5}", 5 * k, yaw_deg(k))).into_bytes(),
            false,
        ),
    ]
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
    for (name, bytes, is_read) in files() {
        std::fs::write(folder.join(name), bytes).expect("room for it");
        let ended = yawrig("identify").and(name).in_folder(folder).run();
        if is_read {
            let ended = ended.exits(0);
            println!("{name}: {}", ended.stdout.lines().nth(3).unwrap_or_default());
            assert!((frequency(folder, name) - expected).abs() < 2e-3, "{name}");
            continue;
        }
        let command = suggested(&ended.exits(3).helps().stderr);
        println!("{name}: {command}");
        assert!(
            name != "no header.txt" || command.ends_with("--time 1 --yaw 2 --unit deg"),
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
