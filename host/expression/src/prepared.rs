//! A compiled moment made ready for one simulation.

use super::expression::Operator;
use super::program::{apply, one, takes_two, two, Function, Input, Instruction, Program};
use super::states::MAX_STATES;

/// A program with its numbers put in, for the many evaluations of a simulation: what does not change is
/// computed once, the rest goes from register to register.
#[derive(Clone, Debug)]
pub struct Prepared {
    steps: Vec<Step>,
    registers: Vec<f64>,
    result: usize,
}

#[derive(Clone, Copy, Debug)]
struct Step {
    operation: Operation,
    a: usize,
    b: usize,
    out: usize,
}

#[derive(Clone, Copy, Debug)]
enum Operation {
    Binary(Operator),
    WholePower(i32),
    One(Function),
    Two(Function),
}

/// Registers of yaw, rate, time and the two signs.
const INPUTS: usize = 5;
/// Registers of what changes: those, and the states.
const CHANGING: usize = INPUTS + MAX_STATES;

impl Prepared {
    /// A program's numbers beyond `parameters` are states.
    pub fn new(
        program: &Program,
        parameters: &[f64],
        natural_frequency_rad_s: f64,
        wind_speed_m_s: f64,
    ) -> Self {
        let mut registers = vec![0.0; CHANGING];
        // Whether a register holds a number that does not change.
        let mut fixed = vec![false; CHANGING];
        let mut stack: Vec<usize> = Vec::new();
        let mut steps = Vec::new();
        for instruction in &program.instructions {
            let number = match *instruction {
                Instruction::Number(value) => Some(value),
                Instruction::Parameter(k) => parameters.get(k as usize).copied(),
                Instruction::Input(Input::NaturalFrequency) => Some(natural_frequency_rad_s),
                Instruction::Input(Input::Wind) => Some(wind_speed_m_s),
                _ => None,
            };
            if let Some(value) = number {
                stack.push(registers.len());
                registers.push(value);
                fixed.push(true);
                continue;
            }
            let mut pop = || stack.pop().expect("an operand");
            let (operation, a, b) = match *instruction {
                Instruction::Parameter(k) => {
                    stack.push(INPUTS + k as usize - parameters.len());
                    continue;
                }
                Instruction::Input(input) => {
                    stack.push(match input {
                        Input::Rate => 1,
                        Input::Time => 2,
                        Input::RateSign => 3,
                        Input::YawSign => 4,
                        _ => 0,
                    });
                    continue;
                }
                Instruction::Negate => {
                    let b = pop();
                    registers.push(0.0);
                    fixed.push(true);
                    (Operation::Binary(Operator::Subtract), registers.len() - 1, b)
                }
                Instruction::Binary(operator) => {
                    let b = pop();
                    (Operation::Binary(operator), pop(), b)
                }
                Instruction::WholePower(n) => {
                    let a = pop();
                    (Operation::WholePower(n), a, a)
                }
                Instruction::Call(f) if takes_two(f) => {
                    let b = pop();
                    (Operation::Two(f), pop(), b)
                }
                Instruction::Call(f) => {
                    let a = pop();
                    (Operation::One(f), a, a)
                }
                Instruction::Number(_) => continue,
            };
            let out = registers.len();
            let unchanging = fixed[a] && fixed[b];
            registers.push(if unchanging { operation.of(registers[a], registers[b]) } else { 0.0 });
            fixed.push(unchanging);
            if !unchanging {
                steps.push(Step { operation, a, b, out });
            }
            stack.push(out);
        }
        Self { steps, registers, result: stack.pop().unwrap_or(0) }
    }

    /// Its value (of a moment over Izz rad/s2) `at` a yaw angle (rad), yaw rate (rad/s) and time (s), with the
    /// signs of rate and angle that the integrator keeps, and at the states `z`.
    #[inline]
    pub fn evaluate(&mut self, at: [f64; INPUTS], z: &[f64]) -> f64 {
        self.registers[..INPUTS].copy_from_slice(&at);
        self.registers[INPUTS..INPUTS + z.len()].copy_from_slice(z);
        for step in &self.steps {
            let (a, b) = (self.registers[step.a], self.registers[step.b]);
            self.registers[step.out] = step.operation.of(a, b);
        }
        self.registers[self.result]
    }
}

impl Operation {
    #[inline]
    fn of(self, a: f64, b: f64) -> f64 {
        match self {
            Self::Binary(operator) => apply(operator, a, b),
            Self::WholePower(n) => a.powi(n),
            Self::One(f) => one(f, a),
            Self::Two(f) => two(f, a, b),
        }
    }
}
