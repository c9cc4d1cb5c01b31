//! Which methods run, and with which models.

use bnkf::blob::Blob;
use bnkf::{Correction, Settings, Tracker, TrackerError};

use crate::baseline::kalman::Kalman;
use crate::filter::Filter;
use crate::method::Method;
use crate::model::Model;
use crate::tracker_filter::TrackerFilter;

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
}

/// Why a roster cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RosterError {
    /// No model has the number of networks that the method needs.
    #[error("method {method}: no model with {networks} network(s) was given")]
    NoModel {
        /// The method.
        method: Method,
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
}

impl<'a> Roster<'a> {
    /// Finds a model for each of `methods`: the last of its kind in `models`. `passes` replaces
    /// the models' own number of Monte Carlo passes.
    ///
    /// # Errors
    /// A method has no model, or the number of passes is out of range.
    pub fn new(
        methods: &[Method],
        models: &'a [Model],
        passes: Option<u16>,
    ) -> Result<Self, RosterError> {
        let tracker = |method, networks, correction| {
            let found = models
                .iter()
                .rev()
                .map(Model::blob)
                .find(|blob| blob.network_count() == networks);
            let blob = found.ok_or(RosterError::NoModel { method, networks })?;
            let mut settings = Settings {
                correction,
                ..Settings::of(&blob)
            };
            settings.passes = passes.unwrap_or(settings.passes);
            Tracker::new(blob, settings)
                .map_err(|cause| RosterError::Settings { method, cause })?;
            Ok(Recipe::Tracker(blob, settings))
        };
        let recipe = |method| match method {
            Method::Ekf => Ok(Recipe::PaperEkf),
            Method::Ukf => Ok(Recipe::PaperUkf),
            Method::Bnn => tracker(method, 1, Correction::None),
            Method::Bnkf => tracker(method, 1, Correction::Converted),
            Method::Bnkfe => tracker(method, 3, Correction::Converted),
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

    /// Fresh filters, one per method; `seed` starts the random streams of those that draw.
    pub fn filters(&self, seed: u64) -> Vec<(Method, Box<dyn Filter + 'a>)> {
        let filter = |recipe: &Recipe<'a>| -> Box<dyn Filter + 'a> {
            match *recipe {
                Recipe::PaperEkf => Box::new(Kalman::paper_ekf()),
                Recipe::PaperUkf => Box::new(Kalman::paper_ukf()),
                Recipe::Tracker(blob, settings) => {
                    let settings = Settings { seed, ..settings };
                    Box::new(TrackerFilter::new(blob, settings).expect("checked in Roster::new"))
                }
            }
        };
        self.entries
            .iter()
            .map(|(method, recipe)| (*method, filter(recipe)))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::{Roster, RosterError};
    use crate::method::Method;

    #[test]
    fn a_method_without_its_model_is_named() {
        let error = Roster::new(&Method::PAPER, &[], None).unwrap_err();
        assert_eq!(
            error,
            RosterError::NoModel {
                method: Method::Bnn,
                networks: 1
            }
        );
        let roster = Roster::new(&[Method::Ukf, Method::Ekf], &[], None).unwrap();
        assert_eq!(
            roster.methods().collect::<Vec<_>>(),
            [Method::Ukf, Method::Ekf]
        );
        assert_eq!(roster.filters(1).len(), 2);
    }
}
