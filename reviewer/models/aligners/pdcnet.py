"""PDC-Net, the paper's aligner, through an installed copy of DenseMatching (LGPL-2.1, needs CUDA).

The repository is not copied here and cannot be installed by pip: `docs/pdcnet.md` says step by step
how it gets onto a machine. Its flow lives in the frame of the *target* and points to the *source*,
so live is passed as target and the reference as source.

Source: Truong et al., "Learning Accurate Dense Correspondences and When to Trust Them", CVPR 2021.
"""

from __future__ import annotations

import sys
from argparse import Namespace
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import torch

from reviewer.errors import InvalidInput
from reviewer.models.device import best_device, check_weights
from reviewer.models.interfaces import Alignment, Image
from reviewer.models.warping import inside
from reviewer.words import PdcNetwork

INSTEAD = "docs/pdcnet.md says how to install it; --aligner dis needs no weights"


@dataclass
class PdcNetAligner:
    """Dense flow with a confidence: valid where PDC-Net is confident.

    Attributes:
        repository: folder of DenseMatching; its weights lie in `pre_trained_models/`.
        network: PDCNet or PDCNet_plus.
        trained_on: what its weights were trained on, as their file's name says.
        least_confidence: probability that the flow is right within `radius_px`, the paper's p_r.
        radius_px: R of the confidence, pixels.
        multi_stage: how large displacements are met, as DenseMatching names it.
        weights: fingerprint; where given, the checkpoint must still hold those.
    """

    repository: str = "DenseMatching"
    network: PdcNetwork = "PDCNet"
    trained_on: str = "megadepth"
    least_confidence: float = 0.5
    radius_px: float = 1.0
    multi_stage: str = "direct"
    weights: str = ""

    def __post_init__(self) -> None:
        """Import DenseMatching and load the net.

        Raises:
            InvalidInput: when it is not there, or its weights are not.
        """
        folder = Path(self.repository).expanduser().resolve()
        option = f"--aligner pdcnet:{self.repository}"
        if not (folder / "model_selection.py").is_file():
            raise InvalidInput(f"{option}: holds no DenseMatching; {INSTEAD}")
        # At the end: its top-level names ("models", "datasets") must not hide others.
        if str(folder) not in sys.path:
            sys.path.append(str(folder))
        try:
            select = import_module("model_selection").select_model
            self._net, _ = select(
                self.network,
                self.trained_on,
                self._arguments(),
                3,
                7,
                path_to_pre_trained_models=str(folder / "pre_trained_models"),
            )
        except Exception as error:  # what a foreign repository raises is not ours to know
            reason = str(error).strip().partition("\n")[0]
            raise InvalidInput(f"{option}: cannot be loaded, {reason}; {INSTEAD}") from error
        self.weights = check_weights(option, self._net, self.weights)
        self._device = best_device()
        self._net.to(self._device).eval()

    def align(self, reference: Image, live: Image) -> Alignment:
        """Estimate the flow both ways; it is valid where the net is confident."""
        flow, confidence = self._estimate(source=reference, target=live)
        backward, _ = self._estimate(source=live, target=reference)
        sure = confidence > self.least_confidence
        return Alignment(flow, inside(flow, *reference.shape[:2]) & sure, backward)

    def _estimate(self, source: Image, target: Image) -> tuple[Any, Any]:
        """Return flow float32 (H, W, 2) from target to source, and p_r float32 (H, W)."""
        tensors = [
            torch.from_numpy(np.ascontiguousarray(image)).permute(2, 0, 1)[None].to(self._device)
            for image in (source, target)
        ]
        with torch.inference_mode():
            flow, uncertainty = self._net.estimate_flow_and_confidence_map(*tensors)
        height, width = target.shape[:2]
        pixels = flow[0].permute(1, 2, 0).float().cpu().numpy()
        chance = uncertainty["p_r"].float().cpu().numpy().reshape(height, width)
        return np.ascontiguousarray(pixels), chance

    def _arguments(self) -> Namespace:
        """Return the arguments that DenseMatching's command line would pass."""
        return Namespace(
            network_type="PDCNet",
            confidence_map_R=self.radius_px,
            ransac_thresh=1.0,
            multi_stage_type=self.multi_stage,
            mask_type="proba_interval_1_above_5",
            homography_visibility_mask=True,
            scaling_factors=[0.5, 0.6, 0.88, 1, 1.33, 1.66, 2],
            compute_cyclic_consistency_error=False,
        )
