"""One contract for all click segmenters, and what each promises beyond it."""

import cv2
import numpy as np
import pytest
import torch
from checkpoints import write_sam, write_sam2
from scenes import textured
from transformers import Sam2Model, SamModel

from reviewer.errors import InvalidInput
from reviewer.masks import intersection_over_union
from reviewer.models.clicks.grabcut import GrabCutClicks
from reviewer.models.clicks.sam import SamClicks
from reviewer.models.interfaces import Click, Prompt
from reviewer.models.registry import build_click_segmenter

NAMES = ("grabcut", "sam", "sam2")


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    root = tmp_path_factory.mktemp("checkpoints")
    return {"sam": write_sam(root / "sam"), "sam2": write_sam2(root / "sam2")}


@pytest.fixture(scope="module", params=NAMES)
def segmenter(request, folders):
    name = request.param
    return build_click_segmenter(f"{name}:{folders[name]}" if name in folders else name)


@pytest.fixture
def scene():
    """The present and the past of a view, and the square that appeared."""
    past = textured(3)
    live, square = past.copy(), np.zeros(past.shape[:2], bool)
    square[40:64, 60:90] = True
    live[square] = (225, 30, 40)
    live.setflags(write=False)
    return live, past, square


PROMPTS = {
    "a click": Prompt((Click(75, 52),)),
    "two clicks": Prompt((Click(75, 52), Click(20, 20, False))),
    "a box": Prompt(box_xyxy=(55, 36, 95, 70)),
    "a box and a click": Prompt((Click(75, 52),), (55, 36, 95, 70)),
}


@pytest.mark.parametrize("prompt", PROMPTS.values(), ids=PROMPTS)
def test_candidates_have_the_images_size_and_come_best_first(segmenter, scene, prompt):
    live, past, _ = scene
    found = segmenter.predict(segmenter.embed(live, past), prompt)
    assert found
    assert all(c.mask.shape == live.shape[:2] and c.mask.dtype == bool for c in found)
    scores = [c.score for c in found]
    assert scores == sorted(scores, reverse=True) and all(0 <= score <= 1 for score in scores)


def test_the_same_prompt_gives_the_same_candidates(segmenter, scene):
    live, past, square = scene
    before = square.copy()
    before[40:52] = False
    clicks = (Click(75, 58), Click(75, 44))
    embedding = segmenter.embed(live, past)
    once = segmenter.predict(embedding, Prompt(clicks, None, before))
    again = segmenter.predict(embedding, Prompt(clicks, None, before))
    for first, second in zip(once, again, strict=True):
        assert (first.mask == second.mask).all() and first.score == second.score


def test_grabcut_keeps_what_the_newest_click_does_not_touch(scene):
    live, past, square = scene
    before = square.copy()
    before[100:112, 8:24] = True
    segmenter = GrabCutClicks()
    clicks = (Click(75, 52), Click(15, 106), Click(58, 52, False))
    found = segmenter.predict(segmenter.embed(live, past), Prompt(clicks, None, before))
    assert any(c.mask[101:111, 9:23].all() and c.mask[42:62, 62:88].all() for c in found)


def test_an_embedding_is_made_of_float32_arrays(segmenter, scene):
    embedding = segmenter.embed(scene[0], None)
    assert all(array.dtype == np.float32 for array in embedding.values())


def test_grabcut_finds_what_appeared_with_one_click(scene):
    live, past, square = scene
    segmenter = GrabCutClicks()
    best = segmenter.predict(segmenter.embed(live, past), PROMPTS["a click"])[0]
    assert intersection_over_union(best.mask, square) > 0.95


def test_grabcut_sees_a_change_that_its_colour_hides():
    # A tint far weaker than the texture: only the difference to the past tells the patch apart.
    past = textured(0)
    patch = np.zeros(past.shape[:2], bool)
    patch[50:74, 70:100] = True
    live = past.copy()
    live[patch] = np.clip(live[patch].astype(int) + np.array([20, -10, 0]), 0, 255)
    segmenter, click = GrabCutClicks(), Prompt((Click(85, 62),))
    aware = segmenter.predict(segmenter.embed(live, past), click)
    blind = segmenter.predict(segmenter.embed(live, None), click)
    best = [max(intersection_over_union(c.mask, patch) for c in found) for found in (aware, blind)]
    assert best[0] > 0.9 and best[1] < 0.1


def test_grabcut_obeys_every_click(scene):
    live, past, _ = scene
    segmenter = GrabCutClicks()
    clicks = (Click(75, 52), Click(63, 42, False), Click(10, 100), Click(159.9, 119.9))
    embedding = segmenter.embed(live, past)
    for count in range(1, len(clicks) + 1):
        for candidate in segmenter.predict(embedding, Prompt(clicks[:count])):
            for click in clicks[:count]:
                assert candidate.mask[int(click.y), int(click.x)] == click.positive


