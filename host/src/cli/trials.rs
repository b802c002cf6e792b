//! Trials of one thing side by side: what was identified in each, at an amplitude that all of them have, and
//! whether they agree.

use super::common::with_words;
use std::fmt::Write as _;
use yawrig_base::error::Result;
use yawrig_core::identify::flag::Flag;
use yawrig_core::identify::{AtAmplitude, Identification};
use yawrig_core::quantity::Quantity;
use yawrig_core::record::Measurand;
use yawrig_report::plot::{svg_in_columns, Axis, Curve, Plot};
use yawrig_report::units::sized;

/// Records with a curve each in the plot; of more nothing could be told apart.
const DRAWN: usize = 12;
/// Scatter over what the uncertainties explain, above which trials differ: of two by chance once in eighty.
const DIFFER: f64 = 2.5;

/// What is kept of a record.
#[derive(Clone, Debug)]
struct Trial {
    file: String,
    measurand: Measurand,
    wn: Quantity,
    zeta: Quantity,
    at: Vec<AtAmplitude>,
    verdict: String,
}

/// The records identified so far.
#[derive(Clone, Debug, Default)]
pub struct Trials {
    all: Vec<Trial>,
}

/// The flags that say what kind of motion it was.
fn verdict(flags: &[Flag]) -> String {
    let said = |flag: &Flag| match flag {
        Flag::Grows => Some("grows"),
        Flag::AmplitudeDependentFrequency => Some("wn changes with amplitude"),
        Flag::AmplitudeDependentDamping => Some("zeta changes with amplitude"),
        Flag::ResidualAboveNoise => Some("not one mode"),
        Flag::FewCycles => Some("few cycles"),
        Flag::DoesNotDieAway => Some("does not die away"),
        Flag::SeveralReleases => Some("one of several releases"),
        _ => None,
    };
    let said: Vec<&str> = flags.iter().filter_map(said).collect();
    match said.is_empty() {
        true => "one mode".to_owned(),
        false => said.join(", "),
    }
}

impl Trials {
    /// Takes in what the first method has found.
    pub fn add(&mut self, found: &Identification) {
        let Some(estimate) = found.estimates.first() else { return };
        self.all.push(Trial {
            file: found.file.clone(),
            measurand: found.said.measurand(),
            wn: estimate.natural_frequency_rad_s,
            zeta: estimate.damping_ratio,
            at: estimate.at_amplitude.clone(),
            verdict: verdict(&estimate.flags),
        });
    }

    /// The largest amplitude that all have, and what each has there; none where they have none in common.
    fn common(&self) -> Option<(f64, Vec<[Quantity; 2]>)> {
        let same = self.all.windows(2).all(|pair| pair[0].measurand == pair[1].measurand);
        let largest = |t: &Trial| t.at.first().map(|a| a.amplitude_deg);
        let largest: Option<Vec<f64>> = self.all.iter().map(largest).collect();
        let amplitude = largest?.into_iter().fold(f64::INFINITY, f64::min);
        let there = |t: &Trial| {
            let there = AtAmplitude::between(&t.at, amplitude)?;
            Some([there.natural_frequency_rad_s, there.damping_ratio])
        };
        let each = self.all.iter().map(there).collect::<Option<_>>();
        each.filter(|_| same).map(|each| (amplitude, each))
    }

    /// One table of all, and whether they agree; nothing for one record alone.
    pub fn table(&self) -> String {
        let [first, _, ..] = self.all.as_slice() else { return String::new() };
        let mut out = String::new();
        let (header, rows) = match self.common() {
            Some((amplitude, each)) => {
                let at = format!(
                    "{} {}",
                    sized(&first.measurand, amplitude, 2),
                    first.measurand.coordinate_unit()
                );
                let names = [format!("wn at {at}"), format!("zeta at {at}")];
                (names, each.into_iter().map(Some).collect())
            }
            None => ([String::new(), String::new()], vec![None; self.all.len()]),
        };
        let [wn_at, zeta_at] = &header;
        let mut table = with_words(&["record", "wn (rad/s)", "zeta", wn_at, zeta_at, ""], &[5]);
        for (trial, at) in self.all.iter().zip(rows) {
            let [wn, zeta] =
                at.map_or([String::new(), String::new()], |q| q.map(|q| q.to_string()));
            table.add_row([
                trial.file.clone(),
                trial.wn.to_string(),
                trial.zeta.to_string(),
                wn,
                zeta,
                trial.verdict.clone(),
            ]);
        }
        let _ = writeln!(out, "\n{}", table.trim_fmt());
        if let Some((_, each)) = self.common() {
            for (k, name) in ["wn", "zeta"].into_iter().enumerate() {
                let all: Vec<Quantity> = each.iter().map(|q| q[k]).collect();
                let _ = writeln!(out, "{}", agreement(name, &all));
            }
        }
        out
    }

