"""Weights files that are none, or damaged: one sentence with the file's name."""

import pytest
import torch

from reviewer.errors import InvalidInput
from reviewer.models.nets.checkpoints import FORMAT, load_checkpoint


@pytest.mark.parametrize("name", ["a.pt", "a.pth", "a.safetensors"])
@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", bytes(range(256)) * 4, b"\x80\x02."])
def test_junk_is_no_checkpoint(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InvalidInput, match=name) as caught:
        load_checkpoint(tmp_path / name)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "content",
    [
        {"format": FORMAT},
        {"format": FORMAT, "record": {}, "state": {}},
        {"format": FORMAT, "record": 5, "state": {}},
        {"format": FORMAT, "record": {"net": "magic"}, "state": {}},
        {"format": FORMAT, "record": {"net": ["cdnet"]}, "state": {}},
        {"format": FORMAT, "record": {"net": "cdnet", "threshold": "high"}, "state": {}},
        {"format": FORMAT, "record": {"net": "cdnet", "width": "wide"}, "state": {}},
        {"format": FORMAT, "record": {"net": "cdnet"}, "state": {}},
        {"format": FORMAT, "record": {"net": "cdnet"}, "state": 5},
        {"format": FORMAT, "record": {"net": "cdnet"}, "state": {"enc1_conv1.weight": 5}},
        {1: torch.zeros(2)},
        {"enc1_conv1.weight": torch.zeros(()), "dec_conv1.weight": torch.zeros(2)},
    ],
)
def test_a_damaged_record_or_state_is_named(tmp_path, content):
    torch.save(content, tmp_path / "a.pt")
    with pytest.raises(InvalidInput, match=r"a\.pt: ") as caught:
        load_checkpoint(tmp_path / "a.pt")
    assert "\n" not in str(caught.value)
