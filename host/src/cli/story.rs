//! The riddle of `demo --hidden`: its steps as commands, each of which says what to type next.

use super::common::{bare, print_json, print_line};
use super::demo::{teach, writable, Demo};
use super::flash;
use super::model::asked;
use crate::campaign::simulated::CAMPAIGN_FILE;
use crate::campaign::CampaignFile;
use crate::demo::results::free_folder;
use crate::demo::reveal::{self, Errors, Revealed};
use crate::demo::story::{self, MODEL_FILE, NETWORK_FILE, PICTURE_FILE, REPORT_FILE, SEALED_FILE};
use crate::model::comparison::{compare, Comparison};
use crate::model::revise::{self, Asked, Revision, Wanted};
use crate::model::training;
use crate::report::{of_model, Made};
use serde::Serialize;
use std::path::{Path, PathBuf};
use yawrig_base::error::Result;
use yawrig_base::files;
use yawrig_base::interrupt;
use yawrig_core::diagnosis::diagnose::Options;
use yawrig_core::effects::Effect;
use yawrig_shared::features::FeatureKind;
use yawrig_train::draws::Ranges;
use yawrig_train::network_training::Settings;
use yawrig_train::Options as Training;

const FOLDER: &str = "yawrig-hidden";
/// What is typed and what is done: enough for a network of 42-6-2.
const SAMPLES: usize = 3000;
const EPOCHS: usize = 200;

/// `demo --hidden`.
pub fn hide(arguments: &Demo, seed: u64) -> Result<()> {
    let folder = arguments.out.clone().unwrap_or_else(|| free_folder(FOLDER));
    writable(&folder, arguments.force, &[SEALED_FILE, CAMPAIGN_FILE, MODEL_FILE, NETWORK_FILE])?;
    if arguments.force {
        // An earlier riddle's model would stand in the way.
        for name in [MODEL_FILE, "model.journal.jsonl", NETWORK_FILE, REPORT_FILE] {
            let _ = std::fs::remove_file(folder.join(name));
        }
    }
    crate::say!("writing four releases to {}", folder.display());
    story::hide(&folder, seed, arguments.force)?;
    if arguments.yes || arguments.json {
        return solve(arguments, &folder);
    }
    let truth = story::unsealed(&folder)?;
    print_line(&format!(
        "{} holds four releases of a model on one spring, about its middle and its front axis, with the wind off\n\
         and on. Something hidden in them is not in the second-order model. Find it: each command says the next.\n\n  \
         yawrig compare {} --no-model",
        folder.display(),
        folder.join(story::first_release(&truth)).display()
    ))
}

/// What to type after this command, if it was about a riddle. Said on stderr.
pub fn say_next() {
    let words: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let given = |word: &str| words.iter().any(|w| w.as_os_str() == word);
    let Some(verb) = words.first().and_then(|w| w.to_str()) else { return };
    if given("--json") || given("--jsonl") {
        return;
    }
    let Some(folder) = story::folder_of(words.iter().skip(1).cloned()) else { return };
    let Ok(truth) = story::unsealed(&folder) else { return };
    let at = |name: &str| folder.join(name).display().to_string();
    let (model, network) = (at(MODEL_FILE), at(NETWORK_FILE));
    let (first, other) = (at(story::first_release(&truth)), at(story::other_release(&truth)));
    let next = match verb {
        "compare" if !folder.join(MODEL_FILE).exists() => {
            format!("which effect is it?\n  yawrig diagnose {}", at(CAMPAIGN_FILE))
        }
        "diagnose" => format!(
            "make a model of a release, to which the effect can be added:\n  yawrig fit {first} --model {model}"
        ),
        "fit" => format!(
            "add the effect that diagnose has named, in the place of EFFECT:\n  yawrig add EFFECT --model {model}"
        ),
        "add" | "remove" | "compare" | "history" => format!(
            "residual over noise is 1 where nothing is left. Teach the device the effect:\n  yawrig train --model \
             {model} --samples {SAMPLES} --epochs {EPOCHS} --out {network}"
        ),
        "train" => format!(
            "measure a release that the model has not seen, with the network the device comes with and with the new \
             one:\n  yawrig replay {other}\n  yawrig replay {other} --network {network}"
        ),
        "replay" if !given("--network") => {
            format!("now with the new network:\n  yawrig replay {other} --network {network}")
        }
        "replay" | "flash" => {
            format!("open the seal:\n  yawrig demo --reveal {}", folder.display())
        }
        _ => return,
    };
    crate::say!("\nnext: {next}");
}

