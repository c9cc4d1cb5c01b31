"""A GRU that tracks: 64 units on the polar readings, their sigmas and time.

Its answer is a correction of the reading, fused with the population's range and elevation, along the three axes of the
line of sight and in units of what is known there, with a Cholesky factor of its covariance. Where it was last and how it moved
come back as inputs. In a gap it corrects its own last answer instead.
"""

import jax
import jax.numpy as jnp

import likelihood
import polar
import recurrent
from recurrent import soft

UNITS, INPUTS = 64, 26


def create(key):
    one, two = jax.random.split(key)
    return {"cell": recurrent.gru(one, INPUTS, UNITS), "head": recurrent.dense(two, UNITS + INPUTS, 9, 0.1)}


def start():
    zero = jnp.zeros(3)
    return {
        "h": jnp.zeros(UNITS), "mean": zero, "moved": zero, "scale": zero + 1.0,
        "silent_s": 0.0, "rate": 0.0, "age_s": 0.0, "is_new": True,
    }


def step(params, known, state, seen):
    """One sample; `known` is polar.population's."""
    dt, z, sigma, there = seen["dt"], seen["z"], seen["sigma"], seen["there"]
    first = state["is_new"]
    r, sr = polar.fused(z[0], sigma[0], known[0], known[1], jnp)
    el, se = polar.fused(z[1], sigma[1], known[2], known[3], jnp)
    reading = polar.cartesian(r, el, z[2], jnp)
    scale = jnp.stack([sr, jnp.clip(r * jnp.cos(el), 0.05 * r, 20.0 / sigma[2]) * sigma[2], r * se])
    silent_s = jnp.where(there, 0.0, state["silent_s"] + dt)
    anchor = jnp.where(there, reading, state["mean"])
    last = jnp.where(first, reading, state["mean"])
    scale = jnp.where(there, scale, state["scale"])
    spread = jnp.sqrt(scale**2 + (1.5 * silent_s) ** 2)
    r, el, az, _ = polar.polar(anchor, anchor, jnp)
    frame = polar.axes(el, az, jnp)
    away, moved = (anchor - last) @ frame, state["moved"] @ frame
    rate = jnp.where(there, z[3], state["rate"])
    inputs = jnp.concatenate([
        soft(away / spread), soft(away / 3.0), soft(moved / 2.0),
        0.5 * jnp.log(spread), 0.3 * jnp.log(sigma) + 0.5,
        jnp.stack([
            (r - known[0]) / known[1], (el - known[2]) / known[3], rate / 2.0,
            soft((rate - moved[0]) / (0.3 + sigma[3])), rate / (1.0 + sigma[3]),
            10.0 * dt, silent_s, there * 1.0, jnp.exp(-state["age_s"]), jnp.exp(-0.2 * state["age_s"]),
        ]),
    ])
    h = recurrent.step(params["cell"], state["h"], inputs)
    answer = recurrent.apply(params["head"], jnp.concatenate([h, inputs]))
    mean = anchor + frame @ (spread * answer[:3])
    factor = recurrent.factor(answer[3:])
    moved = jnp.where(first, jnp.zeros(3), (mean - last) / jnp.maximum(dt, 1e-3))
    new = {
        "h": h, "mean": mean, "moved": moved, "scale": scale,
        "silent_s": silent_s, "rate": rate, "age_s": state["age_s"] + dt, "is_new": False,
    }
    return new, {"mean": mean, "frame": frame, "spread": spread, "factor": factor}


def track(params, known, flight):
    """Answers at all steps of one flight."""
    seen = {name: flight[name] for name in ("dt", "z", "sigma", "there")}
    return jax.lax.scan(lambda state, one: step(params, known, state, one), start(), seen)[1]


def loss(params, known, flight, typical_m):
    """Negative log-likelihood of the truth, and the distance beside a typical one: what our own training weighs, too."""
    answer = jax.tree.map(lambda x: x[1:], track(params, known, flight))
    error = flight["truth"][1:] - answer["mean"]
    return likelihood.loss(error, answer).mean() + likelihood.distance(error).mean() / typical_m
