"""Aligners: where each live pixel lies in the reference.

`planes` (one homography: from features, or by ECC), `dense` (DIS flow), `matches` (EfficientLoFTR).
"""
