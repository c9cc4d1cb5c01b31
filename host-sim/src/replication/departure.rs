//! Where the published code departs from the paper.

/// One difference; absent it is done as the paper says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Departure {
    /// The angle figures of the noise table are radians, not degrees.
    Radians,
    /// 17 Cartesian features, position and velocity out, four hidden layers; not 12 polar
    /// features, position out, five hidden layers.
    Cartesian,
    /// The divergence of the last layer's bias only, weight sigmas left where they began; not of
    /// all weights, sigmas learned.
    LastBias,
    /// The correction takes `R = sigma_range^2 I` for position and velocity; not the covariance of
    /// the converted position.
    RangeSigma,
    /// The estimate belongs to the earlier reading of a pair; not to the later one.
    LookAhead,
    /// Range and range-rate are rounded to the middle of bins one sigma wide; not plain Gaussian.
    Binned,
    /// Estimates in gaps are not scored; otherwise the last estimate is held and scored.
    GapsUnscored,
    /// Errors above 1000 m, D above 10000 and det P above 100000 m^6 are not scored.
    OutliersDropped,
    /// Folds by segment: parts of one recording may be trained on and tested; not by recording.
    SegmentFolds,
}

impl Departure {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Radians,
        Self::Cartesian,
        Self::LastBias,
        Self::RangeSigma,
        Self::LookAhead,
        Self::Binned,
        Self::GapsUnscored,
        Self::OutliersDropped,
        Self::SegmentFolds,
    ];

    /// How it is done with the departure.
    pub const fn taken(self) -> &'static str {
        match self {
            Self::Radians => "angle figures as radians",
            Self::Cartesian => "17 Cartesian features, 6 outputs",
            Self::LastBias => "KL of the last bias only, weight sigmas stay at 0.01",
            Self::RangeSigma => "R = sigma_range^2 I",
            Self::LookAhead => "estimate of the earlier reading",
            Self::Binned => "range and range-rate in bins of one sigma",
            Self::GapsUnscored => "gaps not scored",
            Self::OutliersDropped => "outliers dropped",
            Self::SegmentFolds => "folds by segment",
        }
    }

    /// How it is done without it, as the paper says.
    pub const fn not_taken(self) -> &'static str {
        match self {
            Self::Radians => "angle figures as degrees",
            Self::Cartesian => "12 polar features, 3 outputs",
            Self::LastBias => "KL of all weights, sigmas learned",
            Self::RangeSigma => "R of the converted measurement",
            Self::LookAhead => "estimate of the current reading",
            Self::Binned => "Gaussian noise alone",
            Self::GapsUnscored => "gaps scored",
            Self::OutliersDropped => "nothing dropped",
            Self::SegmentFolds => "folds by recording",
        }
    }

    /// Whether networks trained with and without it differ; otherwise only their use does.
    pub const fn trains(self) -> bool {
        !matches!(
            self,
            Self::RangeSigma | Self::GapsUnscored | Self::OutliersDropped
        )
    }
}
