//! The riddle of `demo --hidden`: its steps as commands, and all of them taken at once.

use super::device_arg::DeviceArg;
use super::flash;
use super::train::teach;
use crate::demo::reveal::{self, Errors, Revealed};
use crate::demo::story::{
    self, Truth, MODEL_FILE, NETWORK_FILE, PICTURE_FILE, REPORT_FILE, SEALED_FILE,
};
use serde::Serialize;
use std::path::{Path, PathBuf};
use yawrig_base::error::Result;
use yawrig_base::files;
use yawrig_base::interrupt;
use yawrig_campaign::simulated::CAMPAIGN_FILE;
use yawrig_campaign::CampaignFile;
use yawrig_core::diagnosis::diagnose::Options;
use yawrig_model::comparison::{compare, Comparison};
use yawrig_model::revise::{self, Revision, RevisionRequest, Wanted};
use yawrig_model::training;
use yawrig_report::{of_model, Made};
use yawrig_shared::features::FeatureKind;
use yawrig_train::network_training::Settings;
use yawrig_train::Options as Training;
use yawrig_verbs::common::{bare, print_json, print_line, writable};
use yawrig_verbs::model::asked;

/// What is typed and what is done: enough for a network of 42-6-2.
const SAMPLES: usize = 3000;
const EPOCHS: usize = 200;

/// A riddle in its folder, and how its answer is given.
pub struct Riddle<'a> {
    folder: PathBuf,
    device: &'a DeviceArg,
    json: bool,
}

