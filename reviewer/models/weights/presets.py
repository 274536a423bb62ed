"""Weights that are known by name: where they come from, under which licence, what uses them."""

from __future__ import annotations

from dataclasses import dataclass

from reviewer.errors import InvalidInput


@dataclass(frozen=True, slots=True)
class Preset:
    """Weights to fetch.

    Attributes:
        name: short name.
        source: hub id, or the address of a file.
        licence: as its makers state it; read it before you publish.
        use: the option that uses it.
        note: what else to know.
        sha256: of the file at that address, where its makers state it; "" = they do not.
    """

    name: str
    source: str
    licence: str
    use: str
    note: str = ""
    sha256: str = ""

    @property
    def is_file(self) -> bool:
        """Whether the source is the address of one file, not a hub id."""
        return self.source.startswith("https://")


_RSCD = "https://github.com/ChadLin9596/Robust-Scene-Change-Detection/releases/download/v0.0.0/"
_C3PO = (
    "https://huggingface.co/Flourish/C-3PO/resolve/be0cc81e8f4db5e6add758d6f8e3fa747c005698/"
    "resnet18_{0}.pth"
)
_SAM2 = "--segmenter grounded-sam:sam2:{0}, --click sam2:{0}"

PRESETS: tuple[Preset, ...] = (
    *(
        Preset(
            f"sam2-{size}",
            f"facebook/sam2.1-hiera-{size}",
            "Apache-2.0",
            _SAM2.format(f"facebook/sam2.1-hiera-{size}"),
            "the default" if size == "small" else "",
        )
        for size in ("tiny", "small", "base-plus", "large")
    ),
    Preset("sam-base", "facebook/sam-vit-base", "Apache-2.0", "--click sam:facebook/sam-vit-base"),
    Preset(
        "sam-huge",
        "facebook/sam-vit-huge",
        "Apache-2.0",
        "--segmenter grounded-sam:sam:facebook/sam-vit-huge",
        "the paper's",
    ),
    Preset(
        "sam3",
        "facebook/sam3",
        "SAM License",
        "--segmenter sam3",
        "gated: ask for access on its page, then set HF_TOKEN",
    ),
    Preset(
        "grounding-dino-base",
        "IDEA-Research/grounding-dino-base",
        "Apache-2.0",
        "--segmenter grounded-sam",
        "the paper's, and the default",
    ),
    Preset(
        "grounding-dino-tiny",
        "IDEA-Research/grounding-dino-tiny",
        "Apache-2.0",
        "--set search.grounding=IDEA-Research/grounding-dino-tiny",
    ),
    Preset(
        "llava-1.5-7b",
        "llava-hf/llava-1.5-7b-hf",
        "Llama 2 Community License",
        "--labeller llava, llava-alpha",
        "the paper's",
    ),
    Preset(
        "alpha-clip",
        "https://drive.usercontent.google.com/download"
        "?id=1dUq1deeLcou26RuxZbBG57m2ALPWev6-&export=download&confirm=t",
        "research only (CC BY-NC 4.0 data)",
        "--labeller llava-alpha:FILE",
        "clip_l14_336_grit_20m_4xe.pth; no checksum is published, the one found is kept",
    ),
    *(
        Preset(
            f"dinov2-{size}",
            f"facebook/dinov2-{size}",
            "Apache-2.0",
            f"--detector dinov2:facebook/dinov2-{size}",
            "the default" if size == "base" else "",
        )
        for size in ("small", "base", "large")
    ),
    Preset("loftr", "zju-community/efficientloftr", "Apache-2.0", "--aligner loftr"),
    Preset(
        "c3po-changesim",
        _C3PO.format("iade_4_deeplabv3_ChangeSim_Binary"),
        "MIT",
        "--detector c3po:FILE",
        "indoor robots, rendered; the file holds its optimizer too",
        "6bd8381da4d2f0076ee8e7dd4dbeb477378580d3540f80395a0106ce7da1beca",
    ),
    Preset(
        "c3po-vl-cmu-cd",
        _C3PO.format("id_4_deeplabv3_VL_CMU_CD"),
        "MIT",
        "--detector c3po:FILE",
        "streets; knows only what disappears from the picture that it sees first",
    ),
    *(
        Preset(
            f"rscd-dinov2-{data.lower()}",
            f"{_RSCD}dinov2.2CrossAttn.{data}.pth",
            "MIT",
            "reviewer checkpoint FILE --backbone-weights, then --detector rscd-dinov2:NEW",
            "streets; a head without its backbone, which is dinov2-vits14",
        )
        for data in ("CMU", "Diff-CMU", "PSCD")
    ),
    Preset(
        "dinov2-vits14",
        "https://dl.fbaipublicfiles.com/dinov2/dinov2_vits14/dinov2_vits14_pretrain.pth",
        "Apache-2.0",
        "--backbone-weights of reviewer checkpoint, for rscd-dinov2",
    ),
    *(
        Preset(
            f"rscd-resnet18-{data.lower()}",
            f"{_RSCD}resnet18.2CrossAttn.{data}.pth",
            "MIT",
            "--detector rscd-resnet18:FILE",
            "streets",
        )
        for data in ("CMU", "PSCD")
    ),
    *(
        Preset(
            f"rscd-baseline-{net}-{data.lower()}",
            f"{_RSCD}baseline.{net.replace('-', '')}.{data}.pth",
            "MIT",
            f"--detector {net}:FILE",
            "streets; what RSCD is compared with",
        )
        for net, data in (
            ("c3po", "Diff-CMU"),
            ("c3po", "PSCD"),
            ("dr-tanet", "CMU"),
            ("dr-tanet", "Diff-CMU"),
            ("dr-tanet", "PSCD"),
            ("cdnet", "CMU"),
            ("cdnet", "Diff-CMU"),
        )
    ),
)


def preset_of_name(name: str) -> Preset:
    """Return a preset, or one made of a hub id.

    Raises:
        InvalidInput: when the name is neither.
    """
    found = next((preset for preset in PRESETS if preset.name == name), None)
    if found is not None:
        return found
    parts = name.split("/")
    if len(parts) == 2 and all(parts):
        return Preset(name, name, "see its page", "")
    known = ", ".join(preset.name for preset in PRESETS)
    raise InvalidInput(
        f"model {name!r}: is no hub id (OWNER/NAME) and no preset; there are {known}"
    )
