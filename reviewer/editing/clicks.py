"""Clicks on a pair: from a person's points to candidate masks in the frame of the live image.

Loads the two images, embeds the one that was clicked, asks the segmenter, and keeps the better of
the old and the new candidate. With `crop` the object is looked at again in a window of its own, and
pasted back, so that small things get the network's whole resolution.
"""

from __future__ import annotations

import time
from collections.abc import Hashable, Iterable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace

import numpy as np

from reviewer.editing.pictures import load_pictures
from reviewer.editing.worker import Urgency, Worker
from reviewer.masks import Mask, crop_to_box
from reviewer.models.clicks.embeddings import EmbeddingCache
from reviewer.models.interfaces import Candidate, Click, Embedding, Prompt
from reviewer.records import Pair, Run
from reviewer.store.database import Store
from reviewer.store.pairs import pair_of_id
from reviewer.store.results import stage_keys
from reviewer.words import SIDES, Side

Window = tuple[slice, slice]
LEAST_CROP_PX = 96
CROP_MARGIN = 0.75
LARGEST_WHOLE_PX, LARGE_CROP_PX = 1600, 768
"""Longest side of a picture that is looked at as a whole, and of the window into a larger one."""
CORNER = (slice(0, 64), slice(0, 64))


@dataclass(frozen=True, slots=True)
class ClickRequest:
    """What a person clicked; coordinates and masks in the live frame.

    Attributes:
        picture: which image to segment; the reference is the one warped to the live view.
        best: the candidate so far, which `prompt.previous` holds the mask of.
        crop: look again in a window around the prompt.
    """

    pair_id: int
    run: Run | None
    picture: Side
    prompt: Prompt
    best: Candidate | None = None
    crop: bool = False


@dataclass(frozen=True, slots=True)
class ClickAnswer:
    """Candidates, best first, with the segmenter's own time in milliseconds."""

    candidates: list[Candidate]
    embed_ms: float
    predict_ms: float


