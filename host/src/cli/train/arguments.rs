//! What is asked of a training, from the words of the command line.

use yawrig_base::error::{Error, Result};
use yawrig_model::training;
use yawrig_shared::features::{FeatureKind, FEATURES};
use yawrig_shared::network::{MAX_OUTPUTS, OUTPUTS};
use yawrig_shared::numbers::MAX_NUMBERS;
use yawrig_train::augmented::{Asked, Source};
use yawrig_train::network_training::Settings;

/// `--features`: how a window is represented, and by how many components.
#[derive(Clone, Copy, Debug)]
pub(super) struct Features {
    pub(super) kind: FeatureKind,
    pub(super) components: Option<usize>,
}

pub(super) fn parse_features(text: &str) -> std::result::Result<Features, String> {
    let kind = match text {
        "bins" => FeatureKind::BinMeans,
        "thesis" => FeatureKind::PointSamples,
        other => {
            let count = other.strip_prefix("pca:").and_then(|n| n.parse().ok());
            return match count.filter(|n| (1..=FEATURES).contains(n)) {
                Some(count) => {
                    Ok(Features { kind: FeatureKind::BinMeans, components: Some(count) })
                }
                None => Err(format!(
                    "`{other}` is neither `bins` nor `thesis` nor `pca:N` with N from 1 to {FEATURES}"
                )),
            };
        }
    };
    Ok(Features { kind, components: None })
}

pub(super) fn features_name(settings: &Settings) -> String {
    match (settings.features, settings.components) {
        (_, Some(count)) => format!("pca:{count}"),
        (FeatureKind::BinMeans, None) => "bins".into(),
        (FeatureKind::PointSamples, None) => "thesis".into(),
    }
}

/// From the first to the second.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span(pub(super) [f64; 2]);

impl std::fmt::Display for Span {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}..{}", self.0[0], self.0[1])
    }
}

pub(super) fn parse_range(text: &str) -> std::result::Result<Span, String> {
    let (low, high) = text.split_once("..").ok_or("a range is written LOW..HIGH")?;
    let number = |t: &str| t.trim().parse::<f64>().map_err(|_| format!("`{t}` is not a number"));
    Ok(Span([number(low)?, number(high)?]))
}

pub(super) fn parse_noise(text: &str) -> std::result::Result<Span, String> {
    if text.contains("..") {
        return parse_range(text);
    }
    let level = text.parse::<f64>().map_err(|_| format!("`{text}` is not a number"))?;
    Ok(Span([level, level]))
}

/// The outputs that every network has, as `--outputs` names them.
const ALWAYS: [&str; OUTPUTS] = ["natural_frequency", "damping_ratio"];

/// The numbers of effects among these outputs.
pub(super) fn numbers(outputs: &str, source: &Source) -> Result<Vec<Asked>> {
    let wrong = |what: String| Error::usage(format!("--outputs {outputs}: {what}"));
    let wanted = outputs.split(',').map(|output| match output.split_once('=') {
        None => Ok((output.trim(), None)),
        Some((name, range)) => match parse_range(range) {
            Ok(Span(range)) => Ok((name.trim(), Some(range))),
            Err(why) => Err(wrong(format!("{name}: {why}"))
                .help(format!("a number's range stands behind it: {name}=LOW..HIGH"))),
        },
    });
    let wanted: Vec<_> = wanted.collect::<Result<_>>()?;
    for (place, (name, range)) in wanted.iter().enumerate() {
        if wanted[..place].iter().any(|(before, _)| before == name) {
            return Err(wrong(format!("{name} stands there twice")).help("name it once"));
        }
        if ALWAYS.contains(name) && range.is_some() {
            return Err(wrong(format!("{name} has a range of its own"))
                .help("give it with --natural-frequency or --damping"));
        }
    }
    if let Some(missing) = ALWAYS.iter().find(|always| !wanted.iter().any(|(n, _)| n == *always)) {
        return Err(wrong(format!("{missing} is left out, which every network says"))
            .help(format!("begin with {}", ALWAYS.join(","))));
    }
    let numbers: Vec<_> = wanted.iter().filter(|(name, _)| !ALWAYS.contains(name)).collect();
    if numbers.len() > MAX_NUMBERS {
        let count = wanted.len();
        return Err(wrong(format!("{count} outputs, and a device says {MAX_OUTPUTS} at most"))
            .help("train another network for the others"));
    }
    numbers.into_iter().map(|(name, range)| training::asked(source, name, *range)).collect()
}

/// Whether the amplitude is an input, and the hidden layers. `with_effects`: the windows are of a
/// model that has some; `outputs`: so many there are.
pub(super) fn parse_topology(
    topology: &str,
    components: Option<usize>,
    with_effects: bool,
    outputs: usize,
) -> Result<(bool, Vec<usize>)> {
    let inputs = components.unwrap_or(FEATURES);
    let wrong = || {
        Error::usage(format!("`{topology}` is not a topology this trains")).help(format!(
            "{inputs} inputs, hidden layers, {outputs} outputs: --topology {inputs}-6-{outputs}"
        ))
    };
    let layers: Vec<usize> = topology
        .split('-')
        .map(|width| width.parse().map_err(|_| wrong()))
        .collect::<Result<_>>()?;
    let Some((_, layers)) = layers.split_last().filter(|(last, _)| **last == outputs) else {
        return Err(wrong());
    };
    match layers {
        [first, hidden @ ..] if components.is_some() && !hidden.contains(&0) => {
            match *first == inputs {
                true => Ok((with_effects, hidden.to_vec())),
                false => Err(wrong()),
            }
        }
        [42, _, ..] if !with_effects => Err(Error::usage(format!(
            "`{topology}`: without effects nothing depends on the amplitude, the 42nd input"
        ))
        .help("take 41 inputs, or train on a model with effects: --model model.toml")),
        [inputs @ (41 | 42), hidden @ ..] if !hidden.contains(&0) => {
            Ok((*inputs == 42, hidden.to_vec()))
        }
        _ => Err(wrong()),
    }
}
