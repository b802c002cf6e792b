//! `yawrig train`: JSON, figures, files.

use serde_json::Value;
use yawrig_shared::blob;
use yawrig_tests::process::yawrig;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

/// 41-6-2 on 250 windows without noise reaches the thesis's accuracy and better.
fn learns(features: &str) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("n.yrn");
    let ended = yawrig("train --json --samples 250 --noise 0 --epochs 1000 --topology 41-6-2")
        .and("--features")
        .and(features)
        .and("--out")
        .and(&file)
        .run()
        .exits(0);
    let object = ended.json();
    assert_eq!(object["topology"], "41-6-2");
    assert_eq!(object["features"], features);
    assert_eq!(object["parameters"], 266);
    assert_eq!(object["samples"], 250);
    let effective = number(&object["effective_parameters"]);
    assert!(effective > 0.0 && effective <= 266.0, "{effective}");
    assert!((1..=1000).contains(&object["epochs"].as_u64().expect("a count")));
    assert!(object["stopped"].is_string());
    assert!(number(&object["seconds"]) > 0.0);
    assert_eq!(object["network"], file.display().to_string());
    for set in ["train", "test"] {
        for field in [
            "natural_frequency_mse",
            "natural_frequency_rms_percent",
            "damping_ratio_mse",
            "damping_ratio_rms_percent",
            "damping_ratio_p95_percent",
        ] {
            assert!(number(&object[set][field]) >= 0.0, "{set} {field}");
        }
    }
    let test = &object["test"];
    assert!(number(&test["natural_frequency_mse"]) <= 1e-5, "{test}");
    assert!(number(&test["damping_ratio_mse"]) <= 1e-12, "{test}");

    // The file holds that network.
    let bytes = std::fs::read(&file).expect("the network");
    let (envelope, payload) = blob::decode(&bytes).expect("a sound network");
    assert_eq!(envelope.blob_length(), bytes.len());
    assert_eq!(payload.network.topology.as_slice(), [41, 6, 2]);
    assert_eq!(object["id"], format!("{:08x}", envelope.payload_crc));
    assert_eq!(payload.provenance.samples, 250);
}

#[test]
fn noise_free_samples_teach_it_the_thesis_features() {
    learns("thesis");
}

#[test]
fn noise_free_samples_teach_it_the_bins() {
    learns("bins");
}

#[test]
fn the_same_seed_gives_the_same_file_and_another_another() {
    let folder = tempfile::tempdir().expect("a folder");
    let train = |name: &str, seed: &str| {
        let file = folder.path().join(name);
        let train = yawrig("train --samples 300 --epochs 30 --seed").and(seed).and("--out");
        let ended = train.and(&file).run().exits(0);
        assert!(ended.stdout.contains("written to"), "{}", ended.report());
        std::fs::read(&file).expect("the network")
    };
    let first = train("a.yrn", "5");
    assert_eq!(first, train("b.yrn", "5"));
    assert_ne!(first, train("c.yrn", "6"));
}

