//! Several opinions about the same track: passes of one network with sampled weights, or networks
//! that were trained apart. Where they disagree about the mean jerk, the filter doubts its motion.

use super::encounter::Encounter;
use super::model::RecursiveModel;
use super::normalisation::Normalisation;
use super::step::{Weighing, advance, features_of};
use crate::scoring::step_score::StepScore;
use bnkf::Inference;
use bnkf::blob::Blob;
use bnkf::network::monte_carlo::separate_moments;
use bnkf::network::repeats::Repeats;
use bnkf::network::{Network, Scratch, moments};
use bnkf::recursive::parameters::Parameters;
use bnkf::recursive::population::{Base, Population};
use bnkf::recursive::schedule::{
    JERK_NOISE_OUTPUT, JERK_OUTPUT, JERK_SCALE, NOTE_OUTPUT, OUTPUTS, Schedule,
};
use bnkf::rng::{Generator, seeded};

/// Networks that share one filter. Each keeps its own notes.
pub struct Committee<'b> {
    parameters: Parameters<f64>,
    members: Vec<Member<'b>>,
    inference: Inference,
}

struct Member<'b> {
    normalisation: Normalisation,
    network: Network<'b>,
}

/// Why blobs make no committee.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CommitteeError {
    /// No blobs at all.
    #[error("no blobs")]
    Empty,
    /// A blob of another kind.
    #[error("not a recursive blob")]
    OtherKind,
}

/// One step of a flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Followed {
    /// The estimated beside the true position.
    pub score: StepScore,
    /// Mean over axes of the variance of the mean jerk over opinions, (m/s^3)^2.
    pub jerk_variance: f64,
    /// What it adds to the scheduled density of the jerk noise, as a share of that.
    pub noise_share: f64,
}

