"""One homography for the whole view: from features, or from the pictures themselves (ECC).

Flow is live -> reference. Features are Lowe's SIFT, the homography is MAGSAC++; ECC is Evangelidis
and Psarakis, "Parametric Image Alignment Using Enhanced Correlation Coefficient Maximization",
PAMI 2008, as OpenCV implements it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from reviewer.models.interfaces import Alignment, Field, Image, ModelFailed
from reviewer.models.warping import inside

Matrix = npt.NDArray[np.float64]
Features = tuple[Sequence[Any], npt.NDArray[np.float32] | None]


@dataclass(frozen=True, slots=True)
class HomographyAligner:
    """One plane for the whole view: right for distant or flat scenes, cheap, never bends objects.

    Attributes:
        ratio: Lowe's ratio test on the two best matches.
        tolerance_px: reprojection error of an inlier.
        least_inliers: below this the pair counts as not aligned.
    """

    ratio: float = 0.8
    tolerance_px: float = 3.0
    least_inliers: int = 12

    def align(self, reference: Image, live: Image) -> Alignment:
        """Estimate the homography and turn it into a flow field."""
        present, past = features(live), features(reference)
        matrix = self._match(present, past)
        return alignment_of_planes(matrix, lambda: self._match(past, present), reference, live)

    def estimate(self, reference: Image, live: Image) -> Matrix:
        """Return the 3x3 matrix that maps live pixels to reference pixels."""
        return self._match(features(live), features(reference))

    def _match(self, present: Features, past: Features) -> Matrix:
        """Return the matrix that maps pixels of the first to pixels of the second."""
        source, target = matched_points(present, past, self.ratio)
        if len(source) < self.least_inliers:
            raise ModelFailed(
                f"aligner homography: {len(source)} matches, but {self.least_inliers} are needed"
            )
        return robust_homography(
            source, target, self.tolerance_px, self.least_inliers, "aligner homography"
        )


@dataclass(frozen=True, slots=True)
class EccAligner:
    """One plane, refined until the pictures correlate best: finer than features, blind to light.

    Starts from the features' homography, or from no motion where there are too few features (a
    carpet, a bare table), and goes from coarse to fine.

    Attributes:
        levels: sizes at which it is refined, coarse to fine, as shares of the whole.
        iterations: most steps at each size.
        least_correlation: below this the pair counts as not aligned.
    """

    levels: tuple[float, ...] = (0.25, 0.5, 1.0)
    iterations: int = 40
    least_correlation: float = 0.5

    def align(self, reference: Image, live: Image) -> Alignment:
        """Refine the homography and turn it into a flow field."""
        try:
            start = HomographyAligner().estimate(reference, live)
        except ModelFailed:
            start = np.eye(3)
        matrix = self._estimate(reference, live, start)
        inverse = np.asarray(np.linalg.inv(start), np.float64)
        way_back = partial(self._estimate, live, reference, inverse)
        return alignment_of_planes(matrix, way_back, reference, live)

    def _estimate(self, reference: Image, live: Image, matrix: Matrix) -> Matrix:
        correlation = 0.0
        for level in self.levels:
            matrix, correlation = self._refine(reference, live, matrix, level)
        if correlation < self.least_correlation:
            raise ModelFailed(
                f"aligner ecc: the pictures correlate by {correlation:.2f} only,"
                f" {self.least_correlation} is needed"
            )
        return matrix

    def _refine(
        self, reference: Image, live: Image, matrix: Matrix, level: float
    ) -> tuple[Matrix, float]:
        scale = np.diag([level, level, 1.0])
        present, past = (
            cv2.resize(grey(image), None, fx=level, fy=level, interpolation=cv2.INTER_AREA)
            for image in (live, reference)
        )
        everywhere = np.full(past.shape, 255, np.uint8)
        start = (scale @ matrix @ np.linalg.inv(scale)).astype(np.float32)
        stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, self.iterations, 1e-5)
        try:
            correlation, found = cv2.findTransformECC(
                present, past, start / start[2, 2], cv2.MOTION_HOMOGRAPHY, stop, everywhere, 5
            )
        except cv2.error as error:
            raise ModelFailed(
                "aligner ecc: does not converge; the pictures show too little alike"
            ) from error
        return np.linalg.inv(scale) @ np.asarray(found, np.float64) @ scale, float(correlation)


def grey(image: Image) -> Image:
    """Return the grey picture, uint8 (H, W)."""
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)


def features(image: Image) -> Features:
    """Return SIFT keypoints and descriptors of a picture."""
    points, described = cv2.SIFT.create(nfeatures=1500).detectAndCompute(grey(image), None)
    return points, described


def matched_points(present: Features, past: Features, ratio: float) -> tuple[Field, Field]:
    """Return the points (N, 2) of matches that pass Lowe's ratio test, and where they match.

    Raises:
        ModelFailed: when one of the two has no features.
    """
    (live_points, live_features), (past_points, past_features) = present, past
    if live_features is None or past_features is None or len(past_features) < 2:
        raise ModelFailed("aligner homography: an image has no features to match")
    pairs = cv2.BFMatcher(cv2.NORM_L2).knnMatch(live_features, past_features, k=2)
    good = [p[0] for p in pairs if len(p) == 2 and p[0].distance < ratio * p[1].distance]
    source = np.array([live_points[m.queryIdx].pt for m in good], np.float32).reshape(-1, 2)
    target = np.array([past_points[m.trainIdx].pt for m in good], np.float32).reshape(-1, 2)
    return source, target


def alignment_of_planes(
    matrix: Matrix, way_back: Callable[[], Matrix], reference: Image, live: Image
) -> Alignment:
    """Return the alignment of a homography live -> reference, and of one found the other way.

    Where there is no way back the way there stands by itself, with nothing to judge it by.
    """
    flow = flow_of_homography(matrix, live.shape[0], live.shape[1])
    backward = None
    with suppress(ModelFailed):
        backward = flow_of_homography(way_back(), reference.shape[0], reference.shape[1])
    return Alignment(flow, inside(flow, reference.shape[0], reference.shape[1]), backward)


def robust_homography(
    source: Field, target: Field, tolerance_px: float, least_inliers: int, aligner: str
) -> Matrix:
    """Return the 3x3 matrix that most matches (N, 2) follow, live to reference.

    Raises:
        ModelFailed: in the name of `aligner`, when too few do.
    """
    cv2.setRNGSeed(0)
    matrix, inliers = cv2.findHomography(
        source, target, cv2.USAC_MAGSAC, tolerance_px, maxIters=2000, confidence=0.999
    )
    found = 0 if inliers is None else int(inliers.sum())
    if matrix is None or found < least_inliers:
        raise ModelFailed(f"{aligner}: {found} inliers, but {least_inliers} are needed")
    return np.asarray(matrix, np.float64)


def flow_of_homography(matrix: Matrix, height: int, width: int) -> Field:
    """Return the flow field of a 3x3 matrix that maps live pixels to reference pixels."""
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    points = np.stack([x, y], axis=2)
    landed = cv2.perspectiveTransform(points.reshape(-1, 1, 2), matrix)
    return np.asarray(landed.reshape(height, width, 2) - points, np.float32)
