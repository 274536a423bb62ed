"""Alignment from learnt matches: EfficientLoFTR, a robust homography, and the residual flow.

Matches that follow the homography within a few pixels (parallax included) give a smooth residual
flow around them; what no match supports follows the plane. Loads a local directory or a hub id.

Source: Wang et al., "Efficient LoFTR", CVPR 2024, as `transformers` implements it.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
import torch
from transformers import EfficientLoFTRForKeypointMatching

from reviewer.models.aligners.planes import flow_of_homography, robust_homography
from reviewer.models.device import best_device, check_weights
from reviewer.models.interfaces import Alignment, Field, Image, ModelFailed
from reviewer.models.warping import inside
from reviewer.models.weights.hub import load_pretrained

Points = npt.NDArray[np.float32]
LUMA = np.array([0.2989, 0.5870, 0.1140], np.float32)


@dataclass
class LoftrAligner:
    """Dense enough matches without a detector of corners: works on carpets and bare floors.

    Attributes:
        checkpoint: directory or hub id.
        weights: fingerprint of the weights; where given, the checkpoint must still hold those.
        height, width: size at which pictures are matched; multiples of 32. The published weights
            are for 480 x 640.
        least_score: matches with a lower score are dropped.
        tolerance_px: reprojection error of an inlier of the homography.
        parallax_px: largest departure from the homography that is followed.
        reach_px: standard deviation of the residual flow around a match.
        least_matches: below this the pair counts as not aligned.
    """

    checkpoint: str = "zju-community/efficientloftr"
    weights: str = ""
    height: int = 480
    width: int = 640
    least_score: float = 0.2
    tolerance_px: float = 3.0
    parallax_px: float = 24.0
    reach_px: float = 16.0
    least_matches: int = 12

    def __post_init__(self) -> None:
        """Load the net.

        Raises:
            InvalidInput: when there is no such checkpoint, or its weights have changed.
        """
        self._net = load_pretrained(
            EfficientLoFTRForKeypointMatching,
            self.checkpoint,
            f"--aligner loftr:{self.checkpoint}",
            types={"efficientloftr"},
            instead="name a directory or a hub id, or use --aligner dis, which needs no weights",
        )
        self._device = best_device()
        self.weights = check_weights(self.checkpoint, self._net, self.weights)
        self._net.to(self._device).eval()

    def align(self, reference: Image, live: Image) -> Alignment:
        """Match both ways, and turn the matches into flow fields."""
        flow = self._flow(reference, live)
        backward = None
        with suppress(ModelFailed):  # without a way back the way there stands by itself
            backward = self._flow(live, reference)
        return Alignment(flow, inside(flow, *reference.shape[:2]), backward)

    def _flow(self, reference: Image, live: Image) -> Field:
        source, target = self.match(reference, live)
        if len(source) < self.least_matches:
            raise ModelFailed(
                f"aligner loftr: {len(source)} matches, but {self.least_matches} are needed"
            )
        return self.flow_of_matches(source, target, *live.shape[:2])

    def match(self, reference: Image, live: Image) -> tuple[Points, Points]:
        """Return matching points (N, 2), live and reference, in their own pixels."""
        both = [self._prepared(image) for image in (live, reference)]
        pictures = np.stack(both)[None]
        with torch.inference_mode():
            out = self._net(torch.from_numpy(pictures).to(self._device))
        good = (out.matching_scores[0, 0] > self.least_score) & (out.matches[0, 0] > -1)
        points = out.keypoints[0][:, good].float().cpu().numpy()
        sizes = [(image.shape[1], image.shape[0]) for image in (live, reference)]
        source, target = (p * np.asarray(s, np.float32) for p, s in zip(points, sizes, strict=True))
        return source.astype(np.float32), target.astype(np.float32)

    def flow_of_matches(self, source: Points, target: Points, height: int, width: int) -> Field:
        """Return the flow that a homography and the matches' departures from it make.

        Raises:
            ModelFailed: when too few matches agree on a homography.
        """
        matrix = robust_homography(
            source, target, self.tolerance_px, self.least_matches, "aligner loftr"
        )
        plane = flow_of_homography(matrix, height, width)
        columns = np.clip(source[:, 0].round().astype(int), 0, width - 1)
        rows = np.clip(source[:, 1].round().astype(int), 0, height - 1)
        departure = target - source - plane[rows, columns]
        near = np.linalg.norm(departure, axis=1) < self.parallax_px
        carried = np.zeros((height, width, 3), np.float32)
        values = np.concatenate([departure[near], np.ones((near.sum(), 1), np.float32)], axis=1)
        np.add.at(carried, (rows[near], columns[near]), values)
        carried = cv2.GaussianBlur(carried, (0, 0), self.reach_px)
        # Half the weight of one match right here: where matches are rarer, the plane counts more.
        floor = 0.5 / (2 * np.pi * self.reach_px**2)
        residual = carried[..., :2] / (carried[..., 2:] + floor)
        return np.asarray(plane + residual, np.float32)

    def _prepared(self, image: Image) -> npt.NDArray[np.float32]:
        """Return float32 (3, height, width) in [0, 1], grey in all three channels."""
        how = cv2.INTER_AREA if image.shape[0] > self.height else cv2.INTER_LINEAR
        small = cv2.resize(image, (self.width, self.height), interpolation=how)
        return np.repeat((small.astype(np.float32) @ LUMA)[None] / np.float32(255), 3, axis=0)
