//! `yawrig train`: train a network and freeze it to a file.

use super::common::{bar, network_id, print_json, print_line, SCHEMA_VERSION};
use crate::error::{Error, Result};
use crate::train::draws::Ranges;
use crate::train::errors::Errors;
use crate::train::freeze;
use crate::train::network_training::{self, Outcome, Settings};
use crate::train::{Epoch, Options, Progress, Stop};
use crate::{files, interrupt};
use clap::Args;
use indicatif::ProgressBar;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Instant;
use yawrig_shared::blob::Envelope;
use yawrig_shared::features::FeatureKind;

#[derive(Args, Debug)]
pub struct Train {
    /// Nodes in each layer, inputs first
    #[arg(long, default_value = "41-6-2")]
    topology: String,
    /// How a window is told to the network: `bins` (means over forty bins) or `thesis` (forty
    /// point samples)
    #[arg(long, default_value = "bins", value_parser = parse_features)]
    features: FeatureKind,
    /// Training windows
    #[arg(long, default_value_t = 8000, value_parser = clap::value_parser!(u32).range(10..=100_000))]
    samples: u32,
    /// Noise of the training windows, rms as a share of the peak: a number, or LOW..HIGH
    #[arg(long, default_value = "0.002..0.01", value_parser = parse_noise)]
    noise: [f64; 2],
    /// Natural frequencies to train on, rad/s: LOW..HIGH; a little wider than the rig's range, as a
    /// network is at its worst at the edges
    #[arg(long, default_value = "2.4..28", value_parser = parse_range)]
    natural_frequency: [f64; 2],
    /// Damping ratios to train on: LOW..HIGH
    #[arg(long, default_value = "0.0005..0.105", value_parser = parse_range)]
    damping: [f64; 2],
    /// Most epochs
    #[arg(long, default_value_t = 500, value_parser = clap::value_parser!(u32).range(1..))]
    epochs: u32,
    /// Starts to choose from, by evidence
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    restarts: u32,
    /// The same seed gives the same network
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// File to write the network to
    #[arg(long, default_value = "network.yrn")]
    out: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

fn parse_features(text: &str) -> std::result::Result<FeatureKind, String> {
    match text {
        "bins" => Ok(FeatureKind::BinMeans),
        "thesis" => Ok(FeatureKind::PointSamples),
        other => Err(format!("`{other}` is neither `bins` nor `thesis`")),
    }
}

fn parse_range(text: &str) -> std::result::Result<[f64; 2], String> {
    let (low, high) = text.split_once("..").ok_or("a range is written LOW..HIGH")?;
    let number = |t: &str| t.trim().parse::<f64>().map_err(|_| format!("`{t}` is not a number"));
    Ok([number(low)?, number(high)?])
}

fn parse_noise(text: &str) -> std::result::Result<[f64; 2], String> {
    if text.contains("..") {
        return parse_range(text);
    }
    let level = text.parse::<f64>().map_err(|_| format!("`{text}` is not a number"))?;
    Ok([level, level])
}

fn parse_hidden(topology: &str) -> Result<Vec<usize>> {
    let wrong = || {
        Error::usage(format!("`{topology}` is not a topology this trains"))
            .help("41 inputs, hidden layers, 2 outputs: --topology 41-6-2")
    };
    let layers: Vec<usize> = topology
        .split('-')
        .map(|width| width.parse().map_err(|_| wrong()))
        .collect::<Result<_>>()?;
    match layers.as_slice() {
        [41, hidden @ .., 2] if !hidden.contains(&0) => Ok(hidden.to_vec()),
        _ => Err(wrong()),
    }
}

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

pub fn run(arguments: &Train) -> Result<()> {
    let settings = Settings {
        features: arguments.features,
        ranges: Ranges {
            natural_frequency_rad_s: arguments.natural_frequency,
            damping_ratio: arguments.damping,
            noise: arguments.noise,
        },
        samples: arguments.samples as usize,
        training: Options {
            hidden: parse_hidden(&arguments.topology)?,
            epochs: arguments.epochs as usize,
            seed: arguments.seed,
            restarts: arguments.restarts as usize,
            ..Options::default()
        },
    };
    files::check_writable(&arguments.out)?;
    let begun = Instant::now();
    let mut bar = Bar::new(u64::from(arguments.epochs) * u64::from(arguments.restarts));
    let outcome = network_training::run(&settings, &mut bar)?;
    drop(bar);
    let seconds = begun.elapsed().as_secs_f64();
    let interrupted = outcome.trained.stopped == Stop::Interrupted;
    if interrupted && outcome.trained.epochs <= 1 {
        // Nothing learned yet: a network that may be there already is worth more.
        return Err(Error::interrupted());
    }
    files::write_atomically(&arguments.out, &outcome.blob)?;
    if arguments.json {
        print_json(&to_json(arguments, &outcome, seconds))?;
    } else {
        print_line(&to_text(arguments, &outcome, seconds))?;
    }
    if interrupted {
        crate::say!("stopped after {} epochs; the network so far is kept", outcome.trained.epochs);
        return Err(Error::interrupted());
    }
    Ok(())
}

fn to_json(arguments: &Train, outcome: &Outcome, seconds: f64) -> serde_json::Value {
    serde_json::json!({
        "schema_version": SCHEMA_VERSION,
        "topology": freeze::name(&outcome.topology),
        "features": match arguments.features {
            FeatureKind::BinMeans => "bins",
            FeatureKind::PointSamples => "thesis",
        },
        "parameters": outcome.trained.weights.len(),
        "effective_parameters": outcome.trained.gamma,
        "samples": arguments.samples,
        "epochs": outcome.trained.epochs,
        "stopped": outcome.trained.stopped,
        "seconds": seconds,
        "train": outcome.train,
        "test": outcome.test,
        "network": arguments.out.display().to_string(),
        "id": Envelope::read(&outcome.blob).map(|e| network_id(e.payload_crc)).ok(),
    })
}

fn to_text(arguments: &Train, outcome: &Outcome, seconds: f64) -> String {
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
    [
        format!(
            "{} on {} windows: {} epochs in {seconds:.1} s ({:?}), {:.0} of {} parameters effective",
            freeze::name(&outcome.topology),
            arguments.samples,
            outcome.trained.epochs,
            outcome.trained.stopped,
            outcome.trained.gamma,
            outcome.trained.weights.len(),
        ),
        row("train", &outcome.train),
        row("test", &outcome.test),
        format!("written to {}", arguments.out.display()),
    ]
    .join("\n")
}
