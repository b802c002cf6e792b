//! `law`: the law that a record shows beside the second-order response, measured, and its names.

use super::common::{bare, print_json, print_line, SCHEMA_VERSION};
use super::model::amplitude_rows;
use super::releases::ReleaseArg;
use super::roll::{self, RollArgs};
use crate::answer::Answer;
use crate::commands::{self, new_model, Addition, Making, Words};
use crate::flags::{self, Flags};
use clap::Args;
use serde_json::json;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use yawrig_base::error::Result;
use yawrig_base::settings::Spelling;
use yawrig_core::effects::{SourceKind, MEASURED_LAW};
use yawrig_core::law::names::Name;
use yawrig_core::law::tables::Point;
use yawrig_core::record::Record;
use yawrig_core::roll::RollDecay;
use yawrig_model::document::{is_model, Model};
use yawrig_model::law::{self, File, LawAnswer};
use yawrig_model::model_fit::Data;
use yawrig_model::revise::quoted;
use yawrig_records::Selection;
use yawrig_report::units::sized;

/// Measure the law that a record shows: restoring moment over yaw angle, dissipation over yaw rate
///
/// Both are curves with their uncertainties, of what is missing beside the second-order response:
/// b'' = -(2 zeta wn r + wn^2 b + K(b) + D(r)). They are known up to the largest angle and rate of the
/// release, counted from where the model comes to rest. How much of the damping in proportion to the rate is
/// zeta's and how much stands in D no record can say: zeta takes what is left beside the simplest formula
/// that the curve is near to, and its uncertainty is without that of the formula. Formulas that the law may
/// be are fitted to the record, ranked by what they predict of parts that were left out; with --out they are
/// written as files that `yawrig add` takes. Several records share the law; each has a natural frequency,
/// damping ratio and rest angle of its own, releases of one condition of a model the first two in common.
#[derive(Args, Debug, Clone)]
pub struct Law {
    /// Records, or a model (its records, beside its effects)
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,
    /// The damping may put energy in
    #[arg(long)]
    pub may_drive: bool,
    #[command(flatten)]
    pub release: ReleaseArg,
    #[command(flatten)]
    pub roll: RollArgs,
    /// Where the named formulas are written, as files that `yawrig add` takes
    #[arg(short, long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Print one JSON object
    #[arg(short, long)]
    pub json: bool,
}

impl Law {
    pub fn run(&self) -> Result<()> {
        let given = self.release.of(&self.files)?;
        let reading = self.release.selection()?;
        let found = self.found(law::read(&given, &reading)?)?;
        let roll = self.roll_decay(&found)?;
        let files = written(&found, self.out.as_deref())?;
        let commands = self.commands(&found, &given, &files)?;
        if self.json {
            return print_json(&with_commands(object(&found, &files), roll, &commands));
        }
        let mut text = text(&found, &files, &command(&given, &reading, self.may_drive));
        if let Some(decay) = roll {
            text += &format!("\n{}", roll::text(&decay, &found.measurand));
        }
        if !commands.is_empty() {
            text = format!("{}\n\n{}", text.trim_end(), commands::lines(&commands));
        }
        print_line(text.trim_end())
    }

    /// Which make the model with the best formula, or where none could be fitted, with the law as measured.
    fn commands(
        &self,
        found: &LawAnswer,
        given: &[PathBuf],
        files: &[PathBuf],
    ) -> Result<Vec<Words>> {
        if found.measured.law.is_none() {
            return Ok(Vec::new());
        }
        let reading = self.release.selection()?;
        let is_there = matches!(given, [file] if is_model(file));
        let making = Making {
            files: if is_there { &[] } else { given },
            reading: &reading,
            unknown_zero: false,
            model: if is_there { given[0].clone() } else { new_model() },
            own: &[],
        };
        let folder = PathBuf::from(FOLDER);
        let best = files.first().cloned();
        let unwritten = || found.files(&folder).into_iter().next().map(|file| file.path);
        let added = best.clone().or_else(unwritten).filter(|_| found.has_name());
        let added = added.map_or(MEASURED_LAW.to_owned(), |file| file.display().to_string());
        let mut all = making.commands(&[Addition {
            effect: &added,
            source: SourceKind::Mechanical,
            keep: false,
        }]);
        // The formulas' files, where they are not written yet.
        if best.is_none() && added != MEASURED_LAW && !all.is_empty() {
            let mut law = vec!["yawrig".to_owned(), "law".to_owned()];
            law.extend(given.iter().map(|file| file.display().to_string()));
            law.extend(making.reading_words());
            law.extend(self.may_drive.then(|| Flags.name("may_drive")));
            law.extend([Flags.name("out"), FOLDER.to_owned()]);
            all.insert(0, law);
        }
        Ok(all)
    }

