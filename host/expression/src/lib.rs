//! A user's own effect: a moment written as an expression in a TOML file.
//!
//! ```toml
//! id = "stribeck_friction"
//! title = "Stribeck friction"
//! moment = "-c * tanh(r / 0.002) * (1 + s * exp(-abs(r) / v))"   # rad/s2
//! [parameters]
//! c = { unit = "rad/s2", start = 0.05, min = 0.0 }
//! s = { unit = "1", start = 0.5, min = 0.0 }
//! v = { unit = "rad/s", start = 0.1, min = 0.0 }
//! ```
//!
//! The moment is divided by Izz and added to b''. It may depend on the yaw angle `b` (rad), the yaw rate `r` (rad/s), the
//! time from the release `t` (s), the natural frequency `wn` (rad/s), the wind speed `wind` (m/s, 0 where it is not
//! known) and its parameters. This module is the one home of its formula: fits and the virtual rig both evaluate the
//! [`Program`] compiled here.

#![forbid(unsafe_code)]

/// A line on stderr. `eprintln!` would panic where nobody reads it any more (`2>&1 | head`).
#[macro_export]
macro_rules! say {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($text)*);
    }};
}

mod checks;
mod document;
pub mod error;
mod expression;
mod file;
mod malformed;
mod number;
mod prepared;
mod program;
mod source;
mod units;

pub use file::from_text;
pub use prepared::Prepared;
pub use program::{Program, State, MOST_PARAMETERS};
pub use source::{nearest, pointed};

use crate::error::{Error, Result};
use std::borrow::Cow;
use std::f64::consts::TAU;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Mutex;

/// One number of an effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    pub name: Cow<'static, str>,
    pub unit: Cow<'static, str>,
    pub min: f64,
    pub max: f64,
}

/// A definition that has passed its checks.
#[derive(Debug)]
pub struct OwnEffect {
    pub id: String,
    pub title: String,
    /// The moment as written, in one line.
    pub formula: String,
    /// In the order of the file.
    pub parameters: Vec<Parameter>,
    /// A typical size of each, not nought.
    pub starts: Vec<f64>,
    /// It depends on time, or puts energy in: a release may never end by itself.
    pub keeps_moving: bool,
    size_parameter: Option<usize>,
    /// What is not wrong but ought to be known.
    pub warnings: Vec<String>,
    pub program: Program,
    /// The whole text of its file.
    pub text: String,
}

impl OwnEffect {
    /// The parameter to which the whole moment is in proportion, so that there is none where it is nought.
    pub fn size_parameter(&self) -> Option<usize> {
        self.size_parameter
    }

    /// Root mean square of the moment over a cycle of `amplitude_rad` at `wn_rad_s`, rad/s2.
    pub fn strength(&self, parameters: &[f64], amplitude_rad: f64, wn_rad_s: f64) -> f64 {
        const POINTS: u32 = 64;
        let square = |k: u32| {
            let (s, c) = (TAU * (f64::from(k) + 0.5) / f64::from(POINTS)).sin_cos();
            let state = State {
                yaw_rad: amplitude_rad * c,
                rate_rad_s: -amplitude_rad * wn_rad_s * s,
                time_s: 0.0,
                natural_frequency_rad_s: wn_rad_s,
                wind_speed_m_s: 0.0,
                rate_sign: -s.signum(),
                yaw_sign: c.signum(),
            };
            self.program.evaluate(&state, parameters).powi(2)
        };
        ((0..POINTS).map(square).sum::<f64>() / f64::from(POINTS)).sqrt()
    }
}

/// Most own effects in one model.
pub const MOST_OWN: usize = 4;

/// An own effect with its numbers; those beyond its parameters are nought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OwnTerm {
    pub effect: &'static OwnEffect,
    pub values: [f64; MOST_PARAMETERS],
}

impl OwnTerm {
    pub fn new(effect: &'static OwnEffect, numbers: &[f64]) -> Self {
        let n = effect.parameters.len();
        let mut values = [0.0; MOST_PARAMETERS];
        values[..n].copy_from_slice(&numbers[..n]);
        Self { effect, values }
    }

