//! An expression compiled: instructions on a stack of numbers, evaluated without an allocation.

use super::expression::{Flaw, Kind, Node, Operator};
use super::number::Number;
use yawrig_text::nearest;

/// Most numbers on the stack at once.
const STACK: usize = 16;
/// Most parameters of one effect.
pub const MAX_PARAMETERS: usize = 6;

/// What the moment depends on besides the parameters. Angles in rad, time from the release in s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    Yaw,
    Rate,
    Time,
    NaturalFrequency,
    Wind,
    /// Sign of the yaw rate, kept by the integrator so that it is definite where the rate is zero.
    RateSign,
    /// Sign of the yaw angle, likewise.
    YawSign,
}

/// The names of the inputs, and what they are.
pub const INPUTS: [(&str, Input); 5] = [
    ("b", Input::Yaw),
    ("r", Input::Rate),
    ("t", Input::Time),
    ("wn", Input::NaturalFrequency),
    ("wind", Input::Wind),
];

/// Where a moment is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<T> {
    pub yaw_rad: T,
    pub rate_rad_s: T,
    pub time_s: T,
    pub natural_frequency_rad_s: T,
    /// 0: off, or not known.
    pub wind_speed_m_s: T,
    /// +1 or -1.
    pub rate_sign: f64,
    /// +1 or -1.
    pub yaw_sign: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    Abs,
    Sign,
    Exp,
    Ln,
    Log10,
    Sqrt,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Atan2,
    Pow,
    Min,
    Max,
}

/// Functions and the number of their arguments. `log` is the natural logarithm, as `ln`.
pub const FUNCTIONS: [(&str, Function, usize); 20] = [
    ("abs", Function::Abs, 1),
    ("sign", Function::Sign, 1),
    ("exp", Function::Exp, 1),
    ("ln", Function::Ln, 1),
    ("log", Function::Ln, 1),
    ("log10", Function::Log10, 1),
    ("sqrt", Function::Sqrt, 1),
    ("sin", Function::Sin, 1),
    ("cos", Function::Cos, 1),
    ("tan", Function::Tan, 1),
    ("asin", Function::Asin, 1),
    ("acos", Function::Acos, 1),
    ("atan", Function::Atan, 1),
    ("sinh", Function::Sinh, 1),
    ("cosh", Function::Cosh, 1),
    ("tanh", Function::Tanh, 1),
    ("atan2", Function::Atan2, 2),
    ("pow", Function::Pow, 2),
    ("min", Function::Min, 2),
    ("max", Function::Max, 2),
];

pub fn function(name: &str) -> Option<(Function, usize)> {
    FUNCTIONS.iter().find(|f| f.0 == name).map(|f| (f.1, f.2))
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Instruction {
    Number(f64),
    Input(Input),
    Parameter(u8),
    Negate,
    Binary(Operator),
    /// A whole power, by multiplications.
    WholePower(i32),
    Call(Function),
}

/// A compiled moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    pub(super) instructions: Vec<Instruction>,
    /// abs(r) or sign(r) is in it: its corner is where the rate changes sign.
    pub has_rate_corner: bool,
    /// abs(b) or sign(b) is in it.
    pub has_yaw_corner: bool,
}

impl Program {
    /// # Errors
    /// A name or function that there is not, a wrong number of arguments, too much on the stack.
    pub fn new(node: &Node, parameters: &[String]) -> Result<Self, Flaw> {
        let mut program =
            Self { instructions: Vec::new(), has_rate_corner: false, has_yaw_corner: false };
        program.compile(node, parameters, 0)?;
        Ok(program)
    }

    /// Whether the wind speed is in it.
    pub fn uses_wind(&self) -> bool {
        self.uses(Input::Wind)
    }

    /// Whether the time is in it.
    pub(super) fn uses_time(&self) -> bool {
        self.uses(Input::Time)
    }

