//! Records a computation written over [`Scalar`] as a list of operations.
//!
//! Equal operations are recorded once, known numbers are folded, and zeros and ones vanish, so a
//! step may be written with plain loops over matrices that hold structural zeros.

use core::cell::RefCell;
use core::ops::{Add, Div, Mul, Neg, Sub};
use std::collections::HashMap;

use bnkf::scalar::Scalar;

/// One operation; the numbers name earlier operations of the same tape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Operation {
    /// The input with this index.
    Input(u32),
    /// A known number, as its bits.
    Constant(u64),
    /// Sum.
    Add(u32, u32),
    /// First minus second.
    Sub(u32, u32),
    /// Product.
    Mul(u32, u32),
    /// First over second.
    Div(u32, u32),
    /// Minus.
    Neg(u32),
    /// Square root.
    Sqrt(u32),
    /// Exponential.
    Exp(u32),
    /// Exponential minus one.
    ExpM1(u32),
    /// Natural logarithm.
    Ln(u32),
    /// Sine.
    Sin(u32),
    /// Cosine.
    Cos(u32),
    /// Hyperbolic tangent.
    Tanh(u32),
    /// Angle of (second, first).
    Atan2(u32, u32),
    /// The larger one.
    Max(u32, u32),
    /// The smaller one.
    Min(u32, u32),
    /// Whole turns taken off.
    Wrap(u32),
    /// Third plus the product of the first two, rounded twice.
    AddProduct(u32, u32, u32),
    /// Third minus the product of the first two, rounded twice.
    SubProduct(u32, u32, u32),
}

#[derive(Default)]
struct Recording {
    operations: Vec<Operation>,
    known: HashMap<Operation, u32>,
}

/// Where variables write themselves down.
#[derive(Default)]
pub struct Tape {
    recording: RefCell<Recording>,
}

/// A number on a [`Tape`], or a known one that is on none yet.
#[derive(Clone, Copy)]
pub struct Variable<'t> {
    place: Place<'t>,
}

#[derive(Clone, Copy)]
enum Place<'t> {
    Known(f64),
    Recorded(&'t Tape, u32),
}

impl Tape {
    /// The input with this index.
    pub fn input(&self, index: u32) -> Variable<'_> {
        self.record(Operation::Input(index))
    }

    /// Operations recorded so far, each after those that it names.
    pub fn operations(&self) -> Vec<Operation> {
        self.recording.borrow().operations.clone()
    }

    /// Where `variable` stands on this tape; a known number is written down now.
    pub fn index_of(&self, variable: Variable<'_>) -> u32 {
        match variable.place {
            Place::Known(value) => self.index(Operation::Constant(value.to_bits())),
            Place::Recorded(_, index) => index,
        }
    }

    fn index(&self, operation: Operation) -> u32 {
        let mut recording = self.recording.borrow_mut();
        if let Some(&index) = recording.known.get(&operation) {
            return index;
        }
        let index = recording.operations.len() as u32;
        recording.operations.push(operation);
        recording.known.insert(operation, index);
        index
    }

    fn record(&self, operation: Operation) -> Variable<'_> {
        Variable {
            place: Place::Recorded(self, self.index(operation)),
        }
    }
}

impl<'t> Variable<'t> {
    fn known(self) -> Option<f64> {
        match self.place {
            Place::Known(value) => Some(value),
            Place::Recorded(..) => None,
        }
    }

    fn tape(self) -> Option<&'t Tape> {
        match self.place {
            Place::Known(_) => None,
            Place::Recorded(tape, _) => Some(tape),
        }
    }

    fn unary(self, fold: fn(f64) -> f64, operation: fn(u32) -> Operation) -> Self {
        match self.place {
            Place::Known(value) => Self::constant(fold(value)),
            Place::Recorded(tape, index) => tape.record(operation(index)),
        }
    }

    fn binary(
        self,
        other: Self,
        fold: fn(f64, f64) -> f64,
        operation: fn(u32, u32) -> Operation,
    ) -> Self {
        match (self.place, other.place) {
            (Place::Known(a), Place::Known(b)) => Self::constant(fold(a, b)),
            _ => match self.tape().or(other.tape()) {
                Some(tape) => tape.record(operation(tape.index_of(self), tape.index_of(other))),
                None => self,
            },
        }
    }
}

