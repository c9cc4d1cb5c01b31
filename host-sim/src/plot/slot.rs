//! The time that a sample stands for in a picture: half an interval to both sides.

/// From when to when each of `times_s` stands, s.
pub fn slots(times_s: &[f64]) -> impl Iterator<Item = (f64, f64)> {
    times_s.iter().enumerate().map(|(index, time_s)| {
        let before = index.checked_sub(1).map_or(*time_s, |i| times_s[i]);
        let after = times_s.get(index + 1).copied().unwrap_or(*time_s);
        (0.5 * (before + time_s), 0.5 * (time_s + after))
    })
}

/// The slots of samples that `(time, s; whether it counts)`, joined where they meet, s.
pub fn stretches(samples: impl Iterator<Item = (f64, bool)>) -> Vec<(f64, f64)> {
    let (times_s, counts): (Vec<f64>, Vec<bool>) = samples.unzip();
    let mut stretches = Vec::new();
    let mut before = false;
    for (slot, counts) in slots(&times_s).zip(counts) {
        match stretches.last_mut() {
            Some((_, end)) if counts && before => *end = slot.1,
            _ if counts => stretches.push(slot),
            _ => {}
        }
        before = counts;
    }
    stretches
}

#[cfg(test)]
mod tests {
    use super::stretches;

    #[test]
    fn what_follows_each_other_is_one_stretch() {
        let samples = |counts: [bool; 6]| (0..6).map(f64::from).zip(counts);
        let found = |counts| stretches(samples(counts));
        assert_eq!(found([false; 6]), []);
        assert_eq!(found([true; 6]), [(0.0, 5.0)]);
        let two = [true, false, false, true, true, false];
        assert_eq!(found(two), [(0.0, 0.5), (2.5, 4.5)]);
    }
}
