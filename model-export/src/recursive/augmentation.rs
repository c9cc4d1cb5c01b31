//! New training flights from generated ones: other sizes, speeds, places, clocks and logs.

use super::elsewhere::Elsewhere;
use super::recorded_clock::recorded_clock;
use crate::flights::agile;
use crate::flights::flight::{Flight, Sample};
use crate::flights::volume::Volume;
use crate::radar::noise::NoiseSigmas;
use crate::random_source::RandomSource;
use serde::{Deserialize, Serialize};

/// How far flights are changed. Every flight is also turned, mirrored and moved at random.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Augmentation {
    /// Standard deviation of the logarithm of the size of a flight.
    pub ln_size_sigma: f64,
    /// Share of flights whose horizontal size is drawn evenly from one to `stretch_max` instead.
    pub stretch_share: f64,
    /// Largest stretch.
    pub stretch_max: f64,
    /// Standard deviation of the logarithm of the speed at which a flight is played.
    pub ln_speed_sigma: f64,
    /// Share of flights that look recorded: their clock jitters and stalls, and their velocity is
    /// the central difference of such positions.
    pub recorded_share: f64,
    /// Share of flights sampled at another rate than their own.
    pub other_rate_share: f64,
    /// Share of flights that are flown at the limits instead, under laws of their own.
    pub agile_share: f64,
    /// Share of flights that are played faster, up to `haste_max` times.
    pub haste_share: f64,
    /// Largest haste.
    pub haste_max: f64,
    /// Factor, 0 to 1, on the shares of agile and hasty flights under a blunt sensor ([`BLUNT_RANGE_RATE_MPS`]): a network
    /// that cannot tell them from others learns to be as unsure of all.
    #[serde(default = "whole", skip_serializing_if = "is_whole")]
    pub under_blunt: f64,
    /// Share of flights that are put anywhere around the radar, not only inside the volume.
    pub elsewhere_share: f64,
    /// Where that is.
    pub elsewhere: Elsewhere,
    /// Whether flights stay where they are, turned and mirrored about the radar.
    pub kept: bool,
    /// Standard deviations of the logarithms of horizontal distance and height that flights which stay are moved by
    /// all the same.
    #[serde(default, skip_serializing_if = "is_nothing")]
    pub kept_spread: [f64; 2],
}

/// Whether older recipes would not name it.
fn is_nothing(spread: &[f64; 2]) -> bool {
    *spread == [0.0; 2]
}

/// The factor of recipes that name none.
fn whole() -> f64 {
    1.0
}

fn is_whole(factor: &f64) -> bool {
    *factor == whole()
}

/// Sigma of the range-rate above which a sensor is blunt, m/s: between the paper's medium and high noise. It is of the
/// noise that was drawn, whether the sensor then measures a range-rate or not.
pub const BLUNT_RANGE_RATE_MPS: f64 = 0.3;

/// Fewest steps of a training flight.
const STEPS_MIN: usize = 40;

impl Augmentation {
    /// What the shipped model is trained with.
    pub const DEFAULT: Self = Self {
        ln_size_sigma: 0.25,
        stretch_share: 0.2,
        stretch_max: 3.0,
        ln_speed_sigma: 0.2,
        recorded_share: 0.3,
        other_rate_share: 0.1,
        agile_share: 0.16,
        haste_share: 0.1,
        haste_max: 4.0,
        under_blunt: 1.0,
        elsewhere_share: 0.12,
        elsewhere: Elsewhere {
            range_m: [6.0, 95.0],
            elevation_deg: [-80.0, 89.0],
        },
        kept: false,
        kept_spread: [0.0; 2],
    };

    /// What the training of the shipped model ended with: more that is fast, but for blunt sensors, less that is
    /// elsewhere.
    pub const END: Self = Self {
        agile_share: 0.2,
        haste_share: 0.3,
        under_blunt: 0.3,
        elsewhere_share: 0.07,
        ..Self::DEFAULT
    };

    /// Turned, mirrored and placed only.
    pub const STILL: Self = Self {
        ln_size_sigma: 0.0,
        stretch_share: 0.0,
        ln_speed_sigma: 0.0,
        recorded_share: 0.0,
        other_rate_share: 0.0,
        agile_share: 0.0,
        haste_share: 0.0,
        elsewhere_share: 0.0,
        ..Self::DEFAULT
    };

