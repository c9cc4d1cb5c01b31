/* BNKF, a Bayesian neural Kalman tracker: firmware/src/c/ for C. See docs/c.md.

   Made by cbindgen (tests/header.rs): do not edit. Metres, seconds, radians; x east, y north, z up. Nothing
   is allocated, nothing panics, and no function keeps state: whatever is not given to two calls at a time
   may be used from any thread or interrupt. */

#ifndef BNKF_H
#define BNKF_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
/* Alignment of every place, and sizes in words of 8 bytes and in bytes. */
#define BNKF_ALIGNMENT 8
#define BNKF_MODEL_WORDS 49
#define BNKF_MODEL_BYTES 392
#define BNKF_WORKSPACE_WORDS 976
#define BNKF_WORKSPACE_BYTES 7808
#define BNKF_TRACK_WORDS 179
#define BNKF_TRACK_BYTES 1432
/* Length of every track as bytes. */
#define BNKF_TRACK_SNAPSHOT_BYTES 1088

// An elevation was measured.
#define BNKF_ELEVATION 1

// An azimuth was measured.
#define BNKF_AZIMUTH 2

// A range was measured.
#define BNKF_RANGE 4

// A range-rate was measured.
#define BNKF_RANGE_RATE 8

// What every function says. A call that was not done changed nothing, unless its function says otherwise.
enum BnkfStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // It was done.
  BNKF_STATUS_OK = 0,
  // A pointer is null.
  BNKF_STATUS_NULL_POINTER = 1,
  // A pointer is not aligned for what it points to.
  BNKF_STATUS_MISALIGNED_POINTER = 2,
  // Nothing was made in this place yet, or something else.
  BNKF_STATUS_NOT_INITIALISED = 3,
  // A code or a sum of channels that means nothing.
  BNKF_STATUS_UNKNOWN_CODE = 4,
  // More values than any memory holds.
  BNKF_STATUS_LENGTH = 5,
  // Fewer bytes than the blob needs.
  BNKF_STATUS_BLOB_TRUNCATED = 16,
  // The first bytes are not `BNKF`.
  BNKF_STATUS_BLOB_NOT_A_BLOB = 17,
  // A version of the blob that this library does not know.
  BNKF_STATUS_BLOB_UNKNOWN_VERSION = 18,
  // The blob's length disagrees with the number of bytes.
  BNKF_STATUS_BLOB_WRONG_LENGTH = 19,
  // The blob's checksum does not match.
  BNKF_STATUS_BLOB_WRONG_CHECKSUM = 20,
  // A parameter of the blob is no target's and no model's.
  BNKF_STATUS_BLOB_PARAMETER = 21,
  // The blob's kind of estimator.
  BNKF_STATUS_BLOB_KIND = 22,
  // The blob's units.
  BNKF_STATUS_BLOB_UNITS = 23,
  // The blob's feature layout.
  BNKF_STATUS_BLOB_FEATURES = 24,
  // The blob's number of networks.
  BNKF_STATUS_BLOB_NETWORKS = 25,
  // The blob's number of inputs.
  BNKF_STATUS_BLOB_INPUTS = 26,
  // The blob's number of outputs.
  BNKF_STATUS_BLOB_OUTPUTS = 27,
  // The blob's number of passes.
  BNKF_STATUS_BLOB_PASSES = 28,
  // The blob's number of parameters.
  BNKF_STATUS_BLOB_PARAMETERS = 29,
  // The blob's input normalisation.
  BNKF_STATUS_BLOB_INPUT_NORMALISATION = 30,
  // The blob's output normalisation.
  BNKF_STATUS_BLOB_OUTPUT_NORMALISATION = 31,
  // The blob's number of layers.
  BNKF_STATUS_BLOB_LAYERS = 32,
  // The size of a layer of the blob.
  BNKF_STATUS_BLOB_LAYER_SIZE = 33,
  // The offset of a layer of the blob.
  BNKF_STATUS_BLOB_LAYER_OFFSET = 34,
  // The largest weight variance of a layer of the blob.
  BNKF_STATUS_BLOB_VARIANCE_MAX = 35,
  // The scale of an output channel of the blob.
  BNKF_STATUS_BLOB_CHANNEL_SCALE = 36,
  // A bias of the blob.
  BNKF_STATUS_BLOB_BIAS_MEAN = 37,
  // A bias's variance of the blob.
  BNKF_STATUS_BLOB_BIAS_VARIANCE = 38,
  // Bytes of the blob that must be zero.
  BNKF_STATUS_BLOB_PADDING = 39,
  // What follows the hidden layers of the blob.
  BNKF_STATUS_BLOB_ACTIVATION = 40,
  // The correction does not fit the model.
  BNKF_STATUS_SETTINGS_CORRECTION = 64,
  // The number of passes does not fit the kind of inference.
  BNKF_STATUS_SETTINGS_PASSES = 65,
  // The library was built without what the model or the kind of inference needs.
  BNKF_STATUS_SETTINGS_LEFT_OUT = 66,
  // Nothing was measured.
  BNKF_STATUS_NOTHING_MEASURED = 80,
  // The elevation or its sigma is not finite.
  BNKF_STATUS_ELEVATION_NOT_FINITE = 81,
  // The azimuth or its sigma is not finite.
  BNKF_STATUS_AZIMUTH_NOT_FINITE = 82,
  // The range or its sigma is not finite.
  BNKF_STATUS_RANGE_NOT_FINITE = 83,
  // The range-rate or its sigma is not finite.
  BNKF_STATUS_RANGE_RATE_NOT_FINITE = 84,
  // The elevation is larger than any.
  BNKF_STATUS_ELEVATION_OUT_OF_RANGE = 85,
  // The azimuth is larger than any.
  BNKF_STATUS_AZIMUTH_OUT_OF_RANGE = 86,
  // The range is larger than any.
  BNKF_STATUS_RANGE_OUT_OF_RANGE = 87,
  // The range-rate is larger than any.
  BNKF_STATUS_RANGE_RATE_OUT_OF_RANGE = 88,
  // The sigma of the elevation is outside its limits.
  BNKF_STATUS_ELEVATION_SIGMA = 89,
  // The sigma of the azimuth is outside its limits.
  BNKF_STATUS_AZIMUTH_SIGMA = 90,
  // The sigma of the range is outside its limits.
  BNKF_STATUS_RANGE_SIGMA = 91,
  // The sigma of the range-rate is outside its limits.
  BNKF_STATUS_RANGE_RATE_SIGMA = 92,
  // The elevation is missing and needed.
  BNKF_STATUS_ELEVATION_MISSING = 93,
  // The azimuth is missing and needed.
  BNKF_STATUS_AZIMUTH_MISSING = 94,
  // The range is missing and needed.
  BNKF_STATUS_RANGE_MISSING = 95,
  // The range-rate is missing and needed.
  BNKF_STATUS_RANGE_RATE_MISSING = 96,
  // The sensor's position, velocity or mounting is not finite.
  BNKF_STATUS_SENSOR_NOT_FINITE = 97,
  // The sensor is too far away.
  BNKF_STATUS_SENSOR_TOO_FAR = 98,
  // The sensor is too fast.
  BNKF_STATUS_SENSOR_TOO_FAST = 99,
  // A memoryless model knows a sensor at rest in the origin only.
  BNKF_STATUS_SENSOR_NOT_AT_ORIGIN = 100,
  // The same measurement as the latest one.
  BNKF_STATUS_REPEATED = 112,
  // The time lies before that of an earlier step.
  BNKF_STATUS_TIME_WENT_BACK = 113,
  // The time lies more than 60 s ahead.
  BNKF_STATUS_TIME_TOO_FAR_AHEAD = 114,
  // No track can start from so blunt a measurement.
  BNKF_STATUS_BLUNT = 115,
  // There is nothing to go on from yet.
  BNKF_STATUS_NOT_STARTED = 116,
  // The track runs on another model: `bnkf_track_hand_over`.
  BNKF_STATUS_OTHER_MODEL = 117,
  // The network's output is not finite.
  BNKF_STATUS_NETWORK_NOT_FINITE = 118,
  // The state or its covariance is not finite.
  BNKF_STATUS_CORRECTION_NOT_FINITE = 119,
  // A covariance is not positive definite.
  BNKF_STATUS_CORRECTION_NOT_POSITIVE_DEFINITE = 120,
  // Nothing is known of the target at that time. After a coast the track was given up, and the next measurement starts a
  // new one; after forecasts or a likelihood it is as it was.
  BNKF_STATUS_LOST = 121,
  // The model is of another kind than the track.
  BNKF_STATUS_OTHER_KIND = 144,
  // The bytes do not begin as a track does.
  BNKF_STATUS_BYTES_NOT_A_TRACK = 145,
  // A version of the bytes that this library does not know.
  BNKF_STATUS_BYTES_UNKNOWN_VERSION = 146,
  // The checksum of the bytes does not match.
  BNKF_STATUS_BYTES_WRONG_CHECKSUM = 147,
  // A kind of track that this library does not know.
  BNKF_STATUS_BYTES_UNKNOWN_KIND = 148,
  // No track has such settings.
  BNKF_STATUS_BYTES_SETTINGS = 149,
  // No track has such times.
  BNKF_STATUS_BYTES_CLOCK = 150,
  // No track has such a latest measurement.
  BNKF_STATUS_BYTES_MEASUREMENT = 151,
  // No track has such a random stream.
  BNKF_STATUS_BYTES_GENERATOR = 152,
  // No track has such a state or covariance.
  BNKF_STATUS_BYTES_TARGET = 153,
  // No track has such a memory.
  BNKF_STATUS_BYTES_MEMORY = 154,
  // No track has such a second track.
  BNKF_STATUS_BYTES_CANDIDATE = 155,
  // No memoryless track has such estimates.
  BNKF_STATUS_BYTES_FIX = 156,
  // A flag that means nothing, or room that is not empty.
  BNKF_STATUS_BYTES_PADDING = 157,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BnkfStatus BnkfStatus;
