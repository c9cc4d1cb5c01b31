"""A GRU on two seconds of positions that says where the target is half a second and one second later.

64 units on the positions' differences from the newest and from the one before, along the axes of the line of sight; positions are
readings fused with the population's range and elevation, whose sigmas and range-rate are inputs too. At level `clean`
readings are the truth to a millimetre. Trained for distance, at a rate of 1.0.
"""

import jax
import jax.numpy as jnp

import likelihood
import polar
import recurrent
from recurrent import soft

UNITS, INPUTS = 64, 13
HISTORY, AHEAD = 20, (5, 10)  # samples of 0.1 s


def create(key):
    one, two = jax.random.split(key)
    return {"cell": recurrent.gru(one, INPUTS, UNITS), "head": recurrent.dense(two, UNITS + INPUTS, 3 * len(AHEAD), 0.1)}


def places(known, z, sigma):
    """Positions (..., 3) of readings and their standard deviations along the line of sight's axes."""
    r, sr = polar.fused(z[..., 0], sigma[..., 0], known[0], known[1], jnp)
    el, se = polar.fused(z[..., 1], sigma[..., 1], known[2], known[3], jnp)
    spread = jnp.stack([sr, jnp.clip(r * jnp.cos(el), 0.05 * r, 20.0 / sigma[..., 2]) * sigma[..., 2], r * se], axis=-1)
    return polar.cartesian(r, el, z[..., 2], jnp), spread


def predict(params, known, z, sigma):
    """Positions (len(AHEAD), 3) after HISTORY + 1 readings."""
    position, spread = places(known, z, sigma)
    newest = position[-1]
    r, el, az, _ = polar.polar(newest, newest, jnp)
    frame = polar.axes(el, az, jnp)
    step = jnp.diff(position, axis=0, prepend=position[:1])
    place = jnp.broadcast_to(jnp.stack([(r - known[0]) / known[1], (el - known[2]) / known[3]]), (len(z), 2))
    inputs = jnp.concatenate([
        soft((position - newest) @ frame / 2.0), soft(step @ frame / (0.2 + spread)), z[:, 3:] / (1.5 + sigma[:, 3:]),
        0.3 * jnp.log(spread), soft(place), 0.3 * jnp.log(sigma[:, 3:]) + 0.5,
    ], axis=-1)
    h, _ = jax.lax.scan(lambda h, x: (recurrent.step(params["cell"], h, x), None), jnp.zeros(UNITS), inputs)
    answer = recurrent.apply(params["head"], jnp.concatenate([h, inputs[-1]]))
    scale = jnp.sqrt(1.0 + spread[-1] ** 2)
    return newest + (answer.reshape(len(AHEAD), 3) * scale) @ frame.T


def windows(params, known, z, sigma, ends):
    """Forecasts (ends, horizons, 3) of one flight's readings after the samples `ends`."""
    rows = ends[:, None] + jnp.arange(-HISTORY, 1)
    return jax.vmap(lambda rows: predict(params, known, z[rows], sigma[rows]))(rows)


def loss(params, known, flight, typical_m):
    ends = jnp.arange(HISTORY, flight["truth"].shape[0] - AHEAD[-1], 15)
    answer = windows(params, known, flight["z"], flight["sigma"], ends)
    truth = flight["truth"][ends[:, None] + jnp.array(AHEAD)]
    return likelihood.distance(truth - answer).mean() / typical_m
