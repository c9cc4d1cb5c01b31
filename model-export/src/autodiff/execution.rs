//! The two loops of a [`super::program::Program`], compiled for each instruction set.
//!
//! No multiply-add is fused, so every instruction set gives the bits of plain `f64`.

use super::lanes::{LANES, Lanes};
use super::tape::Operation;
use crate::kernel::tier::per_tier;
use bnkf::scalar::Scalar;

per_tier! {
    /// Fills `values`, one for every operation; constants must stand there already.
    fn run_forward(
        operations: &[Operation],
        inputs: &[Lanes],
        values: &mut [Lanes],
    ) => forward_body, forward_body, forward_body
}

per_tier! {
    /// Carries `adjoints`, one for every operation, back to the inputs.
    fn run_backward(
        operations: &[Operation],
        values: &[Lanes],
        adjoints: &mut [Lanes],
        input_adjoints: &mut [Lanes],
    ) => backward_body, backward_body, backward_body
}

#[inline(always)]
fn forward_body(operations: &[Operation], inputs: &[Lanes], values: &mut [Lanes]) {
    for (i, &operation) in operations.iter().enumerate() {
        let (done, rest) = values.split_at_mut(i);
        evaluate(operation, done, inputs, &mut rest[0]);
    }
}

#[inline(always)]
fn backward_body(
    operations: &[Operation],
    values: &[Lanes],
    adjoints: &mut [Lanes],
    input_adjoints: &mut [Lanes],
) {
    for (i, &operation) in operations.iter().enumerate().rev() {
        let (earlier, rest) = adjoints.split_at_mut(i);
        differentiate(operation, &rest[0], values, i, earlier, input_adjoints);
    }
}

#[inline(always)]
fn evaluate(operation: Operation, done: &[Lanes], inputs: &[Lanes], out: &mut Lanes) {
    use Operation as O;
    let at = |index: u32| &done[index as usize];
    match operation {
        O::Input(i) => *out = inputs[i as usize],
        // Written once, when the workspace was made.
        O::Constant(_) => {}
        O::Add(a, b) => map2(out, at(a), at(b), |a, b| a + b),
        O::Sub(a, b) => map2(out, at(a), at(b), |a, b| a - b),
        O::Mul(a, b) => map2(out, at(a), at(b), |a, b| a * b),
        O::Div(a, b) => map2(out, at(a), at(b), |a, b| a / b),
        O::Atan2(a, b) => map2(out, at(a), at(b), f64::atan2),
        O::Max(a, b) => map2(out, at(a), at(b), Scalar::max),
        O::Min(a, b) => map2(out, at(a), at(b), Scalar::min),
        O::Neg(a) => map(out, at(a), |a| -a),
        O::Sqrt(a) => map(out, at(a), f64::sqrt),
        O::Exp(a) => map(out, at(a), f64::exp),
        O::ExpM1(a) => map(out, at(a), f64::exp_m1),
        O::Ln(a) => map(out, at(a), f64::ln),
        O::Sin(a) => map(out, at(a), f64::sin),
        O::Cos(a) => map(out, at(a), f64::cos),
        O::Tanh(a) => map(out, at(a), f64::tanh),
        O::Wrap(a) => map(out, at(a), Scalar::wrap),
        O::AddProduct(a, b, c) => {
            let (a, b, c) = (at(a), at(b), at(c));
            for lane in 0..LANES {
                out[lane] = c[lane] + a[lane] * b[lane];
            }
        }
        O::SubProduct(a, b, c) => {
            let (a, b, c) = (at(a), at(b), at(c));
            for lane in 0..LANES {
                out[lane] = c[lane] - a[lane] * b[lane];
            }
        }
    }
}

