"""Two textured backgrounds and four plain objects: what the small nets are shown in tests."""

import hashlib

import numpy as np
from scenes import textured

from reviewer.synthesis.bank import Bank, Cutout
from reviewer.synthesis.views import ViewSettings
from reviewer.training.aligned_views import aligned_views

COLOURS = [(250, 20, 20), (20, 20, 250), (250, 250, 20), (10, 10, 10)]


def block_bank():
    """Four plain rectangles of 30 x 24."""
    alpha = np.full((24, 30), 255, np.uint8)
    return Bank(
        tuple(Cutout(np.full((24, 30, 3), c, np.uint8), alpha, "block") for c in COLOURS),
        {},
        "blocks",
    )


def tiny_views(side=96):
    """Return what makes views of that side, by a generator."""
    bank, backgrounds = block_bank(), [textured(0), textured(1)]
    return lambda rng: aligned_views(backgrounds, bank, ViewSettings(side=side), rng)


def weights_hash(net):
    """Return a hash of all weights of a net."""
    values = (value.numpy().tobytes() for value in net.state_dict().values())
    return hashlib.sha256(b"".join(values)).hexdigest()
