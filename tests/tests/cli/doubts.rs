//! Mistakes made on purpose in a campaign: each is named with its file and its cause before any number.

use std::path::Path;
use yawrig_tests::process::{yawrig, Ended};

/// Springs of the campaign that is spoilt.
const SPRINGS: [&str; 5] = ["K2", "K3", "K4", "K5", "K7"];

fn run(folder: &Path, command: &str) -> Ended {
    yawrig(command).in_folder(folder).run()
}

/// A campaign in a folder of its own, to be spoilt.
struct Campaign {
    folder: tempfile::TempDir,
    text: String,
}

impl Campaign {
    fn copy(sound: &Path) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        for entry in std::fs::read_dir(sound).expect("a campaign") {
            let from = entry.expect("an entry").path();
            std::fs::copy(&from, folder.path().join(from.file_name().expect("a name")))
                .expect("room");
        }
        let text = std::fs::read_to_string(sound.join("campaign.toml")).expect("a campaign");
        Self { folder, text }
    }

    fn path(&self, file: &str) -> std::path::PathBuf {
        self.folder.path().join(file)
    }

    /// Every `from` of the campaign's file.
    fn replace(&mut self, from: &str, to: &str) {
        assert!(self.text.contains(from), "{from}: {}", self.text);
        self.text = self.text.replace(from, to);
    }

    /// Two words of the campaign's file.
    fn exchange(&mut self, one: &str, other: &str) {
        self.replace(one, "\u{1}");
        self.replace(other, one);
        self.replace("\u{1}", other);
    }

    /// In the release of `file` only.
    fn in_release(&mut self, file: &str, from: &str, to: &str) {
        let begins = self.text.find(&format!("\"{file}\"")).expect(file);
        let ends =
            self.text[begins..].find("[[release]]").map_or(self.text.len(), |at| begins + at);
        let changed = self.text[begins..ends].replace(from, to);
        assert_ne!(changed, self.text[begins..ends], "{from}");
        self.text.replace_range(begins..ends, &changed);
    }

    /// Another release like that of `file`, of the record `named`.
    fn repeat(&mut self, file: &str, named: &str) {
        let name = self.text.find(&format!("\"{file}\"")).expect(file);
        let begins = self.text[..name].rfind("[[release]]").expect("its head");
        let ends = self.text[name..].find("[[release]]").map_or(self.text.len(), |at| name + at);
        let again = self.text[begins..ends].replace(file, named);
        self.text.push('\n');
        self.text.push_str(&again);
    }

    /// Each reading of a record and its time.
    fn readings(&self, file: &str, mut change: impl FnMut(f64, f64) -> Option<(f64, f64)>) {
        let text = std::fs::read_to_string(self.path(file)).expect(file);
        let mut out = "time_s,yaw_deg\n".to_owned();
        for line in text.lines().skip(1) {
            let (t, y) = line.split_once(',').expect("two columns");
            let (t, y) = (t.parse().expect("a time"), y.parse().expect("an angle"));
            if let Some((t, y)) = change(t, y) {
                out += &format!("{t},{y}\n");
            }
        }
        std::fs::write(self.path(file), out).expect("room");
    }

    fn write(&self) {
        std::fs::write(self.path("campaign.toml"), &self.text).expect("room");
    }
}

type Spoil = fn(&mut Campaign);

