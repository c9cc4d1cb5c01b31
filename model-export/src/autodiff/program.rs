//! Runs a recorded computation forwards and backwards over [`Lanes`].

use super::execution;
use super::lanes::{LANES, Lanes, ZERO};
use super::simplification::simplify;
use super::tape::{Operation, Tape, Variable};
use crate::kernel::Tier;

/// A straight-line computation from inputs to outputs, without the operations no output needs.
#[derive(Clone, Debug)]
pub struct Program {
    operations: Vec<Operation>,
    /// For every output, the operation that holds it.
    outputs: Vec<u32>,
    input_count: usize,
    tier: Tier,
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
        let (operations, outputs) = simplify(tape.operations(), &outputs);
        Self {
            operations,
            outputs,
            input_count,
            tier: Tier::detect(),
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
        execution::run_forward(self.tier, &self.operations, inputs, &mut workspace.values);
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
            for (sum, term) in adjoints[index as usize].iter_mut().zip(adjoint) {
                *sum += term;
            }
        }
        execution::run_backward(
            self.tier,
            &self.operations,
            values,
            adjoints,
            input_adjoints,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bnkf::scalar::Scalar;

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
                // The lanes' functions are the standard library's, the plain ones libm's: each within
                // a unit in the last place, of which a handful of operations make a few.
                let error = (output[lane] - expected).abs();
                assert!(
                    error <= 8.0 * f64::EPSILON * (1.0 + expected.abs()),
                    "{error:e}"
                );
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

    fn points() -> Vec<Lanes> {
        let x = core::array::from_fn(|lane| -0.83 + 0.117 * lane as f64);
        let y = core::array::from_fn(|lane| 0.91 - 0.093 * lane as f64);
        vec![x, y]
    }
}