#[test]
fn what_cannot_be_trained_is_a_usage_error_that_names_it() {
    let folder = tempfile::tempdir().expect("a folder");
    for (arguments, said) in [
        ("--topology 41-6", "`41-6` is not a topology"),
        ("--topology 40-6-2", "`40-6-2` is not a topology"),
        ("--topology 41-0-2", "`41-0-2` is not a topology"),
        ("--topology 41-six-2", "`41-six-2` is not a topology"),
        ("--topology 41-49-2", "41-49-2 network"),
        ("--topology 41-24-2", "41-24-2 network"),
        ("--topology 41-4-4-4-4-2", "41-4-4-4-4-2 network"),
        ("--features all", "neither `bins` nor `thesis`"),
        ("--features pca:0", "N from 1 to 41"),
        ("--features pca:42", "N from 1 to 41"),
        ("--features pca:ten", "N from 1 to 41"),
        ("--features pca:10 --topology 41-6-2", "`41-6-2` is not a topology"),
        ("--features pca:10 --topology 10-49-2", "10-49-2 network"),
        ("--features pca:40", "41-40-6-2 network"),
        ("--records r.csv --noise 0.01", "cannot be used with"),
        ("--continue n.yrn.unfinished --seed 3", "cannot be used with"),
        ("--natural-frequency 20..5", "natural frequency's range must rise"),
        ("--natural-frequency 1..5", "2.4 rad/s"),
        ("--natural-frequency 5..500", "60 rad/s"),
        ("--natural-frequency 5", "LOW..HIGH"),
        ("--natural-frequency nan..5", "natural frequency's range"),
        ("--damping 0.1..0.01", "damping ratio's range must rise"),
        ("--damping 0.01..0.9", "damping ratio's range"),
        ("--damping a..b", "`a` is not a number"),
        ("--noise 0.5", "noise from 0.5 to 0.5"),
        ("--noise 0.03..0.01", "noise from 0.03 to 0.01"),
        ("--noise nan", "noise from NaN"),
        ("--noise loud", "`loud` is not a number"),
        ("--samples 3", "--samples"),
        ("--samples 99999999999", "--samples"),
        ("--samples many", "--samples"),
        ("--epochs 0", "--epochs"),
        ("--restarts 0", "--restarts"),
    ] {
        let ended = yawrig("train --epochs 5 --samples 50").in_folder(folder.path());
        // The same flag twice is an error of its own.
        let ended = match arguments {
            a if a.starts_with("--samples") => yawrig("train --epochs 5").in_folder(folder.path()),
            a if a.starts_with("--epochs") => yawrig("train --samples 50").in_folder(folder.path()),
            _ => ended,
        };
        let ended = arguments.split(' ').fold(ended, |command, argument| command.and(argument));
        ended.run().exits(2).says(said);
        let left: Vec<_> = folder.path().read_dir().expect("the folder").collect();
        assert!(left.is_empty(), "{arguments} leaves {left:?}");
    }
}

/// A folder with a model of these effects, given as the tables of the file.
fn with_model(effects: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let text = format!("schema_version = 1\n{effects}");
    std::fs::write(folder.path().join("model.toml"), text).expect("room for it");
    folder
}

fn effect(id: &str, parameters: &str) -> String {
    format!("[[effect]]\nid = \"{id}\"\n[effect.parameters]\n{parameters}\n")
}

const FRICTION: &str = "c = { value = 0.15, unit = \"rad/s2\" }";
const SHORT: &str = "train --json --samples 300 --epochs 20 --model model.toml --out";

#[test]
fn a_model_with_effects_teaches_a_network_that_says_so() {
    let folder = with_model(&effect("coulomb_friction", FRICTION));
    let train = |name: &str| {
        let ended = yawrig(SHORT).and(name).in_folder(folder.path()).run().exits(0);
        (ended.json(), std::fs::read(folder.path().join(name)).expect("the network"))
    };
    let (object, first) = train("a.yrn");
    assert_eq!(object["topology"], "42-6-2");
    assert_eq!(object["parameters"], 272);
    assert_eq!(object["effects"], serde_json::json!(["coulomb_friction"]));
    let payload = blob::decode(&first).expect("a sound network").1;
    assert_eq!(payload.network.topology.as_slice(), [42, 6, 2]);
    assert_eq!(payload.provenance.effects.as_str(), "coulomb_friction");
    assert_eq!(first, train("b.yrn").1, "the same seed");
    let simulate = "simulate --natural-frequency 8 --damping 0.01 --seconds 20";
    for (name, hidden) in [("rubbing", " --effect coulomb_friction:c=0.15"), ("free", "")] {
        let made = yawrig(&format!("{simulate}{hidden} --out {name}.csv"));
        made.in_folder(folder.path()).run().exits(0);
    }
    let replay = |name: &str| {
        let replay = yawrig("replay --json --network a.yrn").and(name);
        replay.in_folder(folder.path()).run()
    };
    // Where that friction is not, what it finds is none to rely on, and nothing is refined beside it.
    replay("free.csv").exits(6).says("out_of_trained_range");
    let network = replay("rubbing.csv").exits(0).json()["device"]["network"].clone();
    assert_eq!(network["topology"], "42-6-2");
    assert_eq!(network["effects"], serde_json::json!(["coulomb_friction"]));
}

