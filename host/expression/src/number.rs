//! What an expression can be evaluated in: numbers, and numbers with a derivative.

/// Arithmetic of an expression.
pub trait Number: Copy {
    fn constant(value: f64) -> Self;
    fn value(self) -> f64;
    /// f(x), given f at the value and f' there; f' is asked for only where it is carried.
    fn map(self, f: impl Fn(f64) -> f64, slope: impl Fn(f64) -> f64) -> Self;
    fn add(self, other: Self) -> Self;
    fn subtract(self, other: Self) -> Self;
    fn multiply(self, other: Self) -> Self;
    fn divide(self, other: Self) -> Self;
    fn power(self, other: Self) -> Self;
}

impl Number for f64 {
    #[inline]
    fn constant(value: f64) -> Self {
        value
    }
    #[inline]
    fn value(self) -> f64 {
        self
    }
    #[inline]
    fn map(self, f: impl Fn(f64) -> f64, _: impl Fn(f64) -> f64) -> Self {
        f(self)
    }
    #[inline]
    fn add(self, other: Self) -> Self {
        self + other
    }
    #[inline]
    fn subtract(self, other: Self) -> Self {
        self - other
    }
    #[inline]
    fn multiply(self, other: Self) -> Self {
        self * other
    }
    #[inline]
    fn divide(self, other: Self) -> Self {
        self / other
    }
    #[inline]
    fn power(self, other: Self) -> Self {
        self.powf(other)
    }
}

/// A number and its derivative by one of the inputs (forward-mode differentiation).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual {
    pub value: f64,
    pub slope: f64,
}

impl Number for Dual {
    fn constant(value: f64) -> Self {
        Self { value, slope: 0.0 }
    }
    fn value(self) -> f64 {
        self.value
    }
    fn map(self, f: impl Fn(f64) -> f64, slope: impl Fn(f64) -> f64) -> Self {
        // What does not change does not change its function, whatever the slope there.
        let inner = if self.slope == 0.0 { 0.0 } else { self.slope * slope(self.value) };
        Self { value: f(self.value), slope: inner }
    }
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, slope: self.slope + other.slope }
    }
    fn subtract(self, other: Self) -> Self {
        Self { value: self.value - other.value, slope: self.slope - other.slope }
    }
    fn multiply(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            slope: self.slope * other.value + self.value * other.slope,
        }
    }
    fn divide(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self { value, slope: (self.slope - value * other.slope) / other.value }
    }
    fn power(self, other: Self) -> Self {
        let (x, n) = (self.value, other.value);
        let base = if self.slope == 0.0 { 0.0 } else { n * x.powf(n - 1.0) * self.slope };
        let exponent =
            if other.slope == 0.0 || x == 0.0 { 0.0 } else { x.powf(n) * x.ln() * other.slope };
        Self { value: x.powf(n), slope: base + exponent }
    }
}
