//! Runs a recorded computation forwards and backwards over [`Lanes`].

use super::lanes::{LANES, Lanes, ZERO};
use super::scalar::Scalar;
use super::tape::{Operation, Tape, Variable};

/// A straight-line computation from inputs to outputs, without the operations no output needs.
#[derive(Clone, Debug)]
pub struct Program {
    operations: Vec<Operation>,
    /// For every output, the operation that holds it.
    outputs: Vec<u32>,
    input_count: usize,
}

/// The values and adjoints of every operation; made by [`Program::workspace`].
#[derive(Clone, Debug)]
pub struct Workspace {
    values: Vec<Lanes>,
    adjoints: Vec<Lanes>,
}

impl Program {
    /// Records `write`, which turns `input_count` inputs into outputs.
    pub fn record<F>(input_count: usize, write: F) -> Self
    where
        F: for<'t> FnOnce(&[Variable<'t>]) -> Vec<Variable<'t>>,
    {
        let tape = Tape::default();
        let inputs: Vec<Variable<'_>> = (0..input_count).map(|i| tape.input(i as u32)).collect();
        let outputs: Vec<u32> = write(&inputs)
            .into_iter()
            .map(|output| tape.index_of(output))
            .collect();
        let (operations, outputs) = prune(&tape.operations(), &outputs);
        Self {
            operations,
            outputs,
            input_count,
        }
    }

    /// Number of operations, inputs and constants included.
    pub fn len(&self) -> usize {
        self.operations.len()
    }

    /// Whether nothing is computed.
    pub fn is_empty(&self) -> bool {
        self.operations.is_empty()
    }

    /// Room for one execution.
    pub fn workspace(&self) -> Workspace {
        let values = self
            .operations
            .iter()
            .map(|operation| match operation {
                Operation::Constant(bits) => [f64::from_bits(*bits); LANES],
                _ => ZERO,
            })
            .collect();
        Workspace {
            values,
            adjoints: vec![ZERO; self.operations.len()],
        }
    }

    /// Computes every output from the inputs and keeps what [`Self::backward`] needs.
    ///
    /// # Panics
    /// When `inputs`, `outputs` or `workspace` are of another program's size.
    pub fn forward(&self, workspace: &mut Workspace, inputs: &[Lanes], outputs: &mut [Lanes]) {
        assert_eq!(inputs.len(), self.input_count);
        assert_eq!(outputs.len(), self.outputs.len());
        assert_eq!(workspace.values.len(), self.operations.len());
        for (i, &operation) in self.operations.iter().enumerate() {
            let (done, rest) = workspace.values.split_at_mut(i);
            evaluate(operation, done, inputs, &mut rest[0]);
        }
        for (output, &index) in outputs.iter_mut().zip(&self.outputs) {
            *output = workspace.values[index as usize];
        }
    }

    /// Turns adjoints of the outputs into adjoints of the inputs, for the values that the last
    /// [`Self::forward`] left in `workspace`.
    ///
    /// # Panics
    /// When the slices or `workspace` are of another program's size.
    pub fn backward(
        &self,
        workspace: &mut Workspace,
        output_adjoints: &[Lanes],
        input_adjoints: &mut [Lanes],
    ) {
        assert_eq!(input_adjoints.len(), self.input_count);
        assert_eq!(output_adjoints.len(), self.outputs.len());
        assert_eq!(workspace.values.len(), self.operations.len());
        let Workspace { values, adjoints } = workspace;
        adjoints.fill(ZERO);
        input_adjoints.fill(ZERO);
        for (adjoint, &index) in output_adjoints.iter().zip(&self.outputs) {
            add(&mut adjoints[index as usize], adjoint);
        }
        for (i, &operation) in self.operations.iter().enumerate().rev() {
            let (earlier, rest) = adjoints.split_at_mut(i);
            differentiate(operation, &rest[0], values, i, earlier, input_adjoints);
        }
    }
}