    /// Whether it is linear in yaw angle, yaw rate and states (its numbers beyond so many `parameters`) and nothing
    /// else changes it on the way.
    pub(super) fn is_linear(&self, parameters: usize) -> bool {
        let mut degrees: Vec<u32> = Vec::new();
        // More than linear, whatever it is.
        const BENT: u32 = 2;
        for instruction in &self.instructions {
            let degree = match *instruction {
                Instruction::Input(Input::Yaw | Input::Rate) => 1,
                Instruction::Input(Input::NaturalFrequency | Input::Wind) => 0,
                Instruction::Input(_) => BENT,
                Instruction::Number(_) => 0,
                Instruction::Parameter(k) => u32::from(usize::from(k) >= parameters),
                _ => {
                    let last = degrees.pop().unwrap_or(BENT);
                    let any = |degree: u32| if degree == 0 { 0 } else { BENT };
                    let mut two = |of: fn(u32, u32) -> u32| of(degrees.pop().unwrap_or(BENT), last);
                    match *instruction {
                        Instruction::Negate | Instruction::WholePower(1) => last,
                        Instruction::Binary(Operator::Add | Operator::Subtract) => two(u32::max),
                        Instruction::Binary(Operator::Multiply) => two(|a, b| (a + b).min(BENT)),
                        Instruction::Binary(Operator::Divide) if last == 0 => two(|a, _| a),
                        Instruction::Binary(_) => any(two(u32::max)),
                        Instruction::Call(f) if takes_two(f) => any(two(u32::max)),
                        _ => any(last),
                    }
                }
            };
            degrees.push(degree);
        }
        degrees == [0] || degrees == [1]
    }

    fn uses(&self, input: Input) -> bool {
        self.instructions.contains(&Instruction::Input(input))
    }

    fn compile(&mut self, node: &Node, parameters: &[String], used: usize) -> Result<(), Flaw> {
        if used >= STACK {
            let help = "write it more simply";
            return Err(Flaw::new(node.span.clone(), "the expression is too deeply nested", help));
        }
        match &node.kind {
            Kind::Number(value) => self.push(Instruction::Number(*value)),
            Kind::Name(name) => {
                let instruction = name_of(node, name, parameters)?;
                self.push(instruction);
            }
            Kind::Negated(a) => {
                self.compile(a, parameters, used)?;
                self.push(Instruction::Negate);
            }
            Kind::Binary(operator, a, b) => {
                self.compile(a, parameters, used)?;
                match (operator, whole(b)) {
                    (Operator::Power, Some(n)) => self.push(Instruction::WholePower(n)),
                    _ => {
                        self.compile(b, parameters, used + 1)?;
                        self.push(Instruction::Binary(*operator));
                    }
                }
            }
            Kind::Call(name, arguments) => self.call(node, name, arguments, parameters, used)?,
        }
        Ok(())
    }

    fn call(
        &mut self,
        node: &Node,
        name: &str,
        arguments: &[Node],
        parameters: &[String],
        used: usize,
    ) -> Result<(), Flaw> {
        let Some((f, count)) = function(name) else {
            let names = FUNCTIONS.iter().map(|f| f.0);
            let help = match nearest(name, names.clone()) {
                Some(near) => format!("did you mean {near}?"),
                None => format!("the functions are {}", names.collect::<Vec<_>>().join(", ")),
            };
            return Err(Flaw::new(
                node.at.clone(),
                format!("there is no function \"{name}\""),
                help,
            ));
        };
        if arguments.len() != count {
            let given = arguments.len();
            let message = format!("{name} takes {count} argument(s), not {given}");
            return Err(Flaw::new(node.span.clone(), message, "arguments are separated by commas"));
        }
        // Corners that the integrators keep by themselves.
        let of = |name: &str| matches!(&arguments[0].kind, Kind::Name(n) if n == name);
        let kept = match f {
            Function::Abs | Function::Sign if of("r") => Some((Input::Rate, Input::RateSign)),
            Function::Abs | Function::Sign if of("b") => Some((Input::Yaw, Input::YawSign)),
            _ => None,
        };
        if let Some((input, sign)) = kept {
            self.has_rate_corner |= sign == Input::RateSign;
            self.has_yaw_corner |= sign == Input::YawSign;
            self.push(Instruction::Input(sign));
            if f == Function::Abs {
                self.push(Instruction::Input(input));
                self.push(Instruction::Binary(Operator::Multiply));
            }
            return Ok(());
        }
        for (k, argument) in arguments.iter().enumerate() {
            self.compile(argument, parameters, used + k)?;
        }
        self.push(match f {
            Function::Pow => Instruction::Binary(Operator::Power),
            f => Instruction::Call(f),
        });
        Ok(())
    }

