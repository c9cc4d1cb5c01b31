"""A Kalman filter whose gain a GRU gives, after KalmanNet (Revach et al. 2022), with a covariance after Recursive KalmanNet.

State: position and velocity, straight flight between readings. Innovations are the exact polar ones. The gain stands along
the axes of the line of sight to the prediction, in units of what a reading and the population leave unknown. As in KalmanNet
distances alone train the gain; a second head gives a Cholesky factor, trained by the likelihood of the errors that the
gain leaves, which the gain does not feel.
"""

import jax
import jax.numpy as jnp

import likelihood
import polar
import recurrent
from recurrent import soft

UNITS, INPUTS = 64, 29
# What a channel says of its own axis: its place, its speed.
OWN = jnp.zeros((6, 4)).at[jnp.arange(6), jnp.arange(6) % 3].set(1.0).at[3, 3].set(1.0)


def create(key):
    keys = jax.random.split(key, 4)
    params = {
        "cell": recurrent.gru(keys[0], INPUTS, UNITS),
        "head": recurrent.dense(keys[1], UNITS + INPUTS, 24, 0.01),
        "doubt": recurrent.dense(keys[2], UNITS + INPUTS, 32),
        "factor": recurrent.dense(keys[3], 32, 6, 0.1),
    }
    # Gains before training: a third of what one reading would give, of a range-rate nearly all.
    params["head"]["b"] = (-1.0 * OWN).at[3, 3].set(2.0).ravel()
    return params


def start():
    zero = jnp.zeros(3)
    return {
        "h": jnp.zeros(UNITS), "mean": zero, "velocity": zero, "corrected": jnp.zeros(6),
        "last": jnp.zeros(4), "silent_s": 0.0, "age_s": 0.0, "is_new": True,
    }


def step(params, known, state, seen):
    """One sample; `known` is polar.population's."""
    dt, z, sigma, there = seen["dt"], seen["z"], seen["sigma"], seen["there"]
    first = state["is_new"]
    r, _ = polar.fused(z[0], sigma[0], known[0], known[1], jnp)
    el, _ = polar.fused(z[1], sigma[1], known[2], known[3], jnp)
    predicted = jnp.where(first, polar.cartesian(r, el, z[2], jnp), state["mean"] + dt * state["velocity"])
    r, el, az, _ = polar.polar(predicted, predicted, jnp)
    r = jnp.maximum(r, 1.0)
    frame = polar.axes(el, az, jnp)
    outbound, _ = polar.fused(z[3], sigma[3], 0.0, 1.5, jnp)
    velocity = jnp.where(first, outbound * frame[:, 0], state["velocity"])
    rate = velocity @ frame[:, 0]
    # Range, azimuth, elevation, range-rate: the order of the axes.
    nu = jnp.stack([z[0] - r, polar.wrapped(z[2] - az, jnp), polar.wrapped(z[1] - el, jnp), z[3] - rate])
    noise = jnp.stack([sigma[0], sigma[2], sigma[1], sigma[3]])
    nu = jnp.where(there & ~first, nu / noise, 0.0)
    metres = noise[:3] * jnp.stack([1.0, r * jnp.maximum(jnp.cos(el), 0.05), r])
    unknown = jnp.stack([known[1], 20.0, r * known[3]])
    spread = metres * unknown / jnp.sqrt(metres**2 + unknown**2)
    rate_spread = noise[3] * 1.5 / jnp.sqrt(noise[3] ** 2 + 1.5**2)
    silent_s = jnp.where(there, 0.0, state["silent_s"] + dt)
    inputs = jnp.concatenate([
        soft(nu / 2.0), soft((nu - state["last"]) / 2.0), soft(nu[:3] * spread / metres), soft(3.0 * state["corrected"]),
        soft(velocity @ frame / 2.0),
        0.5 * jnp.log(spread), 0.3 * jnp.log(noise[3:]) + 0.5,
        jnp.stack([soft((r - known[0]) / known[1]), soft((el - known[2]) / known[3]), silent_s, there * 1.0, jnp.exp(-state["age_s"])]),
    ])
    h = recurrent.step(params["cell"], state["h"], inputs)
    both = jnp.concatenate([h, inputs])
    # The gain in metres and m/s for an innovation of one sigma; a range-rate moves nothing farther than its own error.
    near, slow = jnp.minimum(spread, 0.3 * rate_spread), jnp.stack([rate_spread, 0.5, 0.5])
    of_places = jnp.concatenate([spread, slow])[:, None] * (spread / metres)
    of_rate = jnp.concatenate([near, jnp.full(3, rate_spread)])[:, None] * (rate_spread / noise[3])
    raw = recurrent.apply(params["head"], both).reshape(6, 4)
    # Between none and all of a reading on its own axis, and less across: such a loop stays stable.
    share = OWN * jax.nn.sigmoid(raw) + (1.0 - OWN) * 0.3 * jnp.tanh(raw)
    gain = share * jnp.concatenate([of_places, of_rate], axis=1)
    corrected = gain @ nu
    # Far beyond any flight: a gain that is not stable yet must not end in numbers that are none, which teach nothing.
    mean = jnp.clip(predicted + frame @ corrected[:3], -150.0, 150.0)
    velocity = jnp.clip(velocity + frame @ corrected[3:], -20.0, 20.0)
    doubt = jnp.tanh(recurrent.apply(params["doubt"], jax.lax.stop_gradient(both)))
    factor = recurrent.factor(recurrent.apply(params["factor"], doubt))
    new = {
        "h": h, "mean": mean, "velocity": velocity, "corrected": corrected, "last": jnp.where(there, nu, state["last"]),
        "silent_s": silent_s, "age_s": state["age_s"] + dt, "is_new": False,
    }
    return new, {"mean": mean, "frame": frame, "spread": spread + silent_s, "factor": factor}


def track(params, known, flight):
    """Answers at all steps of one flight."""
    seen = {name: flight[name] for name in ("dt", "z", "sigma", "there")}
    return jax.lax.scan(lambda state, one: step(params, known, state, one), start(), seen)[1]


def loss(params, known, flight, typical_m):
    """The distance beside a typical one, and the likelihood of errors that are taken as they are."""
    answer = jax.tree.map(lambda x: x[1:], track(params, known, flight))
    error = flight["truth"][1:] - answer["mean"]
    kept = {name: jax.lax.stop_gradient(answer[name]) for name in ("frame", "spread")} | {"factor": answer["factor"]}
    return likelihood.loss(jax.lax.stop_gradient(error), kept).mean() + 3.0 * likelihood.distance(error).mean() / typical_m