/// Keeps the operations that an output needs, renumbered.
fn prune(operations: &[Operation], outputs: &[u32]) -> (Vec<Operation>, Vec<u32>) {
    let mut needed = vec![false; operations.len()];
    for &output in outputs {
        needed[output as usize] = true;
    }
    for i in (0..operations.len()).rev() {
        if needed[i] {
            let (a, b) = operands(operations[i]);
            for operand in [a, b].into_iter().flatten() {
                needed[operand as usize] = true;
            }
        }
    }
    let mut renumbered = vec![0_u32; operations.len()];
    let mut kept = Vec::new();
    for (i, &operation) in operations.iter().enumerate() {
        if needed[i] {
            renumbered[i] = kept.len() as u32;
            kept.push(rename(operation, &renumbered));
        }
    }
    let outputs = outputs.iter().map(|&o| renumbered[o as usize]).collect();
    (kept, outputs)
}

fn operands(operation: Operation) -> (Option<u32>, Option<u32>) {
    use Operation as O;
    match operation {
        O::Input(_) | O::Constant(_) => (None, None),
        O::Add(a, b)
        | O::Sub(a, b)
        | O::Mul(a, b)
        | O::Div(a, b)
        | O::Atan2(a, b)
        | O::Max(a, b)
        | O::Min(a, b) => (Some(a), Some(b)),
        O::Neg(a)
        | O::Sqrt(a)
        | O::Exp(a)
        | O::ExpM1(a)
        | O::Ln(a)
        | O::Sin(a)
        | O::Cos(a)
        | O::Tanh(a)
        | O::Wrap(a) => (Some(a), None),
    }
}

fn rename(operation: Operation, renumbered: &[u32]) -> Operation {
    use Operation as O;
    let to = |index: u32| renumbered[index as usize];
    match operation {
        O::Input(_) | O::Constant(_) => operation,
        O::Add(a, b) => O::Add(to(a), to(b)),
        O::Sub(a, b) => O::Sub(to(a), to(b)),
        O::Mul(a, b) => O::Mul(to(a), to(b)),
        O::Div(a, b) => O::Div(to(a), to(b)),
        O::Neg(a) => O::Neg(to(a)),
        O::Sqrt(a) => O::Sqrt(to(a)),
        O::Exp(a) => O::Exp(to(a)),
        O::ExpM1(a) => O::ExpM1(to(a)),
        O::Ln(a) => O::Ln(to(a)),
        O::Sin(a) => O::Sin(to(a)),
        O::Cos(a) => O::Cos(to(a)),
        O::Tanh(a) => O::Tanh(to(a)),
        O::Atan2(a, b) => O::Atan2(to(a), to(b)),
        O::Max(a, b) => O::Max(to(a), to(b)),
        O::Min(a, b) => O::Min(to(a), to(b)),
        O::Wrap(a) => O::Wrap(to(a)),
    }
}

#[inline]
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
    }
}

#[inline]
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
    let mut pull = |index: u32, weight: &dyn Fn(usize) -> f64| {
        let target = &mut earlier[index as usize];
        for lane in 0..LANES {
            target[lane] += adjoint[lane] * weight(lane);
        }
    };
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
        O::Neg(a) => subtract(&mut earlier[a as usize], adjoint),
        O::Wrap(a) => add(&mut earlier[a as usize], adjoint),
        O::Div(a, b) => {
            let divisor = at(b);
            pull(a, &|l| 1.0 / divisor[l]);
            pull(b, &|l| -value[l] / divisor[l]);
        }
        O::Atan2(a, b) => {
            let (y, x) = (at(a), at(b));
            pull(a, &|l| x[l] / (x[l] * x[l] + y[l] * y[l]));
            pull(b, &|l| -y[l] / (x[l] * x[l] + y[l] * y[l]));
        }
        O::Max(a, b) => {
            let (p, q) = (at(a), at(b));
            pull(a, &|l| f64::from(u8::from(p[l] > q[l])));
            pull(b, &|l| f64::from(u8::from(p[l] <= q[l])));
        }
        O::Min(a, b) => {
            let (p, q) = (at(a), at(b));
            pull(a, &|l| f64::from(u8::from(p[l] < q[l])));
            pull(b, &|l| f64::from(u8::from(p[l] >= q[l])));
        }
        O::Sqrt(a) => pull(a, &|l| 0.5 / value[l]),
        O::Exp(a) => add_product(&mut earlier[a as usize], adjoint, value),
        O::ExpM1(a) => pull(a, &|l| value[l] + 1.0),
        O::Ln(a) => pull(a, &|l| 1.0 / at(a)[l]),
        O::Sin(a) => pull(a, &|l| at(a)[l].cos()),
        O::Cos(a) => pull(a, &|l| -at(a)[l].sin()),
        O::Tanh(a) => pull(a, &|l| 1.0 - value[l] * value[l]),
    }
}