impl<'b> Committee<'b> {
    /// A committee of the networks of `blobs`; the first one's parameters serve all.
    /// Every network's doubt about its weights is what `inference` says.
    ///
    /// # Errors
    /// See [`CommitteeError`].
    pub fn new(blobs: &[Blob<'b>], inference: Inference) -> Result<Self, CommitteeError> {
        let first = blobs.first().ok_or(CommitteeError::Empty)?;
        let (parameters, _) =
            RecursiveModel::surroundings(first).ok_or(CommitteeError::OtherKind)?;
        let mut members = Vec::new();
        for blob in blobs {
            let (_, normalisation) =
                RecursiveModel::surroundings(blob).ok_or(CommitteeError::OtherKind)?;
            members.extend(blob.networks().map(|view| Member {
                normalisation: normalisation.clone(),
                network: Network::new(view),
            }));
        }
        Ok(Self {
            parameters,
            members,
            inference,
        })
    }

    /// What is known before the first measurement.
    pub fn population(&self) -> &Population<f64> {
        &self.parameters.population
    }

    /// Follows a flight in the double-precision filter, which neither gates nor restarts. `seed` gives the sampled weights.
    pub fn follow(&self, encounter: &Encounter, seed: u64) -> Vec<Followed> {
        let mut carry = encounter.start;
        let mut notes = vec![carry.memory; self.members.len()];
        let mut sampler = Sampler {
            inference: self.inference,
            rng: seeded(seed),
            scratch: Scratch::new(),
        };
        let steps = encounter.arrivals.iter().zip(&encounter.truths_m);
        let follow = |(arrival, truth): (_, &[f64; 3])| {
            let arrival: &super::step::Arrival<f64> = arrival;
            let opinions: Vec<Opinion> = self
                .members
                .iter()
                .zip(&mut notes)
                .map(|(member, notes)| {
                    let mut own = carry;
                    own.memory.notes = notes.notes;
                    let list = features_of(&own, arrival.dt_s);
                    let inputs = member.normalisation.apply(&list).map(|x| x as f32);
                    let opinion = sampler.ask(&member.network, &inputs);
                    notes.noted(arrival.dt_s, &opinion.outputs[NOTE_OUTPUT..]);
                    opinion
                })
                .collect();
            let (outputs, doubt) = joined(&opinions, &self.parameters.base, arrival.dt_s);
            carry = advance(&carry, &outputs, arrival, &self.parameters, Weighing::All);
            Followed {
                score: carry.score(*truth),
                jerk_variance: doubt.jerk_variance,
                noise_share: doubt.noise_share,
            }
        };
        steps.map(follow).collect()
    }
}

/// How a network is asked.
struct Sampler {
    inference: Inference,
    rng: Generator,
    scratch: Scratch,
}

/// A network's answer: means over its passes and variances of the mean jerk.
struct Opinion {
    outputs: [f64; OUTPUTS],
    jerk_variances: [f64; 3],
}

impl Sampler {
    fn ask(&mut self, network: &Network<'_>, inputs: &[f32]) -> Opinion {
        let (mut outputs, mut variances) = ([0.0_f32; OUTPUTS], [0.0_f32; OUTPUTS]);
        match self.inference {
            Inference::Mean => network.mean_pass(inputs, &mut outputs),
            Inference::Passes(passes) => {
                (outputs, variances) = separate_moments(
                    network,
                    inputs,
                    passes.count(),
                    passes.spread(),
                    &mut self.rng,
                    &mut self.scratch,
                );
            }
            Inference::Moments => {
                let (scratch, repeats) = (&mut self.scratch, &Repeats::NONE);
                let covariance: [[f32; 3]; 3] =
                    moments::outputs(network, repeats, inputs, &mut outputs, JERK_OUTPUT, scratch);
                for (axis, row) in covariance.iter().enumerate() {
                    variances[JERK_OUTPUT + axis] = row[axis];
                }
            }
        }
        Opinion {
            outputs: outputs.map(f64::from),
            jerk_variances: core::array::from_fn(|axis| {
                JERK_SCALE * JERK_SCALE * f64::from(variances[JERK_OUTPUT + axis])
            }),
        }
    }
}

/// How much opinions differ.
struct Doubt {
    jerk_variance: f64,
    noise_share: f64,
}

/// The mean answer, its jerk noise raised by what opinions differ in.
fn joined(opinions: &[Opinion], base: &Base<f64>, dt_s: f64) -> ([f64; OUTPUTS], Doubt) {
    let count = opinions.len() as f64;
    let mean = |value: &dyn Fn(&Opinion) -> f64| opinions.iter().map(value).sum::<f64>() / count;
    let mut outputs = [0.0; OUTPUTS];
    for (i, output) in outputs[..NOTE_OUTPUT].iter_mut().enumerate() {
        *output = mean(&|opinion| opinion.outputs[i]);
    }
    let scheduled = Schedule::read(&outputs, base).noise.jerk;
    let mut doubt = Doubt {
        jerk_variance: 0.0,
        noise_share: 0.0,
    };
    for axis in 0..3 {
        let jerk = outputs[JERK_OUTPUT + axis];
        let within = mean(&|opinion| opinion.jerk_variances[axis]);
        let between = if opinions.len() < 2 {
            0.0
        } else {
            let square = |opinion: &Opinion| {
                let apart = JERK_SCALE * (opinion.outputs[JERK_OUTPUT + axis] - jerk);
                apart * apart
            };
            mean(&square) * count / (count - 1.0)
        };
        let variance = within + between;
        let raised = scheduled[axis] + variance * dt_s;
        outputs[JERK_NOISE_OUTPUT + axis] = (raised / base.jerk_noise).ln();
        doubt.jerk_variance += variance / 3.0;
        doubt.noise_share += variance * dt_s / scheduled[axis] / 3.0;
    }
    (outputs, doubt)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flights::generator::{GeneratorSettings, generate};
    use crate::recursive::recipe::Recipe;
    use crate::recursive::scenario::Scenario;
    use crate::recursive::training::Training;

    fn blob(seed: u64) -> (Vec<u8>, Vec<Encounter>) {
        let settings = GeneratorSettings {
            flights: 3,
            ..GeneratorSettings::default()
        };
        let flights = generate(&settings).unwrap();
        let recipe = Recipe {
            seed,
            flights: 32,
            episodes: 2,
            ..Recipe::DEFAULT
        };
        let mut training = Training::new(recipe, &flights).unwrap();
        training.episode();
        training.episode();
        let model = training.model();
        let encounters =
            Scenario::Paper.cells(&flights, 1)[4].encounters(&model.parameters.population);
        (model.blob().unwrap(), encounters)
    }

    #[test]
    fn one_member_is_the_tracker_itself_and_twice_the_same_changes_nothing() {
        let (bytes, encounters) = blob(1);
        let own = Blob::parse(&bytes).unwrap();
        let alone = Committee::new(&[own], Inference::Mean).unwrap();
        let twins = Committee::new(&[own, own], Inference::Mean).unwrap();
        let (parameters, normalisation) = RecursiveModel::surroundings(&own).unwrap();
        assert_eq!(*alone.population(), parameters.population);
        for encounter in &encounters {
            let followed = alone.follow(encounter, 0);
            let mut carry = encounter.start;
            for (arrival, step) in encounter.arrivals.iter().zip(&followed) {
                let inputs = normalisation.apply(&features_of(&carry, arrival.dt_s));
                let mut outputs = [0.0; OUTPUTS];
                let network = Network::new(own.networks().next().unwrap());
                network.mean_pass(&inputs.map(|x| x as f32), &mut outputs);
                let outputs = outputs.map(f64::from);
                carry = advance(&carry, &outputs, arrival, &parameters, Weighing::All);
                assert_eq!(step.jerk_variance, 0.0);
            }
            let last = followed.last().unwrap();
            let truth = encounter.truths_m.last().unwrap();
            let squares = (0..3).map(|i| (carry.state[i] - truth[i]).powi(2));
            let expected = squares.sum::<f64>().sqrt();
            // The same f64 arithmetic but for ln(exp(x)) of the jerk noise.
            assert!((last.score.error_m - expected).abs() < 1e-6 * (1.0 + expected));
            let twin = twins.follow(encounter, 0);
            let other = twin.last().unwrap().score.error_m;
            assert!((last.score.error_m - other).abs() < 1e-6 * (1.0 + expected));
        }
    }

    #[test]
    fn members_that_differ_doubt() {
        let ((a, encounters), (b, _)) = (blob(1), blob(2));
        let blobs = [Blob::parse(&a).unwrap(), Blob::parse(&b).unwrap()];
        let pair = Committee::new(&blobs, Inference::Mean).unwrap();
        let sampled = Committee::new(&blobs[..1], Inference::of_passes(16).unwrap()).unwrap();
        let mean = |committee: &Committee<'_>| {
            let steps = committee.follow(&encounters[0], 3);
            assert!(steps.iter().all(|step| step.score.surprise().is_finite()));
            steps.iter().map(|step| step.noise_share).sum::<f64>() / steps.len() as f64
        };
        assert!(mean(&pair) > 0.0 && mean(&sampled) > 0.0);
    }