#else
typedef uint8_t BnkfStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// How an estimate came about.
enum BnkfMode
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // From the first measurement, or the first one after a long silence.
  BNKF_MODE_STARTED = 0,
  // From the current measurement and the ones before it.
  BNKF_MODE_TRACKING = 1,
  // Without a measurement.
  BNKF_MODE_COASTING = 2,
  // The measurement lay outside the gate and was not used.
  BNKF_MODE_REJECTED = 3,
  // Another track took over, or the filter was started anew.
  BNKF_MODE_RESTARTED = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BnkfMode BnkfMode;
#else
typedef uint8_t BnkfMode;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What the network's estimate is corrected with.
enum BnkfCorrection
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Nothing: the network alone. For a memoryless model.
  BNKF_CORRECTION_NONE = 0,
  // The measured position, converted to Cartesian. For a memoryless model.
  BNKF_CORRECTION_CONVERTED = 1,
  // What was measured itself; the only one for a recursive model.
  BNKF_CORRECTION_POLAR = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BnkfCorrection BnkfCorrection;
#else
typedef uint8_t BnkfCorrection;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What becomes of the doubt about the weights.
enum BnkfInferenceKind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Nothing: every weight at its mean.
  BNKF_INFERENCE_KIND_MEAN = 0,
  // Monte Carlo passes with drawn weights.
  BNKF_INFERENCE_KIND_PASSES = 1,
  // The same, most of them with the standard deviations of the first ones.
  BNKF_INFERENCE_KIND_FROZEN_PASSES = 2,
  // Mean and covariance without drawing.
  BNKF_INFERENCE_KIND_MOMENTS = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BnkfInferenceKind BnkfInferenceKind;