impl<'a> Riddle<'a> {
    pub fn at(folder: PathBuf, device: &'a DeviceArg, json: bool) -> Self {
        Self { folder, device, json }
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// `demo --hidden`: with `yes` or as JSON every step is taken, else each is printed.
    ///
    /// # Errors
    /// Exit 2 where a riddle is there already; else those of the steps.
    pub fn hide(&self, seed: u64, force: bool, yes: bool) -> Result<()> {
        writable(&self.folder, force, &[SEALED_FILE, CAMPAIGN_FILE, MODEL_FILE, NETWORK_FILE])?;
        if force {
            // An earlier riddle's model would stand in the way.
            for name in [MODEL_FILE, "model.journal.jsonl", NETWORK_FILE, REPORT_FILE] {
                let _ = std::fs::remove_file(self.file(name));
            }
        }
        crate::say!("writing four releases to {}", self.folder.display());
        story::hide(&self.folder, seed, force)?;
        if yes || self.json {
            return self.solve();
        }
        print_line(&self.steps(&story::unsealed(&self.folder)?))
    }

    /// What to type, from the records to what was hidden in them.
    fn steps(&self, truth: &Truth) -> String {
        let at = |name: &str| self.file(name).display().to_string();
        let folder = self.folder.display();
        let (campaign, model, network) = (at(CAMPAIGN_FILE), at(MODEL_FILE), at(NETWORK_FILE));
        let (first, other) = (at(story::first_release(truth)), at(story::other_release(truth)));
        format!(
            "{folder} holds four releases of a model on one spring, about its middle and its front axis, with the wind \
             off\nand on. Something hidden in them is not in the second-order model. Find it:\n\n  \
             # residual over noise is 1 where nothing is left\n  \
             yawrig compare {first} --no-model\n  \
             # which effect is it?\n  \
             yawrig diagnose {campaign}\n  \
             # a model of a release, and in it the effect that diagnose has named, in the place of EFFECT\n  \
             yawrig fit {first} --model {model}\n  \
             yawrig add EFFECT --model {model}\n  \
             # a network that knows the effect, and a release that the model has not seen, measured without and with it\n  \
             {}\n  \
             yawrig replay {other}\n  \
             yawrig replay {other} --network {network}\n  \
             # what was hidden, and how near you have come\n  \
             yawrig demo --reveal {folder}",
            self.train_command()
        )
    }

    fn train_command(&self) -> String {
        let (model, network) = (self.file(MODEL_FILE), self.file(NETWORK_FILE));
        let (model, network) = (model.display(), network.display());
        format!(
            "yawrig train --model {model} --samples {SAMPLES} --epochs {EPOCHS} --out {network}"
        )
    }

    /// Every step at once.
    fn solve(&self) -> Result<()> {
        let truth = story::unsealed(&self.folder)?;
        let (model, network) = (self.file(MODEL_FILE), self.file(NETWORK_FILE));
        let first = self.file(story::first_release(&truth));
        let show = |line: String| match self.json {
            true => Ok(()),
            false => print_line(&line),
        };
        let compared =
            compare(&Comparison { files: vec![first.clone()], ..Comparison::default() })?;
        show(format!(
            "$ yawrig compare {} --no-model\n{}",
            first.display(),
            over_noise(&compared)
        ))?;
        let file = CampaignFile::read_releases(&story::campaign(&self.folder))?;
        let found = yawrig_campaign::diagnose(
            &file,
            &Options { stop: interrupt::stop(), ..Options::default() },
        )?;
        let diagnosis = found.diagnosis;
        let named: Vec<&str> = diagnosis.effects.iter().map(|e| e.id()).collect();
        show(format!(
            "$ yawrig diagnose {}\n  {}",
            file.path.display(),
            match named.is_empty() {
                true => "nothing of the library is found in it".to_owned(),
                false => format!("explained by {}", named.join(", ")),
            }
        ))?;
        let step = |command: String| RevisionRequest { command, ..RevisionRequest::default() };
        let command = format!("yawrig fit {} --model {}", first.display(), model.display());
        let wanted = Wanted { files: vec![first], ..Wanted::default() };
        let fitted = revise::fit(&model, &wanted, &step(command.clone()))?;
        show(format!("$ {command}\n{}", over_noise(&fitted)))?;
        for effect in diagnosis.effects.iter().filter(|e| !e.is_random()) {
            let command = format!("yawrig add {effect} --model {}", model.display());
            let added = revise::add(&model, effect.clone(), &step(command.clone()))?;
            show(format!("$ {command}\n{}", over_noise(&added)))?;
        }
        show(format!("$ {}", self.train_command()))?;
        let outcome = teach(&lesson(&model)?)?;
        files::write_atomically(&network, &outcome.blob)?;
        show(format!("$ yawrig demo --reveal {}", self.folder.display()))?;
        let revealed = self.revealed()?;
        if let Some(chart) = reveal::device_chart(&revealed) {
            files::write_atomically(&self.file(PICTURE_FILE), chart.file()?.as_bytes())?;
        }
        let page = self.file(REPORT_FILE);
        yawrig_verbs::report::write(&of_model(&model, Made::now(asked(None).command))?, &page)?;
        self.show(&revealed, Some(&page))
    }

    /// `demo --reveal`.
    ///
    /// # Errors
    /// Exit 3 where there is no riddle; those of the device.
    pub fn reveal(&self) -> Result<()> {
        self.show(&self.revealed()?, None)
    }

    fn revealed(&self) -> Result<Revealed> {
        reveal::reveal(&self.folder, &self.device.device, &mut flash::Bar::new())
    }

    fn show(&self, revealed: &Revealed, report: Option<&Path>) -> Result<()> {
        let folder = self.folder.as_path();
        if self.json {
            let device_kind = self.device.device.to_string();
            return print_json(&Object { folder, device_kind, revealed, report });
        }
        print_line(&text(folder, revealed))?;
        report.map_or(Ok(()), |page| print_line(&format!("report: {}", page.display())))
    }
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
    let amplitude = training::augmented(&source, &[])?.is_some();
    Ok(Settings {
        features: FeatureKind::BinMeans,
        components: None,
        ranges: training::RANGES,
        model: Some(source),
        numbers: Vec::new(),
        amplitude,
        samples: SAMPLES,
        training: Training { epochs: EPOCHS, ..Training::default() },
    })
}

#[derive(Serialize)]
struct Object<'a> {
    folder: &'a Path,
    device_kind: String,
    #[serde(flatten)]
    revealed: &'a Revealed,
    report: Option<&'a Path>,
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
