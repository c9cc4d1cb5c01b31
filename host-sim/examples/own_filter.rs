//! One's own filter in the tables, intervals and page of `evaluate`.
//!
//!     cargo run --release -p bnkf-host-sim --example own_filter -- --quick --methods ekf-tuned,recursive
//!
//! The filter here is a bad one: it answers every reading with where it points, and stands still in a gap.

use bnkf_host_sim::cmd::evaluate::{self, EvaluateError};
use bnkf_host_sim::contest::own_filter::OwnFilter;
use bnkf_host_sim::contest::track::position_of;
use bnkf_host_sim::filter::{Filter, FilterError, Forecasts, PositionEstimate, Start};
use bnkf_host_sim::own_name::OwnName;
use bnkf_model_export::radar::reading::Reading;
use clap::Parser;
use nalgebra::Matrix3;

/// `evaluate` with one more method.
#[derive(Parser)]
struct Cli {
    #[command(flatten)]
    evaluation: evaluate::Args,
}

/// Variance that a position gains a second without a reading, m^2.
const DRIFT_M2: f64 = 4.0;

#[derive(Default)]
struct LastReading {
    latest: Option<(u64, PositionEstimate)>,
}

impl LastReading {
    fn at(&self, time_us: u64) -> Result<PositionEstimate, FilterError> {
        let (then_us, latest) = self.latest.ok_or(FilterError::NotStarted)?;
        let silent_s = 1e-6 * time_us.saturating_sub(then_us) as f64;
        let covariance_m2 = latest.covariance_m2 + Matrix3::identity() * DRIFT_M2 * silent_s;
        Ok(PositionEstimate {
            covariance_m2,
            ..latest
        })
    }

    fn take(&mut self, reading: &Reading) {
        let across_m = reading.range_m * reading.sigma_azimuth_rad.max(reading.sigma_elevation_rad);
        let variance_m2 = reading.sigma_range_m.max(across_m).powi(2);
        let covariance_m2 = Matrix3::identity() * variance_m2;
        let estimate = PositionEstimate::new(position_of(reading), covariance_m2);
        self.latest = Some((reading.time_us, estimate));
    }
}

impl Filter for LastReading {
    fn start(&mut self, start: &Start<'_>) -> Result<PositionEstimate, FilterError> {
        self.take(start.reading);
        self.at(start.reading.time_us)
    }

    fn step(
        &mut self,
        time_us: u64,
        reading: Option<&Reading>,
    ) -> Result<PositionEstimate, FilterError> {
        reading.into_iter().for_each(|reading| self.take(reading));
        self.at(time_us)
    }

    fn forecast(&mut self, times_us: &[u64; 3]) -> Result<Forecasts, FilterError> {
        let [near, middle, far] = times_us.map(|time_us| self.at(time_us));
        Ok([near?, middle?, far?])
    }
}

fn main() -> Result<(), EvaluateError> {
    let name = OwnName::new("last reading").expect("letters and a blank");
    let own = OwnFilter::new(name, |_, _, _| Box::new(LastReading::default()));
    evaluate::evaluate_with(&Cli::parse().evaluation, vec![own])
}
