//! The program: a file of `assets/export` with the model's equations and numbers put in.

use super::release::{code_name, Number, Release};
use std::fmt::Write as _;
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_core::effects::{Effect, Equation};
use yawrig_core::fit::fitting::Covariance;
use yawrig_expression::{translate, Language};

/// For whom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    Python,
    Matlab,
    C,
}

/// What of the text differs from language to language.
struct Dialect {
    target: Target,
    language: Language,
    template: &'static str,
    /// What stands before and after the name of a number.
    number: [&'static str; 2],
    /// What stands before each further term of a sum.
    term: &'static str,
    nan: &'static str,
    truth: [&'static str; 2],
}

impl Dialect {
    fn new(target: Target) -> Self {
        match target {
            Target::Python => Self {
                target,
                language: Language::Python,
                template: include_str!("../../assets/export/model.py"),
                number: ["p[\"", "\"]"],
                term: "\n        + ",
                nan: "nan",
                truth: ["False", "True"],
            },
            Target::Matlab => Self {
                target,
                language: Language::Matlab,
                template: include_str!("../../assets/export/model.m"),
                number: ["p.", ""],
                term: " ...\n    + ",
                nan: "NaN",
                truth: ["false", "true"],
            },
            Target::C => Self {
                target,
                language: Language::C,
                template: include_str!("../../assets/export/model.h"),
                number: ["p->", ""],
                term: "\n        + ",
                nan: "NAN",
                truth: ["0", "1"],
            },
        }
    }

    fn named(&self, number: &str) -> String {
        format!("{}{number}{}", self.number[0], self.number[1])
    }

    fn value(&self, value: f64) -> String {
        if value.is_finite() {
            format!("{value:?}")
        } else {
            self.nan.to_owned()
        }
    }

    fn text(&self, text: &str) -> String {
        match self.target {
            Target::Matlab => format!("'{}'", text.replace('\'', "''")),
            _ => format!("{text:?}"),
        }
    }

    /// One of the numbers as the head of the file lists it.
    fn described(&self, number: &Number) -> String {
        let Number { name, unit, .. } = number;
        match self.target {
            Target::Python => format!("    {name} ({unit})"),
            Target::Matlab => format!("%     {name} ({unit})"),
            Target::C => format!("    double {name}; /* {unit} */"),
        }
    }

    /// All values, or all uncertainties, of a release.
    fn numbers(&self, numbers: &[Number], of: fn(&Number) -> f64) -> String {
        let each = numbers.iter().map(|n| (&n.name, self.value(of(n))));
        match self.target {
            Target::Python => {
                let all: Vec<String> = each.map(|(name, v)| format!("\"{name}\": {v}")).collect();
                format!("{{{}}}", all.join(", "))
            }
            Target::Matlab => {
                let all: Vec<String> = each.map(|(name, v)| format!("'{name}', {v}")).collect();
                format!("struct({})", all.join(", "))
            }
            Target::C => {
                let all: Vec<String> = each.map(|(name, v)| format!(".{name} = {v}")).collect();
                format!("{{{}}}", all.join(", "))
            }
        }
    }

    /// Names and matrix, empty where the model's file was not written by a fit.
    fn covariance(&self, covariance: Option<&Covariance>) -> String {
        let names = covariance.map_or(&[][..], |c| &c.names);
        let name = |name: &String| match name.as_str() {
            "natural_frequency_rad_s" => self.text("wn"),
            "damping_ratio" => self.text("zeta"),
            name => self.text(&name.replace('.', "_")),
        };
        let names = names.iter().map(name).collect::<Vec<_>>().join(", ");
        let row =
            |row: &Vec<f64>| row.iter().map(|c| self.value(*c)).collect::<Vec<_>>().join(", ");
        let rows: Vec<String> = covariance.iter().flat_map(|c| &c.matrix).map(row).collect();
        match self.target {
            Target::Python => {
                let rows: String = rows.iter().map(|row| format!("    [{row}],\n")).collect();
                format!("COVARIANCE_OF = [{names}]\nCOVARIANCE = [\n{rows}]")
            }
            Target::Matlab => {
                let rows = rows.join("; ...\n    ");
                format!("m.covariance_of = {{{names}}};\nm.covariance = [{rows}];")
            }
            Target::C if rows.is_empty() => String::new(),
            Target::C => format!(
                "#define @NAME@_COVARIANCE_OF {{{names}}}\n#define @NAME@_COVARIANCE {{ \\\n    {{{}}}}}",
                rows.join("}, \\\n    {")
            ),
        }
    }

    fn release(&self, index: usize, release: &Release, memory: Option<&Memory>) -> String {
        let (entry, decay) = (&release.recorded.entry, &release.recorded.decay);
        let (grid, state) = (&decay.grid, &release.fit.parameters);
        let end_s = grid.time_s(grid.count - 1);
        let mut fields = vec![
            ("file", self.text(&entry.file)),
            ("condition", self.text(&entry.condition)),
            ("release_time_s", self.value(decay.release_time_s)),
            ("start_s", self.value(grid.start_s)),
            ("end_s", self.value(end_s)),
            ("step_s", self.value(grid.step_s / decay.block as f64)),
            ("yaw_rad", self.value(state[2])),
            ("rate_rad_s", self.value(state[3])),
            ("p", self.numbers(&release.numbers, |n| n.value)),
            ("u", self.numbers(&release.numbers, |n| n.u)),
        ];
        let motion = release.fit.motion();
        // Behind angle and rate: there is one at most.
        if let Some(memory) = memory {
            // Of what is not there in this wind nothing is remembered.
            let z = motion.state(grid.start_s).get(2).copied().unwrap_or(0.0);
            fields.insert(fields.len() - 2, (memory.field, self.value(z)));
        }
        let mut out = String::new();
        for (name, value) in fields {
            let _ = match self.target {
                Target::Python => writeln!(out, "        \"{name}\": {value},"),
                Target::Matlab => writeln!(out, "list({}).{name} = {value};", index + 1),
                Target::C => writeln!(out, "        .{name} = {value},"),
            };
        }
        match self.target {
            Target::Matlab => out,
            _ => format!("    {{\n{out}    }},\n"),
        }
    }
}

/// The whole file.
///
/// # Errors
/// Exit 2 where `file` has no name that the language can call it by.
pub fn written(
    target: Target,
    model: &Path,
    file: &Path,
    effects: &[Effect],
    releases: &[Release],
    covariance: Option<&Covariance>,
) -> Result<String> {
    let dialect = Dialect::new(target);
    let name = identifier(target, file)?;
    let Equations { spring, moments, readings, sticks, memory } = equations(&dialect, effects)?;
    let numbers: Vec<String> =
        releases[0].numbers.iter().map(|number| dialect.described(number)).collect();
    let memory = memory.as_ref();
    let all = releases.iter().enumerate().map(|(k, r)| dialect.release(k, r, memory));
    let all: String = all.collect();
    let with: String = effects.iter().map(|e| format!(" + {e}")).collect();
    // What would end the comment it stands in.
    let title = format!("{}: second order{with}", model.display()).replace(['"', '\\', '*'], "_");
    let file = file.file_name().unwrap_or_default().to_string_lossy();
    let mut out = marked(dialect.template, ["@Z(", ")Z@"], memory.is_some());
    out = marked(&out, ["@O(", ")O@"], memory.is_some_and(|m| m.field == OWN));
    for (place, text) in [
        ("@SPRING@", spring.as_str()),
        ("@MOMENTS@", &moments),
        ("@READINGS@", &readings),
        ("@MEMORY@", memory.map_or("", |m| &m.rate)),
        ("@REMEMBERED@", memory.map_or("", |m| &m.is)),
        ("@Z@", memory.map_or("", |m| m.field)),
        ("@STICKS@", dialect.truth[usize::from(sticks)]),
        ("@NUMBERS@", &numbers.join("\n")),
        ("@COVARIANCE@", &dialect.covariance(covariance)),
        ("@TITLE@", &title),
        ("@FILE@", &file),
        ("@NAME@", &name),
        // Last: whatever stands in the model stays as it is.
        ("@RELEASES@", all.trim_end()),
    ] {
        out = out.replace(place, text);
    }
    Ok(out)
}

/// A template with what stands between two marks, or without.
fn marked(template: &str, [begin, end]: [&str; 2], with: bool) -> String {
    let mut parts = template.split(begin);
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (inner, after) = part.split_once(end).unwrap_or((part, ""));
        out += if with { inner } else { "" };
        out += after;
    }
    out
}

/// The model's terms in the language.
struct Equations {
    spring: String,
    moments: String,
    readings: String,
    /// Dry friction can hold the model, or hysteresis turns.
    sticks: bool,
    memory: Option<Memory>,
}

/// A third state z.
struct Memory {
    /// In words, with its unit.
    is: String,
    /// Its rate.
    rate: String,
    /// What its value at the beginning is called.
    field: &'static str,
}

/// The names of that of hysteresis, and of an own effect's state.
const HYSTERESIS: &str = "z_rad";
const OWN: &str = "z";

/// # Errors
/// Exit 2 for states that a program has no place for.
fn check_states(effects: &[Effect], sticks: bool) -> Result<()> {
    let mut states = 0;
    for effect in effects {
        if let Some(Equation::Remembered { states: own, .. }) = effect.equation() {
            states += own.len();
            if effect.is_own() && sticks {
                let what = format!(
                    "the state of {effect} goes on while friction holds the model, which the programs do not follow"
                );
                return Err(Error::usage(what).help("write the table (csv) instead"));
            }
        }
    }
    if states > 1 {
        let what = format!(
            "the programs follow one state besides angle and rate, and this model has {states}"
        );
        return Err(Error::usage(what).help("write the table (csv) instead"));
    }
    Ok(())
}

fn equations(dialect: &Dialect, effects: &[Effect]) -> Result<Equations> {
    let mut sticks = false;
    let mut write = |effect: Option<&Effect>, text: &str| {
        let mut named = |name: &str| match (name, effect) {
            ("b" | "r" | "t" | "spring", _) => name.to_owned(),
            (name, Some(effect)) if effect.is_state(name) => "z".to_owned(),
            ("sign(r)", _) => {
                sticks = true;
                "direction".to_owned()
            }
            (name, Some(effect)) if !matches!(name, "wn" | "wind") => {
                dialect.named(&code_name(effect, name))
            }
            (name, _) => dialect.named(name),
        };
        translate(text, dialect.language, &mut named)
            .map_err(|why| Error::internal(format!("\"{text}\" is no expression: {why}")))
    };
    let mut spring = write(None, "-wn * wn * b")?;
    let (mut moments, mut readings, mut memory) = (String::new(), String::new(), None);
    for effect in effects {
        match effect.equation() {
            Some(Equation::Moment(text)) => {
                for term in text.lines() {
                    moments += dialect.term;
                    moments += &write(Some(effect), term)?;
                }
            }
            Some(Equation::Remembered { moment, states }) => {
                moments += dialect.term;
                moments += &write(Some(effect), &moment)?;
                for [name, rate] in states {
                    let rate = write(Some(effect), &rate)?;
                    memory = Some(match effect.state_units().as_slice() {
                        [] => Memory {
                            is: format!("what {effect} remembers (rad)"),
                            rate,
                            field: HYSTERESIS,
                        },
                        units => Memory {
                            is: format!("{name} of {effect} ({})", units[0]),
                            rate,
                            field: OWN,
                        },
                    });
                }
            }
            Some(Equation::Reading(text)) => {
                readings += dialect.term;
                readings += &write(Some(effect), text)?;
            }
            Some(Equation::DeadZone(g)) => {
                let text = format!("-wn * wn * (b - max(-{g}, min({g}, b)))");
                spring = write(Some(effect), &text)?;
            }
            None => {}
        }
    }
    check_states(effects, sticks)?;
    Ok(Equations { spring, moments, readings, sticks, memory })
}

/// The name of `file` as the language calls it.
fn identifier(target: Target, file: &Path) -> Result<String> {
    let ending = match target {
        Target::Python => "py",
        Target::Matlab => "m",
        Target::C => "h",
    };
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let fits: String =
        stem.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    let fits = match fits.starts_with(|c: char| c.is_ascii_alphabetic()) {
        true => fits,
        false => format!("model_{}", fits.trim_start_matches('_')),
    };
    if fits == stem && file.extension().is_some_and(|e| e == ending) {
        return Ok(fits);
    }
    let better = file.with_file_name(format!("{fits}.{ending}"));
    Err(Error::usage(format!(
        "{}: the file's name is what programs call it by",
        settings::given("out", &file.display().to_string())
    ))
    .help(format!(
        "give letters, digits and _ and the ending .{ending}: {}",
        settings::given("out", &better.display().to_string())
    )))
}
