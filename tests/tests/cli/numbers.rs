//! No number that physics forbids goes in, and none comes out.

use serde_json::Value;
use std::path::Path;
use yawrig_tests::process::{yawrig, Ended};

fn run(folder: &Path, command: &str) -> Ended {
    yawrig(command).in_folder(folder).run()
}

/// Writes `file` with `from` replaced by `to` wherever it stands.
fn edit(folder: &Path, file: &str, from: &str, to: &str) {
    let path = folder.join(file);
    let text = std::fs::read_to_string(&path).expect(file);
    assert!(text.contains(from), "{from} is not in\n{text}");
    std::fs::write(path, text.replace(from, to)).expect("room for it");
}

#[test]
fn a_natural_frequency_of_zero_is_refused_and_the_journal_stays_readable() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    run(folder, "simulate --natural-frequency 9 --damping 0.02 --seconds 20 --out r.csv").exits(0);
    run(folder, "fit r.csv").exits(0);
    let sound = std::fs::read_to_string(folder.join("model.toml")).expect("a model");
    let line = sound.lines().position(|l| l.starts_with("natural_frequency_rad_s")).expect("it");
    let entry = sound.lines().nth(line).expect("it");
    // Bounds that the file states may be used, those of earlier versions too.
    let bounds = "min = 0.0, max = inf, free = true }";
    let wide = format!("natural_frequency_rad_s = {{ value = 9.0, unit = \"rad/s\", {bounds}");
    edit(folder, "model.toml", entry, &wide);
    run(folder, "fit").exits(0);
    let least = {
        let text = std::fs::read_to_string(folder.join("model.toml")).expect("a model");
        let after = text.split("natural_frequency_rad_s").nth(1).expect("it");
        let min = after.split("min = ").nth(1).expect("min").split(',').next().expect("it");
        assert!(min.parse::<f64>().expect("a number") > 0.0, "{text}");
        min.to_owned()
    };
    for value in [least.as_str(), "0.0", "-7.0", "inf", "1e300"] {
        let no_motion =
            format!("natural_frequency_rad_s = {{ value = {value}, free = false }}\n# was: ");
        let text = format!("{}\n", sound.replacen("natural_frequency_rad_s = ", &no_motion, 1));
        std::fs::write(folder.join("model.toml"), text).expect("room for it");
        let ended = run(folder, "fit");
        if value != least {
            let place = format!("model.toml:{}", line + 1);
            let ended = ended.exits(3).says(&place).helps();
            assert!(ended.report().contains("natural_frequency_rad_s"), "{}", ended.report());
        } else {
            assert!(!ended.report().contains("NaN"), "{}", ended.report());
        }
    }
    std::fs::write(folder.join("model.toml"), sound).expect("room for it");
    for command in ["fit", "add coulomb_friction", "history", "history --return 1"] {
        run(folder, command).exits(0);
    }
    let journal = std::fs::read_to_string(folder.join("model.journal.jsonl")).expect("a journal");
    assert!(!journal.contains("\"residual_rms_deg\":null"), "{journal}");
    // A damaged line takes its own step with it and no other.
    let damaged =
        journal.replacen("\"residual_rms_deg\":0", "\"residual_rms_deg\":null,\"x\":0", 1);
    std::fs::write(folder.join("model.journal.jsonl"), damaged).expect("room for it");
    let history = run(folder, "history --json").exits(0).says("model.journal.jsonl:1").json();
    assert_eq!(history["damaged"][0]["line"], 1);
    let model = std::fs::read_to_string(folder.join("model.toml")).expect("a model");
    std::fs::write(folder.join("model.toml"), format!("{model}\n")).expect("room for it");
    let steps = history["steps"].as_array().expect("steps");
    let last = &steps[steps.len() - 1]["step"];
    assert_ne!(last, steps.len());
    run(folder, "history").exits(0).says(&format!("is not as step {last} left it"));
    run(folder, "history --return 2").exits(0);
    run(folder, "history --return 1").exits(3).says("step 1 cannot be read").helps();
}

/// A campaign of four springs, on and off, both axes.
fn campaign(folder: &Path) {
    run(folder, "simulate --campaign c --seconds 30 --rate-hz 200").exits(0);
}

