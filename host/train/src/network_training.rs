//! From settings to a frozen network: draw windows, train, freeze, test.

use super::augmented::{Asked, Augmented, Source};
use super::draws::{draw, Draw, Ranges};
use super::errors::Errors;
use super::freeze::{self, Scaling};
use super::held_out::{HeldOut, HeldOutEpoch};
use super::pca::{self, Projection};
use super::{Checkpoint, Options, Precision, Progress, Samples, Stop, Trained};
use serde::{Deserialize, Serialize};
use yawrig_base::error::{Error, Exit, Result};
use yawrig_base::settings;
use yawrig_shared::blob::Provenance;
use yawrig_shared::features::FeatureKind;
use yawrig_shared::network::{Network, MAX_POWER, OUTPUTS};

/// Windows the network is tested on, drawn apart from those it is trained on.
const TEST_DRAWS: usize = 2000;

/// The settings of a training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    pub features: FeatureKind,
    /// Principal components of the features that the network is given; none: the features themselves.
    pub components: Option<usize>,
    pub ranges: Ranges,
    /// A model whose effects the windows have; none: the second-order response alone.
    pub model: Option<Source>,
    /// Numbers of the model's effects that the network is to say, too.
    #[serde(default)]
    pub numbers: Vec<Asked>,
    /// The window's amplitude is an input, too.
    pub amplitude: bool,
    pub samples: usize,
    pub training: Options,
}

/// A frozen network and how it came about.
#[derive(Clone, Debug)]
pub struct Outcome {
    pub network: Network,
    pub blob: Vec<u8>,
    pub trained: Trained,
    /// Nodes in each layer of what was trained; its inputs are the components where there are any.
    pub topology: Vec<usize>,
    pub train: Errors,
    pub test: Errors,
    pub numbers: Vec<Told>,
    /// Errors on the windows of `test` over the training; not at every epoch.
    pub test_history: Vec<HeldOutEpoch>,
}

/// How well the network tells a number of an effect, on the windows of `test`: rms in the number's unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Told {
    #[serde(flatten)]
    pub asked: Asked,
    pub rms: f64,
    pub rms_without_noise: f64,
}

impl Told {
    /// Rms of who knows nothing of it but its range.
    fn guessing(&self) -> f64 {
        let [low, high] = self.asked.range;
        (high - low) / 12.0_f64.sqrt()
    }
}

/// A network whose error of a number without noise is a larger share of that of guessing does not tell it:
/// what it says is the middle of the range more than the window.
const TELLS: f64 = 0.5;

/// Draws, trains, freezes and tests; `model`: that of the settings, whose effects the windows have.
///
/// # Errors
/// Exit 2 for settings that make no sense, exit 6 for a training that came to nothing.
pub fn run(
    settings: &Settings,
    model: Option<&Augmented>,
    progress: &mut dyn Progress,
) -> Result<Outcome> {
    from(settings, model, None, progress)
}

/// Goes on with a training that was interrupted at `checkpoint`: the same network to the bit as if it had
/// not been. Only the start it had come to is gone on with.
///
/// # Errors
/// As [`run`].
pub fn resume(
    settings: &Settings,
    model: Option<&Augmented>,
    checkpoint: &Checkpoint,
    progress: &mut dyn Progress,
) -> Result<Outcome> {
    from(settings, model, Some(checkpoint), progress)
}

