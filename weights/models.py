"""Three-dimensional models out of Sweet Home 3D's furniture archives, with surfaces of our own."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import trimesh

from reviewer.demo.shapes import Material, Mesh, join, project_uv

Rng = np.random.Generator
LARGEST_BYTES = 900_000
"""Larger models have more triangles than a room needs."""
TINTED = 0.35
"""Share of parts that are of one colour."""
LIBRARY = ("wood", "dark_wood", "laminate", "fabric", "metal", "leather", "carpet", "plaster")


def unpack_models(archives: Sequence[Path], folder: Path) -> list[Path]:
    """Unpack the models of archives (`.sh3f`, which are zip files); return their OBJ files."""
    for archive in archives:
        with zipfile.ZipFile(archive) as content:
            names = [
                info.filename
                for info in content.infolist()
                if info.filename.lower().endswith(".obj") and info.file_size <= LARGEST_BYTES
            ]
            content.extractall(folder / archive.stem, names)
    return sorted(folder.rglob("*.obj"))


def random_material(rng: Rng) -> Material:
    """Return a surface: a piece of a photograph, one of the demo's textures, or one colour."""
    tile = float(np.exp(rng.uniform(np.log(0.15), np.log(2.0))))
    mirror = float(rng.uniform(0.05, 0.4)) if rng.random() < 0.12 else 0.0
    gloss = float(rng.uniform(0, 0.7)) if rng.random() < 0.4 else 0.0
    light = float(rng.uniform(0.3, 1.0))
    colour = np.clip(light * rng.uniform(0.55, 1.0, 3) ** rng.uniform(0, 2.5), 0.03, 1)
    red, green, blue = (float(v) for v in colour)
    chance = float(rng.random())
    if chance < TINTED:
        return Material("plain", (red, green, blue), tile, mirror, gloss=gloss)
    if chance < TINTED + 0.2:
        kind = str(rng.choice(LIBRARY))
        return Material(kind, (light,) * 3, tile, mirror, gloss=gloss)
    bright = (float(rng.uniform(0.6, 1.2)),) * 3
    return Material(f"photo:{int(rng.integers(4000))}", bright, tile, mirror, gloss=gloss)


def load_model(path: Path, longest_m: float, rng: Rng) -> Mesh | None:
    """Return a model that stands on z = 0, its longest side so long; None where nothing is solid.

    Every part of the file gets a surface drawn anew.
    """
    scene = trimesh.load_scene(path, group_material=True, skip_materials=True, process=False)
    parts = [
        part for part in scene.geometry.values()
        if isinstance(part, trimesh.Trimesh) and len(part.faces)
    ]  # fmt: skip
    if not parts:
        return None
    everything = np.concatenate([part.vertices for part in parts])
    low, high = everything.min(axis=0), everything.max(axis=0)
    extent = float((high - low).max())
    if not np.isfinite(extent) or extent <= 0:
        return None
    scale = longest_m / extent
    middle = (low + high) / 2
    # The files count y upwards.
    shift = np.array([middle[0], low[1], middle[2]])
    meshes = [_mesh(part, shift, scale, random_material(rng)) for part in parts]
    return join(meshes)


def _mesh(
    part: trimesh.Trimesh, shift: npt.NDArray[np.float64], scale: float, material: Material
) -> Mesh:
    moved = ((np.asarray(part.triangles) - shift) * scale)[..., [0, 2, 1]]
    moved[..., 1] *= -1
    corners: npt.NDArray[np.float32] = moved.astype(np.float32)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(across, axis=1, keepdims=True)
    flat = np.repeat((across / np.maximum(length, 1e-12))[:, None], 3, axis=1)
    flat[length[:, 0] < 1e-12] = (0, 0, 1)
    mesh = Mesh(
        corners, flat.astype(np.float32), np.zeros((len(corners), 3, 2), np.float32),
        np.zeros(len(corners), np.int32), (material,),
    )  # fmt: skip
    tile = max(material.tile_m * min(1.0, 2 * float(np.abs(corners).max())), 1e-3)
    return project_uv(replace(mesh, materials=(replace(material, tile_m=tile),)))