/// Order of a commutative pair, so that `a + b` and `b + a` are one operation.
fn ordered(operation: fn(u32, u32) -> Operation, a: u32, b: u32) -> Operation {
    operation(a.min(b), a.max(b))
}

impl Add for Variable<'_> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        if self.known() == Some(0.0) {
            return other;
        }
        if other.known() == Some(0.0) {
            return self;
        }
        self.binary(other, |a, b| a + b, |a, b| ordered(Operation::Add, a, b))
    }
}

impl Sub for Variable<'_> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        if other.known() == Some(0.0) {
            return self;
        }
        if self.known() == Some(0.0) {
            return -other;
        }
        self.binary(other, |a, b| a - b, Operation::Sub)
    }
}

impl Mul for Variable<'_> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        for (one, rest) in [(self, other), (other, self)] {
            match one.known() {
                Some(0.0) => return Self::constant(0.0),
                Some(1.0) => return rest,
                Some(-1.0) => return -rest,
                _ => {}
            }
        }
        self.binary(other, |a, b| a * b, |a, b| ordered(Operation::Mul, a, b))
    }
}

impl Div for Variable<'_> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        if self.known() == Some(0.0) {
            return self;
        }
        if let Some(value) = other.known() {
            return self * Self::constant(1.0 / value);
        }
        self.binary(other, |a, b| a / b, Operation::Div)
    }
}

impl Neg for Variable<'_> {
    type Output = Self;
    fn neg(self) -> Self {
        self.unary(|a| -a, Operation::Neg)
    }
}

impl Scalar for Variable<'_> {
    fn constant(value: f64) -> Self {
        Self {
            place: Place::Known(value),
        }
    }
    fn sqrt(self) -> Self {
        self.unary(f64::sqrt, Operation::Sqrt)
    }
    fn exp(self) -> Self {
        self.unary(f64::exp, Operation::Exp)
    }
    fn exp_m1(self) -> Self {
        self.unary(f64::exp_m1, Operation::ExpM1)
    }
    fn ln(self) -> Self {
        self.unary(f64::ln, Operation::Ln)
    }
    fn sin_cos(self) -> (Self, Self) {
        (
            self.unary(f64::sin, Operation::Sin),
            self.unary(f64::cos, Operation::Cos),
        )
    }
    fn tanh(self) -> Self {
        self.unary(f64::tanh, Operation::Tanh)
    }
    fn atan2(self, x: Self) -> Self {
        self.binary(x, f64::atan2, Operation::Atan2)
    }
    fn max(self, other: Self) -> Self {
        self.binary(other, Scalar::max, Operation::Max)
    }
    fn min(self, other: Self) -> Self {
        self.binary(other, Scalar::min, Operation::Min)
    }
    fn wrap(self) -> Self {
        self.unary(Scalar::wrap, Operation::Wrap)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_operations_are_recorded_once() {
        let tape = Tape::default();
        let (a, b) = (tape.input(0), tape.input(1));
        let first = tape.index_of(a * b + a);
        let second = tape.index_of(a + b * a);
        assert_eq!(first, second);
        assert_eq!(tape.operations().len(), 4);
    }

    #[test]
    fn structural_zeros_and_ones_vanish() {
        let tape = Tape::default();
        let a = tape.input(0);
        let (zero, one) = (Variable::constant(0.0), Variable::constant(1.0));
        let sum = a * zero + one * a + zero - zero / a;
        assert_eq!(tape.index_of(sum), tape.index_of(a));
        assert_eq!(tape.operations(), vec![Operation::Input(0)]);
    }

    #[test]
    fn known_numbers_are_folded() {
        let tape = Tape::default();
        let two = Variable::constant(4.0).sqrt();
        let index = tape.index_of(two * Variable::constant(3.0));
        assert_eq!(
            tape.operations()[index as usize],
            Operation::Constant(6.0_f64.to_bits())
        );
    }
}
