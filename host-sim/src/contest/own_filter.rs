//! The plug-in point: methods from outside, evaluated as the built-in ones are.

use std::sync::Arc;

use bnkf_model_export::flights::flight::Flight;

use crate::filter::Filter;
use crate::method::Method;
use crate::own_name::OwnName;
use crate::scenario::radar::Condition;

/// Makes a filter for one flight under one condition. The seed starts its random numbers, if it draws any.
/// The flight is there for its name; a filter that looks at the samples knows the truth.
type Make = dyn Fn(&Flight, Condition, u64) -> Box<dyn Filter> + Send + Sync;

/// A method from outside.
#[derive(Clone)]
pub struct OwnFilter {
    name: OwnName,
    forecasts: bool,
    recorded_sha256: Option<String>,
    make: Arc<Make>,
}

impl OwnFilter {
    /// A method that answers every call of [`Filter`]. `make` is called on many threads, once for every
    /// flight and condition.
    pub fn new(
        name: OwnName,
        make: impl Fn(&Flight, Condition, u64) -> Box<dyn Filter> + Send + Sync + 'static,
    ) -> Self {
        Self {
            name,
            forecasts: true,
            recorded_sha256: None,
            make: Arc::new(make),
        }
    }

    /// A method that has answered already, in a file with this SHA-256, and knows nothing of other flights: no
    /// forecast is asked for, it flies in no other world and is not timed.
    pub fn recorded(
        name: OwnName,
        sha256: String,
        make: impl Fn(&Flight, Condition, u64) -> Box<dyn Filter> + Send + Sync + 'static,
    ) -> Self {
        Self {
            forecasts: false,
            recorded_sha256: Some(sha256),
            ..Self::new(name, make)
        }
    }

    /// The same without forecasts: none is asked for, and it takes no part in their table.
    ///
    /// ```
    /// use bnkf_host_sim::contest::own_filter::OwnFilter;
    /// use bnkf_host_sim::own_name::OwnName;
    ///
    /// let name = OwnName::new("mine").expect("letters");
    /// let own = OwnFilter::new(name, |_, _, _| unreachable!("not asked here"));
    /// assert!(own.has_forecasts() && !own.without_forecasts().has_forecasts());
    /// ```
    #[must_use]
    pub fn without_forecasts(self) -> Self {
        Self {
            forecasts: false,
            ..self
        }
    }

    /// The method.
    pub fn method(&self) -> Method {
        Method::Own(self.name)
    }

    /// Whether it is asked for forecasts.
    pub fn has_forecasts(&self) -> bool {
        self.forecasts
    }

    /// The SHA-256 of its answers, if it gave them before it was asked.
    pub fn recorded_sha256(&self) -> Option<&str> {
        self.recorded_sha256.as_deref()
    }

    /// A fresh filter.
    pub fn filter(&self, flight: &Flight, condition: Condition, seed: u64) -> Box<dyn Filter> {
        (self.make)(flight, condition, seed)
    }
}

impl std::fmt::Debug for OwnFilter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OwnFilter")
            .field("name", &self.name)
            .field("forecasts", &self.forecasts)
            .finish_non_exhaustive()
    }
}
