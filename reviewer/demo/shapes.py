"""Triangle meshes with normals, texture coordinates and materials.

A mesh is a bag of triangles, so joining and moving are array operations. Lengths are metres, z is
up. Texture coordinates count texture tiles; `project_uv` lays a texture of `tile_m` metres on every
face along its dominant axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import trimesh

Floats = npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Material:
    """How a surface looks.

    Attributes:
        texture: name of a texture in `textures`.
        tint: linear RGB factor on the texture.
        tile_m: side of one texture tile in metres, for projected coordinates.
        mirror: share of mirror reflection at normal incidence, 0..1.
        blur: spread of that reflection, radians.
        gloss: strength of the highlights of the lights, 0..1.
        emission: light that the surface gives off, linear.
    """

    texture: str = "plain"
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    tile_m: float = 1.0
    mirror: float = 0.0
    blur: float = 0.02
    gloss: float = 0.0
    emission: float = 0.0


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles: corners, normals (T, 3, 3), uv (T, 3, 2), and the material of each triangle."""

    corners: Floats
    normals: Floats
    uv: Floats
    material: npt.NDArray[np.int32]
    materials: tuple[Material, ...]

    def moved(self, x: float = 0.0, y: float = 0.0, z: float = 0.0, *, yaw: float = 0.0) -> Mesh:
        """Return the mesh turned by `yaw` about z, then shifted."""
        turn = _rotation_z(yaw)
        shift = np.array([x, y, z], np.float32)
        return replace(self, corners=self.corners @ turn.T + shift, normals=self.normals @ turn.T)

    def turned(self, rotation: npt.NDArray[np.floating]) -> Mesh:
        """Return the mesh rotated about the origin by a 3x3 matrix."""
        turn = rotation.astype(np.float32)
        return replace(self, corners=self.corners @ turn.T, normals=self.normals @ turn.T)


def join(meshes: Sequence[Mesh]) -> Mesh:
    """Return one mesh of all triangles; materials are shared where equal."""
    table: dict[Material, int] = {}
    numbers = []
    for mesh in meshes:
        places = [table.setdefault(material, len(table)) for material in mesh.materials]
        numbers.append(np.asarray(places, np.int32)[mesh.material])
    return Mesh(
        np.concatenate([mesh.corners for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.uv for mesh in meshes]),
        np.concatenate(numbers),
        tuple(table),
    )


def rotation(axis: Sequence[float], angle: float) -> npt.NDArray[np.float64]:
    """Return the 3x3 matrix that turns by `angle` radians about `axis`."""
    matrix: npt.NDArray[np.float64] = trimesh.transformations.rotation_matrix(angle, axis)
    return matrix[:3, :3]


def box(
    size: Sequence[float],
    material: Material,
    *,
    faces: dict[str, Material] | None = None,
) -> Mesh:
    """Return a box standing on z = 0, centred in x and y.

    Args:
        faces: other materials for "front" (-y), "back" (+y), "left" (-x), "right" (+x), "top";
            these faces carry their texture once, upright.
    """
    width, depth, height = size
    w, d = width / 2, depth / 2
    quads = {
        "front": ([[-w, -d, 0], [w, -d, 0], [w, -d, height], [-w, -d, height]], (width, height)),
        "back": ([[w, d, 0], [-w, d, 0], [-w, d, height], [w, d, height]], (width, height)),
        "left": ([[-w, d, 0], [-w, -d, 0], [-w, -d, height], [-w, d, height]], (depth, height)),
        "right": ([[w, -d, 0], [w, d, 0], [w, d, height], [w, -d, height]], (depth, height)),
        "top": (
            [[-w, -d, height], [w, -d, height], [w, d, height], [-w, d, height]],
            (width, depth),
        ),
        "bottom": ([[-w, d, 0], [w, d, 0], [w, -d, 0], [-w, -d, 0]], (width, depth)),
    }
    parts = []
    for name, (corners, extent) in quads.items():
        special = (faces or {}).get(name)
        chosen = special or material
        tiles = (1.0, 1.0) if special else (extent[0] / chosen.tile_m, extent[1] / chosen.tile_m)
        parts.append(quad(corners, chosen, tiles=tiles))
    return join(parts)


