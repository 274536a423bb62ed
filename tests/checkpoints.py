"""Tiny random checkpoints, written as `save_pretrained` writes the real ones."""

from pathlib import Path

import torch
from transformers import (
    EfficientLoFTRConfig,
    EfficientLoFTRForKeypointMatching,
    Sam2Config,
    Sam2HieraDetConfig,
    Sam2MaskDecoderConfig,
    Sam2Model,
    Sam2PromptEncoderConfig,
    Sam2VisionConfig,
    SamConfig,
    SamMaskDecoderConfig,
    SamModel,
    SamPromptEncoderConfig,
    SamVisionConfig,
)

SIDE = 64
DECODER = {"hidden_size": 16, "mlp_dim": 16, "num_attention_heads": 2, "iou_head_hidden_dim": 16}
PROMPTS = {"hidden_size": 16, "image_size": SIDE, "patch_size": 16, "mask_input_channels": 4}


def write_sam(folder: Path, seed: int = 1) -> Path:
    """Write a SAM of 64x64 pixels."""
    vision = SamVisionConfig(
        hidden_size=16,
        num_hidden_layers=2,
        num_attention_heads=2,
        image_size=SIDE,
        patch_size=16,
        output_channels=16,
        window_size=2,
        global_attn_indexes=[1],
        num_pos_feats=8,
        mlp_ratio=2.0,
        initializer_range=0.02,
    )
    config = SamConfig(
        vision_config=vision,
        prompt_encoder_config=SamPromptEncoderConfig(**PROMPTS),
        mask_decoder_config=SamMaskDecoderConfig(**DECODER),
    )
    return _save(SamModel(config), folder, seed)


def write_sam2(folder: Path, seed: int = 1) -> Path:
    """Write a SAM 2 of 64x64 pixels."""
    backbone = Sam2HieraDetConfig(
        hidden_size=8,
        image_size=[SIDE, SIDE],
        blocks_per_stage=[1, 1, 2, 1],
        embed_dim_per_stage=[8, 16, 32, 64],
        num_attention_heads_per_stage=[1, 1, 1, 1],
        window_size_per_stage=[4, 2, 2, 1],
        global_attention_blocks=[3],
        window_positional_embedding_background_size=[4, 4],
    )
    vision = Sam2VisionConfig(
        backbone_config=backbone,
        backbone_channel_list=[64, 32, 16, 8],
        backbone_feature_sizes=[[16, 16], [8, 8], [4, 4]],
        fpn_hidden_size=16,
    )
    config = Sam2Config(
        vision_config=vision,
        prompt_encoder_config=Sam2PromptEncoderConfig(**PROMPTS),
        mask_decoder_config=Sam2MaskDecoderConfig(**DECODER),
    )
    return _save(Sam2Model(config), folder, seed)


def write_loftr(folder: Path, seed: int = 1) -> Path:
    """Write an EfficientLoFTR with few channels and layers."""
    config = EfficientLoFTRConfig(
        stage_num_blocks=[1, 1, 1, 1],
        out_features=[16, 16, 16, 32],
        hidden_size=32,
        num_attention_layers=1,
        num_attention_heads=8,
        initializer_range=0.02,
        coarse_matching_threshold=0.0,  # random weights are never sure
    )
    torch.manual_seed(seed)
    EfficientLoFTRForKeypointMatching(config).save_pretrained(folder)
    return folder


def _save(model, folder: Path, seed: int) -> Path:
    """Fill in weights large enough for prompts to matter, and write them."""
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for parameter in model.parameters():
            if parameter.ndim > 1:
                parameter.copy_(torch.randn(parameter.shape, generator=generator) * 0.3)
    model.save_pretrained(folder)
    return folder