#[inline]
fn map(out: &mut Lanes, a: &Lanes, f: impl Fn(f64) -> f64) {
    for lane in 0..LANES {
        out[lane] = f(a[lane]);
    }
}

#[inline]
fn map2(out: &mut Lanes, a: &Lanes, b: &Lanes, f: impl Fn(f64, f64) -> f64) {
    for lane in 0..LANES {
        out[lane] = f(a[lane], b[lane]);
    }
}

#[inline]
fn add(target: &mut Lanes, adjoint: &Lanes) {
    for lane in 0..LANES {
        target[lane] += adjoint[lane];
    }
}

#[inline]
fn subtract(target: &mut Lanes, adjoint: &Lanes) {
    for lane in 0..LANES {
        target[lane] -= adjoint[lane];
    }
}

#[inline]
fn add_product(target: &mut Lanes, adjoint: &Lanes, factor: &Lanes) {
    for lane in 0..LANES {
        target[lane] += adjoint[lane] * factor[lane];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn every_operation<S: Scalar>(x: S, y: S) -> [S; 5] {
        let c = S::constant;
        let p = (x * y + c(0.3)).sin() / (y * y + c(1.0)) - (x - y).cos().exp();
        let q = (x * x + c(0.5)).sqrt().ln() + (-y).exp_m1() + y.atan2(x) + (x * c(9.0)).wrap();
        let r = x.max(y) * c(2.0) + (x * c(3.0)).min(y) + (x + y).clamp(-0.4, 0.4);
        [p, q, r, p.tanh() * q, (q + r).softplus()]
    }

    #[test]
    fn lanes_equal_plain_numbers() {
        let program = Program::record(2, |v| every_operation(v[0], v[1]).to_vec());
        let inputs = points();
        let mut workspace = program.workspace();
        let mut outputs = vec![ZERO; 5];
        program.forward(&mut workspace, &inputs, &mut outputs);
        for lane in 0..LANES {
            let expected = every_operation(inputs[0][lane], inputs[1][lane]);
            for (output, expected) in outputs.iter().zip(expected) {
                assert_eq!(output[lane], expected);
            }
        }
    }

    #[test]
    fn adjoints_equal_central_differences() {
        let program = Program::record(2, |v| every_operation(v[0], v[1]).to_vec());
        let inputs = points();
        let mut workspace = program.workspace();
        let mut outputs = vec![ZERO; 5];
        program.forward(&mut workspace, &inputs, &mut outputs);
        let seeds: Vec<Lanes> = (0..5).map(|i| [0.5 + 0.3 * f64::from(i); LANES]).collect();
        let mut adjoints = vec![ZERO; 2];
        program.backward(&mut workspace, &seeds, &mut adjoints);
        let total = |x: f64, y: f64| -> f64 {
            every_operation(x, y)
                .iter()
                .zip(&seeds)
                .map(|(value, seed)| value * seed[0])
                .sum()
        };
        let h = 1e-6;
        for lane in 0..LANES {
            let (x, y) = (inputs[0][lane], inputs[1][lane]);
            let by_x = (total(x + h, y) - total(x - h, y)) / (2.0 * h);
            let by_y = (total(x, y + h) - total(x, y - h)) / (2.0 * h);
            assert!((adjoints[0][lane] - by_x).abs() < 1e-7 * (1.0 + by_x.abs()));
            assert!((adjoints[1][lane] - by_y).abs() < 1e-7 * (1.0 + by_y.abs()));
        }
    }

    #[test]
    fn what_no_output_needs_is_dropped() {
        let program = Program::record(3, |v| vec![v[0] + v[1]]);
        assert_eq!(program.len(), 3);
        assert!(!program.is_empty());
    }

    fn points() -> Vec<Lanes> {
        let x = core::array::from_fn(|lane| -0.83 + 0.117 * lane as f64);
        let y = core::array::from_fn(|lane| 0.91 - 0.093 * lane as f64);
        vec![x, y]
    }
}
