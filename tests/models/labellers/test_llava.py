"""LLaVA with and without Alpha-CLIP: the real loading code, and what it feeds the network."""

import numpy as np
import pytest
import torch
from checkpoints import write_alpha_clip, write_llava, write_sam
from scenes import textured
from transformers import (
    AutoTokenizer,
    LlavaForConditionalGeneration,
    LlavaImageProcessorPil,
    LlavaProcessor,
)

from reviewer.errors import InvalidInput
from reviewer.models.labellers.alpha import ON, AlphaBranch, transformers_names
from reviewer.models.labellers.llava import LlavaLabeller, prepare_mask, prepare_picture
from reviewer.models.labellers.phrases import PROMPT
from reviewer.models.registry import build_labeller, settings_of

LIVE = textured(4)
CHANGE = np.zeros(LIVE.shape[:2], bool)
CHANGE[30:50, 40:70] = True
CHANGE[90:95, 10:14] = True


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_llava(tmp_path_factory.mktemp("llava"))


@pytest.fixture(scope="module")
def alpha(tmp_path_factory):
    return write_alpha_clip(tmp_path_factory.mktemp("alpha") / "alpha.pth")


def llava(folder, **settings):
    return build_labeller(
        "llava",
        {"checkpoint": str(folder), "precision": "float32", "max_new_tokens": 12, **settings},
    )


def with_alpha(folder, alpha, **settings):
    own = {"checkpoint": str(folder), "alpha": str(alpha), "precision": "float32"}
    return build_labeller("llava-alpha", {**own, "max_new_tokens": 12, **settings})


def test_it_answers_what_the_library_answers(folder):
    net = LlavaForConditionalGeneration.from_pretrained(folder).eval()
    picture = LlavaImageProcessorPil(
        do_pad=True, size={"shortest_edge": 28}, crop_size={"height": 28, "width": 28}
    )
    processor = LlavaProcessor(
        picture,
        AutoTokenizer.from_pretrained(folder),
        patch_size=14,
        vision_feature_select_strategy="default",
        num_additional_image_tokens=1,
    )
    text = f"USER: <image>\n{PROMPT} ASSISTANT:"
    inputs = processor(images=[LIVE], text=text, return_tensors="pt")
    np.testing.assert_array_equal(inputs["pixel_values"].numpy(), prepare_picture(LIVE, 28))
    with torch.inference_mode():
        out = net.generate(**inputs, do_sample=False, max_new_tokens=12)
    wanted = processor.decode(out[0, inputs["input_ids"].shape[1] :], skip_special_tokens=True)
    assert llava(folder).ask(LIVE, None) == wanted.strip()


def test_it_is_shown_the_change_cut_out(folder, monkeypatch):
    shown = []

    def ask(self, image, mask):
        shown.append(image.shape[:2])
        return "pen"

    monkeypatch.setattr(LlavaLabeller, "ask", ask)
    (said,) = llava(folder, dilations=0).name(LIVE, CHANGE, "cs1")
    assert (said.component, said.raw, said.label) == (None, "pen", "pen")
    two = llava(folder, dilations=0, per_component=True).name(LIVE, CHANGE, "cs1")
    assert [s.component for s in two] == [0, 1]
    # 20 x 30 and 5 x 4 pixels with the least margin, 16, cut off at the left border.
    assert shown[1:] == [(52, 62), (37, 30)]
    llava(folder).name(LIVE, CHANGE & (np.arange(160) > 20), "cs1")
    # Three dilations by 5 x 5 add 6 pixels on every side; then half of 42 is the margin.
    assert shown[-1] == (32 + 2 * 21, 42 + 2 * 21)


def test_only_the_largest_components_are_asked_about_and_the_others_say_so(folder, monkeypatch):
    monkeypatch.setattr(LlavaLabeller, "ask", lambda self, image, mask: "This object is a pen.")
    said = llava(folder, per_component=True, most_components=1).name(LIVE, CHANGE, "cs1")
    assert [s.label for s in said] == ["pen", ""]
    assert said[1].note == "not asked: smaller than 1 others"


def test_nothing_changed_asks_nothing(folder):
    assert llava(folder).name(LIVE, CHANGE & False, "cs1") == ()


def test_the_question_may_name_the_image_marker(folder):
    assert isinstance(llava(folder, prompt="what is <image>?").ask(LIVE, None), str)


def test_the_mask_goes_through_the_pictures_pad_and_resize():
    # White where the mask is: the prepared picture and the prepared mask must agree.
    picture = np.where(CHANGE[..., None], 255, 0).astype(np.uint8).repeat(3, axis=2)
    bright = prepare_picture(picture, 28)[0].mean(axis=0)
    mask = prepare_mask(CHANGE, 28)
    assert mask.any() and bright[mask].min() > bright[~mask].min()
    whole = prepare_mask(np.ones((120, 160), bool), 28)
    # 120 of 160 rows: the pad above and below is outside.
    assert not whole[:3].any() and whole[4:24].all() and not whole[25:].any()


