"""C-3PO and RSCD written a second time, as functions of a state dict, for nothing but comparing.

Every step stands where the public code has it (DoctorKey/C-3PO with torchvision's DeepLabHead,
ChadLin9596/Robust-Scene-Change-Detection on facebookresearch/dinov2), slow and plain.
"""

import math

import torch
from torch.nn import functional


def c3po(state, pictures, *, merging):
    """Return logits (N, 2, H, W) of resnet18_mtf_msf_deeplabv3 with four fused stages."""
    t0, t1 = (_resnet(state, "backbone.encoder.layers", x) for x in pictures.split(3, dim=1))
    fusion = "backbone.combinefeature"

    def conv(name, x, **how):
        return functional.conv2d(x, state[f"{name}.weight"], state.get(f"{name}.bias"), **how)

    def merge(name, f0, f1):
        info = conv(f"{name}.conv", f0 + f1, padding=1)
        disappear = conv(f"{name}.res", (f0 - f1).relu(), padding=1)
        appear = conv(f"{name}.res", (f1 - f0).relu(), padding=1)
        exchange = conv(f"{name}.exchange", torch.max(f0, f1) - torch.min(f0, f1), padding=1)
        whole = {"id": info + 2 * disappear, "iade": info + disappear + appear + exchange}
        return whole[merging].relu()

    # The four stages; the stem (t0[0], t1[0]) is not fused.
    merged = [merge(f"{fusion}.cfs.{i}", t0[i + 1], t1[i + 1]) for i in range(4)]
    last, found = None, []
    for i in (3, 2, 1, 0):
        inner = conv(f"{fusion}.cf_inners.{i}.0", merged[i]).relu()
        if last is not None:
            inner = inner + functional.interpolate(last, size=inner.shape[-2:], mode="nearest")
        last = inner
        layer = conv(f"{fusion}.cf_layers.{i}.0", last, padding=1).relu()
        found.append(_bilinear(layer, merged[0].shape[-2:]))
    x = conv(f"{fusion}.reduce", torch.cat(found, dim=1), padding=1)
    x = _norm(state, f"{fusion}.bn", x).relu()

    head = "classifier.0"
    branches = [conv(f"{head}.convs.0.0", x)]
    for k, rate in ((1, 12), (2, 24), (3, 36)):
        branches.append(conv(f"{head}.convs.{k}.0", x, padding=rate, dilation=rate))
    branches = [_norm(state, f"{head}.convs.{k}.1", y).relu() for k, y in enumerate(branches)]
    pooled = conv(f"{head}.convs.4.1", x.mean(dim=(2, 3), keepdim=True))
    pooled = _norm(state, f"{head}.convs.4.2", pooled).relu()
    joined = torch.cat([*branches, pooled.expand_as(branches[0])], dim=1)
    x = _norm(state, f"{head}.project.1", conv(f"{head}.project.0", joined)).relu()
    x = _norm(state, "classifier.2", conv("classifier.1", x, padding=1)).relu()
    return _bilinear(conv("classifier.4", x), pictures.shape[-2:])


def rscd_dinov2(state, pictures, *, heads, depth, side, attention_blocks, attention_heads):
    """Return logits (N, 2, H, W) of "dino2 + cross_attention" on the queries of the last block."""
    x, y = (dinov2_queries(state, p, heads, depth, side) for p in pictures.split(3, dim=1))
    for block in range(attention_blocks):
        x, y = _two_cross_attention(state, f"ca0s.{block}", x, y, attention_heads)
    return _rscd_decoder(state, x, y, pictures.shape[-2:])


def rscd_resnet18(state, pictures, *, stage, attention_heads):
    """Return logits (N, 2, H, W) of "resnet18 + cross_attention"."""
    x, y = (_resnet(state, "backbone.layers", p)[stage] for p in pictures.split(3, dim=1))
    x, y = _two_cross_attention(state, "ca", x, y, attention_heads)
    return _rscd_decoder(state, x, y, pictures.shape[-2:])


