"""Embeddings are made once: proved by counting the encoder's calls."""

import numpy as np
import pytest
from checkpoints import write_sam2
from fakes import FakeClicks
from scenes import textured

from reviewer.models.clicks.embeddings import EmbeddingCache
from reviewer.models.clicks.grabcut import GrabCutClicks
from reviewer.models.clicks.sam import SamClicks
from reviewer.models.interfaces import Click, ClickPictures, Prompt


def load(seed):
    return lambda: ClickPictures(textured(seed))


def test_an_image_is_embedded_once(tmp_path):
    segmenter = FakeClicks()
    cache = EmbeddingCache(segmenter, tmp_path)
    first = cache.get("a", load(1))
    assert cache.get("a", load(1)) is first and "a" in cache
    cache.get("b", load(2))
    assert len(segmenter.embedded) == 2


def test_an_embedding_outlives_the_process_under_its_model(tmp_path):
    segmenter = FakeClicks()
    EmbeddingCache(segmenter, tmp_path).get("a", load(1))
    again = EmbeddingCache(segmenter, tmp_path).get("other name, same pixels", load(1))
    assert len(segmenter.embedded) == 1
    assert (again["size"] == [120, 160]).all()
    other = FakeClicks()
    other.model_id = "other"
    EmbeddingCache(other, tmp_path).get("a", load(1))
    assert len(other.embedded) == 1


def test_masks_are_the_same_from_a_new_and_from_a_kept_embedding(tmp_path):
    segmenter = SamClicks.load("sam2", str(write_sam2(tmp_path / "sam2")))
    prompt = Prompt((Click(75, 52),))
    fresh, kept = (
        segmenter.predict(EmbeddingCache(segmenter, tmp_path).get("a", load(1)), prompt)
        for _ in range(2)
    )
    assert all(
        (a.mask == b.mask).all() and a.score == b.score for a, b in zip(fresh, kept, strict=True)
    )


def test_memory_and_disk_stay_under_their_sizes(tmp_path):
    segmenter = FakeClicks()
    one = 120 * 160 * 3 * 4 + 8
    cache = EmbeddingCache(segmenter, tmp_path, memory_bytes=2 * one, disk_bytes=300_000)
    for seed in range(4):
        cache.get(seed, load(seed))
    assert [seed in cache for seed in range(4)] == [False, False, True, True]
    kept = list((tmp_path / "fake").glob("*.npz"))
    assert len(kept) == 2 and sum(path.stat().st_size for path in kept) <= 300_000


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 torn"])
def test_a_damaged_file_is_made_again(tmp_path, damage):
    segmenter = FakeClicks()
    EmbeddingCache(segmenter, tmp_path).get("a", load(1))
    (path,) = (tmp_path / "fake").glob("*.npz")
    path.write_bytes(damage)
    again = EmbeddingCache(segmenter, tmp_path).get("a", load(1))
    assert len(segmenter.embedded) == 2
    assert np.allclose(again["map"], textured(1) / 255, atol=1e-3)


def test_what_is_quick_to_embed_is_not_written(tmp_path):
    EmbeddingCache(GrabCutClicks(), tmp_path).get("a", load(1))
    assert not list(tmp_path.iterdir())
