//! An expression written in another language, its numbers and functions as that language has them.

use super::expression::{self, Kind, Node, Operator};
use super::program::{function, Function};

/// What an expression can be written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// With `math` imported and a function `sign`.
    Python,
    /// MATLAB's, as Octave has it too.
    Matlab,
    /// C99 with `math.h`.
    C,
}

/// `text` in `language`. `name` says what each input and parameter is called there; it is asked for
/// `sign(r)`, too, which an integrator keeps so that it is definite where the rate is zero.
///
/// # Errors
/// What is wrong with `text`.
///
/// ```
/// use yawrig_expression::{translate, Language};
///
/// let mut name = |name: &str| format!("p_{name}");
/// let text = translate("-c * abs(r)^n * pi", Language::C, &mut name).expect("an expression");
/// assert_eq!(text, "-p_c * pow(fabs(p_r), p_n) * 3.141592653589793");
/// ```
pub fn translate(
    text: &str,
    language: Language,
    name: &mut dyn FnMut(&str) -> String,
) -> Result<String, String> {
    let node = expression::parse(text).map_err(|flaw| flaw.message)?;
    written(&node, language, name).map(|w| w.0)
}

/// How strongly a piece holds together: sums, products, signs, and what needs no parentheses.
const SUM: u8 = 1;
const PRODUCT: u8 = 2;
const SIGN: u8 = 3;
const POWER: u8 = 4;
const ATOM: u8 = 5;

fn written(
    node: &Node,
    language: Language,
    name: &mut dyn FnMut(&str) -> String,
) -> Result<(String, u8), String> {
    let mut at_least = |node: &Node, least: u8| {
        let (text, strength) = written(node, language, name)?;
        Ok::<String, String>(if strength < least { format!("({text})") } else { text })
    };
    Ok(match &node.kind {
        Kind::Number(value) => (format!("{value:?}"), ATOM),
        Kind::Name(n) if n == "pi" => (format!("{:?}", std::f64::consts::PI), ATOM),
        Kind::Name(n) => (name(n), ATOM),
        // Looser than a power in all of them.
        Kind::Negated(a) => (format!("-{}", at_least(a, POWER)?), SIGN),
        Kind::Binary(Operator::Power, a, b) => {
            power(at_least(a, ATOM)?, at_least(b, ATOM)?, language)
        }
        Kind::Binary(operator, a, b) => {
            let (sign, strength) = match operator {
                Operator::Add => ('+', SUM),
                Operator::Subtract => ('-', SUM),
                Operator::Multiply => ('*', PRODUCT),
                _ => ('/', PRODUCT),
            };
            // What stands on the right is computed first, as it was parsed.
            let text = format!("{} {sign} {}", at_least(a, strength)?, at_least(b, strength + 1)?);
            (text, strength)
        }
        Kind::Call(called, arguments) => {
            let (f, _) =
                function(called).filter(|(_, n)| *n == arguments.len()).ok_or_else(|| {
                    format!("there is no function \"{called}\" of {} argument(s)", arguments.len())
                })?;
            let of_rate = matches!(&arguments[0].kind, Kind::Name(n) if n == "r");
            if f == Function::Sign && of_rate {
                return Ok((name("sign(r)"), ATOM));
            }
            let is_operand = f == Function::Pow || f == Function::Sign;
            let least = if is_operand { ATOM } else { SUM };
            let arguments: Vec<String> =
                arguments.iter().map(|a| at_least(a, least)).collect::<Result<_, _>>()?;
            match (f, language) {
                (Function::Pow, _) => power(arguments[0].clone(), arguments[1].clone(), language),
                (Function::Sign, Language::C) => {
                    (format!("(({0} > 0.0) - ({0} < 0.0))", arguments[0]), ATOM)
                }
                _ => {
                    let called = called_in(f, called, language);
                    (format!("{called}({})", arguments.join(", ")), ATOM)
                }
            }
        }
    })
}

fn power(base: String, exponent: String, language: Language) -> (String, u8) {
    match language {
        Language::Python => (format!("math.pow({base}, {exponent})"), ATOM),
        Language::C => (format!("pow({base}, {exponent})"), ATOM),
        // From left to right there, from right to left here: both sides have parentheses.
        Language::Matlab => (format!("{base}^{exponent}"), POWER),
    }
}

fn called_in(f: Function, called: &str, language: Language) -> String {
    let name = match (f, language) {
        (Function::Ln, _) => "log",
        (Function::Abs, Language::C) => "fabs",
        (Function::Min, Language::C) => "fmin",
        (Function::Max, Language::C) => "fmax",
        _ => called,
    };
    let is_built_in = matches!(f, Function::Abs | Function::Min | Function::Max | Function::Sign);
    match language {
        Language::Python if !is_built_in => format!("math.{name}"),
        _ => name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> [String; 3] {
        [Language::Python, Language::Matlab, Language::C]
            .map(|l| translate(text, l, &mut |n| n.replace("sign(r)", "direction")).unwrap())
    }

    #[test]
    fn what_is_computed_first_stays_so() {
        assert_eq!(all("-b^2"), ["-math.pow(b, 2.0)", "-b^2.0", "-pow(b, 2.0)"]);
        assert_eq!(all("2^3^b")[1], "2.0^(3.0^b)");
        assert_eq!(all("(-b)^2")[1], "(-b)^2.0");
        assert_eq!(all("b^-2")[1], "b^(-2.0)");
        assert_eq!(all("a - (b - c)")[2], "a - (b - c)");
        assert_eq!(all("a / (b * c)")[2], "a / (b * c)");
        assert_eq!(all("(a + b) * -c")[2], "(a + b) * -c");
        assert_eq!(all("pow(a + b, c)")[0], "math.pow((a + b), c)");
        assert_eq!(all("1/3")[2], "1.0 / 3.0");
    }

    #[test]
    fn functions_have_the_names_they_have_there() {
        assert_eq!(all("ln(b)"), ["math.log(b)", "log(b)", "log(b)"]);
        assert_eq!(all("log(b)"), all("ln(b)"));
        assert_eq!(all("abs(b)"), ["abs(b)", "abs(b)", "fabs(b)"]);
        assert_eq!(all("min(b, 1)"), ["min(b, 1.0)", "min(b, 1.0)", "fmin(b, 1.0)"]);
        assert_eq!(all("sign(r) * sign(b)")[0], "direction * sign(b)");
        assert_eq!(all("sign(b - 1)")[2], "(((b - 1.0) > 0.0) - ((b - 1.0) < 0.0))");
        assert_eq!(all("tanh(b)")[0], "math.tanh(b)");
        assert!(translate("sinc(b)", Language::C, &mut str::to_owned).is_err());
    }
}
