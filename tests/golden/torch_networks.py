#!/usr/bin/env python3
"""Trains small Bayesian networks with torchbnn and bayesian-torch, and says what PyTorch computes with them.

    python3 -m venv venv && venv/bin/pip install torch==2.15.0 numpy torchbnn==1.2 safetensors==0.8.0
    venv/bin/pip install --no-deps bayesian-torch==0.5.0
    venv/bin/python tests/golden/torch_networks.py tests/golden/torch_networks

writes a file of weights and a recipe for each network, and values.json: inputs, outputs at the mean weights,
and mean and covariance over 100,000 passes that draw every weight, with standard errors.
"""
import json
import math
import sys
from pathlib import Path

import torch
import torchbnn
from bayesian_torch.layers import LinearReparameterization
from safetensors.torch import save_file

PASSES = 100_000
ACTIVATIONS = dict(relu=torch.nn.ReLU, tanh=torch.nn.Tanh, identity=torch.nn.Identity, gelu=torch.nn.GELU)
# Name, library, activation, form of the file, features, hidden widths, one network an axis.
NETWORKS = [
    ("relu", "torchbnn", "relu", "pt", 13, [16, 16], False),
    ("tanh", "bayesian-torch", "tanh", "pt", 13, [16, 16], False),
    ("identity", "torchbnn", "identity", "safetensors", 12, [9], False),
    ("gelu", "torchbnn", "gelu", "safetensors", 12, [16, 10], False),
    ("axes", "bayesian-torch", "relu", "safetensors", 13, [8, 7], True),
]


def flights(count, features):
    """Two radar measurements of targets in the paper's volume, features as firmware/BLOB.md lists them, and the
    position at the second."""
    position = torch.stack([60 * torch.rand(count) - 30, 60 * torch.rand(count) - 30, 3 + 20 * torch.rand(count)], 1)
    velocity = 4 * torch.randn(count, 3)
    age = 0.1 + 0.3 * torch.rand(count)
    sigmas = torch.tensor([0.3, 0.01, 0.01, 0.1]) * torch.exp(2 * torch.rand(count, 1))

    def measured(at):
        distance = at.norm(dim=1)
        exact = torch.stack([distance, torch.asin(at[:, 2] / distance), torch.atan2(at[:, 1], at[:, 0]),
                             (at * velocity).sum(1) / distance], 1)
        return exact + sigmas * torch.randn(count, 4)

    previous, current = measured(position - age[:, None] * velocity), measured(position)
    if features == 12:
        return torch.cat([previous, current, sigmas], 1), position
    turn = torch.remainder(previous[:, 2] - current[:, 2] + math.pi, 2 * math.pi) - math.pi
    previous[:, 2] = current[:, 2] + turn
    return torch.cat([previous, current, sigmas.log(), age[:, None]], 1), position


def layer(library, inputs, outputs):
    if library == "torchbnn":
        return torchbnn.BayesLinear(prior_mu=0, prior_sigma=0.05, in_features=inputs, out_features=outputs)
    return LinearReparameterization(inputs, outputs, prior_variance=0.05, posterior_rho_init=-3.0)


def network(library, activation, widths):
    layers = []
    for inputs, outputs in zip(widths[:-1], widths[1:]):
        layers += [layer(library, inputs, outputs), ACTIVATIONS[activation]()]
    return torch.nn.Sequential(*layers[:-1])


def run(model, x):
    """A pass; layers of bayesian-torch answer with their divergence besides."""
    for part in model:
        x = part(x)
        x = x[0] if isinstance(x, tuple) else x
    return x


def train(model, x, y):
    optimiser = torch.optim.Adam(model.parameters(), lr=5e-3)
    for _ in range(600):
        rows = torch.randint(len(x), (256,))
        loss = ((run(model, x[rows]) - y[rows]) ** 2).mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()


