//! Files that do not say what they hold: the command that is printed is typed as it stands, and reads the
//! swing.

use crate::foreign::{
    archive, comma, frequency, suggested, table, time_s, typed, yaw_deg, RATE_HZ, ROWS,
};
use yawrig_tests::process::yawrig;

const WN_RAD_S: f64 = 8.0;

/// What a motor does beside the swing: it never dies away.
fn motor(k: usize) -> f64 {
    30.0 * (5.0 * time_s(k)).sin()
}

/// A LabVIEW file with these columns of times.
fn labview(columns: &str, names: &str, row: impl Fn(usize) -> String) -> String {
    let head = format!(
        "LabVIEW Measurement\t\r\nWriter_Version\t2\r\nSeparator\tTab\r\nDecimal_Separator\t,\r\nX_Columns\t{columns}\r\n\
         ***End_of_Header***\t\r\n\t\r\nChannels\t2\t\r\nY_Unit_Label\tdeg\tV\t\r\nX_Dimension\tTime\tTime\t\r\n\
         Delta_X\t0,005\t0,005\t\r\n***End_of_Header***\t\t\r\n{names}\r\n"
    );
    table(&head, row)
}

/// Each file, and what its command has to hold.
fn files() -> Vec<(&'static str, Vec<u8>, &'static str)> {
    let rad = |k: usize| yaw_deg(k).to_radians();
    // The second of two takes ends before the first.
    let takes = table("t1,theta1,t2,theta2\n", |k| match k < ROWS / 2 {
        true => format!("{:.4},{:.6},{:.4},{:.6}", time_s(k), rad(k), time_s(k), 0.9 * rad(k)),
        false => format!("{:.4},{:.6},,", time_s(k), rad(k)),
    });
    let pictures = table("frame,theta\n", |k| format!("{k},{:.5}", yaw_deg(k)));
    let driven = table("Time (s),CH1,CH2\n", |k| {
        format!("{:.4},{:.4},{:.5}", time_s(k), motor(k), yaw_deg(k))
    });
    // A clock in seconds, so slow that it might be something else.
    let slow = table("t,yaw_deg\n", |k| format!("{:.1},{:.5}", k as f64 * 0.4, yaw_deg(k)));
    let gap = table("time_s,yaw_deg\n", |k| match k % 400 {
        9 => format!("{:.4},NaN", time_s(k)),
        _ => format!("{:.4},{:.5}", time_s(k), yaw_deg(k)),
    });
    let anew = table("time_s,yaw_deg\n", |k| {
        format!("{:.4},{:.5}", time_s(k % (ROWS - 300)), yaw_deg(k % (ROWS - 300)))
    });
    vec![
        ("takes.csv", takes.into_bytes(), "--yaw theta1 --unit rad"),
        (
            "pictures.csv",
            pictures.into_bytes(),
            "--time frame --time-unit samples --rate-hz HZ --yaw theta --unit deg",
        ),
        ("driven.csv", driven.into_bytes(), "--yaw CH2 --unit deg"),
        ("slow.csv", slow.into_bytes(), "--time-unit s"),
        ("gap.csv", gap.into_bytes(), "--yaw yaw_deg"),
        ("anew.csv", anew.into_bytes(), "--rate-hz 200 --yaw yaw_deg"),
    ]
}

#[test]
fn commands_that_are_printed_read_the_swing() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    for (name, bytes, holds) in files() {
        std::fs::write(folder.join(name), bytes).expect("room for it");
        let ended = yawrig("identify").and(name).in_folder(folder).run().exits(3).helps();
        let command = suggested(&ended.stderr);
        println!("{name}: {command}");
        assert!(command.contains(holds), "{name}: {command}");
        // What stands for a rate that only its user knows does not run.
        typed(folder, &command.replace(" HZ ", " 30 "));
        // Of a clock that is not the record's own, the answer has its unit.
        let clock = match name {
            "pictures.csv" => 30.0 / RATE_HZ,
            "slow.csv" => 2.5 / RATE_HZ,
            _ => 1.0,
        };
        let found = frequency(folder, "record.csv") / clock;
        assert!((found - WN_RAD_S).abs() < 4e-3, "{name}: {found} by {command}");
    }
}

