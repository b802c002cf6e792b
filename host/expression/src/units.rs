//! Units of an expression. rad counts as 1, as in the SI; a bare number takes whatever unit it needs.

use super::expression::{Flaw, Kind, Node, Operator, Span};
use super::program::{function, Function};
use std::fmt;

/// Powers of s, m and kg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit([f64; 3]);

/// A unit, or what takes any: a bare number, and what it is multiplied with.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Dimension {
    Any,
    Of(Unit),
}

/// Symbols and their powers of s, m and kg.
const SYMBOLS: [(&str, [f64; 3]); 8] = [
    ("1", [0.0, 0.0, 0.0]),
    ("rad", [0.0, 0.0, 0.0]),
    ("s", [1.0, 0.0, 0.0]),
    ("Hz", [-1.0, 0.0, 0.0]),
    ("m", [0.0, 1.0, 0.0]),
    ("kg", [0.0, 0.0, 1.0]),
    ("N", [-2.0, 1.0, 1.0]),
    ("Pa", [-2.0, -1.0, 1.0]),
];

impl Unit {
    const ONE: Self = Self([0.0; 3]);
    pub(super) const MOMENT: Self = Self([-2.0, 0.0, 0.0]);
    const PER_SECOND: Self = Self([-1.0, 0.0, 0.0]);

    /// Reads `rad/s2`, `1/(rad2 s)`, `kg m2`, `s^-1`.
    ///
    /// # Errors
    /// What is wrong with it, and where.
    pub fn parse(text: &str) -> Result<Self, Flaw> {
        let mut unit = [0.0; 3];
        let (mut over, mut group, mut some) = (1.0, 1.0, false);
        let mut open = None;
        let mut rest = text;
        let at = |rest: &str| text.len() - rest.len();
        while let Some(c) = rest.chars().next() {
            let here = at(rest)..at(rest) + c.len_utf8();
            let wrong = |message: String| {
                let symbols: Vec<&str> = SYMBOLS.iter().map(|s| s.0).collect();
                let help = format!("units are made of {}, as in 1/(rad2 s)", symbols.join(", "));
                Flaw::new(here.clone(), message, help)
            };
            match c {
                ' ' | '*' | '.' | '·' => {}
                '/' => over = -1.0,
                '(' if open.is_none() => {
                    open = Some(here);
                    group = over;
                    over = 1.0;
                }
                ')' if open.is_some() => {
                    open = None;
                    group = 1.0;
                    over = 1.0;
                }
                _ => {
                    let Some((symbol, powers)) = longest(rest) else {
                        let word: String =
                            rest.chars().take_while(|c| c.is_alphanumeric()).collect();
                        let degrees = word.starts_with("deg");
                        let hint = if degrees { ": angles are in rad" } else { "" };
                        let mut flaw = wrong(format!("there is no unit \"{word}\"{hint}"));
                        flaw.span.end = flaw.span.end.max(flaw.span.start + word.len());
                        return Err(flaw);
                    };
                    rest = &rest[symbol.len()..];
                    let (power, length) = exponent(rest);
                    let Some(power) = power else {
                        return Err(wrong("a whole power is expected".to_owned()));
                    };
                    for (u, p) in unit.iter_mut().zip(powers) {
                        *u += over * group * power * p;
                    }
                    over = 1.0;
                    some = true;
                    rest = &rest[length..];
                    continue;
                }
            }
            rest = &rest[c.len_utf8()..];
        }
        if !some || open.is_some() || over < 0.0 {
            let help = "write it as rad/s2 or 1/(rad2 s); 1 for a pure number";
            return Err(Flaw::new(0..text.len(), format!("\"{text}\" is no complete unit"), help));
        }
        Ok(Self(unit))
    }

    /// The power of seconds in it.
    pub fn seconds(&self) -> f64 {
        self.0[0]
    }

    /// Of a rate of change.
    pub(super) fn per_second(self) -> Self {
        self.combined(Self::PER_SECOND, 1.0)
    }

    fn combined(self, other: Self, sign: f64) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + sign * other.0[k]))
    }

    fn power(self, n: f64) -> Self {
        Self(self.0.map(|p| p * n))
    }
}

fn longest(rest: &str) -> Option<(&'static str, [f64; 3])> {
    let word = rest.chars().take_while(|c| c.is_alphabetic()).map(char::len_utf8).sum::<usize>();
    let word = &rest[..word.max(usize::from(rest.starts_with('1')))];
    SYMBOLS.into_iter().find(|(symbol, _)| *symbol == word)
}

/// The power after a symbol, 1 where there is none, and how many bytes it takes.
fn exponent(rest: &str) -> (Option<f64>, usize) {
    let digits = rest.strip_prefix('^').unwrap_or(rest);
    let caret = rest.len() - digits.len();
    let length = digits
        .char_indices()
        .take_while(|(k, c)| c.is_ascii_digit() || *k == 0 && *c == '-')
        .count();
    if length == 0 && caret == 0 {
        return (Some(1.0), 0);
    }
    (digits[..length].parse::<i8>().ok().map(f64::from), caret + length)
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let write = |sign: f64| {
            let symbols = ["s", "m", "kg"].into_iter().zip(self.0).filter(|(_, p)| p * sign > 0.0);
            let text = |(symbol, p): (&str, f64)| match p.abs() {
                1.0 => symbol.to_owned(),
                p => format!("{symbol}{p}"),
            };
            symbols.map(text).collect::<Vec<_>>()
        };
        let (above, below) = (write(1.0), write(-1.0));
        let above = if above.is_empty() { "1".to_owned() } else { above.join(" ") };
        match below.as_slice() {
            [] => write!(f, "{above}"),
            [one] => write!(f, "{above}/{one}"),
            many => write!(f, "{above}/({})", many.join(" ")),
        }
    }
}

