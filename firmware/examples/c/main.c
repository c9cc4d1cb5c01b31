/* A tracker's whole life in C, without a heap: models are checked, a track begins, takes measurements with
   channels missing, goes through gaps, forecasts, says how well plots fit, and is written down and read again.

   Prints one number for all answers. It is the number of the Rust program src/bin/same-bits, which flies the
   same, and it is the same on a host and on a microcontroller (tests/from_c.rs). Compile with
   -ffp-contract=off: the measurements are computed here, and a fused multiply-add would change them. */
#include "bnkf.h"
#include "program.h"

enum { STEPS = 24, SNAPSHOT = 12, FORECASTS = 3 };

/* All memory there is; what is zero holds nothing yet. */
static BnkfModel model;
static BnkfWorkspace workspace;
static BnkfTrack track;
static BnkfEstimate estimates[FORECASTS];
static uint8_t bytes[BNKF_TRACK_SNAPSHOT_BYTES];

/* FNV-1a. */
static uint64_t hash = 0xCBF29CE484222325u;

static void add_byte(uint8_t byte) { hash = (hash ^ byte) * 0x100000001B3u; }

static void add_number(uint64_t number, int size) {
    for (int i = 0; i < size; i++) {
        add_byte((uint8_t)(number >> (8 * i)));
    }
}

static void add_floats(const float *floats, int count) {
    for (int i = 0; i < count; i++) {
        union {
            float number;
            uint32_t bits;
        } of = {.number = floats[i]};
        add_number(of.bits, 4);
    }
}

static bool add_status(BnkfStatus status) {
    add_byte(status);
    return status == BNKF_STATUS_OK;
}

static void add_estimate(const BnkfEstimate *e) {
    add_number(e->time_us, 8);
    add_floats(e->position_m, 3);
    add_floats(&e->covariance_m2[0][0], 9);
    add_floats((const float[]){e->nis, e->manoeuvre, e->outlier}, 3);
    add_byte(e->mode);
    add_byte(e->outside);
    add_byte(e->has_motion);
    if (e->has_motion) {
        add_floats(e->velocity_mps, 3);
        add_floats(e->acceleration_mps2, 3);
        add_floats(&e->covariance[0][0], 81);
    }
}

static void add_likelihood(const BnkfLikelihood *l) {
    static const uint8_t channels[] = {BNKF_ELEVATION, BNKF_AZIMUTH, BNKF_RANGE, BNKF_RANGE_RATE};
    for (int i = 0; i < 4; i++) {
        add_byte((l->channels & channels[i]) != 0);
        add_floats(&l->innovation[i], 1);
    }
    add_floats((const float[]){l->nis, l->ln_likelihood}, 2);
    add_byte(l->degrees);
    add_byte(l->passes_gate);
}

/* A value with an error of a tenth of its sigma's size. */
static BnkfSensed sensed(float value, float sigma, unsigned step, unsigned channel) {
    float error = (float)((step * 7 + channel * 3) % 11) * 0.04f - 0.2f;
    return (BnkfSensed){.value = value + sigma * error, .sigma = sigma};
}

/* A target that rises and turns, seen by a radar that is turned and tilted. */
static BnkfMeasurement measurement(unsigned step) {
    float along = (float)step;
    float wild = step == 13 ? 25.0f : 0.0f;
    BnkfMeasurement seen = {
        .time_us = 100000u * (uint64_t)step,
        .range = sensed(30.0f + 0.15f * along + wild, 0.5f, step, 0),
        .range_rate = sensed(1.5f, 0.1f, step, 3),
        .channels = BNKF_ELEVATION | BNKF_AZIMUTH | BNKF_RANGE | BNKF_RANGE_RATE,
    };
    BnkfDirection direction;
    BnkfStatus status = bnkf_mounting_direction(
        0.9f, 0.1f, -0.05f, sensed(0.2f + 0.006f * along, 0.01f, step, 1),
        sensed(-0.6f + 0.04f * along, 0.01f, step, 2), &direction);
    if (status != BNKF_STATUS_OK) {
        add_status(status);
        return seen;
    }
    seen.elevation = direction.elevation;
    seen.azimuth = direction.azimuth;
    if (!direction.has_azimuth) {
        seen.channels &= (uint8_t)~BNKF_AZIMUTH;
    }
    if (step % 7 == 3) {
        seen.channels &= (uint8_t)~(BNKF_ELEVATION | BNKF_RANGE_RATE);
    }
    if (step % 11 == 6) {
        seen.channels &= (uint8_t)~BNKF_RANGE;
    }
    /* Another radar, on a vehicle. */
    if (step == 16) {
        seen.sensor_position_m[0] = 0.5f;
        seen.sensor_position_m[1] = -0.25f;
        seen.sensor_position_m[2] = 1.0f;
        seen.sensor_velocity_mps[1] = 0.125f;
    }
    return seen;
}

