"""The adapter to DenseMatching, against a stand-in with its interface."""

import sys

import numpy as np
import pytest
from scenes import textured

from reviewer.errors import InvalidInput
from reviewer.models.registry import build_aligner, settings_of
from reviewer.models.warping import warp_image

STAND_IN = '''
import torch

CALLS = []

class Net(torch.nn.Module):
    """Knows the shift of the test: the live view shows the reference 6 to the left, 4 lower."""

    def __init__(self, which):
        super().__init__()
        self.weight = torch.nn.Parameter(torch.full((1,), float(which)))

    def estimate_flow_and_confidence_map(self, source_img, target_img, output_shape=None,
                                         scaling=1.0, mode="channel_first"):
        assert source_img.shape == target_img.shape and source_img.dtype == torch.uint8
        _, channels, height, width = target_img.shape
        assert channels == 3 and mode == "channel_first"
        CALLS.append((source_img[0, :, 50, 50].tolist(), target_img[0, :, 50, 50].tolist()))
        ahead = 1 if len(CALLS) % 2 else -1
        flow = torch.empty(1, 2, height, width)
        flow[:, 0], flow[:, 1] = 6.0 * ahead, -4.0 * ahead
        sure = torch.ones(1, 1, height, width)
        sure[..., :20] = 0.3
        return flow, {"p_r": sure}


def select_model(model_name, pre_trained_model_type, arguments, global_optim_iter,
                 local_optim_iter, path_to_pre_trained_models=""):
    assert model_name == "PDCNet" and pre_trained_model_type == "megadepth"
    assert (global_optim_iter, local_optim_iter) == (3, 7)
    assert arguments.network_type == "PDCNet" and arguments.confidence_map_R == 1.0
    with open(path_to_pre_trained_models + "/PDCNet_megadepth.pth.tar") as file:
        return Net(file.read()), True
'''


@pytest.fixture
def repository(tmp_path, monkeypatch):
    folder = tmp_path / "DenseMatching"
    (folder / "pre_trained_models").mkdir(parents=True)
    (folder / "model_selection.py").write_text(STAND_IN)
    (folder / "pre_trained_models" / "PDCNet_megadepth.pth.tar").write_text("1")
    monkeypatch.setattr(sys, "path", list(sys.path))
    yield folder
    sys.modules.pop("model_selection", None)


def test_the_reference_is_the_source_and_flow_goes_from_live_to_it(repository):
    reference = textured(3)
    live = np.roll(reference, (4, -6), axis=(0, 1))
    alignment = build_aligner("pdcnet", {"repository": str(repository)}).align(reference, live)
    calls = sys.modules["model_selection"].CALLS
    assert calls[0] == (reference[50, 50].tolist(), live[50, 50].tolist())
    assert calls[1] == calls[0][::-1]
    inner = np.s_[10:-10, 30:-10]
    np.testing.assert_array_equal(warp_image(reference, alignment.flow)[inner], live[inner])
    # Where the net is not sure, and where the flow leaves the reference, nothing can be compared.
    assert not alignment.valid[:, :20].any() and alignment.valid[10:-10, 20:-10].all()
    assert not alignment.valid[:4].any() and not alignment.valid[:, -6:].any()
    np.testing.assert_array_equal(alignment.backward, -alignment.flow)


def test_its_settings_name_the_weights(repository):
    settings = settings_of(build_aligner("pdcnet", {"repository": str(repository)}))
    assert len(settings["weights"]) == 12
    with pytest.raises(InvalidInput, match="holds other weights"):
        build_aligner("pdcnet", {**settings, "weights": "0" * 12})


def test_what_is_missing_is_named_with_the_page_that_helps(repository, tmp_path):
    with pytest.raises(InvalidInput, match=r"holds no DenseMatching; docs/pdcnet\.md"):
        build_aligner("pdcnet", {"repository": str(tmp_path)})
    (repository / "pre_trained_models" / "PDCNet_megadepth.pth.tar").unlink()
    with pytest.raises(InvalidInput, match=r"cannot be loaded, .*No such file"):
        build_aligner("pdcnet", {"repository": str(repository)})
