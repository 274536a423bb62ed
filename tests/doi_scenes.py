"""Small pictures of components, objects and truth, made from a seed: all that DoI looks at."""

import numpy as np

HEIGHT, WIDTH = 40, 60


def blobs(rng, number, least=3, most=14):
    masks = []
    for _ in range(number):
        mask = np.zeros((HEIGHT, WIDTH), bool)
        y, x = rng.integers(0, HEIGHT - 3), rng.integers(0, WIDTH - 3)
        mask[y : y + rng.integers(least, most), x : x + rng.integers(least, most)] = True
        masks.append(mask)
    return masks


def scene(seed):
    """M_o, live and reference objects that overlap, valid, truth, ignore; some of them empty."""
    rng = np.random.default_rng(seed)
    live = blobs(rng, rng.integers(0, 7))
    if live and seed % 3 == 0:
        live[0] = np.zeros((HEIGHT, WIDTH), bool)
    change = np.zeros((HEIGHT, WIDTH), bool)
    for mask in [*live[: rng.integers(0, 6)], *blobs(rng, rng.integers(0, 4), 2, 6)]:
        change |= np.roll(mask, int(rng.integers(-3, 4)), axis=int(rng.integers(0, 2)))
    truth = np.zeros_like(change)
    for mask in [*live[::2], *blobs(rng, 1)]:
        truth |= mask
    valid = np.ones_like(change)
    valid[:, : rng.integers(0, 20)] = False
    ignore = np.zeros_like(change)
    ignore[: rng.integers(0, 10)] = True
    return change, live, blobs(rng, rng.integers(0, 3)), valid, truth, ignore
