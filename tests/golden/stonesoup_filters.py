#!/usr/bin/env python3
"""Makes stonesoup_filters.json: EKF, UKF and CKF posteriors computed by Stone Soup.

Run it with any Python 3.10 or later: `python3 tests/golden/stonesoup_filters.py`. It makes a
virtual environment under target/ with the pinned packages, runs itself there and overwrites the
JSON file beside it. CI only reads that file.

The sequence is analytic (an inclined circle, a lemniscate and a level circle, one per noise
level), with noise from one fixed seed. Filters: constant velocity, q = 0.1 m^2/s^3, started at the truth with
P0 = diag(sigma_range^2 x 3, sigma_range_rate^2 x 3), as the paper set its baselines up.

Five things are not Stone Soup's defaults:
- `force_symmetric_covariance=True` for the EKF. Its update is P - K S K', whose rounding errors
  leave P slightly asymmetric. Nothing in the recursion damps that, so the asymmetry may grow from
  step to step and would be compared instead of the filter.
- UKF with alpha = 1, beta = 2, kappa = 0. With the customary alpha = 1e-3 the weights are of the
  order of 1e6 with opposite signs, P loses definiteness and the run ends in NaN.
- CKF as the unscented filter with alpha = 1, beta = 0, kappa = 0, which is the same rule. Stone
  Soup's own cubature classes take the covariance of state and reading from uncentred moments,
  which goes wrong with angles that are averaged on the circle.
- The state is ordered x, y, z, vx, vy, vz. Sigma points come from a Cholesky factor, which depends
  on the order: with position and velocity interleaved the UKF differs in the fourth digit.
- Elevation has the type Bearing, which wraps to +-pi. Stone Soup's Elevation folds a difference
  of two elevations into +-pi/2 by arcsin(sin), so that points 120 degrees apart count as 60.
"""

import json
import sys
from pathlib import Path

# Beside the folder of this script.
sys.path.append(str(Path(__file__).resolve().parent.parent))
import environment

PACKAGES = ["stonesoup==1.9.1", "numpy==2.4.6"]
HERE = Path(__file__).resolve().parent
VENV = HERE.parent.parent / "target" / "golden-venv-stonesoup"

SEED = 20_240_611
DT_S = 0.1
STEPS = 144
Q_M2_S3 = 0.1
COVARIANCE_EVERY = 8
# range m, elevation rad, azimuth rad, range-rate m/s
SIGMAS = {
    "low": (1.0, 0.001, 0.001, 0.01),
    "medium": (10.0, 0.01, 0.01, 0.1),
    "high": (100.0, 0.1, 0.1, 1.0),
}


def path(noise, t):
    """Position and velocity, shape (n, 3) each, m and m/s. x east, y north, z up."""
    import numpy as np

    one = np.ones_like(t)
    if noise == "low":  # inclined circle, crosses the azimuth cut at +-pi
        w, r, tilt = 0.45, 6.0, 0.5
        c, s = np.cos(w * t), np.sin(w * t)
        p = [-30.0 + r * c, r * s * np.cos(tilt), 12.0 + r * s * np.sin(tilt)]
        v = [-r * w * s, r * w * c * np.cos(tilt), r * w * c * np.sin(tilt)]
    elif noise == "medium":  # level lemniscate
        w, a, b = 0.35, 7.0, 3.5
        p = [22.0 + a * np.cos(w * t), 18.0 + b * np.sin(2 * w * t), 9.0 * one]
        v = [-a * w * np.sin(w * t), 2 * b * w * np.cos(2 * w * t), 0.0 * one]
    else:  # level circle
        w, r = -0.3, 8.0
        p = [10.0 + r * np.cos(w * t), -27.0 + r * np.sin(w * t), 15.0 * one]
        v = [-r * w * np.sin(w * t), r * w * np.cos(w * t), 0.0 * one]
    return np.stack(p, axis=1), np.stack(v, axis=1)


def polar(p, v):
    """[elevation, azimuth, range, range-rate] of positions and velocities."""
    import numpy as np

    r = np.linalg.norm(p, axis=1)
    return np.stack(
        [np.arcsin(p[:, 2] / r), np.arctan2(p[:, 1], p[:, 0]), r, (p * v).sum(axis=1) / r], axis=1
    )