#[test]
fn every_kind_of_effect_can_be_learnt() {
    let own = "id = \"rub\"\ntitle = \"Rub\"\nmoment = \"-c * tanh(r / 0.02)\"\n\
               [parameters]\nc = { unit = \"rad/s2\", start = 0.05, min = 0.0 }\n";
    let forcing = "f = { value = 0.3 }\nw = { value = 40.0 }\nphi = { value = 0.5 }";
    let mode = "amplitude = { value = 0.002 }\nphase = { value = 0.1 }\n\
                w2 = { value = 90.0 }\nzeta2 = { value = 0.01 }";
    for (id, parameters) in [
        ("rub.toml", "c = { value = 0.05 }"),
        ("quadratic_damping", "d = { value = 0.05 }"),
        ("cubic_damping", "c = { value = 1.0 }"),
        ("cubic_stiffness", "k3 = { value = -20.0 }"),
        ("quadratic_stiffness", "k2 = { value = 5.0 }"),
        ("static_offset", "m = { value = 0.1 }"),
        ("free_play", "g = { value = 0.001 }"),
        ("harmonic_forcing", forcing),
        ("second_mode", mode),
        ("stiffness_drift", "e = { value = 0.0005 }"),
        ("sensor_nonlinearity", "s = { value = 0.05 }"),
        ("baseline_drift", "d = { value = 0.0002 }"),
    ] {
        let folder = with_model(&effect(id, parameters));
        std::fs::write(folder.path().join("rub.toml"), own).expect("room for it");
        let ended = yawrig(SHORT).and("n.yrn").in_folder(folder.path()).run().exits(0);
        assert_eq!(ended.json()["effects"], serde_json::json!([id.trim_end_matches(".toml")]));
    }
}

#[test]
fn a_model_without_effects_is_the_second_order_response() {
    let folder = with_model("");
    let plain = "train --samples 300 --epochs 20 --out plain.yrn";
    yawrig(plain).in_folder(folder.path()).run().exits(0);
    let ended = yawrig(SHORT).and("n.yrn").in_folder(folder.path()).run().exits(0);
    let ended = ended.says("model.toml has no effects");
    assert_eq!(ended.json()["topology"], "41-6-2");
    let read = |name: &str| std::fs::read(folder.path().join(name)).expect("a network");
    assert_eq!(read("n.yrn"), read("plain.yrn"));
}

#[test]
fn a_model_that_cannot_be_trained_on_is_an_error_that_says_why() {
    let strong = effect("coulomb_friction", "c = { value = 1000.0 }");
    let random = effect("buffeting", "q = { value = 0.001 }");
    let unfitted = "[[effect]]\nid = \"coulomb_friction\"\n".to_owned();
    for (effects, code, said) in [
        (strong, 2, "hardly any three cycles"),
        (random, 3, "buffeting is random"),
        (unfitted, 3, "coulomb_friction has no values yet"),
    ] {
        let folder = with_model(&effects);
        let ended = yawrig(SHORT).and("n.yrn").in_folder(folder.path()).run();
        ended.exits(code).says(said).helps();
        assert!(!folder.path().join("n.yrn").exists());
    }
    let folder = tempfile::tempdir().expect("a folder");
    let run = |command: &str| yawrig(command).in_folder(folder.path()).run();
    run(&format!("{SHORT} n.yrn")).exits(3).says("cannot read model.toml").helps();
    let amplitude = "train --topology 42-6-2";
    run(amplitude).exits(2).says("nothing depends on the amplitude").helps();
    let many = "train --samples 10 --topology 41-20-2 --out n.yrn";
    run(many).exits(2).says("882 parameters cannot be determined").helps();
}