fn from(
    settings: &Settings,
    model: Option<&Augmented>,
    checkpoint: Option<&Checkpoint>,
    progress: &mut dyn Progress,
) -> Result<Outcome> {
    check(settings)?;
    let seed = settings.training.seed;
    let quiet = Ranges { noise: [0.0; 2], ..settings.ranges.clone() };
    let windows =
        |ranges: &Ranges, count, seed| draw(ranges, settings.features, model, count, seed);
    let draws = windows(&settings.ranges, settings.samples, seed)?;
    let asked: Vec<Asked> = model.into_iter().flat_map(Augmented::asked).cloned().collect();
    let scaling = Scaling::new(&draws, &settings.ranges, asked.iter(), settings.amplitude);
    let projection = match settings.components {
        None => None,
        Some(count) => Some(projection(&scaling.inputs(&draws), draws.len(), count)?),
    };
    let told = |draws: &[Draw]| {
        let inputs = scaling.inputs(draws);
        let inputs = match &projection {
            Some(projection) => projection.apply(&inputs),
            None => inputs,
        };
        let (n, targets) = (draws.len(), scaling.targets(draws));
        Samples { d: inputs.len() / n, inputs, targets, n, k: OUTPUTS + asked.len() }
    };
    let samples = told(&draws);
    let topology = settings.training.topology(&samples);
    // Freezing is tried before training: a network too large for the device is no use.
    let shape: usize = topology.windows(2).map(|pair| (pair[0] + 1) * pair[1]).sum();
    let freeze = |weights: &[f64]| {
        let (layers, weights) = with_projection(&topology, weights, projection.as_ref());
        let linear = layers.len() - topology.len();
        freeze::network(&layers, linear, &weights, settings.features, &scaling, &settings.ranges)
    };
    freeze(&vec![0.0; shape])?;
    // Drawn before the training, too: where that is interrupted its network is still tested.
    let test_draws = windows(&settings.ranges, TEST_DRAWS, !seed)?;
    let quiet_draws = windows(&quiet, TEST_DRAWS, !seed)?;
    // Without noise one output can let the other starve; with it a shared precision lets zeta's
    // noise loosen the fit of wn.
    let quiet_windows = settings.ranges.noise[1] == 0.0;
    let precision = if quiet_windows { Precision::Shared } else { Precision::PerOutput };
    let options = Options { precision, ..settings.training.clone() };
    let test_samples = told(&test_draws);
    let mut progress = HeldOut::new(&test_samples, &topology, progress);
    let trained = match checkpoint {
        None => super::train(&samples, &options, &mut progress),
        Some(checkpoint) => super::resume(&samples, &options, checkpoint, &mut progress),
    }?;
    let test_history = progress.history(&trained);
    let mut network = freeze(&trained.weights)?;
    let (test, numbers) = tested(&mut network, &test_draws, &quiet_draws, &asked);
    network.number_names = model.and_then(Augmented::number_names).unwrap_or_default();
    if trained.stopped != Stop::Interrupted {
        numbers.iter().try_for_each(tells)?;
    }
    let provenance = Provenance {
        trainer: heapless::String::try_from(env!("CARGO_PKG_VERSION")).unwrap_or_default(),
        seed,
        samples: settings.samples as u32,
        epochs: trained.epochs as u32,
        noise: settings.ranges.noise.map(|x| x as f32),
        effects: model.and_then(Augmented::ids).unwrap_or_default(),
    };
    let blob = freeze::blob(network.clone(), provenance, &test_draws)?;
    let train = freeze::errors(&network, &draws);
    Ok(Outcome { network, blob, trained, topology, train, test, numbers, test_history })
}

/// How far the network is off in windows it was not trained on, with noise and without, which it carries
/// with it.
fn tested(
    network: &mut Network,
    test_draws: &[Draw],
    quiet_draws: &[Draw],
    asked: &[Asked],
) -> (Errors, Vec<Told>) {
    let test = freeze::errors(network, test_draws);
    let bias = freeze::errors(network, quiet_draws);
    let rms =
        |e: &Errors| [e.natural_frequency_mse.sqrt() as f32, e.damping_ratio_mse.sqrt() as f32];
    (network.test_rms, network.bias_rms) = (rms(&test), rms(&bias));
    let noisy = freeze::number_errors(network, test_draws);
    let quiet = freeze::number_errors(network, quiet_draws);
    let mut numbers = Vec::new();
    for (((number, noisy), quiet), asked) in
        network.numbers.iter_mut().zip(&noisy).zip(&quiet).zip(asked)
    {
        (number.test_rms, number.bias_rms) = (noisy.rms as f32, quiet.rms as f32);
        // The noise was drawn as a share of the amplitude; a sensor's is the same at all of them.
        let power = 2.0 - 2.0 * noisy.amplitude_power;
        number.amplitude_power = power.round().clamp(0.0, f64::from(MAX_POWER)) as u8;
        let (rms, rms_without_noise) = (noisy.rms, quiet.rms);
        numbers.push(Told { asked: asked.clone(), rms, rms_without_noise });
    }
    (test, numbers)
}

