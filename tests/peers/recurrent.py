"""A gated recurrent unit and a dense layer in plain JAX."""

import jax
import jax.numpy as jnp


def dense(key, inputs, outputs, gain=1.0):
    return {"w": gain / inputs**0.5 * jax.random.normal(key, (inputs, outputs)), "b": jnp.zeros(outputs)}


def apply(layer, x):
    return x @ layer["w"] + layer["b"]


def gru(key, inputs, units):
    """Cho et al. 2014, with the reset after the product, as cuDNN has it: one product a step for each of input and state."""
    one, two = jax.random.split(key)
    return {"in": dense(one, inputs, 3 * units), "state": dense(two, units, 3 * units)}


def step(cell, h, x):
    units = h.shape[-1]
    a, b = apply(cell["in"], x), apply(cell["state"], h)
    gates = jax.nn.sigmoid(a[..., : 2 * units] + b[..., : 2 * units])
    reset, keep = gates[..., :units], gates[..., units:]
    new = jnp.tanh(a[..., 2 * units :] + reset * b[..., 2 * units :])
    return keep * h + (1 - keep) * new


def factor(raw):
    """Lower triangular (3, 3) with a positive diagonal, of six numbers; the identity of zeros."""
    d = jnp.exp(jnp.clip(raw[:3], -7.0, 7.0))
    zero = jnp.zeros(())
    rows = [[d[0], zero, zero], [raw[3], d[1], zero], [raw[4], raw[5], d[2]]]
    return jnp.stack([jnp.stack(row) for row in rows])


def soft(x):
    """About x where it is small, never beyond 5: what comes back as an input must not run away."""
    return 5.0 * jnp.tanh(0.2 * x)
