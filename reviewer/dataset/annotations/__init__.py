"""Masks as other annotation tools keep them, one file a tool: COCO, labelme, CVAT, Label Studio."""