/// # Errors
/// Exit 6 where the network says little more of a number than where its range is.
fn tells(told: &Told) -> Result<()> {
    let Told { asked: Asked { name, unit, .. }, rms_without_noise: rms, .. } = told;
    let guessing = told.guessing();
    if *rms <= TELLS * guessing {
        return Ok(());
    }
    Err(Error::new(
        Exit::Quality,
        format!(
            "the network cannot tell {name}: from windows without noise it is off by {rms:.2e} {unit} rms, and the middle \
             of its range by {guessing:.2e}"
        ),
    )
    .help(format!(
        "if three cycles hold it at all: ranges around the rig's own ({}, {}), a wider one of the number, more {} or {}",
        settings::name("natural_frequency"),
        settings::name("damping"),
        settings::name("samples"),
        settings::name("epochs")
    )))
}

/// Components of these row-major inputs.
fn projection(inputs: &[f64], rows: usize, count: usize) -> Result<Projection> {
    Projection::new(inputs, inputs.len() / rows, count, pca::Scale::Common).ok_or_else(|| {
        Error::usage(format!(
            "{}: the training windows have no {count} components",
            settings::given("features", &format!("pca:{count}"))
        ))
        .help(format!("take 1 to 41 components: {}", settings::given("features", "pca:10")))
    })
}

/// What the device runs: the projection as a layer of its own before the trained ones.
fn with_projection(
    topology: &[usize],
    weights: &[f64],
    projection: Option<&Projection>,
) -> (Vec<usize>, Vec<f64>) {
    let Some(projection) = projection else { return (topology.to_vec(), weights.to_vec()) };
    let mut all = projection.layer();
    let mut layers = vec![all.len() / projection.count() - 1];
    layers.extend(topology);
    all.extend(weights);
    (layers, all)
}

fn check(settings: &Settings) -> Result<()> {
    let Ranges { natural_frequency_rad_s, damping_ratio, noise } = &settings.ranges;
    let rising = |[low, high]: &[f64; 2]| low.is_finite() && high.is_finite() && low < high;
    if !rising(natural_frequency_rad_s) || natural_frequency_rad_s[0] < 2.4 {
        return Err(Error::usage(
            "the natural frequency's range must rise and begin at 2.4 rad/s or above",
        )
        .help("three cycles slower than that do not fit the device's buffer of 8.2 s"));
    }
    if natural_frequency_rad_s[1] > 60.0 {
        return Err(Error::usage("the natural frequency's range must end at 60 rad/s or below"));
    }
    if !rising(damping_ratio) || damping_ratio[0] < -0.1 || damping_ratio[1] > 0.2 {
        return Err(Error::usage("the damping ratio's range must rise and lie within -0.1 to 0.2"));
    }
    let [low, high] = *noise;
    let sensible = (low == 0.0 && high == 0.0) || (low > 0.0 && low <= high && high <= 0.2);
    if !sensible {
        return Err(Error::usage(format!(
            "noise from {low} to {high} of the peak is not a range within 0 to 0.2"
        ))
        .help(format!(
            "{}, or a range: {}",
            settings::given("noise", "0.02"),
            settings::given("noise", "0.002..0.02")
        )));
    }
    if settings.samples < 10 {
        return Err(Error::usage("fewer than 10 training samples teach nothing"));
    }
    Ok(())
}
