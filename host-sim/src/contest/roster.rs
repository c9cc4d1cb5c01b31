//! Which methods run, and with which models.

use bnkf::blob::{Blob, Kind as BlobKind};
use bnkf::{
    Correction as TrackerCorrection, Inference, PassesError, Settings, Tracker, TrackerError,
};
use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};
use bnkf_model_export::radar::reading::Reading;
use bnkf_model_export::seed;

use crate::baseline::correction::Correction;
use crate::baseline::gated::Gated;
use crate::baseline::imm::Imm;
use crate::baseline::kalman::Kalman;
use crate::baseline::late::Late;
use crate::baseline::memoryless::{Memoryless, Rule};
use crate::baseline::rao_blackwell::RaoBlackwell;
use crate::baseline::sigma_points::Spread;
use crate::baseline::tuning::Tuning;
use crate::contest::forecast::track_ahead;
use crate::contest::model::Model;
use crate::contest::own_filter::OwnFilter;
use crate::contest::track::{TrackStep, track};
use crate::contest::tracker_filter::TrackerFilter;
use crate::contest::tunings::Tunings;
use crate::filter::Filter;
use crate::method::Method;
use crate::scenario::radar::Condition;
use crate::scoring::forecast::ScoredForecast;

/// The methods under test with what they need.
#[derive(Clone, Debug)]
pub struct Roster<'a> {
    entries: Vec<(Method, Recipe<'a>)>,
}

/// How a filter is made.
#[derive(Clone, Copy, Debug)]
enum Recipe<'a> {
    PaperEkf,
    PaperUkf,
    Tracker(Blob<'a>, Settings),
    Tuned(&'a Tunings, Kind),
    Own(&'a OwnFilter),
}

/// A filter that needs a tuning.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Kalman(Correction),
    Imm5,
    Imm10,
    Particle,
    Rule(Rule),
}

/// What methods are made from.
#[derive(Clone, Copy, Debug, Default)]
pub struct Supplies<'a> {
    /// Blobs; of several with the same kind and number of networks the last is used.
    pub models: &'a [Model],
    /// Monte Carlo passes, if not the models' own number.
    pub passes: Option<u16>,
    /// Parameters of the tuned baselines.
    pub tunings: Option<&'a Tunings>,
    /// The recursive blob that was tuned.
    pub tuned: Option<&'a Model>,
    /// Methods from outside.
    pub own: &'a [OwnFilter],
}

/// Why a roster cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RosterError {
    /// No model has the kind and the number of networks that the method needs.
    #[error("method {method}: no {kind:?} model with {networks} network(s) was given")]
    NoModel {
        /// The method.
        method: Method,
        /// Kind it needs.
        kind: BlobKind,
        /// Networks it needs.
        networks: usize,
    },
    /// The settings do not fit the model.
    #[error("method {method}: {cause}")]
    Settings {
        /// The method.
        method: Method,
        /// What the tracker said.
        cause: TrackerError,
    },
    /// The number of passes is out of range.
    #[error("method {method}: {cause}")]
    Passes {
        /// The method.
        method: Method,
        /// The number.
        cause: PassesError,
    },
    /// A method from outside that nobody brought.
    #[error("method {0} is not built in, and none of that name was given")]
    NoOwn(Method),
    /// The method needs training flights.
    #[error("method {0}: nothing was tuned; it needs --folds")]
    NoTuning(Method),
}

