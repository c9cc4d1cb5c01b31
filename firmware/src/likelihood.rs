//! How well a measurement fits a track.

use core::f32::consts::TAU;

use crate::measurement::Vectors;

/// What a track says of a measurement, for associating plots with tracks.
///
/// Innovation, NIS and likelihood are those of one Gaussian: the measurement as it is expected if the
/// target moves as the model says and the sensor is as good as it says. That a reading may be wrong
/// is left out on purpose: such a reading fits every track equally, and whoever associates has a
/// model of false plots of his own. The gate alone asks under all hypotheses.
///
/// ```
/// use bnkf::Likelihood;
///
/// /// Of the tracks that a plot can be of (chi-square, one of their own in twenty thousand is not), the one
/// /// that expects it most.
/// fn best(fits: &[Likelihood]) -> Option<usize> {
///     let taken = fits.iter().enumerate().filter(|(_, fit)| fit.degrees == 4 && fit.nis < 25.0);
///     let best = taken.max_by(|(_, a), (_, b)| a.ln_likelihood.total_cmp(&b.ln_likelihood));
///     best.map(|(place, _)| place)
/// }
/// assert_eq!(best(&[]), None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Likelihood {
    /// What was measured less what was expected: elevation, azimuth (rad), range (m), range-rate
    /// (m/s). `None` where nothing was measured, or the blob cannot expect it: a memoryless one
    /// knows no range-rate.
    pub innovation: [Option<f32>; 4],
    /// Normalised innovation squared, `y' S^-1 y`.
    pub nis: f32,
    /// Numbers in the innovation: the degrees of freedom of the NIS, which is chi-square distributed
    /// for the track's own measurements.
    pub degrees: u8,
    /// Natural logarithm of the density, per rad^2 m m/s or what is there of them:
    /// `-(NIS + ln det(2 pi S)) / 2` (Bar-Shalom, Li and Kirubarajan 2001, equation 5.4.2-5).
    pub ln_likelihood: f32,
    /// Whether the gate of a step would pass the measurement, which knows that readings may be wrong: it passes
    /// many that are another target's, and does not associate. A memoryless blob has none and uses everything:
    /// here the gate of a recursive one stands for it. Where a track is blind beside its sensor's vertical axis, or
    /// another sensor sees it far aside, a step takes the place from the measurement instead, and may restart, as it does
    /// after ten seconds of silence; that is not asked here.
    pub passes_gate: bool,
}

impl Likelihood {
    /// The likelihood of `vectors`, which a state expected `innovation` away; its correction had this NIS
    /// and half the logarithm of its innovation's determinant. `None` if it is no finite number.
    pub(crate) fn new(
        innovation: [f32; 4],
        vectors: &Vectors<f32>,
        nis: f32,
        ln_root: f32,
        passes_gate: bool,
    ) -> Option<Self> {
        let there = |i: usize| (vectors.present[i] > 0.0).then_some(innovation[i]);
        let innovation: [Option<f32>; 4] = core::array::from_fn(there);
        let degrees = innovation.iter().flatten().count() as u8;
        let constant = 0.5 * f32::from(degrees) * libm::logf(TAU);
        let ln_likelihood = -0.5 * nis - ln_root - constant;
        let finite = innovation.iter().flatten().all(|y| y.is_finite());
        (finite && ln_likelihood.is_finite()).then_some(Self {
            innovation,
            nis,
            degrees,
            ln_likelihood,
            passes_gate,
        })
    }
}
