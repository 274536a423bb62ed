"""Fetching from a hub on this machine: progress, hashes, resuming, licences, refusals."""

import hashlib
import re
from dataclasses import replace

import pytest
from checkpoints import write_sam
from hub import serve_hub

from reviewer.errors import InvalidInput, NotFound
from reviewer.models.clicks.sam import SamClicks
from reviewer.models.weights import fetching
from reviewer.models.weights.fetching import fetch, find_fetched, weights_folder
from reviewer.models.weights.presets import PRESETS, preset_of_name

TINY = preset_of_name("lab/tiny")


@pytest.fixture(autouse=True)
def own_caches(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_CACHE", str(tmp_path / "hub"))


@pytest.fixture
def folder(tmp_path):
    folder = write_sam(tmp_path / "tiny")
    (folder / "pytorch_model.bin").write_bytes(b"the same weights in another format")
    return folder


def test_a_fetched_model_is_checked_found_and_loaded_by_its_hub_id(folder):
    assert find_fetched(TINY) is None
    steps, wanted = [], ("config.json", "model.safetensors")
    with serve_hub(folder) as (hub, asked):
        found = fetch(TINY, lambda *step: steps.append(step), hub)
    assert found.licence == "mit"
    assert found.size == sum(
        (folder / n).stat().st_size for n in ("config.json", "model.safetensors")
    )
    assert steps[0][0] == 0 and steps[-1][:2] == (found.size, found.size)
    assert [done for done, _, _ in steps] == sorted(done for done, _, _ in steps)
    assert {file for _, _, file in steps} == {*wanted, ""} and len(steps) > 4
    assert not any("pytorch_model.bin" in path for _, path, _ in asked)
    assert find_fetched(TINY) == found.path
    # From here on nothing is asked of any hub.
    assert SamClicks.load("sam", "lab/tiny").model_id.startswith("sam-tiny-")


def test_what_is_there_is_not_fetched_again(folder):
    with serve_hub(folder) as (hub, asked):
        fetch(TINY, endpoint=hub)
        before = [path for command, path, _ in asked if command == "GET" and "resolve" in path]
        fetch(TINY, endpoint=hub)
        after = [path for command, path, _ in asked if command == "GET" and "resolve" in path]
    assert len(before) == 2 and after == before


def test_a_file_with_another_hash_than_stated_is_removed(folder):
    with (
        serve_hub(folder, lie=True) as (hub, _),
        pytest.raises(InvalidInput, match="it was removed"),
    ):
        fetch(TINY, endpoint=hub)
    assert find_fetched(TINY) is None


def test_a_gated_model_says_where_to_ask(folder):
    with (
        serve_hub(folder, gated=True) as (hub, _),
        pytest.raises(InvalidInput, match="is gated; ask"),
    ):
        fetch(TINY, endpoint=hub)


def test_a_model_the_hub_does_not_have_and_a_hub_that_is_not_there(folder):
    with serve_hub(folder) as (hub, _), pytest.raises(NotFound, match="the hub has no lab/other"):
        fetch(preset_of_name("lab/other"), endpoint=hub)
    with pytest.raises(NotFound, match="cannot be fetched"):
        fetch(TINY, endpoint="http://127.0.0.1:9")


@pytest.fixture
def single(tmp_path, monkeypatch):
    """A preset of one file, and the folder it is served from."""
    served = tmp_path / "served"
    served.mkdir()
    (served / "w.pth").write_bytes(bytes(range(256)) * 12000)
    (served / "page.html").write_text("<html>sign in</html>")
    monkeypatch.setitem(fetching.FILE_NAMES, "one", "w.pth")
    monkeypatch.setattr(fetching.Preset, "is_file", property(lambda self: self.name == "one"))
    return served


def one(hub, name="w.pth"):
    return replace(TINY, name="one", source=f"{hub}/files/{name}", licence="research only")


def test_a_single_file_goes_on_where_it_was_cut(single):
    with serve_hub(single, cut_after=2_000_000) as (hub, asked):
        with pytest.raises(NotFound, match="the same command goes on later"):
            fetch(one(hub))
        part = weights_folder() / "w.pth.part"
        cut = part.stat().st_size
        assert 0 < cut < 3_072_000 and find_fetched(one(hub)) is None
        found = fetch(one(hub))
    assert found.path.read_bytes() == (single / "w.pth").read_bytes() and not part.exists()
    assert asked[-1][2] == f"bytes={cut}-"
    assert (weights_folder() / "w.pth.sha256").read_text().endswith("  w.pth\n")


def test_a_single_file_that_changed_here_is_noticed(single):
    with serve_hub(single) as (hub, _):
        found = fetch(one(hub))
        found.path.write_bytes(b"something else")
        with pytest.raises(InvalidInput, match="was noted when it was fetched"):
            fetch(one(hub))


def test_a_single_file_is_held_against_the_hash_its_makers_state(single):
    good = hashlib.sha256((single / "w.pth").read_bytes()).hexdigest()
    with serve_hub(single) as (hub, _):
        with pytest.raises(
            InvalidInput, match=r"w\.pth has the hash \w{12}, but its makers say 0000"
        ):
            fetch(replace(one(hub), sha256="0" * 64))
        assert list(weights_folder().iterdir()) == []
        assert fetch(replace(one(hub), sha256=good)).path.name == "w.pth"


def test_files_are_kept_under_the_last_part_of_their_address():
    files = [preset for preset in PRESETS if preset.is_file]
    names = {fetching._place(preset).name for preset in files}
    assert len(names) == len(files) > 10
    assert {name.rpartition(".")[2] for name in names} == {"pth"}
    assert all(re.fullmatch(r"|[0-9a-f]{64}", preset.sha256) for preset in PRESETS)


def test_names_are_unique_and_unknown_ones_are_told_what_there_is():
    assert len({preset.name for preset in PRESETS}) == len(PRESETS)
    assert all(preset.licence and preset.use for preset in PRESETS)
    with pytest.raises(InvalidInput, match="there are sam2-tiny"):
        preset_of_name("sam9")
