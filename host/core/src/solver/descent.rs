//! Damped steps downhill: the one loop of every fit. What a step is, what it promises and where it leads is the
//! problem's; that one which does not gain is damped more, one that does less, and when no damping helps, stands
//! here.
//!
//! Reference: K. Madsen, H. B. Nielsen, O. Tingleff, "Methods for non-linear least squares problems" (2004).

/// Why a descent ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// The minimum is nearer than asked for.
    Converged,
    /// The step is below the rounding of the parameters, as with data without noise.
    SmallStep,
    /// No damping gives a smaller sum of squares.
    NoDescent,
    /// No damping gives a step.
    NoStep,
    /// The allowed evaluations are used up.
    MaxEvaluations,
    /// The start itself gives residuals that are not finite.
    NotFinite,
    /// No residuals, or fewer than free parameters.
    TooFewResiduals,
    /// Somebody asked for an end.
    Interrupted,
}

impl Ended {
    /// Whether the parameters can be taken for a minimum.
    pub fn is_minimum(self) -> bool {
        matches!(self, Ended::Converged | Ended::SmallStep | Ended::NoDescent)
    }
}

/// What comes of one damping.
#[derive(Clone, Copy, Debug)]
pub enum Attempt {
    /// A step by which the objective falls so much if all is linear.
    Promises(f64),
    /// None: the damped equations have no solution.
    Impossible,
    /// None is to be tried.
    Ended(Ended),
}

/// What is brought downhill, where it stands, and the step that it is about to make.
pub trait Descent {
    /// Why there is nothing more to be done from where it stands, if so.
    fn arrived(&mut self) -> Option<Ended>;
    /// Prepares the step with this damping.
    fn step(&mut self, damping: f64) -> Attempt;
    /// By how much the objective falls by the step prepared; `None` where it cannot be evaluated.
    fn gain(&mut self) -> Option<f64>;
    /// Whether a step that promised and gained so much is the last one.
    fn is_last(&self, promised: f64, gained: Option<f64>) -> bool;
    /// Goes where the step leads.
    fn take(&mut self);
    /// What the damping is multiplied with after a step that kept this share of what it promised.
    fn relaxation(&self, kept: f64) -> f64 {
        relaxation(kept)
    }
}

/// Nielsen's, of a step that kept this share of what it promised.
pub fn relaxation(kept: f64) -> f64 {
    (1.0 - (2.0 * kept - 1.0).powi(3)).clamp(1.0 / 3.0, 2.0)
}

/// The damping of the steps, in the problem's own unit.
#[derive(Clone, Copy, Debug)]
pub struct Damping {
    value: f64,
    /// After a step that gained, at least.
    least: f64,
    /// After one that did not, at least.
    raised: f64,
    /// Beyond it a step has no length.
    most: f64,
    growth: f64,
    /// By what the growth grows from one failure to the next.
    faster: f64,
}

impl Damping {
    /// From `value` on, kept between `least` and `most`.
    pub fn new(value: f64, [least, most]: [f64; 2]) -> Self {
        Self { value, least, raised: 0.0, most, growth: 2.0, faster: 2.0 }
    }

    /// The same, at least so much after a step that did not gain, and tenfold where there was no step.
    pub(crate) fn raised_to(self, raised: f64) -> Self {
        Self { raised, ..self }
    }

    /// The same, tenfold after each step that did not gain, whatever went before.
    pub(crate) fn tenfold(self) -> Self {
        Self { growth: 10.0, faster: 1.0, ..self }
    }

    /// Of the next step.
    pub fn value(&self) -> f64 {
        self.value
    }

    fn lower(&mut self, by: f64) {
        self.value = (self.value * by).max(self.least);
        self.growth = if self.faster > 1.0 { self.faster } else { self.growth };
    }

    fn raise(&mut self, had_step: bool) {
        if had_step || self.raised == 0.0 {
            self.value = (self.value * self.growth).max(self.raised);
            self.growth *= self.faster;
        } else {
            self.value = (10.0 * self.value).max(self.raised);
        }
    }
}

/// One step that gains, with whatever damping it takes; why it ended where there is none, or it was the last.
pub fn step_down(problem: &mut impl Descent, damping: &mut Damping) -> Option<Ended> {
    let mut had_step = true;
    while damping.value <= damping.most {
        match problem.step(damping.value) {
            Attempt::Ended(ended) => return Some(ended),
            Attempt::Impossible => had_step = false,
            Attempt::Promises(promised) => {
                had_step = true;
                let gained = problem.gain();
                let last = problem.is_last(promised, gained).then_some(Ended::Converged);
                if let Some(gained) = gained.filter(|gained| *gained > 0.0) {
                    let kept = if promised > 0.0 { gained / promised } else { 1.0 };
                    damping.lower(problem.relaxation(kept));
                    problem.take();
                    return last;
                }
                if last.is_some() {
                    return last;
                }
            }
        }
        damping.raise(had_step);
    }
    Some(if had_step { Ended::NoDescent } else { Ended::NoStep })
}

/// Steps until there is nothing more to be done.
///
/// ```
/// use yawrig_core::solver::descent::{descend, Attempt, Damping, Descent, Ended};
///
/// /// The least of (x^2 - 2)^2, by Gauss-Newton steps.
/// struct Root {
///     x: f64,
///     to: f64,
/// }
/// impl Descent for Root {
///     fn arrived(&mut self) -> Option<Ended> {
///         ((self.x * self.x - 2.0).abs() < 1e-12).then_some(Ended::Converged)
///     }
///     fn step(&mut self, damping: f64) -> Attempt {
///         let (r, slope) = (self.x * self.x - 2.0, 2.0 * self.x);
///         let by = -slope * r / (slope * slope + damping);
///         self.to = self.x + by;
///         Attempt::Promises(-by * slope * (2.0 * r + by * slope))
///     }
///     fn gain(&mut self) -> Option<f64> {
///         let square = |x: f64| (x * x - 2.0).powi(2);
///         Some(square(self.x) - square(self.to))
///     }
///     fn is_last(&self, _promised: f64, _gained: Option<f64>) -> bool {
///         false
///     }
///     fn take(&mut self) {
///         self.x = self.to;
///     }
/// }
/// let mut root = Root { x: 0.1, to: 0.0 };
/// assert_eq!(descend(&mut root, Damping::new(1e-3, [1e-12, 1e12])), Ended::Converged);
/// assert!((root.x - 2f64.sqrt()).abs() < 1e-12);
/// ```
pub fn descend(problem: &mut impl Descent, mut damping: Damping) -> Ended {
    loop {
        let ended = problem.arrived().or_else(|| step_down(problem, &mut damping));
        if let Some(ended) = ended {
            return ended;
        }
    }
}