    fn found(&self, (model, data): (Model, Data)) -> Result<LawAnswer> {
        self.roll.all_roll(data.fitted.iter().map(|r| &r.decay.measurand))?;
        law::beside(&model, &data, !self.may_drive, &|_, _| {})
    }

    /// The equivalent linear damping of naval architecture, where the motion is called roll.
    fn roll_decay(&self, found: &LawAnswer) -> Result<Option<RollDecay>> {
        let wn = found.measured.natural_frequency_rad_s();
        self.roll.of(&found.measurand, |ship| RollDecay::of_law(wn, &found.at_amplitude, ship))
    }
}

fn with_commands(
    mut object: serde_json::Value,
    roll: Option<RollDecay>,
    commands: &[Words],
) -> serde_json::Value {
    object["commands"] = json!(commands);
    if let Some(roll) = roll {
        object["roll"] = json!(roll);
    }
    object
}

impl Law {
    /// The answer about `records` in memory, or, where there are none, about the files. Nothing is written.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn answer(&self, records: Vec<Record>) -> Result<Answer> {
        let found = self.found(match records.is_empty() {
            true => law::read(&self.release.of(&self.files)?, &self.release.selection()?)?,
            false => law::of_records(records)?,
        })?;
        let sentence = match found.names.ranked.first() {
            Some(best) => format!(
                "best formula, held out {:.3} times the noise: {}",
                best.held_out_over_noise,
                best.effect.card().formula
            ),
            None => "no law beside the second-order response that has a name".to_owned(),
        };
        let roll = self.roll_decay(&found)?;
        Answer::new(&with_commands(object(&found, &[]), roll, &[]), sentence)
    }
}

/// The files of the best formulas, in their order, written to `folder`; none where none was asked for.
///
/// # Errors
/// Exit 3 where they cannot be written.
pub(super) fn written(found: &LawAnswer, folder: Option<&Path>) -> Result<Vec<PathBuf>> {
    let write = |file: File| file.write().map(|()| file.path);
    folder.map_or(Ok(Vec::new()), |folder| found.files(folder).into_iter().map(write).collect())
}

/// The command that measures the law of `files`.
pub(super) fn command(files: &[PathBuf], reading: &Selection, may_drive: bool) -> String {
    let files: Vec<String> = files.iter().map(|f| quoted(&f.display().to_string())).collect();
    let driven = if may_drive { " --may-drive" } else { "" };
    format!("yawrig law {}{}{driven}", files.join(" "), flags::of(&reading.settings()))
}

/// What takes the best formula into a model: of its file, or, where none is written, with the command that
/// writes it.
fn adding(found: &LawAnswer, files: &[PathBuf], measure: &str) -> Option<String> {
    let add = |file: &Path| format!("yawrig add {}", quoted(&file.display().to_string()));
    match (files.first(), found.files(Path::new(FOLDER)).first()) {
        (Some(file), _) => Some(add(file)),
        (None, Some(file)) => Some(format!("{measure} --out {FOLDER}, then {}", add(&file.path))),
        (None, None) => None,
    }
}

