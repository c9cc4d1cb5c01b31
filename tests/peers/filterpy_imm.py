"""FilterPy's IMM of five extended Kalman filters: straight flight and level turns at half and full rate to both sides.

The models are those of tests/golden/filterpy_imm.py: velocity that is damped, white acceleration, discrete by Van Loan's
matrix. FilterPy has no extended filter that its IMM can drive; the class below hands it the measurement function.
"""

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter, IMMEstimator
from scipy.linalg import expm

import polar

WHAT = "q (m^2/s^3), full turn rate (rad/s), damping (1/s):"
GRID = [(q, turn, damping) for q in (0.3, 1.0) for turn, damping in ((0.6, 0.1), (1.2, 0.1), (1.2, 0.4))]
SOJOURN_S, PARTS = 3.0, [0.0, -0.5, 0.5, -1.0, 1.0]


def expected(x):
    return np.array(polar.polar(x[:3], x[3:]))


def jacobian(x):
    r, el, az, rate = polar.polar(x[:3], x[3:])
    out, across, up = polar.axes(el, az).T
    h = np.zeros((4, 6))
    h[0, :3], h[1, :3], h[2, :3] = out, up / r, across / (r * np.cos(el))
    h[3, :3], h[3, 3:] = (x[3:] - rate * out) / r, out
    return h


def difference(z, other):
    d = z - other
    d[1:3] = polar.wrapped(d[1:3])
    return d


class Extended(ExtendedKalmanFilter):
    def predict(self, u):
        super().predict(0 if u is None else u)

    def update(self, z):
        if z is not None:
            super().update(z, jacobian, expected, residual=difference)


def discrete(turn, dt, q, damping):
    """Transition and noise."""
    drift = np.zeros((6, 6))
    drift[:3, 3:] = np.eye(3)
    drift[3:, 3:] = -damping * np.eye(3)
    drift[3, 4], drift[4, 3] = -turn, turn
    block = np.zeros((12, 12))
    block[:6, :6], block[3:6, 9:], block[6:, 6:] = -drift, q * np.eye(3), drift.T
    e = expm(block * dt)
    transition = e[6:, 6:].T
    return transition, transition @ e[:6, 6:]


def track(_, setting, begin, t, z, sigma, there):
    """Yields position and covariance after every sample; samples are evenly spaced."""
    q, full, damping = setting
    dt = float(t[1] - t[0])
    leave = np.full((5, 5), 1 / (4 * SOJOURN_S))
    np.fill_diagonal(leave, -1 / SOJOURN_S)
    filters = []
    for part in PARTS:
        one = Extended(dim_x=6, dim_z=4)
        one.x, one.P = begin[0].copy(), begin[1].copy()
        one.F, one.Q = discrete(part * full, dt, q, damping)
        one.R = np.diag(sigma[0] ** 2)
        filters.append(one)
    imm = IMMEstimator(filters, np.full(5, 0.2), expm(leave * dt))
    yield begin[0][:3], begin[1][:3, :3]
    for reading, seen in zip(z[1:], there[1:]):
        imm.predict()
        if seen:
            imm.update(reading)
            yield imm.x[:3].copy(), imm.P[:3, :3].copy()
        else:
            yield imm.x_prior[:3].copy(), imm.P_prior[:3, :3].copy()