impl<'a> Roster<'a> {
    /// Finds what each of `methods` needs among `supplies`.
    ///
    /// # Errors
    /// A method lacks its model or tuning, or the number of passes is out of range.
    pub fn new(methods: &[Method], supplies: Supplies<'a>) -> Result<Self, RosterError> {
        let runs = |method: Method, blob: Blob<'a>, correction| {
            let own = Settings::of(&blob);
            let asked = supplies.passes.map(Inference::of_passes).transpose();
            let asked = asked.map_err(|cause| RosterError::Passes { method, cause })?;
            let inference = if method.takes_moments() {
                Inference::Moments
            } else {
                asked.unwrap_or(own.inference)
            };
            let settings = Settings {
                correction,
                inference,
                ..own
            };
            Tracker::new(blob, settings)
                .map_err(|cause| RosterError::Settings { method, cause })?;
            Ok(Recipe::Tracker(blob, settings))
        };
        let tracker = |method, kind, networks, correction| {
            let blobs = supplies.models.iter().rev().map(Model::blob);
            let found = blobs
                .into_iter()
                .find(|blob| blob.kind() == kind && blob.network_count() == networks);
            let blob = found.ok_or(RosterError::NoModel {
                method,
                kind,
                networks,
            })?;
            runs(method, blob, correction)
        };
        let memoryless = |method, networks, correction| {
            tracker(method, BlobKind::Memoryless, networks, correction)
        };
        let tuned = |method, kind| {
            let tunings = supplies.tunings.ok_or(RosterError::NoTuning(method))?;
            Ok(Recipe::Tuned(tunings, kind))
        };
        let recipe = |method| match method {
            Method::Ekf => Ok(Recipe::PaperEkf),
            Method::Ukf => Ok(Recipe::PaperUkf),
            Method::Bnn => memoryless(method, 1, TrackerCorrection::None),
            Method::Bnkf | Method::BnkfMoments => {
                memoryless(method, 1, TrackerCorrection::Converted)
            }
            Method::Bnkfe | Method::BnkfeMoments => {
                memoryless(method, 3, TrackerCorrection::Converted)
            }
            Method::Recursive | Method::RecursiveMoments => {
                tracker(method, BlobKind::Recursive, 1, TrackerCorrection::Polar)
            }
            Method::RecursiveTuned => {
                let model = supplies.tuned.ok_or(RosterError::NoTuning(method))?;
                runs(method, model.blob(), TrackerCorrection::Polar)
            }
            Method::EkfTuned => tuned(method, Kind::Kalman(Correction::Extended)),
            Method::UkfTuned => tuned(method, Kind::Kalman(Correction::SigmaPoints(Spread::UNIT))),
            Method::CkfTuned => tuned(
                method,
                Kind::Kalman(Correction::SigmaPoints(Spread::CUBATURE)),
            ),
            Method::Imm5 => tuned(method, Kind::Imm5),
            Method::Imm10 => tuned(method, Kind::Imm10),
            Method::Particle => tuned(method, Kind::Particle),
            Method::Converted => tuned(method, Kind::Rule(Rule::Converted)),
            Method::PopulationMean => tuned(method, Kind::Rule(Rule::PopulationMean)),
            Method::ConstantRange => tuned(method, Kind::Rule(Rule::ConstantRange)),
            Method::Fused => tuned(method, Kind::Rule(Rule::Fused)),
            Method::Own(_) => {
                let found = supplies.own.iter().find(|own| own.method() == method);
                found.map(Recipe::Own).ok_or(RosterError::NoOwn(method))
            }
        };
        let entries = methods.iter().map(|method| Ok((*method, recipe(*method)?)));
        Ok(Self {
            entries: entries.collect::<Result<_, _>>()?,
        })
    }

    /// The methods in their order.
    pub fn methods(&self) -> impl Iterator<Item = Method> {
        self.entries.iter().map(|(method, _)| *method)
    }

    /// Every method over one flight. Depends on nothing but the flight, its readings, the condition
    /// and the seed, so neither order nor threads show in the results.
    pub fn tracks(
        &self,
        flight: &Flight,
        readings: &[Option<Reading>],
        condition: Condition,
        seed: u64,
    ) -> Vec<(Method, Vec<TrackStep>)> {
        self.flight_filters(flight, condition, seed)
            .into_iter()
            .map(|(method, mut filter)| (method, track(filter.as_mut(), flight, readings)))
            .collect()
    }

    /// The same with every method's forecasts on the way, which change no track.
    pub fn tracks_ahead(
        &self,
        flight: &Flight,
        readings: &[Option<Reading>],
        condition: Condition,
        seed: u64,
    ) -> Vec<(Method, Vec<TrackStep>, Vec<ScoredForecast>)> {
        self.flight_filters(flight, condition, seed)
            .into_iter()
            .zip(&self.entries)
            .map(|((method, mut filter), (_, recipe))| {
                let filter = filter.as_mut();
                let (steps, forecasts) = match recipe {
                    Recipe::Own(own) if !own.has_forecasts() => {
                        (track(filter, flight, readings), Vec::new())
                    }
                    _ => track_ahead(filter, flight, readings),
                };
                (method, steps, forecasts)
            })
            .collect()
    }

    fn flight_filters(
        &self,
        flight: &Flight,
        condition: Condition,
        seed: u64,
    ) -> Vec<(Method, Box<dyn Filter + 'a>)> {
        let ids = [
            seed::name_id("tracker"),
            seed::name_id(&flight.name),
            condition.table as u64,
            condition.noise as u64,
            condition.rate.get().to_bits(),
        ];
        self.filters(flight, condition, seed::derive(seed, &ids))
    }

    /// Fresh filters for `flight` under `condition`, one per method; `seed` starts the random streams of
    /// those that draw.
    ///
    /// # Panics
    /// If a tuned method was not tuned for the condition's noise.
    pub fn filters(
        &self,
        flight: &Flight,
        condition: Condition,
        seed: u64,
    ) -> Vec<(Method, Box<dyn Filter + 'a>)> {
        let filter = |recipe: &Recipe<'a>| -> Box<dyn Filter + 'a> {
            match *recipe {
                Recipe::PaperEkf => Box::new(Late::new(Kalman::paper_ekf())),
                Recipe::PaperUkf => Box::new(Late::new(Kalman::paper_ukf())),
                Recipe::Tracker(blob, settings) => {
                    let settings = Settings { seed, ..settings };
                    Box::new(TrackerFilter::new(blob, settings).expect("checked in Roster::new"))
                }
                Recipe::Tuned(tunings, kind) => {
                    kind.filter(tuning(tunings, condition.table, condition.noise), seed)
                }
                Recipe::Own(own) => own.filter(flight, condition, seed),
            }
        };
        self.entries
            .iter()
            .map(|(method, recipe)| (*method, filter(recipe)))
            .collect()
    }
}