#[test]
fn a_campaign_in_the_wrong_units_is_refused_or_doubted_at_its_entry() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    campaign(folder);
    let clean = run(folder, "derivatives c/campaign.toml --json").exits(0).json();
    let doubts = |table: &Value| table["doubts"].to_string();
    let by_network = run(folder, "derivatives c/campaign.toml --json --method network").exits(0);
    let noisy = by_network.stdout.matches("residual_above_noise").count();
    assert!(noisy < 8, "{noisy} of 32 clean releases");
    assert_eq!(clean["doubts"], serde_json::json!([]), "{clean}");
    let sound = std::fs::read_to_string(folder.join("c/campaign.toml")).expect("a campaign");
    let changed = |from: &str, to: &str| {
        std::fs::write(folder.join("c/campaign.toml"), &sound).expect("room for it");
        edit(folder, "c/campaign.toml", from, to);
        run(folder, "derivatives c/campaign.toml --json")
    };
    // One spring in N/mm.
    let line = |of: &str| {
        let text = std::fs::read_to_string(folder.join("c/campaign.toml")).expect("a campaign");
        1 + text.lines().position(|l| l.contains(of)).expect(of)
    };
    for (spring, from) in [("K8", "2594.0"), ("K5", "1051.0")] {
        let to = from.parse::<f64>().expect("a number") / 1000.0;
        let of = "spring_stiffness_n_per_m = ";
        let ended = changed(&format!("{of}{from}"), &format!("{of}{to}"));
        let place = format!("campaign.toml, line {}", line(&format!("{of}{to}")));
        ended.exits(3).says(&place).says(&format!("spring {spring}")).says("is it in N/m").helps();
    }
    // A tenth off is seen against the other springs.
    let table = changed("spring_stiffness_n_per_m = 1051.0", "spring_stiffness_n_per_m = 1510.0")
        .exits(0)
        .json();
    let text = doubts(&table);
    assert!(text.contains("spring K5 disagrees") && text.contains("K5-mid-off.csv"), "{text}");
    assert_eq!(table["doubts"][0]["line"], line("spring_stiffness_n_per_m = 1510.0"), "{text}");
    // Looked into and right all the same.
    edit(
        folder,
        "c/campaign.toml",
        "schema_version = 1",
        "schema_version = 1\naccept = [\"spring_disagrees\"]",
    );
    let table = run(folder, "derivatives c/campaign.toml --json").exits(0).json();
    assert_eq!(table["doubts"][0]["accepted"], true, "{table}");
    let text = run(folder, "derivatives c/campaign.toml").exits(0).stdout;
    assert!(!text.contains("K5 disagrees") && text.contains("accepted in the file"), "{text}");
    let check = run(folder, "campaign check c/campaign.toml").exits(0).stdout;
    assert!(check.contains("nothing is wrong"), "{check}");
    edit(folder, "c/campaign.toml", "spring_disagrees", "springs_disagree");
    run(folder, "derivatives c/campaign.toml").exits(3).says("spring_disagrees").helps();
    // An arm in mm.
    changed("spring_arm_m = 0.1", "spring_arm_m = 100.0")
        .exits(3)
        .says("in mm")
        .says("spring_arm_m")
        .helps();
    changed("spring_arm_m = 0.1", "spring_arm_m = 0.002").exits(3).says("lighter than air").helps();
    // Wind on and off exchanged on one spring.
    let swapped = sound.replace("K3-mid-off.csv", "KX").replace("K3-mid-on.csv", "K3-mid-off.csv");
    let swapped = swapped.replace("KX", "K3-mid-on.csv");
    assert_ne!(swapped, sound, "{sound}");
    std::fs::write(folder.join("c/campaign.toml"), swapped).expect("room for it");
    let text = doubts(&run(folder, "derivatives c/campaign.toml --json").exits(0).json());
    assert!(text.contains("wind_exchanged") && text.contains("K3-mid-on.csv"), "{text}");
}

#[test]
fn each_method_of_a_report_has_its_own_residual_over_noise() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    // So much damping that the conventional method's frequency is a little off, which many cycles show.
    run(folder, "simulate --spring K4 --wind 10 --seed 3 --out release.csv").exits(0);
    let report = run(folder, "report release.csv --json").exits(0).json();
    let estimates = report["releases"][0]["estimates"].as_array().expect("estimates").clone();
    let noise = report["releases"][0]["noise_rms_deg"].as_f64().expect("noise");
    for e in &estimates {
        let raw = e["residual_rms_deg"].as_f64().expect("a residual") / noise;
        let over = e["residual_over_noise"].as_f64().expect("over noise");
        // On block means a misfit shows more, never less.
        assert!(over > 0.9 * raw, "{e}");
        match e["method"].as_str() {
            Some("least-squares") => assert!(over < 1.5, "{e}"),
            Some("conventional") => assert!(raw < 2.0 || over > 2.0, "{e}"),
            _ => {}
        }
    }
}

#[test]
fn an_angle_beyond_half_a_turn_is_asked_about() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    run(folder, "simulate --natural-frequency 9 --damping 0.01 --seconds 30 --out r.csv").exits(0);
    edit(folder, "r.csv", "yaw_deg", "yaw_rad");
    run(folder, "identify r.csv").exits(3).says("more than half a turn").says("yaw_deg");
    run(folder, "identify r.csv --from-deg 3000 --to-deg 100").exits(0);
    run(folder, "fit r.csv").exits(3).says("more than half a turn").helps();
}

#[test]
fn an_amplitude_window_that_the_record_does_not_hold_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    run(folder, "simulate --natural-frequency 9 --damping 0.01 --seconds 15 --out r.csv").exits(0);
    let ended = run(folder, "identify r.csv --from-deg 0.002 --to-deg 0.001").exits(3);
    let ended = ended.says("fewer than three cycles between the amplitudes asked for");
    assert_eq!(ended.stdout.trim(), "", "{}", ended.report());
    run(folder, "identify r.csv").exits(0);
    let ended = run(folder, "identify r.csv --from-deg 5000").exits(2).says("3600");
    assert!(!ended.report().contains("larger"), "{}", ended.report());
}

