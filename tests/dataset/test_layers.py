"""A lab's own detector maps and object masks come in beside ours."""

import json
import tracemalloc

import cv2
import numpy as np
import pytest

from reviewer.dataset.layers import import_layer
from reviewer.errors import Conflict, InvalidInput, NotFound
from reviewer.masks import decode_rle, encode_png
from reviewer.pipeline.fields import load_flow, load_probability, packing
from reviewer.pipeline.runner import prepare_run, run_pipeline
from reviewer.pipeline.settings import PipelineSettings
from reviewer.store.layers import load_alignment, load_detection, load_objects
from reviewer.store.pairs import pair_ids
from reviewer.store.regions import load_regions
from reviewer.store.results import finished_pairs


@pytest.fixture
def own_run(db):
    return prepare_run(db, "ours", PipelineSettings(detector="imported", segmenter="imported"))


def maps(pairs):
    values = np.zeros((pairs[0].live.height, pairs[0].live.width), np.float32)
    values[40:60, 50:75] = 0.8
    return values


def test_probabilities_come_in_and_the_pipeline_goes_on(db, tiny_split, own_run, tmp_path):
    folder = tmp_path / "maps" / "cs1"
    folder.mkdir(parents=True)
    np.save(folder / "0000.npy", maps(tiny_split))
    (folder / "0001.png").write_bytes(encode_png(maps(tiny_split) > 0.5))
    objects = np.zeros((1, *maps(tiny_split).shape), np.uint8)
    objects[0, 40:60, 48:75] = 1
    np.save(tmp_path / "0000.npy", objects)
    (tmp_path / "0000.json").write_text(json.dumps([{"label": "pen", "score": 0.7}]))
    report = import_layer(db, own_run, "detection", tmp_path / "maps", tiny_split, packing(own_run))
    assert (report.imported, report.without_file) == (2, ("cs1/0002",))
    assert (
        import_layer(
            db, own_run, "live-objects", tmp_path, tiny_split[:1], packing(own_run)
        ).imported
        == 1
    )
    done = run_pipeline(db, own_run, pair_ids(db))
    assert done.done == 2
    assert "no imported detection" in done.failures[0]
    stored = load_detection(db, own_run.id, tiny_split[0].id)
    assert load_probability(stored)[45, 60] == pytest.approx(0.8, abs=0.002)
    (thing,) = load_objects(db, own_run.id, tiny_split[0].id)
    assert (thing.label, thing.score) == ("pen", 0.7)
    (region,) = load_regions(db, own_run.id, tiny_split[0].id)
    assert (region.labels, region.region.choice) == ("pen", "adopt")
    assert decode_rle(thing.mask).sum() == 20 * 27


@pytest.mark.parametrize(
    ("array", "message"),
    [(np.full((120, 160), np.nan, np.float32), r"probabilities lie in \[0, 1\]"),
     (np.full((120, 160), 1.5, np.float32), "these go from 1.5"),
     (np.zeros((3, 4), np.float32), "is 4x3 but the live image of pair cs1/0001"),
     (np.zeros((2, 120, 160), np.float32), r"is \(height, width\)")],
)  # fmt: skip
def test_a_bad_map_is_refused_and_the_run_stays_as_it_was(
    db, tiny_split, own_run, tmp_path, array, message
):
    np.save(tmp_path / "0000.npy", maps(tiny_split))
    np.save(tmp_path / "0001.npy", array)
    with pytest.raises(InvalidInput, match=message):
        import_layer(db, own_run, "detection", tmp_path, tiny_split, packing(own_run))
    assert finished_pairs(db, own_run.id, "detect") == set()


def test_pickled_arrays_are_refused(db, tiny_split, own_run, tmp_path):
    np.save(tmp_path / "0000.npy", np.array([{"a": 1}], object), allow_pickle=True)
    with pytest.raises(InvalidInput, match=r"not a readable \.npy array"):
        import_layer(db, own_run, "detection", tmp_path, tiny_split, packing(own_run))