    /// Whether how flights are changed depends on what measures them.
    pub fn asks_for_noise(&self) -> bool {
        !is_whole(&self.under_blunt)
    }

    /// How flights that a sensor of this noise measures are changed.
    pub fn under(&self, noise: &NoiseSigmas) -> Self {
        let factor = if noise.range_rate_mps > BLUNT_RANGE_RATE_MPS {
            self.under_blunt
        } else {
            1.0
        };
        Self {
            agile_share: factor * self.agile_share,
            haste_share: factor * self.haste_share,
            ..*self
        }
    }

    /// Takes up to `steps` samples, `interval_s` apart, somewhere from `flight`.
    pub fn draw(
        &self,
        flight: &Flight,
        volume: &Volume,
        steps: usize,
        interval_s: f64,
        random: &mut RandomSource,
    ) -> Vec<Sample> {
        let interval_s = if random.chance(self.other_rate_share) {
            interval_s * [0.5, 2.0, 3.0][random.below(3)]
        } else {
            interval_s
        };
        let haste = if random.chance(self.haste_share) {
            random.uniform(1.0, self.haste_max)
        } else {
            1.0
        };
        let speed = (haste
            * (self.ln_speed_sigma * random.normal())
                .exp()
                .clamp(0.5, 2.0))
        .min(flight.duration_s() / (interval_s * (STEPS_MIN + 2) as f64));
        // A short flight gives fewer steps.
        let longest = (flight.duration_s() / (speed * interval_s)) as usize;
        let steps = steps.min(longest.saturating_sub(2)).max(STEPS_MIN);
        let wanted_s = interval_s * (steps + 2) as f64;
        let clock = if random.chance(self.recorded_share) {
            recorded_clock(steps + 2, random)
        } else {
            (0..steps + 2).map(|i| i as f64).collect()
        };
        let recorded = clock[steps + 1] != (steps + 1) as f64;
        let spare_s = (flight.duration_s() - speed * wanted_s).max(0.0);
        let first_s = random.uniform(0.0, spare_s) + 0.5 * speed * interval_s;
        let agile = random.chance(self.agile_share);
        let flown;
        let (flight, first_s, speed) = if agile {
            flown = Flight {
                name: flight.name.clone(),
                source: flight.source.clone(),
                samples: agile::fly(steps + 3, interval_s, random),
            };
            (&flown, 0.0, 1.0)
        } else {
            (flight, first_s, speed)
        };
        let mut samples: Vec<Sample> = clock
            .iter()
            .enumerate()
            .map(|(i, tick)| {
                let mut sample = flight.at(first_s + speed * interval_s * tick);
                sample.time_s = interval_s * i as f64;
                sample.velocity_mps = sample.velocity_mps.map(|v| v * speed);
                sample
            })
            .collect();
        self.reshape(&mut samples, !agile, volume, random);
        if recorded {
            difference(&mut samples);
        }
        // The first and the last sample only served as neighbours.
        samples.remove(0);
        samples.truncate(steps);
        let start_s = samples[0].time_s;
        for sample in &mut samples {
            sample.time_s -= start_s;
        }
        samples
    }

    /// Scales, mirrors, turns and moves, with velocities to match.
    fn reshape(
        &self,
        samples: &mut [Sample],
        scaled: bool,
        volume: &Volume,
        random: &mut RandomSource,
    ) {
        let mut size = (self.ln_size_sigma * random.normal()).exp().clamp(0.5, 2.0);
        if random.chance(self.stretch_share) {
            size = random.uniform(1.0, self.stretch_max);
        }
        if !scaled {
            size = 1.0;
        }
        let vertical = size.min(1.4);
        let (s, c) = random.uniform(0.0, core::f64::consts::TAU).sin_cos();
        let mirror = random.sign();
        let turned = |v: [f64; 3]| {
            let [x, y, z] = [size * v[0], size * mirror * v[1], vertical * v[2]];
            [c * x - s * y, s * x + c * y, z]
        };
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for sample in samples.iter_mut() {
            sample.position_m = turned(sample.position_m);
            sample.velocity_mps = turned(sample.velocity_mps);
            for axis in 0..3 {
                low[axis] = low[axis].min(sample.position_m[axis]);
                high[axis] = high[axis].max(sample.position_m[axis]);
            }
        }
        let half: [f64; 3] = core::array::from_fn(|axis| 0.5 * (high[axis] - low[axis]));
        let centre: [f64; 3] = core::array::from_fn(|axis| low[axis] + half[axis]);
        let target = if self.kept {
            self.near(centre, random)
        } else if random.chance(self.elsewhere_share) {
            self.elsewhere.draw(random)
        } else {
            place(half, volume, random)
        };
        for sample in samples.iter_mut() {
            for axis in 0..3 {
                sample.position_m[axis] += target[axis] - centre[axis];
            }
        }
    }

