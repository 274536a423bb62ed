"""Which live image goes with which reference: by viewpoint in a `sequence`, else by file name."""

from __future__ import annotations

from pathlib import Path

from reviewer.dataset.layouts import Skipped
from reviewer.dataset.poses import StampedPose, closest_references, read_poses
from reviewer.dataset.settings import ImportSettings
from reviewer.errors import InvalidInput
from reviewer.geometry import wrap_angle

Poses = dict[tuple[str, str], StampedPose]
"""Poses by session and image name."""
Match = tuple[str, str, float | None]
"""Names of reference and live image, and the distance of their viewpoints."""


def poses_of(folder: Path, settings: ImportSettings) -> Poses:
    """Return the poses of a split; none where a layout does without.

    Raises:
        InvalidInput: when they are malformed, or missing where pairs are made from them.
    """
    path = folder / "poses.csv"
    if path.exists() or path.is_symlink():
        return read_poses(path, settings.heading)
    if settings.layout == "sequence":
        raise InvalidInput(f"{path}: is missing; pairs of layout sequence are made from poses")
    return {}


def match_images(
    references: dict[str, Path], lives: dict[str, Path], poses: Poses, settings: ImportSettings
) -> tuple[list[Match], list[Skipped]]:
    """Return the matches, and the images without a match with the reason.

    Raises:
        InvalidInput: when an image of a `sequence` has no pose.
    """
    if settings.layout != "sequence":
        alone = [(lives[n], "no reference of that name") for n in lives if n not in references]
        alone += [(references[n], "no live of that name") for n in references if n not in lives]
        return [(n, n, None) for n in lives if n in references], alone
    for session, images in (("reference", references), ("live", lives)):
        for name in images:
            if (session, name) not in poses:
                raise InvalidInput(f"{images[name]}: has no row in poses.csv")
    if not references:
        return [], [(path, "there are no reference images") for path in lives.values()]
    past = list(references)
    found = closest_references(
        [poses["live", name].pose for name in lives],
        [poses["reference", name].pose for name in past],
        metres_per_radian=settings.metres_per_radian,
    )
    matches: list[Match] = []
    alone = []
    for name, (index, distance) in zip(lives, found, strict=True):
        if distance <= settings.max_distance:
            matches.append((past[index], name, distance))
            continue
        here, there = poses["live", name].pose, poses["reference", past[index]].pose
        turned = abs(wrap_angle(here.theta - there.theta))
        alone.append(
            (
                lives[name],
                f"closest reference is {distance:.2f} m away (limit {settings.max_distance}), with"
                f" {turned:.2f} radians of heading between them",
            )
        )
    return matches, alone
