//! The states in the file of a user's own effect, and what is refused in them.

use super::document::{DeclaredState, Text};
use super::expression::{self, Flaw, Span};
use super::naming::{named as checked_name, one_line};
use super::program::{Program, State};
use super::source::Place;
use super::states::{begun, OwnState, MAX_STATES};
use super::units::{self, Unit, Wanted};
use crate::error::Result;
use toml::Spanned;

/// What the expressions of an effect may hold besides the inputs: its parameters, then its states.
pub struct Numbers<'a> {
    pub names: &'a [String],
    /// Of all that the file declares.
    pub units: &'a [(String, Unit)],
    /// How many of the names are parameters.
    pub parameters: usize,
}

/// A state, and the names in its expressions.
pub struct Compiled {
    pub state: OwnState,
    pub uses: Vec<String>,
}

/// Name and unit of a state; `taken` are those before it.
///
/// # Errors
/// A name that is none, is reserved or there already; a unit that is none.
pub fn named(
    place: &Text,
    state: &DeclaredState,
    taken: &[(String, Unit)],
) -> Result<(String, Unit)> {
    let name = state.name.get_ref();
    let unit = checked_name(place, &state.name, &state.unit, "state")?;
    if taken.iter().any(|t| t.0 == *name) {
        let message = format!("\"{name}\" is there already");
        return Err(place.error(&state.name, &message, "give the state another name"));
    }
    Ok((name.clone(), unit))
}

/// # Errors
/// Too many states.
pub fn check_count(place: &Text, states: &[DeclaredState]) -> Result<()> {
    states.get(MAX_STATES).map_or(Ok(()), |state| {
        let message = format!("more than {MAX_STATES} states");
        Err(place.error(&state.name, &message, "no record tells so many apart"))
    })
}

/// Whether each state changes the moment, by itself or by another; `used` are the names in the moment.
///
/// # Errors
/// One that does not.
pub fn check_used(place: &Text, states: &[DeclaredState], used: &[(&str, Span)]) -> Result<()> {
    let in_moment = |state: &DeclaredState| used.iter().any(|u| u.0 == state.name.get_ref());
    let idle = |state: &&DeclaredState| {
        let of_another = states.iter().filter(|other| in_moment(other)).any(|other| {
            let mut names = Vec::new();
            let parsed = expression::parse(other.rate.get_ref());
            if let Ok(node) = &parsed {
                node.names(&mut names);
            }
            names.iter().any(|n| n.0 == state.name.get_ref())
        });
        !in_moment(state) && !of_another
    };
    states.iter().find(idle).map_or(Ok(()), |state| {
        let message = format!("the moment does not use the state \"{}\"", state.name.get_ref());
        Err(place.error(&state.name, &message, "use it in the moment or take it away"))
    })
}

/// The states, compiled and checked; `starts` of the parameters.
///
/// # Errors
/// Pointing at the character: what is no expression, has another unit, or has no balance to begin from.
pub fn compiled(
    place: &Text,
    declared: &[DeclaredState],
    numbers: &Numbers,
    starts: &[f64],
) -> Result<Vec<Compiled>> {
    let one = |state: &DeclaredState| compile(place, state, numbers);
    let all = declared.iter().map(one).collect::<Result<Vec<_>>>()?;
    let states: Vec<OwnState> = all.iter().map(|c| c.state.clone()).collect();
    check_begin(place, declared, &states, starts)?;
    Ok(all)
}

fn compile(place: &Text, declared: &DeclaredState, numbers: &Numbers) -> Result<Compiled> {
    let name = declared.name.get_ref();
    let unit = numbers.units.iter().find(|u| u.0 == *name).expect("it is named").1;
    let mut uses = Vec::new();
    let mut read = |text: &Spanned<String>, names: &[String], wanted: &Wanted| {
        let written = text.get_ref();
        let quoted = Place::new(place.text, text.span(), written);
        let pointed = |flaw: Flaw| quoted.error(place.file, place.text, &flaw);
        let node = expression::parse(written).map_err(pointed)?;
        let program = Program::new(&node, names).map_err(pointed)?;
        units::check(written, &node, numbers.units, wanted).map_err(pointed)?;
        let mut found = Vec::new();
        node.names(&mut found);
        uses.extend(found.iter().map(|f| f.0.to_owned()).filter(|used| used != name));
        Ok((one_line(written, &node), program))
    };
    let rate = Wanted {
        unit: unit.per_second(),
        written: unit.per_second().to_string(),
        why: "the rate of a state is its unit over s; a bare number takes any unit it needs",
    };
    let (rate, rate_program) = read(&declared.rate, numbers.names, &rate)?;
    let wanted = Wanted {
        unit,
        written: declared.unit.get_ref().clone(),
        why: "a state begins at a value of its own unit; a bare number takes any unit it needs",
    };
    let start = declared.start.as_ref();
    let parameters = &numbers.names[..numbers.parameters];
    let start = start.map(|start| read(start, parameters, &wanted)).transpose()?;
    let state = OwnState {
        name: name.clone(),
        unit: declared.unit.get_ref().clone(),
        rate,
        rate_program,
        start_program: start.map(|s| s.1),
    };
    Ok(Compiled { state, uses })
}

/// Angles of releases at which there has to be a beginning, rad, and wind speeds, m/s.
const HELD: [(f64, f64); 5] = [(0.0, 0.0), (0.25, 0.0), (-0.25, 0.0), (0.02, 10.0), (-0.1, 10.0)];

/// Whether the states have a value to begin at, whatever the release.
fn check_begin(
    place: &Text,
    declared: &[DeclaredState],
    states: &[OwnState],
    starts: &[f64],
) -> Result<()> {
    for (yaw_rad, wind_speed_m_s) in HELD {
        let held = State {
            yaw_rad,
            rate_rad_s: 0.0,
            time_s: 0.0,
            natural_frequency_rad_s: 7.0,
            wind_speed_m_s,
            rate_sign: if yaw_rad > 0.0 { -1.0 } else { 1.0 },
            yaw_sign: if yaw_rad < 0.0 { -1.0 } else { 1.0 },
        };
        let z = begun(states, starts, &held);
        let Some(k) = (0..states.len()).find(|k| !z[*k].is_finite()) else { continue };
        // Those that are to begin in balance have it together.
        let k = if declared[k].start.is_some() { k } else { first_free(declared) };
        let (state, name) = (&declared[k], declared[k].name.get_ref());
        return Err(match &state.start {
            Some(start) => {
                let message = format!("the start of {name} is {} at b = {yaw_rad} rad", z[k]);
                place.error(start, &message, "begin at a value that is finite at every angle")
            }
            None => {
                let message = format!(
                    "{name} has no balance: with the model held at b = {yaw_rad} rad no one value of it makes its rate zero"
                );
                let help = "say where it begins at a release: start = \"b\", or start = \"0\"";
                place.error(&state.rate, &message, help)
            }
        });
    }
    Ok(())
}

fn first_free(declared: &[DeclaredState]) -> usize {
    declared.iter().position(|state| state.start.is_none()).unwrap_or_default()
}