/// What an expression's unit is to be.
pub struct Wanted {
    pub unit: Unit,
    pub written: String,
    /// Of what it is, and why it has that unit.
    pub why: &'static str,
}

impl Wanted {
    /// An acceleration.
    pub fn moment() -> Self {
        let why = "a moment is divided by the inertia; a bare number takes any unit it needs";
        Self { unit: Unit::MOMENT, written: "rad/s2".into(), why }
    }
}

/// Whether `node` has the unit `wanted`, given those of the numbers in it.
///
/// # Errors
/// The operator or function at which units do not go together.
pub fn check(
    text: &str,
    node: &Node,
    parameters: &[(String, Unit)],
    wanted: &Wanted,
) -> Result<(), Flaw> {
    match of(text, node, parameters)? {
        Dimension::Of(unit) if unit != wanted.unit => Err(Flaw::new(
            node.span.clone(),
            format!("this has the unit {unit}, not {}", wanted.written),
            wanted.why,
        )),
        _ => Ok(()),
    }
}

fn of(text: &str, node: &Node, parameters: &[(String, Unit)]) -> Result<Dimension, Flaw> {
    use Dimension::{Any, Of};
    Ok(match &node.kind {
        Kind::Number(_) => Any,
        Kind::Name(name) => match name.as_str() {
            "b" | "pi" => Of(Unit::ONE),
            "r" | "wn" => Of(Unit::PER_SECOND),
            "t" => Of(Unit([1.0, 0.0, 0.0])),
            "wind" => Of(Unit([-1.0, 1.0, 0.0])),
            name => parameters.iter().find(|p| p.0 == name).map_or(Any, |p| Of(p.1)),
        },
        Kind::Negated(a) => of(text, a, parameters)?,
        Kind::Binary(Operator::Power, a, b) => {
            power(text, (a, b), node.operator(text), parameters)?
        }
        Kind::Binary(operator, a, b) => {
            let (x, y) = (of(text, a, parameters)?, of(text, b, parameters)?);
            let sign = match operator {
                Operator::Multiply => 1.0,
                Operator::Divide => -1.0,
                _ => return same(x, y, node.operator(text)),
            };
            match (x, y) {
                (Of(x), Of(y)) => Of(x.combined(y, sign)),
                _ => Any,
            }
        }
        Kind::Call(name, arguments) => {
            let Some((f, _)) = function(name) else { return Ok(Any) };
            call(text, node, f, arguments, parameters)?
        }
    })
}

fn call(
    text: &str,
    node: &Node,
    f: Function,
    arguments: &[Node],
    parameters: &[(String, Unit)],
) -> Result<Dimension, Flaw> {
    use Dimension::{Any, Of};
    let first = of(text, &arguments[0], parameters)?;
    Ok(match f {
        Function::Abs => first,
        Function::Sign => Of(Unit::ONE),
        Function::Sqrt => match first {
            Of(unit) => Of(unit.power(0.5)),
            Any => Any,
        },
        Function::Min | Function::Max => {
            same(first, of(text, &arguments[1], parameters)?, node.at.clone())?
        }
        Function::Atan2 => {
            same(first, of(text, &arguments[1], parameters)?, node.at.clone())?;
            Of(Unit::ONE)
        }
        Function::Pow => power(text, (&arguments[0], &arguments[1]), node.at.clone(), parameters)?,
        _ => {
            if let Of(unit) = first
                && unit != Unit::ONE
            {
                let name = &text[node.at.clone()];
                return Err(Flaw::new(
                    node.at.clone(),
                    format!("{name}() of something with the unit {unit}"),
                    "divide by a scale: a parameter of that unit, or a bare number",
                ));
            }
            Of(Unit::ONE)
        }
    })
}

fn same(x: Dimension, y: Dimension, at: Span) -> Result<Dimension, Flaw> {
    match (x, y) {
        (Dimension::Of(a), Dimension::Of(b)) if a != b => Err(Flaw::new(
            at,
            format!("the units do not go together: {a} and {b}"),
            "a bare number takes any unit it needs; rad counts as 1",
        )),
        (Dimension::Any, other) => Ok(other),
        (x, _) => Ok(x),
    }
}

fn power(
    text: &str,
    (base, exponent): (&Node, &Node),
    at: Span,
    parameters: &[(String, Unit)],
) -> Result<Dimension, Flaw> {
    use Dimension::{Any, Of};
    let (base, by) = (of(text, base, parameters)?, of(text, exponent, parameters)?);
    if let Of(unit) = by
        && unit != Unit::ONE
    {
        let message = format!("an exponent with the unit {unit}");
        return Err(Flaw::new(at, message, "an exponent is a pure number"));
    }
    match (base, literal(exponent)) {
        (Any, _) => Ok(Any),
        (Of(unit), Some(n)) => Ok(Of(unit.power(n))),
        (Of(unit), None) if unit == Unit::ONE => Ok(base),
        (Of(unit), None) => Err(Flaw::new(
            at,
            format!("a variable power of something with the unit {unit}"),
            "divide the base by a scale first: (abs(r) / 1.0)^n",
        )),
    }
}

/// The number that an exponent is made of, if it is one.
fn literal(node: &Node) -> Option<f64> {
    match &node.kind {
        Kind::Number(value) => Some(*value),
        Kind::Negated(a) => literal(a).map(|x| -x),
        Kind::Binary(Operator::Divide, a, b) => Some(literal(a)? / literal(b)?),
        _ => None,
    }
}