def test_names_must_match_the_masks(db, tiny_split, own_run, tmp_path):
    labels = np.zeros((120, 160), np.uint8)
    labels[:5], labels[10:20] = 1, 7
    np.save(tmp_path / "0000.npy", np.stack([labels == 1, labels == 7]))
    (tmp_path / "0000.json").write_text('[{"label": "pen"}]')
    with pytest.raises(InvalidInput, match="names 1 objects, but the masks hold 2"):
        import_layer(db, own_run, "live-objects", tmp_path, tiny_split, packing(own_run))


def test_a_run_with_a_model_of_its_own_takes_no_layer(db, tiny_split, tmp_path):
    run = prepare_run(db, None, PipelineSettings(segmenter="oversegment", detector="difference"))
    with pytest.raises(Conflict, match="is made by difference, not imported"):
        import_layer(db, run, "detection", tmp_path, tiny_split, packing(run))


def test_a_folder_without_any_file_says_what_is_expected(db, tiny_split, own_run, tmp_path):
    with pytest.raises(NotFound, match=r"expected names such as .*cs1.0000\.png"):
        import_layer(db, own_run, "detection", tmp_path / "maps", tiny_split, packing(own_run))


def write_flo(path, flow):
    height, width = flow.shape[:2]
    size = np.array([width, height], "<i4").tobytes()
    path.write_bytes(b"PIEH" + size + flow.astype("<f4").tobytes())


@pytest.fixture
def aligned_elsewhere(db):
    return prepare_run(
        db,
        "flows",
        PipelineSettings(segmenter="oversegment", detector="difference", aligner="imported"),
    )


def test_flows_and_confidences_come_in_and_are_judged(db, tiny_split, aligned_elsewhere, tmp_path):
    flow = np.zeros((120, 160, 2), np.float32)
    flow[..., 0] = 2
    write_flo(tmp_path / "0000.flo", flow)
    flow[3, 4] = np.nan
    np.save(tmp_path / "0001.npy", flow)
    confidence = np.ones((120, 160), np.float32)
    confidence[:, :40] = 0.2
    np.save(tmp_path / "0001.confidence.npy", confidence)
    run, pack = aligned_elsewhere, packing(aligned_elsewhere)
    report = import_layer(db, run, "alignment", tmp_path, tiny_split, pack)
    assert (report.imported, report.without_file) == (2, ("cs1/0002",))
    whole, partly = (load_alignment(db, run.id, pair.id) for pair in tiny_split[:2])
    np.testing.assert_allclose(load_flow(whole)[..., 0], 2)
    valid = decode_rle(partly.valid)
    assert not valid[:, :40].any() and not valid[3, 4] and valid[10:, 40:-3].all()
    assert "leaves a larger difference" in whole.doubt
    done = run_pipeline(db, run, pair_ids(db))
    assert done.done == 2 and "no imported alignment" in done.failures[0]


@pytest.mark.parametrize(
    ("content", "message"),
    [(np.zeros((120, 160), np.float32), r"a flow is \(height, width, 2\)"),
     (np.zeros((60, 80, 2), np.float32), "is 80x60 but the live image")],
)  # fmt: skip
def test_what_is_no_flow_of_the_pair_is_refused(
    db, tiny_split, aligned_elsewhere, tmp_path, content, message
):
    np.save(tmp_path / "0000.npy", content)
    with pytest.raises(InvalidInput, match=message):
        pack = packing(aligned_elsewhere)
        import_layer(db, aligned_elsewhere, "alignment", tmp_path, tiny_split, pack)


def test_a_truncated_flo_is_refused(db, tiny_split, aligned_elsewhere, tmp_path):
    pack = packing(aligned_elsewhere)
    for content in (b"PIEH" + b"\0" * 6, b"RIFF" + b"\0" * 60):
        (tmp_path / "0000.flo").write_bytes(content)
        with pytest.raises(InvalidInput, match=r"not a readable \.flo file"):
            import_layer(db, aligned_elsewhere, "alignment", tmp_path, tiny_split, pack)


