"""Pictures, masks and arrays from outside: read the same way up everywhere, or refused by name."""

import os
import socket
import subprocess
import sys
from struct import pack

import cv2
import numpy as np
import pytest
from PIL import Image as PillowImage
from scenes import textured

from reviewer.dataset.files import (
    check_image,
    image_size,
    is_plain_png,
    list_images,
    read_array,
    read_flow,
    read_grey,
    read_rgb,
)
from reviewer.errors import InvalidInput

ORIENTATION = 0x0112
AS_SHOWN = {
    1: lambda a: a,
    2: np.fliplr,
    3: lambda a: np.rot90(a, 2),
    4: np.flipud,
    5: lambda a: a.swapaxes(0, 1),
    6: lambda a: np.rot90(a, -1),
    7: lambda a: np.rot90(a, 2).swapaxes(0, 1),
    8: np.rot90,
}


def save(path, array, orientation=1, **options):
    exif = PillowImage.Exif()
    exif[ORIENTATION] = orientation
    PillowImage.fromarray(array).save(path, exif=exif, **options)
    return path


@pytest.mark.parametrize("orientation", AS_SHOWN)
@pytest.mark.parametrize("suffix", [".png", ".tif", ".webp"])
def test_a_picture_is_turned_as_its_exif_says(tmp_path, orientation, suffix):
    stored = textured(1)
    options = {"lossless": True} if suffix == ".webp" else {}
    path = save(tmp_path / f"a{suffix}", stored, orientation, **options)
    shown = AS_SHOWN[orientation](stored)
    checked = check_image(path)
    assert (checked.height, checked.width) == image_size(path) == shown.shape[:2]
    assert checked.turned == (orientation > 1)
    assert (read_rgb(path) == shown).all()
    assert not is_plain_png(path) or (suffix == ".png" and orientation == 1)


def test_a_jpeg_and_a_mask_are_turned_too(tmp_path):
    path = save(tmp_path / "a.jpg", textured(1), 6)
    assert read_rgb(path).shape == (160, 120, 3)
    assert (check_image(path).height, check_image(path).width) == (160, 120)
    mask = np.zeros((120, 160), np.uint8)
    mask[:10] = 255
    assert read_grey(save(tmp_path / "m.png", mask, 6))[:, -10:].all()


@pytest.mark.parametrize(("suffix", "shape"), [
    (".png", (12, 16)), (".png", (12, 16, 3)), (".tif", (12, 16)), (".tif", (12, 16, 3))
])  # fmt: skip
def test_16_bits_a_channel_are_refused_with_the_way_out(tmp_path, suffix, shape):
    path = tmp_path / f"deep{suffix}"
    assert cv2.imwrite(str(path), np.full(shape, 300, np.uint16))
    for read in (check_image, read_rgb):
        with pytest.raises(InvalidInput, match=r"deep\.\w+: has more than 8 bits .*-level LOW,HIG"):
            read(path)


def test_an_alpha_channel_is_left_out_and_told(tmp_path):
    picture = np.dstack([textured(1), np.full((120, 160), 9, np.uint8)])
    PillowImage.fromarray(picture).save(tmp_path / "a.png")
    assert check_image(tmp_path / "a.png").transparent and not is_plain_png(tmp_path / "a.png")
    assert (read_rgb(tmp_path / "a.png") == textured(1)).all()
    PillowImage.fromarray(textured(1)).save(tmp_path / "b.png")
    assert not check_image(tmp_path / "b.png").transparent and is_plain_png(tmp_path / "b.png")


def test_a_grey_mask_with_an_alpha_channel_is_grey(tmp_path):
    grey = np.zeros((12, 16), np.uint8)
    grey[2:5] = 255
    PillowImage.fromarray(np.dstack([grey, np.full_like(grey, 255)])).save(tmp_path / "a.png")
    assert (read_grey(tmp_path / "a.png") == grey).all()


