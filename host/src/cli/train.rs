//! `yawrig train`: train a network and freeze it to a file.

mod arguments;

use arguments::{
    features_name, numbers, parse_features, parse_noise, parse_range, parse_topology, Features,
    Span,
};
use clap::Args;
use indicatif::ProgressBar;
use std::io::Read as _;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;
use yawrig_base::error::{Error, Result};
use yawrig_base::files;
use yawrig_base::interrupt;
use yawrig_model::training;
use yawrig_shared::blob::{EffectIds, Envelope, MAGIC};
use yawrig_shared::features::FEATURES;
use yawrig_shared::network::OUTPUTS;
use yawrig_train::augmented::{Asked, Augmented, Source};
use yawrig_train::continued::Unfinished;
use yawrig_train::draws::Ranges;
use yawrig_train::errors::Errors;
use yawrig_train::freeze;
use yawrig_train::measured;
use yawrig_train::network_training::{self, Outcome, Settings, Told};
use yawrig_train::{Checkpoint, Epoch, Options, Progress, Stop};
use yawrig_verbs::common::{bar, network_id, print_json, print_line, SCHEMA_VERSION};

#[derive(Args, Debug)]
pub struct Train {
    /// Nodes in each layer, inputs first; 42 inputs: with the window's amplitude, which effects
    /// need. [default: 41-6-2, 42-6-2 on a model with effects, N-6-2 on N components; 10 in place
    /// of 6 where it says numbers of effects]
    #[arg(long)]
    topology: Option<String>,
    /// Train on this model and its effects: what the device then reports is the natural frequency
    /// and damping ratio without them
    #[arg(short, long, value_name = "MODEL")]
    model: Option<PathBuf>,
    /// What the network says: natural_frequency,damping_ratio and up to two numbers of the model's
    /// effects, as coulomb_friction.c; each is trained on from half to one and a half of the
    /// model's value, or on coulomb_friction.c=LOW..HIGH
    #[arg(long, value_name = "NAMES", requires = "model")]
    outputs: Option<String>,
    /// How a window is represented: `bins` (means over forty bins), `thesis` (forty
    /// point samples) or `pca:N` (N principal components of `bins`)
    #[arg(long, default_value = "bins", value_parser = parse_features)]
    features: Features,
    /// Training windows
    #[arg(long, default_value_t = 8000, value_parser = clap::value_parser!(u32).range(10..=100_000))]
    samples: u32,
    /// Noise of the training windows, rms as a share of the peak: a number, or LOW..HIGH
    #[arg(long, default_value_t = Span(training::RANGES.noise), value_parser = parse_noise)]
    noise: Span,
    /// Natural frequencies to train on, rad/s: LOW..HIGH; a little wider than the rig's range, as a
    /// network is at its worst at the edges
    #[arg(long, default_value_t = Span(training::RANGES.natural_frequency_rad_s), value_parser = parse_range)]
    natural_frequency: Span,
    /// Damping ratios to train on: LOW..HIGH
    #[arg(long, default_value_t = Span(training::RANGES.damping_ratio), value_parser = parse_range)]
    damping: Span,
    /// Take noise, natural frequencies and damping ratios to train on from measured records
    #[arg(long, num_args = 1.., value_name = "FILE",
          conflicts_with_all = ["noise", "natural_frequency", "damping"])]
    records: Vec<PathBuf>,
    /// Most epochs [default: 500]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    epochs: Option<u32>,
    /// Starts to choose from, by evidence
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    restarts: u32,
    /// The same seed gives the same network
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// File to write the network to [default: network.yrn]
    #[arg(short, long)]
    out: Option<PathBuf>,
    /// Go on with a training that was interrupted, from the file it has left; more `--epochs` may be
    /// given, and another `--out`
    #[arg(long = "continue", value_name = "FILE.unfinished", conflicts_with_all = ["topology",
          "features", "samples", "noise", "natural_frequency", "damping", "records", "restarts", "seed", "model", "outputs"])]
    unfinished: Option<PathBuf>,
    /// Print one JSON object
    #[arg(short, long)]
    json: bool,
}

/// Epochs where nothing is said.
const EPOCHS: u32 = 500;

/// Epochs as a bar; Ctrl-C ends the training with what it has.
pub struct Bar(ProgressBar);

impl Bar {
    pub fn new(epochs: u64) -> Self {
        Self(bar(epochs, "training"))
    }
}

