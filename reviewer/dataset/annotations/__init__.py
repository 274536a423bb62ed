"""Masks from other annotation tools, one module per tool: COCO, labelme, CVAT, Label Studio."""