def quad(
    corners: Sequence[Sequence[float]], material: Material, *, tiles: tuple[float, float] = (1, 1)
) -> Mesh:
    """Return a flat four-cornered face: lower left, lower right, upper right, upper left."""
    points = np.asarray(corners, np.float32)
    u, v = tiles
    uv = np.array([[0, 0], [u, 0], [u, v], [0, v]], np.float32)
    order = np.array([[0, 1, 2], [0, 2, 3]])
    normal = np.cross(points[1] - points[0], points[3] - points[0])
    normal = normal / np.linalg.norm(normal)
    return Mesh(
        points[order],
        np.broadcast_to(normal.astype(np.float32), (2, 3, 3)).copy(),
        uv[order],
        np.zeros(2, np.int32),
        (material,),
    )


def surface(
    grid: npt.NDArray[np.floating], material: Material, *, tiles: tuple[float, float] = (1, 1)
) -> Mesh:
    """Return a smooth surface through an (R, C, 3) grid of points, textured once or in tiles."""
    points = grid.astype(np.float32)
    rows, columns = points.shape[:2]
    du = np.gradient(points, axis=1)
    dv = np.gradient(points, axis=0)
    if np.allclose(points[:, 0], points[:, -1]):
        du[:, 0] = du[:, -1] = points[:, 1] - points[:, -2]
    normals = np.cross(du, dv)
    normals /= np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), 1e-9)
    v, u = np.meshgrid(
        np.linspace(0, tiles[1], rows), np.linspace(0, tiles[0], columns), indexing="ij"
    )
    uv = np.stack([u, v], axis=2).astype(np.float32)
    order = _grid_triangles(rows, columns)
    return Mesh(
        points.reshape(-1, 3)[order],
        normals.reshape(-1, 3)[order].astype(np.float32),
        uv.reshape(-1, 2)[order],
        np.zeros(len(order), np.int32),
        (material,),
    )


def _grid_triangles(rows: int, columns: int) -> npt.NDArray[np.int64]:
    """Return the corners (T, 3) of the triangles between the points of a grid, as flat indices."""
    first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)[None, :]).ravel()
    return np.concatenate(
        [
            np.stack([first, first + 1, first + columns + 1], axis=1),
            np.stack([first, first + columns + 1, first + columns], axis=1),
        ]
    )


def rounded_box(
    size: Sequence[float], radius: float, material: Material, *, steps: int = 3
) -> Mesh:
    """Return a box with rounded edges standing on z = 0, centred in x and y."""
    half = np.asarray(size, np.float64) / 2
    radius = min(radius, *half)
    quarter = np.linspace(0, np.pi / 2, steps + 1)
    around = np.concatenate([k * np.pi / 2 + quarter for k in range(4)] + [[2 * np.pi]])
    upwards = np.concatenate([quarter - np.pi / 2, quarter])
    # Nudged off the axes, so that sign() puts each corner's arc on its own side.
    side = np.concatenate(
        [np.full(steps + 1, k * np.pi / 2 + np.pi / 4) for k in range(4)] + [[np.pi / 4]]
    )
    layer = np.concatenate([-np.ones(steps + 1), np.ones(steps + 1)])
    normals = np.stack(
        [
            np.cos(upwards)[:, None] * np.cos(around)[None, :],
            np.cos(upwards)[:, None] * np.sin(around)[None, :],
            np.broadcast_to(np.sin(upwards)[:, None], (len(upwards), len(around))),
        ],
        axis=2,
    )
    inner = half - radius
    core = np.stack(
        [
            np.broadcast_to(np.sign(np.cos(side)) * inner[0], normals.shape[:2]),
            np.broadcast_to(np.sign(np.sin(side)) * inner[1], normals.shape[:2]),
            np.broadcast_to(layer[:, None] * inner[2], normals.shape[:2]),
        ],
        axis=2,
    )
    points = core + radius * normals
    points[..., 2] += half[2]
    mesh = surface(points, material)
    smooth = surface_with_normals(points, normals, material)
    lids = [
        _lid(points[-1], 1.0, material),
        _lid(points[0][::-1], -1.0, material),
    ]
    return project_uv(join([replace(mesh, normals=smooth), *lids]))


