"""The workbench's tools: their pixels against independent oracles, and in a person's hands."""

import cv2
import numpy as np
import pytest
from playwright.sync_api import expect
from scipy import ndimage
from workbench import on_live, wait_saved, wait_title

from reviewer.masks import decode_rle
from reviewer.store.revisions import list_revisions, newest_revision

pytestmark = pytest.mark.browser


@pytest.fixture
def frame(server, visit):
    return visit("Ada")[1]


def noise(seed, share=0.45, shape=(37, 53)):
    return np.random.default_rng(seed).random(shape) < share


def in_page(frame, script, mask, *arguments):
    """Run a function of a module on a mask in the browser; return the new mask."""
    height, width = mask.shape
    flat = frame.evaluate(
        """async ([file, name, height, width, pixels, args]) => {
            const module = await import(`/static/js/${file}`);
            const mask = { width, height, data: Uint8Array.from(pixels) };
            const result = module[name](mask, ...args);
            return Array.from(result instanceof Uint8Array ? result : mask.data);
        }""",
        [*script, height, width, mask.astype(int).ravel().tolist(), list(arguments)],
    )
    return np.array(flat, bool).reshape(mask.shape)


def inside(points, shape):
    """Even-odd rule at the pixel centres, by crossing numbers."""
    y, x = np.mgrid[0 : shape[0], 0 : shape[1]] + 0.5
    result = np.zeros(shape, bool)
    for (ax, ay), (bx, by) in zip(points, points[1:] + points[:1], strict=True):
        crosses = (ay <= y) != (by <= y)
        with np.errstate(divide="ignore", invalid="ignore"):
            result ^= crosses & (x < ax + (y - ay) / (by - ay) * (bx - ax))
    return result


def test_a_polygon_fills_the_pixels_whose_centres_it_holds(frame):
    rng = np.random.default_rng(4)
    for count in (3, 5, 9):
        points = [(float(x), float(y)) for x, y in rng.uniform(-5, 55, (count, 2))]
        corners = [{"x": x, "y": y} for x, y in points]
        empty = np.zeros((37, 53), bool)
        filled = in_page(frame, ("fill.js", "fillPolygon"), empty, corners, 1)
        assert (filled == inside(points, empty.shape)).all()
        assert not in_page(frame, ("fill.js", "fillPolygon"), filled, corners, 0).any()


def test_cleaning_up_agrees_with_opencv_and_scipy(frame):
    eight = np.ones((3, 3))
    square = np.ones((3, 3), np.uint8)
    for seed in range(3):
        mask = noise(seed)
        pixels = mask.astype(np.uint8)
        holes = in_page(frame, ("cleanup.js", "fillHoles"), mask)
        assert (holes == ndimage.binary_fill_holes(mask)).all()
        assert (in_page(frame, ("cleanup.js", "grow"), mask) == cv2.dilate(pixels, square)).all()
        assert (in_page(frame, ("cleanup.js", "shrink"), mask) == cv2.erode(pixels, square)).all()
        labels, count = ndimage.label(mask, eight)
        sizes = ndimage.sum_labels(mask, labels, range(count + 1))
        specks = in_page(frame, ("cleanup.js", "dropSpecks"), mask, 9)
        assert (specks == (mask & (sizes[labels] >= 9))).all()
        row, column = np.argwhere(mask)[len(np.argwhere(mask)) // 2]
        point = {"x": float(column) + 0.5, "y": float(row) + 0.5}
        kept = in_page(frame, ("cleanup.js", "keepComponent"), mask, point)
        assert (kept == (labels == labels[row, column])).all()
        sums = cv2.filter2D(pixels, -1, eight, borderType=cv2.BORDER_CONSTANT)
        smooth = in_page(frame, ("cleanup.js", "smooth"), mask)
        assert (smooth == ((sums >= 5) | (mask & (sums == 4)))).all()


def test_flood_fill_stops_at_the_tolerance(frame):
    picture = np.zeros((30, 40, 4), np.uint8)
    picture[5:20, 8:30] = (100, 100, 100, 255)
    picture[10:12, 8:30] = (115, 100, 100, 255)
    mask = np.zeros(picture.shape[:2], bool)
    for tolerance, expected in ((20, np.s_[5:20, 8:30]), (10, np.s_[5:10, 8:30])):
        pixels = picture.ravel().tolist()
        arguments = (pixels, {"x": 9.5, "y": 6.5}, tolerance, 1)
        filled = in_page(frame, ("fill.js", "floodFill"), mask, *arguments)
        truth = mask.copy()
        truth[expected] = True
        assert (filled == truth).all()


def test_the_tools_in_a_persons_hands(server, visit):
    page, frame = visit("Ada")
    wait_title(frame, "cs1/0000")

    def mask():
        return decode_rle(newest_revision(server.store, 1).mask)

    page.keyboard.press("x")
    on_live(frame, page, [(100, 80), (130, 110)])
    wait_saved(frame, 2)
    assert mask()[81:109, 101:129].all() and not mask()[78, 115]
    page.keyboard.press("l")
    page.keyboard.down("Alt")
    on_live(frame, page, [(110, 90), (120, 90), (120, 100), (110, 100)])
    page.keyboard.up("Alt")
    wait_saved(frame, 3)
    assert not mask()[92:98, 112:118].any()
    page.keyboard.press("Shift+H")
    wait_saved(frame, 4)
    assert mask()[81:109, 101:129].all()
    page.keyboard.press("q")
    for corner in ((10, 90), (40, 90), (40, 110)):
        on_live(frame, page, [corner])
    page.keyboard.press("Enter")
    wait_saved(frame, 5)
    assert mask()[95, 35] and not mask()[108, 12]
    page.keyboard.press("b")
    on_live(frame, page, [(10, 20)])
    wait_saved(frame, 6)
    page.keyboard.down("Shift")
    on_live(frame, page, [(60, 20)])
    page.keyboard.up("Shift")
    wait_saved(frame, 7)
    assert mask()[20, 10:60].all()
    for _ in range(6):
        page.keyboard.press("Control+z")
        page.wait_for_timeout(100)
    expect(frame.locator("#save")).to_have_text("saved")
    first, last = list_revisions(server.store, 1)[0], newest_revision(server.store, 1)
    assert last.mask == first.mask