    /// A place as far from the radar and as high as this one, or nearly.
    fn near(&self, [x, y, z]: [f64; 3], random: &mut RandomSource) -> [f64; 3] {
        if is_nothing(&self.kept_spread) {
            return [x, y, z];
        }
        let [distance, height] = self
            .kept_spread
            .map(|sigma| (sigma * random.normal()).exp().clamp(0.5, 2.0));
        [distance * x, distance * y, height * z]
    }
}

/// A centre at which a flight of these half extents lies inside the volume, or nearly.
fn place(half: [f64; 3], volume: &Volume, random: &mut RandomSource) -> [f64; 3] {
    let reach = half[0].hypot(half[1]);
    let (lowest, highest) = (volume.height_m_min + half[2], volume.height_m_max - half[2]);
    let mut best = [
        volume.range_m_mean,
        0.0,
        lowest.max(0.5 * (lowest + highest)),
    ];
    for _ in 0..20 {
        let height = if lowest < highest {
            random.uniform(lowest, highest)
        } else {
            lowest
        };
        let range = volume.range_m_mean + volume.range_m_sd * random.normal();
        if range <= height {
            continue;
        }
        let horizontal = (range * range - height * height).sqrt();
        let (s, c) = random.uniform(0.0, core::f64::consts::TAU).sin_cos();
        best = [horizontal * c, horizontal * s, height];
        let nearest = (horizontal - reach).max(0.0).hypot(height - half[2]);
        let farthest = (horizontal + reach).hypot(height + half[2]);
        // Stretched flights need more room than the volume has.
        let slack = 0.25 * reach;
        if nearest > volume.range_m_min - slack && farthest < volume.range_m_max + slack {
            break;
        }
    }
    best
}

