"""The blocked correlation equals its definition, forwards and backwards."""

import pytest
import torch

from reviewer.models.nets.correlation import correlate


def by_definition(first, second, max_displacement=20, stride=2):
    """out[(j, i)][y, x] = mean_c a[c, y, x] * b[c, y + j, x + i], vertical slow, zero outside."""
    count, _, height, width = first.shape
    steps = range(-max_displacement, max_displacement + 1, stride)
    out = torch.zeros(count, len(steps) ** 2, height, width, dtype=first.dtype)
    for row, j in enumerate(steps):
        for column, i in enumerate(steps):
            for y in range(height):
                for x in range(width):
                    if 0 <= y + j < height and 0 <= x + i < width:
                        product = first[:, :, y, x] * second[:, :, y + j, x + i]
                        out[:, row * len(steps) + column, y, x] = product.mean(1)
    return out


@pytest.mark.parametrize(
    ("shape", "reach", "stride"),
    [
        ((1, 3, 5, 7), 4, 2),
        ((2, 2, 4, 43), 2, 1),
        ((1, 2, 9, 3), 6, 3),
        ((1, 1, 1, 1), 4, 2),
        ((1, 4, 6, 24), 20, 2),
    ],
)
def test_it_equals_the_written_out_loop(shape, reach, stride):
    torch.manual_seed(0)
    first, second = torch.randn(shape).double(), torch.randn(shape).double()
    found = correlate(first, second, max_displacement=reach, stride=stride)
    wanted = by_definition(first, second, reach, stride)
    torch.testing.assert_close(found, wanted, rtol=0, atol=1e-12)


def test_gradients_are_right():
    torch.manual_seed(0)
    maps = [torch.randn(2, 2, 3, 22, dtype=torch.double, requires_grad=True) for _ in range(2)]
    assert torch.autograd.gradcheck(
        lambda a, b: correlate(a, b, max_displacement=2, stride=2), maps
    )


def test_a_shift_shows_at_its_displacement():
    torch.manual_seed(0)
    second = torch.randn(1, 64, 30, 40)
    first = torch.roll(second, (-6, 4), (2, 3))  # first[y, x] = second[y + 6, x - 4]
    best = correlate(first, second)[0, :, 15, 20].argmax()
    assert divmod(int(best), 21) == (10 + 3, 10 - 2)


def test_half_precision_comes_back_as_it_came():
    maps = torch.ones(1, 4, 6, 6, dtype=torch.bfloat16)
    volume = correlate(maps, maps, max_displacement=2)
    assert volume.dtype == torch.bfloat16 and volume[0, 4, 3, 3] == 1


def test_bad_shapes_are_refused():
    with pytest.raises(ValueError, match="maps differ"):
        correlate(torch.zeros(1, 2, 4, 4), torch.zeros(1, 2, 4, 5))
    with pytest.raises(ValueError, match="stride 3 does not divide 20"):
        correlate(torch.zeros(1, 2, 4, 4), torch.zeros(1, 2, 4, 4), stride=3)
