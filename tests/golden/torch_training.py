#!/usr/bin/env python3
"""What PyTorch computes for a training step of a small variational network, in float64.

Forward passes at the mean weights and with given noise (local reparameterisation), the loss and its
gradient by automatic differentiation, the divergence from the prior, and steps of torch.optim.Adam.

    python3 -m venv venv && venv/bin/pip install torch==2.5.1 numpy==2.2.6
    venv/bin/python tests/golden/torch_training.py tests/golden/torch_training.json
"""
import json
import sys
from pathlib import Path

import torch

WIDTHS = [13, 8, 8, 3]
ROWS = 6
PRIOR_SIGMA = 0.3
KL_WEIGHT = 1e-3
ADAM_STEPS = 10
ADAM_RATE = 0.01


def layers(flat):
    """Cuts a flat vector into (weights [out][in], biases) per layer."""
    start, cut = 0, []
    for inputs, outputs in zip(WIDTHS[:-1], WIDTHS[1:]):
        weights = flat[start:start + inputs * outputs].view(outputs, inputs)
        start += inputs * outputs
        cut.append((weights, flat[start:start + outputs]))
        start += outputs
    return cut


def forward(means, variances, x, noise):
    """Outputs [row][output]; `noise` is one [row][output] tensor per layer."""
    pairs = list(zip(layers(means), layers(variances), noise))
    for index, ((mean, bias), (variance, bias_variance), eps) in enumerate(pairs):
        m = x @ mean.T + bias
        v = x.square() @ variance.T + bias_variance
        x = m + v.sqrt() * eps
        if index < len(pairs) - 1:
            x = torch.nn.functional.gelu(x)
    return x


def data_loss(means, variances, x, noise, targets, weights):
    errors = forward(means, variances, x, noise) - targets
    return (weights * errors.square().sum(1)).mean()


def divergence(means, log_sigmas):
    posterior = torch.distributions.Normal(means, log_sigmas.exp())
    prior = torch.distributions.Normal(torch.zeros_like(means), PRIOR_SIGMA)
    return torch.distributions.kl_divergence(posterior, prior).sum()


def main(path):
    generator = torch.Generator().manual_seed(30)

    def randn(*shape):
        return torch.randn(*shape, generator=generator, dtype=torch.float64).float().double()

    count = sum((i + 1) * o for i, o in zip(WIDTHS[:-1], WIDTHS[1:]))
    means = (0.3 * randn(count)).float().double().requires_grad_()
    log_sigmas = (-2.0 + 0.5 * randn(count)).float().double().requires_grad_()
    x, targets = randn(ROWS, WIDTHS[0]), randn(ROWS, WIDTHS[-1])
    weights = (0.5 + randn(ROWS).abs()).float().double()
    noise = [randn(ROWS, outputs) for outputs in WIDTHS[1:]]
    silence = [torch.zeros_like(eps) for eps in noise]

    variances = (2.0 * log_sigmas).exp().detach().requires_grad_()
    loss = data_loss(means, variances, x, noise, targets, weights)
    by_mean, by_variance = torch.autograd.grad(loss, [means, variances])
    mean_loss = data_loss(means, variances, x, silence, targets, weights)
    mean_by_mean, = torch.autograd.grad(mean_loss, [means])

    start = (means.tolist(), log_sigmas.tolist())
    optimiser = torch.optim.Adam([means, log_sigmas], lr=ADAM_RATE)
    for _ in range(ADAM_STEPS):
        optimiser.zero_grad()
        total = data_loss(means, (2.0 * log_sigmas).exp(), x, silence, targets, weights)
        (total + KL_WEIGHT * divergence(means, log_sigmas)).backward()
        optimiser.step()

    start_means, start_log_sigmas = (torch.tensor(v, dtype=torch.float64) for v in start)
    values = dict(
        torch=torch.__version__, widths=WIDTHS, prior_sigma=PRIOR_SIGMA, kl_weight=KL_WEIGHT,
        adam_steps=ADAM_STEPS, adam_rate=ADAM_RATE,
        means=start[0], log_sigmas=start[1], inputs=x.tolist(), targets=targets.tolist(),
        weights=weights.tolist(), noise=[eps.tolist() for eps in noise],
        mean_outputs=forward(start_means, variances, x, silence).tolist(),
        sampled_outputs=forward(start_means, variances, x, noise).tolist(),
        mean_loss=mean_loss.item(), mean_by_mean=mean_by_mean.tolist(),
        sampled_loss=loss.item(), sampled_by_mean=by_mean.tolist(),
        sampled_by_variance=by_variance.tolist(),
        divergence=divergence(start_means, start_log_sigmas).item(),
        adam_means=means.tolist(), adam_log_sigmas=log_sigmas.tolist())
    Path(path).write_text(json.dumps(values) + "\n")


if __name__ == "__main__":
    main(sys.argv[1])