    /// wn and zeta of each against amplitude, as a drawing of its own.
    ///
    /// # Errors
    /// Exit 1, for a defect of this program only.
    pub fn svg(&self) -> Result<String> {
        type Of = fn(&AtAmplitude) -> Quantity;
        let unit = self.all.first().map(|t| t.measurand.coordinate_unit().to_owned());
        let unit = unit.unwrap_or_else(|| "deg".to_owned());
        let all: [(&str, &str, Of); 2] = [
            ("Natural frequency", "wn (rad/s)", |a| a.natural_frequency_rad_s),
            ("Damping ratio", "zeta", |a| a.damping_ratio),
        ];
        let plot = |(title, label, of): (&str, &str, Of)| {
            let curve = |t: &Trial| {
                let bar = |a: &AtAmplitude| (a.amplitude_deg, of(a).value, 2.0 * of(a).u);
                Curve::bars(t.file.clone(), t.at.iter().map(bar).collect())
            };
            Plot {
                title: format!("{title} against amplitude, k = 2"),
                x: Axis::logarithmic(format!("amplitude ({unit})")),
                y: Axis::linear(label),
                curves: self.all.iter().take(DRAWN).map(curve).collect(),
            }
        };
        svg_in_columns(&all.map(plot), 1)
    }

    /// Records that the drawing has no room for.
    pub fn not_drawn(&self) -> usize {
        self.all.len().saturating_sub(DRAWN)
    }
}

/// Mean and scatter of `all`, and how large that is against their uncertainties.
fn agreement(name: &str, all: &[Quantity]) -> String {
    let n = all.len() as f64;
    let mean = all.iter().map(|q| q.value).sum::<f64>() / n;
    let square = all.iter().map(|q| (q.value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let expected = (all.iter().map(|q| q.u * q.u).sum::<f64>() / n).sqrt();
    let ratio = square.sqrt() / expected;
    let said = match ratio > DIFFER {
        true => "the trials differ",
        false => "the trials agree",
    };
    let scattered = Quantity::new(mean, square.sqrt());
    format!("{name} there: mean {scattered} (scatter), {ratio:.1} times what the uncertainties explain: {said}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(amplitude_deg: f64, wn: f64, u: f64) -> AtAmplitude {
        AtAmplitude {
            amplitude_deg,
            natural_frequency_rad_s: Quantity::new(wn, u),
            damping_ratio: Quantity::new(0.01, 1e-4),
        }
    }

    fn trial(file: &str, at: Vec<AtAmplitude>) -> Trial {
        Trial {
            file: file.to_owned(),
            measurand: Measurand::default(),
            wn: at[0].natural_frequency_rad_s,
            zeta: at[0].damping_ratio,
            at,
            verdict: verdict(&[Flag::AmplitudeDependentFrequency, Flag::Resampled]),
        }
    }

    #[test]
    fn trials_are_compared_at_an_amplitude_that_all_have() {
        // From 16 deg and from 8 deg: at 8 deg the first lies half way in the logarithm.
        let first = trial("a", vec![at(16.0, 7.0, 1e-3), at(4.0, 7.4, 1e-3)]);
        let second = trial("b", vec![at(8.0, 7.2, 1e-3), at(2.0, 7.5, 1e-3)]);
        let (amplitude, each) = Trials { all: vec![first, second.clone()] }.common().unwrap();
        assert!((amplitude - 8.0).abs() < 1e-12 && (each[0][0].value - 7.2).abs() < 1e-12);
        assert!((each[0][0].u - 1e-3 / 2f64.sqrt()).abs() < 1e-9);
        let text = Trials { all: vec![second.clone(), second.clone()] }.table();
        assert!(text.contains("wn at 8.00 deg") && text.contains("the trials agree"), "{text}");
        assert!(text.contains("wn changes with amplitude"), "{text}");
        let other = trial("c", vec![at(8.0, 7.3, 1e-3), at(2.0, 7.5, 1e-3)]);
        let text = Trials { all: vec![second.clone(), other] }.table();
        assert!(text.contains("the trials differ"), "{text}");
        // One is no table, and those without an amplitude in common have none.
        assert_eq!(Trials { all: vec![second.clone()] }.table(), "");
        let far = trial("d", vec![at(1.0, 7.3, 1e-3), at(0.5, 7.5, 1e-3)]);
        assert!(Trials { all: vec![second, far] }.common().is_none());
    }
}
