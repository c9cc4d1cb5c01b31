"""Polar readings and what the population of flights says of them; for numpy and jax.numpy arrays alike.

Metres, seconds, radians; x east, y north, z up, the radar in the origin; azimuth from +x towards +y. A reading is
[range, elevation, azimuth, range-rate], the order of the four sigmas too.

>>> p = cartesian(np.array([10.0]), np.array([0.3]), np.array([-2.0]))
>>> [round(float(part[0]), 12) for part in polar(p, np.zeros((1, 3)))]
[10.0, 0.3, -2.0, 0.0]
>>> a = axes(np.array(0.3), np.array(-2.0))
>>> bool(np.allclose(a @ a.T, np.eye(3))) and bool(np.allclose(10 * a[:, 0], p[0]))
True
>>> [round(float(wrapped(np.array(angle))), 6) for angle in (3.5, -3.5, 1.0)]
[-2.783185, 2.783185, 1.0]
>>> [round(float(x), 6) for x in fused(np.array(30.0), np.array(2.0), 36.0, 2.0)]
[33.0, 1.414214]
"""

import numpy as np


def wrapped(angle, xp=np):
    """The same angle in [-pi, pi)."""
    return xp.mod(angle + xp.pi, 2 * xp.pi) - xp.pi


def cartesian(r, el, az, xp=np):
    """Positions (..., 3)."""
    return xp.stack([r * xp.cos(el) * xp.cos(az), r * xp.cos(el) * xp.sin(az), r * xp.sin(el)], axis=-1)


def polar(position, velocity, xp=np):
    """Range, elevation, azimuth and range-rate."""
    x, y, z = position[..., 0], position[..., 1], position[..., 2]
    r = xp.sqrt((position**2).sum(-1))
    return r, xp.arcsin(z / r), xp.arctan2(y, x), (position * velocity).sum(-1) / r


def axes(el, az, xp=np):
    """Columns: unit vectors outbound, towards greater azimuth, towards greater elevation (..., 3, 3)."""
    ce, se, ca, sa = xp.cos(el), xp.sin(el), xp.cos(az), xp.sin(az)
    zero = xp.zeros_like(el)
    columns = [xp.stack(column, axis=-1) for column in ([ce * ca, ce * sa, se], [-sa, ca, zero], [-se * ca, -se * sa, ce])]
    return xp.stack(columns, axis=-1)


def fused(value, sigma, mean, sd, xp=np):
    """A reading fused with what the population says of the same quantity: mean and sigma."""
    share = sd**2 / (sd**2 + sigma**2)
    return mean + share * (value - mean), sigma * xp.sqrt(share)


def population(position, velocity):
    """[mean range, its sd, mean elevation, its sd, sd of a horizontal velocity, sd of the vertical one]."""
    r, el, _, _ = polar(position, velocity)
    across = np.sqrt((velocity[..., :2] ** 2).mean())
    return np.array([r.mean(), r.std(), el.mean(), el.std(), across, np.sqrt((velocity[..., 2] ** 2).mean())])
