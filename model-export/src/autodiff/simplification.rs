//! Drops what no output needs and joins products with the sums that take them.

use super::tape::Operation;

/// Shortens a recording: the operations that `outputs` need, renumbered, and the outputs' new
/// numbers. Every value keeps its bits.
pub fn simplify(mut operations: Vec<Operation>, outputs: &[u32]) -> (Vec<Operation>, Vec<u32>) {
    let uses = count_uses(&operations, outputs);
    for i in 0..operations.len() {
        operations[i] = joined(operations[i], &operations, &uses);
    }
    // Products that were joined have no use left.
    let uses = count_uses(&operations, outputs);
    let mut renumbered = vec![0_u32; operations.len()];
    let mut kept = Vec::new();
    for (i, &operation) in operations.iter().enumerate() {
        if uses[i] > 0 {
            renumbered[i] = kept.len() as u32;
            kept.push(renamed(operation, |index| renumbered[index as usize]));
        }
    }
    let outputs = outputs.iter().map(|&o| renumbered[o as usize]).collect();
    (kept, outputs)
}

/// How often each operation is named by outputs and by operations that are used themselves.
fn count_uses(operations: &[Operation], outputs: &[u32]) -> Vec<u32> {
    let mut uses = vec![0; operations.len()];
    for &output in outputs {
        uses[output as usize] += 1;
    }
    for i in (0..operations.len()).rev() {
        if uses[i] > 0 {
            // Renaming visits every operand.
            renamed(operations[i], |operand| {
                uses[operand as usize] += 1;
                operand
            });
        }
    }
    uses
}

/// A sum with a product that nothing else needs becomes one operation.
fn joined(operation: Operation, operations: &[Operation], uses: &[u32]) -> Operation {
    use Operation as O;
    let own_product = |index: u32| match operations[index as usize] {
        O::Mul(a, b) if uses[index as usize] == 1 => Some((a, b)),
        _ => None,
    };
    match operation {
        O::Add(x, y) => match (own_product(x), own_product(y)) {
            (_, Some((a, b))) => O::AddProduct(a, b, x),
            (Some((a, b)), None) => O::AddProduct(a, b, y),
            (None, None) => operation,
        },
        O::Sub(x, y) => match own_product(y) {
            Some((a, b)) => O::SubProduct(a, b, x),
            None => operation,
        },
        _ => operation,
    }
}

fn renamed(operation: Operation, mut to: impl FnMut(u32) -> u32) -> Operation {
    use Operation as O;
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
        O::AddProduct(a, b, c) => O::AddProduct(to(a), to(b), to(c)),
        O::SubProduct(a, b, c) => O::SubProduct(to(a), to(b), to(c)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_output_needs_is_dropped() {
        use Operation as O;
        let recorded = vec![
            O::Input(0),
            O::Input(1),
            O::Sin(1),
            O::Mul(0, 0),
            O::Add(0, 1),
        ];
        let (kept, outputs) = simplify(recorded, &[4, 0]);
        assert_eq!(kept, [O::Input(0), O::Input(1), O::Add(0, 1)]);
        assert_eq!(outputs, [2, 0]);
    }

    #[test]
    fn a_product_joins_its_only_sum() {
        use Operation as O;
        let recorded = vec![O::Input(0), O::Input(1), O::Mul(0, 1), O::Sub(0, 2)];
        let (kept, outputs) = simplify(recorded.clone(), &[3]);
        assert_eq!(kept, [O::Input(0), O::Input(1), O::SubProduct(0, 1, 0)]);
        assert_eq!(outputs, [2]);
        // A product that is an output itself stays.
        let (kept, _) = simplify(recorded.clone(), &[3, 2]);
        assert_eq!(kept, recorded);
    }
}
