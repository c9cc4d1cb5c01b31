"""What an answer costs: its covariance's root is frame * spread * factor, a rotation, a scale and a lower triangle."""

import jax.numpy as jnp


def covariance(answer):
    """Of answers of any shape (..., 3, 3)."""
    root = answer["frame"] @ (answer["spread"][..., None] * answer["factor"])
    return root @ root.swapaxes(-1, -2)


def loss(error, answer):
    """Negative log-likelihood of the error under a normal distribution, without its constant."""
    factor, spread = answer["factor"], answer["spread"]
    y = (error[..., None, :] @ answer["frame"])[..., 0, :] / spread
    d = jnp.diagonal(factor, axis1=-2, axis2=-1)
    a = y[..., 0] / d[..., 0]
    b = (y[..., 1] - factor[..., 1, 0] * a) / d[..., 1]
    c = (y[..., 2] - factor[..., 2, 0] * a - factor[..., 2, 1] * b) / d[..., 2]
    square = a**2 + b**2 + c**2
    # Beyond five sigmas as the root of the square, so that one lost flight does not make the gradient.
    square = jnp.where(square < 25.0, square, 10.0 * jnp.sqrt(jnp.maximum(square, 25.0)) - 25.0)
    return 0.5 * square + (jnp.log(d) + jnp.log(spread)).sum(-1)


def distance(error):
    return jnp.sqrt((error**2).sum(-1) + 1e-8)
