"""Files of the small nets: half precision, the same bytes for the same net, refusals by name."""

import subprocess
import sys

import pytest
import torch
from safetensors.torch import load_file, save_file

from reviewer.errors import InvalidInput, NotFound
from reviewer.models.nets.click_net import ClickNet
from reviewer.models.nets.siamese_lite import SiameseLite
from reviewer.models.nets.small import load_small, save_small, small_weights

ABOUT = {"steps": "3", "seed": "0", "data_sha256": "a1", "training": "{}", "start": "none"}
TINY = (4, 8, 8, 8, 8)


def test_what_is_saved_is_loaded_again_in_half_precision_with_what_made_it(tmp_path):
    torch.manual_seed(0)
    net, again = ClickNet(TINY), ClickNet(TINY)
    save_small(tmp_path / "a.safetensors", net, "click-net", ABOUT)
    assert load_small(tmp_path / "a.safetensors", again, "click-net") == {
        "net": "click-net", **ABOUT
    }  # fmt: skip
    assert not again.training
    for key, value in net.state_dict().items():
        wanted = value.half().float() if value.is_floating_point() else value
        assert torch.equal(again.state_dict()[key], wanted), key
    stored = load_file(tmp_path / "a.safetensors")
    assert stored["mask.weight"].dtype == torch.float16


def test_the_same_net_gives_the_same_bytes_in_every_process(tmp_path):
    code = (
        "import sys, torch; from pathlib import Path;"
        "from reviewer.models.nets.click_net import ClickNet;"
        "from reviewer.models.nets.small import save_small; torch.manual_seed(0);"
        f"net = ClickNet({TINY}); about = {ABOUT};"
        "[save_small(Path(place), net, 'click-net', about) for place in sys.argv[1:]]"
    )
    # Six keys in an order of chance: four files do not agree by luck.
    files = [str(tmp_path / f"{k}.safetensors") for k in range(4)]
    for half in (files[:2], files[2:]):
        subprocess.run([sys.executable, "-c", code, *half], check=True)
    assert len({(tmp_path / f"{k}.safetensors").read_bytes() for k in range(4)}) == 1


def test_a_save_that_breaks_off_leaves_the_weights_before(tmp_path, monkeypatch):
    path = tmp_path / "a.safetensors"
    save_small(path, ClickNet(TINY), "click-net", ABOUT)
    before = path.read_bytes()

    def full(*_):
        raise OSError("no space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="no space"):
        save_small(path, ClickNet(TINY), "click-net", ABOUT)
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(NotFound, match=r"no\.safetensors: weights of click-net do not exist"):
        load_small(tmp_path / "no.safetensors", ClickNet(TINY), "click-net")


def test_a_file_that_is_no_safetensors_file_is_refused(tmp_path):
    path = tmp_path / "a.safetensors"
    path.write_bytes(b"x" * 64)
    with pytest.raises(InvalidInput, match=r"a\.safetensors: is no safetensors file"):
        load_small(path, ClickNet(TINY), "click-net")


def test_weights_of_another_net_are_refused(tmp_path):
    path = tmp_path / "a.safetensors"
    save_small(path, SiameseLite(), "siamese-lite", {})
    with pytest.raises(InvalidInput, match="weights of 'siamese-lite', but click-net is wanted"):
        load_small(path, ClickNet(TINY), "click-net")
    save_file({"a": torch.zeros(1)}, path)
    with pytest.raises(InvalidInput, match="weights of None, but click-net is wanted"):
        load_small(path, ClickNet(TINY), "click-net")


def test_weights_of_another_size_are_refused(tmp_path):
    path = tmp_path / "a.safetensors"
    save_small(path, ClickNet(TINY), "click-net", {})
    with pytest.raises(InvalidInput, match=r"does not fit click-net, .*size mismatch"):
        load_small(path, ClickNet(), "click-net")


@pytest.mark.parametrize(("name", "net"), [("click-net", ClickNet), ("siamese-lite", SiameseLite)])
def test_the_weights_in_the_package_load(name, net):
    assert load_small(small_weights(name), net(), name)["net"] == name
    assert small_weights(name, "own.safetensors").name == "own.safetensors"
