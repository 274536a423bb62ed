"""Objects that were found, and how well borders lie."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from reviewer.cli import app
from reviewer.evaluation.shapes import IOUS, SHARES, TOLERANCES_PX, score_shapes
from reviewer.metrics import Counts, border_px, boundary_f, boundary_ious

SHAPE = (60, 80)


def mask(*boxes):
    made = np.zeros(SHAPE, bool)
    for y0, x0, y1, x1 in boxes:
        made[y0:y1, x0:x1] = True
    return made


def test_objects_match_by_iou_one_to_one():
    truth = mask((5, 5, 15, 15), (30, 30, 40, 40), (50, 60, 55, 70))
    # The same; a third of it; none of the third; and one that is not there.
    found = mask((5, 5, 15, 15), (30, 30, 40, 34), (20, 60, 25, 70))
    score = score_shapes(found, truth)
    assert dict(zip(IOUS, score.objects, strict=True)) == {
        0.1: Counts(2, 1, 1),
        0.25: Counts(2, 1, 1),
        0.5: Counts(1, 2, 2),
    }


def test_one_object_cannot_find_two():
    truth = mask((10, 10, 20, 20), (10, 24, 20, 34))
    score = score_shapes(mask((10, 10, 20, 34)), truth)
    assert score.objects[0] == Counts(1, 0, 1)


def test_borders_are_those_of_the_whole_masks():
    truth, found = mask((10, 10, 30, 30)), mask((11, 12, 31, 30), (50, 2, 55, 9))
    wanted = tuple(boundary_f(found, truth, tolerance) for tolerance in TOLERANCES_PX)
    assert score_shapes(found, truth).borders == pytest.approx(wanted)
    assert score_shapes(truth, truth).borders == (1.0, 1.0, 1.0)


def test_borders_at_the_images_edge_count_too():
    truth, found = mask((0, 0, 20, 20)), mask((0, 0, 20, 21))
    wanted = tuple(boundary_f(found, truth, tolerance) for tolerance in TOLERANCES_PX)
    assert score_shapes(found, truth).borders == pytest.approx(wanted)


def test_bands_are_as_wide_as_the_whole_image_says():
    truth, found = mask((0, 5, 20, 25)), mask((0, 6, 20, 26), (50, 2, 55, 9))
    wanted = boundary_ious(found, truth, [border_px(*SHAPE, share) for share in SHARES])
    assert score_shapes(found, truth).bands == pytest.approx(wanted)
    assert score_shapes(truth, truth).bands == (1.0, 1.0)
    assert score_shapes(mask(), mask()).bands is None


def test_nothing_found_where_nothing_is_has_no_border():
    score = score_shapes(mask(), mask())
    assert score.borders is None and score.objects == (Counts(),) * 3
    assert score_shapes(mask(), mask((1, 1, 5, 5))).borders == (0.0, 0.0, 0.0)


def test_ignored_pixels_belong_to_neither():
    truth, ignore = mask((10, 10, 20, 20), (40, 40, 50, 50)), mask((35, 35, 55, 55))
    score = score_shapes(mask((10, 10, 20, 20)), truth, ignore)
    assert score.objects[2] == Counts(1, 0, 0) and score.borders == (1.0, 1.0, 1.0)


def test_the_command_prints_a_row_a_run_and_method(db, run, tiny_split):
    given = ["evaluate", "--shapes", "--format", "json", "--db", str(db.path)]
    rows = json.loads(CliRunner().invoke(app, given).stdout)
    assert [row["method"] for row in rows] == ["without DoI", "with DoI"]
    assert 0 < rows[1]["border IoU 0.5 %"] <= rows[1]["border IoU 2 %"] <= 1
    assert rows[1]["R@0.5"] == 1.0 and 0 < rows[1]["border 1 px"] <= rows[1]["border 3 px"] <= 1
