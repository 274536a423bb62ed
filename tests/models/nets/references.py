"""The public nets written a second time, as functions of a state dict, for nothing but comparing.

Every step stands where the public code has it (kensakurada/sscdnet, Herrccc/DR-TANet), slow and
plain: whole windows are unfolded, correlation is a loop over displacements.
"""

import torch
from torch.nn import functional


def cscdnet(state, pictures, *, correlation, damp=lambda level, features, image: features):
    """Return logits (N, 2, H, W); `damp` may change the features f1 .. f6 of an encoder's image."""

    def conv(name, x, stride=1):
        weight = state[f"{name}.weight"]
        return functional.conv2d(
            x, weight, state.get(f"{name}.bias"), stride, padding=weight.shape[-1] // 2
        )

    def norm(name, x):
        return _norm(state, name, x)

    def up(x):
        return functional.interpolate(x, scale_factor=2, mode="bilinear", align_corners=True)

    def block(name, x, stride=1, larger=False, skip1=(), skip2=()):
        y = norm(f"{name}.bn1", conv(f"{name}.conv1", torch.cat([x, *skip1], 1), stride)).relu()
        y = conv(f"{name}.conv2", torch.cat([y, *skip2], 1))
        y = norm(f"{name}.bn2", up(y) if larger else y)
        if f"{name}.downsample.0.weight" in state:
            x = conv(f"{name}.downsample.0", x, stride)
            x = norm(f"{name}.downsample.2", up(x)) if larger else norm(f"{name}.downsample.1", x)
        return (x + y).relu()

    def encode(name, image):
        levels = [norm(f"{name}_bn1", conv(f"{name}_conv1", image, 2)).relu()]
        x = functional.max_pool2d(levels[0], 3, 2, 1)
        for stage in (1, 2, 3, 4):
            x = block(f"{name}_res{stage}_1", x, 1 if stage == 1 else 2)
            x = damp(stage + 1, block(f"{name}_res{stage}_2", x), image)
            levels.append(x)
        x = norm(f"{name}_bn5", conv(f"{name}_conv5", x, 2)).relu()
        return [*levels, norm(f"{name}_bn6", conv(f"{name}_conv6", x)).relu()]

    def compared(a, b):
        return [a, b, functional.leaky_relu(_correlation(a, b), 0.1)] if correlation else [a, b]

    a, b = encode("enc1", pictures[:, :3]), encode("enc2", pictures[:, 3:])
    x = norm("dec_bn6", conv("dec_conv6", torch.cat([a[5], b[5]], 1))).relu()
    x = norm("dec_bn5", up(conv("dec_conv5", x))).relu()
    x = block("dec_res4_1", block("dec_res4_2", x, skip2=[a[4], b[4]]), larger=True)
    x = block("dec_res3_1", block("dec_res3_2", x, skip2=[a[3], b[3]]), larger=True)
    x = block("dec_res2_1", block("dec_res2_2", x, skip1=compared(a[2], b[2])), larger=True)
    x = block("dec_res1_1", block("dec_res1_2", x, skip2=[a[1], b[1]]))
    x = conv("dec_conv1", torch.cat([up(x), *compared(a[0], b[0])], 1))
    return conv("classifier", norm("dec_bn1", up(x)).relu())


def _correlation(a, b):
    _, _, h, w = a.shape
    padded = functional.pad(b, (20, 20, 20, 20))
    steps = range(0, 41, 2)
    return torch.stack(
        [(a * padded[..., dy : dy + h, dx : dx + w]).mean(1) for dy in steps for dx in steps], 1
    )