/// Every step at once.
fn solve(arguments: &Demo, folder: &Path) -> Result<()> {
    let truth = story::unsealed(folder)?;
    let at = |name: &str| folder.join(name);
    let (model, network) = (at(MODEL_FILE), at(NETWORK_FILE));
    let first = at(story::first_release(&truth));
    let tell = |line: String| match arguments.json {
        true => Ok(()),
        false => print_line(&line),
    };
    let compared = compare(&Comparison { files: vec![first.clone()], ..Comparison::default() })?;
    tell(format!("$ yawrig compare {} --no-model\n{}", first.display(), over_noise(&compared)))?;
    let file = CampaignFile::read_releases(&story::campaign(folder))?;
    let diagnosis = crate::campaign::diagnose(
        &file,
        &Options { stop: interrupt::stop(), ..Options::default() },
    )?;
    let named: Vec<&str> = diagnosis.effects.iter().map(|e| e.id()).collect();
    tell(format!(
        "$ yawrig diagnose {}\n  {}",
        file.path.display(),
        match named.is_empty() {
            true => "nothing of the library is found in it".to_owned(),
            false => format!("explained by {}", named.join(", ")),
        }
    ))?;
    let step = |command: String| Asked { command, why: None };
    let command = format!("yawrig fit {} --model {}", first.display(), model.display());
    let wanted = Wanted { files: vec![first], ..Wanted::default() };
    let fitted = revise::fit(&model, &wanted, &step(command.clone()))?;
    tell(format!("$ {command}\n{}", over_noise(&fitted)))?;
    for effect in diagnosis.effects.iter().filter(|e| **e != Effect::Buffeting) {
        let command = format!("yawrig add {effect} --model {}", model.display());
        let added = revise::add(&model, effect.clone(), &step(command.clone()))?;
        tell(format!("$ {command}\n{}", over_noise(&added)))?;
    }
    tell(format!(
        "$ yawrig train --model {} --samples {SAMPLES} --epochs {EPOCHS} --out {}",
        model.display(),
        network.display()
    ))?;
    let outcome = teach(&lesson(&model)?)?;
    files::write_atomically(&network, &outcome.blob)?;
    tell(format!("$ yawrig demo --reveal {}", folder.display()))?;
    let revealed = reveal::reveal(folder, &arguments.device.device, &mut flash::Bar::new())?;
    if let Some(chart) = reveal::device_chart(&revealed) {
        files::write_atomically(&at(PICTURE_FILE), chart.file()?.as_bytes())?;
    }
    let page = at(REPORT_FILE);
    super::report::write(&of_model(&model, Made::now(asked(None).command))?, &page)?;
    shown(arguments, folder, &revealed, Some(&page))
}

fn over_noise(revision: &Revision) -> String {
    let r = revision.appraisal.residuals;
    format!(
        "  residual {:.2} times the noise, {:.2} times on the later part, which was held out",
        r.residual_over_noise, r.held_out_over_noise
    )
}

/// As `train --model` has them.
fn lesson(model: &Path) -> Result<Settings> {
    let source = training::read(model)?;
    let amplitude = training::augmented(&source)?.is_some();
    Ok(Settings {
        features: FeatureKind::BinMeans,
        components: None,
        ranges: Ranges {
            natural_frequency_rad_s: [2.4, 28.0],
            damping_ratio: [0.0005, 0.105],
            noise: [0.002, 0.01],
        },
        model: Some(source),
        amplitude,
        samples: SAMPLES,
        training: Training { epochs: EPOCHS, ..Training::default() },
    })
}

