"""Models that stand in for slow ones: passed in, and counting their calls."""

from threading import Event

import numpy as np

from reviewer.models.interfaces import Candidate, Instance, ModelFailed, Objects


class FakeClicks:
    """A click segmenter that answers with discs around the positive clicks."""

    keeps_embeddings = True
    model_id = "fake"

    def __init__(self, score=0.5):
        self.score = score
        self.embedded = []
        self.confidences = []
        self.changes = []
        self.prompts = []
        self.go_on = Event()
        self.go_on.set()

    def embed(self, image, other, confidence=None, change=None):
        self.embedded.append((image.copy(), None if other is None else other.copy()))
        self.confidences.append(confidence)
        self.changes.append(change)
        return {"size": np.float32(image.shape[:2]), "map": image.astype(np.float32) / 255}

    def predict(self, embedding, prompt):
        self.go_on.wait(10)
        self.prompts.append(prompt)
        height, width = (int(v) for v in embedding["size"])
        rows, columns = np.mgrid[:height, :width]
        mask = np.zeros((height, width), bool)
        for click in prompt.clicks:
            near = (rows + 0.5 - click.y) ** 2 + (columns + 0.5 - click.x) ** 2 <= 36
            mask[near] = click.positive
        if prompt.box_xyxy is not None:
            x0, y0, x1, y1 = (int(v) for v in prompt.box_xyxy)
            mask[y0:y1, x0:x1] = True
        return [Candidate(mask, self.score), Candidate(~mask, self.score / 2)]


class NamedObjects:
    """A segmenter that finds one object a label, and none for "unfindable"."""

    built = 0

    def __init__(self):
        NamedObjects.built += 1

    def segment(self, view):
        if "unfindable" in view.labels:
            raise ModelFailed("segmenter named: the net is out of order")
        found = []
        for k, label in enumerate(view.labels):
            mask = np.zeros_like(view.valid)
            mask[40:60, 50 + 5 * k : 75] = True
            found.append(Instance(mask, label, 0.5))
        return Objects(tuple(found), ())