class Clicks:
    """The click segmenter of a server, its embeddings and its worker."""

    def __init__(self, store: Store, cache: EmbeddingCache) -> None:
        self._store = store
        self._cache = cache
        self._worker = Worker("clicks")

    @property
    def model_id(self) -> str:
        """Which segmenter answers."""
        return self._cache.segmenter.model_id

    def find(
        self, client: Hashable, request: ClickRequest, *, preview: bool = False
    ) -> Future[ClickAnswer]:
        """Find candidates; the client's request that still waits is dropped.

        Raises (in the future):
            NotFound: when the pair, an image or the run's alignment does not exist.
        """
        urgency = Urgency.PREVIEW if preview else Urgency.CLICK
        return self._worker.submit(client, urgency, lambda: self._answer(request))

    def embed_ahead(self, client: Hashable, pair_ids: Sequence[int], run: Run | None) -> None:
        """Embed both images of pairs that a person will open next, when nobody else waits."""
        wanted = [
            (pair_id, picture) for pair_id in pair_ids for picture in _pictures(run is not None)
        ]
        self._ahead(client, wanted, run)

    def stop(self) -> None:
        """End the worker."""
        self._worker.stop()

    def _ahead(self, client: Hashable, wanted: list[tuple[int, Side]], run: Run | None) -> None:
        """Embed one image per turn, so that a click waits for one image at most."""
        if not wanted or self._worker.stopped:
            return
        (pair_id, picture), rest = wanted[0], wanted[1:]

        def work() -> None:
            try:
                pair = pair_of_id(self._store, pair_id)
                if self._looks_at_whole((pair.live.height, pair.live.width)):
                    self._embedding(pair, run, picture, None)
                else:  # which window a click will want is not known yet, the pictures are
                    load_pictures(self._store, pair, run, picture, CORNER)
            finally:  # a picture that cannot be had must not keep the others back
                self._ahead(client, rest, run)

        self._worker.submit(client, Urgency.AHEAD, work)

    def _answer(self, request: ClickRequest) -> ClickAnswer:
        pair = pair_of_id(self._store, request.pair_id)
        shape = (pair.live.height, pair.live.width)
        window = self._window(request, shape)
        start = time.perf_counter()
        embedding = self._embedding(pair, request.run, request.picture, window)
        embedded = time.perf_counter()
        prompt = request.prompt if window is None else _moved(request.prompt, window)
        found = self._cache.segmenter.predict(embedding, prompt)
        done = time.perf_counter()
        if window is not None:
            found = [replace(c, mask=_pasted(c.mask, window, shape)) for c in found]
        chosen = keep_best(request.best, found, request.prompt.clicks)
        return ClickAnswer(chosen, (embedded - start) * 1e3, (done - embedded) * 1e3)

    def _embedding(
        self, pair: Pair, run: Run | None, picture: Side, window: Window | None
    ) -> Embedding:
        place = None if window is None else tuple((s.start, s.stop) for s in window)
        # The stages' keys tell one alignment or detection of a run from the next.
        stages = stage_keys(self._store, run.id, [pair.id])[pair.id] if run else {}
        made_of = (stages.get("align"), stages.get("detect"))
        key = (pair.id, picture, run.id if run else 0, made_of, place)
        return self._cache.get(key, lambda: load_pictures(self._store, pair, run, picture, window))

    def _window(self, request: ClickRequest, shape: tuple[int, int]) -> Window | None:
        """Return where to look: the whole; a window of a large picture, wide enough for all that a
        segmenter looks at, and the same one for clicks near each other; or a close one to look
        again. A costly embedding is made once, of the whole."""
        if request.crop:
            return crop_window(request.prompt, shape)
        if self._looks_at_whole(shape):
            return None
        return crop_window(request.prompt, shape, LARGE_CROP_PX, LARGE_CROP_PX // 3)

    def _looks_at_whole(self, shape: tuple[int, int]) -> bool:
        return self._cache.segmenter.keeps_embeddings or max(shape) <= LARGEST_WHOLE_PX


def keep_best(
    best: Candidate | None, found: list[Candidate], clicks: Iterable[Click]
) -> list[Candidate]:
    """Put the candidate so far first when it is better than all new ones and obeys all clicks."""
    if best is None or not found or best.score <= found[0].score or not _obeys(best.mask, clicks):
        return found
    return [best, *found]


def crop_window(
    prompt: Prompt, shape: tuple[int, int], least_px: int = LEAST_CROP_PX, grid_px: int = 1
) -> Window:
    """Return the window around everything a prompt names, with a margin; it begins on a grid."""
    xs = [click.x for click in prompt.clicks]
    ys = [click.y for click in prompt.clicks]
    boxes = [] if prompt.box_xyxy is None else [prompt.box_xyxy]
    held = None if prompt.previous is None else crop_to_box(prompt.previous)
    if held is not None:
        boxes.append(held.box_xyxy)
    for box in boxes:
        xs += [box[0], box[2]]
        ys += [box[1], box[3]]
    side = max(least_px, (1 + CROP_MARGIN) * max(max(xs) - min(xs), max(ys) - min(ys)))
    spans = []
    for middle, length in ((_middle(ys), shape[0]), (_middle(xs), shape[1])):
        start = (middle - side / 2) // grid_px * grid_px
        start = int(min(max(start, 0), max(length - side, 0)))
        spans.append(slice(start, int(min(start + side, length))))
    return spans[0], spans[1]


def _middle(values: Sequence[float]) -> float:
    return (min(values) + max(values)) / 2


def _pictures(aligned: bool) -> tuple[Side, ...]:
    return SIDES if aligned else ("live",)


def _obeys(mask: Mask, clicks: Iterable[Click]) -> bool:
    height, width = mask.shape
    return all(
        bool(mask[min(int(c.y), height - 1), min(int(c.x), width - 1)]) == c.positive
        for c in clicks
    )


def _moved(prompt: Prompt, window: Window) -> Prompt:
    """Return a prompt in the frame of a window."""
    rows, columns = window
    clicks = tuple(replace(c, x=c.x - columns.start, y=c.y - rows.start) for c in prompt.clicks)
    box = prompt.box_xyxy
    if box is not None:
        x, y = columns.start, rows.start
        box = (box[0] - x, box[1] - y, box[2] - x, box[3] - y)
    previous = None if prompt.previous is None else np.ascontiguousarray(prompt.previous[window])
    return Prompt(clicks, box, previous)


def _pasted(part: Mask, window: Window, shape: tuple[int, int]) -> Mask:
    mask = np.zeros(shape, np.bool_)
    mask[window] = part
    return mask
