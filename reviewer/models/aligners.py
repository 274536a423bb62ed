"""Classical aligners: one homography from SIFT matches, and dense flow (DIS).

Flow is live -> reference. Dense flow: Kroeger et al., "Fast Optical Flow using Dense Inverse
Search", ECCV 2016, as OpenCV implements it; features are Lowe's, the homography is MAGSAC++.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from reviewer.masks import Mask
from reviewer.models.interfaces import Alignment, Field, Image, ModelFailed
from reviewer.models.warping import inside, sample_field


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
        matrix = self.estimate(reference, live)
        flow = _flow_of_homography(matrix, *live.shape[:2])
        return Alignment(flow, inside(flow, *reference.shape[:2]))

    def estimate(self, reference: Image, live: Image) -> npt.NDArray[np.float64]:
        """Return the 3x3 matrix that maps live pixels to reference pixels."""
        sift = cv2.SIFT.create(nfeatures=1500)
        live_points, live_features = sift.detectAndCompute(_grey(live), None)
        past_points, past_features = sift.detectAndCompute(_grey(reference), None)
        if live_features is None or past_features is None or len(past_features) < 2:
            raise ModelFailed("aligner homography: an image has no features to match")
        pairs = cv2.BFMatcher(cv2.NORM_L2).knnMatch(live_features, past_features, k=2)
        good = [p[0] for p in pairs if len(p) == 2 and p[0].distance < self.ratio * p[1].distance]
        if len(good) < self.least_inliers:
            raise ModelFailed(
                f"aligner homography: {len(good)} matches, but {self.least_inliers} are needed"
            )
        source = np.array([live_points[m.queryIdx].pt for m in good], np.float32)
        target = np.array([past_points[m.trainIdx].pt for m in good], np.float32)
        cv2.setRNGSeed(0)
        matrix, inliers = cv2.findHomography(
            source, target, cv2.USAC_MAGSAC, self.tolerance_px, maxIters=2000, confidence=0.999
        )
        found = 0 if inliers is None else int(inliers.sum())
        if matrix is None or found < self.least_inliers:
            raise ModelFailed(
                f"aligner homography: {found} inliers, but {self.least_inliers} are needed"
            )
        return np.asarray(matrix, np.float64)


@dataclass(frozen=True, slots=True)
class DisAligner:
    """Dense flow that follows parallax, checked forwards and backwards.

    Where the two directions disagree (occlusion, and just the changed objects) the flow there is
    not believed: it is interpolated from the agreeing pixels around, so that a new object is
    compared with what lay behind it. Far from any agreeing pixel (a large object, a bare wall) the
    homography that most agreeing pixels follow stands in. What leaves the reference is not valid.

    Attributes:
        disagreement_px: largest forward-backward error that is believed.
        reach_px: standard deviation of the interpolation.
    """

    disagreement_px: float = 1.5
    reach_px: float = 14.0

    def align(self, reference: Image, live: Image) -> Alignment:
        """Estimate flow in both directions and keep what agrees."""
        if reference.shape != live.shape:
            raise ModelFailed(
                "aligner dis: needs images of one size (height, width), but reference is "
                f"{reference.shape[:2]} and live is {live.shape[:2]}"
            )
        present, past = _even_light(live), _even_light(reference)
        forward = _dense_flow(present, past)
        backward = _dense_flow(past, present)
        height, width = present.shape
        landing = sample_field(backward, forward)
        error = np.linalg.norm(forward + landing, axis=2)
        agreed = (error < self.disagreement_px) & inside(forward, height, width)
        flow, support = _interpolate(forward, agreed, self.reach_px)
        lonely = support < 0.1
        if lonely.any():
            # Far from any agreeing pixel, as inside a large new object: one plane for the view.
            plane = _fit_plane(forward, agreed)
            if plane is None:
                return Alignment(flow, ~lonely & inside(flow, height, width))
            weight = np.clip(support / 0.1, 0, 1)[..., None]
            flow = (weight * flow + (1 - weight) * plane).astype(np.float32)
        return Alignment(flow, inside(flow, height, width))


def _grey(image: Image) -> Image:
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)


def _even_light(image: Image) -> Image:
    """Equalise local contrast, so that another exposure does not look like motion."""
    equalised = cv2.createCLAHE(clipLimit=3.0, tileGridSize=(8, 6)).apply(_grey(image))
    return np.asarray(equalised, np.uint8)


def _dense_flow(source: Image, target: Image) -> Field:
    method = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    return np.asarray(method.calc(source, target, None), np.float32)


def _fit_plane(flow: Field, agreed: Mask) -> Field | None:
    """Return the flow of the homography that most agreeing pixels follow; None without enough."""
    rows, columns = np.nonzero(agreed[::8, ::8])
    if len(rows) < 100:
        return None
    source = np.stack([columns, rows], axis=1).astype(np.float32) * 8
    target = source + flow[::8, ::8][rows, columns]
    cv2.setRNGSeed(0)
    matrix, _ = cv2.findHomography(source, target, cv2.USAC_MAGSAC, 2.0, maxIters=500)
    if matrix is None:
        return None
    return _flow_of_homography(np.asarray(matrix, np.float64), *flow.shape[:2])


def _flow_of_homography(matrix: npt.NDArray[np.float64], height: int, width: int) -> Field:
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    points = np.stack([x, y], axis=2)
    landed = cv2.perspectiveTransform(points.reshape(-1, 1, 2), matrix)
    return np.asarray(landed.reshape(height, width, 2) - points, np.float32)


def _interpolate(flow: Field, agreed: Mask, reach_px: float) -> tuple[Field, Field]:
    """Replace flow off `agreed` by a Gaussian average of the agreeing flow around it.

    Works at quarter size: the average is smooth. Returns the flow and the support in [0, 1].
    """
    height, width = agreed.shape
    weight = agreed.astype(np.float32)
    small = (max(1, width // 4), max(1, height // 4))
    light = cv2.resize(weight, small, interpolation=cv2.INTER_AREA)
    carried = cv2.resize(flow * weight[..., None], small, interpolation=cv2.INTER_AREA)
    sigma = reach_px / 4
    support = cv2.GaussianBlur(light, (0, 0), sigma)
    mean = cv2.GaussianBlur(carried, (0, 0), sigma) / np.maximum(support, 1e-4)[..., None]
    wide_mean = cv2.resize(mean, (width, height), interpolation=cv2.INTER_LINEAR)
    wide_support = cv2.resize(support, (width, height), interpolation=cv2.INTER_LINEAR)
    # A soft edge between believed and interpolated flow keeps the warped image free of tears.
    trust = cv2.GaussianBlur(cv2.erode(weight, np.ones((5, 5), np.uint8)), (0, 0), 2.0)[..., None]
    blended = trust * flow + (1 - trust) * wide_mean
    return blended.astype(np.float32), wide_support.astype(np.float32)