#else
typedef uint8_t BnkfInferenceKind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// A measured quantity and its standard deviation (1 sigma).
typedef struct BnkfSensed {
  // The value: m, rad or m/s.
  float value;
  // Its standard deviation, in the same unit.
  float sigma;
} BnkfSensed;

// A direction in the track's axes.
typedef struct BnkfDirection {
  // Elevation, rad.
  struct BnkfSensed elevation;
  // Azimuth, rad.
  struct BnkfSensed azimuth;
  // Whether there is an azimuth: near the vertical there is none.
  bool has_azimuth;
} BnkfDirection;

// Room for a model: a checked blob. It may be copied; the blob's bytes stay where they are, unchanged, for
// as long as any copy is used.
typedef struct BnkfModel {
  // Nobody else's; zero before it was made.
  uint64_t words[BNKF_MODEL_WORDS];
} BnkfModel;

// How a track asks its network.
typedef struct BnkfInference {
  // A `BnkfInferenceKind`.
  uint8_t kind;
  // Passes, 2 to 10000, where it is by passes; else zero.
  uint16_t passes;
} BnkfInference;

// Settings of a track; `bnkf_model_settings` fills them in.
typedef struct BnkfSettings {
  // A `BnkfCorrection`.
  uint8_t correction;
  // How the network is asked.
  struct BnkfInference inference;
  // Seed of the passes.
  uint64_t seed;
} BnkfSettings;

// Room for the working memory of a step. Any number of tracks share it, one call at a time.
typedef struct BnkfWorkspace {
  // Nobody else's; zero before it was made.
  uint64_t words[BNKF_WORKSPACE_WORDS];
} BnkfWorkspace;

// Room for a track: all that is known of one target. A copy is a snapshot.
typedef struct BnkfTrack {
  // Nobody else's; zero before it was made.
  uint64_t words[BNKF_TRACK_WORDS];
} BnkfTrack;