/// What is done, the kind it is named by, and words of file and cause.
const FAULTS: [(&str, &str, &[&str], Spoil); 31] = [
    (
        "wind-on records of two springs exchanged",
        "records_exchanged",
        &["K2-mid-on.csv", "K3-mid-on.csv"],
        |c| {
            c.exchange("\"K2-mid-on.csv\"", "\"K3-mid-on.csv\"");
        },
    ),
    (
        "wind-on records of the two axes exchanged",
        "axes_exchanged",
        &["K4-mid-on.csv", "K4-front-on.csv"],
        |c| {
            c.exchange("\"K4-mid-on.csv\"", "\"K4-front-on.csv\"");
        },
    ),
    (
        "wind-off records of the two axes exchanged",
        "axes_exchanged",
        &["K5-mid-off.csv", "K5-front-off.csv"],
        |c| {
            c.exchange("\"K5-mid-off.csv\"", "\"K5-front-off.csv\"");
        },
    ),
    (
        "wind-off records of two springs exchanged",
        "records_exchanged",
        &["K2-mid-off.csv", "K4-mid-off.csv"],
        |c| {
            c.exchange("\"K2-mid-off.csv\"", "\"K4-mid-off.csv\"");
        },
    ),
    ("all axes exchanged", "axes_exchanged", &["front axis"], |c| {
        c.exchange("axis = \"mid\"", "axis = \"front\"");
    }),
    ("wind off and on exchanged", "wind_exchanged", &["K3-mid-off.csv", "K3-mid-on.csv"], |c| {
        c.exchange("\"K3-mid-off.csv\"", "\"K3-mid-on.csv\"");
    }),
    ("wind off and on exchanged everywhere", "wind_exchanged", &["wind off and on"], |c| {
        c.exchange("-on.csv", "-off.csv");
    }),
    ("two stiffnesses exchanged", "stiffness_exchanged", &["K2", "K4"], |c| {
        c.exchange("= 214.0", "= 806.0")
    }),
    ("one stiffness in kgf/m", "stiffness_unit", &["K4", "kgf/m"], |c| {
        c.replace("= 806.0", "= 82.19")
    }),
    ("one stiffness in N/mm", "stiffness_unit", &["K4", "N/mm"], |c| {
        c.replace("= 806.0", "= 0.806")
    }),
    ("one stiffness of both springs", "stiffness_unit", &["K4", "both springs"], |c| {
        c.replace("= 806.0", "= 1612.0")
    }),
    ("all stiffnesses in kgf/m", "inertia_of_no_body", &["kgf/m"], |c| {
        for (n, kgf) in [
            ("214.0", "21.82"),
            ("306.0", "31.2"),
            ("806.0", "82.19"),
            ("1051.0", "107.17"),
            ("2242.0", "228.6"),
        ] {
            c.replace(&format!("= {n}"), &format!("= {kgf}"));
        }
    }),
    ("an inertia in g cm2", "inertia_unit", &["mid_kg_m2", "g cm2"], |c| {
        c.replace("[rig]", "[inertia]\nmid_kg_m2 = 1010000.0\n\n[rig]");
    }),
    ("an inertia a tenth off", "inertia_disagrees", &["mid_kg_m2"], |c| {
        c.replace("[rig]", "[inertia]\nmid_kg_m2 = 0.111\n\n[rig]");
    }),
    ("two inertias exchanged", "inertia_exchanged", &["mid_kg_m2", "front_kg_m2"], |c| {
        c.replace("[rig]", "[inertia]\nmid_kg_m2 = 0.1205\nfront_kg_m2 = 0.101\n\n[rig]");
    }),
    ("a density in g/m3", "out_of_range", &["density_kg_m3", "g/m3"], |c| {
        c.replace("density_kg_m3 = 1.2", "density_kg_m3 = 1200.0")
    }),
    ("an axis offset in mm", "out_of_range", &["axis_offset_m", "mm"], |c| {
        c.replace("axis_offset_m = 0.05", "axis_offset_m = 50.0")
    }),
    ("a length in mm", "out_of_range", &["length_m", "mm"], |c| {
        c.replace("length_m = 0.625", "length_m = 625.0")
    }),
    ("an area in cm2", "out_of_range", &["frontal_area_m2", "cm2"], |c| {
        c.replace("frontal_area_m2 = 0.036", "frontal_area_m2 = 360.0")
    }),
    ("the wind in km/h", "coefficients_unusual", &["km/h"], |c| {
        c.replace("wind_speed_m_s = 10.0", "wind_speed_m_s = 36.0")
    }),
    ("the wind of one spring in km/h", "wind_unit", &["K4-mid-on.csv", "km/h"], |c| {
        for axis in ["mid", "front"] {
            c.in_release(&format!("K4-{axis}-on.csv"), "= 10.0", "= 36.0");
        }
    }),
    ("a name in km/h", "wind_unit", &["K4-mid-36kmh.csv"], |c| {
        std::fs::rename(c.path("K4-mid-on.csv"), c.path("K4-mid-36kmh.csv")).expect("room");
        c.replace("K4-mid-on.csv", "K4-mid-36kmh.csv");
        c.in_release("K4-mid-36kmh.csv", "= 10.0", "= 36.0");
    }),
    ("a copy as a repeat", "same_content", &["again.csv", "K3-mid-on.csv"], |c| {
        std::fs::copy(c.path("K3-mid-on.csv"), c.path("again.csv")).expect("room");
        c.repeat("K3-mid-on.csv", "again.csv");
    }),
    (
        "a wind-off record as a wind-on one",
        "same_content",
        &["K3-mid-on.csv", "K3-mid-off.csv"],
        |c| {
            std::fs::copy(c.path("K3-mid-off.csv"), c.path("K3-mid-on.csv")).expect("room");
        },
    ),
    ("a part of a record as a repeat", "same_record", &["part.csv", "K3-mid-off.csv"], |c| {
        std::fs::copy(c.path("K3-mid-off.csv"), c.path("part.csv")).expect("room");
        c.readings("part.csv", |t, y| (t > 4.0).then_some((t - 4.0, y)));
        c.repeat("K3-mid-off.csv", "part.csv");
    }),
    ("a release without wind as a wind-on one", "no_wind", &["K3-mid-on.csv", "wind off"], |c| {
        run(
            c.folder.path(),
            "simulate --spring K3 --seconds 25 --rate-hz 100 --seed 77 --force --out K3-mid-on.csv",
        )
        .exits(0);
    }),
    ("another record", "wind_disagrees", &["K5-mid-on.csv"], |c| {
        let other = "simulate --natural-frequency 13.1 --damping 0.01 --seconds 25 --rate-hz 100";
        run(c.folder.path(), &format!("{other} --force --out K5-mid-on.csv")).exits(0);
    }),
    ("a record at twice its rate", "clock", &["K3-mid-off.csv"], |c| {
        c.readings("K3-mid-off.csv", |t, y| Some((2.0 * t, y)));
    }),
    ("a reading that is cut off", "clipped", &["K4-mid-on.csv", "cut off"], |c| {
        c.readings("K4-mid-on.csv", |t, y| Some((t, y.min(6.0))));
    }),
    ("samples lost", "lost_samples", &["K4-mid-on.csv", "lost"], |c| {
        let mut count = -1.0;
        c.readings("K4-mid-on.csv", |t, y| {
            if (10.0..10.2).contains(&t) {
                return None;
            }
            count += 1.0;
            Some((count / 100.0, y))
        });
    }),
    ("a dead spot", "dead_spot", &["K4-mid-on.csv", "dead spot"], |c| {
        let mut last = 0.0;
        c.readings("K4-mid-on.csv", |t, y| {
            if !(1.0..1.9).contains(&y) {
                last = y;
            }
            Some((t, last))
        });
    }),
];