    /// For the many evaluations of one simulation.
    pub fn prepared(&self, natural_frequency_rad_s: f64, wind_speed_m_s: f64) -> Prepared {
        let program = &self.effect.program;
        Prepared::new(program, &self.values, natural_frequency_rad_s, wind_speed_m_s)
    }

    /// The moment over Izz, rad/s2.
    #[inline]
    pub fn moment(&self, state: &State<f64>) -> f64 {
        self.effect.program.evaluate(state, &self.values)
    }
}

/// An effect is the one its identifier says.
impl PartialEq for OwnEffect {
    fn eq(&self, other: &Self) -> bool {
        self.id == other.id
    }
}

impl Eq for OwnEffect {}

impl PartialOrd for OwnEffect {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for OwnEffect {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.id.cmp(&other.id)
    }
}

impl std::hash::Hash for OwnEffect {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.id.hash(state);
    }
}

/// Every definition of this run of the program; they live as long as it does.
static KNOWN: Mutex<Vec<&'static OwnEffect>> = Mutex::new(Vec::new());

fn known() -> std::sync::MutexGuard<'static, Vec<&'static OwnEffect>> {
    KNOWN.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// The definition with this identifier, if its file has been read; the last one where it was defined anew.
pub fn find(id: &str) -> Option<&'static OwnEffect> {
    known().iter().copied().rev().find(|effect| effect.id == id)
}

/// Whether an identifier may be given another definition: a program that runs on while its user edits.
static REDEFINABLE: AtomicBool = AtomicBool::new(false);

/// From now on an identifier that is defined once more means its new definition; models that are in memory keep theirs.
pub fn allow_redefinition() {
    REDEFINABLE.store(true, Ordering::Relaxed);
}

/// The definition in `text`, checked but not made known.
///
/// # Errors
/// Those of [`define`], pointing at the character in `text`.
pub fn check(file: &Path, text: &str, taken: &[&str]) -> Result<OwnEffect> {
    file::from_text(file, text, taken)
}

/// Whether an argument names a file and not an identifier.
pub fn is_file(text: &str) -> bool {
    Path::new(text).extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

/// Reads and checks a file, once for the whole run; `taken` are the identifiers of the library. Warnings go to stderr.
///
/// # Errors
/// Exit 3: unreadable, or wrong, pointing at the character; another definition with the same identifier.
pub fn load(file: &Path, taken: &[&str]) -> Result<&'static OwnEffect> {
    intern(file::read(file, taken)?, file)
}

/// As [`load`], from a definition's `text`, which stands in `file`.
///
/// # Errors
/// Those of [`load`].
pub fn define(file: &Path, text: &str, taken: &[&str]) -> Result<&'static OwnEffect> {
    intern(file::from_text(file, text, taken)?, file)
}

fn intern(effect: OwnEffect, file: &Path) -> Result<&'static OwnEffect> {
    let mut known = known();
    let id = &effect.id;
    let may_change = REDEFINABLE.load(Ordering::Relaxed);
    let is_same = |other: &OwnEffect| {
        other.program == effect.program
            && other.parameters == effect.parameters
            && (!may_change || other.text == effect.text)
    };
    let mut others = known.iter().filter(|other| other.id == *id).peekable();
    let is_known = others.peek().is_some();
    if let Some(&same) = others.find(|other| is_same(other)) {
        return Ok(same);
    }
    if is_known && !may_change {
        return Err(Error::data(format!(
            "{}: another effect with the id \"{id}\" has been read already",
            file.display()
        ))
        .help("give each effect its own id"));
    }
    for warning in &effect.warnings {
        crate::say!("yawrig: warning: {warning}");
    }
    let effect: &'static OwnEffect = Box::leak(Box::new(effect));
    known.push(effect);
    Ok(effect)
}

#[cfg(test)]
mod tests;
