use super::simulated::{describe, plan};
use super::{Campaign, CampaignFile};
use yawrig_base::error::{Error, Exit};
use yawrig_rig::Rig;

/// A simulated campaign's file with `from` replaced by `to`, its records beside it, and what reading it says.
fn read_with(from: &str, to: &str) -> (String, Result<CampaignFile, Error>) {
    let folder = tempfile::tempdir().unwrap();
    let rig = Rig::default();
    let campaign = describe(&rig, &plan(&rig, 10.0, 1, 1).unwrap());
    for release in &campaign.release {
        std::fs::write(folder.path().join(&release.file), "").unwrap();
    }
    let text = toml::to_string(&campaign).unwrap();
    assert!(text.contains(from), "{from:?} is not in the example");
    let text = text.replacen(from, to, 1);
    let path = folder.path().join("campaign.toml");
    std::fs::write(&path, &text).unwrap();
    (text, CampaignFile::read(&path))
}

/// Refused on the line that holds `at`, counted in the changed file.
fn refused(from: &str, to: &str, at: Option<&str>, words: &str) {
    let (text, read) = read_with(from, to);
    let error = read.unwrap_err();
    assert_eq!(error.exit, Exit::Data);
    assert!(error.message.contains("campaign.toml"), "{error}");
    assert!(error.message.contains(words), "{error} does not say {words:?}");
    if let Some(at) = at {
        let line = text.lines().position(|line| line.contains(at)).unwrap() + 1;
        assert!(error.message.contains(&format!("line {line}:")), "{error} is not on line {line}");
    }
}

#[test]
fn an_example_is_read_back_as_it_was_written() {
    let (text, file) = read_with("schema_version", "schema_version");
    let file = file.unwrap();
    assert_eq!(file.campaign, toml::from_str::<Campaign>(&text).unwrap());
    assert_eq!(file.release_lines.len(), 32);
    let first = text.lines().position(|line| line == "[[release]]").unwrap() + 1;
    assert_eq!(file.release_lines[0], first);
}

#[test]
fn the_words_of_its_motion_are_those_of_its_records() {
    let (_, file) = read_with("schema_version = 1\n", "schema_version = 1\nmotion = \"roll\"\n");
    let folder = tempfile::tempdir().unwrap();
    let mut file = file.unwrap();
    file.path = folder.path().join("campaign.toml");
    let rows = (0..20).fold("time_s,yaw_deg\n".to_owned(), |text, k| format!("{text}{k},1\n"));
    std::fs::write(file.record_path(0), rows).unwrap();
    assert_eq!(file.record(0).unwrap().measurand.coordinate(), "roll angle");
}

#[test]
fn mistakes_are_named_by_line() {
    refused("length_m = 0.625", "lenght_m = 0.625", Some("lenght_m"), "lenght_m");
    refused("length_m = 0.625", "length_m = \"long\"", Some("\"long\""), "invalid type");
    refused("length_m = 0.625", "length_m = 0.625 m", Some("0.625 m"), "");
    refused("length_m = 0.625", "length_m = -1.0", None, "model.length_m");
    refused("density_kg_m3 = 1.2", "density_kg_m3 = nan", None, "air.density_kg_m3");
    refused(
        "density_kg_m3 = 1.2",
        "density_kg_m3 = 1.2\ndensity_u_kg_m3 = -1.0",
        None,
        "density_u",
    );
    refused("schema_version = 1", "schema_version = 2", None, "schema_version is 2");
    refused("axis = \"mid\"", "axis = \"rear\"", Some("\"rear\""), "rear");
    refused("\naxis = \"mid\"", "", None, "axis");
}

#[test]
fn a_release_that_does_not_fit_the_others_is_named() {
    refused("K1-mid-on.csv", "absent.csv", None, "absent.csv is not there");
    refused("K1-mid-on.csv", "K1-mid-off.csv", None, "listed already");
    refused("stiffness_n_per_m = 119.0", "stiffness_n_per_m = 120.0", None, "another stiffness");
    refused("stiffness_n_per_m = 119.0", "stiffness_n_per_m = 0.0", None, "positive");
    refused("wind_speed_m_s = 0.0", "wind_speed_m_s = -1.0", None, "negative");
}

#[test]
fn a_missing_wind_off_reference_is_named() {
    let (text, read) = read_with(
        "file = \"K3-front-off.csv\"\nspring = \"K3\"\nspring_stiffness_n_per_m = 306.0\naxis = \"front\"\nwind_speed_m_s = 0.0",
        "file = \"K3-front-off.csv\"\nspring = \"K3\"\nspring_stiffness_n_per_m = 306.0\naxis = \"front\"\nwind_speed_m_s = 10.0",
    );
    let error = read.unwrap_err();
    assert!(
        error.message.contains("no wind-off release of spring K3 on the front axis"),
        "{error}"
    );
    assert!(error.help.contains("axis = \"front\""), "{error}");
    let line = text.lines().position(|line| line.contains("K3-front-off")).unwrap();
    assert!(error.message.contains(&format!("line {line}:")), "{error}");
}

#[test]
fn a_campaign_without_releases_or_without_wind_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let rig = Rig::default();
    let mut campaign = describe(&rig, &plan(&rig, 10.0, 1, 1).unwrap());
    let path = folder.path().join("campaign.toml");
    campaign.release.retain(|release| release.wind_speed_m_s == 0.0);
    for release in &campaign.release {
        std::fs::write(folder.path().join(&release.file), "").unwrap();
    }
    for words in ["wind on", "no [[release]]"] {
        std::fs::write(&path, toml::to_string(&campaign).unwrap()).unwrap();
        let error = CampaignFile::read(&path).unwrap_err();
        assert!(error.message.contains(words), "{error}");
        campaign.release.clear();
    }
}
