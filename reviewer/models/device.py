"""The device of this machine, and fingerprints of weights."""

from __future__ import annotations

import hashlib
from pathlib import Path

import torch
from torch import nn

from reviewer.errors import InvalidInput
from reviewer.words import Precision


def best_device() -> str:
    """Return "cuda" where there is a GPU, else "cpu"."""
    return "cuda" if torch.cuda.is_available() else "cpu"


def has_bfloat16() -> bool:
    """Say whether this processor multiplies bfloat16 in hardware (AVX512-BF16 or AMX)."""
    able = torch.cpu.get_capabilities()
    return bool(able.get("avx512_bf16") or able.get("amx_bf16"))


def bfloat16_pays(device: str) -> bool:
    """Say whether bfloat16 is faster than float32 on a device."""
    return torch.cuda.is_bf16_supported() if device == "cuda" else has_bfloat16()


def choose_precision(wanted: Precision, device: str) -> Precision:
    """Return the precision that "auto" means on a device; any other value unchanged."""
    if wanted != "auto":
        return wanted
    return "bfloat16" if bfloat16_pays(device) else "float32"


def fingerprint(module: nn.Module) -> str:
    """Return 12 hexadecimal digits that stand for all weights of a module."""
    digest = hashlib.blake2b(digest_size=6)
    for name, tensor in sorted(module.state_dict().items()):
        digest.update(name.encode())
        digest.update(tensor.contiguous().view(-1).view(torch.uint8).cpu().numpy())
    return digest.hexdigest()


def sampled_fingerprint(module: nn.Module) -> str:
    """Return 12 hexadecimal digits from up to 4096 values of every weight: for billions of them.

    Any training moves every tensor it trains, so two checkpoints that differ differ here too.
    """
    digest = hashlib.blake2b(digest_size=6)
    for name, tensor in sorted(module.state_dict().items()):
        flat = tensor.detach().reshape(-1)
        sample = flat[:: max(1, flat.numel() // 4096)].contiguous()
        digest.update(f"{name}{tuple(tensor.shape)}".encode())
        digest.update(sample.view(torch.uint8).cpu().numpy())
    return digest.hexdigest()


def free_memory() -> int | None:
    """Return the bytes available for weights on the device; None where unknown."""
    if best_device() == "cuda":
        return int(torch.cuda.mem_get_info()[0])
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
    except OSError:
        return None
    found = next((line for line in lines if line.startswith("MemAvailable:")), None)
    return int(found.split()[1]) * 1024 if found else None


def check_weights(checkpoint: str, module: nn.Module, recorded: str) -> str:
    """Return the fingerprint of a module that was loaded from `checkpoint`.

    Raises:
        InvalidInput: when a run began with others; `recorded` is their fingerprint, or "".
    """
    return check_recorded(checkpoint, fingerprint(module), recorded)


def check_recorded(what: str, found: str, recorded: str) -> str:
    """Return the fingerprints found.

    Raises:
        InvalidInput: when a run began with others; `recorded` is theirs, or "".
    """
    if recorded not in ("", found):
        raise InvalidInput(
            f"{what}: holds other weights ({found}) than this run began with ({recorded});"
            " give the new ones a run of their own with --name"
        )
    return found