#[test]
fn outputs_that_no_network_can_have_are_refused_with_the_reason() {
    let fixed = "c = { value = 0.15, unit = \"rad/s2\", free = false }";
    let drag = effect("quadratic_damping", "d = { value = 0.05 }");
    let play = effect("free_play", "g = { value = 0.001 }");
    let forcing = effect(
        "harmonic_forcing",
        "f = { value = 0.3 }\nw = { value = 40.0 }\nphi = { value = 0.5 }",
    );
    let rubbing = effect("coulomb_friction", FRICTION);
    let all = format!("{rubbing}{drag}{play}{forcing}");
    let folder = with_model(&all);
    let both = "natural_frequency,damping_ratio";
    let refused = |folder: &tempfile::TempDir, outputs: &str, said: &str| {
        let train = yawrig("train --samples 300 --epochs 20 --model model.toml --outputs");
        let ended = train.and(outputs).in_folder(folder.path()).run().exits(2).says(said).helps();
        assert!(!folder.path().join("network.yrn").exists(), "{}", ended.report());
    };
    for (more, said) in [
        (",coulomb_friction.d", "coulomb_friction.d is no number of an effect in it"),
        (",cubic_damping.c", "cubic_damping.c is no number of an effect in it"),
        (",coulomb_friction.c,coulomb_friction.c", "coulomb_friction.c stands there twice"),
        (
            ",coulomb_friction.c,quadratic_damping.d,free_play.g",
            "5 outputs, and a device says 4 at most",
        ),
        (",harmonic_forcing.phi", "another one in each release"),
        (",coulomb_friction.c=0.2..0.1", "is no range to train on"),
        (",coulomb_friction.c=-0.1..0.1", "goes beyond its bounds, 0 to inf"),
        (",coulomb_friction.c=some", "a range is written LOW..HIGH"),
    ] {
        refused(&folder, &format!("{both}{more}"), said);
    }
    refused(&folder, "damping_ratio,coulomb_friction.c", "natural_frequency is left out");
    refused(&folder, "natural_frequency,coulomb_friction.c", "damping_ratio is left out");
    refused(&folder, "natural_frequency=7..9,damping_ratio", "has a range of its own");
    let kept = with_model(&effect("coulomb_friction", fixed));
    refused(&kept, &format!("{both},coulomb_friction.c"), "coulomb_friction.c is fixed");
    let none = with_model("");
    refused(&none, &format!("{both},coulomb_friction.c"), "is no number of an effect in it");
    let without = yawrig("train --outputs natural_frequency,damping_ratio");
    without.in_folder(folder.path()).run().exits(2).says("--model");
}

/// A constant moment moves the mid-line, which is taken off a window.
#[test]
fn a_number_that_three_cycles_do_not_show_is_refused_after_the_training() {
    let folder = with_model(&effect("static_offset", "m = { value = 0.1 }"));
    let train = "train --samples 300 --epochs 20 --model model.toml --outputs";
    let outputs = "natural_frequency,damping_ratio,static_offset.m";
    let ended = yawrig(train).and(outputs).in_folder(folder.path()).run();
    ended.exits(6).says("the network cannot tell static_offset.m").helps();
    assert!(!folder.path().join("network.yrn").exists());
}

/// Two outputs asked for are the default, and a training that says a number goes on as it was.
#[test]
fn two_outputs_are_the_default_bit_for_bit() {
    let folder = with_model(&effect("coulomb_friction", FRICTION));
    let train = |more: &str, name: &str| {
        let command = yawrig(&format!("{SHORT} {name}{more}")).in_folder(folder.path());
        command.run().exits(0);
        std::fs::read(folder.path().join(name)).expect("the network")
    };
    let plain = train("", "a.yrn");
    assert_eq!(plain, train(" --outputs natural_frequency,damping_ratio", "b.yrn"));
    assert_eq!(blob::Envelope::read(&plain).expect("an envelope").format, blob::FORMAT);
}

#[test]
fn a_file_that_cannot_be_written_is_found_before_the_training() {
    let folder = tempfile::tempdir().expect("a folder");
    let absent = folder.path().join("absent/n.yrn");
    // So many epochs that whoever trains first runs out of the test's patience.
    for out in [absent.as_path(), folder.path(), "/proc/n.yrn".as_ref()] {
        let command = yawrig("train --samples 20000 --epochs 1000000 --out").and(out);
        let ended = command.run().exits(3).says("cannot write").helps();
        let ended = ended.says(&out.display().to_string());
        assert!(!ended.stderr.contains(".yawrig-"), "{}", ended.report());
    }
}

