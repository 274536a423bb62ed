"""What is read of a pair is what was imported."""

import os

import cv2
import numpy as np
import pytest
from PIL import Image as PillowImage

from reviewer.dataset.files import hash_file, read_rgb
from reviewer.dataset.pictures import read_bytes, read_picture, upright_bytes
from reviewer.errors import InvalidInput, NotFound
from reviewer.records import Image


def image_of(path, height, width):
    return Image(1, path.stem, path, hash_file(path), height, width, None)


def swap(pair, other):
    """Put another image of the same size in place of a pair's, with the old one's times."""
    path, times = pair.live.path, pair.live.path.stat()
    path.write_bytes(other.live.path.read_bytes())
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))


def test_an_image_is_read_as_it_was_imported(tiny_split):
    image = tiny_split[0].live
    assert read_bytes(image) == image.path.read_bytes()
    assert (read_picture(image) == read_rgb(image.path)).all()
    assert read_picture(image).dtype == np.uint8


@pytest.mark.parametrize("read", [read_bytes, read_picture])
def test_a_replaced_image_is_refused_with_the_way_out(tiny_split, read):
    swap(tiny_split[0], tiny_split[1])
    with pytest.raises(InvalidInput, match=r"0000\.png: is not the image .*put .*back.*--split"):
        read(tiny_split[0].live)


@pytest.mark.parametrize("read", [read_bytes, read_picture])
def test_an_image_that_is_gone_is_told(tiny_split, read):
    path = tiny_split[0].live.path
    path.unlink()
    with pytest.raises(NotFound, match=r"0000\.png: is gone"):
        read(tiny_split[0].live)
    path.mkdir()
    with pytest.raises(NotFound, match=r"0000\.png: is no file any more"):
        read(tiny_split[0].live)


@pytest.mark.parametrize("suffix", ["png", "jpg"])
def test_a_picture_that_leaves_is_the_same_way_round_for_every_reader(tmp_path, suffix):
    stored = np.zeros((40, 60, 3), np.uint8)
    stored[:10, :20] = 250
    path, exif = tmp_path / f"a.{suffix}", PillowImage.Exif()
    exif[0x0112] = 6  # on its side
    PillowImage.fromarray(stored).save(path, exif=exif)
    data = upright_bytes(image_of(path, 60, 40))
    without_exif = cv2.imdecode(
        np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    )
    wanted = read_rgb(path)
    assert without_exif.shape == wanted.shape == (60, 40, 3)
    assert np.abs(without_exif[..., ::-1].astype(int) - wanted).max() <= 4
    plain = tmp_path / f"plain.{suffix}"
    PillowImage.fromarray(stored).save(plain)
    assert upright_bytes(image_of(plain, 40, 60)) == plain.read_bytes()


def test_a_large_picture_is_decoded_once_as_long_as_its_file_is_the_same(
    db, tiny_split, monkeypatch
):
    monkeypatch.setattr("reviewer.dataset.pictures.LARGE_PX", 1)
    image = tiny_split[0].live
    first = read_picture(image)
    assert read_picture(image) is first and not first.flags.writeable
    image.path.write_bytes(tiny_split[1].live.path.read_bytes())
    with pytest.raises(InvalidInput, match="is not the image that was imported"):
        read_picture(image)
