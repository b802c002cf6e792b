//! Several records side by side: a line for each, and whether those of one condition agree.

mod conditions;

use super::common::with_words;
use conditions::Conditions;
use std::path::{Path, PathBuf};
use yawrig_base::error::Result;
use yawrig_core::identify::flag::Flag;
use yawrig_core::identify::{AtAmplitude, Estimate, Identification, Method};
use yawrig_core::quantity::Quantity;
use yawrig_core::record::Measurand;
use yawrig_report::plot::{svg_in_columns, Axis, Curve, Plot};
use yawrig_report::units::sized;

/// Records with a curve each in the plot; of more nothing could be told apart.
const DRAWN: usize = 12;
/// Scatter over what the uncertainties explain, above which trials differ: of two by chance once in eighty.
const DIFFER: f64 = 2.5;

/// Natural frequencies further apart than the first, as a ratio, or damping ratios further than the second are not
/// those of one thing, if their uncertainties do not say as much. Generous, for what changes with amplitude or from
/// day to day: it keeps a mean from being taken over several springs. A campaign says what belongs together.
const ONE_THING: [f64; 2] = [1.05, 2.0];

/// What is kept of a record.
#[derive(Clone, Debug)]
struct Trial {
    file: String,
    /// As a campaign says it.
    condition: Option<String>,
    measurand: Measurand,
    /// Of the first method.
    wn: Quantity,
    zeta: Quantity,
    at: Vec<AtAmplitude>,
    /// Method, wn, zeta, residual over noise and what to know of it, of each method.
    rows: Vec<[String; 5]>,
}

/// The records identified so far.
#[derive(Clone, Debug, Default)]
pub struct Trials {
    all: Vec<Trial>,
    conditions: Conditions,
}

/// What kind of motion it was, and what to know of the record, in few words.
fn note(flags: &[Flag]) -> String {
    let has = |flag| flags.contains(&flag);
    let changing =
        [(Flag::AmplitudeDependentFrequency, "wn"), (Flag::AmplitudeDependentDamping, "zeta")];
    let changing: Vec<&str> =
        changing.into_iter().filter(|(flag, _)| has(*flag)).map(|(_, name)| name).collect();
    let change = if changing.len() == 1 { "changes" } else { "change" };
    let mut said = vec![match (changing.is_empty(), has(Flag::ResidualAboveNoise)) {
        (true, false) => "one mode".to_owned(),
        (true, true) => "not one mode".to_owned(),
        _ => format!("{} {change} with amplitude", changing.join(" and ")),
    }];
    let besides = |flag: &Flag| match flag {
        Flag::Grows => Some("grows"),
        Flag::FewCycles => Some("few cycles"),
        Flag::DoesNotDieAway => Some("does not die away"),
        Flag::SeveralReleases => Some("one of several releases"),
        Flag::StartsInMidSwing => Some("starts in mid swing"),
        Flag::DrivenBefore => Some("driven before"),
        Flag::PushedAtStart => Some("pushed at the start"),
        Flag::StoppedEarly => Some("stopped early"),
        Flag::AmplitudeOutsideWindow => Some("other amplitudes than asked for"),
        Flag::EndsAboveWindow => Some("ends early"),
        Flag::OutliersExcluded => Some("outliers"),
        Flag::GapsFilled => Some("gaps"),
        Flag::RateUncertain => Some("rate uncertain"),
        Flag::RepeatedValues => Some("repeated values"),
        Flag::OutsideTrainedRange => Some("outside the trained range"),
        _ => None,
    };
    said.extend(flags.iter().filter_map(besides).map(str::to_owned));
    said.join(", ")
}

/// Those of one condition.
struct Group<'a> {
    /// As a campaign says it.
    condition: Option<&'a str>,
    trials: Vec<&'a Trial>,
}