    /// Appends, and computes at once what depends on nothing.
    fn push(&mut self, instruction: Instruction) {
        use Instruction::{Binary, Call, Negate, Number as N, WholePower};
        let constants = match *self.instructions.as_slice() {
            [.., N(a), N(b)] => (Some(a), Some(b)),
            [.., N(b)] => (None, Some(b)),
            _ => (None, None),
        };
        let (folded, taken) = match (instruction, constants) {
            (Negate, (_, Some(x))) => (-x, 1),
            (WholePower(n), (_, Some(x))) => (x.powi(n), 1),
            (Binary(operator), (Some(a), Some(b))) => (apply(operator, a, b), 2),
            (Call(f), (_, Some(x))) if !takes_two(f) => (one(f, x), 1),
            (Call(f), (Some(a), Some(b))) if takes_two(f) => (two(f, a, b), 2),
            _ => {
                self.instructions.push(instruction);
                return;
            }
        };
        self.instructions.truncate(self.instructions.len() - taken);
        self.instructions.push(N(folded));
    }

    /// The moment over Izz, rad/s2.
    #[inline]
    pub fn evaluate<T: Number>(&self, state: &State<T>, parameters: &[T]) -> T {
        let mut stack = [T::constant(0.0); STACK + 1];
        let mut top = 0;
        for instruction in &self.instructions {
            match *instruction {
                Instruction::Number(value) => {
                    stack[top] = T::constant(value);
                    top += 1;
                }
                Instruction::Input(input) => {
                    stack[top] = match input {
                        Input::Yaw => state.yaw_rad,
                        Input::Rate => state.rate_rad_s,
                        Input::Time => state.time_s,
                        Input::NaturalFrequency => state.natural_frequency_rad_s,
                        Input::Wind => state.wind_speed_m_s,
                        Input::RateSign => T::constant(state.rate_sign),
                        Input::YawSign => T::constant(state.yaw_sign),
                    };
                    top += 1;
                }
                Instruction::Parameter(k) => {
                    stack[top] = parameters[k as usize];
                    top += 1;
                }
                Instruction::Negate => stack[top - 1] = T::constant(0.0).subtract(stack[top - 1]),
                Instruction::WholePower(n) => {
                    let slope = |x: f64| f64::from(n) * x.powi(n - 1);
                    stack[top - 1] = stack[top - 1].map(|x| x.powi(n), slope);
                }
                Instruction::Binary(operator) => {
                    top -= 1;
                    stack[top - 1] = apply(operator, stack[top - 1], stack[top]);
                }
                Instruction::Call(f) if takes_two(f) => {
                    top -= 1;
                    stack[top - 1] = two(f, stack[top - 1], stack[top]);
                }
                Instruction::Call(f) => stack[top - 1] = one(f, stack[top - 1]),
            }
        }
        stack[0]
    }
}