// One measurement. Frame: x east, y north, z up; azimuth from +x towards +y, elevation from the horizontal,
// range-rate positive outbound. All zero but what was measured is a radar at rest in the origin.
typedef struct BnkfMeasurement {
  // Time, microseconds.
  uint64_t time_us;
  // Elevation, rad.
  struct BnkfSensed elevation;
  // Azimuth, rad.
  struct BnkfSensed azimuth;
  // Range, m.
  struct BnkfSensed range;
  // Range-rate, m/s.
  struct BnkfSensed range_rate;
  // Position of the sensor, m.
  float sensor_position_m[3];
  // Velocity of the sensor, m/s.
  float sensor_velocity_mps[3];
  // What was measured: the sum of `BNKF_ELEVATION` and so on. What was not is not read.
  uint8_t channels;
} BnkfMeasurement;

// Position and covariance at one instant; x east, y north, z up.
typedef struct BnkfEstimate {
  // Time, microseconds.
  uint64_t time_us;
  // Position, m.
  float position_m[3];
  // Covariance of the position, m^2, symmetric positive definite.
  float covariance_m2[3][3];
  // Normalised innovation squared of the correction; zero without one.
  float nis;
  // Probability that the target manoeuvred.
  float manoeuvre;
  // Probability that the reading is wrong; one if it was rejected.
  float outlier;
  // Velocity, m/s; of a recursive model.
  float velocity_mps[3];
  // Acceleration, m/s^2; of a recursive model.
  float acceleration_mps2[3];
  // Covariance of position, velocity and acceleration, three rows each; of a recursive model.
  float covariance[9][9];
  // How it came about.
  BnkfMode mode;
  // Whether the target is where, or moves as, the model was not trained for.
  bool outside;
  // Whether there are velocity, acceleration and their covariance; they are zero for a memoryless model.
  bool has_motion;
} BnkfEstimate;

// What a track says of a measurement, for associating plots with tracks.
typedef struct BnkfLikelihood {
  // What was measured less what was expected: elevation, azimuth (rad), range (m), range-rate (m/s); zero
  // where there is none.
  float innovation[4];
  // Normalised innovation squared.
  float nis;
  // Natural logarithm of the density.
  float ln_likelihood;
  // What the innovation is of: the sum of `BNKF_ELEVATION` and so on.
  uint8_t channels;
  // Degrees of freedom of the NIS.
  uint8_t degrees;
  // Whether a step's gate would pass the measurement. It passes many that are another target's: associate by
  // `nis` and `ln_likelihood`.
  bool passes_gate;
} BnkfLikelihood;







#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// A direction in the axes of a sensor that is turned by yaw, pitch and roll (rad), as one in the track's axes; what
// no measurement may have, and a turn that is not finite, is named, and nothing is written then.
//
// # Safety
// `direction` is room for a direction.
BnkfStatus bnkf_mounting_direction(float yaw_rad,
                                   float pitch_rad,
                                   float roll_rad,
                                   struct BnkfSensed elevation,
                                   struct BnkfSensed azimuth,
                                   struct BnkfDirection *direction);

// Checks the `length` bytes of `blob` and makes a model of them, which any number of tracks run on. The
// weights are not copied: the bytes stay as they are for as long as the model is used. A step is a little
// faster where they begin on a word boundary.
//
// # Safety
// `model` is room for a model that nobody else uses, and `blob` points to `length` bytes that nobody changes.
BnkfStatus bnkf_model_init(struct BnkfModel *model, const uint8_t *blob, size_t length);

// The checksum of the model's blob, by which logs and tracks know it.
//
// # Safety
// `model` is room for a model, and `checksum` for a number.
BnkfStatus bnkf_model_checksum(const struct BnkfModel *model, uint32_t *checksum);

// The settings that the model asks for: start from these.
//
// # Safety
// `model` is room for a model, and `settings` for settings.
BnkfStatus bnkf_model_settings(const struct BnkfModel *model, struct BnkfSettings *settings);

// Makes a workspace.
//
// # Safety
// `workspace` is room for a workspace that nobody else uses.
BnkfStatus bnkf_workspace_init(struct BnkfWorkspace *workspace);

// Makes a track that has seen nothing yet.
//
// # Safety
// `track` is room for a track that nobody else uses; `model` is room for a model; `settings` are settings.
BnkfStatus bnkf_track_init(struct BnkfTrack *track,
                           const struct BnkfModel *model,
                           const struct BnkfSettings *settings);

