"""Layers as pictures: what people see has the pixels that the pipeline works on."""

from dataclasses import replace

import cv2
import numpy as np
from PIL import Image as PillowImage

from reviewer.app.endpoints.pictures import draw_layer
from reviewer.dataset.files import hash_file, read_rgb


def imported_anew(pair):
    """The pair as if its live image had been imported as it is now."""
    return replace(pair, live=replace(pair.live, sha256=hash_file(pair.live.path)))


def test_a_png_that_browsers_show_otherwise_is_sent_as_it_is_read(db, tiny_split):
    pair = tiny_split[0]
    path = pair.live.path
    stored = read_rgb(path)
    assert draw_layer(db, pair, None, "live") == path.read_bytes()
    exif = PillowImage.Exif()
    exif[0x0112] = 3
    clear = np.dstack([stored, np.zeros(stored.shape[:2], np.uint8)])
    for array, options in ((stored, {"exif": exif}), (clear, {})):
        PillowImage.fromarray(array).save(path, **options)
        pair = imported_anew(pair)
        sent = cv2.imdecode(
            np.frombuffer(draw_layer(db, pair, None, "live"), np.uint8), cv2.IMREAD_UNCHANGED
        )
        assert (sent[..., ::-1] == read_rgb(path)).all()