@pytest.mark.parametrize(
    ("prefix", "joined"), [("", "in_proj."), ("visual.", "in_proj_"), ("module.", "in_proj.")]
)
def test_public_names_of_the_tower_are_understood(folder, tmp_path, prefix, joined):
    path = write_alpha_clip(tmp_path / "a.pth", prefix=prefix, joined=joined)
    labeller = with_alpha(folder, path)
    plain = torch.load(write_alpha_clip(tmp_path / "b.pth"), weights_only=True)
    tower = labeller._net.model.vision_tower.state_dict()
    for key, value in transformers_names(plain).items():
        torch.testing.assert_close(tower[key], value)
    thirds = plain["transformer.resblocks.1.attn.in_proj.weight"].chunk(3)
    torch.testing.assert_close(tower["encoder.layers.1.self_attn.v_proj.weight"], thirds[2])


def test_the_branch_adds_its_convolution_to_the_patches(folder, alpha):
    labeller = with_alpha(folder, alpha)
    tower = labeller._net.model.vision_tower
    pixels = torch.from_numpy(prepare_picture(LIVE, 28))
    shown = torch.full((1, 1, 28, 28), ON)
    with torch.inference_mode():
        without = tower.embeddings.patch_embedding(pixels)
        with labeller._branch.showing(shown):
            found = tower.embeddings.patch_embedding(pixels)
        added = torch.nn.functional.conv2d(
            shown, tower.embeddings.patch_embedding_alpha.weight, stride=14
        )
    torch.testing.assert_close(found, without + added)


def test_a_branch_without_weights_changes_nothing(folder):
    net = LlavaForConditionalGeneration.from_pretrained(folder).eval()
    tower = net.model.vision_tower
    pixels = torch.from_numpy(prepare_picture(LIVE, 28))
    with torch.inference_mode():
        before = tower(pixels).last_hidden_state
        branch = AlphaBranch(tower)
        with branch.showing(torch.full((1, 1, 28, 28), ON)):
            after = tower(pixels).last_hidden_state
    assert torch.equal(before, after)


def test_the_answer_depends_on_the_mask(folder, alpha):
    labeller = with_alpha(folder, alpha)
    answers = {labeller.ask(LIVE, mask) for mask in (CHANGE, ~CHANGE, None)}
    assert len(answers) > 1
    assert labeller.ask(LIVE, CHANGE) == labeller.ask(LIVE, CHANGE)


def test_a_whole_pair_is_named(folder, alpha):
    (said,) = with_alpha(folder, alpha, stop_list=[]).name(LIVE, CHANGE, "cs1")
    assert said.raw and (said.label or said.note)


def test_its_settings_say_which_weights_it_has(folder, alpha):
    one, other = settings_of(llava(folder)), settings_of(with_alpha(folder, alpha))
    assert one["weights"] != other["weights"] and len(one["weights"]) == 12
    with pytest.raises(InvalidInput, match="holds other weights"):
        llava(folder, weights="0" * 12)


def test_fetched_weights_are_found(folder, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    path = tmp_path / "reviewer" / "weights" / "clip_l14_336_grit_20m_4xe.pth"
    path.parent.mkdir(parents=True)
    write_alpha_clip(path)
    assert settings_of(with_alpha(folder, ""))["alpha"] == str(path)


@pytest.mark.parametrize(
    ("file", "message"),
    [(None, "needs Alpha-CLIP's weights"),
     ("none.pth", "there is no such file"),
     ("text.pth", "is no Alpha-CLIP checkpoint"),
     ("other.pth", "is no Alpha-CLIP checkpoint")],
)  # fmt: skip
def test_weights_that_are_no_alpha_clip_are_refused(folder, tmp_path, monkeypatch, file, message):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "text.pth").write_text("no weights")
    torch.save({"layer.weight": torch.zeros(3)}, tmp_path / "other.pth")
    with pytest.raises(InvalidInput, match=message):
        with_alpha(folder, "" if file is None else tmp_path / file)


def test_a_checkpoint_of_another_kind_is_refused(tmp_path):
    with pytest.raises(InvalidInput, match="holds a model of type 'sam', not llava"):
        llava(write_sam(tmp_path / "sam"))


def test_a_model_that_was_not_fetched_says_how_to_fetch_it(monkeypatch, tmp_path):
    with pytest.raises(InvalidInput, match="reviewer models fetch nobody/nothing"):
        llava("nobody/nothing")


def test_a_model_too_big_for_the_memory_is_refused_with_both_figures(folder, monkeypatch):
    monkeypatch.setattr("reviewer.models.weights.hub.free_memory", lambda: 1000)
    with pytest.raises(InvalidInput, match=r"take 0\.0 GiB in torch.float32, but 0\.0"):
        llava(folder)
