//! A moment as a user writes it, parsed: `-c * tanh(r / 0.002) * (1 + s * exp(-abs(r) / v))`.
//!
//! The parser is `winnow`'s (MIT; kept by the authors of Rust's `toml`, which brings it in anyway): its
//! precedence climbing knows where in the text it is, so that every error points at a character, and it gives
//! a tree from which units can be checked. The evaluators looked at give neither: `exmex` 0.21 (fast,
//! derivatives) and `fasteval` 0.2 (2020) and `meval` 0.2 name no position and keep their tree to themselves,
//! in `exmex` -b^2 is (-b)^2, `evalexpr` has been AGPL since its version 12, `mathexpr` is at 0.1. Evaluation
//! is in [`super::program`].

use std::ops::Range;
use winnow::combinator::{alt, cut_err, expression, opt, preceded, separated, Infix, Prefix};
use winnow::error::{ErrMode, ParserError};
use winnow::prelude::*;
use winnow::stream::{LocatingSlice, Location, Stream};
use winnow::token::{one_of, take_while};

/// Longest expression, characters.
pub const LONGEST: usize = 1000;
/// Deepest nesting of parentheses, of powers and of signs one after the other.
const DEEPEST: usize = 24;

/// Where something stands in the expression, in bytes.
pub type Span = Range<usize>;

/// What is wrong, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Flaw {
    pub span: Span,
    pub message: String,
    pub help: String,
}

impl Flaw {
    pub fn new(span: Span, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { span, message: message.into(), help: help.into() }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operator {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    Number(f64),
    Name(String),
    Negated(Box<Node>),
    Binary(Operator, Box<Node>, Box<Node>),
    Call(String, Vec<Node>),
}

/// A piece of an expression; `at` is where its operator or its name is, `span` all of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    pub kind: Kind,
    pub at: Span,
    pub span: Span,
}

impl Node {
    /// The operator's one character.
    pub fn operator(&self, text: &str) -> Span {
        let between = &text[self.at.clone()];
        let start = self.at.start + between.len() - between.trim_start().len();
        start..start + 1
    }

    /// Every name in it that is not a function's, in order.
    pub fn names<'a>(&'a self, out: &mut Vec<(&'a str, Span)>) {
        match &self.kind {
            Kind::Number(_) => {}
            Kind::Name(name) => out.push((name, self.at.clone())),
            Kind::Negated(a) => a.names(out),
            Kind::Binary(_, a, b) => {
                a.names(out);
                b.names(out);
            }
            Kind::Call(_, arguments) => arguments.iter().for_each(|a| a.names(out)),
        }
    }
}

/// # Errors
/// The first thing that does not belong where it stands.
pub fn parse(text: &str) -> Result<Node, Flaw> {
    refuse_sizes(text)?;
    let mut input = LocatingSlice::new(text);
    let fail = |e: ErrMode<Expected>| {
        let Expected { at, what } = e.into_inner().unwrap_or(Expected { at: 0, what: OPERAND });
        unexpected(text, at, what)
    };
    let node = sum.parse_next(&mut input).map_err(fail)?;
    blank.parse_next(&mut input).map_err(fail)?;
    match input.eof_offset() {
        0 => Ok(node),
        _ => Err(unexpected(text, input.current_token_start(), OPERATOR)),
    }
}

const OPERAND: &str = "a number, a name or ( is expected";
const TOO_LARGE: &str = "this number is too large";
const OPERATOR: &str = "an operator (+ - * / ^) is expected";

fn unexpected(text: &str, at: usize, what: &str) -> Flaw {
    let rest = &text[at..];
    let Some(found) = rest.chars().next() else {
        return Flaw::new(at..at, format!("the expression ends where {what}"), "complete it");
    };
    let span = at..at + found.len_utf8();
    if what == TOO_LARGE {
        return Flaw::new(span, what, "give a finite number");
    }
    let help = match found {
        ')' => "take it away, or open a parenthesis before it",
        '*' if text[..at].ends_with('*') => "a power is written ^ or pow(x, n)",
        '=' => "give the right-hand side only, what is added to the yaw acceleration",
        c if what == OPERATOR && (c.is_alphanumeric() || "(_.".contains(c)) => {
            "a product is written with *"
        }
        _ => "numbers, names, + - * / ^, parentheses and commas make up an expression",
    };
    Flaw::new(span, format!("{what} here, not '{}'", found.escape_debug()), help)
}

/// Keeps the parser's recursion within bounds, before it sees the text.
fn refuse_sizes(text: &str) -> Result<(), Flaw> {
    if let Some((at, _)) = text.char_indices().nth(LONGEST) {
        let message = format!("the expression is longer than {LONGEST} characters");
        return Err(Flaw::new(at..at + 1, message, "write it more shortly"));
    }
    let (mut depth, mut signs, mut powers) = (0usize, 0usize, 0usize);
    let mut open = Vec::new();
    let mut is_quoted = false;
    for (at, c) in text.char_indices() {
        is_quoted ^= c == '"';
        if is_quoted {
            continue;
        }
        match c {
            '(' => {
                depth += 1;
                open.push(at);
            }
            ')' => {
                depth = depth.saturating_sub(1);
                open.pop();
            }
            '^' => powers += 1,
            _ => {}
        }
        match c {
            '+' | '-' => signs += 1,
            c if c.is_whitespace() => {}
            _ => signs = 0,
        }
        if depth.max(signs).max(powers) > DEEPEST {
            let message = format!("nested more than {DEEPEST} deep");
            return Err(Flaw::new(at..at + 1, message, "write it more simply"));
        }
    }
    match open.last() {
        Some(&at) => Err(Flaw::new(at..at + 1, "this parenthesis is not closed", "add a )")),
        None => Ok(()),
    }
}

type Input<'a> = LocatingSlice<&'a str>;
type Parsed<T> = Result<T, ErrMode<Expected>>;

/// What the parser was looking for when it failed.
#[derive(Clone, Copy, Debug)]
struct Expected {
    at: usize,
    what: &'static str,
}

impl ParserError<Input<'_>> for Expected {
    type Inner = Self;
    fn from_input(input: &Input<'_>) -> Self {
        Self { at: input.current_token_start(), what: OPERAND }
    }
    fn or(self, other: Self) -> Self {
        if other.at >= self.at {
            other
        } else {
            self
        }
    }
    fn into_inner(self) -> Result<Self, Self> {
        Ok(self)
    }
}

