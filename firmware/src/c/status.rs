//! What a call says: that it was done, or why not.

use crate::blob::{BlobError, BlobField};
use crate::ekf::EkfError;
use crate::measurement::{Channel, MeasurementError};
use crate::sensor::SensorError;
use crate::settings::TrackerError;
use crate::step_error::StepError;
use crate::track::{OtherKind, TrackBytesError, TrackField};

/// What every function says. A call that was not done changed nothing, unless its function says otherwise.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BnkfStatus {
    /// It was done.
    Ok = 0,

    /// A pointer is null.
    NullPointer = 1,
    /// A pointer is not aligned for what it points to.
    MisalignedPointer = 2,
    /// Nothing was made in this place yet, or something else.
    NotInitialised = 3,
    /// A code or a sum of channels that means nothing.
    UnknownCode = 4,
    /// More values than any memory holds.
    Length = 5,

    /// Fewer bytes than the blob needs.
    BlobTruncated = 16,
    /// The first bytes are not `BNKF`.
    BlobNotABlob = 17,
    /// A version of the blob that this library does not know.
    BlobUnknownVersion = 18,
    /// The blob's length disagrees with the number of bytes.
    BlobWrongLength = 19,
    /// The blob's checksum does not match.
    BlobWrongChecksum = 20,
    /// A parameter of the blob is no target's and no model's.
    BlobParameter = 21,
    /// The blob's kind of estimator.
    BlobKind = 22,
    /// The blob's units.
    BlobUnits = 23,
    /// The blob's feature layout.
    BlobFeatures = 24,
    /// The blob's number of networks.
    BlobNetworks = 25,
    /// The blob's number of inputs.
    BlobInputs = 26,
    /// The blob's number of outputs.
    BlobOutputs = 27,
    /// The blob's number of passes.
    BlobPasses = 28,
    /// The blob's number of parameters.
    BlobParameters = 29,
    /// The blob's input normalisation.
    BlobInputNormalisation = 30,
    /// The blob's output normalisation.
    BlobOutputNormalisation = 31,
    /// The blob's number of layers.
    BlobLayers = 32,
    /// The size of a layer of the blob.
    BlobLayerSize = 33,
    /// The offset of a layer of the blob.
    BlobLayerOffset = 34,
    /// The largest weight variance of a layer of the blob.
    BlobVarianceMax = 35,
    /// The scale of an output channel of the blob.
    BlobChannelScale = 36,
    /// A bias of the blob.
    BlobBiasMean = 37,
    /// A bias's variance of the blob.
    BlobBiasVariance = 38,
    /// Bytes of the blob that must be zero.
    BlobPadding = 39,
    /// What follows the hidden layers of the blob.
    BlobActivation = 40,

    /// The correction does not fit the model.
    SettingsCorrection = 64,
    /// The number of passes does not fit the kind of inference.
    SettingsPasses = 65,
    /// The library was built without what the model or the kind of inference needs.
    SettingsLeftOut = 66,

    /// Nothing was measured.
    NothingMeasured = 80,
    /// The elevation or its sigma is not finite.
    ElevationNotFinite = 81,
    /// The azimuth or its sigma is not finite.
    AzimuthNotFinite = 82,
    /// The range or its sigma is not finite.
    RangeNotFinite = 83,
    /// The range-rate or its sigma is not finite.
    RangeRateNotFinite = 84,
    /// The elevation is larger than any.
    ElevationOutOfRange = 85,
    /// The azimuth is larger than any.
    AzimuthOutOfRange = 86,
    /// The range is larger than any.
    RangeOutOfRange = 87,
    /// The range-rate is larger than any.
    RangeRateOutOfRange = 88,
    /// The sigma of the elevation is outside its limits.
    ElevationSigma = 89,
    /// The sigma of the azimuth is outside its limits.
    AzimuthSigma = 90,
    /// The sigma of the range is outside its limits.
    RangeSigma = 91,
    /// The sigma of the range-rate is outside its limits.
    RangeRateSigma = 92,
    /// The elevation is missing and needed.
    ElevationMissing = 93,
    /// The azimuth is missing and needed.
    AzimuthMissing = 94,
    /// The range is missing and needed.
    RangeMissing = 95,
    /// The range-rate is missing and needed.
    RangeRateMissing = 96,
    /// The sensor's position, velocity or mounting is not finite.
    SensorNotFinite = 97,
    /// The sensor is too far away.
    SensorTooFar = 98,
    /// The sensor is too fast.
    SensorTooFast = 99,
    /// A memoryless model knows a sensor at rest in the origin only.
    SensorNotAtOrigin = 100,

    /// The same measurement as the latest one.
    Repeated = 112,
    /// The time lies before that of an earlier step.
    TimeWentBack = 113,
    /// The time lies more than 60 s ahead.
    TimeTooFarAhead = 114,
    /// No track can start from so blunt a measurement.
    Blunt = 115,
    /// There is nothing to go on from yet.
    NotStarted = 116,
    /// The track runs on another model: `bnkf_track_hand_over`.
    OtherModel = 117,
    /// The network's output is not finite.
    NetworkNotFinite = 118,
    /// The state or its covariance is not finite.
    CorrectionNotFinite = 119,
    /// A covariance is not positive definite.
    CorrectionNotPositiveDefinite = 120,
    /// Nothing is known of the target at that time. After a coast the track was given up, and the next measurement starts a
    /// new one; after forecasts or a likelihood it is as it was.
    Lost = 121,

    /// The model is of another kind than the track.
    OtherKind = 144,
    /// The bytes do not begin as a track does.
    BytesNotATrack = 145,
    /// A version of the bytes that this library does not know.
    BytesUnknownVersion = 146,
    /// The checksum of the bytes does not match.
    BytesWrongChecksum = 147,
    /// A kind of track that this library does not know.
    BytesUnknownKind = 148,
    /// No track has such settings.
    BytesSettings = 149,
    /// No track has such times.
    BytesClock = 150,
    /// No track has such a latest measurement.
    BytesMeasurement = 151,
    /// No track has such a random stream.
    BytesGenerator = 152,
    /// No track has such a state or covariance.
    BytesTarget = 153,
    /// No track has such a memory.
    BytesMemory = 154,
    /// No track has such a second track.
    BytesCandidate = 155,
    /// No memoryless track has such estimates.
    BytesFix = 156,
    /// A flag that means nothing, or room that is not empty.
    BytesPadding = 157,
}

