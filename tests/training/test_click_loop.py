"""The click net learns, the same for the same seed, and goes on where it was stopped."""

import copy

import numpy as np
import pytest
import torch
from tiny_views import tiny_views, weights_hash

from reviewer.models.nets.click_net import ClickNet
from reviewer.training.click_loop import ClickTraining, train_click_net
from reviewer.training.loop import TrainingFailed

TINY = (4, 8, 8, 8, 8)


class Silent:
    """A detector that finds nothing."""

    def detect_confident(self, warped, live, valid, confidence):
        return np.zeros_like(confidence)


def fitted(settings, tell=lambda fit, losses: None, state=None):
    torch.manual_seed(0)
    return train_click_net(ClickNet(TINY), tiny_views(), Silent(), settings, tell, state)


def test_some_steps_on_a_few_things_lower_the_loss():
    losses = []
    settings = ClickTraining(steps=100, batch=8, rate=1e-2)
    average = fitted(settings, lambda fit, found: losses.append(found["mask"]))
    assert len(losses) == 100
    assert np.mean(losses[-10:]) < np.mean(losses[:10]) - 0.1
    assert not average.training


def test_the_same_seed_gives_the_same_weights_and_another_seed_gives_others():
    first, again = (weights_hash(fitted(ClickTraining(steps=3, batch=4))) for _ in range(2))
    other = weights_hash(fitted(ClickTraining(steps=3, batch=4, seed=1)))
    assert first == again != other


def test_a_stopped_training_goes_on_to_its_last_step():
    settings = ClickTraining(steps=5, batch=4)
    states, told, rates = [], [], []
    fitted(settings, lambda fit, _: states.append(copy.deepcopy(fit.state())))

    def listen(fit, _):
        told.append(fit.done)
        rates.append(fit.state()["schedule"]["_last_lr"])

    fitted(settings, listen, states[2])
    assert told == [4, 5]
    assert rates == [state["schedule"]["_last_lr"] for state in states[3:]]


def test_a_loss_that_is_no_number_stops_the_training_before_the_step():
    def spoil(fit, _):
        with torch.no_grad():
            fit.net.mask.bias.fill_(float("nan"))

    with pytest.raises(TrainingFailed, match=r"step 2: loss nan is not finite; try a lower --lr"):
        fitted(ClickTraining(steps=3, batch=4), spoil)