// The estimate at the time of a measurement. Refused, the measurement is ignored and the track as before.
//
// # Safety
// `track`, `model` and `workspace` are places of their kind, the first and the last used by nobody else;
// `measurement` is a measurement; `estimate` is room for an estimate.
BnkfStatus bnkf_track_step(struct BnkfTrack *track,
                           const struct BnkfModel *model,
                           struct BnkfWorkspace *workspace,
                           const struct BnkfMeasurement *measurement,
                           struct BnkfEstimate *estimate);

// The estimate at a time without a measurement, at most 60 s ahead; the covariance grows. `BNKF_STATUS_LOST`: the
// target was forgotten, and the next measurement starts anew.
//
// # Safety
// As of `bnkf_track_step`.
BnkfStatus bnkf_track_coast(struct BnkfTrack *track,
                            const struct BnkfModel *model,
                            struct BnkfWorkspace *workspace,
                            uint64_t time_us,
                            struct BnkfEstimate *estimate);

// Where the target will be at `count` times, which lie in order; the track stays as it is. Refused, some of
// the forecasts may have been written. `BNKF_STATUS_LOST`: one of them would be unsure by more than 100 km.
//
// # Safety
// As of `bnkf_track_step`; `times_us` points to `count` times and `forecasts` to room for as many estimates.
BnkfStatus bnkf_track_forecasts(struct BnkfTrack *track,
                                const struct BnkfModel *model,
                                struct BnkfWorkspace *workspace,
                                const uint64_t *times_us,
                                size_t count,
                                struct BnkfEstimate *forecasts);

// How well a measurement fits the track, which stays as it is.
//
// # Safety
// As of `bnkf_track_step`; `likelihood` is room for a likelihood.
BnkfStatus bnkf_track_likelihood(struct BnkfTrack *track,
                                 const struct BnkfModel *model,
                                 struct BnkfWorkspace *workspace,
                                 const struct BnkfMeasurement *measurement,
                                 struct BnkfLikelihood *likelihood);

// Time of the latest measurement or coast, microseconds; `BNKF_STATUS_NOT_STARTED` before the first.
//
// # Safety
// `track` is room for a track, and `time_us` for a number.
BnkfStatus bnkf_track_latest_us(const struct BnkfTrack *track, uint64_t *time_us);

// Forgets the target and all times, and starts the random stream again.
//
// # Safety
// `track` is room for a track that nobody else uses.
BnkfStatus bnkf_track_reset(struct BnkfTrack *track);

// Writes all that is known of the target as `BNKF_TRACK_SNAPSHOT_BYTES` bytes, the same on every computer.
//
// # Safety
// `track` is room for a track, and `bytes` for so many bytes.
BnkfStatus bnkf_track_to_bytes(const struct BnkfTrack *track, uint8_t *bytes);

// Makes the track that was written as `BNKF_TRACK_SNAPSHOT_BYTES` bytes; refused, the place is as before. Any
// bytes may be given.
//
// # Safety
// `track` is room for a track that nobody else uses, and `bytes` points to so many bytes.
BnkfStatus bnkf_track_from_bytes(struct BnkfTrack *track, const uint8_t *bytes);

// Lets another model of its kind go on with the track.
//
// # Safety
// `track` is room for a track that nobody else uses; `model` is room for a model.
BnkfStatus bnkf_track_hand_over(struct BnkfTrack *track, const struct BnkfModel *model);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* BNKF_H */

#ifdef __cplusplus
#define BNKF_ASSERT static_assert
#define BNKF_ALIGN_OF alignof
#else
#define BNKF_ASSERT _Static_assert
#define BNKF_ALIGN_OF _Alignof
#endif
BNKF_ASSERT(sizeof(BnkfModel) == BNKF_MODEL_BYTES, "BnkfModel");
BNKF_ASSERT(BNKF_ALIGN_OF(BnkfModel) == BNKF_ALIGNMENT, "BnkfModel");
BNKF_ASSERT(sizeof(BnkfWorkspace) == BNKF_WORKSPACE_BYTES, "BnkfWorkspace");
BNKF_ASSERT(BNKF_ALIGN_OF(BnkfWorkspace) == BNKF_ALIGNMENT, "BnkfWorkspace");
BNKF_ASSERT(sizeof(BnkfTrack) == BNKF_TRACK_BYTES, "BnkfTrack");
BNKF_ASSERT(BNKF_ALIGN_OF(BnkfTrack) == BNKF_ALIGNMENT, "BnkfTrack");
#undef BNKF_ASSERT
#undef BNKF_ALIGN_OF