/// As C returns it.
pub fn said(result: Result<(), BnkfStatus>) -> BnkfStatus {
    result.err().unwrap_or(BnkfStatus::Ok)
}

impl From<BlobError> for BnkfStatus {
    fn from(error: BlobError) -> Self {
        match error {
            BlobError::Truncated { .. } => Self::BlobTruncated,
            BlobError::NotABlob => Self::BlobNotABlob,
            BlobError::UnknownVersion(_) => Self::BlobUnknownVersion,
            BlobError::WrongLength { .. } => Self::BlobWrongLength,
            BlobError::WrongChecksum => Self::BlobWrongChecksum,
            BlobError::Parameter(_) => Self::BlobParameter,
            BlobError::Invalid(field) => match field {
                BlobField::Kind => Self::BlobKind,
                BlobField::Units => Self::BlobUnits,
                BlobField::Features => Self::BlobFeatures,
                BlobField::Networks => Self::BlobNetworks,
                BlobField::Inputs => Self::BlobInputs,
                BlobField::Outputs => Self::BlobOutputs,
                BlobField::Passes => Self::BlobPasses,
                BlobField::Parameters => Self::BlobParameters,
                BlobField::InputNormalisation => Self::BlobInputNormalisation,
                BlobField::OutputNormalisation => Self::BlobOutputNormalisation,
                BlobField::Layers => Self::BlobLayers,
                BlobField::Activation => Self::BlobActivation,
                BlobField::LayerSize => Self::BlobLayerSize,
                BlobField::LayerOffset => Self::BlobLayerOffset,
                BlobField::VarianceMax => Self::BlobVarianceMax,
                BlobField::ChannelScale => Self::BlobChannelScale,
                BlobField::BiasMean => Self::BlobBiasMean,
                BlobField::BiasVariance => Self::BlobBiasVariance,
                BlobField::Padding => Self::BlobPadding,
            },
        }
    }
}

