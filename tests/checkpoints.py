"""Tiny random checkpoints, written as `save_pretrained` writes the real ones."""

from pathlib import Path

import torch
from tokenizers import Tokenizer, decoders, models, pre_tokenizers, processors
from torch import nn
from transformers import (
    BertConfig,
    BertTokenizer,
    CLIPTextConfig,
    CLIPTokenizer,
    CLIPVisionConfig,
    Dinov2Config,
    Dinov2Model,
    Dinov2WithRegistersConfig,
    Dinov2WithRegistersModel,
    EfficientLoFTRConfig,
    EfficientLoFTRForKeypointMatching,
    GroundingDinoConfig,
    GroundingDinoForObjectDetection,
    GroundingDinoImageProcessorPil,
    GroundingDinoProcessor,
    LlamaConfig,
    LlavaConfig,
    LlavaForConditionalGeneration,
    PreTrainedTokenizerFast,
    Sam2Config,
    Sam2HieraDetConfig,
    Sam2MaskDecoderConfig,
    Sam2Model,
    Sam2PromptEncoderConfig,
    Sam2VisionConfig,
    Sam3Config,
    Sam3DETRDecoderConfig,
    Sam3DETREncoderConfig,
    Sam3GeometryEncoderConfig,
    Sam3MaskDecoderConfig,
    Sam3Model,
    Sam3VisionConfig,
    Sam3ViTConfig,
    SamConfig,
    SamMaskDecoderConfig,
    SamModel,
    SamPromptEncoderConfig,
    SamVisionConfig,
    SwinConfig,
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


def write_dinov2(folder: Path, seed: int = 1, registers: int = 0) -> Path:
    """Write a DINOv2 of four blocks for pictures of 56x56 pixels."""
    size = {
        "hidden_size": 32,
        "num_hidden_layers": 4,
        "num_attention_heads": 2,
        "mlp_ratio": 2,
        "image_size": 56,
        "patch_size": 14,
    }
    if registers:
        config = Dinov2WithRegistersConfig(**size, num_register_tokens=registers)
        return _save(Dinov2WithRegistersModel(config), folder, seed)
    return _save(Dinov2Model(Dinov2Config(**size)), folder, seed)


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


def write_grounding_dino(folder: Path, seed: int = 1) -> Path:
    """Write a Grounding DINO of few queries with its processor."""
    torch.manual_seed(seed)
    backbone = SwinConfig(
        image_size=64,
        patch_size=4,
        embed_dim=8,
        depths=[1, 1, 1, 1],
        num_heads=[1, 1, 2, 2],
        window_size=2,
        out_indices=[2, 3, 4],
    )
    words = BertConfig(
        vocab_size=1100,
        hidden_size=16,
        num_hidden_layers=1,
        num_attention_heads=2,
        intermediate_size=16,
        max_position_embeddings=512,
    )
    config = GroundingDinoConfig(
        backbone_config=backbone,
        text_config=words,
        num_queries=10,
        d_model=32,
        encoder_layers=1,
        decoder_layers=2,
        encoder_attention_heads=4,
        decoder_attention_heads=4,
        encoder_ffn_dim=16,
        decoder_ffn_dim=16,
        encoder_n_points=2,
        decoder_n_points=2,
    )
    GroundingDinoForObjectDetection(config).save_pretrained(folder)
    tokenizer = BertTokenizer(vocab=_word_pieces(), do_lower_case=True, model_max_length=512)
    pictures = GroundingDinoImageProcessorPil(size={"shortest_edge": 64, "longest_edge": 128})
    GroundingDinoProcessor(pictures, tokenizer).save_pretrained(folder)
    return folder


def _word_pieces() -> dict[str, int]:
    """1100 pieces, the special ones where BERT's are: the network knows them by number."""
    tokens = [f"[unused{k}]" for k in range(1100)]
    special = {0: "[PAD]", 100: "[UNK]", 101: "[CLS]", 102: "[SEP]", 103: "[MASK]", 1012: "."}
    for place, token in {**special, 1029: "?", 1010: ","}.items():
        tokens[place] = token
    for k, letter in enumerate("abcdefghijklmnopqrstuvwxyz0123456789"):
        tokens[200 + k], tokens[300 + k] = letter, f"##{letter}"
    tokens[336:339] = ["pen", "wallet", "cup"]
    return {token: place for place, token in enumerate(tokens)}


def write_llava(folder: Path, seed: int = 1) -> Path:
    """Write a LLaVA that sees 28x28 pixels and speaks bytes."""
    torch.manual_seed(seed)
    tokenizer = _bytes_tokenizer()
    vision = CLIPVisionConfig(
        hidden_size=32,
        intermediate_size=64,
        num_hidden_layers=3,
        num_attention_heads=4,
        image_size=28,
        patch_size=14,
        projection_dim=16,
    )
    language = LlamaConfig(
        vocab_size=len(tokenizer),
        hidden_size=32,
        intermediate_size=64,
        num_hidden_layers=2,
        num_attention_heads=4,
        num_key_value_heads=4,
        max_position_embeddings=512,
        initializer_range=0.5,  # else random words hardly depend on the picture
        bos_token_id=1,
        eos_token_id=2,
        pad_token_id=3,
    )
    config = LlavaConfig(
        vision_config=vision,
        text_config=language,
        image_token_index=tokenizer.convert_tokens_to_ids("<image>"),
        image_seq_length=4,
        vision_feature_layer=-2,
        vision_feature_select_strategy="default",
    )
    LlavaForConditionalGeneration(config).save_pretrained(folder)
    tokenizer.save_pretrained(folder)
    return folder


def _bytes_tokenizer() -> PreTrainedTokenizerFast:
    special = ["<unk>", "<s>", "</s>", "<pad>", "<image>"]
    letters = sorted(pre_tokenizers.ByteLevel.alphabet())
    vocabulary = {token: place for place, token in enumerate([*special, *letters])}
    tokenizer = Tokenizer(models.BPE(vocab=vocabulary, merges=[], unk_token="<unk>"))
    tokenizer.pre_tokenizer = pre_tokenizers.ByteLevel(add_prefix_space=False)
    tokenizer.decoder = decoders.ByteLevel()
    tokenizer.post_processor = processors.TemplateProcessing(
        single="<s> $A", special_tokens=[("<s>", 1)]
    )
    return PreTrainedTokenizerFast(
        tokenizer_object=tokenizer,
        unk_token="<unk>",
        bos_token="<s>",
        eos_token="</s>",
        pad_token="<pad>",
        extra_special_tokens={"image_token": "<image>"},
    )


def write_alpha_clip(path: Path, seed: int = 2, prefix: str = "", joined: str = "in_proj.") -> Path:
    """Write an Alpha-CLIP tower for `write_llava`, under the names its authors use."""
    generator = torch.Generator().manual_seed(seed)
    width, inner, patch, places = 32, 64, 14, 5

    def values(*shape: int) -> torch.Tensor:
        return torch.randn(shape, generator=generator) * 0.3

    state = {
        "class_embedding": values(width),
        "positional_embedding": values(places, width),
        "proj": values(width, 16),
        "conv1.weight": values(width, 3, patch, patch),
        "conv1_alpha.weight": values(width, 1, patch, patch),
    }
    for name in ("ln_pre", "ln_post"):
        state[f"{name}.weight"], state[f"{name}.bias"] = values(width), values(width)
    for layer in range(3):
        at = f"transformer.resblocks.{layer}"
        for name in ("ln_1", "ln_2"):
            state[f"{at}.{name}.weight"], state[f"{at}.{name}.bias"] = values(width), values(width)
        state[f"{at}.attn.{joined}weight"] = values(3 * width, width)
        state[f"{at}.attn.{joined}bias"] = values(3 * width)
        state[f"{at}.attn.out_proj.weight"] = values(width, width)
        state[f"{at}.attn.out_proj.bias"] = values(width)
        state[f"{at}.mlp.c_fc.weight"] = values(inner, width)
        state[f"{at}.mlp.c_fc.bias"] = values(inner)
        state[f"{at}.mlp.c_proj.weight"] = values(width, inner)
        state[f"{at}.mlp.c_proj.bias"] = values(width)
    torch.save({prefix + key: value for key, value in state.items()}, path)
    return path


def write_sam3(folder: Path, seed: int = 1) -> Path:
    """Write a SAM 3 of 112x112 pixels with its tokenizer."""
    torch.manual_seed(seed)
    letters = sorted(pre_tokenizers.ByteLevel.alphabet())
    ends = [*letters, *(f"{letter}</w>" for letter in letters), "<|startoftext|>", "<|endoftext|>"]
    vocabulary = {token: place for place, token in enumerate(ends)}
    tokenizer = CLIPTokenizer(vocab=vocabulary, merges=[], model_max_length=32)
    small = {"hidden_size": 32, "num_attention_heads": 2, "intermediate_size": 32, "num_layers": 1}
    backbone = Sam3ViTConfig(
        hidden_size=32,
        intermediate_size=32,
        num_hidden_layers=2,
        num_attention_heads=2,
        image_size=112,
        patch_size=14,
        window_size=4,
        global_attn_indexes=[1],
        pretrain_image_size=56,
    )
    words = CLIPTextConfig(
        vocab_size=len(tokenizer),
        hidden_size=32,
        intermediate_size=32,
        num_hidden_layers=1,
        num_attention_heads=2,
        max_position_embeddings=32,
        projection_dim=16,
        eos_token_id=tokenizer.eos_token_id,
        bos_token_id=tokenizer.bos_token_id,
        pad_token_id=tokenizer.pad_token_id,
    )
    config = Sam3Config(
        vision_config=Sam3VisionConfig(
            backbone_config=backbone,
            fpn_hidden_size=32,
            backbone_feature_sizes=[[32, 32], [16, 16], [8, 8]],
        ),
        text_config=words,
        geometry_encoder_config=Sam3GeometryEncoderConfig(**small),
        detr_encoder_config=Sam3DETREncoderConfig(**small),
        detr_decoder_config=Sam3DETRDecoderConfig(**small, num_queries=10),
        mask_decoder_config=Sam3MaskDecoderConfig(hidden_size=32, num_attention_heads=2),
    )
    Sam3Model(config).save_pretrained(folder)
    tokenizer.save_pretrained(folder)
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


def resnet18(channels=(64, 128, 256, 512), deep=False):
    """Weights in torchvision's and timm's naming."""
    state = {"conv1.weight": torch.randn(channels[0], 3, 7, 7), "fc.weight": torch.randn(10, 512)}
    state |= norm("bn1", channels[0])
    before = channels[0]
    for stage, number in enumerate(channels, start=1):
        for block in range(3 if deep else 2):
            name, first = f"layer{stage}.{block}", block == 0 and stage > 1
            state[f"{name}.conv1.weight"] = torch.randn(number, before if first else number, 3, 3)
            state[f"{name}.conv2.weight"] = torch.randn(number, number, 3, 3)
            state |= norm(f"{name}.bn1", number) | norm(f"{name}.bn2", number)
            if first:
                state[f"{name}.downsample.0.weight"] = torch.randn(number, before, 1, 1)
                state |= norm(f"{name}.downsample.1", number)
        before = number
    return state


def norm(name, number):
    return {f"{name}.{k}": v for k, v in nn.BatchNorm2d(number).state_dict().items()}