def dinov2_queries(state, image, heads, depth, side, prefix="backbone."):
    """Return the unit queries (N, C, rows, columns) that the public hook takes of block `depth`."""
    own = {k.removeprefix(prefix): v for k, v in state.items() if k.startswith(prefix)}

    def linear(name, x):
        return x @ own[f"{name}.weight"].T + own[f"{name}.bias"]

    def norm(name, x):
        centred = x - x.mean(-1, keepdim=True)
        scaled = centred / (centred.square().mean(-1, keepdim=True) + 1e-6).sqrt()
        return scaled * own[f"{name}.weight"] + own[f"{name}.bias"]

    grid = functional.conv2d(
        image, own["patch_embed.proj.weight"], own["patch_embed.proj.bias"], stride=14
    )
    n, hidden, rows, columns = grid.shape
    positions = own["pos_embed"]
    if (rows, columns) != (side, side):
        patches = positions[:, 1:].reshape(1, side, side, hidden).permute(0, 3, 1, 2)
        factor = ((rows + 0.1) / side, (columns + 0.1) / side)
        patches = functional.interpolate(patches, scale_factor=factor, mode="bicubic")
        patches = patches.permute(0, 2, 3, 1).reshape(1, rows * columns, hidden)
        positions = torch.cat([positions[:, :1], patches], dim=1)
    x = torch.cat([own["cls_token"].expand(n, 1, hidden), grid.flatten(2).mT], dim=1) + positions
    for k in range(depth):
        q, k_, v = linear(f"blocks.{k}.attn.qkv", norm(f"blocks.{k}.norm1", x)).split(hidden, -1)
        if k == depth - 1:
            q = q[:, 1:]
            return (q / q.norm(dim=-1, keepdim=True)).mT.reshape(n, hidden, rows, columns)
        mixed = _attend(q, k_, v, heads)
        x = x + linear(f"blocks.{k}.attn.proj", mixed) * own[f"blocks.{k}.ls1.gamma"]
        y = linear(f"blocks.{k}.mlp.fc1", norm(f"blocks.{k}.norm2", x))
        y = 0.5 * y * (1 + torch.erf(y / math.sqrt(2)))
        x = x + linear(f"blocks.{k}.mlp.fc2", y) * own[f"blocks.{k}.ls2.gamma"]
    return x


def _attend(q, k, v, heads):
    """Return softmax(q k / sqrt d) v, head by head."""
    answers = []
    for a, b, c in zip(q.chunk(heads, -1), k.chunk(heads, -1), v.chunk(heads, -1), strict=True):
        shares = (a @ b.mT / math.sqrt(a.shape[-1])).softmax(-1)
        answers.append(shares @ c)
    return torch.cat(answers, -1)


def _two_cross_attention(state, name, x_map, y_map, heads):
    """`x, y = ca(x, y, y, y, x, x)`, where `ca(Q1, K1, V1, Q2, K2, V2)` asks block 1 about K2, V2
    and block 2 about K1, V1."""
    x, y = (m.flatten(2).mT for m in (x_map, y_map))

    def ca(q1, k1, v1, q2, k2, v2):
        return block("cross_att_1", q1, k2, v2), block("cross_att_2", q2, k1, v1)

    def block(own, q, k, v):
        own = f"{name}.{own}"
        attention = f"{own}.multi_head_self_attention"
        weights = state[f"{attention}.in_proj_weight"].chunk(3)
        biases = state[f"{attention}.in_proj_bias"].chunk(3)
        projected = [t @ w.T + b for t, w, b in zip((q, k, v), weights, biases, strict=True)]
        answer = linear(f"{attention}.out_proj", _attend(*projected, heads))
        z = norm(f"{own}.layer_norm1", answer + q)
        inner = linear(f"{own}.feed_forward.0", z).relu()
        return norm(f"{own}.layer_norm2", z + linear(f"{own}.feed_forward.3", inner))

    def linear(key, z):
        return z @ state[f"{key}.weight"].T + state[f"{key}.bias"]

    def norm(key, z):
        centred = z - z.mean(-1, keepdim=True)
        scaled = centred / (centred.square().mean(-1, keepdim=True) + 1e-5).sqrt()
        return scaled * state[f"{key}.weight"] + state[f"{key}.bias"]

    x, y = ca(x, y, y, y, x, x)
    return x.mT.reshape(x_map.shape), y.mT.reshape(y_map.shape)


def _rscd_decoder(state, x, y, size):
    z = torch.cat([x, y], dim=1)
    z = functional.conv2d(z, state["conv1.weight"], state["conv1.bias"], padding=1).relu()
    z = functional.conv2d(z, state["conv2.weight"], state["conv2.bias"]).relu()
    return _bilinear(z, size)


def _resnet(state, name, x):
    """Return the features of the stem and of the four stages of torchvision's ResNet-18."""

    def conv(key, x, stride=1):
        weight = state[f"{key}.weight"]
        return functional.conv2d(x, weight, stride=stride, padding=weight.shape[-1] // 2)

    def block(key, x, stride):
        y = _norm(state, f"{key}.bn1", conv(f"{key}.conv1", x, stride)).relu()
        y = _norm(state, f"{key}.bn2", conv(f"{key}.conv2", y))
        if f"{key}.downsample.0.weight" in state:
            x = _norm(state, f"{key}.downsample.1", conv(f"{key}.downsample.0", x, stride))
        return (x + y).relu()

    x = _norm(state, f"{name}.0.1", conv(f"{name}.0.0", x, 2)).relu()
    found = [functional.max_pool2d(x, 3, 2, 1)]
    for stage in (1, 2, 3, 4):
        x = block(f"{name}.{stage}.0", found[-1], 1 if stage == 1 else 2)
        found.append(block(f"{name}.{stage}.1", x, 1))
    return found


def _bilinear(x, size):
    return functional.interpolate(x, size, mode="bilinear", align_corners=False)


def _norm(state, name, x):
    mean, variance, weight, bias = (
        state[f"{name}.{part}"][:, None, None]
        for part in ("running_mean", "running_var", "weight", "bias")
    )
    return (x - mean) / (variance + 1e-5).sqrt() * weight + bias