#[test]
fn a_midline_is_that_of_the_record_and_a_models_file_is_known_by_itself() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    run(folder, "simulate --spring K4 --wind 10 --seconds 30 --out r.csv").exits(0);
    let replayed = run(folder, "replay r.csv --json").exits(0).json();
    let windows = replayed["records"][0]["estimates"][0]["windows"].as_array().expect("windows");
    for window in windows {
        let midline = window["midline_deg"].as_f64().expect("a midline");
        assert!(midline.abs() < 0.05, "{window}");
    }
    run(folder, "fit r.csv --model b.toml").exits(0);
    let compared = run(folder, "compare b.toml --json").exits(0).json();
    assert_eq!(compared["effects"], serde_json::json!([]));
}

/// Held, let go at 12 deg and caught, as often as `times`.
fn releases(file: &Path, times: usize) {
    let mut text = "time_s,yaw_deg\n".to_owned();
    let mut seed = 1u64;
    for k in 0..times * 4400 {
        let t = k as f64 / 200.0;
        let since = t % 22.0 - 2.0;
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let noise = 0.04 * ((seed >> 33) as f64 / f64::from(1u32 << 31) - 0.5);
        // Each is a little stiffer than the one before.
        let wn = 9.0 + (t / 22.0).floor();
        let yaw =
            if since < 0.0 { 12.0 } else { 12.0 * (-0.15 * since).exp() * (wn * since).cos() };
        text.push_str(&format!("{t:.3},{:.5}\n", yaw + noise));
    }
    std::fs::write(file, text).expect("room for it");
}

#[test]
fn several_releases_in_one_record_are_told_apart() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    releases(&folder.join("r.csv"), 2);
    let frequency = |record: &Value| {
        record["estimates"][0]["natural_frequency_rad_s"]["value"].as_f64().expect("a frequency")
    };
    let ended = run(folder, "identify r.csv").exits(0);
    assert!(ended.stdout.contains("several releases"), "{}", ended.report());
    let all = run(folder, "identify r.csv --release all --json").exits(0).json();
    let records = all["records"].as_array().expect("records");
    assert_eq!(records.len(), 2, "{all}");
    for (k, wanted) in [(0, 9.0), (1, 10.0)] {
        assert!((frequency(&records[k]) - wanted).abs() < 0.01, "{all}");
        assert_eq!(records[k]["file"], format!("r.csv#{}", k + 1));
        let one = format!("identify r.csv --release {} --json", k + 1);
        assert_eq!(run(folder, &one).exits(0).json()["records"][0], records[k]);
    }
    run(folder, "identify r.csv --release 3").exits(3).says("there is no release 3").helps();
    run(folder, "identify r.csv --release 0").exits(2);
    // In a model and a campaign they are records of their own.
    run(folder, "fit r.csv --release 2").exits(0);
    let model = std::fs::read_to_string(folder.join("model.toml")).expect("a model");
    assert!(model.contains("r.csv#2"), "{model}");
    run(folder, "compare").exits(0);
    run(folder, "fit r.csv --model both.toml").exits(0).says("holds 2 releases");
    run(folder, "diagnose r.csv").exits(0).says("holds 2 releases");
    let second = run(folder, "diagnose r.csv --release 2 --json").exits(0).json();
    let wn = second["modal"]["natural_frequency_rad_s"]["value"].as_f64().expect("a frequency");
    assert!((wn - 10.0).abs() < 0.01, "{second}");
    run(folder, "convert r.csv out.csv --release all").exits(0);
    for (k, wanted) in [(1, 9.0), (2, 10.0)] {
        let one = run(folder, &format!("identify out-{k}.csv --json")).exits(0).json();
        assert!((frequency(&one["records"][0]) - wanted).abs() < 0.01, "{one}");
    }
}

#[test]
fn a_full_disk_leaves_whole_lines_and_says_what_was_lost() {
    let folder = tempfile::tempdir().expect("a folder");
    // A file may grow to 256 KiB, and to write beyond is an error as on a full disk.
    let limited =
        "trap '' XFSZ; ulimit -f 512; exec \"$0\" monitor --speed 20 --seconds 60 --record s.csv";
    let output = std::process::Command::new("sh")
        .args(["-c", limited])
        .arg(yawrig_tests::process::binary())
        .current_dir(folder.path())
        .stdin(std::process::Stdio::null())
        .output()
        .expect("a shell");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("samples are kept") && said.contains("lost"), "{said}");
    assert!(!said.contains("none missing, 0"), "{said}");
    let text = std::fs::read_to_string(folder.path().join("s.csv")).expect("the trace");
    assert!(text.ends_with('\n') && text.len() > 200_000);
    let last = text.lines().last().expect("a line");
    let yaw = last.split_once(',').expect("two numbers").1;
    assert_eq!(yaw.split_once('.').expect("a point").1.len(), 6, "{last}");
    let rows = text.lines().count() - 1;
    assert!(said.contains(&format!("{rows} samples")), "{rows}: {said}");
}
