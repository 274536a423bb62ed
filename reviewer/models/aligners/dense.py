"""Dense flow (DIS), checked forwards and backwards; flow is live -> reference.

Kroeger et al., "Fast Optical Flow using Dense Inverse Search", ECCV 2016, as OpenCV implements it.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from reviewer.masks import Mask
from reviewer.models.aligners.planes import flow_of_homography, grey
from reviewer.models.aligners.rivals import BothWays, by_planes, fused, there_and_back
from reviewer.models.aligners.sight import clipped, confidence_of
from reviewer.models.interfaces import Alignment, Field, Image, ModelFailed
from reviewer.models.warping import inside, warp_image

LONELY = 0.1


@dataclass(frozen=True, slots=True)
class DisAligner:
    """Dense flow that follows parallax, checked forwards and backwards.

    Where the two directions disagree (occlusion, and just the changed objects) the flow there is
    not believed: it is interpolated from the agreeing pixels around, so that a new object is
    compared with what lay behind it. Far from any agreeing pixel (a large object, a bare wall) the
    homography that most agreeing pixels follow stands in. Where too few pixels agree, the pair is
    brought together by homographies of matched features first, and each pixel follows the start
    that serves it best.

    A pixel is valid where the reference has it and the confidence reaches `least_confidence`; what
    is not valid is *unseen*.

    Attributes:
        disagreement_px: largest forward-backward error of a pixel that agrees.
        reach_px: standard deviation of the interpolation.
        enough: share of valid pixels from which no other start is tried.
        starts: most homographies that are tried; 0 = none.
        least_confidence: below it a pixel is unseen.
    """

    disagreement_px: float = 1.5
    reach_px: float = 14.0
    enough: float = 0.9
    starts: int = 3
    least_confidence: float = 0.25

    def align(self, reference: Image, live: Image) -> Alignment:
        """Estimate flow in both directions and keep what agrees."""
        if reference.shape != live.shape:
            raise ModelFailed(
                "aligner dis: needs images of one size (height, width), but reference is "
                f"{reference.shape[:2]} and live is {live.shape[:2]}"
            )
        present, past = _even_light(live), _even_light(reference)
        found = BothWays(_dense_flow(present, past), _dense_flow(past, present))
        alignment = self._judged(found, reference, live)
        if alignment.valid.mean() >= self.enough or not self.starts:
            return alignment
        rivals = by_planes(reference, live, present, past, _dense_flow, self.starts)
        if not rivals:
            return alignment
        other = self._judged(fused([found, *rivals], present, past), reference, live)
        return max(alignment, other, key=lambda each: each.valid.mean())

    def _judged(self, found: BothWays, reference: Image, live: Image) -> Alignment:
        height, width = live.shape[:2]
        agreed = self._agreed(found)
        flow, support = _interpolate(found.forward, agreed, self.reach_px)
        plane = _fit_plane(found.forward, agreed)
        confidence = confidence_of(found.forward, agreed, plane)
        if plane is not None:
            # Far from any agreeing pixel, as inside a large new object: one plane for the view.
            weight = np.clip(support / LONELY, 0, 1)[..., None]
            flow = (weight * flow + (1 - weight) * plane).astype(np.float32)
        confidence[~inside(flow, height, width)] = 0
        confidence[clipped(live, warp_image(reference, flow))] = 0
        return Alignment(flow, confidence >= self.least_confidence, found.backward, confidence)

    def _agreed(self, found: BothWays) -> Mask:
        height, width = found.forward.shape[:2]
        near: Mask = there_and_back(found) < self.disagreement_px
        return near & inside(found.forward, height, width)


def _even_light(image: Image) -> Image:
    """Equalise local contrast, so that another exposure does not look like motion."""
    equalised = cv2.createCLAHE(clipLimit=3.0, tileGridSize=(8, 6)).apply(grey(image))
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
    return flow_of_homography(np.asarray(matrix, np.float64), *flow.shape[:2])


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