impl Group<'_> {
    /// The largest amplitude that all have, and what each has there; none where they have none in common.
    fn common(&self) -> Option<(f64, Vec<[Quantity; 2]>)> {
        let same = self.trials.windows(2).all(|pair| pair[0].measurand == pair[1].measurand);
        let largest = |t: &&Trial| t.at.first().map(|a| a.amplitude_deg);
        let largest: Option<Vec<f64>> = self.trials.iter().map(largest).collect();
        let amplitude = largest?.into_iter().fold(f64::INFINITY, f64::min);
        let there = |t: &&Trial| {
            let there = AtAmplitude::between(&t.at, amplitude)?;
            Some([there.natural_frequency_rad_s, there.damping_ratio])
        };
        let each = self.trials.iter().map(there).collect::<Option<_>>();
        each.filter(|_| same).map(|each| (amplitude, each))
    }

    /// The lowest and the highest.
    fn ends(&self, of: fn(&Trial) -> Quantity) -> [Quantity; 2] {
        let mut all: Vec<Quantity> = self.trials.iter().map(|t| of(t)).collect();
        all.sort_by(|a, b| a.value.total_cmp(&b.value));
        [all[0], all[all.len() - 1]]
    }

    /// Whether they may be trials of one thing: a campaign says so, or their values do not rule it out.
    fn is_one_thing(&self) -> bool {
        let near = |[low, high]: [Quantity; 2], ratio: f64| {
            let apart = high.value - low.value;
            apart <= (ratio - 1.0) * low.value.abs().min(high.value.abs())
                || apart <= DIFFER * low.u.hypot(high.u)
        };
        let [wn, zeta] = ONE_THING;
        self.condition.is_some()
            || near(self.ends(|t| t.wn), wn) && near(self.ends(|t| t.zeta), zeta)
    }
}

impl Trials {
    /// Records taken in.
    pub fn count(&self) -> usize {
        self.all.len()
    }

    /// Takes in what was found in a record.
    pub fn add(&mut self, found: &Identification) {
        let Some(first) = found.estimates.first() else { return };
        let row = |estimate: &Estimate| {
            let over_noise = estimate.residual_rms_deg / found.noise_rms_deg;
            let over_noise = match over_noise.is_finite() {
                true => format!("{over_noise:.1}"),
                false => String::new(),
            };
            let [wn, zeta] = [estimate.natural_frequency_rad_s, estimate.damping_ratio];
            [
                method(estimate.method).to_owned(),
                wn.to_string(),
                zeta.to_string(),
                over_noise,
                note(&estimate.flags),
            ]
        };
        self.all.push(Trial {
            condition: self.conditions.of(Path::new(&found.file)),
            file: found.file.clone(),
            measurand: found.said.measurand(),
            wn: first.natural_frequency_rad_s,
            zeta: first.damping_ratio,
            at: first.at_amplitude.clone(),
            rows: found.estimates.iter().map(row).collect(),
        });
    }