def run(kind, sigmas, prior_mean, prior_variance, readings):
    import datetime as dt

    import numpy as np
    from stonesoup.models.measurement.nonlinear import CartesianToElevationBearingRangeRate
    from stonesoup.models.transition.linear import LinearGaussianTimeInvariantTransitionModel
    from stonesoup.predictor.kalman import ExtendedKalmanPredictor, UnscentedKalmanPredictor
    from stonesoup.types.angle import Bearing
    from stonesoup.types.array import StateVector
    from stonesoup.types.detection import Detection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.state import GaussianState
    from stonesoup.updater.kalman import ExtendedKalmanUpdater, UnscentedKalmanUpdater

    class Radar(CartesianToElevationBearingRangeRate):
        @staticmethod
        def _typed_vector():
            return np.array([[Bearing(0)], [Bearing(0)], [0.0], [0.0]])

    sr, se, sa, sd = sigmas
    one, none = np.eye(3), np.zeros((3, 3))
    motion = LinearGaussianTimeInvariantTransitionModel(
        transition_matrix=np.block([[one, DT_S * one], [none, one]]),
        covariance_matrix=Q_M2_S3
        * np.block(
            [[DT_S**3 / 3 * one, DT_S**2 / 2 * one], [DT_S**2 / 2 * one, DT_S * one]]
        ),
    )
    sensor = Radar(
        ndim_state=6,
        mapping=(0, 1, 2),
        velocity_mapping=(3, 4, 5),
        noise_covar=np.diag([se**2, sa**2, sr**2, sd**2]),
    )
    if kind == "ekf":
        predictor = ExtendedKalmanPredictor(motion)
        updater = ExtendedKalmanUpdater(sensor, force_symmetric_covariance=True)
    else:
        spread = {"alpha": 1.0, "beta": 2.0 if kind == "ukf" else 0.0, "kappa": 0.0}
        predictor = UnscentedKalmanPredictor(motion, **spread)
        updater = UnscentedKalmanUpdater(sensor, **spread)
    start = dt.datetime(2020, 1, 1)
    state = GaussianState(
        StateVector(prior_mean), np.diag(prior_variance), timestamp=start
    )
    means, covariances = [], []
    for k, z in enumerate(readings, start=1):
        time = start + dt.timedelta(milliseconds=100 * k)
        vector = StateVector([Bearing(z[0]), Bearing(z[1]), z[2], z[3]])
        prediction = predictor.predict(state, timestamp=time)
        detection = Detection(vector, timestamp=time, measurement_model=sensor)
        state = updater.update(SingleHypothesis(prediction, detection))
        mean = np.asarray(state.state_vector, dtype=float).reshape(6)
        covariance = np.asarray(state.covar, dtype=float)
        if not (np.isfinite(mean).all() and np.linalg.eigvalsh(covariance).min() > 0):
            raise SystemExit(f"{kind}: not finite or not positive definite at step {k}")
        means.append(mean.tolist())
        if k % COVARIANCE_EVERY == 0:
            covariances.append(covariance[np.triu_indices(6)].tolist())
    return {"mean": means, "covariance_upper": covariances}


def main():
    environment.enter(VENV, PACKAGES)
    import numpy as np
    import stonesoup

    rng = np.random.default_rng(SEED)
    levels = []
    for noise, sigmas in SIGMAS.items():
        t = DT_S * np.arange(STEPS + 1)
        p, v = path(noise, t)
        sr, se, sa, sd = sigmas
        z = polar(p, v) + rng.standard_normal((STEPS + 1, 4)) * [se, sa, sr, sd]
        z[:, 1] = (z[:, 1] + np.pi) % (2 * np.pi) - np.pi
        prior_mean = np.concatenate([p[0], v[0]]).tolist()
        prior_variance = [sr**2] * 3 + [sd**2] * 3
        level = {
            "noise": noise,
            "sigmas": {"elevation_rad": se, "azimuth_rad": sa, "range_m": sr, "range_rate_mps": sd},
            "prior_mean": prior_mean,
            "prior_variance": prior_variance,
            "readings": z[1:].tolist(),
        }
        for kind in ("ekf", "ukf", "ckf"):
            level[kind] = run(kind, sigmas, prior_mean, prior_variance, z[1:])
            error = np.linalg.norm(np.array(level[kind]["mean"])[:, :3] - p[1:], axis=1)
            print(f"{noise} {kind}: mean error {error.mean():.3f} m, last {error[-1]:.3f} m")
        levels.append(level)
    document = {
        "made_by": "tests/golden/stonesoup_filters.py",
        "stonesoup": stonesoup.__version__,
        "numpy": np.__version__,
        "state": ["x", "y", "z", "vx", "vy", "vz"],
        "reading": ["elevation", "azimuth", "range", "range_rate"],
        "dt_s": DT_S,
        "q_m2_s3": Q_M2_S3,
        "covariance_every": COVARIANCE_EVERY,
        "levels": levels,
    }
    out = HERE / "stonesoup_filters.json"
    out.write_text(json.dumps(document, separators=(",", ":")) + "\n")
    print(f"{out.name}: {out.stat().st_size} bytes")


if __name__ == "__main__":
    main()
