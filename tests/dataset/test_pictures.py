"""What is read of a pair is what was imported."""

import os

import numpy as np
import pytest

from reviewer.dataset.files import read_rgb
from reviewer.dataset.pictures import read_bytes, read_picture
from reviewer.errors import InvalidInput, NotFound


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
    with pytest.raises(NotFound, match=r"0000\.png: is gone"):
        read(tiny_split[0].live)