#[inline(always)]
fn differentiate(
    operation: Operation,
    adjoint: &Lanes,
    values: &[Lanes],
    own: usize,
    earlier: &mut [Lanes],
    input_adjoints: &mut [Lanes],
) {
    use Operation as O;
    let at = |index: u32| &values[index as usize];
    let value = &values[own];
    match operation {
        O::Input(i) => add(&mut input_adjoints[i as usize], adjoint),
        O::Constant(_) => {}
        O::Add(a, b) => {
            add(&mut earlier[a as usize], adjoint);
            add(&mut earlier[b as usize], adjoint);
        }
        O::Sub(a, b) => {
            add(&mut earlier[a as usize], adjoint);
            subtract(&mut earlier[b as usize], adjoint);
        }
        O::Mul(a, b) => {
            add_product(&mut earlier[a as usize], adjoint, at(b));
            add_product(&mut earlier[b as usize], adjoint, at(a));
        }
        O::AddProduct(a, b, c) => {
            add(&mut earlier[c as usize], adjoint);
            add_product(&mut earlier[a as usize], adjoint, at(b));
            add_product(&mut earlier[b as usize], adjoint, at(a));
        }
        O::SubProduct(a, b, c) => {
            add(&mut earlier[c as usize], adjoint);
            subtract_product(&mut earlier[a as usize], adjoint, at(b));
            subtract_product(&mut earlier[b as usize], adjoint, at(a));
        }
        O::Neg(a) => subtract(&mut earlier[a as usize], adjoint),
        O::Wrap(a) => add(&mut earlier[a as usize], adjoint),
        O::Div(a, b) => {
            let divisor = at(b);
            pull(&mut earlier[a as usize], adjoint, |l| 1.0 / divisor[l]);
            pull(&mut earlier[b as usize], adjoint, |l| {
                -value[l] / divisor[l]
            });
        }
        O::Atan2(a, b) => {
            let (y, x) = (at(a), at(b));
            pull(&mut earlier[a as usize], adjoint, |l| {
                x[l] / (x[l] * x[l] + y[l] * y[l])
            });
            pull(&mut earlier[b as usize], adjoint, |l| {
                -y[l] / (x[l] * x[l] + y[l] * y[l])
            });
        }
        O::Max(a, b) => {
            let (p, q) = (at(a), at(b));
            pull(&mut earlier[a as usize], adjoint, |l| {
                f64::from(u8::from(p[l] > q[l]))
            });
            pull(&mut earlier[b as usize], adjoint, |l| {
                f64::from(u8::from(p[l] <= q[l]))
            });
        }
        O::Min(a, b) => {
            let (p, q) = (at(a), at(b));
            pull(&mut earlier[a as usize], adjoint, |l| {
                f64::from(u8::from(p[l] < q[l]))
            });
            pull(&mut earlier[b as usize], adjoint, |l| {
                f64::from(u8::from(p[l] >= q[l]))
            });
        }
        O::Sqrt(a) => pull(&mut earlier[a as usize], adjoint, |l| 0.5 / value[l]),
        O::Exp(a) => add_product(&mut earlier[a as usize], adjoint, value),
        O::ExpM1(a) => pull(&mut earlier[a as usize], adjoint, |l| value[l] + 1.0),
        O::Ln(a) => pull(&mut earlier[a as usize], adjoint, |l| 1.0 / at(a)[l]),
        O::Sin(a) => pull(&mut earlier[a as usize], adjoint, |l| at(a)[l].cos()),
        O::Cos(a) => pull(&mut earlier[a as usize], adjoint, |l| -at(a)[l].sin()),
        O::Tanh(a) => pull(&mut earlier[a as usize], adjoint, |l| {
            1.0 - value[l] * value[l]
        }),
    }
}

#[inline(always)]
fn map(out: &mut Lanes, a: &Lanes, f: impl Fn(f64) -> f64) {
    for lane in 0..LANES {
        out[lane] = f(a[lane]);
    }
}

#[inline(always)]
fn map2(out: &mut Lanes, a: &Lanes, b: &Lanes, f: impl Fn(f64, f64) -> f64) {
    for lane in 0..LANES {
        out[lane] = f(a[lane], b[lane]);
    }
}

#[inline(always)]
fn add(target: &mut Lanes, adjoint: &Lanes) {
    for lane in 0..LANES {
        target[lane] += adjoint[lane];
    }
}

#[inline(always)]
fn subtract(target: &mut Lanes, adjoint: &Lanes) {
    for lane in 0..LANES {
        target[lane] -= adjoint[lane];
    }
}

#[inline(always)]
fn add_product(target: &mut Lanes, adjoint: &Lanes, factor: &Lanes) {
    for lane in 0..LANES {
        target[lane] += adjoint[lane] * factor[lane];
    }
}

#[inline(always)]
fn pull(target: &mut Lanes, adjoint: &Lanes, weight: impl Fn(usize) -> f64) {
    for lane in 0..LANES {
        target[lane] += adjoint[lane] * weight(lane);
    }
}

#[inline(always)]
fn subtract_product(target: &mut Lanes, adjoint: &Lanes, factor: &Lanes) {
    for lane in 0..LANES {
        target[lane] -= adjoint[lane] * factor[lane];
    }
}