#[test]
fn thirty_one_mistakes_are_named_before_any_number() {
    let folder = tempfile::tempdir().expect("a folder");
    run(folder.path(), "simulate --campaign c --seconds 25 --rate-hz 100").exits(0);
    let sound = folder.path().join("c");
    let text = std::fs::read_to_string(sound.join("campaign.toml")).expect("a campaign");
    let (head, releases) = text.split_once("[[release]]").expect("releases");
    let kept = releases
        .split("[[release]]")
        .filter(|r| SPRINGS.iter().any(|spring| r.contains(&format!("\"{spring}\""))));
    let text = format!("{head}{}", kept.map(|r| format!("[[release]]{r}")).collect::<String>());
    std::fs::write(sound.join("campaign.toml"), text).expect("room");
    let check = run(&sound, "campaign check campaign.toml --json").exits(0).json();
    assert_eq!(
        (&check["errors"], &check["doubts"]),
        (&serde_json::json!([]), &serde_json::json!([]))
    );
    let mut missed = Vec::new();
    for (what, kind, words, spoil) in FAULTS {
        let mut campaign = Campaign::copy(&sound);
        spoil(&mut campaign);
        campaign.write();
        let ended = run(campaign.folder.path(), "derivatives campaign.toml");
        // Errors refuse; doubts stand before the first number of the table.
        let before = match ended.code {
            3 => ended.stderr.clone(),
            _ => ended.stdout.split("\nIzz about").next().unwrap_or_default().to_owned(),
        };
        println!("{what}, exit {}:", ended.code);
        before
            .lines()
            .filter(|l| l.contains("campaign.toml"))
            .for_each(|line| println!("  {line}"));
        let line = before.lines().find(|line| line.contains(&format!("[{kind}]")));
        let is_named = line.is_some_and(|line| words.iter().all(|word| line.contains(word)));
        let has_place = line.is_some_and(|line| line.contains("campaign.toml, line "));
        if !(is_named && has_place) {
            missed.push(format!("{what}: {kind} {words:?}\n{}", ended.report()));
        }
    }
    assert!(missed.is_empty(), "{} missed:\n{}", missed.len(), missed.join("\n"));
}

#[test]
fn check_gives_errors_and_doubts_in_json_and_on_the_page_s_terms() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    run(folder, "simulate --campaign c --seconds 20 --rate-hz 100").exits(0);
    let path = folder.join("c/campaign.toml");
    let sound = std::fs::read_to_string(&path).expect("a campaign");
    std::fs::write(&path, sound.replace("= 1.2", "= 1200.0").replace("= 10.0", "= -1.0"))
        .expect("room");
    let ended = run(folder, "campaign check c/campaign.toml --json").exits(3);
    let check = ended.json();
    let first = &check["errors"][0];
    assert_eq!(first["file"], "c/campaign.toml", "{check}");
    assert!(first["line"].is_u64() && first["kind"] == "entry", "{check}");
    std::fs::write(&path, sound.replace("= 1.2", "= 1200.0")).expect("room");
    let check = run(folder, "campaign check c/campaign.toml --json").exits(3).json();
    let error = &check["errors"][0];
    assert_eq!(error["kind"], "out_of_range", "{check}");
    assert_eq!(error["field"], "air.density_kg_m3", "{check}");
    let line = 1 + sound.lines().position(|l| l.starts_with("density")).expect("its line");
    assert_eq!(error["line"], line, "{check}");
}