/// Velocities by central differences, as for a recorded flight.
fn difference(samples: &mut [Sample]) {
    let positions: Vec<[f64; 3]> = samples.iter().map(|sample| sample.position_m).collect();
    for i in 1..samples.len() - 1 {
        let span_s = samples[i + 1].time_s - samples[i - 1].time_s;
        for axis in 0..3 {
            samples[i].velocity_mps[axis] =
                (positions[i + 1][axis] - positions[i - 1][axis]) / span_s;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::noise::{NoiseLevel, NoiseTable};

    /// Twenty-four seconds of a level circle at 2 m/s.
    fn circle() -> Flight {
        let samples = (0..240)
            .map(|i| {
                let time_s = 0.1 * f64::from(i);
                let (s, c) = (0.4 * time_s).sin_cos();
                Sample {
                    time_s,
                    position_m: [5.0 * c, 5.0 * s, 12.0],
                    velocity_mps: [-2.0 * s, 2.0 * c, 0.0],
                }
            })
            .collect();
        Flight {
            name: "circle".to_owned(),
            source: "circle".to_owned(),
            samples,
        }
    }

    #[test]
    fn interpolation_follows_the_circle() {
        for i in 0..100 {
            let time_s = 3.0 + 0.0137 * f64::from(i);
            let sample = circle().at(time_s);
            let (s, c) = (0.4 * time_s).sin_cos();
            assert!((sample.position_m[0] - 5.0 * c).abs() < 1e-6);
            assert!((sample.velocity_mps[1] - 2.0 * c).abs() < 1e-4, "{i}");
            assert!((sample.velocity_mps[0] + 2.0 * s).abs() < 1e-4);
        }
    }

    #[test]
    fn blunt_sensors_meet_fewer_of_both_kinds() {
        let shares = |level: NoiseLevel| {
            let noise = level.sigmas(NoiseTable::Radians);
            let changed = Augmentation::END.under(&noise);
            [changed.agile_share, changed.haste_share]
        };
        assert_eq!(shares(NoiseLevel::Medium), [0.2, 0.3]);
        for (got, want) in shares(NoiseLevel::High).into_iter().zip([0.06, 0.09]) {
            assert!((got - want).abs() < 1e-12);
        }
    }

    #[test]
    fn drawn_flights_are_smooth_inside_and_differ() {
        let mut random = RandomSource::new(3, &[]);
        let mut stretched = 0;
        let inside = Augmentation {
            agile_share: 0.0,
            haste_share: 0.0,
            elsewhere_share: 0.0,
            ..Augmentation::DEFAULT
        };
        for _ in 0..200 {
            let samples = inside.draw(&circle(), &Volume::PAPER, 150, 0.1, &mut random);
            assert!((STEPS_MIN..=150).contains(&samples.len()));
            assert_eq!(samples[0].time_s, 0.0);
            for pair in samples.windows(3) {
                let dt = pair[2].time_s - pair[0].time_s;
                for axis in 0..3 {
                    let slope = (pair[2].position_m[axis] - pair[0].position_m[axis]) / dt;
                    // 6 m/s on a stretched circle turn by at most half a radian a step.
                    assert!((slope - pair[1].velocity_mps[axis]).abs() < 0.6);
                }
                assert!(pair[1].position_m[2] > 4.0);
            }
            let [x, y, _] = samples[0].velocity_mps;
            stretched += usize::from(x.hypot(y) > 4.0);
        }
        assert!((10..100).contains(&stretched), "{stretched}");
    }

    /// Shares are what they say: other places, other laws, haste; and nothing else is kept where it
    /// was.
    #[test]
    fn shares_are_drawn_as_often_as_they_say() {
        let mut random = RandomSource::new(6, &[]);
        let (mut low, mut fast) = (0, 0);
        for _ in 0..400 {
            let samples =
                Augmentation::DEFAULT.draw(&circle(), &Volume::PAPER, 150, 0.1, &mut random);
            let mean = samples.iter().map(|s| s.position_m[2]).sum::<f64>() / samples.len() as f64;
            low += usize::from(mean < 0.0);
            let speed = |s: &Sample| s.velocity_mps.iter().map(|v| v * v).sum::<f64>().sqrt();
            fast += usize::from(samples.iter().map(speed).fold(0.0, f64::max) > 8.0);
        }
        // An eighth goes anywhere, nearly half of it below the radar.
        assert!((9..40).contains(&low), "{low}");
        assert!((15..110).contains(&fast), "{fast}");
        let still = Augmentation {
            kept: true,
            ..Augmentation::STILL
        };
        for _ in 0..20 {
            let samples = still.draw(&circle(), &Volume::PAPER, 100, 0.1, &mut random);
            for sample in &samples {
                let [x, y, z] = sample.position_m;
                assert!((x.hypot(y) - 5.0).abs() < 1e-3 && (z - 12.0).abs() < 1e-9);
            }
        }
    }

    /// Distances and heights are spread by what they are told, and flights keep their shape.
    #[test]
    fn flights_that_stay_are_moved_a_little() {
        let mut far = circle();
        for sample in &mut far.samples {
            sample.position_m[0] += 40.0;
        }
        let near = Augmentation {
            kept: true,
            kept_spread: [0.1, 0.2],
            ..Augmentation::STILL
        };
        let mut random = RandomSource::new(7, &[]);
        let mut sums = [[0.0; 2]; 2];
        for _ in 0..400 {
            // A whole turn, whose mean is its centre.
            let samples = near.draw(&far, &Volume::PAPER, 157, 0.1, &mut random);
            let mean: [f64; 3] = core::array::from_fn(|axis| {
                samples.iter().map(|s| s.position_m[axis]).sum::<f64>() / samples.len() as f64
            });
            let logarithms = [(mean[0].hypot(mean[1]) / 40.0).ln(), (mean[2] / 12.0).ln()];
            for (sum, logarithm) in sums.iter_mut().zip(logarithms) {
                sum[0] += logarithm / 400.0;
                sum[1] += logarithm * logarithm / 400.0;
            }
            let radius = |s: &Sample| (s.position_m[0] - mean[0]).hypot(s.position_m[1] - mean[1]);
            assert!(samples.iter().all(|s| (radius(s) - 5.0).abs() < 0.3));
        }
        for (sum, sigma) in sums.iter().zip([0.1, 0.2]) {
            assert!(sum[0].abs() < 0.03, "{sums:?}");
            assert!((sum[1].sqrt() / sigma - 1.0).abs() < 0.15, "{sums:?}");
        }
    }
}