def test_pipes_sockets_and_devices_are_not_read(tmp_path):
    os.mkfifo(tmp_path / "a.png")
    with socket.socket(socket.AF_UNIX) as door:
        door.bind(str(tmp_path / "b.png"))
        (tmp_path / "c.png").symlink_to("/dev/zero")
        (tmp_path / "d.png").symlink_to(tmp_path / "d.png")
        for name, kind in (("a", "a pipe"), ("b", "a socket"), ("c", "a device"), ("d", "cannot")):
            for read in (check_image, read_rgb, read_grey, image_size, whole_array):
                with pytest.raises(InvalidInput, match=rf"{name}\.png: (is )?{kind}"):
                    read(tmp_path / f"{name}.png")


def test_a_loop_of_links_and_a_folder_of_a_picture_s_name_are_told(tmp_path):
    (tmp_path / "a.png").mkdir()
    save(tmp_path / "b.png", textured(1))
    found, skipped = list_images(tmp_path, tmp_path)
    assert list(found) == ["b"] and skipped == [(tmp_path / "a.png", "is a folder")]
    (tmp_path / "c.png").symlink_to(tmp_path / "c.png")
    with pytest.raises(InvalidInput, match=r"c\.png: is a loop of links"):
        list_images(tmp_path, tmp_path)


@pytest.mark.parametrize("name", [b"\xff\xfe.png", b"a\nb.png", b"a\x1b[31m.png"])
def test_a_name_that_is_no_text_is_refused(tmp_path, name):
    (tmp_path / os.fsdecode(name)).write_bytes(b"x")
    with pytest.raises(InvalidInput, match="a name of readable characters is needed"):
        list_images(tmp_path, tmp_path)


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".bmp", ".tif", ".webp"])
@pytest.mark.parametrize("junk", [b"", b"\0" * 64, bytes(range(256))])
def test_junk_with_a_picture_s_name_is_refused(tmp_path, suffix, junk):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(junk)
    for read in (check_image, read_rgb, read_grey):
        with pytest.raises(InvalidInput, match=r"a\.\w+: not a readable image"):
            read(path)


def whole_array(path):
    return read_array(path, lambda shape: None)


def npy(shape, kind="<f4"):
    head = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    head += b" " * ((64 - (len(head) + 11) % 64) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + pack("<H", len(head)) + head + bytes(64)


@pytest.mark.parametrize("content", [
    npy((2**20, 2**20)), npy((-1, 4)), npy("()" * 9), npy((2**63, 2)), npy("((("),
    npy(" " * 11000), b"", b"PK\x03\x04", b"\x80"
])  # fmt: skip
def test_an_array_that_claims_more_than_its_file_holds_is_refused(tmp_path, content):
    (tmp_path / "a.npy").write_bytes(content)
    with pytest.raises(InvalidInput, match=r"a\.npy: not a readable \.npy array, \S") as caught:
        whole_array(tmp_path / "a.npy")
    assert "\n" not in str(caught.value)


def test_an_archive_of_arrays_is_no_array(tmp_path):
    with (tmp_path / "a.npy").open("wb") as file:
        np.savez(file, a=np.zeros(3))
    with pytest.raises(InvalidInput, match=r"not a readable \.npy array, .*magic"):
        whole_array(tmp_path / "a.npy")


@pytest.mark.parametrize(("width", "height"), [(4, -1), (-1, 4), (2**31 - 1, 2**31 - 1), (0, 0)])
def test_a_flow_of_impossible_size_is_refused(tmp_path, width, height):
    (tmp_path / "a.flo").write_bytes(b"PIEH" + pack("<ii", width, height) + bytes(64))
    with pytest.raises(InvalidInput, match=r"a\.flo: not a readable \.flo file"):
        read_flow(tmp_path / "a.flo", lambda shape: None)


def test_a_damaged_tag_is_passed_over_in_silence(tmp_path):
    save(tmp_path / "a.jpg", textured(1), 6)
    data = bytearray((tmp_path / "a.jpg").read_bytes())
    at = data.index(b"Exif\0\0") + 14
    data[at] = 90  # so many tags are promised
    (tmp_path / "a.jpg").write_bytes(data)
    code = "from pathlib import Path; from reviewer.dataset.files import check_image as c"
    done = subprocess.run(
        [sys.executable, "-c", f"{code}; print(c(Path('a.jpg')).height)"],
        cwd=tmp_path, capture_output=True, text=True,
    )  # fmt: skip
    assert done.stderr == "" and done.stdout in ("120\n", "160\n")