def objects_of(db, pair, run, tmp_path, names):
    labels = np.zeros((1, 120, 160), np.uint8)
    labels[0, :5] = 1
    np.save(tmp_path / "0000.npy", labels)
    (tmp_path / "0000.json").write_bytes(names if isinstance(names, bytes) else names.encode())
    import_layer(db, run, "live-objects", tmp_path, [pair], packing(run))
    return load_objects(db, run.id, pair.id)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ("", "0000.json: not a list of .*, it is no JSON"),
        ("[" * 100_000, "0000.json: not a list of .*, it is nested too deeply"),
        (b"\xff\xfe", "0000.json: is no UTF-8 text"),
        ("5", "0000.json: not a list of "),
        ("[5]", "0000.json: not a list of "),
        ('[{"score": 1e999}]', "a score lies in .0, 1., but one is inf"),
        ('[{"score": NaN}]', "a score lies in .0, 1., but one is nan"),
        (r'[{"label": "\ud800"}]', "has characters that nobody can read"),
        (r'[{"label": "a\u0000b"}]', "has characters that nobody can read"),
    ],
)
def test_broken_names_of_objects_are_one_sentence(
    db, tiny_split, own_run, tmp_path, names, message
):
    with pytest.raises(InvalidInput, match=message):
        objects_of(db, tiny_split[0], own_run, tmp_path, names)


def test_names_of_objects_are_put_into_one_form(db, tiny_split, own_run, tmp_path):
    (thing,) = objects_of(db, tiny_split[0], own_run, tmp_path, r'[{"label": "\uff50en\n box "}]')
    assert thing.label == "pen box"


def sparse_array(path, shape):
    """A file that holds what its header says, all zeros and none of it on the disk."""
    with path.open("wb") as file:
        header = {"descr": "|u1", "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(file, header)
        file.truncate(file.tell() + int(np.prod(shape)))


@pytest.mark.parametrize(
    ("kind", "shape", "message"),
    [
        ("detection", (60_000, 60_000), "is 60000x60000 but the live image"),
        ("live-objects", (9, 20_000, 20_000), "is 20000x20000 but the live image"),
        ("alignment", (30_000, 30_000, 2), "is 30000x30000 but the live image"),
        ("detection", (0, 0), r"a probability map is \(height, width\), not \(0, 0\)"),
    ],
)
def test_the_size_of_an_array_is_checked_before_it_is_read(
    db, tiny_split, tmp_path, kind, shape, message
):
    settings = PipelineSettings("imported", "imported", segmenter="imported")
    run = prepare_run(db, "sparse", settings)
    sparse_array(tmp_path / "0000.npy", shape)
    tracemalloc.start()
    with pytest.raises(InvalidInput, match=message):
        import_layer(db, run, kind, tmp_path, tiny_split[:1], packing(run))
    assert tracemalloc.get_traced_memory()[1] < 20_000_000
    tracemalloc.stop()


@pytest.mark.parametrize("kind", ["detection", "live-objects"])
def test_the_size_of_an_image_is_checked_by_its_header(db, tiny_split, own_run, tmp_path, kind):
    assert cv2.imwrite(str(tmp_path / "0000.png"), np.zeros((7000, 9000), np.uint8))
    tracemalloc.start()
    with pytest.raises(InvalidInput, match="is 9000x7000 but the live image"):
        import_layer(db, own_run, kind, tmp_path, tiny_split[:1], packing(own_run))
    assert tracemalloc.get_traced_memory()[1] < 20_000_000
    tracemalloc.stop()


def test_a_flow_beyond_what_float32_holds_is_not_believed(
    db, tiny_split, aligned_elsewhere, tmp_path
):
    flow = np.zeros((120, 160, 2))
    flow[:, :80] = 1e308
    np.save(tmp_path / "0000.npy", flow)
    run = aligned_elsewhere
    import_layer(db, run, "alignment", tmp_path, tiny_split[:1], packing(run))
    valid = decode_rle(load_alignment(db, run.id, tiny_split[0].id).valid)
    assert not valid[:, :80].any() and valid[10:110, 90:150].all()