#[test]
fn a_network_of_principal_components_runs_on_the_device() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("pca.yrn");
    let ended = yawrig("train --json --features pca:10 --samples 1500 --epochs 150 --out")
        .and(&file)
        .run()
        .exits(0);
    let object = ended.json();
    assert_eq!(object["topology"], "10-6-2");
    assert_eq!(object["features"], "pca:10");
    assert_eq!(object["parameters"], 80);
    let test = &object["test"];
    println!("10-6-2 on ten components: {test}");
    // With 8000 windows and 500 epochs 0.06 % and 1.6 %.
    assert!(number(&test["natural_frequency_rms_percent"]) < 0.3, "{test}");
    assert!(number(&test["damping_ratio_rms_percent"]) < 6.0, "{test}");
    let bytes = std::fs::read(&file).expect("the network");
    let (_, payload) = blob::decode(&bytes).expect("a sound network");
    assert_eq!(payload.network.topology.as_slice(), [41, 10, 6, 2]);
    assert_eq!(payload.network.linear_layers, 1);
    // Golden vectors and all.
    yawrig("flash").and(&file).run().exits(0);
}

#[test]
fn a_training_gone_on_with_ends_in_the_same_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let (file, whole) = (folder.path().join("n.yrn"), folder.path().join("whole.yrn"));
    let unfinished = folder.path().join("n.yrn.unfinished");
    let train = "train --samples 6000 --seed 4 --epochs 1000000 --out";
    let mut running = yawrig(train).and(&file).drawing().start();
    running.draws_step(3);
    running.signal(nix::sys::signal::Signal::SIGINT);
    running.ends().exits(130).says("--continue");
    let text = std::fs::read_to_string(&unfinished).expect("its state");
    let state: Value = serde_json::from_str(&text).expect("JSON");
    let epochs = state["checkpoint"]["epoch"].as_u64().expect("a count") + 3;
    let epochs = epochs.to_string();
    let go_on = yawrig("train --epochs").and(&epochs).and("--continue").and(&unfinished);
    go_on.run().exits(0);
    assert!(!unfinished.exists(), "it is finished");
    let at_once = yawrig("train --samples 6000 --seed 4 --epochs").and(&epochs).and("--out");
    at_once.and(&whole).run().exits(0);
    let read = |path: &std::path::Path| std::fs::read(path).expect("a network");
    assert_eq!(read(&file), read(&whole));
}

#[test]
fn what_is_no_unfinished_training_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("x.unfinished");
    yawrig("train --continue").and(&file).run().exits(3).says("x.unfinished").helps();
    for text in ["", "{}", "{\"schema_version\": 1"] {
        std::fs::write(&file, text).expect("room for it");
        let ended = yawrig("train --continue").and(&file).run();
        ended.exits(3).says("x.unfinished").says("not an unfinished training").helps();
    }
}

#[test]
fn records_say_what_to_train_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let simulate = |name: &str, spring: &str| {
        let command =
            yawrig("simulate --wind 10 --json --spring").and(spring).and("--out").and(name);
        let truth = &command.in_folder(folder.path()).run().exits(0).json()["truth"];
        [number(&truth["natural_frequency_rad_s"]), number(&truth["damping_ratio"])]
    };
    let (slow, fast) = (simulate("k3.csv", "K3"), simulate("k5.csv", "K5"));
    let train = "train --json --samples 300 --epochs 30 --records k3.csv k5.csv";
    let object = yawrig(train).in_folder(folder.path()).run().exits(0).json();
    let range = |name: &str| [number(&object[name][0]), number(&object[name][1])];
    let wn = range("natural_frequency_rad_s");
    assert!(wn[0] < slow[0] && fast[0] < wn[1] && wn[1] - wn[0] < 2.0 * (fast[0] - slow[0]));
    let zeta = range("damping_ratio");
    assert!(zeta[0] < slow[1].min(fast[1]) && slow[1].max(fast[1]) < zeta[1], "{zeta:?}");
    // 0.05 deg of noise at 10 deg and at 1 deg.
    let noise = range("noise");
    assert!((0.003..0.007).contains(&noise[0]) && (0.03..0.07).contains(&noise[1]), "{noise:?}");
    yawrig("train --records absent.csv").in_folder(folder.path()).run().exits(3).says("absent.csv");
}
