//! The firmware's recursive filter in f32 against the trainer's own step in f64, the twin that it
//! was trained with, over whole flights with gaps.

mod tolerance;
#[path = "untrained/recursive.rs"]
mod untrained;

use bnkf::blob::Blob;
use bnkf::call::Call;
use bnkf::measurement::Vectors;
use bnkf::network::Network;
use bnkf::recursive::parameters::Parameters;
use bnkf::recursive::population::Population;
use bnkf::recursive::schedule::OUTPUTS;
use bnkf::{Estimate, Measurement, Mode, Settings, Tracker};
use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::flights::generator::{GeneratorSettings, generate};
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
use bnkf_model_export::radar::sampling::{RadarSettings, sample_radar, time_us};
use bnkf_model_export::recursive::carry::Carry;
use bnkf_model_export::recursive::normalisation::Normalisation;
use bnkf_model_export::recursive::step::{Arrival, Weighing, advance, features_of};
use tolerance::RECURSIVE_TWIN;
use untrained::recursive_blob;

struct Twin<'a> {
    network: Network<'a>,
    carry: Option<Carry<f64>>,
}

impl Twin<'_> {
    /// The f64 step, fed with the same f32 measurement and the same integer network.
    fn step(&mut self, measurement: Option<&Measurement>, dt_s: f64) -> Carry<f64> {
        let vectors = measurement.map(|m| {
            let Vectors {
                measured,
                sigmas,
                present,
            } = Vectors::from(m);
            Vectors {
                measured: measured.map(f64::from),
                sigmas: sigmas.map(f64::from),
                present: present.map(f64::from),
            }
        });
        let next = match (&self.carry, vectors) {
            (None, Some(vectors)) => Carry::start(&vectors, &Population::PAPER),
            (None, None) => panic!("flights start with a measurement"),
            (Some(carry), vectors) => {
                let mut normalisation = Normalisation::IDENTITY;
                normalisation.gain.fill(0.25);
                let inputs = normalisation.apply(&features_of(carry, dt_s));
                let mut outputs = [0.0; OUTPUTS];
                self.network
                    .mean_pass(&inputs.map(|x| x as f32), &mut outputs);
                let arrival = Arrival {
                    dt_s,
                    measured: f64::from(u8::from(vectors.is_some())),
                    vectors: vectors.unwrap_or(Vectors::whole([0.0; 4], [1.0; 4])),
                };
                {
                    let outputs = outputs.map(f64::from);
                    advance(carry, &outputs, &arrival, &Parameters::PAPER, Weighing::All)
                }
            }
        };
        self.carry = Some(next);
        next
    }
}

fn flights() -> Vec<Flight> {
    generate(&GeneratorSettings {
        flights: 4,
        seed: 5,
        ..GeneratorSettings::default()
    })
    .expect("valid settings")
}

#[test]
fn single_precision_follows_the_double_precision_twin() {
    let bytes = recursive_blob(24);
    let blob = Blob::parse(&bytes).expect("valid blob");
    let (mut worst_shift, mut worst_variance, mut coasted) = (0.0_f64, 0.0_f64, 0);
    for flight in flights() {
        for level in NoiseLevel::ALL {
            let settings = RadarSettings::paper(level, NoiseTable::Radians, SamplingRate::HALF, 3);
            let readings = sample_radar(&flight, &settings);
            let mut tracker = Tracker::new(blob, Settings::of(&blob)).expect("valid settings");
            let network = Network::new(blob.networks().next().expect("one network"));
            let mut twin = Twin {
                network,
                carry: None,
            };
            let mut last_us = 0;
            for (sample, reading) in flight.samples.iter().zip(&readings) {
                let now_us = time_us(&flight, sample.time_s);
                let measurement = reading.as_ref().map(Measurement::from);
                let expected = twin.step(measurement.as_ref(), (now_us - last_us) as f64 * 1e-6);
                last_us = now_us;
                let call = Call::new(now_us, measurement);
                let estimate = call.answer(&mut tracker).expect("a step");
                assert_ne!(estimate.mode, Mode::Restarted);
                coasted += usize::from(estimate.mode == Mode::Coasting);
                let (shift, variance) = difference(&estimate, &expected);
                worst_shift = worst_shift.max(shift);
                worst_variance = worst_variance.max(variance);
            }
        }
    }
    println!("position {worst_shift:.1e} sigma, variance {worst_variance:.1e}");
    assert!(coasted > 500, "{coasted} steps were coasted");
    assert!(worst_shift < RECURSIVE_TWIN, "{worst_shift}");
    assert!(worst_variance < RECURSIVE_TWIN, "{worst_variance}");
}

/// Largest difference of a state in standard deviations, and of a variance relative to it.
fn difference(estimate: &Estimate, expected: &Carry<f64>) -> (f64, f64) {
    let motion = estimate.motion.expect("a recursive estimate");
    let state: Vec<f32> = [
        estimate.position_m,
        motion.velocity_mps,
        motion.acceleration_mps2,
    ]
    .into_iter()
    .flatten()
    .collect();
    let (mut shift, mut variance) = (0.0_f64, 0.0_f64);
    for i in 0..9 {
        let expected_variance = expected.covariance[i][i];
        let error = (f64::from(state[i]) - expected.state[i]).abs();
        shift = shift.max(error / expected_variance.sqrt());
        let error = (f64::from(motion.covariance[i][i]) - expected_variance).abs();
        variance = variance.max(error / expected_variance);
    }
    (shift, variance)
}