/// `files`: of the best formulas, in their order, where they were written.
pub(super) fn object(found: &LawAnswer, files: &[PathBuf]) -> serde_json::Value {
    let LawAnswer { file, measured, names, measurand, .. } = found;
    let shown = |x: f64| measurand.shown(x);
    let points = |points: Vec<Point>, at: &str| -> Vec<serde_json::Value> {
        let point = |p: Point| {
            json!({
                at: shown(p.at), "moment_rad_s2": p.moment_rad_s2.value, "u": p.moment_rad_s2.u,
            })
        };
        points.into_iter().map(point).collect()
    };
    let name = |name: &Name, file: Option<&PathBuf>| {
        let parameters: serde_json::Map<String, serde_json::Value> =
            name.parameters.iter().map(|(n, q)| (n.clone(), json!(q))).collect();
        json!({
            "form": name.effect.id(), "formula": name.effect.card().formula, "file": file,
            "parameters": parameters,
            "residual_over_noise": name.residual_over_noise,
            "held_out_over_noise": name.held_out_over_noise,
        })
    };
    let wn = measured.natural_frequency_rad_s();
    let zeta = measured.damping_ratio();
    let mut object = json!({
        "schema_version": SCHEMA_VERSION,
        "record": file,
        "records": found.records,
        "stiffness": points(measured.tables().stiffness(), "yaw_deg"),
        "damping": points(measured.tables().damping(), "rate_deg_s"),
        "known": {
            "yaw_deg": shown(measured.law.yaw_rad),
            "rate_deg_s": shown(measured.law.rate_rad_s),
        },
        "modal": { "natural_frequency_rad_s": wn, "damping_ratio": zeta },
        "at_amplitude": found.at_amplitude,
        "rest_deg": shown(measured.rest_rad()),
        "residual_over_noise": measured.residual_over_noise,
        "held_out_over_noise": measured.held_out_over_noise,
        "without": {
            "residual_over_noise": measured.plain_residual_over_noise,
            "held_out_over_noise": measured.plain_held_out_over_noise,
        },
        "memory": names.memory.is_some(),
        "beside": names.beside.as_ref().map(|b| json!({
            "kind": b.kind.name(),
            "effect": b.effect.id(),
            "held_out_over_noise": b.held_out_over_noise,
            "frequency_rad_s": b.frequency_rad_s,
        })),
        "hysteresis": names.memory.as_ref().map(|memory| name(memory, None)),
        "names": names.ranked.iter().enumerate().map(|(k, n)| name(n, files.get(k))).collect::<Vec<_>>(),
        "indistinguishable": names.indistinguishable,
    });
    if let (Some(object), Ok(serde_json::Value::Object(said))) =
        (object.as_object_mut(), serde_json::to_value(measurand.said()))
    {
        object.extend(said);
    }
    object
}

fn text(found: &LawAnswer, files: &[PathBuf], measure: &str) -> String {
    let LawAnswer { file, measured, names, measurand, .. } = found;
    let (coordinate, rate) = (measurand.coordinate(), measurand.rate());
    let mut out = format!(
        "{}: a law of {coordinate} and {rate}, beside wn {} rad/s and zeta {} at rest ({} {})\n",
        match found.records {
            1 => file.display().to_string(),
            n => format!("{n} records, the largest {}", file.display()),
        },
        measured.natural_frequency_rad_s(),
        measured.damping_ratio(),
        sized(measurand, measurand.shown(measured.rest_rad()), 3),
        measurand.unit(),
    );
    let _ = writeln!(
        out,
        "  residual over noise {:.3} -> {:.3}, held out {:.3} -> {:.3}",
        measured.plain_residual_over_noise,
        measured.residual_over_noise,
        measured.plain_held_out_over_noise,
        measured.held_out_over_noise,
    );
    let _ = writeln!(
        out,
        "  known up to {} {} and {} {}; beyond, it goes on at its end slope\n",
        sized(measurand, measurand.shown(measured.law.yaw_rad), 2),
        measurand.coordinate_unit(),
        sized(measurand, measurand.shown(measured.law.rate_rad_s), 1),
        measurand.rate_unit(),
    );
    out.push_str(&amplitude_rows(measurand, &found.at_amplitude));
    out.push('\n');
    let (of, per_s) = (measurand.coordinate_unit(), measurand.rate_unit());
    let moment = measurand.parameter_unit("rad/s2");
    for (title, at, points) in [
        (
            format!("restoring moment K ({moment})"),
            format!("{} ({of})", measurand.word()),
            measured.tables().stiffness(),
        ),
        (
            format!("dissipation D ({moment})"),
            format!("rate ({per_s})"),
            measured.tables().damping(),
        ),
    ] {
        if points.iter().all(|p| p.moment_rad_s2.value == 0.0) {
            let _ = writeln!(out, "{title}: none beside the linear one\n");
            continue;
        }
        let mut table = bare(&[&at, &title]);
        for p in points.iter().step_by(SHOWN) {
            let at = sized(measurand, measurand.shown(p.at), 2);
            table.add_row([at, p.moment_rad_s2.to_string()]);
        }
        let _ = writeln!(out, "{}\n", table.trim_fmt());
    }
    if let (Some(said), Some(memory)) = (found.memory(), &names.memory) {
        let _ = writeln!(out, "{said}: yawrig add {}\n", memory.effect);
    }
    if let Some(said) = found.beside() {
        let _ = writeln!(out, "{said}\n");
    }
    out.push_str(&named(found, files, measure));
    out
}

