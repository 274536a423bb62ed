"""Named recipes of a training: the program's own, and the paper's to the letter.

The program's recipe takes the paper's figures and adds what makes small trainings on a processor
work: several objects a pair, differences of light and place, a limit on the gradient. The paper's
adds nothing: one COCO object pasted at random size and place on a reference image (section "Data
Synthesis"), encoders from ImageNet, no limit. Its weights are those after 40,000 iterations of a
rate that falls to 0 over 50,000 (the public CSCDNet code), so they are the last, not the best.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from reviewer.errors import InvalidInput
from reviewer.synthesis.settings import SynthesisSettings
from reviewer.training.settings import FAMILY, TrainingSettings
from reviewer.words import RecipeName

PLAIN = SynthesisSettings(
    changes=(1, 1),
    unchanged=0,
    rotation_degrees=0.0,
    feather_px=(0.0, 0.0),
    colour_match=(0.0, 0.0),
    shadow=0.0,
    removal=0.0,
    homography_px=0.0,
    flow_px=0.0,
    exposure=1.0,
    colour_cast=1.0,
    shade=0.0,
    noise=0.0,
    blur_px=0.0,
)
"""The paper's pair: a reference image, and the same with one object more."""
DECAY_OVER = {"cscdnet": 50000}
"""Iterations over which the rate falls, where the public code stops before its end."""


@dataclass(frozen=True, slots=True)
class Recipe:
    """What a training follows.

    Attributes:
        weights: which file a run should use, "best.pt" or "last.pt".
    """

    name: RecipeName
    settings: TrainingSettings
    synthesis: SynthesisSettings
    weights: str

    def differences(self) -> dict[str, tuple[Any, Any]]:
        """Return what differs from the program's own recipe for this net: (here, there) by name."""
        own = TrainingSettings.of_paper(self.settings.net)
        found: dict[str, tuple[Any, Any]] = {}
        for kind, here, there in (
            ("training", asdict(self.settings), asdict(own)),
            ("synthesis", asdict(self.synthesis), asdict(SynthesisSettings())),
        ):
            found |= {
                f"{kind} {name}": (here[name], there[name])
                for name in here
                if here[name] != there[name] and name != "seed"
            }
        return found

    def record(self) -> dict[str, Any]:
        """Return name and differences as plain JSON values."""
        lists = {name: [_plain(v) for v in pair] for name, pair in self.differences().items()}
        return {"name": self.name, "weights": self.weights, "differs_from_default": lists}


def make_recipe(
    name: RecipeName, net: str, training: dict[str, Any], synthesis: dict[str, Any]
) -> Recipe:
    """Return a recipe for a net, changed by the settings given.

    Raises:
        InvalidInput: for an unknown net, or a value outside its range.
    """
    if name == "default":
        settings = TrainingSettings.of_paper(net, **training)
        return Recipe(name, settings, SynthesisSettings(**synthesis), "best.pt")
    decay = DECAY_OVER.get(FAMILY.get(net, ""))
    settings = TrainingSettings.of_paper(net, **{"clip_norm": 0.0, "decay_over": decay, **training})
    plain = {field.name: getattr(PLAIN, field.name) for field in fields(PLAIN)}
    return Recipe(name, settings, SynthesisSettings(**{**plain, **synthesis}), "last.pt")


def check_paper(backbone: Path | None, coco: Path | None) -> None:
    """Require what the paper's recipe needs.

    Raises:
        InvalidInput: naming the option that is missing.
    """
    if backbone is None:
        raise InvalidInput(
            "--recipe paper: its encoders start from ImageNet; give --backbone-weights, a ResNet-18"
            " file in torchvision or timm naming"
        )
    if coco is None:
        raise InvalidInput(
            "--recipe paper: pastes COCO objects; give --coco, an instances file of COCO"
        )


def iterations_of_epochs(epochs: int, references: int, batch: int) -> int:
    """Return the iterations in which every reference image is shown `epochs` times."""
    return epochs * -(-references // batch)


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