#[test]
fn files_that_say_it_themselves_need_no_command() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let no_times = labview("No", "X_Value\tYaw\tVoltage\tComment", |k| {
        format!("\t{}\t{}", comma(yaw_deg(k)), comma(motor(k)))
    });
    // One column stays empty, the other is an angle by its unit.
    let empty = labview("One", "X_Value\tVoltage\tEmpty\tComment", |k| {
        format!("{}\t{}\t\t", comma(time_s(k)), comma(yaw_deg(k)))
    });
    // The comma parts the columns and is the decimal sign.
    let commas = table("Zeit [s],Gierwinkel [°]\n", |k| {
        format!("{},{}", comma(time_s(k)), comma(30.0 + yaw_deg(k)))
    });
    let rows = table("\"Time (s)\",\"Yaw angle (deg)\"\n", |k| {
        format!("{:e},{:e}", time_s(k), yaw_deg(k))
    });
    let about = "\"property\",\"value\"\n\"version\",\"1.1\"\n".to_owned();
    let phyphox = archive(&[("Raw Data.csv", rows), ("meta/device.csv", about)]);
    let values = |of: fn(usize) -> f64| -> String {
        (0..ROWS).map(|k| format!("<value>{}</value>", of(k))).collect()
    };
    let channel = |quantity: &str, unit: &str, values: &str| {
        format!("<channels count=\"1\"><channel dec=\"2\"><quantity>{quantity}</quantity><symbol>x</symbol><unit>{unit}</unit><values count=\"{ROWS}\">{values}</values></channel></channels>")
    };
    let cassy = format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?><cassylab xml:lang=\"de-DE\"><allchannels>{}{}{}</allchannels></cassylab>",
        channel("Zeit", "s", &values(time_s)),
        channel("Strom", "A", &values(motor)),
        channel("Winkel", "°", &values(yaw_deg)),
    );
    for (name, bytes) in [
        ("no times.lvm", no_times.into_bytes()),
        ("empty.lvm", empty.into_bytes()),
        ("commas.csv", commas.into_bytes()),
        ("phyphox.zip", phyphox),
        ("Drehpendel.labx", cassy.into_bytes()),
    ] {
        std::fs::write(folder.join(name), bytes).expect("room for it");
        let found = frequency(folder, name);
        assert!((found - WN_RAD_S).abs() < 4e-3, "{name}: {found}");
    }
}

#[test]
fn a_channel_is_an_expression_of_others() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let tracked = table("t,x,y,V\n", |k| {
        let (sine, cosine) = yaw_deg(k).to_radians().sin_cos();
        format!(
            "{:.4},{:.7},{:.7},{:.7}",
            time_s(k),
            0.4 * sine,
            -0.4 * cosine,
            2.5 + yaw_deg(k) / 45.0
        )
    });
    std::fs::write(folder.join("tracked.csv"), tracked).expect("room for it");
    for command in [
        "yawrig convert tracked.csv record.csv --yaw 'atan2(x, -y)'",
        "yawrig convert tracked.csv record.csv --yaw '(V - 2.5) * 45' --unit deg",
    ] {
        typed(folder, command);
        let found = frequency(folder, "record.csv");
        assert!((found - WN_RAD_S).abs() < 4e-3, "{command}: {found}");
        let first = std::fs::read_to_string(folder.join("record.csv")).expect("the record");
        let yaw: f64 =
            first.lines().nth(1).and_then(|l| l.split(',').nth(1)?.parse().ok()).expect("an angle");
        assert!((yaw - yaw_deg(0)).abs() < 1e-3, "{command}: {yaw}");
    }
    let refused = |yaw: &[&str]| {
        let mut asked = yawrig("convert tracked.csv other.csv --yaw");
        for argument in yaw {
            asked = asked.and(argument);
        }
        asked.in_folder(folder).run().exits(3).helps().stderr
    };
    let unknown = refused(&["x / z"]);
    assert!(
        unknown.contains("there is no channel \"z\"; its channels: t (3000 numbers)"),
        "{unknown}"
    );
    // What is no angle by itself has no unit.
    assert!(refused(&["2 * x"]).contains("in an unknown unit"));
    assert!(refused(&["atan2(x, y)", "--unit", "deg"]).contains("in rad and in deg"));
}
