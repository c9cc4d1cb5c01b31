//! Whole flights that were lost, as a sentence.

use crate::campaign::cell_summary::CellSummary;
use crate::method::Method;
use crate::plot::svg::escaped;

/// The methods that lost whole flights, with how many over all conditions.
pub fn lost(cells: &[CellSummary]) -> String {
    let mut sums: Vec<(Method, usize)> = Vec::new();
    for cell in cells.iter().filter(|cell| cell.flights_not_tracked > 0) {
        match sums.iter_mut().find(|(method, _)| *method == cell.method) {
            Some((_, sum)) => *sum += cell.flights_not_tracked,
            None => sums.push((cell.method, cell.flights_not_tracked)),
        }
    }
    if sums.is_empty() {
        return "none.".to_owned();
    }
    let one = |(method, sum): &(Method, usize)| format!("{} {sum}", escaped(method.label()));
    let all: Vec<String> = sums.iter().map(one).collect();
    format!("{} (all conditions together).", all.join(", "))
}
