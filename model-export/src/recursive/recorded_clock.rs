//! When a recorder really took its samples.

use crate::random_source::RandomSource;

/// Instants, in sampling intervals, at which a recorder really took its samples.
///
/// Intervals alternate between longer and shorter, vary, and now and then nearly stall, some at
/// random, some because the recorder pauses regularly: what the log of a simulator under load looks
/// like. The clock lags behind by what it lost.
pub fn recorded_clock(ticks: usize, random: &mut RandomSource) -> Vec<f64> {
    let alternation = if random.chance(0.6) {
        random.uniform(0.0, 0.08)
    } else {
        0.0
    };
    let jitter = random.uniform(0.0, 0.04);
    let kind = random.unit();
    let stalls = if kind < 0.4 {
        random.uniform(0.02, 0.12)
    } else {
        0.0
    };
    let mut pauses = (kind > 0.6).then(|| Pauses::draw(random));
    let mut tick = 0.0;
    let mut clock = vec![tick];
    for i in 1..ticks {
        let mut advance = 1.0 + jitter * random.normal();
        advance += if i % 2 == 0 {
            alternation
        } else {
            -alternation
        };
        if random.chance(stalls) {
            advance *= random.uniform(0.05, 0.8);
        }
        if let Some(pauses) = &mut pauses {
            advance *= 1.0 - pauses.before(i as f64, random);
        }
        tick += advance.max(0.02);
        clock.push(tick);
    }
    clock
}

/// Regular pauses of a recorder. All in sampling intervals.
struct Pauses {
    period: f64,
    length: f64,
    start: f64,
}

impl Pauses {
    fn draw(random: &mut RandomSource) -> Self {
        let period = random.uniform(6.0, 30.0);
        Self {
            period,
            length: random.uniform(0.3, 1.2),
            start: random.uniform(0.0, period),
        }
    }

    /// The part of the interval that ends at `end` in which the recorder pauses. Intervals are
    /// asked for in order.
    fn before(&mut self, end: f64, random: &mut RandomSource) -> f64 {
        let resume = self.start + self.length;
        let part = (resume.min(end) - self.start.max(end - 1.0)).max(0.0);
        if resume <= end {
            self.start += self.period * (1.0 + 0.03 * random.normal()).clamp(0.9, 1.1);
        }
        part
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recorded_clock_runs_forward_and_lags() {
        let mut random = RandomSource::new(4, &[]);
        let mut lag = 0.0;
        for _ in 0..50 {
            let clock = recorded_clock(152, &mut random);
            assert!(clock.windows(2).all(|pair| pair[1] > pair[0]));
            lag += 151.0 - clock[151];
        }
        assert!(lag / 50.0 > 1.0);
    }

    #[test]
    fn pauses_come_regularly_and_last_as_drawn() {
        let mut random = RandomSource::new(5, &[]);
        let mut pauses = Pauses {
            period: 10.0,
            length: 0.8,
            start: 3.5,
        };
        let parts: Vec<f64> = (1..=400)
            .map(|end| pauses.before(f64::from(end), &mut random))
            .collect();
        assert!(parts.iter().all(|part| (0.0..0.8 + 1e-9).contains(part)));
        // The first lies in two intervals.
        assert!((parts[3] - 0.5).abs() < 1e-12 && (parts[4] - 0.3).abs() < 1e-12);
        let whole: f64 = parts.iter().sum();
        // Two pauses more or less: periods vary by 3 %, two of them in a sum of forty.
        assert!((whole - 0.8 * 40.0).abs() < 1.7, "{whole}");
    }
}