impl Progress for Bar {
    fn epoch(&mut self, _epoch: &Epoch, _weights: &[f64]) -> ControlFlow<()> {
        self.0.inc(1);
        match interrupt::requested() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// What to train, from where, and where its network goes.
struct Job {
    settings: Settings,
    model: Option<Augmented>,
    from: Option<Checkpoint>,
    out: PathBuf,
}

/// The effects of the model that is trained on.
fn augmented(source: Option<&Source>, asked: &[Asked]) -> Result<Option<Augmented>> {
    source.map_or(Ok(None), |source| training::augmented(source, asked))
}

/// Their identifiers; empty: none.
fn ids(model: Option<&Augmented>) -> EffectIds {
    model.and_then(Augmented::ids).unwrap_or_default()
}

fn job(arguments: &Train) -> Result<Job> {
    if let Some(path) = &arguments.unfinished {
        let mut unfinished = Unfinished::read(path)?;
        if let Some(epochs) = arguments.epochs {
            unfinished.settings.training.epochs = epochs as usize;
        }
        let out = arguments.out.clone().unwrap_or(unfinished.out);
        let (settings, from) = (unfinished.settings, Some(unfinished.checkpoint));
        let model = augmented(settings.model.as_ref(), &settings.numbers)?;
        return Ok(Job { settings, model, from, out });
    }
    let source = arguments.model.as_deref().map(training::read).transpose()?;
    let numbers = match (&arguments.outputs, &source) {
        (Some(outputs), Some(source)) => numbers(outputs, source)?,
        _ => Vec::new(),
    };
    let model = augmented(source.as_ref(), &numbers)?;
    let effects = ids(model.as_ref());
    if let (Some(path), true) = (&arguments.model, effects.is_empty()) {
        crate::say!(
            "{} has no effects: training on the second-order response alone",
            path.display()
        );
    }
    let Features { kind, components } = arguments.features;
    let usual = FEATURES + usize::from(!effects.is_empty());
    let outputs = OUTPUTS + numbers.len();
    // A number more takes nodes of its own, or the others would be worse for it.
    let nodes = if numbers.is_empty() { 6 } else { 10 };
    let usual = format!("{}-{nodes}-{outputs}", components.unwrap_or(usual));
    let topology = arguments.topology.as_deref().unwrap_or(&usual);
    let (amplitude, hidden) = parse_topology(topology, components, !effects.is_empty(), outputs)?;
    let ranges = if arguments.records.is_empty() {
        Ranges {
            natural_frequency_rad_s: arguments.natural_frequency.0,
            damping_ratio: arguments.damping.0,
            noise: arguments.noise.0,
        }
    } else {
        let ranges = measured::ranges(&arguments.records, &yawrig_records::read)?;
        let Ranges { natural_frequency_rad_s: wn, damping_ratio: zeta, noise } = &ranges;
        crate::say!(
            "from the records: natural frequency {:.2}..{:.2} rad/s, damping ratio {:.5}..{:.5}, noise {:.4}..{:.4} \
             of the peak",
            wn[0], wn[1], zeta[0], zeta[1], noise[0], noise[1]
        );
        ranges
    };
    let settings = Settings {
        features: kind,
        components,
        model: source,
        numbers,
        amplitude,
        ranges,
        samples: arguments.samples as usize,
        training: Options {
            hidden,
            epochs: arguments.epochs.unwrap_or(EPOCHS) as usize,
            seed: arguments.seed,
            restarts: arguments.restarts as usize,
            ..Options::default()
        },
    };
    let out = arguments.out.clone().unwrap_or_else(|| "network.yrn".into());
    Ok(Job { settings, model, from: None, out })
}

/// # Errors
/// Exit 2 where something else than a network is at `out`.
fn refuse_others(out: &Path) -> Result<()> {
    let mut head = [0; MAGIC.len()];
    let read = std::fs::File::open(out).and_then(|mut file| file.read_exact(&mut head));
    match read {
        Ok(()) if head == MAGIC => Ok(()),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(()),
        _ if out.metadata().is_ok_and(|there| there.len() == 0) => Ok(()),
        _ => Err(Error::usage(format!("{} is there and is no network", out.display()))
            .help("give --out another name, as network.yrn, or move that file away")),
    }
}

pub fn run(arguments: &Train) -> Result<()> {
    let Job { settings, model, from, out } = job(arguments)?;
    files::check_writable(&out)?;
    refuse_others(&out)?;
    let begun = Instant::now();
    let mut bar = Bar::new((settings.training.epochs * settings.training.restarts) as u64);
    let outcome = match &from {
        None => network_training::run(&settings, model.as_ref(), &mut bar)?,
        Some(checkpoint) => {
            network_training::resume(&settings, model.as_ref(), checkpoint, &mut bar)?
        }
    };
    drop(bar);
    let seconds = begun.elapsed().as_secs_f64();
    let interrupted = outcome.trained.stopped == Stop::Interrupted;
    if interrupted && outcome.trained.epochs <= 1 {
        // Nothing learned yet: a network that may be there already is worth more.
        return Err(Error::interrupted());
    }
    // Beside a finished network that is there already.
    let place = if interrupted { interrupted_out(&out) } else { out.clone() };
    files::write_atomically(&place, &outcome.blob)?;
    let unfinished = Unfinished::path(&out);
    if interrupted {
        let checkpoint = outcome.trained.checkpoint.clone();
        Unfinished::new(settings.clone(), checkpoint, out.clone()).write(&unfinished)?;
    } else if arguments.unfinished.as_ref() == Some(&unfinished) {
        // It is finished now. A file that cannot be removed does no harm.
        let _ = std::fs::remove_file(&unfinished);
    }
    let effects = ids(model.as_ref());
    if arguments.json {
        print_json(&to_json(&settings, &outcome, &effects, &place, seconds))?;
    } else {
        print_line(&to_text(&settings, &outcome, &effects, &place, seconds))?;
    }
    if interrupted {
        crate::say!(
            "stopped after {} epochs; the network so far is in {}; to go on: yawrig train --continue {}",
            outcome.trained.epochs,
            place.display(),
            unfinished.display()
        );
        return Err(Error::interrupted());
    }
    Ok(())
}

/// Trains for another verb, with a bar and a line about what came of it.
///
/// # Errors
/// Those of the training; 130 where the user stops it.
pub fn teach(settings: &Settings) -> Result<Outcome> {
    let model = augmented(settings.model.as_ref(), &settings.numbers)?;
    let mut bar = Bar::new(settings.training.epochs as u64);
    let outcome = network_training::run(settings, model.as_ref(), &mut bar)?;
    drop(bar);
    interrupt::check()?;
    crate::say!(
        "trained {} on {} windows; on 2000 others: wn {:.3} % rms, zeta {:.2} % rms",
        freeze::name(&outcome.topology),
        settings.samples,
        outcome.test.natural_frequency_rms_percent,
        outcome.test.damping_ratio_rms_percent,
    );
    Ok(outcome)
}

/// Where an interrupted training leaves its network: a finished one that is there already stays.
fn interrupted_out(out: &Path) -> PathBuf {
    if !out.exists() {
        return out.to_owned();
    }
    let mut name = out.as_os_str().to_owned();
    name.push(".partial");
    name.into()
}

fn to_json(
    settings: &Settings,
    outcome: &Outcome,
    effects: &str,
    out: &Path,
    seconds: f64,
) -> serde_json::Value {
    serde_json::json!({
        "schema_version": SCHEMA_VERSION,
        "topology": freeze::name(&outcome.topology),
        "features": features_name(settings),
        "parameters": outcome.trained.weights.len(),
        "effective_parameters": outcome.trained.gamma,
        "samples": settings.samples,
        "natural_frequency_rad_s": settings.ranges.natural_frequency_rad_s,
        "damping_ratio": settings.ranges.damping_ratio,
        "noise": settings.ranges.noise,
        "epochs": outcome.trained.epochs,
        "stopped": outcome.trained.stopped,
        "seconds": seconds,
        "train": outcome.train,
        "test": outcome.test,
        "effects": effects.split_whitespace().collect::<Vec<_>>(),
        "numbers": outcome.numbers,
        "network": out.display().to_string(),
        "id": Envelope::read(&outcome.blob).map(|e| network_id(e.payload_crc)).ok(),
    })
}

fn to_text(
    settings: &Settings,
    outcome: &Outcome,
    effects: &str,
    out: &Path,
    seconds: f64,
) -> String {
    let model = match effects {
        "" => String::new(),
        effects => format!(" of a model with {}", effects.replace(' ', ", ")),
    };
    let row = |name: &str, e: &Errors| {
        format!(
            "{name:6} wn: mse {:.2e} rad2/s2, rms {:.4} %   zeta: mse {:.2e}, rms {:.3} %, 95 % below {:.3} %",
            e.natural_frequency_mse,
            e.natural_frequency_rms_percent,
            e.damping_ratio_mse,
            e.damping_ratio_rms_percent,
            e.damping_ratio_p95_percent,
        )
    };
    let numbers = outcome.numbers.iter().map(|Told { asked, rms, rms_without_noise }| {
        let Asked { name, unit, range: [low, high] } = asked;
        format!(
            "test   {name}: rms {rms:.2e} {unit}, without noise {rms_without_noise:.2e}; trained from {low} to {high}"
        )
    });
    let mut lines = vec![
        format!(
            "{} on {} windows{model}: {} epochs in {seconds:.1} s ({}), {:.0} of {} parameters effective",
            freeze::name(&outcome.topology),
            settings.samples,
            outcome.trained.epochs,
            outcome.trained.stopped.words(),
            outcome.trained.gamma,
            outcome.trained.weights.len(),
        ),
        row("train", &outcome.train),
        row("test", &outcome.test),
    ];
    lines.extend(numbers);
    lines.push(format!("written to {}", out.display()));
    lines.join("\n")
}