@pytest.mark.parametrize("kind", ["sam", "sam2"])
def test_prompts_reach_the_network_as_if_it_was_called_directly(kind, folders, scene):
    live, _, square = scene
    segmenter = SamClicks.load(kind, str(folders[kind]))
    model = {"sam": SamModel, "sam2": Sam2Model}[kind].from_pretrained(folders[kind]).eval()
    side, height, width = 64, *live.shape[:2]
    columns, rows = (64, 64) if kind == "sam2" else (64, 48)
    scale = torch.tensor([columns / width, rows / height])
    pixels = segmenter._pixels(live)
    assert pixels.shape == (1, 3, side, side)
    if kind == "sam":
        assert not pixels[..., 48:, :].any() and pixels[..., :48, :].any()
    low = cv2.resize(square.astype(np.float32), (columns // 4, rows // 4), interpolation=3)
    given = torch.full((1, 1, 16, 16), 0.0)
    given[..., : rows // 4, : columns // 4] = (2 * torch.from_numpy(low) - 1) * 10
    with torch.inference_mode():
        maps = model.get_image_embeddings(pixels)
        expected = model(
            image_embeddings=maps,
            input_points=(torch.tensor([[75.0, 52.0], [20.0, 20.0]]) * scale)[None, None],
            input_labels=torch.tensor([[[1, 0]]]),
            input_boxes=(torch.tensor([[55.0, 36.0], [95.0, 70.0]]) * scale).view(1, 1, 4),
            input_masks=given,
            multimask_output=False,
        )
        full = expected.pred_masks[0].float()
        if kind == "sam":
            full = torch.nn.functional.interpolate(full, (64, 64), mode="bilinear")[..., :48, :]
        full = torch.nn.functional.interpolate(full, (height, width), mode="bilinear")
    embedding = {"size": np.float32([height, width])}
    for k, tensor in enumerate(maps if kind == "sam2" else [maps]):
        embedding[f"map{k}"] = tensor.numpy()
    prompt = Prompt((Click(75, 52), Click(20, 20, False)), (55, 36, 95, 70), square)
    found = segmenter.predict(embedding, prompt)
    assert torch.equal(segmenter._prompts(prompt, height, width)["input_masks"], given)
    assert len(found) == 1
    assert (found[0].mask == (full[0, 0] > 0).numpy()).all()
    assert found[0].score == pytest.approx(float(expected.iou_scores[0, 0, 0].clamp(0, 1)))


@pytest.mark.parametrize("kind", ["sam", "sam2"])
def test_different_weights_are_different_models(kind, folders, tmp_path):
    other = {"sam": write_sam, "sam2": write_sam2}[kind](tmp_path / kind, seed=9)
    first = SamClicks.load(kind, str(folders[kind])).model_id
    assert first != SamClicks.load(kind, str(other)).model_id
    assert first == SamClicks.load(kind, str(folders[kind])).model_id


def test_sam2_video_checkpoints_load_as_their_image_model(folders, tmp_path):
    import json
    import shutil

    shutil.copytree(folders["sam2"], tmp_path / "video")
    config = tmp_path / "video" / "config.json"
    config.write_text(json.dumps({**json.loads(config.read_text()), "model_type": "sam2_video"}))
    loaded = SamClicks.load("sam2", str(tmp_path / "video"))
    assert (
        loaded.model_id.split("-")[-1]
        == SamClicks.load("sam2", str(folders["sam2"])).model_id.split("-")[-1]
    )


def test_a_checkpoint_that_cannot_be_used_is_refused_by_name(folders, tmp_path):
    with pytest.raises(InvalidInput, match=r"no such directory.*grabcut"):
        build_click_segmenter(f"sam:{tmp_path}/none")
    with pytest.raises(InvalidInput, match="type 'sam', not sam2"):
        build_click_segmenter(f"sam2:{folders['sam']}")
    with pytest.raises(InvalidInput, match="takes no path"):
        build_click_segmenter("grabcut:weights")
    with pytest.raises(InvalidInput, match="there is no 'clicky'"):
        build_click_segmenter("clicky")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InvalidInput, match=r"cannot be loaded|type None"):
        build_click_segmenter(f"sam:{tmp_path / 'empty'}")


def test_missing_weights_are_an_error_and_not_random_numbers(folders, tmp_path):
    import shutil

    from safetensors.torch import load_file, save_file

    shutil.copytree(folders["sam"], tmp_path / "torn")
    path = tmp_path / "torn" / "model.safetensors"
    weights = load_file(path)
    del weights["mask_decoder.iou_token.weight"]
    save_file(weights, path, {"format": "pt"})
    with pytest.raises(InvalidInput, match=r"1 weights are missing.*iou_token"):
        build_click_segmenter(f"sam:{tmp_path / 'torn'}")


def test_embeddings_of_another_precision_are_other_ones(folders):
    exact = SamClicks.load("sam2", str(folders["sam2"]), precision="float32")
    coarse = SamClicks.load("sam2", str(folders["sam2"]), precision="bfloat16")
    assert exact.model_id.endswith("-float32") and coarse.model_id.endswith("-bfloat16")
    image = textured(0)
    first, second = exact.embed(image, None), coarse.embed(image, None)
    assert not np.array_equal(first["map0"], second["map0"])