def surface_with_normals(
    points: npt.NDArray[np.floating], normals: npt.NDArray[np.floating], material: Material
) -> Floats:
    """Return the corner normals (T, 3, 3) that `surface` would have with the given normals."""
    rows, columns = points.shape[:2]
    order = _grid_triangles(rows, columns)
    chosen: Floats = normals.reshape(-1, 3).astype(np.float32)[order]
    return chosen


def _lid(ring: npt.NDArray[np.floating], up: float, material: Material) -> Mesh:
    centre = ring.mean(axis=0)
    following = np.roll(ring, -1, axis=0)
    corners = np.stack([np.broadcast_to(centre, ring.shape), ring, following], axis=1)
    normals = np.zeros_like(corners)
    normals[..., 2] = up
    return Mesh(
        corners.astype(np.float32),
        normals.astype(np.float32),
        np.zeros((len(ring), 3, 2), np.float32),
        np.zeros(len(ring), np.int32),
        (material,),
    )


def cylinder(
    radius: float,
    height: float,
    material: Material,
    *,
    top: Material | None = None,
    top_radius: float | None = None,
    sides: int = 24,
    wrap: bool = False,
) -> Mesh:
    """Return a cylinder or frustum standing on z = 0; `wrap` lays the texture round it once."""
    upper = radius if top_radius is None else top_radius
    return lathe([(radius, 0.0), (upper, height)], material, top=top, sides=sides, wrap=wrap)


def lathe(
    profile: Sequence[tuple[float, float]],
    material: Material,
    *,
    top: Material | None = None,
    sides: int = 24,
    wrap: bool = False,
) -> Mesh:
    """Turn a profile of (radius, z) points about z, closed at both ends."""
    angles = np.linspace(0, 2 * np.pi, sides + 1)
    radii = np.array([p[0] for p in profile])
    heights = np.array([p[1] for p in profile])
    points = np.stack(
        [
            radii[:, None] * np.cos(angles)[None, :],
            radii[:, None] * np.sin(angles)[None, :],
            np.broadcast_to(heights[:, None], (len(radii), len(angles))),
        ],
        axis=2,
    )
    length = float(np.abs(np.diff(radii)).sum() + np.abs(np.diff(heights)).sum())
    tiles = (
        (1.0, 1.0)
        if wrap
        else (2 * np.pi * float(radii.max()) / material.tile_m, length / material.tile_m)
    )
    parts = [surface(points, material, tiles=tiles)]
    if radii[-1] > 1e-6:
        parts.append(project_uv(_lid(points[-1, :-1], 1.0, top or material)))
    if radii[0] > 1e-6:
        parts.append(project_uv(_lid(points[0, -2::-1], -1.0, material)))
    return join(parts)


def tube(
    path: npt.NDArray[np.floating], radius: float, material: Material, *, sides: int = 8
) -> Mesh:
    """Sweep a circle along an (N, 3) path; the path must not run straight up."""
    tangent = np.gradient(path, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    side = np.cross(tangent, [0.0, 0.0, 1.0])
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-9)
    other = np.cross(side, tangent)
    angles = np.linspace(0, 2 * np.pi, sides + 1)
    ring = (
        side[:, None, :] * np.cos(angles)[None, :, None]
        + other[:, None, :] * np.sin(angles)[None, :, None]
    )
    points = path[:, None, :] + radius * ring
    return replace(surface(points, material), normals=surface_with_normals(points, ring, material))


def project_uv(mesh: Mesh) -> Mesh:
    """Lay each triangle's texture along the dominant axis of its plane, in tiles of `tile_m`."""
    plane = np.cross(
        mesh.corners[:, 1] - mesh.corners[:, 0], mesh.corners[:, 2] - mesh.corners[:, 0]
    )
    dominant = np.abs(plane).argmax(axis=1)
    first = np.where(dominant == 0, 1, 0)
    second = np.where(dominant == 2, 1, 2)
    rows = np.arange(len(dominant))[:, None]
    corner = np.arange(3)[None, :]
    uv = np.stack(
        [mesh.corners[rows, corner, first[:, None]], mesh.corners[rows, corner, second[:, None]]],
        axis=2,
    )
    tile = np.array([m.tile_m for m in mesh.materials], np.float32)[mesh.material]
    return replace(mesh, uv=(uv / tile[:, None, None]).astype(np.float32))


def _rotation_z(yaw: float) -> Floats:
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]], np.float32)