def posterior(model, library):
    """Mean and deviation of the weights and biases of each layer, in double precision."""
    for part in model:
        if hasattr(part, "weight_mu"):
            spread = torch.exp
            names = ("weight_mu", "weight_log_sigma", "bias_mu", "bias_log_sigma")
        elif hasattr(part, "mu_weight"):
            spread = torch.nn.functional.softplus
            names = ("mu_weight", "rho_weight", "mu_bias", "rho_bias")
        else:
            continue
        mean, coded, bias, bias_coded = (getattr(part, name).detach().double() for name in names)
        yield mean, spread(coded), bias, spread(bias_coded)


def forward(layers, activation, x, draw):
    for index, (mean, sigma, bias, bias_sigma) in enumerate(layers):
        x = torch.einsum("...oi,...i->...o", draw(mean, sigma), x) + draw(bias, bias_sigma)
        if index < len(layers) - 1:
            x = ACTIVATIONS[activation]()(x)
    return x


def monte_carlo(layers, activation, x):
    outputs = []
    for _ in range(PASSES // 1000):
        def draw(mean, sigma):
            return mean + sigma * torch.randn(1000, *mean.shape, dtype=torch.float64)
        outputs.append(forward(layers, activation, x.expand(1000, -1), draw))
    y = torch.cat(outputs)
    deviation = y - y.mean(0)
    products = deviation[:, :, None] * deviation[:, None, :]
    covariance = products.sum(0) / (PASSES - 1)
    return dict(mean=y.mean(0).tolist(), covariance=covariance.tolist(),
                mean_standard_error=(covariance.diagonal() / PASSES).sqrt().tolist(),
                covariance_standard_error=(products.var(0) / PASSES).sqrt().tolist())


def recipe(library, activation, features, layers, scales):
    numbers = [", ".join(f"{number:.9g}" for number in scale.tolist()) for scale in scales]
    names = f"layers = {json.dumps(layers)}\n" if layers else ""
    return f"""layout = "{library}"
activation = "{activation}"
features = "polar-{features}"
{names}
[input]
mean = [{numbers[0]}]
scale = [{numbers[1]}]

[output]
mean_m = [{numbers[2]}]
scale_m = [{numbers[3]}]

[population]
speed_sigma_mps = 4.0
acceleration_sigma_mps2 = 5.0
"""


def main(folder):
    folder.mkdir(exist_ok=True)
    torch.manual_seed(31)
    values = dict(torch=torch.__version__, passes=PASSES, networks=[])
    for name, library, activation, form, features, hidden, by_axis in NETWORKS:
        x, y = flights(4000, features)
        scales = x.mean(0), x.std(0), y.mean(0), y.std(0)
        x, y = (x - scales[0]) / scales[1], (y - scales[2]) / scales[3]
        axes = [[0], [1], [2]] if by_axis else [[0, 1, 2]]
        models = [network(library, activation, [features, *hidden, len(axis)]) for axis in axes]
        state, order = {}, None
        for model, axis in zip(models, axes):
            train(model, x, y[:, axis])
        if by_axis:
            named = dict(zip("xyz", models))
            state = {f"{axis}.{key}": value for axis, model in named.items() for key, value in model.state_dict().items()}
            layers = [index for index, part in enumerate(models[0]) if list(part.parameters())]
            order = [[f"{axis}.{index}" for index in layers] for axis in named]
        else:
            state = models[0].state_dict()
        file = folder / f"{name}.{form}"
        torch.save(state, file) if form == "pt" else save_file(dict(state), file)
        (folder / f"{name}.toml").write_text(recipe(library, activation, features, order, scales))
        posteriors = [list(posterior(model, library)) for model in models]
        cases = []
        for row in x[:2].double():
            mean = torch.cat([forward(p, activation, row, lambda mean, _: mean) for p in posteriors])
            cases.append(dict(input=row.tolist(), mean_weight_outputs=mean.tolist(),
                              passes=[monte_carlo(p, activation, row) for p in posteriors]))
        values["networks"].append(dict(name=name, file=file.name, cases=cases))
    (folder / "values.json").write_text(json.dumps(values, indent=1) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