fn named(found: &LawAnswer, files: &[PathBuf], measure: &str) -> String {
    let LawAnswer { measured, names, .. } = found;
    let Some(best) = names.ranked.first() else {
        return match measured.law.is_none() {
            true => "no law to be named: the second-order response is all that is seen\n",
            false => "no formula could be fitted to this law\nto take it as it was measured: yawrig add measured_law\n",
        }
        .to_owned();
    };
    let mut out = String::new();
    let mut table = bare(&["formula", "held out over noise", "residual over noise", "numbers"]);
    for name in names.ranked.iter().take(NAMED) {
        let numbers = name.parameters.iter().map(|(n, q)| match q.u.is_nan() {
            true => format!("{n} {:.4}, no error bar", q.value),
            false => format!("{n} {q}"),
        });
        table.add_row([
            name.effect.id().to_owned(),
            format!("{:.3}", name.held_out_over_noise),
            format!("{:.3}", name.residual_over_noise),
            numbers.collect::<Vec<_>>().join(", "),
        ]);
    }
    let _ = writeln!(out, "{}", table.trim_fmt());
    if let Some(alike) = found.alike() {
        let _ = writeln!(out, "{alike}");
    }
    if let Some(adding) = adding(found, files, measure) {
        let (formula, held_out) = (best.effect.card().formula, best.held_out_over_noise);
        let measured = measured.held_out_over_noise;
        let _ = writeln!(out, "best formula, held out {held_out:.3}: {formula}");
        let _ = writeln!(out, "to take it into the model: {adding}");
        if !found.has_name() {
            let _ = writeln!(out, "{WORSE} (held out {measured:.3})");
        }
        let _ = writeln!(out, "to take the law as it was measured: yawrig add measured_law");
    }
    out
}

/// The name of a law in a few lines, with the commands that take it.
pub(super) fn in_short(found: &LawAnswer, files: &[PathBuf], measure: &str) -> Option<String> {
    let LawAnswer { measured, names, .. } = found;
    if measured.law.is_none() {
        return None;
    }
    let mut out = format!(
        "as a law of {} and {}: residual over noise {:.3} -> {:.3}, held out {:.3}",
        found.measurand.coordinate(),
        found.measurand.rate(),
        measured.plain_residual_over_noise,
        measured.residual_over_noise,
        measured.held_out_over_noise
    );
    if let (Some(said), Some(memory)) = (found.memory(), &names.memory) {
        let _ = write!(out, "\n  {said}: yawrig add {}", memory.effect);
    }
    if let Some(said) = found.beside() {
        let _ = write!(out, "\n  {said}");
    }
    if let (Some(best), Some(adding)) = (names.ranked.first(), adding(found, files, measure)) {
        let (formula, held_out) = (best.effect.card().formula, best.held_out_over_noise);
        let _ = write!(out, "\n  best formula, held out {held_out:.3}: {formula}\n    {adding}");
        if !found.has_name() {
            let _ = write!(out, "\n  {WORSE}");
        }
    }
    if let Some(alike) = found.alike() {
        let _ = write!(out, "\n  {alike}");
    }
    let _ = write!(out, "\n  as it was measured: yawrig add measured_law");
    Some(out)
}

/// Said where the law as it was measured is to be taken.
const WORSE: &str = "no formula predicts as well as the law as it was measured";
/// The folder that a printed command names.
const FOLDER: &str = "found";
/// Every so many points of a table are printed, and so many names.
const SHOWN: usize = 4;
const NAMED: usize = 6;