fn tuning(tunings: &Tunings, table: NoiseTable, noise: NoiseLevel) -> &Tuning {
    tunings
        .find(table, noise)
        .expect("tuned for every condition that is evaluated")
}

impl Kind {
    fn filter(self, tuning: &Tuning, seed: u64) -> Box<dyn Filter> {
        let range_sigma_m = tuning.prior.range_m.sigma;
        match self {
            Self::Kalman(correction) => gated(tuning.kalman(correction), range_sigma_m),
            Self::Imm5 => gated(tuning.imm_five(), range_sigma_m),
            Self::Imm10 => gated(Imm::wide(tuning.origin()), range_sigma_m),
            Self::Particle => {
                let particles = RaoBlackwell::new(tuning.singer, tuning.prior, seed);
                gated(particles, range_sigma_m)
            }
            Self::Rule(rule) => Box::new(Late::new(Memoryless::new(rule, tuning.prior))),
        }
    }
}

/// A filter behind the gate, which takes late readings as well.
fn gated<F: Filter + Clone + 'static>(filter: F, range_sigma_m: f64) -> Box<dyn Filter> {
    Box::new(Late::new(Gated::new(filter, range_sigma_m)))
}

#[cfg(test)]
mod tests {
    use bnkf_model_export::radar::gaps::SamplingRate;
    use bnkf_model_export::radar::noise::{NoiseLevel, NoiseTable};

    use super::{BlobKind, Flight, Inference, Recipe, Roster, RosterError, Supplies};
    use crate::contest::default_models;
    use crate::method::Method;
    use crate::own_name::OwnName;
    use crate::scenario::radar::Condition;

    #[test]
    fn a_method_without_its_supplies_is_named() {
        let error = Roster::new(&Method::PAPER, Supplies::default()).unwrap_err();
        assert_eq!(
            error,
            RosterError::NoModel {
                method: Method::Bnn,
                kind: BlobKind::Memoryless,
                networks: 1
            }
        );
        let error = Roster::new(&[Method::Imm5], Supplies::default()).unwrap_err();
        assert_eq!(error, RosterError::NoTuning(Method::Imm5));
        let models = default_models::load().unwrap();
        let with = |passes| Supplies {
            models: &models,
            passes: Some(passes),
            ..Supplies::default()
        };
        let error = Roster::new(&[Method::Bnkf], with(0)).unwrap_err();
        let cause = Inference::of_passes(0).unwrap_err();
        let method = Method::Bnkf;
        assert_eq!(error, RosterError::Passes { method, cause });
        let roster = Roster::new(&[Method::Ukf, Method::Ekf], Supplies::default()).unwrap();
        assert_eq!(
            roster.methods().collect::<Vec<_>>(),
            [Method::Ukf, Method::Ekf]
        );
        let condition = Condition {
            table: NoiseTable::Radians,
            noise: NoiseLevel::Low,
            rate: SamplingRate::FULL,
        };
        let rows = [0.0, 1.0, 2.0].map(|t| [t, 1.0 + t, 2.0, 3.0]);
        let flight = Flight::from_track("a", "a.csv", &rows).unwrap();
        assert_eq!(roster.filters(&flight, condition, 1).len(), 2);
        let own = Method::Own(OwnName::new("mine").unwrap());
        let error = Roster::new(&[own], Supplies::default()).unwrap_err();
        assert_eq!(error, RosterError::NoOwn(own));
    }

    /// Whatever the number of passes.
    #[test]
    fn methods_with_moments_take_moments() {
        let models = default_models::load().unwrap();
        for passes in [None, Some(7)] {
            let supplies = Supplies {
                models: &models,
                passes,
                ..Supplies::default()
            };
            let methods = [Method::Bnkf, Method::BnkfMoments, Method::RecursiveMoments];
            let roster = Roster::new(&methods, supplies).unwrap();
            let inferences = roster.entries.iter().map(|(_, recipe)| match recipe {
                Recipe::Tracker(_, settings) => settings.inference,
                other => panic!("{other:?}"),
            });
            let own = Inference::of_passes(passes.unwrap_or(100)).unwrap();
            let expected = [own, Inference::Moments, Inference::Moments];
            assert_eq!(inferences.collect::<Vec<_>>(), expected);
        }
    }
}