impl From<TrackerError> for BnkfStatus {
    fn from(error: TrackerError) -> Self {
        match error {
            TrackerError::Correction(_) => Self::SettingsCorrection,
            TrackerError::LeftOut(_) => Self::SettingsLeftOut,
        }
    }
}

impl From<MeasurementError> for BnkfStatus {
    fn from(error: MeasurementError) -> Self {
        use Channel::{Azimuth, Elevation, Range, RangeRate};
        match error {
            MeasurementError::Empty => Self::NothingMeasured,
            MeasurementError::NotFinite(Elevation) => Self::ElevationNotFinite,
            MeasurementError::NotFinite(Azimuth) => Self::AzimuthNotFinite,
            MeasurementError::NotFinite(Range) => Self::RangeNotFinite,
            MeasurementError::NotFinite(RangeRate) => Self::RangeRateNotFinite,
            MeasurementError::OutOfRange(Elevation) => Self::ElevationOutOfRange,
            MeasurementError::OutOfRange(Azimuth) => Self::AzimuthOutOfRange,
            MeasurementError::OutOfRange(Range) => Self::RangeOutOfRange,
            MeasurementError::OutOfRange(RangeRate) => Self::RangeRateOutOfRange,
            MeasurementError::Sigma(Elevation) => Self::ElevationSigma,
            MeasurementError::Sigma(Azimuth) => Self::AzimuthSigma,
            MeasurementError::Sigma(Range) => Self::RangeSigma,
            MeasurementError::Sigma(RangeRate) => Self::RangeRateSigma,
            MeasurementError::Sensor(SensorError::NotFinite) => Self::SensorNotFinite,
            MeasurementError::Sensor(SensorError::TooFar) => Self::SensorTooFar,
            MeasurementError::Sensor(SensorError::TooFast) => Self::SensorTooFast,
        }
    }
}

impl From<StepError> for BnkfStatus {
    fn from(error: StepError) -> Self {
        match error {
            StepError::Measurement(error) => error.into(),
            StepError::Missing(Channel::Elevation) => Self::ElevationMissing,
            StepError::Missing(Channel::Azimuth) => Self::AzimuthMissing,
            StepError::Missing(Channel::Range) => Self::RangeMissing,
            StepError::Missing(Channel::RangeRate) => Self::RangeRateMissing,
            StepError::Sensor => Self::SensorNotAtOrigin,
            StepError::Repeated => Self::Repeated,
            StepError::TimeWentBack { .. } => Self::TimeWentBack,
            StepError::TimeTooFarAhead { .. } => Self::TimeTooFarAhead,
            StepError::Blunt => Self::Blunt,
            StepError::NotStarted => Self::NotStarted,
            StepError::OtherModel => Self::OtherModel,
            StepError::NetworkNotFinite => Self::NetworkNotFinite,
            StepError::Correction(EkfError::NotFinite) => Self::CorrectionNotFinite,
            StepError::Correction(EkfError::NotPositiveDefinite) => {
                Self::CorrectionNotPositiveDefinite
            }
            StepError::Lost => Self::Lost,
        }
    }
}

impl From<OtherKind> for BnkfStatus {
    fn from(_: OtherKind) -> Self {
        Self::OtherKind
    }
}

impl From<TrackBytesError> for BnkfStatus {
    fn from(error: TrackBytesError) -> Self {
        match error {
            TrackBytesError::NotATrack => Self::BytesNotATrack,
            TrackBytesError::UnknownVersion(_) => Self::BytesUnknownVersion,
            TrackBytesError::WrongChecksum => Self::BytesWrongChecksum,
            TrackBytesError::UnknownKind(_) => Self::BytesUnknownKind,
            TrackBytesError::Invalid(field) => match field {
                TrackField::Settings => Self::BytesSettings,
                TrackField::Clock => Self::BytesClock,
                TrackField::Measurement => Self::BytesMeasurement,
                TrackField::Generator => Self::BytesGenerator,
                TrackField::Target => Self::BytesTarget,
                TrackField::Memory => Self::BytesMemory,
                TrackField::Candidate => Self::BytesCandidate,
                TrackField::Fix => Self::BytesFix,
                TrackField::Padding => Self::BytesPadding,
            },
        }
    }
}
