"""All textures by name: what materials ask for and the renderer samples."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from reviewer.demo import prints, textures
from reviewer.demo.textures import Picture, Rng

MAKERS: dict[str, Callable[[Rng], Picture]] = {
    "plain": textures.plain,
    "plaster": textures.plaster,
    "wallpaper": textures.wallpaper,
    "concrete": textures.concrete,
    "wood": textures.wood,
    "dark_wood": textures.dark_wood,
    "laminate": textures.laminate,
    "parquet": textures.parquet,
    "floor_tile": textures.floor_tile,
    "vinyl": textures.vinyl,
    "carpet": textures.carpet,
    "rug": textures.rug,
    "fabric": textures.fabric,
    "metal": textures.metal,
    "leather": textures.leather,
    "foliage": textures.foliage,
    "curtain": textures.curtain,
    "ceiling": textures.ceiling,
    "packaging": prints.packaging,
    "spine": prints.spine,
    "poster": prints.poster,
    "paper": prints.paper,
    "whiteboard": prints.whiteboard,
    "screen": prints.screen,
    "card": prints.card,
    "handkerchief": prints.handkerchief,
    "battery": prints.battery,
    "keyboard": prints.keyboard,
}


def make_texture(name: str) -> Picture:
    """Return the texture of a name such as "wood" or "packaging:7" (the number varies it)."""
    kind, _, variant = name.partition(":")
    seed = [sum(ord(c) * 31**i for i, c in enumerate(kind)) % 2**31, int(variant or 0)]
    return MAKERS[kind](np.random.default_rng(seed))
