#!/usr/bin/env python3
"""Writes a small Bayesian network as a blob, and what PyTorch computes from the same numbers.

An independent writer of the blob format (struct and zlib, from firmware/BLOB.md) and an independent
reader of its meaning (PyTorch, float64): the tests compare the firmware crate with both.

    python3 -m venv venv && venv/bin/pip install torch==2.5.1 numpy==2.2.6
    venv/bin/python tests/golden/torch_blob.py tests/golden

writes tiny_bnkf.bnkf, tiny_bnkfe.bnkf (the bytes) and torch_blob.json (the values).
"""
import json
import math
import struct
import sys
import zlib
from pathlib import Path

import torch

PASSES = 100_000
FEATURES_POLAR13 = 2


def network(generator, widths):
    """Random codes: what counts is the arithmetic, not what the network knows."""
    layers = []
    for inputs, outputs in zip(widths[:-1], widths[1:]):
        scale = (0.6 + torch.rand(outputs, generator=generator)) * 2.2 / (127 * math.sqrt(inputs))
        codes = torch.randint(-127, 128, (outputs, inputs), generator=generator)
        variance_codes = torch.randint(180, 256, (outputs, inputs), generator=generator)
        variance_codes[torch.rand(outputs, inputs, generator=generator) < 0.05] = 0
        layers.append(dict(
            inputs=inputs, outputs=outputs, codes=codes, variance_codes=variance_codes,
            variance_max=struct.unpack("<f", struct.pack("<f", 0.02 / inputs))[0],
            scale=scale.float(),
            bias=(0.3 * torch.randn(outputs, generator=generator)).float(),
            bias_variance=(0.002 * torch.rand(outputs, generator=generator)).float()))
    return layers


def moments(layer):
    """Weight means and variances in float64, by the format's definition."""
    mean = layer["codes"].double() * layer["scale"].double()[:, None]
    code = layer["variance_codes"].double()
    variance = layer["variance_max"] * torch.pow(2.0, (code - 255) / 8)
    return mean, torch.where(layer["variance_codes"] == 0, 0.0, variance)


def forward(layers, x, draw):
    """One pass for a batch of inputs; `draw(mean, variance)` gives the weights to use."""
    for index, layer in enumerate(layers):
        mean, variance = moments(layer)
        weight = draw(mean, variance)
        bias = draw(layer["bias"].double(), layer["bias_variance"].double())
        x = torch.einsum("...oi,...i->...o", weight, x) + bias
        if index < len(layers) - 1:
            x = torch.nn.functional.gelu(x)
    return x


def monte_carlo(layers, x, generator):
    """Mean, covariance and their standard errors over passes that draw every weight."""
    outputs = []
    for _ in range(PASSES // 1000):
        def draw(mean, variance):
            eps = torch.randn(1000, *mean.shape, generator=generator, dtype=torch.float64)
            return mean + variance.sqrt() * eps
        outputs.append(forward(layers, x.expand(1000, -1), draw))
    y = torch.cat(outputs)
    mean = y.mean(0)
    deviation = y - mean
    products = deviation[:, :, None] * deviation[:, None, :]
    covariance = products.sum(0) / (PASSES - 1)
    return dict(mean=mean.tolist(), covariance=covariance.tolist(),
                mean_standard_error=(covariance.diagonal() / PASSES).sqrt().tolist(),
                covariance_standard_error=(products.var(0) / PASSES).sqrt().tolist())


def padded(rows, stride, code):
    return b"".join(struct.pack(f"<{len(r)}{code}", *r) + bytes(stride - len(r)) for r in rows)


def blob(networks, inputs, outputs, parameters, input_pairs, output_pairs):
    head = struct.pack("<BBBBHH", FEATURES_POLAR13, len(networks), inputs, outputs, 100, len(parameters))
    sections = struct.pack(f"<{len(parameters)}f", *parameters)
    for pairs in (input_pairs, output_pairs):
        sections += b"".join(struct.pack("<2f", *pair) for pair in pairs)
    table_len = sum(4 + 12 * len(n) for n in networks)
    offset = 24 + len(sections) + table_len
    tables, data = b"", b""
    for layers in networks:
        tables += struct.pack("<HH", len(layers), 0)
        for layer in layers:
            stride = (layer["inputs"] + 3) // 4 * 4
            tables += struct.pack("<HHIf", layer["inputs"], layer["outputs"], offset + len(data), layer["variance_max"])
            data += padded(layer["codes"].tolist(), stride, "b") + padded(layer["variance_codes"].tolist(), stride, "B")
            for name in ("scale", "bias", "bias_variance"):
                data += struct.pack(f"<{layer['outputs']}f", *layer[name].tolist())
    rest = head + sections + tables + data
    front = b"BNKF" + struct.pack("<HBBI", 2, 1, 1, 16 + len(rest))
    return front + struct.pack("<I", zlib.crc32(front + rest)) + rest


def main(folder):
    generator = torch.Generator().manual_seed(20)
    torch.manual_seed(21)
    joint = network(generator, [13, 16, 16, 3])
    axes = [network(generator, [13, 8, 8, 1]) for _ in range(3)]
    parameters = [1.5, 2.5]
    input_pairs = [(0.25 * i, 0.5 + 0.0625 * i) for i in range(13)]
    output_pairs = [(1.0, 20.0), (-2.0, 18.0), (12.0, 5.0)]
    files = dict(
        tiny_bnkf=blob([joint], 13, 3, parameters, input_pairs, output_pairs),
        tiny_bnkfe=blob(axes, 13, 1, parameters, input_pairs, output_pairs))
    for name, content in files.items():
        (folder / f"{name}.bnkf").write_bytes(content)
    cases = []
    for _ in range(3):
        x = torch.randn(13, generator=generator).float()
        mean_weights = [forward(n, x.double(), lambda mean, _: mean).tolist() for n in [joint, *axes]]
        cases.append(dict(input=x.tolist(), mean_weight_outputs=mean_weights,
                          joint=monte_carlo(joint, x.double(), generator)))
    values = dict(torch=torch.__version__, passes=PASSES, cases=cases,
                  joint_weights=[dict(mean=m.tolist(), variance=v.tolist()) for m, v in map(moments, joint)])
    (folder / "torch_blob.json").write_text(json.dumps(values, indent=1) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
