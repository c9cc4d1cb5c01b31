#!/usr/bin/env python3
"""Makes filterpy_imm.json: posteriors of a five-model IMM computed by FilterPy.

Run it with any Python 3.10 or later: `python3 tests/golden/filterpy_imm.py`. It makes a virtual
environment under target/ with the pinned packages, runs itself there and overwrites the JSON file
beside it. CI only reads that file.

Readings, priors and noise levels are those of stonesoup_filters.json. The models are straight
flight and level turns at half and full rate to both sides, with damped velocity; their transition
comes from scipy's matrix exponential and their noise from Van Loan's block matrix, so the test also
checks the discretisation. FilterPy has no extended filter that an IMM can drive: the class below
only hands the measurement function to FilterPy's EKF.
"""

import json
import sys
from pathlib import Path

# Beside the folder of this script.
sys.path.append(str(Path(__file__).resolve().parent.parent))
import environment

PACKAGES = ["filterpy==2.0.0", "numpy==2.4.6", "scipy==1.17.1"]
HERE = Path(__file__).resolve().parent
VENV = HERE.parent.parent / "target" / "golden-venv-filterpy"

TURN_RATE_RADPS = 1.2
DAMPING_PER_S = 0.3
Q_M2_S3 = 0.8
SOJOURN_S = 3.0
PARTS = [0.0, -0.5, 0.5, -1.0, 1.0]
EVERY = 4


def discrete(turn_rate, dt):
    """Transition and noise by Van Loan's method; state x, y, z, vx, vy, vz."""
    import numpy as np
    from scipy.linalg import expm

    drift = np.zeros((6, 6))
    drift[:3, 3:] = np.eye(3)
    drift[3:, 3:] = -DAMPING_PER_S * np.eye(3)
    drift[3, 4], drift[4, 3] = -turn_rate, turn_rate
    diffusion = np.zeros((6, 6))
    diffusion[3:, 3:] = Q_M2_S3 * np.eye(3)
    block = np.zeros((12, 12))
    block[:6, :6] = -drift
    block[:6, 6:] = diffusion
    block[6:, 6:] = drift.T
    e = expm(block * dt)
    transition = e[6:, 6:].T
    return transition, transition @ e[:6, 6:]


def reading(x):
    import numpy as np

    p, v = x[:3], x[3:]
    r = np.linalg.norm(p)
    return np.array([np.arcsin(p[2] / r), np.arctan2(p[1], p[0]), r, p @ v / r])


def jacobian(x):
    """Derivative of `reading` by complex steps: exact to rounding, and nobody's algebra."""
    import numpy as np

    def complex_reading(x):
        p, v = x[:3], x[3:]
        r = np.sqrt(p @ p)
        half = p[1] / (np.sqrt(p[0] * p[0] + p[1] * p[1]) + p[0])  # tan of half the azimuth
        return np.array([np.arcsin(p[2] / r), 2 * np.arctan(half), r, p @ v / r])

    h = np.empty((4, 6))
    for i in range(6):
        at = x.astype(complex)
        at[i] += 1e-30j
        h[:, i] = complex_reading(at).imag / 1e-30
    return h


def difference(z, expected):
    import numpy as np

    d = z - expected
    d[:2] = (d[:2] + np.pi) % (2 * np.pi) - np.pi
    return d


def main():
    environment.enter(VENV, PACKAGES)
    import filterpy
    import numpy as np
    from filterpy.kalman import ExtendedKalmanFilter, IMMEstimator
    from scipy.linalg import expm

    class Ekf(ExtendedKalmanFilter):
        def predict(self, u):
            super().predict(0 if u is None else u)

        def update(self, z):
            super().update(z, jacobian, reading, residual=difference)

    source = json.loads((HERE / "stonesoup_filters.json").read_text())
    dt = source["dt_s"]
    # A target leaves its model at a rate of 1 / SOJOURN_S for any of the four others.
    generator = np.full((5, 5), 1 / (4 * SOJOURN_S))
    np.fill_diagonal(generator, -1 / SOJOURN_S)
    switching = expm(generator * dt)
    levels = []
    for level in source["levels"]:
        s = level["sigmas"]
        sigma = [s["elevation_rad"], s["azimuth_rad"], s["range_m"], s["range_rate_mps"]]
        filters = []
        for part in PARTS:
            f = Ekf(dim_x=6, dim_z=4)
            f.x = np.array(level["prior_mean"])
            f.P = np.diag(level["prior_variance"])
            f.F, f.Q = discrete(part * TURN_RATE_RADPS, dt)
            f.R = np.diag(np.square(sigma))
            filters.append(f)
        imm = IMMEstimator(filters, [0.2] * 5, switching)
        means, covariances, probabilities = [], [], []
        for k, z in enumerate(level["readings"], start=1):
            imm.predict()
            imm.update(np.array(z))
            if k % EVERY == 0:
                means.append(imm.x.tolist())
                covariances.append(imm.P[np.triu_indices(6)].tolist())
                probabilities.append(imm.mu.tolist())
        print(level["noise"], "last probabilities", np.round(imm.mu, 3))
        levels.append(
            {
                "noise": level["noise"],
                "mean": means,
                "covariance_upper": covariances,
                "probability": probabilities,
            }
        )
    document = {
        "made_by": "tests/golden/filterpy_imm.py",
        "filterpy": filterpy.__version__,
        "turn_rate_radps": TURN_RATE_RADPS,
        "damping_per_s": DAMPING_PER_S,
        "q_m2_s3": Q_M2_S3,
        "sojourn_s": SOJOURN_S,
        "every": EVERY,
        "levels": levels,
    }
    out = HERE / "filterpy_imm.json"
    out.write_text(json.dumps(document, separators=(",", ":")) + "\n")
    print(f"{out.name}: {out.stat().st_size} bytes")


if __name__ == "__main__":
    main()
