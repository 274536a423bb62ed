"""Change detectors: the difference of colours, and the learned nets."""
