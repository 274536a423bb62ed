"""DINOv2's vision transformer up to the queries of its last block, for nets built on it.

Parameter names and arithmetic are those of the public code (facebookresearch/dinov2, ViT-S/14 and
ViT-B/14 without registers), so its files load without translation; what lies behind the queries is
left out. Position embeddings are interpolated as there, with an offset of 0.1 patches, which
`transformers` does not do.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

PATCH = 14
OFFSET = 0.1
SMOOTHING = 1e-6
"""LayerNorm's epsilon."""


class QueryEncoder(nn.Module):
    """A picture to one unit vector per patch: the queries of the last block."""

    def __init__(self, hidden: int, heads: int, depth: int, side: int = 37) -> None:
        """Build it with random weights.

        Args:
            hidden, heads, depth: of the transformer.
            side: patches along a side of the pictures that it was trained on.
        """
        super().__init__()
        self.side = side
        self.cls_token = nn.Parameter(torch.zeros(1, 1, hidden))
        self.pos_embed = nn.Parameter(torch.zeros(1, 1 + side * side, hidden))
        nn.init.trunc_normal_(self.pos_embed, std=0.02)
        self.patch_embed = nn.ModuleDict({"proj": nn.Conv2d(3, hidden, PATCH, stride=PATCH)})
        self.blocks = nn.ModuleList(
            [*(_Block(hidden, heads) for _ in range(depth - 1)), _Queries(hidden)]
        )

    def forward(self, image: Tensor) -> Tensor:
        """Return unit queries (N, hidden, H / 14, W / 14) of images (N, 3, H, W)."""
        grid: Tensor = self.patch_embed["proj"](image)
        rows, columns = grid.shape[-2:]
        patches = grid.flatten(2).transpose(1, 2)
        tokens = torch.cat([self.cls_token.expand(len(patches), -1, -1), patches], 1)
        tokens = tokens + self._positions(rows, columns)
        for block in self.blocks:
            tokens = block(tokens)
        queries = functional.normalize(tokens[:, 1:], dim=-1)
        return queries.transpose(1, 2).reshape(len(queries), -1, rows, columns)

    def _positions(self, rows: int, columns: int) -> Tensor:
        if rows == columns == self.side:
            return self.pos_embed
        first, others = self.pos_embed[:, :1], self.pos_embed[:, 1:]
        square = others.reshape(1, self.side, self.side, -1).permute(0, 3, 1, 2).float()
        scale = ((rows + OFFSET) / self.side, (columns + OFFSET) / self.side)
        fitted = functional.interpolate(square, scale_factor=scale, mode="bicubic")
        return torch.cat([first, fitted.flatten(2).transpose(1, 2)], 1)


class _Attention(nn.Module):
    def __init__(self, hidden: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.qkv = nn.Linear(hidden, 3 * hidden)
        self.proj = nn.Linear(hidden, hidden)

    def forward(self, x: Tensor) -> Tensor:
        n, tokens, hidden = x.shape
        qkv = self.qkv(x).view(n, tokens, 3, self.heads, hidden // self.heads)
        q, k, v = qkv.permute(2, 0, 3, 1, 4)
        mixed = functional.scaled_dot_product_attention(q, k, v)
        answer: Tensor = self.proj(mixed.transpose(1, 2).reshape(n, tokens, hidden))
        return answer


class _Scale(nn.Module):
    def __init__(self, hidden: int) -> None:
        super().__init__()
        self.gamma = nn.Parameter(torch.ones(hidden))

    def forward(self, x: Tensor) -> Tensor:
        return x * self.gamma


class _Mlp(nn.Module):
    def __init__(self, hidden: int) -> None:
        super().__init__()
        self.fc1 = nn.Linear(hidden, 4 * hidden)
        self.fc2 = nn.Linear(4 * hidden, hidden)

    def forward(self, x: Tensor) -> Tensor:
        y: Tensor = self.fc2(functional.gelu(self.fc1(x)))
        return y


class _Block(nn.Module):
    def __init__(self, hidden: int, heads: int) -> None:
        super().__init__()
        self.norm1 = nn.LayerNorm(hidden, eps=SMOOTHING)
        self.attn = _Attention(hidden, heads)
        self.ls1 = _Scale(hidden)
        self.norm2 = nn.LayerNorm(hidden, eps=SMOOTHING)
        self.mlp = _Mlp(hidden)
        self.ls2 = _Scale(hidden)

    def forward(self, x: Tensor) -> Tensor:
        x = x + self.ls1(self.attn(self.norm1(x)))
        y: Tensor = x + self.ls2(self.mlp(self.norm2(x)))
        return y


class _Queries(nn.Module):
    """The last block, as far as its queries."""

    def __init__(self, hidden: int) -> None:
        super().__init__()
        self.norm1 = nn.LayerNorm(hidden, eps=SMOOTHING)
        self.attn = nn.ModuleDict({"qkv": nn.Linear(hidden, 3 * hidden)})

    def forward(self, x: Tensor) -> Tensor:
        queries: Tensor = self.attn["qkv"](self.norm1(x)).chunk(3, dim=-1)[0]
        return queries
