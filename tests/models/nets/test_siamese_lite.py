"""The change net compares: nothing differs from itself, and a near match is found."""

import pytest
import torch

from reviewer.models.nets.siamese_lite import (
    LIGHT_PX,
    STATISTICS,
    TOLERANCE_PX,
    Comparison,
    SiameseLite,
    _beyond,
    _colours,
    _without_light,
)


def noise(*shape, seed=0):
    return torch.randn(*shape, generator=torch.manual_seed(seed))


@pytest.fixture
def comparison():
    torch.manual_seed(2)
    return Comparison(6, 8, 3, learns=True)


def statistics(comparison, live, past):
    with torch.no_grad():
        found = comparison(live, past)
    assert found.shape[1] == STATISTICS + 2 * 8
    here, forth, back, _ = found[:, :STATISTICS].unbind(1)
    return here, forth, back, found[:, STATISTICS : STATISTICS + 8]


def test_identical_features_match_everywhere_and_do_not_differ(comparison):
    features = noise(1, 6, 20, 24)
    here, forth, back, difference = statistics(comparison, features, features)
    for similarity in (here, forth, back):
        torch.testing.assert_close(similarity, torch.ones_like(similarity))
    assert not difference.any()


@pytest.mark.parametrize(("dy", "dx"), [(3, 0), (0, -3), (-2, 3)])
def test_a_shift_within_reach_is_matched_and_one_beyond_is_not(comparison, dy, dx):
    features = noise(1, 6, 40, 40)
    inner = slice(8, -8)
    moved = torch.roll(features, (dy, dx), (2, 3))
    here, forth, back, _ = (s[..., inner, inner] for s in statistics(comparison, features, moved))
    torch.testing.assert_close(forth, torch.ones_like(forth))
    torch.testing.assert_close(back, torch.ones_like(back))
    assert here.mean() < 0.6
    far = torch.roll(features, (2 * dy + 1, 2 * dx + 1), (2, 3))
    _, forth, back, _ = (s[..., inner, inner] for s in statistics(comparison, features, far))
    assert forth.mean() < 0.97 and back.mean() < 0.97


def test_a_thing_in_one_picture_only_has_no_match_in_that_direction(comparison):
    past = noise(1, 6, 40, 40)
    live = past.clone()
    live[..., 15:25, 15:25] = 4 * noise(1, 6, 10, 10, seed=1)
    _, forth, _, _ = statistics(comparison, live, past)
    inside, outside = forth[..., 18:22, 18:22], forth[..., :10, :10]
    assert inside.mean() < outside.mean() - 0.05
    torch.testing.assert_close(outside, torch.ones_like(outside))


def test_a_wide_search_at_a_fine_scale_is_not_learnt_through():
    for learns in (False, True):
        torch.manual_seed(0)
        comparison = Comparison(4, 4, 2, learns=learns)
        comparison(noise(1, 4, 8, 8), noise(1, 4, 8, 8, seed=1))[:, 1].sum().backward()
        assert bool(comparison.embed.weight.grad.any()) == learns


def test_identical_pictures_leave_no_colour_unexplained_nor_does_a_move_within_tolerance():
    picture = torch.rand(1, 3, 64, 64, generator=torch.manual_seed(0)) * 255
    _, mine, theirs = _colours(picture, picture)
    assert not mine.any() and not theirs.any()
    plain = _without_light(picture / 255)
    moved = torch.roll(plain, (TOLERANCE_PX, -TOLERANCE_PX), (2, 3))
    inner = slice(4, -4)
    assert not _beyond(plain, moved)[..., inner, inner].any()
    too_far = torch.roll(plain, TOLERANCE_PX + 1, 3)
    assert _beyond(plain, too_far)[..., inner, inner].any()


def test_light_that_changes_slowly_is_no_difference_of_colours():
    picture = torch.rand(1, 3, 96, 96, generator=torch.manual_seed(0)) * 100
    brighter = picture + torch.linspace(20, 40, 96)
    _, mine, theirs = _colours(picture, brighter)
    inner = slice(LIGHT_PX, -LIGHT_PX)
    # 20 to 40 grey levels are 0.24 to 0.47 with the gain of three.
    assert mine[..., inner, inner].max() < 0.06 and theirs[..., inner, inner].max() < 0.06
    spot = picture.clone()
    spot[..., 45:51, 45:51] += 60
    _, mine, _ = _colours(spot, picture)
    assert mine[..., 46:50, 46:50].mean() > 0.1


def test_logits_have_the_size_of_the_pictures_and_follow_the_confidence():
    torch.manual_seed(0)
    net = SiameseLite().eval()
    live, warped = (torch.rand(2, 3, 64, 96) * 255 for _ in range(2))
    with torch.no_grad():
        sure = net(live, warped, torch.ones(2, 1, 64, 96))
        unsure = net(live, warped, torch.zeros(2, 1, 64, 96))
        single = net(live[:1], warped[:1], torch.ones(1, 1, 64, 96))
    assert sure.shape == (2, 64, 96)
    assert not torch.allclose(sure, unsure)
    torch.testing.assert_close(single, sure[:1], rtol=1e-4, atol=1e-4)