/// `demo --reveal`.
pub fn reveal(arguments: &Demo, folder: &Path) -> Result<()> {
    let revealed = reveal::reveal(folder, &arguments.device.device, &mut flash::Bar::new())?;
    shown(arguments, folder, &revealed, None)
}

#[derive(Serialize)]
struct Object<'a> {
    folder: &'a Path,
    device_kind: String,
    #[serde(flatten)]
    revealed: &'a Revealed,
    report: Option<&'a Path>,
}

fn shown(
    arguments: &Demo,
    folder: &Path,
    revealed: &Revealed,
    report: Option<&Path>,
) -> Result<()> {
    if arguments.json {
        let device_kind = arguments.device.device.to_string();
        return print_json(&Object { folder, device_kind, revealed, report });
    }
    print_line(&text(folder, revealed))?;
    report.map_or(Ok(()), |page| print_line(&format!("report: {}", page.display())))
}

fn text(folder: &Path, r: &Revealed) -> String {
    let hidden = &r.hidden;
    let mut out = format!("hidden: {} ({})\n", hidden.effect, hidden.title);
    match &r.model {
        None => out += &format!("there is no {} in {}\n", MODEL_FILE, folder.display()),
        Some(m) if m.named_right => out += &format!("your model: {}: named right\n", hidden.effect),
        Some(m) if m.effects.is_empty() => out += "your model has no effects\n",
        Some(m) if m.effects.contains(&hidden.effect) => {
            out +=
                &format!("your model: {}: right, and more than was hidden\n", m.effects.join(", "));
        }
        Some(m) => out += &format!("your model: {}: not what was hidden\n", m.effects.join(", ")),
    }
    for p in &hidden.parameters {
        out += &match (p.found, p.within_k2) {
            (Some(found), Some(within)) => format!(
                "  {} = {found} {}, truth {}: {:.3} % off, {} k = 2\n",
                p.name,
                p.unit,
                p.truth,
                100.0 * (found.value / p.truth - 1.0).abs(),
                if within { "within" } else { "not within" }
            ),
            _ => format!("  {}: truth {} {}\n", p.name, p.truth, p.unit),
        };
    }
    let mut rows =
        bare(&["release", "zeta planted", "host before", "after", "device before", "after"]);
    for release in &r.releases {
        let miss = |pair: Option<[f64; 2]>| {
            pair.map_or("-".to_owned(), |p| format!("{:+.6}", p[1] - release.truth[1]))
        };
        rows.add_row([
            release.file.clone(),
            format!("{:.6}", release.truth[1]),
            miss(Some(release.host_before)),
            miss(release.host_after),
            miss(Some(release.device_before)),
            miss(release.device_after),
        ]);
    }
    out += &format!(
        "\nDamping ratio of each release, and by how much it is missed before and after the effect is known:\n{}\n",
        rows.trim_fmt()
    );
    let mut rows = bare(&["rms error", "second order", "with the effect", "times less"]);
    for (name, errors) in [("host", &r.host), ("device", &r.device)] {
        let Some(e) = errors else { continue };
        let Errors {
            natural_frequency_before: f0,
            natural_frequency_after: f1,
            damping_ratio_before: z0,
            damping_ratio_after: z1,
        } = e;
        for (what, unit, scale, before, after) in
            [("wn", " %", 100.0, f0, f1), ("zeta", "", 1.0, z0, z1)]
        {
            rows.add_row([
                format!("{name}, {what}"),
                format!("{:.6}{unit}", scale * before),
                format!("{:.6}{unit}", scale * after),
                format!("{:.1}", before / after),
            ]);
        }
    }
    out += &format!("\n{}", rows.trim_fmt());
    if r.device.is_none() {
        out += "\nthere is no network here that has learnt the effect: yawrig train --model";
    }
    out
}