    #[test]
    fn the_spread_of_the_mean_jerk_is_added_to_its_noise() {
        let opinion = |jerk: f64, variance: f64| {
            let mut outputs = [0.0; OUTPUTS];
            outputs[JERK_OUTPUT] = jerk;
            Opinion {
                outputs,
                jerk_variances: [variance, 0.0, 0.0],
            }
        };
        let base = Base::DRONE;
        let noise = |opinions: &[Opinion]| {
            let (outputs, _) = joined(opinions, &base, 0.1);
            let schedule = Schedule::read(&outputs, &base);
            (schedule.jerk_mps3[0], schedule.noise.jerk)
        };
        let (jerk, alone) = noise(&[opinion(0.3, 0.0)]);
        assert!((jerk - 0.6).abs() < 1e-12);
        assert!(alone.iter().all(|q| (q - base.jerk_noise).abs() < 1e-12));
        // Jerks of 2 and 1 m/s^3: a variance of 1/2 between them, and 0.4 within each on average.
        let (jerk, two) = noise(&[opinion(1.0, 0.2), opinion(0.5, 0.6)]);
        assert!((jerk - 1.5).abs() < 1e-12);
        assert!(
            (two[0] - (base.jerk_noise + 0.9 * 0.1)).abs() < 1e-12,
            "{two:?}"
        );
        assert!((two[1] - base.jerk_noise).abs() < 1e-12);
    }

    #[test]
    fn no_blobs_and_other_kinds_are_refused() {
        assert_eq!(
            Committee::new(&[], Inference::Mean).err(),
            Some(CommitteeError::Empty)
        );
        let bytes =
            std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../models/bnkf.bnkf")).unwrap();
        let other = Blob::parse(&bytes).unwrap();
        assert_eq!(
            Committee::new(&[other], Inference::Mean).err(),
            Some(CommitteeError::OtherKind)
        );
    }
}
