"""The change net learns beside its fixed features, the same for the same seed, and resumes."""

import copy

import numpy as np
import torch
from tiny_views import tiny_views, weights_hash

from reviewer.models.nets.siamese_lite import SiameseLite
from reviewer.training.change_loop import ChangeTraining, train_change_net


def fitted(settings, tell=lambda fit, losses: None, state=None):
    torch.manual_seed(0)
    return train_change_net(SiameseLite(), tiny_views(), settings, tell, state)


def test_some_steps_on_a_few_things_lower_the_loss():
    losses = []
    settings = ChangeTraining(steps=40, batch=2, rate=5e-3)
    fitted(settings, lambda fit, found: losses.append(found["change"]))
    assert np.mean(losses[-10:]) < np.mean(losses[:10]) - 0.5


def test_the_features_stay_unless_a_rate_is_given_for_them():
    torch.manual_seed(0)
    before = weights_hash(SiameseLite().features)
    settings = ChangeTraining(steps=2, batch=2)
    assert weights_hash(fitted(settings).features) == before
    settings = ChangeTraining(steps=2, batch=2, feature_rate=0.1)
    assert weights_hash(fitted(settings).features) != before


def test_the_same_seed_gives_the_same_weights_and_another_seed_gives_others():
    first, again = (weights_hash(fitted(ChangeTraining(steps=2, batch=2))) for _ in range(2))
    other = weights_hash(fitted(ChangeTraining(steps=2, batch=2, seed=1)))
    assert first == again != other


def test_a_stopped_training_ends_as_one_that_was_not_stopped():
    settings = ChangeTraining(steps=4, batch=2)
    states = []
    whole = fitted(
        settings,
        lambda fit, _: states.append(copy.deepcopy(fit.state())) if fit.done == 2 else None,
    )
    assert weights_hash(fitted(settings, state=states[0])) == weights_hash(whole)
