"""Weights and pictures that depend on a seed and on nothing else, not even on torch's version."""

import numpy as np
import torch


def seeded_state(net, seed=0):
    """Return a state dict of a net with every tensor drawn by numpy, in the order of the names."""
    rng = np.random.default_rng(seed)
    state = {}
    for name, value in sorted(net.state_dict().items()):
        shape = tuple(value.shape)
        if name.endswith("num_batches_tracked"):
            continue
        if name.endswith("running_var") or (value.ndim == 1 and name.endswith("weight")):
            drawn = rng.uniform(0.5, 1.5, shape)
        elif value.ndim == 4:
            drawn = rng.standard_normal(shape) * np.sqrt(1.5 / np.prod(shape[1:]))
        else:
            drawn = rng.standard_normal(shape) * 0.3
        state[name] = torch.from_numpy(drawn.astype(np.float32))
    return state


def filled(net, seed=0):
    """Return the net with those weights, ready to be asked."""
    missing, unexpected = net.load_state_dict(seeded_state(net, seed), strict=False)
    assert not unexpected and all(name.endswith("num_batches_tracked") for name in missing)
    return net.eval()


def seeded_pictures(height, width, seed=1):
    """Return pictures (1, 6, H, W): smooth shapes, the second with a block that the first lacks."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width] / max(height, width)
    planes = [np.sin(a * x + b * y + c) for a, b, c in rng.uniform(2, 14, (3, 3))]
    pictures = np.stack([*planes, *planes]).astype(np.float32)
    pictures += rng.standard_normal(pictures.shape).astype(np.float32) * 0.05
    pictures[3:, height // 4 : height // 2, width // 3 : width // 2] = -0.8
    return torch.from_numpy(pictures)[None]