    /// By condition, in the order of the first of each; all together where no campaign says any.
    fn groups(&self) -> Vec<Group<'_>> {
        if self.all.iter().all(|t| t.condition.is_none()) {
            return vec![Group { condition: None, trials: self.all.iter().collect() }];
        }
        let mut groups: Vec<Group<'_>> = Vec::new();
        for trial in &self.all {
            let Some(condition) = trial.condition.as_deref() else { continue };
            match groups.iter_mut().find(|group| group.condition == Some(condition)) {
                Some(group) => group.trials.push(trial),
                None => groups.push(Group { condition: Some(condition), trials: vec![trial] }),
            }
        }
        groups
    }

    /// A line for each record, and below whether those of one condition agree; nothing for one record alone.
    pub fn table(&self) -> String {
        let [_, _, ..] = self.all.as_slice() else { return String::new() };
        let folder = self.folder();
        let several = self.all.iter().any(|t| t.rows.len() > 1);
        let mut header = vec!["record", "wn (rad/s)", "zeta", "residual/noise", "note"];
        if several {
            header.insert(1, "method");
        }
        let words = if several { vec![1, 5] } else { vec![4] };
        let mut table = with_words(&header, &words);
        for trial in &self.all {
            let path = Path::new(&trial.file);
            let named = path.strip_prefix(&folder).unwrap_or(path).display().to_string();
            for (k, [method, rest @ ..]) in trial.rows.iter().enumerate() {
                let named = if k == 0 { named.clone() } else { String::new() };
                let method = several.then(|| method.clone());
                table.add_row([named].into_iter().chain(method).chain(rest.iter().cloned()));
            }
        }
        let place = match folder.as_os_str().is_empty() {
            true => String::new(),
            false => format!("{}:\n", folder.display()),
        };
        format!("{place}{}\n{}", table.trim_fmt(), self.agreement())
    }

    /// The folder that all records lie in.
    fn folder(&self) -> PathBuf {
        let mut folders =
            self.all.iter().map(|t| Path::new(&t.file).parent().unwrap_or(Path::new("")));
        let first = folders.next().unwrap_or(Path::new(""));
        match folders.all(|folder| folder == first) {
            true => first.to_owned(),
            false => PathBuf::new(),
        }
    }

    /// Whether the records of each condition agree, at the largest amplitude that all of them have.
    fn agreement(&self) -> String {
        let groups: Vec<Group<'_>> =
            self.groups().into_iter().filter(|group| group.trials.len() > 1).collect();
        if let Some(group) = groups.iter().find(|group| !group.is_one_thing()) {
            let [[slow, fast], [least, most]] = [group.ends(|t| t.wn), group.ends(|t| t.zeta)];
            return format!(
                    "\nThese are not trials of one thing (wn {:.4} to {:.4} rad/s, zeta {:.4} to {:.4}): no mean over them.\n\
                     Which of them belong together is said by a campaign.toml beside them: `yawrig campaign init`.\n",
                    slow.value, fast.value, least.value, most.value,
                );
        }
        let header =
            ["trials of", "at", "wn ± scatter", "scatter/u", "zeta ± scatter", "scatter/u", ""];
        let mut table = with_words(&header, &[6]);
        for group in &groups {
            let Some((amplitude, each)) = group.common() else { continue };
            let measurand = &group.trials[0].measurand;
            let name = group.condition.unwrap_or("one thing");
            let of = |k: usize| Scatter::new(&each.iter().map(|q| q[k]).collect::<Vec<_>>());
            let [wn, zeta] = [of(0), of(1)];
            let differ = match (wn.is_more_than_chance(), zeta.is_more_than_chance()) {
                (false, false) => "the trials agree",
                (true, false) => "the trials differ in wn",
                (false, true) => "the trials differ in zeta",
                (true, true) => "the trials differ in wn and zeta",
            };
            table.add_row([
                format!("{name} ({})", each.len()),
                format!("{} {}", sized(measurand, amplitude, 2), measurand.coordinate_unit()),
                wn.mean.to_string(),
                format!("{:.1}", wn.over_expected),
                zeta.mean.to_string(),
                format!("{:.1}", zeta.over_expected),
                differ.to_owned(),
            ]);
        }
        match table.is_empty() {
            true => String::new(),
            false => format!("\n{}\n", table.trim_fmt()),
        }
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

/// Mean of several with their standard deviation for its u, and how large that is against what their
/// uncertainties explain.
struct Scatter {
    mean: Quantity,
    over_expected: f64,
}

impl Scatter {
    fn new(all: &[Quantity]) -> Self {
        let n = all.len() as f64;
        let mean = all.iter().map(|q| q.value).sum::<f64>() / n;
        let square = all.iter().map(|q| (q.value - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let expected = (all.iter().map(|q| q.u * q.u).sum::<f64>() / n).sqrt();
        Self { mean: Quantity::new(mean, square.sqrt()), over_expected: square.sqrt() / expected }
    }

    fn is_more_than_chance(&self) -> bool {
        self.over_expected > DIFFER
    }
}

/// A method's name in a table.
pub(super) fn method(method: Method) -> &'static str {
    match method {
        Method::LeastSquares => "least-squares",
        Method::Conventional => "conventional",
        Method::Network => "network",
    }
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

    fn trial(file: &str, condition: Option<&str>, at: Vec<AtAmplitude>) -> Trial {
        let [wn, zeta] = [at[0].natural_frequency_rad_s, at[0].damping_ratio];
        let flags = [Flag::AmplitudeDependentFrequency, Flag::ResidualAboveNoise, Flag::Resampled];
        let [by, wn_said, zeta_said] =
            [method(Method::LeastSquares).to_owned(), wn.to_string(), zeta.to_string()];
        Trial {
            file: file.to_owned(),
            condition: condition.map(str::to_owned),
            measurand: Measurand::default(),
            wn,
            zeta,
            at,
            rows: vec![[by, wn_said, zeta_said, "7.0".to_owned(), note(&flags)]],
        }
    }

    fn table(all: &[&Trial]) -> String {
        let all = all.iter().map(|t| (*t).clone()).collect();
        Trials { all, conditions: Conditions::default() }.table()
    }

    #[test]
    fn trials_are_compared_at_an_amplitude_that_all_have() {
        // From 16 deg and from 8 deg: at 8 deg the first lies half way in the logarithm.
        let first = trial("f/a", None, vec![at(16.0, 7.0, 1e-3), at(4.0, 7.4, 1e-3)]);
        let second = trial("f/b", None, vec![at(8.0, 7.2, 1e-3), at(2.0, 7.5, 1e-3)]);
        let group = Group { condition: None, trials: vec![&first, &second] };
        let (amplitude, each) = group.common().unwrap();
        assert!((amplitude - 8.0).abs() < 1e-12 && (each[0][0].value - 7.2).abs() < 1e-12);
        assert!((each[0][0].u - 1e-3 / 2f64.sqrt()).abs() < 1e-9);
        let text = table(&[&second, &second]);
        assert!(text.contains("8.00 deg") && text.contains("the trials agree"), "{text}");
        assert!(text.starts_with("f:\n") && text.contains("wn changes with amplitude"), "{text}");
        let other = trial("f/c", None, vec![at(8.0, 7.3, 1e-3), at(2.0, 7.5, 1e-3)]);
        let text = table(&[&second, &other]);
        assert!(text.contains("the trials differ in wn"), "{text}");
        // One is no table, and those without an amplitude in common have nothing to compare.
        assert_eq!(table(&[&second]), "");
        let far = trial("d", None, vec![at(1.0, 7.3, 1e-3), at(0.5, 7.5, 1e-3)]);
        let text = table(&[&second, &far]);
        assert!(!text.contains("the trials") && text.contains("f/b"), "{text}");
    }

    #[test]
    fn what_plainly_differs_has_no_mean() {
        let wn =
            |file: &str, wn: f64| trial(file, None, vec![at(8.0, wn, 1e-3), at(2.0, wn, 1e-3)]);
        let text = table(&[&wn("a", 7.0), &wn("b", 14.0)]);
        assert!(text.contains("wn 7.0000 to 14.0000 rad/s") && !text.contains("scatter"), "{text}");
        // Damping ratios of which little is known, and of what grows, are apart by as much as that says.
        let zeta = |file: &str, value: f64, u: f64| {
            let mut trial = wn(file, 7.0);
            trial.zeta = Quantity::new(value, u);
            trial
        };
        let both = |a: f64, b: f64, u: f64| table(&[&zeta("a", a, u), &zeta("b", b, u)]);
        assert!(!both(1e-4, 3e-4, 1e-4).contains("not trials"));
        assert!(both(1e-4, 3e-4, 1e-5).contains("not trials"));
        assert!(!both(-2e-3, -1.2e-3, 1e-5).contains("not trials"));
        assert!(both(-2e-3, 2e-3, 1e-5).contains("not trials"));
    }

    #[test]
    fn only_those_of_one_condition_are_compared() {
        let of = |file: &str, condition: Option<&str>, wn: f64| {
            trial(file, condition, vec![at(8.0, wn, 1e-3), at(2.0, wn, 1e-3)])
        };
        let all = [
            of("a", Some("K1, mid, wind off"), 7.0),
            of("b", Some("K2, mid, wind off"), 14.0),
            of("c", Some("K1, mid, wind off"), 7.001),
            of("d", None, 9.0),
        ];
        let text = table(&all.iter().collect::<Vec<_>>());
        let rows: Vec<&str> = text.lines().filter(|line| line.contains("the trials")).collect();
        assert!(text.contains("trials of") && text.contains("K1, mid, wind off (2)"), "{text}");
        assert!(rows.len() == 1 && rows[0].contains("7.00050 ± 0.00071"), "{text}");
        // Released once each, there is nothing to compare.
        let text = table(&[&all[0], &all[1]]);
        assert!(!text.contains("trials"), "{text}");
    }
}