/* As after a reset of the board: all that is left of the track are its bytes. */
static void write_and_read(void) {
    BnkfStatus status = bnkf_track_to_bytes(&track, bytes);
    for (unsigned i = 0; i < BNKF_TRACK_SNAPSHOT_BYTES; i++) {
        add_byte(bytes[i]);
    }
    if (status == BNKF_STATUS_OK) {
        status = bnkf_track_reset(&track);
    }
    if (status == BNKF_STATUS_OK) {
        status = bnkf_track_from_bytes(&track, bytes);
    }
    add_status(status);
}

static void run_step(unsigned step) {
    uint64_t time_us = 100000u * (uint64_t)step;
    if (step % 5 == 4) {
        if (add_status(bnkf_track_coast(&track, &model, &workspace, time_us, estimates))) {
            add_estimate(estimates);
        }
    } else {
        BnkfMeasurement seen = measurement(step);
        BnkfLikelihood fit;
        if (add_status(bnkf_track_likelihood(&track, &model, &workspace, &seen, &fit))) {
            add_likelihood(&fit);
        }
        if (add_status(bnkf_track_step(&track, &model, &workspace, &seen, estimates))) {
            add_estimate(estimates);
        }
    }
    const uint64_t ahead_us[FORECASTS] = {time_us + 50000, time_us + 1000000, time_us + 2500000};
    if (add_status(bnkf_track_forecasts(&track, &model, &workspace, ahead_us, FORECASTS, estimates))) {
        for (int i = 0; i < FORECASTS; i++) {
            add_estimate(&estimates[i]);
        }
    }
}

static void run(BnkfInference inference) {
    BnkfSettings settings;
    BnkfStatus status = bnkf_model_settings(&model, &settings);
    settings.inference = inference;
    if (status == BNKF_STATUS_OK) {
        status = bnkf_track_init(&track, &model, &settings);
    }
    if (status != BNKF_STATUS_OK) {
        add_status(status);
        return;
    }
    for (unsigned step = 0; step < STEPS; step++) {
        if (step == SNAPSHOT) {
            write_and_read();
        }
        run_step(step);
    }
}

static void run_passes(uint16_t count) {
    run((BnkfInference){.kind = BNKF_INFERENCE_KIND_PASSES, .passes = count});
    run((BnkfInference){.kind = BNKF_INFERENCE_KIND_FROZEN_PASSES, .passes = count});
}

static void run_moments(void) {
    run((BnkfInference){.kind = BNKF_INFERENCE_KIND_MOMENTS});
}

static bool load(const uint8_t *blob, const uint8_t *end) {
    BnkfStatus status = bnkf_model_init(&model, blob, (size_t)(end - blob));
    return status == BNKF_STATUS_OK || add_status(status);
}

int main(void) {
    BnkfStatus status = bnkf_workspace_init(&workspace);
    if (status != BNKF_STATUS_OK) {
        add_status(status);
    }
    if (load(recursive, recursive_end)) {
        run((BnkfInference){.kind = BNKF_INFERENCE_KIND_MEAN});
        run_passes(6);
        run_moments();
    }
    if (load(tiny_bnkf, tiny_bnkf_end)) {
        run_passes(9);
        run_moments();
    }
    if (load(tiny_bnkfe, tiny_bnkfe_end)) {
        run_passes(5);
        run_moments();
    }
    char text[] = "0123456789abcdef\n";
    for (int i = 0; i < 16; i++) {
        text[i] = "0123456789abcdef"[(hash >> (60 - 4 * i)) & 15];
    }
    say(text);
    return 0;
}