fn name_of(node: &Node, name: &str, parameters: &[String]) -> Result<Instruction, Flaw> {
    if let Some((_, input)) = INPUTS.iter().find(|i| i.0 == name) {
        return Ok(Instruction::Input(*input));
    }
    if name == "pi" {
        return Ok(Instruction::Number(std::f64::consts::PI));
    }
    if let Some(k) = parameters.iter().position(|p| p == name) {
        return Ok(Instruction::Parameter(k as u8));
    }
    let at = node.at.clone();
    if function(name).is_some() {
        let message = format!("{name} is a function");
        return Err(Flaw::new(at, message, format!("give its argument: {name}(...)")));
    }
    let known = || {
        let inputs = INPUTS.iter().map(|i| i.0).chain(["pi"]);
        inputs.chain(parameters.iter().map(String::as_str))
    };
    let near = nearest(name, known().chain(FUNCTIONS.iter().map(|f| f.0)));
    let help = match near {
        Some(near) => format!("did you mean {near}? A parameter is declared under [parameters]"),
        None => format!(
            "there are {}; a parameter is declared under [parameters]",
            known().collect::<Vec<_>>().join(", ")
        ),
    };
    Err(Flaw::new(at, format!("there is no \"{name}\""), help))
}

/// The whole number that an exponent is, if it is a small one.
fn whole(node: &Node) -> Option<i32> {
    let value = match &node.kind {
        Kind::Number(value) => *value,
        Kind::Negated(inner) => return whole(inner).map(|n| -n),
        _ => return None,
    };
    (value.fract() == 0.0 && value <= 16.0).then_some(value as i32)
}

pub(super) fn takes_two(f: Function) -> bool {
    matches!(f, Function::Atan2 | Function::Min | Function::Max | Function::Pow)
}

#[inline]
pub(super) fn apply<T: Number>(operator: Operator, a: T, b: T) -> T {
    match operator {
        Operator::Add => a.add(b),
        Operator::Subtract => a.subtract(b),
        Operator::Multiply => a.multiply(b),
        Operator::Divide => a.divide(b),
        Operator::Power => a.power(b),
    }
}

#[inline]
pub(super) fn two<T: Number>(f: Function, a: T, b: T) -> T {
    match f {
        // NaN goes through: it must not vanish in a comparison.
        Function::Min if a.value() <= b.value() || a.value().is_nan() => a,
        Function::Max if a.value() >= b.value() || a.value().is_nan() => a,
        Function::Pow => a.power(b),
        Function::Atan2 => {
            let (y, x) = (a.value(), b.value());
            let square = x * x + y * y;
            let by_y = a.map(|y| y.atan2(x), |_| x / square);
            let by_x = b.map(|_| 0.0, |_| -y / square);
            by_y.add(by_x)
        }
        _ => b,
    }
}

#[inline]
pub(super) fn one<T: Number>(f: Function, x: T) -> T {
    match f {
        Function::Abs => x.map(f64::abs, sign),
        Function::Sign => x.map(sign, |_| 0.0),
        Function::Exp => x.map(f64::exp, f64::exp),
        Function::Ln => x.map(f64::ln, f64::recip),
        Function::Log10 => x.map(f64::log10, |x| std::f64::consts::LOG10_E / x),
        Function::Sqrt => x.map(f64::sqrt, |x| 0.5 / x.sqrt()),
        Function::Sin => x.map(f64::sin, f64::cos),
        Function::Cos => x.map(f64::cos, |x| -x.sin()),
        Function::Tan => x.map(f64::tan, |x| 1.0 / x.cos().powi(2)),
        Function::Asin => x.map(f64::asin, |x| 1.0 / (1.0 - x * x).sqrt()),
        Function::Acos => x.map(f64::acos, |x| -1.0 / (1.0 - x * x).sqrt()),
        Function::Atan => x.map(f64::atan, |x| 1.0 / (1.0 + x * x)),
        Function::Sinh => x.map(f64::sinh, f64::cosh),
        Function::Cosh => x.map(f64::cosh, f64::sinh),
        Function::Tanh => x.map(f64::tanh, |x| 1.0 - x.tanh().powi(2)),
        Function::Atan2 | Function::Pow | Function::Min | Function::Max => x,
    }
}

/// -1, 0 or 1.
fn sign(x: f64) -> f64 {
    if x == 0.0 {
        0.0
    } else {
        x.signum()
    }
}
