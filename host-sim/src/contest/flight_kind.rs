//! Flights of different kinds, for pictures that show one of each.

use bnkf_model_export::flights::flight::Flight;

/// Numbers of the flights that are the first of their kind: names without the trailing number that
/// the generator (`circle-0003`) and the cutting into segments (`log#2`) give.
pub fn first_of_each(flights: &[Flight]) -> Vec<usize> {
    let kind = |index: usize| {
        let name = flights[index].name.as_str();
        name.rsplit_once(['-', '#']).map_or(name, |(kind, _)| kind)
    };
    let mut chosen: Vec<usize> = Vec::new();
    for index in 0..flights.len() {
        if chosen.iter().all(|other| kind(*other) != kind(index)) {
            chosen.push(index);
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::flights::flight::Flight;

    use super::first_of_each;

    #[test]
    fn numbers_make_no_kind() {
        let rows = [0.0, 1.0, 2.0].map(|t| [t, 1.0 + t, 2.0, 3.0]);
        let names = [
            "circle-0000",
            "circle-0001",
            "log#0",
            "plain",
            "log#1",
            "eight-0004",
        ];
        let flights: Vec<Flight> = names
            .iter()
            .map(|name| Flight::from_track(name, "f", &rows).unwrap())
            .collect();
        assert_eq!(first_of_each(&flights), [0, 2, 3, 5]);
        assert!(first_of_each(&[]).is_empty());
    }
}
