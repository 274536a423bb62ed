"""Weights: where they come from, and the names they are known by."""
