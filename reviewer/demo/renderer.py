"""Ray-cast a scene of triangles under area lights, with exact object masks.

One primary ray a pixel decides what the pixel shows (so masks are exact); shadows and ambient
occlusion are ordered-dithered over 4x4 pixels and averaged inside each surface, which leaves no
pattern on flat faces; floors mirror the room. Edges get three more rays. Light is linear; `sensor`
turns it into a picture. Embree does the intersections.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
import numpy.typing as npt
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from reviewer.demo.patterns import (
    DITHER,
    average_inside,
    hemisphere,
    ones,
    stratified,
    surface_numbers,
    texel_density,
)
from reviewer.demo.sampling import TextureSet
from reviewer.demo.shapes import Mesh

Floats = npt.NDArray[np.float32]
Ints = npt.NDArray[np.int32]

LIFT = 4e-4
AMBIENT_REACH = 0.55
MIRRORED_AT_MOST = 2.2


@dataclass(frozen=True, slots=True)
class Light:
    """A rectangle that shines: centre, two half sides, linear RGB power."""

    centre: tuple[float, float, float]
    side_a: tuple[float, float, float]
    side_b: tuple[float, float, float]
    power: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Camera:
    """Pinhole camera: world pose of the optical axis, intrinsics in pixels.

    Attributes:
        position: metres. yaw, pitch: radians; pitch < 0 looks down.
    """

    position: tuple[float, float, float]
    yaw: float
    pitch: float
    width: int = 640
    height: int = 480
    focal: float = 385.0

    def rays(self, x: Floats, y: Floats) -> Floats:
        """Return unit directions (N, 3) through image points in pixels."""
        forward, right, up = self.axes()
        across = ((x - self.width / 2) / self.focal)[:, None]
        down = ((y - self.height / 2) / self.focal)[:, None]
        direction = forward + across * right - down * up
        unit: Floats = direction / np.linalg.norm(direction, axis=1, keepdims=True)
        return unit.astype(np.float32)

    def axes(self) -> tuple[Floats, Floats, Floats]:
        """Return forward, right and up unit vectors in the world."""
        cy, sy, cp, sp = np.cos(self.yaw), np.sin(self.yaw), np.cos(self.pitch), np.sin(self.pitch)
        forward = np.array([cy * cp, sy * cp, sp], np.float32)
        right = np.array([sy, -cy, 0.0], np.float32)
        return forward, right, np.cross(right, forward).astype(np.float32)


@dataclass(frozen=True, slots=True)
class Rendering:
    """Linear light (H, W, 3), object number (H, W; 0 = room), distance (H, W) in metres."""

    light: Floats
    object_number: Ints
    distance: Floats


class Scene:
    """Room and small objects, ready to be rendered from any camera."""

    def __init__(
        self, parts: Sequence[Mesh], lights: Sequence[Light], ambient: tuple[float, float, float]
    ) -> None:
        """Build the ray-casting structure; part k is object number k (part 0 is the room)."""
        self.lights = tuple(lights)
        self.ambient = np.asarray(ambient, np.float32)
        corners = np.concatenate([part.corners for part in parts])
        self._normals = np.concatenate([part.normals for part in parts])
        self._uv = np.concatenate([part.uv for part in parts])
        self._object = np.concatenate(
            [np.full(len(part.corners), k, np.int32) for k, part in enumerate(parts)]
        )
        materials = list(dict.fromkeys(m for part in parts for m in part.materials))
        place = {material: k for k, material in enumerate(materials)}
        self._material = np.concatenate(
            [
                np.array([place[m] for m in part.materials], np.int32)[part.material]
                for part in parts
            ]
        )
        self._names = tuple(dict.fromkeys(m.texture for m in materials))
        self._texture = np.array([self._names.index(m.texture) for m in materials], np.int32)
        self._tint = np.array([m.tint for m in materials], np.float32)
        self._mirror = np.array([m.mirror for m in materials], np.float32)
        self._blur = np.array([m.blur for m in materials], np.float32)
        self._gloss = np.array([m.gloss for m in materials], np.float32)
        self._emission = np.array([m.emission for m in materials], np.float32)
        self._corners = corners
        self._embree = EmbreeScene()
        # Embree copies the corners when the mesh is made.
        TriangleMesh(self._embree, np.ascontiguousarray(corners, np.float32))

    # Needed by pictures only: a scene that is merely asked for hit points never makes them.
    @cached_property
    def _textures(self) -> TextureSet:
        return TextureSet(self._names)

    @cached_property
    def _texel_density(self) -> Floats:
        return texel_density(self._corners, self._uv)

    @cached_property
    def _surface(self) -> Ints:
        return surface_numbers(self._corners, self._object, self._material)

    def render(self, camera: Camera, rng: np.random.Generator) -> Rendering:
        """Render a picture; `rng` only spreads the samples of antialiased edges and blur."""
        height, width = camera.height, camera.width
        y, x = np.mgrid[0:height, 0:width].astype(np.float32)
        rays = camera.rays(x.ravel() + 0.5, y.ravel() + 0.5)
        origins = np.broadcast_to(np.asarray(camera.position, np.float32), rays.shape)
        hits = self._cast(np.ascontiguousarray(origins), rays)
        turn = (np.arange(height)[:, None] % DITHER) * DITHER + np.arange(width)[None, :] % DITHER
        direct = np.empty_like(hits.point)
        open_sky = np.empty(len(rays), np.float32)
        for band in _bands(len(rays)):
            direct[band], open_sky[band] = self._irradiance(hits.part(band), turn.ravel()[band])
        mirrored = self._mirrored(
            hits, (turn % 2 + turn // DITHER % 2 * 2 == 0).ravel(), camera, rng
        )
        surface = np.where(hits.triangle >= 0, self._surface[hits.triangle], -1)
        planes = np.concatenate([direct.T, open_sky[None]]).reshape(-1, height, width)
        even = average_inside(planes, surface.reshape(height, width)).reshape(len(planes), -1).T
        soft = np.concatenate([even, mirrored], axis=1)
        light = mirrored.copy()
        for band in _bands(len(rays)):
            lit = soft[band]
            light[band] += self._shade(hits.part(band), lit[:, :3], lit[:, 3], camera.focal)
        image = light.reshape(height, width, 3)
        self._soften_edges(image, surface.reshape(height, width), camera, soft)
        number = np.where(hits.triangle >= 0, self._object[hits.triangle], 0)
        return Rendering(
            image,
            number.reshape(height, width).astype(np.int32),
            hits.distance.reshape(height, width),
        )

    def pick(self, camera: Camera, x: Floats, y: Floats) -> tuple[Floats, Floats, Ints]:
        """Cast rays through image points: hit points (N, 3), normals (N, 3), object numbers.

        A ray that leaves the scene has object number -1.
        """
        rays = camera.rays(x, y)
        origins = np.broadcast_to(np.asarray(camera.position, np.float32), rays.shape)
        hits = self._cast(np.ascontiguousarray(origins), rays)
        number = np.where(hits.triangle >= 0, self._object[hits.triangle], -1)
        return hits.point, hits.normal, number.astype(np.int32)

    def _cast(self, origins: Floats, rays: Floats) -> _Hits:
        found = self._embree.run(origins, rays, query="INTERSECT", output=True)
        triangle = found["primID"].astype(np.int32)
        missed = found["geomID"] < 0
        triangle[missed] = -1
        distance = np.where(missed, np.float32(30.0), found["tfar"])
        u, v = found["u"][:, None], found["v"][:, None]
        corner_normals = self._normals[triangle]
        normal = (
            corner_normals[:, 0] * (1 - u - v) + corner_normals[:, 1] * u + corner_normals[:, 2] * v
        )
        normal /= np.maximum(np.sqrt(np.einsum("ij,ij->i", normal, normal)), 1e-9)[:, None]
        facing = np.einsum("ij,ij->i", normal, rays)
        normal[facing > 0] *= -1
        corner_uv = self._uv[triangle]
        uv = corner_uv[:, 0] * (1 - u - v) + corner_uv[:, 1] * u + corner_uv[:, 2] * v
        point = origins + rays * distance[:, None]
        return _Hits(triangle, distance, point, normal, uv, rays, np.abs(facing))

    def _irradiance(self, hits: _Hits, turn: npt.NDArray[np.int64]) -> tuple[Floats, Floats]:
        """Return light from the lamps (N, 3) and the open share of the hemisphere (N,)."""
        start = hits.point + hits.normal * LIFT
        direct = np.zeros_like(hits.point)
        for number, light in enumerate(self.lights):
            a, b = np.asarray(light.side_a, np.float32), np.asarray(light.side_b, np.float32)
            facing = np.cross(a, b)
            area = 4 * float(np.linalg.norm(facing))
            facing = facing / max(float(np.linalg.norm(facing)), 1e-9)
            table = stratified(number).astype(np.float32)
            target = np.asarray(light.centre, np.float32) + table @ np.stack([a, b])
            towards = target[turn] - start
            square = np.maximum(np.einsum("ij,ij->i", towards, towards), 1e-4)
            towards_unit = towards / np.sqrt(square)[:, None]
            cosine = np.maximum(np.einsum("ij,ij->i", towards_unit, hits.normal), 0)
            cosine *= np.abs(towards_unit @ facing)
            clear = self._embree.run(start, towards, dists=ones(len(start)), query="OCCLUDED") < 0
            share = np.where(clear, cosine / square * area, 0).astype(np.float32)
            direct += share[:, None] * np.asarray(light.power, np.float32)
        return direct, self._open_share(start, hits.normal, turn)

    def _open_share(self, start: Floats, normal: Floats, turn: npt.NDArray[np.int64]) -> Floats:
        table = hemisphere()
        local = table[turn]
        away = np.stack([normal[:, 1], -normal[:, 0], np.zeros(len(normal), np.float32)], axis=1)
        away[np.abs(normal[:, 2]) > 0.9] = (1.0, 0.0, 0.0)
        side = away - normal * np.einsum("ij,ij->i", away, normal)[:, None]
        side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-9)
        other = np.cross(normal, side)
        ray = side * local[:, :1] + other * local[:, 1:2] + normal * local[:, 2:]
        reach = np.full(len(start), AMBIENT_REACH, np.float32)
        hit = self._embree.run(start, ray.astype(np.float32), dists=reach, query="OCCLUDED")
        return np.asarray(hit < 0, np.float32)

    def _shade(
        self,
        hits: _Hits,
        direct: Floats,
        open_sky: Floats,
        focal: float,
    ) -> Floats:
        material = self._material[hits.triangle]
        texels = hits.distance / focal * self._texel_density[hits.triangle]
        texels /= np.sqrt(np.maximum(hits.facing, 0.05))
        colour = self._textures.sample(self._texture[material], hits.uv, texels.astype(np.float32))
        colour *= self._tint[material]
        bounce = 0.75 + 0.25 * hits.normal[:, 2:3]
        light = colour * (direct + self.ambient * bounce * (0.25 + 0.75 * open_sky[:, None]))
        light += colour * self._emission[material][:, None]
        light += self._highlights(hits, material)
        light[hits.triangle < 0] = self.ambient
        result: Floats = light.astype(np.float32)
        return result

    def _highlights(self, hits: _Hits, material: Ints) -> Floats:
        """Blinn-Phong highlights of the lamps' centres, unshadowed: glints, not light transport."""
        result = np.zeros_like(hits.point)
        glossy = np.flatnonzero(self._gloss[material] > 0)
        for light in self.lights if len(glossy) else ():
            towards = np.asarray(light.centre, np.float32) - hits.point[glossy]
            square = np.einsum("ij,ij->i", towards, towards)
            half = towards / np.sqrt(square)[:, None] - hits.ray[glossy]
            half /= np.linalg.norm(half, axis=1, keepdims=True)
            cosine = np.maximum(np.einsum("ij,ij->i", half, hits.normal[glossy]), 0)
            strength = self._gloss[material[glossy]] * cosine**60 / np.maximum(square, 0.5)
            result[glossy] += strength[:, None] * np.asarray(light.power, np.float32)
        return result

    def _mirrored(
        self, hits: _Hits, quarter: npt.NDArray[np.bool_], camera: Camera, rng: np.random.Generator
    ) -> Floats:
        """Return what shiny surfaces mirror (N, 3), more at grazing angles (Schlick).

        One ray for 2x2 pixels: the reflections are blurred, and averaging spreads them again.
        """
        material = self._material[hits.triangle]
        shiny = np.flatnonzero((self._mirror[material] > 0) & quarter & (hits.triangle >= 0))
        result = np.zeros_like(hits.point)
        if not len(shiny):
            return result
        spread = self._blur[material[shiny]][:, None]
        normal = hits.normal[shiny] + rng.normal(0, 1, (len(shiny), 3)).astype(np.float32) * spread
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        ray = hits.ray[shiny]
        away = ray - 2 * np.einsum("ij,ij->i", ray, normal)[:, None] * normal
        seen = self._cast(hits.point[shiny] + hits.normal[shiny] * LIFT, away.astype(np.float32))
        seen.distance[:] += hits.distance[shiny]
        direct = np.full_like(seen.point, 0.9) * self.ambient
        light = self._shade(seen, direct, np.ones(len(shiny), np.float32), camera.focal * 0.25)
        base = self._mirror[material[shiny]]
        share = base + (1 - base) * base * 4 * (1 - hits.facing[shiny]) ** 4
        result[shiny] = np.minimum(light, MIRRORED_AT_MOST) * np.minimum(share, 0.85)[:, None]
        sparse = result.reshape(camera.height, camera.width, 3)[::2, ::2]
        cast = np.zeros(len(result), np.float32)
        cast[shiny] = 1
        weight = cv2.GaussianBlur(cast.reshape(camera.height, camera.width)[::2, ::2], (0, 0), 2.5)
        even = cv2.GaussianBlur(sparse, (0, 0), 2.5) / np.maximum(weight, 0.02)[..., None]
        full = cv2.resize(even, (camera.width, camera.height), interpolation=cv2.INTER_LINEAR)
        full[self._mirror[material].reshape(full.shape[:2]) == 0] = 0
        reflected: Floats = full.reshape(-1, 3).astype(np.float32)
        return reflected

    def _soften_edges(self, image: Floats, surface: Ints, camera: Camera, smooth: Floats) -> None:
        """Average three more rays into every pixel on the border of two surfaces."""
        edge = np.zeros(surface.shape, np.bool_)
        across, down = surface[:, 1:] != surface[:, :-1], surface[1:] != surface[:-1]
        edge[:, 1:] |= across
        edge[:, :-1] |= across
        edge[1:] |= down
        edge[:-1] |= down
        rows, columns = np.nonzero(edge)
        if not len(rows):
            return
        total = image[rows, columns].copy()
        flat = rows * camera.width + columns
        for shift_x, shift_y in ((0.17, 0.39), (0.61, 0.13), (0.83, 0.73)):
            rays = camera.rays(columns + np.float32(shift_x), rows + np.float32(shift_y))
            origins = np.broadcast_to(np.asarray(camera.position, np.float32), rays.shape)
            hits = self._cast(np.ascontiguousarray(origins), rays)
            source = self._neighbour_on_surface(hits, surface, rows, columns)
            near = smooth[np.where(source >= 0, source, flat)]
            total += self._shade(hits, near[:, :3], near[:, 3], camera.focal) + near[:, 4:]
        image[rows, columns] = total / 4

    def _neighbour_on_surface(
        self,
        hits: _Hits,
        surface: Ints,
        rows: npt.NDArray[np.int64],
        columns: npt.NDArray[np.int64],
    ) -> npt.NDArray[np.int64]:
        """Return the flat index of a pixel nearby that shows the same surface, -1 where none does.

        Its light is already smooth, which saves the shadow rays of the edge samples.
        """
        height, width = surface.shape
        wanted = np.where(hits.triangle >= 0, self._surface[hits.triangle], -1)
        source = np.full(len(rows), -1, np.int64)
        for dy, dx in ((0, 0), (0, 1), (1, 0), (0, -1), (-1, 0), (1, 1), (-1, -1)):
            r, c = np.clip(rows + dy, 0, height - 1), np.clip(columns + dx, 0, width - 1)
            fits = (source < 0) & (surface[r, c] == wanted)
            source[fits] = (r * width + c)[fits]
        return source


@dataclass(frozen=True, slots=True)
class _Hits:
    triangle: Ints
    distance: Floats
    point: Floats
    normal: Floats
    uv: Floats
    ray: Floats
    facing: Floats

    def part(self, band: slice) -> _Hits:
        return _Hits(
            self.triangle[band],
            self.distance[band],
            self.point[band],
            self.normal[band],
            self.uv[band],
            self.ray[band],
            self.facing[band],
        )


def _bands(count: int, size: int = 20480) -> list[slice]:
    """Cut a picture into bands whose temporaries stay in the processor's cache."""
    return [slice(start, start + size) for start in range(0, count, size)]
