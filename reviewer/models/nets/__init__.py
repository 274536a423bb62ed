"""Change detection nets as torch modules: two pictures in, two logits per pixel out.

Every net takes float32 (N, 6, H, W), reference then live, and returns (N, 2, H, W); it has the
attribute `multiple`, which H and W must be multiples of. Parameter names are those of the public
checkpoints, so these load without translation.
"""