def tanet(state, pictures, *, sides, refinement, groups=4):
    """Return logits (N, 2, H, W) of TANet or DR-TANet with windows of these sides."""

    def conv(name, x, stride=1):
        weight = state[f"{name}.weight"]
        return functional.conv2d(
            x, weight, state.get(f"{name}.bias"), stride, padding=weight.shape[-1] // 2
        )

    def norm(name, x):
        return _norm(state, name, x)

    def block(name, x, stride):
        y = norm(f"{name}.bn1", conv(f"{name}.conv1", x, stride)).relu()
        y = norm(f"{name}.bn2", conv(f"{name}.conv2", y))
        if f"{name}.downsample.0.weight" in state:
            x = norm(f"{name}.downsample.1", conv(f"{name}.downsample.0", x, stride))
        # In the public code this ReLU works in place on the tensor that is handed on.
        return (x + y).relu()

    def encode(name, image):
        x = norm(f"{name}.bn1", conv(f"{name}.conv1", image, 2)).relu()
        x = functional.max_pool2d(x, 3, 2, 1)
        levels = []
        for stage in (1, 2, 3, 4):
            x = block(f"{name}.layer{stage}.0", x, 1 if stage == 1 else 2)
            x = block(f"{name}.layer{stage}.1", x, 1)
            levels.append(x)
        return levels

    def resized(x, size):
        return functional.interpolate(x, size, mode="bilinear", align_corners=False)

    def enlarged(x):
        return resized(x, [2 * side for side in x.shape[-2:]])

    def up_step(name, x, skip):
        skip = conv(f"{name}.bottleneck.conv", norm(f"{name}.bottleneck.norm", skip).relu())
        x = resized(x, skip.shape[-2:]) + skip
        return conv(f"{name}.blend_conv.conv", norm(f"{name}.blend_conv.norm", x).relu())

    past, present = encode("encoder1", pictures[:, :3]), encode("encoder2", pictures[:, 3:])
    module = "attention_module"
    answers = []
    for stage, levels in enumerate(zip(past, present, strict=True)):
        prefix = f"{module}.attention_layer{stage + 1}."
        own = {k.removeprefix(prefix): v for k, v in state.items() if k.startswith(prefix)}
        answers.append(attention(own, *levels, sides[stage], groups, refinement))
    x = answers[0]
    for stage in (1, 2, 3):
        x = torch.cat([conv(f"{module}.downsample{stage}", x, 2), answers[stage]], 1)
    for step, skip in enumerate(reversed(answers), start=1):
        x = up_step(f"decoder.upsample{step}", x, skip)
    x = enlarged(norm("bn", enlarged(x))).relu()
    return conv("classifier", x)


def attention(weights, past, present, side, groups, refinement):
    """Return temporal attention (N, C, H, W) with the whole window unfolded."""
    n, c, h, w = past.shape
    q, k, v = (
        functional.conv2d(x, weights[f"{name}.weight"])
        for name, x in (("w_q", present), ("w_k", past), ("w_v", past))
    )

    def window(x, up, left):
        padded = functional.pad(x, (left, left, up, up))
        return padded.unfold(2, 2 * up + 1, 1).unfold(3, 2 * left + 1, 1)

    def attend(keys, values):
        keys = keys.reshape(n, groups, c // groups, h, w, -1)
        values = values.reshape(n, groups, c // groups, h, w, -1)
        shares = (q.view(n, groups, c // groups, h, w, 1) * keys).sum(2).softmax(-1)
        return (shares[:, :, None] * values).sum(-1).reshape(n, c, h, w)

    upper, lower = window(k, side // 2, side // 2).chunk(2, dim=1)
    keys = torch.cat([upper + weights["rel_h"], lower + weights["rel_w"]], dim=1)
    answer = attend(keys, window(v, side // 2, side // 2))
    if refinement:
        answer = answer + attend(window(k, 0, side), window(v, 0, side))
        answer = answer + attend(window(k, side, 0), window(v, side, 0))
    return answer


def _norm(state, name, x):
    return functional.batch_norm(
        x,
        state[f"{name}.running_mean"],
        state[f"{name}.running_var"],
        state[f"{name}.weight"],
        state[f"{name}.bias"],
    )
