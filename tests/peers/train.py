"""Trains a peer for all noise levels, then from there for each, and writes its weights.

    python train.py gru|gain|forecast FLIGHTS.npz FOLDER UPDATES UPDATES_PER_LEVEL

FOLDER/PEER-LEVEL.npz; what is there is not trained again. Adam with a cosine fall of the rate, gradients clipped to norm 1,
left out where they are not finite.
The last 300 flights are never trained on: the loss on them is printed and kept. Training time is the processor's.
"""

import importlib
import sys
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import optax

import simulated
import whole

HELD_OUT, SIZE, RATE, SEED = 300, 64, 1e-3, 1
MODULES = {"gru": "gru", "gain": "gain_network", "forecast": "forecast"}
# What distances are weighed by, m: about those of a tuned filter.
TYPICAL_M = jnp.array([0.13, 1.2, 4.5, 0.1])


def flat(params):
    """Weights as {name: array}."""
    leaves = jax.tree_util.tree_flatten_with_path(params)[0]
    return {jax.tree_util.keystr(path): np.asarray(leaf) for path, leaf in leaves}


def restored(module, file):
    """And back."""
    leaves, shape = jax.tree_util.tree_flatten_with_path(module.create(jax.random.key(0)))
    return jax.tree_util.tree_unflatten(shape, [jnp.asarray(file[jax.tree_util.keystr(path)]) for path, _ in leaves])


def fall(count, updates, peak):
    """The rate of an update."""
    return peak * min(1.0, count / (0.05 * updates)) * (0.5 + 0.5 * np.cos(np.pi * count / updates) + 0.005)


class Trainer:
    """Compiled once for all levels."""

    def __init__(self, peer, file):
        self.module, self.peer = importlib.import_module(MODULES[peer]), peer
        data = {name: np.asarray(file[name]) for name in ("position", "velocity")}
        self.held, self.data = ({name: part(x) for name, x in data.items()} for part in (lambda x: x[-HELD_OUT:], lambda x: x[:-HELD_OUT]))
        self.known = jnp.asarray(file["population"])
        self.rule = optax.apply_if_finite(optax.chain(optax.clip_by_global_norm(1.0), optax.scale_by_adam(b2=0.995)), 20)
        self.update = jax.jit(self.updated)

    def cost(self, params, flights):
        one = lambda flight: self.module.loss(params, self.known, flight, TYPICAL_M[flight["level"]])
        return jax.vmap(one)(flights).mean()

    def updated(self, params, state, flights, rate):
        value, slope = jax.value_and_grad(self.cost)(params, flights)
        steps, state = self.rule.update(slope, state)
        return jax.tree.map(lambda x, step: x - rate * step, params, steps), state, value

    def train(self, params, level, updates, peak):
        """Weights, seconds of the processor and the loss on flights that were held out."""
        number = simulated.LEVELS.get(level, -1)
        rng, practice = np.random.default_rng([SEED, number + 1]), np.random.default_rng(99)
        state, recent, began = self.rule.init(params), [], time.process_time()
        for count in range(1, updates + 1):
            flights = simulated.batch(rng, self.data, SIZE, number)
            params, state, value = self.update(params, state, flights, fall(count, updates, peak))
            recent.append(value)
            if count == 20 or count % max(1, updates // 10) == 0:
                print(f"{self.peer} {level}: update {count}/{updates}, loss {float(np.mean(recent)):.4f}, {time.process_time() - began:.0f} s", flush=True)
                recent = []
        seconds = time.process_time() - began
        check = jax.jit(self.cost)
        value = float(np.mean([check(params, simulated.batch(practice, self.held, SIZE, number)) for _ in range(8)]))
        print(f"{self.peer} {level}: loss on flights that were held out {value:.4f}, {seconds:.0f} s", flush=True)
        if not np.isfinite(value):
            raise SystemExit("training failed: the loss is not finite")
        return params, seconds, value


def main():
    peer, flights, folder, *updates = sys.argv[1:]
    updates, folder = [int(count) for count in updates], Path(folder)
    levels = ["all", "low", "medium", "high"] + (["clean"] if peer == "forecast" else [])
    if all((folder / f"{peer}-{level}.npz").exists() for level in levels):
        return
    trainer = Trainer(peer, np.load(flights))
    for level in levels:
        path, origin = folder / f"{peer}-{level}.npz", folder / f"{peer}-all.npz"
        if path.exists():
            continue
        first, count, peak = (True, updates[0], RATE) if level == "all" else (False, updates[1], 0.4 * RATE)
        params = trainer.module.create(jax.random.key(SEED)) if first else restored(trainer.module, np.load(origin))
        params, seconds, value = trainer.train(params, level, count, peak)
        before = 0.0 if first else float(np.load(origin)["seconds"])
        whole.save(path, **flat(params), seconds=seconds + before, held_out=value, updates=count)


if __name__ == "__main__":
    main()
