//! What a run of the image is worth knowing: equality, memory, instructions.

use bnkf::Inference;
use bnkf::protocol::{BudgetFrame, Ready};

use crate::image::equality::{Comparison, Spread};

/// Equality, memory and instructions as lines of text. The image ran with `inference`, and its stack is at most
/// `stack_bound` bytes, if that can be told.
pub fn figures(
    comparison: &Comparison,
    ready: &Ready,
    budget: &BudgetFrame,
    stack_bound: Option<u32>,
    inference: Inference,
) -> String {
    let mut text = format!(
        "{} of {} estimates identical",
        comparison.identical, comparison.steps
    );
    if comparison.refused > 0 {
        text += &format!(" ({} of them refused alike)", comparison.refused);
    }
    let questions = [
        ("forecasts", &comparison.forecasts),
        ("likelihoods", &comparison.likelihoods),
    ];
    for (what, questions) in questions {
        text += &format!(
            "\n{} of {} {what} identical",
            questions.identical, questions.asked
        );
    }
    text += &format!(
        "\nflash         {} bytes, {} of them the blob\n\
         RAM           {} bytes: {} static, {} of stack at its deepest",
        grouped(budget.flash_bytes as usize),
        grouped(ready.blob_bytes as usize),
        grouped((budget.ram_static_bytes + budget.stack_bytes_max) as usize),
        grouped(budget.ram_static_bytes as usize),
        grouped(budget.stack_bytes_max as usize),
    );
    if let Some(bound) = stack_bound {
        text += &format!(" ({} by its code)", grouped(bound as usize));
    }
    text.push('\n');
    let rows = [
        (
            format!("estimate with {inference}"),
            &comparison.ticks_measured,
        ),
        ("estimate in a gap".to_owned(), &comparison.ticks_coasted),
        ("three forecasts".to_owned(), &comparison.forecasts.ticks),
        ("likelihood".to_owned(), &comparison.likelihoods.ticks),
    ];
    for (what, ticks) in rows {
        if let Some(spread) = Spread::of(ticks) {
            text += &format!(
                "instructions  per {what}: min {}, median {}, max {}\n",
                grouped(spread.min as usize),
                grouped(spread.median as usize),
                grouped(spread.max as usize),
            );
        }
    }
    text
}

/// A number with its thousands apart.
pub fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::question::Questions;

    #[test]
    fn thousands_are_apart() {
        let cases = [
            (0, "0"),
            (999, "999"),
            (1000, "1,000"),
            (1_234_567, "1,234,567"),
        ];
        for (number, text) in cases {
            assert_eq!(grouped(number), text);
        }
    }

    #[test]
    fn figures_are_complete() {
        let comparison = Comparison {
            steps: 4,
            identical: 3,
            refused: 1,
            first_difference: None,
            ticks_measured: vec![2000, 1000],
            ticks_coasted: vec![],
            forecasts: Questions {
                asked: 4,
                identical: 2,
                ticks: vec![3000],
            },
            likelihoods: Questions::default(),
        };
        let ready = Ready {
            protocol_version: 1,
            blob_bytes: 1740,
            blob_crc: 0,
        };
        let budget = BudgetFrame {
            flash_bytes: 60_000,
            ram_static_bytes: 3000,
            stack_bytes_max: 2500,
            stack_bytes_limit: 100_000,
        };
        let expected = "\
            3 of 4 estimates identical (1 of them refused alike)\n\
            2 of 4 forecasts identical\n\
            0 of 0 likelihoods identical\n\
            flash         60,000 bytes, 1,740 of them the blob\n\
            RAM           5,500 bytes: 3,000 static, 2,500 of stack at its deepest (2,600 by its code)\n\
            instructions  per estimate with 8 passes: min 1,000, median 1,000, max 2,000\n\
            instructions  per three forecasts: min 3,000, median 3,000, max 3,000\n";
        let eight = Inference::of_passes(8).unwrap();
        assert_eq!(
            figures(&comparison, &ready, &budget, Some(2600), eight),
            expected
        );
    }
}
