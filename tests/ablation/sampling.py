#!/usr/bin/env python3
"""Plain, antithetic and Latin hypercube passes beside very many: would another way to draw pay?

    python3 tests/ablation/sampling.py models/bnkf.bnkf

Draws the pre-activations of every unit, as the firmware's passes do, but in floating point and with numpy: each for
itself, in pairs of opposite sign, or one from each of as many equally likely strata as there are passes. Prints for 16
and 100 passes the error of the mean, in predictive standard deviations, and of the covariance, as a share of its
Frobenius norm, both root mean squares over random inputs and runs; ten minutes. Only blobs of one memoryless network with GELU.
Takes its packages as compare.py does.
"""

import struct
import sys
from pathlib import Path
from statistics import NormalDist

from compare import np

INPUTS = 12
RUNS = 100
REFERENCE_PASSES = 400_000
BLOCK = 4_000


def layers(blob: bytes):
    """Means, variances, bias means and bias variances of every layer; offsets as in firmware/BLOB.md."""
    (version, kind) = struct.unpack_from("<HB", blob, 4)
    (networks, inputs, outputs) = struct.unpack_from("<BBB", blob, 17)
    if blob[:4] != b"BNKF" or (version, kind, networks) != (2, 1, 1):
        raise ValueError("one memoryless network with GELU is needed")
    table = 24 + 4 * struct.unpack_from("<H", blob, 22)[0] + 8 * (inputs + outputs)
    for layer in range(struct.unpack_from("<H", blob, table)[0]):
        rows_in, rows, at, largest = struct.unpack_from("<HHIf", blob, table + 4 + 12 * layer)
        stride = (rows_in + 3) // 4 * 4
        codes = np.frombuffer(blob, np.int8, rows * stride, at).reshape(rows, stride)
        logs = np.frombuffer(blob, np.uint8, rows * stride, at + rows * stride).reshape(rows, stride)
        scale, bias, bias_variance = np.frombuffer(blob, "<f4", 3 * rows, at + 2 * rows * stride).reshape(3, rows)
        variance = np.where(logs == 0, 0.0, largest * 2.0 ** ((logs.astype(float) - 255.0) / 8.0))
        yield (codes * scale[:, None])[:, :rows_in], variance[:, :rows_in], bias, bias_variance


TABLE = np.linspace(-8.0, 8.0, 32_001)
QUANTILES = np.linspace(0.0, 1.0, 20_001)[1:-1]
NORMALS = np.array([NormalDist().inv_cdf(p) for p in QUANTILES])
GELU = TABLE * np.array([NormalDist().cdf(x) for x in TABLE])


def gelu(x):
    return np.where(x > 8.0, x, np.interp(x, TABLE, GELU))


def plain(shape, rng):
    return rng.standard_normal(shape)


def antithetic(shape, rng):
    half = rng.standard_normal((shape[0] // 2, shape[1]))
    return np.concatenate([half, -half])


def hypercube(shape, rng):
    """Each column has one number in each stratum, in an order of its own."""
    strata = rng.permuted(np.tile(np.arange(shape[0])[:, None], (1, shape[1])), axis=0)
    return np.interp((strata + rng.random(shape)) / shape[0], QUANTILES, NORMALS)


def passes(network, x, count, draw, rng):
    """Outputs of so many passes, a row each."""
    values = np.tile(x, (count, 1))
    for layer, (means, variances, bias, bias_variance) in enumerate(network):
        if layer:
            values = gelu(values)
        mean = values @ means.T + bias
        deviation = np.sqrt(values**2 @ variances.T + bias_variance)
        values = mean + deviation * draw(mean.shape, rng)
    return values


def main() -> None:
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    try:
        network = list(layers(Path(sys.argv[1]).read_bytes()))
    except (OSError, ValueError, struct.error) as error:
        raise SystemExit(f"{sys.argv[1]}: not a whole blob: {error}") from None
    rng = np.random.default_rng(1)
    inputs = rng.standard_normal((INPUTS, network[0][0].shape[1]))
    references = []
    for x in inputs:
        drawn = [passes(network, x, BLOCK, plain, rng) for _ in range(REFERENCE_PASSES // BLOCK)]
        drawn = np.concatenate(drawn)
        references.append((drawn.mean(axis=0), np.cov(drawn.T)))
    print("passes  drawn        mean, sigma  covariance")
    for count in (16, 100):
        for draw in (plain, antithetic, hypercube):
            squares = []
            for x, (mean, covariance) in zip(inputs, references):
                for _ in range(RUNS):
                    drawn = passes(network, x, count, draw, rng)
                    apart = (drawn.mean(axis=0) - mean) / np.sqrt(np.diag(covariance))
                    share = np.linalg.norm(np.cov(drawn.T) - covariance) / np.linalg.norm(covariance)
                    squares.append((np.mean(apart**2), share**2))
            mean, covariance = np.sqrt(np.mean(squares, axis=0))
            print(f"{count:6}  {draw.__name__:10}  {mean:11.4f}  {covariance:10.3f}")


if __name__ == "__main__":
    main()
