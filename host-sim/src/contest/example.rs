//! A flight to look at, with the track of every method.

use bnkf_model_export::flights::flight::Flight;
use bnkf_model_export::radar::gaps::SamplingRate;
use bnkf_model_export::radar::noise::NoiseLevel;
use bnkf_model_export::radar::reading::Reading;

use crate::contest::track::TrackStep;
use crate::method::Method;

/// One flight at one noise level, and what every method made of it.
#[derive(Clone, Debug)]
pub struct Example<'a> {
    /// The truth.
    pub flight: &'a Flight,
    /// Noise level of the readings.
    pub noise: NoiseLevel,
    /// Part of the samples that were measured.
    pub rate: SamplingRate,
    /// One entry per sample.
    pub readings: Vec<Option<Reading>>,
    /// Every method's steps, from the second sample on.
    pub tracks: Vec<(Method, Vec<TrackStep>)>,
}