fn blank(i: &mut Input<'_>) -> Parsed<()> {
    take_while(0.., char::is_whitespace).void().parse_next(i)
}

fn sum(i: &mut Input<'_>) -> Parsed<Node> {
    let infix = |i: &mut Input<'_>| {
        use Infix::{Left, Right};
        blank.parse_next(i)?;
        let sign: char = one_of(['+', '-', '*', '/', '^']).parse_next(i)?;
        Ok(match sign {
            '+' => Left(5, |i, a, b| Ok(binary(i, Operator::Add, a, b))),
            '-' => Left(5, |i, a, b| Ok(binary(i, Operator::Subtract, a, b))),
            '*' => Left(7, |i, a, b| Ok(binary(i, Operator::Multiply, a, b))),
            '/' => Left(7, |i, a, b| Ok(binary(i, Operator::Divide, a, b))),
            _ => Right(11, |i, a, b| Ok(binary(i, Operator::Power, a, b))),
        })
    };
    let prefix = |i: &mut Input<'_>| {
        blank.parse_next(i)?;
        let sign: char = one_of(['-', '+']).parse_next(i)?;
        Ok(match sign {
            // Looser than the power: -b^2 is -(b^2).
            '-' => Prefix(9, |_: &mut Input<'_>, a: Node| {
                let span = a.span.clone();
                Ok(Node { kind: Kind::Negated(Box::new(a)), at: span.clone(), span })
            }),
            _ => Prefix(9, |_: &mut Input<'_>, a: Node| Ok(a)),
        })
    };
    expression(operand).prefix(prefix).infix(infix).parse_next(i)
}

/// `at` is what stands between the operands: blanks, the operator, signs of the right one.
fn binary(_: &mut Input<'_>, operator: Operator, left: Node, right: Node) -> Node {
    let at = left.span.end..right.span.start;
    let span = left.span.start..right.span.end;
    Node { kind: Kind::Binary(operator, Box::new(left), Box::new(right)), at, span }
}

fn operand(i: &mut Input<'_>) -> Parsed<Node> {
    blank.parse_next(i)?;
    alt((number, group, quoted, name)).parse_next(i)
}

/// A name of other than letters, in quotes, `"Potential (V)"`; or the number of a channel, `#2`.
fn quoted(i: &mut Input<'_>) -> Parsed<Node> {
    let inner =
        ('"', take_while(1.., |c: char| c != '"'), '"').map(|(_, name, _): (_, &str, _)| name);
    let number = ('#', take_while(1.., '0'..='9')).take();
    let (name, at) = alt((inner, number)).with_span().parse_next(i)?;
    Ok(Node { kind: Kind::Name(name.to_owned()), span: at.clone(), at })
}

fn number(i: &mut Input<'_>) -> Parsed<Node> {
    let digits = |i: &mut Input<'_>| take_while(0.., '0'..='9').void().parse_next(i);
    let some =
        |i: &mut Input<'_>| -> Parsed<()> { take_while(1.., '0'..='9').void().parse_next(i) };
    let start = i.checkpoint();
    let mantissa = alt(((some, opt(('.', digits))).void(), ('.', some).void()));
    let exponent = opt((one_of(['e', 'E']), opt(one_of(['+', '-'])), some));
    let (text, span) = (mantissa, exponent).take().with_span().parse_next(i)?;
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => {
            Ok(Node { kind: Kind::Number(value), at: span.clone(), span })
        }
        _ => {
            i.reset(&start);
            Err(ErrMode::Cut(Expected { at: span.start, what: TOO_LARGE }))
        }
    }
}

/// What is in parentheses, its span with them.
fn group(i: &mut Input<'_>) -> Parsed<Node> {
    let ((inner, ()), span) =
        (preceded('(', cut_err(sum)), cut_err(closing)).with_span().parse_next(i)?;
    Ok(Node { span, ..inner })
}

fn closing(i: &mut Input<'_>) -> Parsed<()> {
    blank.parse_next(i)?;
    let at = i.current_token_start();
    ')'.void().parse_next(i).map_err(|_: ErrMode<Expected>| {
        ErrMode::Cut(Expected { at, what: "an operator or ) is expected" })
    })
}

fn name(i: &mut Input<'_>) -> Parsed<Node> {
    let first = one_of(|c: char| c.is_alphabetic() || c == '_');
    let rest = take_while(0.., |c: char| c.is_alphanumeric() || c == '_');
    let (text, at) = (first, rest).take().with_span().parse_next(i)?;
    let name = text.to_owned();
    blank.parse_next(i)?;
    if opt('(').parse_next(i)?.is_none() {
        return Ok(Node { kind: Kind::Name(name), span: at.clone(), at });
    }
    let comma = |i: &mut Input<'_>| -> Parsed<()> {
        blank.parse_next(i)?;
        ','.void().parse_next(i)
    };
    let arguments = cut_err(separated(1.., sum, comma)).parse_next(i)?;
    cut_err(closing).parse_next(i)?;
    let span = at.start..i.previous_token_end();
    Ok(Node { kind: Kind::Call(name, arguments), at, span })
}
